#include "sl/ops/examples.h"

namespace kanuka::sl::ops {

namespace {

constexpr Example value(std::string_view of, std::string_view expression, float expected) {
    return {Example::Value, of, {}, expression, expected};
}
constexpr Example after(std::string_view of, std::string_view before, std::string_view expression,
                        float expected) {
    return {Example::Value, of, before, expression, expected};
}
constexpr Example surface(std::string_view of, std::string_view body) {
    return {Example::Surface, of, body, {}, 0};
}
constexpr Example source(std::string_view of, std::string_view text) {
    return {Example::Source, of, text, {}, 0};
}

constexpr std::string_view Layered = R"(class layered() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "base", LambertBrdf());
        AddLobe(b, "varnish", MicrofacetDielectricBrdf());
        AddLayer(b, "all", "coat", "varnish", "base");
    }
    public void mnk_prelighting(output MnkMaterialBoundary b) {
        SetLobe(b, "base", 1, LambertBrdf("diffuseReflectance", Cs));
        SetLayer(b, "all", u);
        SetPresence(b, v);
    }
})";
constexpr std::string_view Filled = R"(class filled() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "bsdf", MicrosurfaceDielectricBsdfRgb_v1());
        MnkMaterialInterior i = CreateInterior(m, "homogeneous", 1.5);
        AddPhaseFunction(i, "pf", HenyeyGreensteinPfrgb());
    }
    public void mnk_interior(output MnkMaterialInterior i) {
        SetPhaseFunction(i, "pf", HenyeyGreensteinPfrgb("meanCosine", color(0.5)));
        SetAbsorption(i, color(1, 2, 3));
        SetScattering(i, color(0.5));
        SetPriority(i, 2);
    }
})";

constexpr Example shadeops[] = {
    // mathematics
    value("radians", "radians(180)", 3.1415927f),
    value("degrees", "degrees(PI)", 180),
    value("sin", "sin(PI / 2)", 1),
    value("cos", "cos(0)", 1),
    value("tan", "tan(PI / 4)", 1),
    value("asin", "asin(1)", 1.5707963f),
    value("acos", "acos(-1)", 3.1415927f),
    value("atan", "atan(1, 1) + atan(1)", 1.5707963f),
    value("exp", "exp(1)", 2.7182818f),
    value("log", "log(8, 2)", 3),
    value("pow", "pow(2, 10)", 1024),
    value("sqrt", "comp(sqrt(color(4, 9, 16)), 1)", 3),
    value("inversesqrt", "inversesqrt(4)", 0.5f),
    value("mod", "mod(-1, 3)", 2),
    value("abs", "abs(-2)", 2),
    value("sign", "sign(-3)", -1),
    value("floor", "floor(-1.5)", -2),
    value("ceil", "ceil(1.2)", 2),
    value("round", "round(2.5)", 3),
    value("min", "min(3, 1, 2)", 1),
    value("max", "max(3, 1, 2)", 3),
    value("clamp", "clamp(5, 0, 2)", 2),
    value("mix", "mix(2, 4, 0.25)", 2.5f),
    value("step", "step(0.5, u)", 1),
    value("smoothstep", "smoothstep(0, 1, 0.25)", 0.15625f),
    value("linearstep", "linearstep(0, 4, 1)", 0.25f),
    value("filterstep", "filterstep(0.5, u)", 0.5f),
    value("spline", "spline(\"solvelinear\", 0.25, 0, 0, 1, 1)", 0.25f),
    // noise
    value("noise", "noise(3)", 0.5f),
    value("snoise", "snoise(point(1, 2, 3))", 0),
    value("cellnoise", "cellnoise(1.2) == cellnoise(1.7) ? 1 : 0", 1),
    value("pnoise", "pnoise(0.3, 4) - pnoise(4.3, 4)", 0),
    value("random", "random() < 1 ? 1 : 0", 1),
    // geometry
    value("xcomp", "xcomp(P)", 1),
    value("ycomp", "ycomp(P)", 0.4f),
    value("zcomp", "zcomp(N)", 1),
    after("setxcomp", "point p = P; setxcomp(p, 7);", "xcomp(p)", 7),
    after("setycomp", "vector p = 0; setycomp(p, 7);", "ycomp(p)", 7),
    after("setzcomp", "normal p = N; setzcomp(p, 7);", "zcomp(p)", 7),
    value("length", "length(vector(3, 4, 0))", 5),
    value("distance", "distance(point(1, 1, 1), point(1, 1, 3))", 2),
    value("normalize", "xcomp(normalize(vector(5, 0, 0)))", 1),
    value("faceforward", "zcomp(faceforward(N, vector(0, 0, -1)))", 1),
    value("shadingnormal", "zcomp(shadingnormal(N * 3))", 1),
    value("reflect", "zcomp(reflect(vector(0, 0, -1), N))", 1),
    value("refract", "zcomp(refract(vector(0, 0, -1), N, 1.5))", -1),
    after("fresnel", "float kr, kt; fresnel(vector(0, 0, -1), N, 1 / 1.5, kr, kt);", "kr", 0.04f),
    value("ptlined", "ptlined(point(1, 2, 0), point(0, 0, 0), point(5, 0, 0))", 2),
    value("bump", "zcomp(bump(\"flat.tx\", N, dPdu, dPdv))", 1),
    value("rotate", "ycomp(rotate(point(1, 0, 0), PI / 2, point(0), point(0, 0, 1)))", 1),
    value("depth", "depth(point(0, 0, 4))", 4),
    value("transform", "xcomp(transform(\"shifted\", point(3, 0, 0)))", 2),
    value("vtransform", "xcomp(vtransform(\"shifted\", vector(3, 0, 0)))", 3),
    value("ntransform", "zcomp(ntransform(\"shifted\", N))", 1),
    // derivatives
    value("Du", "Du(u * 3)", 3),
    value("Dv", "Dv(v * 3)", 3),
    value("Deriv", "Deriv(u * 5, u)", 5),
    value("area", "area(P)", 0.05f),
    value("filterwidth", "filterwidth(u)", 0.125f),
    value("filterwidthp", "filterwidthp(P)", 0.2236068f),
    value("calculatenormal", "zcomp(normalize(calculatenormal(P)))", 1),
    // colour
    value("comp", "comp(color(1, 2, 3), 2)", 3),
    after("setcomp", "color c = 0; setcomp(c, 1, 5);", "comp(c, 1)", 5),
    value("luminance", "luminance(color(1))", 1),
    value("ctransform", "comp(ctransform(\"hsv\", \"rgb\", color(0, 1, 1)), 0)", 1),
    // matrices
    value("determinant", "determinant(matrix(2))", 16),
    value("translate", "xcomp(transform(translate(1, vector(4, 0, 0)), point(1, 0, 0)))", 5),
    value("scale", "xcomp(transform(scale(1, point(4, 1, 1)), point(2, 0, 0)))", 8),
    value("mtransform", "comp(mtransform(\"world\", \"current\", matrix(3)), 0, 0)", 3),
    // strings
    value("format", "format(\"%d %s\", 3, \"x\") == \"3 x\" ? 1 : 0", 1),
    value("concat", "concat(\"a\", \"b\") == \"ab\" ? 1 : 0", 1),
    value("match", "match(\"a.c\", \"xabcx\")", 1),
    after("printf", "if (u > 2) printf(\"%f\\n\", u);", "1", 1),
    // textures: the test's is (s, t, 0.25)
    value("texture", "comp(color texture(\"a.tx\", 0.5, 0.5), 2)", 0.25f),
    value("environment", "comp(color environment(\"e.tx\", vector(0, 0, 3)), 2)", 3),
    value("shadow", "float shadow(\"s.tx\", P)", 0),
    // light
    surface("ambient", "Oi = 1; Ci = Cs * ambient();"),
    surface("diffuse", "Oi = 1; Ci = Cs * diffuse(N);"),
    surface("specular", "Oi = 1; Ci = specular(N, -I, 0.1);"),
    surface("phong", "Oi = 1; Ci = phong(N, -I, 20);"),
    surface("trace", "Oi = 1; Ci = 0.5 * trace(P, reflect(I, N));"),
    surface("specularbrdf", "Oi = 1; Ci = 0; illuminance (P, N, PI / 2) Ci += Cl * "
                            "specularbrdf(normalize(L), N, -normalize(I), 0.1);"),
    surface("subsurface", "Oi = 1; Ci = Cs * subsurface(P);"),
    surface("bsdf", "Oi = 1; Ci = 0; illuminance (P, N, PI / 2) Ci += Cl * PI * bsdf(L, N);"),
    value("occlusion", "occlusion(P, N, 16)", 0),
    surface("indirectdiffuse", "Oi = 1; Ci = Cs * indirectdiffuse(P, N, 16);"),
    surface("indirect", "Oi = 1; Ci = Cs * indirect(P, N);"),
    surface("photonmap", "Oi = 1; Ci = Cs * photonmap(\"p\", P, N);"),
    surface("caustic", "Oi = 1; Ci = Cs * caustic(P, N);"),
    surface("irradiance", "Oi = 1; Ci = Cs * irradiance(P, N);"),
    value("transmission", "comp(transmission(P, P + N), 0)", 1),
    value("visibility", "comp(visibility(P, P + N), 0)", 1),
    value("rayhittest", "rayhittest(P, N)", 1e10f),
    surface("fulltrace", "color hit; fulltrace(P, reflect(I, N), hit); Oi = 1; Ci = hit;"),
    surface("rayserver", "color hit; rayserver(P, reflect(I, N), hit); Oi = 1; Ci = hit;"),
    after("rayinfo", "float depth = 5; float known = rayinfo(\"depth\", depth);", "known + depth", 1),
    value("raylevel", "raylevel()", 0),
    value("raydepth", "raydepth()", 0),
    value("isshadowray", "isshadowray()", 0),
    value("isindirectray", "isindirectray()", 0),
    // material
    source("CreateBoundary", Layered),
    source("AddLobe", Layered),
    source("AddLayer", Layered),
    source("SetLobe", Layered),
    source("SetLayer", Layered),
    source("SetPresence", Layered),
    source("CreateInterior", Filled),
    source("AddPhaseFunction", Filled),
    source("SetPhaseFunction", Filled),
    source("SetPriority", Filled),
    source("SetAbsorption", Filled),
    source("SetScattering", Filled),
    // information: the test's host knows user:age = 41 and a texture of 64 x 32
    after("attribute", "float age = 0; float known = attribute(\"user:age\", age);", "known * age", 41),
    after("option", "float aspect = 3; float known = option(\"nothing\", aspect);", "known + aspect", 3),
    after("rendererinfo", "string name = \"\"; rendererinfo(\"renderer\", name);", "name == \"test\" ? 1 : 0",
          1),
    after("textureinfo", "float size[2] = 0; textureinfo(\"a.tx\", \"resolution\", size);", "size[1]", 32),
    value("shadername", "shadername() == \"probe\" ? 1 : 0", 1),
    after("surface", "float k = 2; float known = surface(\"Kd\", k);", "known + k", 2),
    after("displacement", "float k = 2; float known = displacement(\"Km\", k);", "known + k", 2),
    after("atmosphere", "float k = 2; float known = atmosphere(\"d\", k);", "known + k", 2),
    after("incident", "float k = 2; float known = incident(\"d\", k);", "known + k", 2),
    after("opposite", "float k = 2; float known = opposite(\"d\", k);", "known + k", 2),
    after("lightsource", "float k = 2; float known = lightsource(\"__nondiffuse\", k);", "known + k", 2),
    value("isoutput", "isoutput()", 1),
    value("bake", "bake(\"b\", s, t, 1)", 0),
    value("bake3d", "bake3d(\"b\", \"\", P, N)", 0),
    after("texture3d", "color c = 5; texture3d(\"b\", P, N, \"c\", c);", "comp(c, 0)", 5),
    // arrays
    after("arraylength", "float a[3] = {1, 2, 3};", "arraylength(a)", 3),
    after("push", "float a[]; push(a, 4); push(a, 5);", "arraylength(a) * 10 + a[1]", 25),
    after("pop", "float a[] = {1, 2, 7}; float last = pop(a);", "arraylength(a) * 10 + last", 27),
    after("resize", "float a[] = {1, 2}; resize(a, 5);", "arraylength(a) + a[4]", 5),
    after("reserve", "float a[]; reserve(a, 20); push(a, 1);", "arraylength(a)", 1),
    after("capacity", "float a[]; reserve(a, 20);", "capacity(a)", 20),
    // co-shaders
    value("getshader", "getshader(\"none\") == null ? 1 : 0", 1),
    after("getshaders", "shader all[] = getshaders();", "arraylength(all)", 0),
    after("getlights", "shader all[] = getlights(\"category\", \"key\");", "arraylength(all)", 0),
    value("caller", "caller() == null ? 1 : 0", 1),
    after("getvar", "float k = 3; float known = getvar(null, \"k\", k);", "known + k", 3),
    value("hasmethod", "hasmethod(null, \"shade\")", 0),
    after("writeaov", "writeaov(\"a\", u);", "1", 1),
    value("outputchannel", "outputchannel(\"a\", u)", 0),
    after("evalparam", "float k = 3; float known = evalparam(\"k\", k);", "known + k", 3),
    after("emit", "emit(color(1));", "1", 1),
};

constexpr Example statements[] = {
    after("declarations", "uniform float a = 1, b = 2; varying color c = color(a, b, 3);", "comp(c, 2)", 3),
    after("assignment", "float a, b; a = b = 4; a += 1; a *= 2; a -= 3; a /= 7;", "a + b", 5),
    after("if, else", "float x; if (u > 0.4) x = 1; else x = 2;", "x", 1),
    after("while", "float x = 0; while (x < 5) x += 1;", "x", 5),
    after("for", "float i, x = 0; for (i = 0; i < 4; i += 1) x += i;", "x", 6),
    after("break n",
          "float i, j, x = 0; for (i = 0; i < 4; i += 1) for (j = 0; j < 4; j += 1) { if (j == 2) break 2; x "
          "+= 1; }",
          "x", 2),
    after("continue n", "float i, x = 0; for (i = 0; i < 4; i += 1) { if (i == 1) continue; x += 1; }", "x",
          3),
    after("functions, return",
          "float f(float x; output float y) { y = x; if (x > 1) return 2; return 3; } float y; float r0 = "
          "f(u * 4, y);",
          "r0 * 10 + y", 22),
    after("extern", "float k = 3; float f() { extern float k; return k; }", "f()", 3),
    after("arrays", "float a[3] = {1, 2, 3}; a[1] = 5;", "a[floor(u * 2)]", 5),
    after("components", "color c = color(1, 2, 3); c[1] = 7; matrix m = 1; m[0][1] = 4;",
          "c[1] + m[0][1] + P[0]", 12),
    after("?:", "color c = u > 1 ? color(1) : color(2);", "comp(c, 0)", 2),
    after("dot and cross", "vector a = vector(1, 2, 3);", "a . a + zcomp(a ^ vector(1, 0, 0))", 12),
    after("casts", "color c = color \"hsv\" (0, 1, 1); point p = point \"shifted\" (0, 0, 0);",
          "comp(c, 0) + zcomp(p)", 4),
    after("conditions as numbers", "float a = (u > 0.1) + (v > 0.1);", "a && !0 ? a : 9", 2),
    source("struct", R"(struct Ray { point origin = 0; vector direction = vector(0, 0, 1);
    point at(float t) { return origin + direction * t; } }
class s() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) { AddLobe(CreateBoundary(m), "e", DiffuseEmission()); }
    public void mnk_prelighting(output MnkMaterialBoundary b) {
        Ray r = Ray(P, N);
        r->direction *= 2;
        SetLobe(b, "e", 1, DiffuseEmission("radiance", color(xcomp(r->at(3)))));
    }
})"),
    surface("illuminance", "Oi = 1; Ci = 0; illuminance (P, N, PI / 2) { Ci += Cl * (N . normalize(L)); }"),
    surface("gather", "Oi = 1; float hit = 0; gather (\"illuminance\", P, N, PI / 2, 4) { hit += 1; } else { "
                      "hit += 0; } Ci = 1 - hit;"),
    source("illuminate",
           "light l(float intensity = 1;) { illuminate (point(0)) { Cl = intensity / (L . L); } }"),
    source("solar", "light l(float intensity = 1;) { solar (vector(0, 0, 1), 0) { Cl = intensity; } }"),
    source("volume", "volume v(float d = 1;) { Ci = mix(Ci, color(0.5), 1 - exp(-length(I) * d)); Oi = "
                     "mix(Oi, color(1), d); }"),
    source("imager",
           "imager i(color background = 0;) { Ci += (1 - alpha) * background; Oi = 1; alpha = 1; }"),
    source("displacement", "displacement d(float Km = 0.1;) { P += Km * noise(10 * P) * normalize(N); N = "
                           "calculatenormal(P); }"),
};

} // namespace

std::span<const Example> shadeop_examples() {
    return shadeops;
}
std::span<const Example> statement_examples() {
    return statements;
}

} // namespace kanuka::sl::ops
