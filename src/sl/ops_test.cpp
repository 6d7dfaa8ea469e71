// Every shadeop at every lane count and optimisation level, against values computed here.
#include <filesystem>
#include <fstream>

#include "sl/ops/noise.h"
#include "sl/ops/shadeops.h"
#include "sl/test_support.h"

namespace kanuka::sl::test {

// At vertex k of the plane: u = s = (k % 9) / 8, v = t = (k / 9) / 5, P = (2u, v, 0), N = (0, 0, 1).
struct Case {
    const char* expression; // of type float, in terms of u and v
    float (*expected)(float u, float v);
};

static float sgn(float x) {
    return x < 0 ? -1 : x > 0 ? 1 : 0;
}
static float floormod(float a, float b) {
    return a - b * std::floor(a / b);
}

static const Case cases[] = {
    {"radians(180 * u)", [](float u, float) { return u * Pi; }},
    {"degrees(PI * u)", [](float u, float) { return 180 * u; }},
    {"sin(5 * u - 2)", [](float u, float) { return std::sin(5 * u - 2); }},
    {"cos(5 * u)", [](float u, float) { return std::cos(5 * u); }},
    {"tan(u)", [](float u, float) { return std::tan(u); }},
    {"asin(2 * u - 1)", [](float u, float) { return std::asin(2 * u - 1); }},
    {"acos(3 * u - 1)", [](float u, float) { return std::acos(std::min(1.0f, 3 * u - 1)); }},
    {"atan(4 * u - 2)", [](float u, float) { return std::atan(4 * u - 2); }},
    {"atan(v - 0.5, u - 0.45)", [](float u, float v) { return std::atan2(v - 0.5f, u - 0.45f); }},
    {"exp(3 * u)", [](float u, float) { return std::exp(3 * u); }},
    {"log(u + 0.5)", [](float u, float) { return std::log(u + 0.5f); }},
    {"log(u + 0.5, 2)", [](float u, float) { return std::log2(u + 0.5f); }},
    {"pow(u + 0.1, 2.5)", [](float u, float) { return std::pow(u + 0.1f, 2.5f); }},
    {"sqrt(u)", [](float u, float) { return std::sqrt(u); }},
    {"sqrt(u - 1)", [](float, float) { return 0.0f; }},
    {"inversesqrt(u + 1)", [](float u, float) { return 1 / std::sqrt(u + 1); }},
    {"mod(7 * u - 3, 1.5)", [](float u, float) { return floormod(7 * u - 3, 1.5f); }},
    {"abs(u - 0.5)", [](float u, float) { return std::abs(u - 0.5f); }},
    {"sign(u - 0.5)", [](float u, float) { return sgn(u - 0.5f); }},
    {"floor(5.3 * u - 2)", [](float u, float) { return std::floor(5.3f * u - 2); }},
    {"ceil(5.3 * u - 2)", [](float u, float) { return std::ceil(5.3f * u - 2); }},
    {"round(5.3 * u)", [](float u, float) { return std::floor(5.3f * u + 0.5f); }},
    {"min(u, v, 0.3)", [](float u, float v) { return std::min({u, v, 0.3f}); }},
    {"max(u, v, 0.3, 0.4)", [](float u, float v) { return std::max({u, v, 0.4f}); }},
    {"determinant(2) + determinant(u + 1)",
     [](float u, float) { return 16 + std::pow(u + 1, 4.0f); }}, // of a float: on the diagonal
    {"clamp(u, 0.2, 0.7)", [](float u, float) { return std::clamp(u, 0.2f, 0.7f); }},
    {"mix(2, 5, u)", [](float u, float) { return 2 * (1 - u) + 5 * u; }},
    {"step(0.5, u)", [](float u, float) { return u < 0.5f ? 0.0f : 1.0f; }},
    {"smoothstep(0.2, 0.8, u)",
     [](float u, float) {
         const float t = std::clamp((u - 0.2f) / (0.8f - 0.2f), 0.0f, 1.0f);
         return t * t * (3 - 2 * t);
     }},
    {"linearstep(0.2, 0.8, u)",
     [](float u, float) { return std::clamp((u - 0.2f) / (0.8f - 0.2f), 0.0f, 1.0f); }},
    {"filterstep(0.5, u)",
     [](float u, float) { return std::clamp((u + 0.0625f - 0.5f) / 0.125f, 0.0f, 1.0f); }},
    // geometry
    {"length(vector(u, v, 1))", [](float u, float v) { return std::sqrt(u * u + v * v + 1); }},
    {"distance(P, point(0, 0, 1))", [](float u, float v) { return std::sqrt(4 * u * u + v * v + 1); }},
    {"xcomp(P) + 10 * ycomp(P) + zcomp(N)", [](float u, float v) { return 2 * u + 10 * v + 1; }},
    {"comp(color(u, v, 3), 1)", [](float, float v) { return v; }},
    {"comp(color(u, v, 3), floor(2.9 * u))",
     [](float u, float v) { return u < 1 / 2.9f   ? u
                                   : u < 2 / 2.9f ? v
                                                  : 3.0f; }},
    {"zcomp(normalize(vector(u, v, 2)))", [](float u, float v) { return 2 / std::sqrt(u * u + v * v + 4); }},
    {"length(normalize(vector(0)))", [](float, float) { return 0.0f; }},
    {"xcomp(reflect(vector(u, v, -1), N)) + zcomp(reflect(vector(u, v, -1), N))",
     [](float u, float) { return u + 1; }},
    {"zcomp(refract(vector(0, 0, -1), N, 1.5))", [](float, float) { return -1.0f; }},
    {"ptlined(P, point(0, 0, 0), point(2, 0, 0))", [](float, float v) { return v; }},
    {"ycomp(rotate(point(1 + u, 0, 0), PI / 2, point(0), point(0, 0, 1)))",
     [](float u, float) { return 1 + u; }},
    {"zcomp(faceforward(N, vector(0, 0, 1)))", [](float, float) { return -1.0f; }},
    {"zcomp(faceforward(N, vector(0, 0, -1)))", [](float, float) { return 1.0f; }},
    {"zcomp(faceforward(N, I))", [](float, float) { return 1.0f; }},
    {"vector(u, v, 1) . vector(2, 3, 4)", [](float u, float v) { return 2 * u + 3 * v + 4; }},
    {"zcomp(vector(u, v, 0) ^ vector(1, 2, 0))", [](float u, float v) { return 2 * u - v; }},
    {"depth(point(u, v, 5))", [](float, float) { return 5.0f; }},
    // spaces: "shifted" lies at (1, 2, 3), "scaled" is twice as large
    {"xcomp(point \"shifted\" (u, 0, 0))", [](float u, float) { return u + 1; }},
    {"ycomp(transform(\"shifted\", P))", [](float, float v) { return v - 2; }},
    {"zcomp(transform(\"shifted\", \"current\", point(0, 0, u)))", [](float u, float) { return u + 3; }},
    {"xcomp(vtransform(\"shifted\", vector(u, 0, 0)))", [](float u, float) { return u; }},
    {"xcomp(vector \"scaled\" (u, 0, 0))", [](float u, float) { return 2 * u; }},
    {"xcomp(ntransform(\"scaled\", \"current\", normal(u, 0, 0)))", [](float u, float) { return u / 2; }},
    // matrices
    {"comp(matrix(2), 1, 1) + comp(matrix(2), 0, 1)", [](float, float) { return 2.0f; }},
    {"determinant(matrix(1 + u))", [](float u, float) { return std::pow(1 + u, 4.0f); }},
    {"comp(matrix(1,0,0,0, 0,1,0,0, 0,0,1,0, u,v,3,1) / matrix(1,0,0,0, 0,1,0,0, 0,0,1,0, u,v,2,1), 3, 2)",
     [](float, float) { return 1.0f; }},
    {"xcomp(transform(translate(matrix(1), vector(u, 2, 3)), point(1, 0, 0)))",
     [](float u, float) { return 1 + u; }},
    {"ycomp(transform(rotate(matrix(1), PI / 2, vector(0, 0, 1)), point(1 + u, 0, 0)))",
     [](float u, float) { return 1 + u; }},
    {"zcomp(transform(scale(matrix(1), point(1, 2, 3)), point(1, 1, u)))",
     [](float u, float) { return 3 * u; }},
    // colours
    {"comp(ctransform(\"hsv\", color(1, 0, 0)), 2) + comp(ctransform(\"hsv\", color(0, 1, 0)), 0)",
     [](float, float) { return 1 + 1 / 3.0f; }},
    {"comp(color \"hsv\" (u, 1, 1), 0)",
     [](float u, float) {
         const float k = floormod(u + 1 / 3.0f, 1) * 6;
         return k < 1 ? k : k < 3 ? 1 : k < 4 ? 4 - k : 0;
     }},
    {"comp(ctransform(\"hsl\", \"rgb\", ctransform(\"hsl\", color(u, v, 0.3))), 0)",
     [](float u, float) { return u; }},
    {"comp(ctransform(\"xyz\", \"rgb\", ctransform(\"xyz\", color(u, v, 0.3))), 1)",
     [](float, float v) { return v; }},
    {"comp(ctransform(\"yiq\", \"rgb\", ctransform(\"yiq\", color(u, v, 0.3))), 2)",
     [](float, float) { return 0.3f; }},
    {"comp(ctransform(\"xyY\", \"rgb\", ctransform(\"xyY\", color(u, v, 0.3))), 1)",
     [](float, float v) { return v; }},
    {"luminance(color(u, u, u))", [](float u, float) { return u; }},
    // derivatives: the grid is a plane of 8 x 5 cells
    {"Du(3 * u * u)", [](float u, float) { return 6 * u; }},
    {"Dv(v * v * 2)", [](float, float v) { return 4 * v; }},
    {"length(Du(P)) + length(Dv(P))", [](float, float) { return 3.0f; }},
    {"Deriv(u * u, u)", [](float u, float) { return 2 * u; }},
    {"area(P)", [](float, float) { return 0.25f * 0.2f; }},
    {"filterwidth(u)", [](float, float) { return 0.125f; }},
    {"filterwidthp(P)", [](float, float) { return std::sqrt(0.05f); }},
    {"zcomp(normalize(calculatenormal(P + N * (u + v))))",
     [](float, float) { return 1 / std::sqrt(1 + 0.25f + 1); }},
    {"Du(3)", [](float, float) { return 0.0f; }},
    // splines
    {"spline(u, 0, 1, 2, 3, 4, 5)", [](float u, float) { return 1 + 3 * u; }},
    {"spline(\"linear\", u, 9, 0, 1, 0, 9)", [](float u, float) { return u < 0.5f ? 2 * u : 2 - 2 * u; }},
    {"spline(\"bezier\", u, 0, 0, 1, 1)", [](float u, float) { return u * u * (3 - 2 * u); }},
    {"spline(\"bspline\", u, 0, 1, 2, 3)", [](float u, float) { return 1 + u; }},
    {"comp(spline(u, color(0), color(1), color(2), color(3)), 1)", [](float u, float) { return 1 + u; }},
    // textures: the test's texture is (s, t, 0.25)
    {"float texture(\"a.tx\")", [](float u, float) { return u; }},
    {"comp(color texture(\"a.tx\", u * 2, v), 0)", [](float u, float) { return 2 * u; }},
    {"float texture(\"a.tx\"[1], u, v, \"blur\", 0.1, \"swidth\", 2)", [](float, float v) { return v; }},
    {"float texture(\"a.tx\", u, v, u + 1, v, u + 1, v + 1, u, v + 1)",
     [](float u, float) { return u + 0.5f; }},
    {"comp(color environment(\"e.tx\", vector(u, v, 7)), 2)", [](float, float) { return 7.0f; }},
    // strings
    {"match(\"ab+\", \"xxabbb\") + match(\"^b\", \"ab\")", [](float, float) { return 1.0f; }},
    {"concat(\"a\", \"b\", \"c\") == \"abc\" ? 1 : 0", [](float, float) { return 1.0f; }},
    {"format(\"%d %s %%\", 3, \"x\") == \"3 x %\" ? 1 : 0", [](float, float) { return 1.0f; }},
    {"shadername() == \"probe\" ? 1 : 0", [](float, float) { return 1.0f; }},
};

TEST(SlOps, Values) {
    // Many at a time: compiling dominates.
    const size_t n = std::size(cases);
    for (size_t begin = 0; begin < n; begin += 3) {
        std::string s;
        for (size_t k = 0; k < 3; k++)
            s += "float r" + std::to_string(k) + " = " + (begin + k < n ? cases[begin + k].expression : "0") +
                 ";\n";
        s += "r = color(r0, r1, r2);";
        const std::vector<Vec3f> r = evaluate(s);
        ASSERT_EQ(r.size(), 54u);
        for (size_t k = 0; k < 3 && begin + k < n; k++)
            for (int i = 0; i < 54; i++) {
                const float u = float(i % 9) / 8, v = float(i / 9) / 5;
                const float expected = cases[begin + k].expected(u, v);
                EXPECT_NEAR(r[size_t(i)][int(k)], expected, 2e-5f * std::max(1.0f, std::abs(expected)))
                    << cases[begin + k].expression << " at u = " << u << ", v = " << v;
            }
    }
}

TEST(SlOps, NoiseRangesMeansAndTypes) {
    const char* expressions[] = {
        "float noise(P * 37.7)",           "float noise(u * 31.3)",
        "float noise(u * 31.3, v * 17.9)", "float noise(P * 17.3, u * 9.1)",
        "float cellnoise(P * 37.7)",       "float pnoise(P * 20, point(4, 5, 6))",
        "float pnoise(u * 20, 5)",         "random()",
    };
    for (const char* e : expressions) {
        const std::string statements = std::string("float x = ") + e + "; r = color(x, x * x, 0);";
        const auto shader = compile(probe(statements));
        ASSERT_TRUE(shader);
        TestServices services;
        grid::Grid g = plane(63, 63);
        const auto values = run_probe(*shader, g, services);
        double sum = 0, squares = 0;
        for (const Vec3f& v : values) {
            EXPECT_GE(v.x, 0) << e;
            EXPECT_LE(v.x, 1) << e;
            sum += v.x;
            squares += v.y;
        }
        const double n = double(values.size()), mean = sum / n;
        EXPECT_NEAR(mean, 0.5, 0.06) << e;
        EXPECT_GT(squares / n - mean * mean, 0.005) << e; // it does vary
    }
    // color and point noise: components differ; a context that wants a color gets one
    const auto r = evaluate("r = noise(P * 7.3);");
    EXPECT_NE(r[10].x, r[10].y);
    const auto f = evaluate("vector d = N * noise(P * 7.3); r = color(xcomp(d), ycomp(d), zcomp(d));");
    EXPECT_EQ(f[10].x, 0);
    EXPECT_NE(f[10].z, 0);
}

TEST(SlOps, NoiseIsContinuousAndPeriodic) {
    const auto r =
        evaluate("r = color(noise(P * 5 + 1e-4) - noise(P * 5), pnoise(u, v, 1, 1), pnoise(point(u + 3, v + "
                 "4, 5), point(3, 4, 5)) - pnoise(point(u, v, 0), point(3, 4, 5)));");
    for (const Vec3f& v : r) {
        EXPECT_LT(std::abs(v.x), 1e-3);
        EXPECT_NEAR(v.z, 0, 1e-5);
    }
    EXPECT_NEAR(r[0].y, r[8].y, 1e-6); // u = 0 and u = 1
}

TEST(SlOps, NoiseLanesAgreeToTheBit) {
    for (size_t k = 0; k < ops::noise_kernels().size(); k++) {
        const ops::NoiseKernel& kernel = ops::noise_kernels()[k];
        const ops::NoiseFunction one = ops::noise_function(int(k), 1);
        for (int width : {8, 16}) {
            const ops::NoiseFunction wide = ops::noise_function(int(k), width);
            if (!wide)
                continue;
            float in[8 * 16], out[3 * 16];
            for (int i = 0; i < 8 * width; i++)
                in[i] = i % 11 == 10 ? NAN : float((i * 7919) % 1009) * 0.37f - 150.0f;
            in[3] = 1e30f;
            wide(in, out);
            for (int lane = 0; lane < width; lane++) {
                float single[8], result[3];
                for (int c = 0; c < kernel.inputs(); c++)
                    single[c] = in[c * width + lane];
                one(single, result);
                for (int c = 0; c < kernel.results; c++)
                    EXPECT_EQ(std::memcmp(&result[c], &out[c * width + lane], 4), 0)
                        << kernel.symbol << " lane " << lane;
            }
        }
    }
}

TEST(SlOps, TableIsConsistent) {
    for (const ops::Shadeop& op : ops::shadeops()) {
        EXPECT_FALSE(op.signatures.empty()) << op.name;
        EXPECT_TRUE(op.name.starts_with("__") || !op.doc.empty()) << op.name;
        for (const ops::Signature& s : op.signatures)
            EXPECT_NE(s.result.base, ast::Base::Error) << op.name;
    }
    EXPECT_NE(ops::shadeops_manual().find("**noise**"), std::string::npos);
}

// docs/shadeops.md is printed from the table; KANUKA_WRITE_DOCS=1 writes it anew.
TEST(SlOps, ManualIsUpToDate) {
    const std::filesystem::path file = std::filesystem::path(KANUKA_SOURCE_DIR) / "docs/shadeops.md";
    if (std::getenv("KANUKA_WRITE_DOCS"))
        std::ofstream(file) << ops::shadeops_manual();
    std::ifstream in(file);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(text, ops::shadeops_manual()) << "run this test with KANUKA_WRITE_DOCS=1";
}

TEST(SlOps, SpacesAndPrintfReport) {
    TestServices services;
    evaluate("r = color(xcomp(transform(\"nowhere\", P)), 0, 0); printf(\"hello %f\\n\", 2);", {}, 4e-6f,
             &services);
    bool space = false, hello = false;
    for (const std::string& s : services.reports) {
        space = space || s.find("nowhere") != std::string::npos;
        hello = hello || s.find("hello 2") != std::string::npos;
    }
    EXPECT_TRUE(space);
    EXPECT_TRUE(hello);
}

} // namespace kanuka::sl::test
