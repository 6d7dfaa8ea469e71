// Classic surfaces, read as closures.
#include "sl/test_materials.h"

namespace kanuka::sl::test {

static Vec3f shaded(const Instance& i, const char* name, const GridGlobals& globals = {}, int vertex = 0) {
    TestServices services;
    grid::Grid g = plane(8, 5);
    grid::VertexInputs out;
    i.shade(g, globals, services, out);
    const int s = slot(i.program(), name);
    if (s < 0)
        ADD_FAILURE() << "no slot " << name;
    return s < 0 ? Vec3f(-1, -1, -1) : value(out, s, vertex);
}

TEST(SlClosures, StandardShaders) {
    TestServices services;
    GridGlobals globals;
    globals.Cs = Vec3f(0.5f, 0.25f, 1);
    const auto metal = make(R"(surface metal(float Ka = 1, Ks = 1, roughness = .25;) {
        normal Nf = faceforward(normalize(N), I); vector V = -normalize(I);
        Oi = Os; Ci = Os * Cs * (Ka * ambient() + Ks * specular(Nf, V, roughness)); })",
                            services);
    ASSERT_TRUE(metal);
    // Ambient light is reflected by the highlight's lobe, which is there.
    EXPECT_EQ(lobes(metal->program()), (std::vector{LobeId::HighlightBrdf}));
    EXPECT_EQ(shaded(*metal, "specular.height", globals), Vec3f(0.5f, 0.25f, 1));

    const auto shiny =
        make(R"(surface shinymetal(float Ka = 1, Ks = 1, Kr = 1, roughness = .1; string texturename = "";) {
        normal Nf = faceforward(normalize(N), I); vector V = -normalize(I);
        vector D = reflect(I, normalize(Nf)); D = vtransform("current", "world", D);
        color ev;
        if (texturename != "") ev = color environment(texturename, D); else ev = 0;
        Oi = Os; Ci = Os * Cs * (Ka * ambient() + Ks * specular(Nf, V, roughness) + Kr * ev); })",
             services);
    ASSERT_TRUE(shiny);
    EXPECT_EQ(shaded(*shiny, "mirror.reflectance", globals), Vec3f(0, 0, 0)); // no texture named
    const std::vector<Argument> named = {{"texturename", {}, {"env.tx"}, false}};
    EXPECT_EQ(shaded(*make(R"(surface shinymetal(float Kr = 1; string texturename = "";) {
        vector D = reflect(I, normalize(N)); color ev = 0;
        if (texturename != "") ev = Kr * color environment(texturename, D);
        Oi = Os; Ci = Os * Cs * ev; })",
                           services, named),
                     "mirror.reflectance", globals),
              Vec3f(0.5f, 0.25f, 1));

    const auto painted = make(
        R"(surface paintedplastic(float Ka = 1, Kd = .5, Ks = .5, roughness = .1; color specularcolor = 1; string texturename = "";) {
        normal Nf = faceforward(normalize(N), I); vector V = -normalize(I);
        color Ct = Cs;
        if (texturename != "") Ct *= color texture(texturename);
        Oi = Os; Ci = Os * (Ct * (Ka * ambient() + Kd * diffuse(Nf)) + specularcolor * Ks * specular(Nf, V, roughness)); })",
        services, named);
    ASSERT_TRUE(painted);
    EXPECT_NEAR(shaded(*painted, "diffuse.diffuseReflectance", globals, 8).x, 0.25f, 1e-6); // s = 1
    EXPECT_NEAR(shaded(*painted, "diffuse.diffuseReflectance", globals, 8).y, 0, 1e-6);     // t = 0
    EXPECT_FALSE(painted->uniform_material(false));

    const auto null = make("surface null() {}", services);
    ASSERT_TRUE(null);
    EXPECT_EQ(services.reports.size(), 0u);
}

TEST(SlClosures, AlgebraOfLight) {
    TestServices services;
    // sums, differences, products, selections, loops, functions and variables
    const auto i = make(R"(
color twice(color c) { return c + c; }
surface s(float k = 0.1; varying float w = 0.5;) {
    color D = 0; float i;
    for (i = 0; i < 3; i += 1) D += k * diffuse(N);
    if (u > 0.5) D *= 2;
    color S = u > 0.2 ? specular(N, -I, 0.2) : color(0);
    Oi = 1; Ci = twice(D) * color(1, 0.5, w) + 0.25 * S - 0 * S + phong(N, -I, 10) / 4 + 0.125 * Cs;
})",
                        services);
    ASSERT_TRUE(i);
    EXPECT_EQ(i->program().presence, -1);
    EXPECT_EQ(lobes(i->program()), (std::vector{LobeId::LambertBrdf, LobeId::HighlightBrdf,
                                                LobeId::HighlightBrdf, LobeId::DiffuseEmission}));
    EXPECT_NEAR(shaded(*i, "diffuse.diffuseReflectance", {}, 0).x, 0.6f, 1e-6);
    EXPECT_NEAR(shaded(*i, "diffuse.diffuseReflectance", {}, 8).x, 1, 1e-6); // 1.2, limited
    EXPECT_NEAR(shaded(*i, "diffuse.diffuseReflectance", {}, 8).z, 0.6f, 1e-6);
    EXPECT_EQ(shaded(*i, "specular.height", {}, 0).x, 0);
    EXPECT_NEAR(shaded(*i, "specular.height", {}, 8).x, 0.25f, 1e-6);
    EXPECT_NEAR(shaded(*i, "specular2.height", {}, 8).x, 0.25f, 1e-6);
    EXPECT_NEAR(shaded(*i, "specular.exponent", {}, 8).x, 8 / 0.2, 1e-4);
    EXPECT_EQ(shaded(*i, "specular2.exponent", {}, 0).x, 10);
    EXPECT_EQ(shaded(*i, "specular2.about", {}, 0).x, 1);
    EXPECT_EQ(shaded(*i, "emission.radiance", {}, 0).x, 0.125f);
}

TEST(SlClosures, MirrorsAndPresence) {
    TestServices services;
    const auto i = make(R"(surface s(float Kr = 0.75;) {
        normal Nf = faceforward(normalize(N), I); vector R = reflect(normalize(I), Nf);
        Oi = Os * color(0.5); Ci = Oi * Kr * trace(P, R); })",
                        services);
    ASSERT_TRUE(i);
    EXPECT_EQ(shaded(*i, "mirror.reflectance"), Vec3f(0.75f, 0.75f, 0.75f));
    EXPECT_EQ(shaded(*i, "mirror.roughness").x, 0);
    EXPECT_NEAR(shaded(*i, "presence").x, 0.5f, 1e-6);
    // Opacity that the arguments fix to one leaves no presence.
    const std::vector<Argument> opaque = {{"Os", {1, 1, 1}, {}, false}};
    const char* matte = "surface matte(float Kd = 1;) { Oi = Os; Ci = Os * Cs * Kd * diffuse(N); }";
    EXPECT_EQ(make(matte, services, opaque)->program().presence, -1);
    EXPECT_GE(make(matte, services)->program().presence, 0);
}

TEST(SlClosures, IlluminanceLoopsAreRead) {
    TestServices services;
    const auto i = make(R"(
color mydiffuse(normal n; point p) {
    color C = 0;
    extern vector L; extern color Cl;
    illuminance(p, n, PI / 2) { C += Cl * (normalize(L) . n); }
    return C;
}
surface s(float Kd = 0.5, Ks = 0.25, roughness = 0.1, size = 20;) {
    normal Nf = faceforward(normalize(N), I); vector V = -normalize(I);
    vector R = normalize(reflect(I, Nf));
    color S = 0, F = 0;
    illuminance(P, Nf, PI / 2) {
        vector Ln = normalize(L);
        vector H = normalize(Ln + V);
        float nl = Ln . Nf;
        if (nl > 0) S += Cl * pow(max(0, Nf . H), 1 / roughness);
        F += Cl * pow(max(0, R . Ln), size) * Cs;
    }
    Oi = 1; Ci = Kd * Cs * mydiffuse(Nf, P) + Ks * S + 0.125 * F;
})",
                        services);
    ASSERT_TRUE(i);
    EXPECT_EQ(lobes(i->program()),
              (std::vector{LobeId::LambertBrdf, LobeId::HighlightBrdf, LobeId::HighlightBrdf}));
    EXPECT_EQ(shaded(*i, "diffuse.diffuseReflectance").x, 0.5f);
    EXPECT_NEAR(shaded(*i, "specular.height").x, 0.25f, 1e-6);
    EXPECT_NEAR(shaded(*i, "specular.exponent").x, 10, 1e-4); // as it stands there
    EXPECT_NEAR(shaded(*i, "specular2.height").x, 0.125f, 1e-6);
    EXPECT_EQ(shaded(*i, "specular2.exponent").x, 20);
    // The same in one expression, with both kernels beside each other, and with specularbrdf().
    const auto j = make(R"(surface s(float Kd = 0.5, roughness = 0.1;) {
    Oi = Os; Ci = 0; vector V = -normalize(I);
    illuminance(P, N, 1.57) { vector Ln = normalize(L); Ci += Os * Cl * (Cs * Kd * (Ln . N) + 0.25 * specularbrdf(Ln, N, V, roughness)); } })",
                        services);
    ASSERT_TRUE(j);
    EXPECT_EQ(shaded(*j, "diffuse.diffuseReflectance").x, 0.5f);
    EXPECT_NEAR(shaded(*j, "specular.height").x, 0.25f, 1e-6);
    EXPECT_NEAR(shaded(*j, "specular.exponent").x, 8 / 0.1, 1e-4);
}

TEST(SlClosures, FresnelMakesDielectrics) {
    TestServices services;
    const auto glass = make(R"(surface glass(float index = 1.5;) {
    normal Nf = faceforward(normalize(N), I); vector In = normalize(I); vector R, T; float Kr, Kt;
    float eta = (In . N < 0) ? 1 / index : index;
    fresnel(In, Nf, eta, Kr, Kt, R, T);
    Oi = 1; Ci = Kr * trace(P, R) + color(1, 0.5, 1) * Kt * trace(P, T); })",
                            services);
    ASSERT_TRUE(glass);
    EXPECT_EQ(lobes(glass->program()), (std::vector{LobeId::MicrosurfaceDielectricBsdfRgb_v1}));
    EXPECT_EQ(shaded(*glass, "glass.reflectance"), Vec3f(1, 1, 1));
    EXPECT_EQ(shaded(*glass, "glass.transmittance"), Vec3f(1, 0.5f, 1));
    EXPECT_NEAR(shaded(*glass, "glass.ior").x, 1.5f, 1e-5);
    const auto glazed = make(R"(surface ceramic(float Kd = 0.5;) {
    normal Nf = faceforward(normalize(N), I); float Kr, Kt;
    fresnel(normalize(I), Nf, 1 / 1.4, Kr, Kt);
    Oi = 1; Ci = Kd * diffuse(Nf) + Kr * specular(Nf, -normalize(I), 0.05); })",
                             services);
    ASSERT_TRUE(glazed);
    EXPECT_EQ(lobes(glazed->program()), (std::vector{LobeId::LambertBrdf, LobeId::MicrofacetDielectricBrdf}));
    EXPECT_NEAR(shaded(*glazed, "specular.ior").x, 1.4f, 1e-5);
    EXPECT_NEAR(shaded(*glazed, "specular.roughness").x, std::pow(2 / (8 / 0.05 + 2), 0.25), 1e-5);
}

TEST(SlClosures, BumpInASurfaceShaderSetsN) {
    TestServices services;
    const auto i =
        make("surface s() { N = calculatenormal(P + normalize(N) * 0.3 * u); Oi = 1; Ci = diffuse(N); }",
             services);
    ASSERT_TRUE(i);
    grid::Grid g = plane(8, 5);
    grid::VertexInputs out;
    i->shade(g, {}, services, out);
    EXPECT_LT(g.normal(3).x, -0.001f);
    EXPECT_EQ(g.position(3).z, 0);
}

TEST(SlClosures, WhatIsNotAMaterialIsAnErrorIfStrict) {
    const std::pair<const char*, const char*> bad[] = {
        {"Oi = 1; Ci = diffuse(N) * diffuse(N);", "which is not known"},
        {"Oi = 1; color c = diffuse(N); if (comp(c, 0) > 0.5) c = 0; Ci = c;", "which is not known"},
        {"Oi = 1; Ci = abs(1 - normalize(I) . N) * diffuse(N);", "viewing direction I"},
        {"Oi = 1; Ci = diffuse(normalize(I));", "normal of this lobe"},
        {"Oi = 1; Ci = 0; float i; for (i = 0; i < 2; i += 1) Ci += trace(N);", "mirrored"},
        {"Oi = 1; Ci = 0; illuminance(P, N, PI / 2) { Ci += Cl * xcomp(L); }", "is not that of a lobe"},
        {"Oi = 1; Ci = 0; illuminance(P, N, PI / 2) { Ci += Cl; }", "is not that of a lobe"},
        {"Oi = 1; Ci = 0; illuminance(P, N, PI / 2) { Ci += Cl * pow(normalize(L) . N, 3); }",
         "is not that of a lobe"},
    };
    for (const auto& [body, message] : bad) {
        CompileOptions o;
        o.use_cache = false;
        const std::string source = "surface s() {\n " + std::string(body) + " }";
        Journal lenient;
        EXPECT_TRUE(compile_source("test.sl", source, o, lenient)) << body << messages(lenient);
        o.strict_directions = true;
        Journal journal;
        EXPECT_FALSE(compile_source("test.sl", source, o, journal)) << body;
        EXPECT_NE(messages(journal).find(message), std::string::npos) << body << "\n" << messages(journal);
        EXPECT_NE(messages(journal).find("test.sl:2:"), std::string::npos) << messages(journal);
    }
}

TEST(SlClosures, Displacement) {
    TestServices services;
    const auto i = make(R"(displacement dented(float Km = 0.5;) {
        float size = 1, magnitude = 0, i;
        point p2 = transform("shader", P);
        for (i = 0; i < 6; i += 1) { magnitude += abs(0.5 - noise(p2 * size)) / size; size *= 2; }
        P -= normalize(N) * (magnitude * magnitude * magnitude) * Km;
        N = calculatenormal(P); })",
                        services);
    ASSERT_TRUE(i);
    EXPECT_TRUE(i->displaces());
    EXPECT_TRUE(i->program().nodes.empty());
    grid::Grid g = plane(20, 20);
    i->displace(g, {}, services);
    int moved = 0;
    for (int k = 0; k < g.vertices(); k++)
        moved += g.position(k).z < -1e-4f;
    EXPECT_GT(moved, 200);
}

TEST(SlClosures, OtherKindsOfShadersHaveParameters) {
    const char* light =
        R"(light distantlight(float intensity = 1; color lightcolor = 1; point from = point "shader" (0, 0, 0), to = point "shader" (0, 0, 1);) {
        solar(to - from, 0) { Cl = intensity * lightcolor; } })";
    const char* fog = "volume fog(float distance = 1; color background = 0;) { float d = 1 - exp(-length(I) "
                      "/ distance); Ci = mix(Ci, background, d); Oi = mix(Oi, color(1, 1, 1), d); }";
    const char* imager =
        "imager background(color bgcolor = 1;) { Ci += (1 - alpha) * bgcolor; Oi = 1; alpha = 1; }";
    EXPECT_EQ(compile(light)->parameters().size(), 4u);
    EXPECT_EQ(compile(light)->kind(), ShaderKind::Light);
    EXPECT_EQ(compile(fog)->parameters()[1].type, Type::Color);
    EXPECT_EQ(compile(imager)->kind(), ShaderKind::Imager);
}

} // namespace kanuka::sl::test
