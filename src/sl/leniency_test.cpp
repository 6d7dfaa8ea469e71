// What published shaders do, beyond what the specification says: it compiles, and means what its authors
// meant.
#include "sl/test_support.h"

namespace kanuka::sl::test {

static void expect(const std::string& statements, float expected, const std::string& before = {}) {
    const std::vector<Vec3f> r = evaluate("float x = 0;\n" + statements + "\nr = color(x);", before);
    EXPECT_NEAR(r[4 + 9 * 2].x, expected, 1e-5f) << statements; // u = 0.5, v = 0.4
}

static void compiles(const std::string& source) {
    Journal journal;
    EXPECT_TRUE(compile(source, {}, &journal)) << source << "\n" << messages(journal);
}

TEST(SlLeniency, TypesNamesAsVariables) {
    expect("point normal = (1, 2, 3); vector matrix = normal; x = ycomp(normal) + zcomp(matrix);", 5);
    expect("float constant = 2; constant += 1; x = constant;", 3);
}

TEST(SlLeniency, ParametersAndGlobalsAreCopiedWhenChanged) {
    expect("float k = 3; x = f(k) * 10 + k;", 43, "float f(float a) { a += 1; return a; }");
    expect("u = u + 1; s *= 4; x = u + s;", 3.5f);
    compiles("surface s(float Kd = 1;) { Kd = Kd * 2; I = normalize(I); Oi = Os; Ci = Os * Kd * "
             "diffuse(faceforward(N, I)); }");
    compiles("light l() { L = 0; Cl = 1; }");
}

TEST(SlLeniency, Functions) {
    expect("x = later(2);", 4, "float later(float a);\nfloat later(float a) { return a * a; }");
    expect("x = f(1);", 1, "f(float a) { return a; }");
    expect("x = min(f(), 7, 3);", 3, "float min(float a) { return 99; }\nfloat f() { return min(0); }");
    expect("point p = f(); x = xcomp(p) + f();", 3,
           "float f() { return 1; }\npoint f() { return point(2, 0, 0); }");
    expect("x = f(u, 1.5);", 2, "float f(uniform float a; float varying b) { return a + b; }");
    // A shader may return, and its parameters may be used by functions outside of it.
    compiles("float k() { extern float Kd; return Kd; }\nsurface s(float Kd = 1;) { Oi = 1; Ci = k(); if (u "
             "> 0.5) return; Ci = 0; }");
}

TEST(SlLeniency, ParameterLists) {
    compiles("surface s(float a = 1, b = 2; ; uniform float c = 3, string n = \"\"; varying output color d = "
             "0,) { Oi = 1; Ci = a * b * c * d; }");
    compiles("surface s(matrix m = \"shader\" 1; point p = \"world\" (1, 2, 3); vector up = dPdu; float k[2] "
             "= {PI, sin(1)};) { Oi = 1; Ci = comp(m, 0, 0) * xcomp(p) * length(up) * k[1]; }");
    compiles("float f(void) { return 1; }\nsurface s() { Oi = 1; Ci = f(); }");
}

TEST(SlLeniency, DefaultsThatVary) {
    const auto shader = compile(probe("r = color(xcomp(d), 0, 0);", {}, "varying vector d = dPdu * 3;"));
    ASSERT_TRUE(shader);
    TestServices services;
    grid::Grid g = plane(2, 2);
    EXPECT_EQ(run_probe(*shader, g, services)[0].x, 6);
    const std::vector<Argument> given = {{"d", {9, 0, 0}, {}, false}};
    EXPECT_EQ(run_probe(*shader, g, services, given)[0].x, 9);
}

TEST(SlLeniency, ConditionsAndRelations) {
    expect("if (color(0, 0, 1)) x = 1; if (\"\") x = 5; if (\"a\" && !color(0)) x += 2;", 3);
    expect("x = (color(1, 2, 3) > color(0)) + (color(1, 2, 3) < color(2));", 1);
    expect("float i, j; for (i = 0, j = 10; i < j; i += 1, j -= 1) x += 1;", 5);
    expect("color c = (1, 2, 3) * 2; x = comp((1, 1, 1) + c, 2);", 7);
}

TEST(SlLeniency, Components) {
    expect("color c[2] = {color(1, 2, 3), color(4, 5, 6)}; c[1][2] *= 2; P[0] = 3; x = c[1][2] + P[0] + "
           "c[0][floor(u * 3)];",
           17);
    expect("matrix m = 2; m[0][3] = 5; m[1][1] += 1; x = m[0][3] * 10 + m[1][1];", 53);
}

TEST(SlLeniency, Structs) {
    const char* types = "struct Pair { float a = 2; color c = color(1, 2, 3); }\n"
                        "struct Both { Pair first; float k[2] = {7, 8}; };\n"
                        "Pair make(float a) { Pair p; p->a = a; return p; }\n"
                        "void twice(output Pair p) { p->a *= 2; }\n"
                        "float read(Pair p) { return p->a; }\n";
    expect("Pair p; x = p->a + comp(p->c, 1);", 4, types);
    expect("Pair p = make(5); twice(p); Pair q = p; p->a = 0; x = q->a + p->a;", 10, types);
    expect("Both b; b->first->a = 4; b->k[1] = 3; Both d = b; x = d->first->a + d->k[0] + d->k[1];", 14,
           types);
    expect("x = read(Pair(6, color(0))) + read(make(3));", 9, types);
    expect("Pair p[3]; p[1]->a = 8; Pair q = p[1]; p[2] = q; x = p[2]->a + q->a + p[0]->a;", 18, types);
    expect("Pair p[]; push(p, make(4)); push(p, Pair(5)); x = arraylength(p) * 10 + p[0]->a + p[1]->a;", 29,
           types);
    expect("Pair p; if (u > 0.4) p = make(v); x = p->a;", 0.4f, types);
}

TEST(SlLeniency, ResizableArrays) {
    expect("float a[]; float i; for (i = 0; i < 10; i += 1) push(a, i); x = arraylength(a) * 100 + a[9] + "
           "pop(a) + arraylength(a);",
           1000 + 9 + 9 + 9);
    expect("string a[] = {\"p\", \"q\"}; push(a, \"r\"); x = arraylength(a) + (a[2] == \"r\");", 4);
    expect("uniform float n = 3; color a[n]; a[2] = 4; color b[] = a; x = arraylength(b) + comp(b[2], 0);",
           7);
    expect("float a[]; fill(a, 4); x = total(a);", 10,
           "void fill(output float a[]; float n) { float i; for (i = 1; i <= n; i += 1) push(a, i); }\n"
           "float total(float a[]) { float i, s = 0; for (i = 0; i < arraylength(a); i += 1) s += a[i]; "
           "return s; }\n");
    const auto shader = compile(probe("float i; for (i = 0; i < arraylength(k); i += 1) r += k[i];", {},
                                      "uniform float k[] = {1, 2}; uniform string names[] = {};"));
    ASSERT_TRUE(shader);
    TestServices services;
    grid::Grid g = plane(1, 1);
    EXPECT_EQ(run_probe(*shader, g, services)[0].x, 3);
    const std::vector<Argument> given = {{"k", {5, 6, 7}, {}, false}, {"names", {}, {"a"}, false}};
    EXPECT_EQ(run_probe(*shader, g, services, given)[0].x, 18);
    EXPECT_TRUE(services.reports.empty());
}

TEST(SlLanguage, AovsAreHandedOut) {
    CompileOptions o;
    o.use_cache = false;
    o.aovs = {"height", "tint", "nothing"};
    Journal journal;
    const auto shader =
        compile_source("aov.sl",
                       "surface s(output varying float height = 0; output varying color tint = 0;"
                       "output varying color unused = 0;) {"
                       "height = u * 2; tint = color(1, 2, 3); Oi = 1; Ci = tint * diffuse(N); }",
                       o, journal);
    ASSERT_TRUE(shader) << messages(journal);
    TestServices services;
    const auto instance = shader->instantiate({}, services);
    EXPECT_EQ(instance->aovs(), (std::vector<std::string>{"height", "tint"}));
    grid::Grid g = plane(8, 5);
    grid::VertexInputs out;
    std::vector<grid::SlotValues> aovs;
    instance->shade_with_aovs(g, {}, services, out, aovs);
    ASSERT_EQ(aovs.size(), 2u);
    EXPECT_EQ(aovs[0].data[4], 1);
    EXPECT_TRUE(aovs[1].uniform);
    EXPECT_EQ(aovs[1].value.z, 3);
}

TEST(SlLeniency, StringsThatVary) {
    expect("string a; if (u > 0.4) a = \"p\"; else if (v > 2) a = \"q\"; string b = u > 3 ? a : \"z\";"
           "x = (a == \"p\") + 2 * (a != \"q\") + 4 * (b == \"z\") + 8 * (a == b);",
           7);
}

TEST(SlLeniency, StringsThatVaryInMessages) {
    TestServices services;
    evaluate("string a = \"p\"; if (u > 0.4) a = \"q\"; printf(\"it is %s\", a); r = a == \"q\";", {}, 4e-6f,
             &services);
    EXPECT_NE(services.reports.at(0).find("it is (a string that varies)"), std::string::npos);
}

TEST(SlLeniency, ClassesAndCoShaders) {
    compiles(
        "class c(shader s = null; shader all[] = {};) { color base; public void construct() { base = 0.5; }\n"
        "public void displacement(output point P; output normal N) { P += N * 0.1; }\n"
        "public void opacity(output color Oi) { Oi = 0.5; }\n"
        "public void prelighting(output color Ci, Oi) { base *= 2; }\n"
        "public void lighting(output color Ci, Oi) { float i; Ci = base;\n"
        "  if (s != null) Ci += s->shade(P, 2); for (i = 0; i < arraylength(all); i += 1) Ci += all[i]->c; } "
        "}");
    compiles("class c() { public color shade(point p; float k) { return this->twice(k); } float twice(float "
             "k) { return 2 * k; } }");
    compiles(
        "plugin \"x\";\nclass c() { public void surface(output color Ci, Oi) { Ci = far(1); Oi = 1; } }");
}

TEST(SlLeniency, FilterRegions) {
    expect("filterregion f; f->calculate2d(0.25, 0.75); f->scale(2); x = float texture(\"a.tx\", f);", 0.25f);
    expect("filterregion f; f->calculate3d(point(0, 0, 3)); x = comp(color environment(\"e.tx\", f), 2);", 3);
}

TEST(SlLeniency, Preprocessor) {
    expect("x = two(1, 2) + any(3, 4, 5);", 3 + 12,
           "#define two(a, b) ((a) + \\  \n  (b))\n#define any(...) add(__VA_ARGS__)\nfloat add(float a, b, "
           "c) { return a + b + c; }\n");
    expect("x = sqr(3) + long(2);", 9 + 4,
           "#define sqr(x) ((x) * (x))\nfloat sqr(float x) { return x * x; }\n"
           "#define long(x) /* a comment \\\n that goes on */ ((x) + 2)\n#if 0\n it's 3D \"text\n#endif\n");
    expect("x = 2;", 2, "#ident \"a\"\n/* */ #define A\n#ifdef A // a comment \\\n that goes on\n#endif A\n");
    EXPECT_TRUE(compile("surface s() {\r Oi = 1;\r // a comment\r Ci = Cs;\r}\r"));
    EXPECT_TRUE(compile("\xef\xbb\xbfsurface s() { Oi = 1; Ci = Cs; }\x1a"));
}

TEST(SlFaults, DivisionsAndLoops) {
    TestServices services;
    const auto r = evaluate("r = color(1 / (u - 0.5), u > 0.9 ? 1 / (u - 0.5) : 3, 0); color c = Cs / (v * "
                            "Cs); if (v > 2) r = c;",
                            {}, 4e-6f, &services);
    EXPECT_EQ(r[4].x, 0); // a defined value
    EXPECT_EQ(r[0].x, -2);
    size_t divisions = 0;
    for (const std::string& s : services.reports)
        divisions += s.find("division by zero (6 times)") != std::string::npos;
    EXPECT_EQ(divisions, configs().size()); // once each, with its count, where lanes run

    TestServices endless;
    const auto left = evaluate("float n = 0; while (n >= 0) n = n * 0.5; while (u >= 0) { n += "
                               "calculatenormal(P) . N; } r = n > 0 ? 8 : 7;",
                               {}, 4e-6f, &endless);
    EXPECT_EQ(left[0].x, 7);
    bool told = false;
    for (const std::string& s : endless.reports)
        told = told || s.find("this loop does not end") != std::string::npos;
    EXPECT_TRUE(told);
}

TEST(SlLeniency, TexturesBesideColorsAreColors) {
    // The test's texture is (s, t, 0.25): a float of it would be s in all components.
    for (const char* e :
         {"Cs * texture(\"a.tx\")", "texture(\"a.tx\") * Cs", "Cs * 2 * texture(\"a.tx\") / 2",
          "Cs * (texture(\"a.tx\") + texture(\"b.tx\")) / 2", "Cs * pow(texture(\"a.tx\"), 1)",
          "mix(Cs, texture(\"a.tx\"), 1)", "Cs * mix(texture(\"a.tx\"), texture(\"a.tx\"), 0.5)",
          "max(color(0), texture(\"a.tx\"))", "Cs * (s > -1 ? texture(\"a.tx\") : 1)",
          "Cs * clamp(texture(\"a.tx\"), 0, 1)"})
        for (size_t i : {size_t(1), size_t(20), size_t(50)}) {
            const Vec3f r = evaluate(std::string("r = ") + e + ";")[i];
            const grid::Grid g = plane(8, 5);
            EXPECT_NEAR(r.x, g.s[i], 1e-6f) << e;
            EXPECT_NEAR(r.y, g.t[i], 1e-6f) << e;
            EXPECT_NEAR(r.z, 0.25f, 1e-6f) << e;
        }
    EXPECT_EQ(evaluate("r = Cs * environment(\"sky.tx\", vector (1, 2, 3));")[5], Vec3f(1, 2, 3));
    // A factor of a direction stays a number.
    EXPECT_EQ(evaluate("r = color(N * texture(\"a.tx\"));")[8].z, 1);
}

} // namespace kanuka::sl::test
