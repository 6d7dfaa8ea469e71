// Statements, functions, arrays, control flow in all its details, at every lane count and optimisation level.
#include <algorithm>

#include "sl/test_support.h"

namespace kanuka::sl::test {

// Checks r.x at every vertex of the 9 x 6 plane.
static void expect(const std::string& statements, float (*expected)(float u, float v),
                   const std::string& before = {}) {
    const std::vector<Vec3f> r = evaluate(statements, before);
    ASSERT_EQ(r.size(), 54u);
    for (int i = 0; i < 54; i++) {
        const float u = float(i % 9) / 8, v = float(i / 9) / 5;
        EXPECT_NEAR(r[size_t(i)].x, expected(u, v), 1e-5f) << statements << " at u = " << u << ", v = " << v;
    }
}

TEST(SlLanguage, VaryingIfs) {
    expect("if (u > 0.5) r = 1; else r = 2;", [](float u, float) { return u > 0.5f ? 1.0f : 2.0f; });
    expect("float x = 1; if (u > 0.5) { x = 3; if (v > 0.5) x += 4; else x -= 1; } else if (v > 0.3) x = 7; "
           "r = x;",
           [](float u, float v) { return u > 0.5f   ? (v > 0.5f ? 7.0f : 2.0f)
                                         : v > 0.3f ? 7.0f
                                                    : 1.0f; });
    expect("if (u > 0.5 && !(v < 0.5) || u == 0) r = 1;",
           [](float u, float v) { return (u > 0.5f && v >= 0.5f) || u == 0 ? 1.0f : 0.0f; });
    expect("r = u > 0.5 ? noise(P) * 0 + 5 : v;", [](float u, float v) { return u > 0.5f ? 5.0f : v; });
}

// c op= x is c = c op x, also where the type of x follows from what is beside it: a factor is a float, a
// summand a colour.
TEST(SlLanguage, CompoundAssignmentsTakeTheTypesOfTheirOperators) {
    const auto run = [](const std::string& statements) {
        return evaluate("point q = P * 3.1 + 0.2; " + statements);
    };
    for (const std::string value :
         {"noise(q)", "0.5 * noise(q)", "-noise(q)", "texture(\"a.tx\", u, v)", "(1, 2, 3)"})
        for (const std::string op : {"*", "/", "+", "-"}) {
            const std::string start = "color c = color(1, 2, 4); ";
            const std::vector<Vec3f> compound = run(start + "c " + op + "= " + value + "; r = c;"),
                                     plain = run(start + "c = c " + op +
                                                 (value[0] == '(' ? " " + value : " (" + value + ")") +
                                                 "; r = c;");
            for (size_t i = 0; i < plain.size(); i++)
                EXPECT_EQ(compound[i], plain[i]) << op << " " << value;
        }
    const std::vector<Vec3f> factor = run("color c = color(1, 2, 4); c *= noise(q); r = c;"),
                             summand = run("color c = 0; c += noise(q); r = c;"),
                             floats = run("float f = 1; f *= noise(q); r = f;"),
                             vectors = run("vector w = 0; w += noise(q); r = color w;");
    bool colored = false, pointed = false;
    for (size_t i = 0; i < factor.size(); i++) {
        EXPECT_NEAR(factor[i].y, 2 * factor[i].x, 1e-6f);
        EXPECT_NEAR(factor[i].z, 4 * factor[i].x, 1e-6f);
        EXPECT_NEAR(factor[i].x, floats[i].x, 1e-6f);
        colored = colored || std::abs(summand[i].x - summand[i].y) > 0.01f;
        pointed = pointed || std::abs(vectors[i].x - vectors[i].y) > 0.01f;
    }
    EXPECT_TRUE(colored && pointed);
    // Initialisers, results and arguments say what they want.
    const auto differ = [](const std::vector<Vec3f>& r) {
        return std::ranges::any_of(r, [](const Vec3f& x) { return std::abs(x.x - x.y) > 0.01f; });
    };
    EXPECT_TRUE(differ(run("color c = noise(q); r = c;")));
    EXPECT_TRUE(differ(evaluate("r = f(P * 3.1 + 0.2);", "color f(point q) { return noise(q); }")));
    EXPECT_TRUE(differ(evaluate("r = f(noise(P * 3.1 + 0.2));", "color f(color c) { return c; }")));
    EXPECT_FALSE(differ(evaluate("r = f(noise(P * 3.1 + 0.2));", "color f(float c) { return c; }")));
}

TEST(SlLanguage, Loops) {
    expect("float i, x = 0; for (i = 0; i < 5; i += 1) x += i; r = x;", [](float, float) { return 10.0f; });
    expect("float i = 0, n = floor(u * 8); while (i < n) { i += 1; } r = i;",
           [](float u, float) { return std::floor(u * 8); });
    expect("float i, x = 0; for (i = 0; i < 10; i += 1) { if (i > u * 8) break; if (mod(i, 2) == 0) "
           "continue; x += 1; } r = x;",
           [](float u, float) {
               float x = 0;
               for (int i = 0; i < 10; i++) {
                   if (float(i) > u * 8)
                       break;
                   if (i % 2 == 0)
                       continue;
                   x += 1;
               }
               return x;
           });
    expect("float i, j, x = 0; for (i = 0; i < 4; i += 1) { for (j = 0; j < 4; j += 1) { if (j + i > u * 6) "
           "break 2; x += 1; } } r = x;",
           [](float u, float) {
               float x = 0;
               for (int i = 0; i < 4; i++)
                   for (int j = 0; j < 4; j++) {
                       if (float(i + j) > u * 6)
                           return x;
                       x += 1;
                   }
               return x;
           });
    expect("float i, j, x = 0; for (i = 0; i < 4; i += 1) { for (j = 0; j < 4; j += 1) { if (j > v * 4) "
           "continue 2; x += 1; } x += 100; } r = x;",
           [](float, float v) {
               float x = 0;
               for (int i = 0; i < 4; i++) {
                   bool next = false;
                   for (int j = 0; j < 4 && !next; j++) {
                       if (float(j) > v * 4)
                           next = true;
                       else
                           x += 1;
                   }
                   x += next ? 0 : 100;
               }
               return x;
           });
    expect("float i, x = 0; if (u > 0.4) for (i = 0; i < 3; i += 1) x += 2; r = x;",
           [](float u, float) { return u > 0.4f ? 6.0f : 0.0f; });
}

TEST(SlLanguage, FunctionsAndReturns) {
    const char* before = R"(
float early(float x) { if (x > 0.7) return 3; if (x > 0.3) { return 2; } return 1; }
void both(float a; output float b, c) { b = a * 2; c = a + 1; }
float search(float limit) { float i; for (i = 0; i < 20; i += 1) { if (i * 0.1 > limit) return i; } return -1; }
color pick(color a, b; float k) { return mix(a, b, k); }
float over(float x) { return x; }
float over(color c) { return comp(c, 0) * 10; }
)";
    expect("r = early(u);", [](float u, float) { return u > 0.7f ? 3.0f : u > 0.3f ? 2.0f : 1.0f; }, before);
    expect(
        "float p, q; both(u, p, q); r = p + 10 * q;", [](float u, float) { return 2 * u + 10 * (u + 1); },
        before);
    expect(
        "r = search(v);",
        [](float, float v) {
            for (int i = 0; i < 20; i++)
                if (float(i) * 0.1f > v)
                    return float(i);
            return -1.0f;
        },
        before);
    expect(
        "float x = 0; if (v > 0.5) x = early(u) + search(u * 0.5) * 0; r = x;",
        [](float u, float v) {
            return v > 0.5f ? (u > 0.7f ? 3.0f : u > 0.3f ? 2.0f : 1.0f) : 0.0f;
        },
        before);
    expect("r = pick(color(0), color(1), u);", [](float u, float) { return u; }, before);
    expect("r = over(u) + over(color(v));", [](float u, float v) { return u + 10 * v; }, before);
    expect("float k = 2; float nested(float x) { extern float k; return x * k; } r = nested(u);",
           [](float u, float) { return 2 * u; });
    expect("float a[3]; a[1] = 5; float f(output float x) { x += 1; return x; } float y = f(a[1]); r = y + "
           "10 * a[1];",
           [](float, float) { return 66.0f; });
}

TEST(SlLanguage, Arrays) {
    expect("float a[4] = {1, 2, 3, 4}; r = a[2] + arraylength(a);", [](float, float) { return 7.0f; });
    expect("uniform float a[4] = {1, 2, 3, 4}; r = a[floor(u * 3.9)];",
           [](float u, float) { return 1 + std::floor(u * 3.9f); });
    expect("float a[3]; a[0] = u; a[1] = v; a[2] = 9; float k = floor(u * 2.9); a[k] += 1; r = a[0] + 10 * "
           "a[1] + 100 * a[2];",
           [](float u, float v) {
               float a[3] = {u, v, 9};
               a[int(std::floor(u * 2.9f))] += 1;
               return a[0] + 10 * a[1] + 100 * a[2];
           });
    expect("point a[2]; a[0] = P; a[1] = P * 2; float k = floor(u * 1.9); r = xcomp(a[k]);",
           [](float u, float) { return u * 1.9f >= 1 ? 4 * u : 2 * u; });
    expect("float a[2] = {3, 4}; float b[2] = a; b[0] = 1; r = a[0] + 10 * b[0] + 100 * b[1];",
           [](float, float) { return 413.0f; });
    expect("float total(float x[]) { float i, t = 0; for (i = 0; i < arraylength(x); i += 1) t += x[i]; "
           "return t; } float a[3] = {1, 2, 3}; r = total(a);",
           [](float, float) { return 6.0f; });
    expect("float a[3] = {1, 2, 3}; if (u > 0.5) a[1] = 10; r = a[1];",
           [](float u, float) { return u > 0.5f ? 10.0f : 2.0f; });
}

TEST(SlLanguage, DerivativesInsideControlFlow) {
    // In uniform loops and ifs, in functions, in varying ifs (over all lanes), with what lives across them.
    expect("float i, x = 0; for (i = 0; i < 3; i += 1) x += filterwidth(u * (i + 1)); r = x;",
           [](float, float) { return 0.125f * 6; });
    expect(
        "float fw(float x) { if (x < 0) return 0; return filterwidth(x); } float k = u * 2; r = fw(k) + k;",
        [](float u, float) { return 0.25f + 2 * u; });
    expect("float x = 1; if (u > 0.5) { float d = Du(u * u); x = d; if (v > 0.5) x += 1; } r = x;",
           [](float u, float v) { return u > 0.5f ? 2 * u + (v > 0.5f ? 1 : 0) : 1.0f; });
    expect("float i = 0, x = 0; while (i < floor(u * 8)) { x += filterwidth(v); i += 1; } r = x;",
           [](float u, float) { return std::floor(u * 8) * 0.2f; });
    expect("float a[3]; a[0] = u; a[1] = Du(u * u); a[2] = filterwidth(a[0]); r = a[0] + a[1] + a[2];",
           [](float u, float) { return u + 2 * u + 0.125f; });
    expect("color c = color(0); float i; for (i = 0; i < 2; i += 1) { if (i == 1) c += color "
           "texture(\"a.tx\", s, t); } r = c;",
           [](float u, float) { return u; });
    expect("float k = 0; float f() { extern float k; float i; for (i = 0; i < 8; i += 1) { k += "
           "filterwidth(u); if (i >= u * 4) return k; } return -1; } r = f();",
           [](float u, float) { return 0.125f * (std::ceil(u * 4) + 1); });
}

TEST(SlLanguage, OperatorsAndCasts) {
    expect("float x = 2; x += 3; x -= 1; x *= 4; x /= 8; r = x;", [](float, float) { return 2.0f; });
    expect("vector a = vector(1, 2, 3); a ^= vector(0, 0, 1); r = xcomp(a);",
           [](float, float) { return 2.0f; });
}

TEST(SlLanguage, Precedence) {
    // "." binds tighter than "*", "*" tighter than "^", "^" tighter than "+".
    expect("vector a = vector(u, 2, 3); r = 2 * a . vector(1, 0, 0) + 1;",
           [](float u, float) { return 2 * u + 1; });
    expect("vector a = vector(1, 0, 0), b = vector(0, 1, 0); vector c = a ^ b * 2 + a; r = zcomp(c) + 10 * "
           "xcomp(c);",
           [](float, float) { return 12.0f; });
    expect("r = -2 + 3 < 2 && 1 == 1 ? 5 : 6;", [](float, float) { return 5.0f; });
    expect("float x, y; x = y = u; r = x + y;", [](float u, float) { return 2 * u; });
    expect("r = (float) 3 + float u;", [](float u, float) { return 3 + u; });
    expect("r = color (1, 2, 3) * color 2;", [](float, float) { return 2.0f; });
    expect("float x = u > 0.5; r = x;", [](float u, float) { return u > 0.5f ? 1.0f : 0.0f; });
    expect("if (P == point(0, 0, 0)) r = 1;",
           [](float u, float v) { return u == 0 && v == 0 ? 1.0f : 0.0f; });
    expect("string a = \"x\"; if (a == \"x\" && a != \"y\") r = 3;", [](float, float) { return 3.0f; });
    expect("matrix m = matrix(2); setcomp(m, 3, 0, u); r = comp(m, 3, 0) + comp(m, 1, 1);",
           [](float u, float) { return u + 2; });
    expect("point p = P; setxcomp(p, 7); setycomp(p, u); r = xcomp(p) + ycomp(p);",
           [](float u, float) { return 7 + u; });
    expect("color c = 0; setcomp(c, 0, u); setcomp(c, 1, 5); r = c;", [](float u, float) { return u; });
}

TEST(SlLanguage, Preprocessor) {
    const char* before = R"(
#define SQUARE(x) ((x) * (x))
#define TWICE(x) SQUARE(x) + SQUARE(x)
#define NAME(a, b) a ## b
#define FLAG 1
#if FLAG && defined(KANUKA) && !defined(OTHER)
#define PART 3 \
   + 4
#else
#error not here
#endif
#ifdef OTHER
float broken( {
#elif 1
float fine(float x) { return x; }
#endif
#undef FLAG
#ifndef FLAG
#define AFTER 100
#endif
)";
    expect(
        "float NAME(al, pha) = TWICE(u + 1); r = alpha + PART + AFTER + fine(0);",
        [](float u, float) { return 2 * (u + 1) * (u + 1) + 107; }, before);
}

TEST(SlLanguage, IndexFaultsAreReportedAndClamped) {
    TestServices services;
    const auto r = evaluate("float a[3] = {1, 2, 3}; r = a[u * 8];", {}, 4e-6f, &services);
    EXPECT_EQ(r[0].x, 1);
    EXPECT_EQ(r[2].x, 3);
    EXPECT_EQ(r[8].x, 3);
    ASSERT_FALSE(services.reports.empty());
    EXPECT_NE(services.reports[0].find("test.sl:"), std::string::npos);
    EXPECT_NE(services.reports[0].find("outside of array"), std::string::npos);
    EXPECT_EQ(services.reports.size(), configs().size()); // once a run
    // Lanes that do not run cause no fault.
    TestServices quiet;
    evaluate("float a[3] = {1, 2, 3}; if (u < 0.3) r = a[u * 8];", {}, 4e-6f, &quiet);
    EXPECT_TRUE(quiet.reports.empty());
}

TEST(SlLanguage, VaryingParametersAndPrimvars) {
    const std::string source = probe("r = tint * k;", {},
                                     "varying color tint = color(1, 2, 3); float k = 2; uniform float "
                                     "unused[2] = {1, 2}; string name = \"x\";");
    for (const Config c : configs()) {
        Journal journal;
        const auto shader = compile(source, c, &journal);
        ASSERT_TRUE(shader) << messages(journal);
        EXPECT_NE(messages(journal).find("\"unused\" is never used"), std::string::npos);
        TestServices services;
        grid::Grid g = plane(8, 5);
        EXPECT_EQ(run_probe(*shader, g, services)[3].z, 6);
        const std::vector<Argument> args = {
            {"k", {3}, {}, false}, {"tint", {}, {}, true}, {"wrong", {1}, {}, false}};
        grid::Channel tint{"tint", 3, g.stride, std::vector<float>(size_t(g.stride) * 3)};
        for (int i = 0; i < g.vertices(); i++)
            tint.data[size_t(i)] = float(i);
        g.primvars.push_back(tint);
        const auto r = run_probe(*shader, g, services, args);
        EXPECT_EQ(r[3].x, 9);
        EXPECT_EQ(r[20].x, 60);
        ASSERT_EQ(services.reports.size(), 1u);
        EXPECT_NE(services.reports[0].find("no parameter \"wrong\""), std::string::npos);
        const auto constant = shader->instantiate({}, services);
        EXPECT_TRUE(constant->uniform_material());
        EXPECT_FALSE(shader->instantiate(args, services)->uniform_material());
    }
}

TEST(SlLanguage, MeshesWithoutNeighbours) {
    const auto shader = compile(probe("r = color(Du(s), length(calculatenormal(P)), s);"));
    TestServices services;
    grid::Grid g = plane(4999, 0); // more than a block
    for (int i = 0; i < 5000; i++)
        g.s[size_t(i)] = float(i);
    const auto r = run_probe(*shader, g, services);
    for (int i = 0; i < 5000; i++) {
        ASSERT_EQ(r[size_t(i)].x, 0);
        ASSERT_NEAR(r[size_t(i)].y, 1, 1e-6);
        ASSERT_EQ(r[size_t(i)].z, float(i));
    }
}

TEST(SlLanguage, DefaultsThatTheRunTimeComputes) {
    const auto shader =
        compile(probe("r = color(xcomp(p), k, 0);", {},
                      "point p = point \"shifted\" (1, 0, 0); float k = 2 * 3 + sin(0); float a = 1;"));
    TestServices services;
    grid::Grid g = plane(2, 2);
    EXPECT_EQ(run_probe(*shader, g, services)[0].x, 2);
    EXPECT_EQ(run_probe(*shader, g, services)[0].y, 6);
    EXPECT_TRUE(shader->parameters()[0].floats.empty());
    EXPECT_EQ(shader->parameters()[2].floats[0], 1);
    const std::vector<Argument> args = {{"p", {9, 0, 0}, {}, false}};
    EXPECT_EQ(run_probe(*shader, g, services, args)[0].x, 9);
}

} // namespace kanuka::sl::test
