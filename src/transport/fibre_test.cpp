// Light on fibres: round, of one layer where nothing refracts, in place, in instances and in motion.
#include <gtest/gtest.h>

#include "transport/test_scene.h"

namespace kanuka::transport {

using namespace testing;

namespace {

constexpr int Size = 32;
constexpr float Far = 1000, Radius = 1;

// An upright fibre of four segments that fills the picture from side to side.
void add_fibre(TestScene& s, const std::vector<Lobe>& lobes, float at = 0, bool narrows = false,
               const std::vector<float>& later = {}) {
    constexpr int Vertices = 5;
    grid::Grid g;
    g.allocate(Vertices - 1, 0);
    grid::TracedMesh mesh;
    mesh.vertices_per_face = 1;
    mesh.around = true;
    for (int k = 0; k < Vertices; k++) {
        const size_t i = size_t(k), n = size_t(g.stride);
        g.P[i] = at, g.P[i + n] = 10.0f * float(k - 2), g.P[i + 2 * n] = Far;
        g.N[i + 2 * n] = -1;
        mesh.radius.push_back(narrows ? Radius * (1.5f - 0.25f * float(k)) : Radius);
        if (k + 1 < Vertices)
            mesh.indices.push_back(uint32_t(k));
    }
    for (const float x : later) {
        g.later.push_back({g.P, g.N});
        std::fill_n(g.later.back().P.begin(), Vertices, x);
        mesh.later_radius.push_back(mesh.radius);
    }
    s.inputs.moving = !later.empty();
    std::vector<Vec3f> values;
    const auto program = make_program(lobes, values);
    grid::VertexInputs in;
    in.stride = g.stride;
    for (const Vec3f& v : values)
        in.slots.push_back({true, v, {}});
    s.add({&g, nullptr, &mesh, &in}, program);
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, Radius / Far, Size, Size);
}

scene::Light sun(double degrees) { // from behind the camera at 0, from its left at 90
    scene::Light l;
    l.kind = scene::Light::Kind::Distant;
    l.amount = Rgb(1);
    l.world_from_light = Transform::rotate(degrees, 0, 1, 0);
    return l;
}

double mean(TestScene& s, int lanes = 8) {
    double sum = 0;
    for (const PixelSums& p : s.render(16, lanes))
        sum += double(p.rgb[1]) / (Size * Size);
    return sum;
}

// Of a cylinder that is lit from an angle a to the viewer, the mean over what is seen of the cosine to the
// light.
double lit_cylinder(double a) {
    constexpr int N = 20000;
    double sum = 0;
    for (int i = 0; i < N; i++) {
        const double x = 2 * (i + 0.5) / N - 1, z = std::sqrt(1 - x * x);
        sum += std::max(0.0, z * std::cos(a) - x * std::sin(a)) / N;
    }
    return sum;
}

TEST(Fibres, AreLitAsCylinders) {
    for (const int degrees : {0, 40, 90, 140}) {
        TestScene s;
        add_fibre(s, {matte(Rgb(0.6f))});
        s.inputs.lights = {sun(degrees)};
        s.inputs.max_depth = 1;
        s.finish();
        const double expected = 0.6 * InvPi * lit_cylinder(degrees * Pi / 180);
        EXPECT_NEAR(mean(s), expected, 0.01 * expected + 1e-4) << degrees;
        EXPECT_EQ(mean(s, 1), mean(s, 8));
    }
}

// Lit from behind, what lets light through does so once: the path out is free.
TEST(Fibres, AreOneLayer) {
    TestScene s;
    add_fibre(s, {{grid::LobeId::LambertBtdf, {Rgb(0.6f)}}});
    s.inputs.lights = {sun(180)};
    s.finish();
    const double expected = 0.6 * InvPi * lit_cylinder(0);
    EXPECT_NEAR(mean(s), expected, 0.01 * expected);
}

// White ones vanish before a white sky: no light is lost inside of them, and none comes twice.
TEST(Fibres, Furnace) {
    const Transform stretched = Transform::rotate(20, 0, 0, 1) * Transform::scale(-1.3, 0.9, 1.2);
    for (const bool narrows : {false, true})
        for (const bool instanced : {false, true})
            for (const Lobe& lobe : {matte(Rgb(1)), glass(0), metal(0)}) {
                TestScene s;
                add_fibre(s, {lobe}, 0.2f, narrows);
                s.inputs.lights = {constant_sky(Rgb(1))};
                s.inputs.max_depth = 64;
                s.finish(instanced ? 0 : -1, stretched);
                EXPECT_NEAR(mean(s), 1, 0.005) << narrows << instanced << int(lobe.id);
                EXPECT_EQ(s.nan_samples, 0u);
            }
}

// Over its path through the picture it is in each place for its part of the time.
TEST(Fibres, Move) {
    TestScene s;
    add_fibre(s, {matte(Rgb(1))}, -4, false, {4});
    s.inputs.lights = {sun(0)};
    s.inputs.max_depth = 1;
    s.finish();
    // Covered for a quarter of the time, the distance of a width of 2 out of 8, by what is lit as from the
    // camera.
    double sum = 0;
    for (const PixelSums& p : s.render(1024, 8))
        sum += double(p.rgb[1]) / (Size * Size);
    const double expected = 0.25 * InvPi * lit_cylinder(0);
    EXPECT_NEAR(sum, expected, 0.02 * expected);
}

// The same path there and back, lit from the side: the shadow that a fibre casts on itself goes with it.
TEST(Fibres, MoveThereAndBack) {
    for (const float side : {-4.0f, 4.0f}) {
        TestScene s;
        add_fibre(s, {matte(Rgb(1))}, side, false, {-side, side});
        s.inputs.lights = {sun(90)};
        s.inputs.max_depth = 1;
        s.finish();
        double sum = 0;
        for (const PixelSums& p : s.render(256, 8))
            sum += double(p.rgb[1]) / (Size * Size);
        const double expected = 0.25 * InvPi * lit_cylinder(Pi / 2);
        EXPECT_NEAR(sum, expected, 0.03 * expected) << side;
    }
}

// ---- balls

// One ball that fills the picture from side to side.
void add_ball(TestScene& s, const std::vector<Lobe>& lobes) {
    grid::Grid g;
    g.allocate(0, 0);
    g.P[2 * size_t(g.stride)] = Far;
    g.N[2 * size_t(g.stride)] = -1;
    grid::TracedMesh mesh;
    mesh.vertices_per_face = 1;
    mesh.around = mesh.balls = true;
    mesh.radius = {Radius};
    mesh.indices = {0};
    std::vector<Vec3f> values;
    const auto program = make_program(lobes, values);
    grid::VertexInputs in;
    in.stride = g.stride;
    for (const Vec3f& v : values)
        in.slots.push_back({true, v, {}});
    s.add({&g, nullptr, &mesh, &in}, program);
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, Radius / Far, Size, Size);
}

// Flux of a matte ball towards the viewer, lit from an angle: Lambert's law for spheres (Russell 1916, "On
// the albedo of the planets and their satellites"). Of the square picture the ball is pi / 4.
TEST(Balls, AreLitAsSpheres) {
    for (const int degrees : {0, 40, 90, 140}) {
        TestScene s;
        add_ball(s, {matte(Rgb(0.6f))});
        s.inputs.lights = {sun(degrees)};
        s.inputs.max_depth = 1;
        s.finish();
        const double a = degrees * double(Pi) / 180, phase = (std::sin(a) + (Pi - a) * std::cos(a)) / Pi,
                     expected = 0.6 * InvPi * (2.0 / 3) * phase * Pi / 4;
        EXPECT_NEAR(mean(s), expected, 0.01 * expected + 1e-4) << degrees;
        EXPECT_EQ(mean(s, 1), mean(s, 8));
    }
}

TEST(Balls, Furnace) {
    for (const Lobe& lobe : {matte(Rgb(1)), glass(0), metal(0)})
        for (const bool instanced : {false, true}) {
            TestScene s;
            add_ball(s, {lobe});
            s.inputs.lights = {constant_sky(Rgb(1))};
            s.inputs.max_depth = 64;
            s.finish(instanced ? 0 : -1, Transform::scale(-1.3, 0.9, 1.2));
            EXPECT_NEAR(mean(s), 1, 0.005) << instanced << int(lobe.id);
            EXPECT_EQ(s.nan_samples, 0u);
        }
}

// ---- between vertices

// A square of one cell with the value of an input at its corners.
double seen_between(const Lobe& lobe, size_t input, std::array<float, 4> corners, const Vec3f& at) {
    TestScene s;
    std::vector<Vec3f> values;
    auto program = make_program({lobe}, values);
    grid::Grid g;
    g.allocate(1, 1);
    grid::TracedGrid t;
    t.mu = t.mv = 1;
    grid::VertexInputs in;
    in.stride = g.stride;
    for (const Vec3f& v : values)
        in.slots.push_back({true, v, {}});
    grid::SlotValues& varying = in.slots[size_t(program.nodes[0].inputs[input])];
    varying = {false, {}, std::vector<float>(size_t(g.stride), 0.0f)};
    for (size_t i = 0; i < 4; i++) {
        const float p[3] = {i % 2 ? 1.0f : -1.0f, i / 2 ? 1.0f : -1.0f, 2};
        for (size_t c = 0; c < 3; c++)
            g.P[i + c * size_t(g.stride)] = p[c], t.P.push_back(p[c]);
        g.N[i + 2 * size_t(g.stride)] = -1;
        g.dPdu[i] = 1;
        varying.data[i] = corners[i];
    }
    s.add({&g, &t, nullptr, &in}, program);
    const Vec3f forward = normalize(at);
    const Vec3f right = normalize(cross(Vec3f(0, 1, 0), forward));
    s.camera(right, cross(forward, right), forward, 1e-4f, 4, 4);
    scene::Light quad;
    quad.kind = scene::Light::Kind::Quad;
    quad.width = 0.3f, quad.height = 3;
    quad.amount = Rgb(1);
    quad.visible_camera = false;
    s.inputs.lights = {constant_sky(Rgb(0.2f)), quad}; // at the camera, shining along +z
    s.inputs.max_depth = 1;
    s.finish();
    double sum = 0;
    for (const PixelSums& p : s.render(256, 8))
        for (int c = 0; c < 3; c++)
            sum += double(p.rgb[c]) * (1 + c) / 16;
    return sum;
}

TEST(Between, GroovesTurnTheShorterWay) {
    Lobe brushed{grid::LobeId::MicrofacetConductorBrdf,
                 {Rgb(1), Rgb(1), Vec3f(0.5f), Rgb(1), Vec3f(0.9f), Vec3f(0.0f)}};
    const auto constant = [&](float turns) {
        return seen_between(brushed, 5, {turns, turns, turns, turns}, {0.01f, 0.02f, 2});
    };
    const double along = constant(0), across = constant(0.25f);
    EXPECT_GT(std::abs(along - across), 0.1 * across); // else this tells nothing
    const auto varying = [&](float left, float right) {
        return seen_between(brushed, 5, {left, right, left, right}, {0.01f, 0.02f, 2});
    };
    EXPECT_NEAR(varying(0.95f, 0.05f), along, 0.02 * along);                   // over the end of the range
    EXPECT_NEAR(varying(0.45f, 0.05f), along, 0.2 * std::abs(across - along)); // half a turn is none
    EXPECT_NEAR(varying(0.2f, 0.3f), across, 0.02 * across);
}

TEST(Between, CodesAreTheNearest) {
    Lobe metal{grid::LobeId::MetalBrdf, {Vec3f(0), Rgb(1.5f), Rgb(4), Vec3f(0.3f)}};
    const auto constant = [&](float code) {
        return seen_between(metal, 0, {code, code, code, code}, {0, 0.1f, 2});
    };
    const double silver = constant(1), copper = constant(5);
    for (const float x : {-0.9f, -0.3f, -0.1f, 0.1f, 0.3f, 0.9f}) {
        const double seen = seen_between(metal, 0, {1, 5, 1, 5}, {x, 0.1f, 2});
        const double expected = seen_between(
            metal, 0, x < 0 ? std::array<float, 4>{1, 1, 1, 1} : std::array<float, 4>{5, 5, 5, 5},
            {x, 0.1f, 2});
        EXPECT_NEAR(seen, expected, 0.005 * expected) << x;
    }
    EXPECT_GT(std::abs(silver - copper), 0.2 * silver);
}

} // namespace
} // namespace kanuka::transport
