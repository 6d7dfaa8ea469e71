// Light shaders over points: forms, cones, falloff, at every lane count.
#include "sl/test_support.h"

namespace kanuka::sl {
namespace {

using namespace test;

// Points Ps on the plane z = 0 over [0, 2] x [0, 1].
std::vector<Vec3f> emit(const std::string& source, Emission* emission = nullptr,
                        std::span<const Argument> arguments = {}) {
    std::vector<Vec3f> first;
    for (const Config c : configs()) {
        const auto shader = compile(source, c);
        if (!shader)
            return std::vector<Vec3f>(54, Vec3f(NAN, NAN, NAN));
        TestServices services;
        grid::Grid g = plane(8, 5);
        const Emission e = shader->instantiate(arguments, services)->emit(g, {}, services);
        const size_t stride = size_t(g.stride);
        for (size_t i = 0; i < size_t(g.vertices()); i++) {
            const Vec3f Cl(e.Cl[i], e.Cl[stride + i], e.Cl[2 * stride + i]);
            if (first.size() <= i)
                first.push_back(Cl);
            for (int k = 0; k < 3; k++)
                EXPECT_NEAR(Cl[k], first[i][k], 4e-6f * std::max(1.0f, first[i][k]))
                    << i << " lanes " << c.lanes;
        }
        if (emission)
            *emission = e;
    }
    return first;
}

Vec3f Ps(int i) {
    const grid::Grid g = plane(8, 5);
    return {g.P[size_t(i)], g.P[size_t(g.stride) + size_t(i)], 0};
}

} // namespace

TEST(Emission, PointLightFallsOffFromItsPlace) {
    Emission e;
    const auto Cl = emit("light p(float intensity = 3; point from = point \"shifted\" (0, 0, 0)) {"
                         " illuminate (from) Cl = intensity * color(1, 2, 3) / (L . L); }",
                         &e);
    EXPECT_EQ(e.form, Emission::Illuminate);
    EXPECT_EQ(e.from, Vec3f(1, 2, 3));
    for (int i = 0; i < 54; i++) {
        const Vec3f L = Ps(i) - Vec3f(1, 2, 3);
        for (int k = 0; k < 3; k++)
            EXPECT_NEAR(Cl[size_t(i)][k], 3 * float(k + 1) / dot(L, L), 1e-5f) << i;
    }
}

TEST(Emission, ConesAreDarkOutside) {
    Emission e;
    const auto Cl = emit("light s() { illuminate (point (1, 0, 1), vector (0, 0, -1), PI / 5) Cl = 1; }", &e);
    EXPECT_EQ(e.axis, Vec3f(0, 0, -1));
    EXPECT_NEAR(e.angle, Pi / 5, 1e-6f);
    int lit = 0;
    for (int i = 0; i < 54; i++) {
        const float tangent = length(Ps(i) - Vec3f(1, 0, 0));
        EXPECT_EQ(Cl[size_t(i)].x, tangent <= std::tan(Pi / 5) ? 1 : 0) << i;
        lit += Cl[size_t(i)].x > 0;
    }
    EXPECT_GT(lit, 5);
    EXPECT_LT(lit, 50);
}

TEST(Emission, SolarAndAmbientForms) {
    Emission e;
    auto Cl = emit("light d() { solar (vector (0, 1, -1), 0.1) Cl = color(0, xcomp(Ps), zcomp(L)); }", &e);
    EXPECT_EQ(e.form, Emission::Solar);
    EXPECT_EQ(e.axis, Vec3f(0, 1, -1));
    EXPECT_FLOAT_EQ(e.angle, 0.1f);
    for (int i = 0; i < 54; i++)
        EXPECT_EQ(Cl[size_t(i)], Vec3f(0, Ps(i).x, -1));
    Cl = emit("light a(color lightcolor = color(1, 2, 3)) { Cl = 2 * lightcolor; }", &e);
    EXPECT_EQ(e.form, Emission::Ambient);
    EXPECT_EQ(Cl[7], Vec3f(2, 4, 6));
    emit("light sky() { solar() Cl = color(normalize(L)); }", &e);
    EXPECT_EQ(e.form, Emission::Sky);
}

TEST(Emission, ParametersTexturesAndSpaces) {
    const std::vector<Argument> arguments = {{"tint", {5, 6, 7}, {}, false}};
    auto Cl =
        emit("light t(color tint = 1) { illuminate (P, N, 3) Cl = tint * color texture(\"a.tx\", xcomp(Ps), "
             "ycomp(Ps)) + zcomp(N); }",
             nullptr, arguments);
    for (int i = 0; i < 54; i++) {
        if (length(Ps(i)) > 0.3f) {
            EXPECT_NEAR(Cl[size_t(i)].x, 5 * Ps(i).x + 1, 1e-5f) << i;
        }
    }
}

TEST(Emission, MisplacedStatementsAreErrors) {
    for (const char* source :
         {"light l() { illuminate () Cl = 1; }", "light l() { solar (vector (0, 0, 1)) Cl = 1; }"}) {
        Journal journal;
        EXPECT_FALSE(compile(source, {}, &journal)) << source;
        EXPECT_NE(messages(journal).find("test.sl:1:"), std::string::npos) << messages(journal);
    }
}

// ---- volume and imager shaders

// Over the plane, with Ci = (u, v, 1/2) and Oi = u.
static std::vector<Vec3f> filter(const std::string& source) {
    std::vector<Vec3f> first;
    for (const Config c : configs()) {
        const auto shader = compile(source, c);
        if (!shader)
            return {};
        TestServices services;
        grid::Grid g = plane(8, 5);
        const size_t stride = size_t(g.stride);
        for (const char* name : {"Cs", "Os"}) {
            grid::Channel channel;
            channel.name = name;
            channel.components = 3;
            channel.stride = g.stride;
            channel.data.assign(3 * stride + 32, 0.5f);
            for (size_t i = 0; i < stride; i++) {
                channel.data[i] = g.u[i];
                channel.data[stride + i] = name[0] == 'C' ? g.v[i] : g.u[i];
            }
            g.primvars.push_back(std::move(channel));
        }
        const Filtered f = shader->instantiate({}, services)->filter(g, {}, services);
        for (size_t i = 0; i < size_t(g.vertices()); i++) {
            const Vec3f r(f.Ci[i], f.Ci[stride + i], f.alpha[i]);
            if (first.size() <= i)
                first.push_back(r);
            EXPECT_NEAR(length(r - first[i]), 0, 1e-6f) << i << " lanes " << c.lanes;
        }
    }
    return first;
}

TEST(Emission, AnAreaLightRunsOnItself) {
    Journal journal;
    CompileOptions options;
    options.use_cache = false;
    options.area_light = true;
    const auto run = [&](const std::string& source) {
        const auto shader = compile_source("a.sl", source, options, journal);
        EXPECT_TRUE(shader) << messages(journal);
        TestServices services;
        grid::Grid g = plane(8, 5);
        return shader->instantiate({}, services)->emit(g, {}, services);
    };
    const size_t stride = size_t(plane(8, 5).stride);
    const Emission varying =
        run("light a() { illuminate (P, N, PI / 3) Cl = color(u, xcomp(P), zcomp(L)) / (L . L); }");
    EXPECT_FALSE(varying.uniform);
    EXPECT_EQ(varying.axis, Vec3f(0, 0, 1));
    EXPECT_NEAR(varying.angle, Pi / 3, 1e-6f);
    for (size_t i = 0; i < 54; i++) {
        const float u = float(i % 9) / 8;
        EXPECT_NEAR(varying.Cl[i], u, 1e-6f);
        EXPECT_NEAR(varying.Cl[stride + i], 2 * u, 1e-6f);
        EXPECT_NEAR(varying.Cl[2 * stride + i], 1, 1e-6f);
    }
    const Emission uniform =
        run("light a(color c = color(1, 2, 3)) { illuminate (P, N, PI / 2) Cl = c / PI; }");
    EXPECT_TRUE(uniform.uniform);
    EXPECT_NEAR(uniform.Cl[stride + 53], 2 / Pi, 1e-6f);
}

TEST(Filter, ImagersSeeColorAndCoverage) {
    const auto r = filter(
        "imager back(color bgcolor = color(0, 1, 0)) { Ci += (1 - alpha) * bgcolor; Oi = 1; alpha = 1; }");
    ASSERT_EQ(r.size(), 54u);
    for (int i = 0; i < 54; i++) {
        const float u = float(i % 9) / 8, v = float(i / 9) / 5;
        EXPECT_NEAR(r[size_t(i)].x, u, 1e-6f);
        EXPECT_NEAR(r[size_t(i)].y, v + 1 - u, 1e-6f);
        EXPECT_EQ(r[size_t(i)].z, 1);
    }
}

TEST(Filter, VolumesMixByDistance) {
    const auto r =
        filter("volume fog(float d = 2) { float f = 1 - exp(-length(I) / d); Ci = mix(Ci, color 1, f); }");
    ASSERT_EQ(r.size(), 54u);
    for (int i = 0; i < 54; i++) {
        const float u = float(i % 9) / 8, v = float(i / 9) / 5, f = 1 - std::exp(-std::hypot(2 * u, v) / 2);
        EXPECT_NEAR(r[size_t(i)].x, u + f * (1 - u), 1e-5f);
        EXPECT_EQ(r[size_t(i)].z, u); // untouched
    }
}

} // namespace kanuka::sl
