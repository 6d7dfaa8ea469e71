// Air before surfaces, made by what knows its law: the segments that are evaluated, and what is then seen, in
// closed form.
#include <gtest/gtest.h>
#include <mutex>
#include <set>

#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr int Size = 40; // more paths than one batch evaluates

// T = exp(-sigma d), and the air emits: (1 - T) times a radiance.
struct Haze final : grid::Air {
    std::vector<double> sigma;
    double radiance = 0.5;
    mutable std::mutex mutex;
    mutable std::set<int> evaluated;
    mutable std::vector<std::pair<Vec3f, Vec3f>> segments;

    explicit Haze(std::vector<double> sigma) : sigma(std::move(sigma)) {}
    void evaluate(int air, grid::AirSegments& s) const override {
        const std::lock_guard lock(mutex);
        evaluated.insert(air);
        for (int k = 0; k < s.count; k++) {
            const Vec3f from(s.from[0][k], s.from[1][k], s.from[2][k]),
                to(s.to[0][k], s.to[1][k], s.to[2][k]);
            segments.emplace_back(from, to);
            const double through = std::exp(-sigma[size_t(air)] * double(length(to - from)));
            for (int c = 0; c < 3; c++) {
                s.transmittance[c][k] = float(through);
                s.inscatter[c][k] = float(radiance * (1 - through));
            }
        }
    }
    double seen(int air, double distance, double light) const {
        const double through = std::exp(-sigma[size_t(air)] * distance);
        return through * light + radiance * (1 - through);
    }
};

void add_quad(TestScene& s, Vec3f p, Vec3f ex, Vec3f ey, const std::vector<Lobe>& lobes, int air) {
    grid::Grid g;
    g.allocate(1, 1);
    grid::TracedGrid t;
    t.mu = t.mv = 1;
    const Vec3f n = normalize(cross(ex, ey)),
                corners[4] = {p - ex - ey, p + ex - ey, p - ex + ey, p + ex + ey};
    for (size_t i = 0; i < 4; i++)
        for (int c = 0; c < 3; c++) {
            g.P[size_t(c * g.stride) + i] = corners[i][c];
            g.N[size_t(c * g.stride) + i] = n[c];
            t.P.push_back(corners[i][c]);
        }
    std::vector<Vec3f> values;
    auto program = make_program(lobes, values);
    program.air = air;
    grid::VertexInputs in;
    in.stride = g.stride;
    for (const Vec3f& v : values)
        in.slots.push_back({true, v, {}});
    s.add({&g, &t, nullptr, &in}, program);
}

void look(TestScene& s) {
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.4f, Size, Size);
    s.filter = {0, 0}; // through the middles of pixels
    s.finish();
}

} // namespace

// Three walls, each behind an air of its own or none, the last of the materials too.
TEST(Air, LiesBeforeWhatTheCameraSees) {
    TestScene s;
    const Vec3f up(0, 4, 0);
    add_quad(s, {-1.09f, 0, 2}, up, {1, 0, 0}, {emission(Rgb(2))}, 1);
    add_quad(s, {0.0f, 0, 2}, up, {0.09f, 0, 0}, {emission(Rgb(1))}, -1);
    add_quad(s, {1.09f, 0, 2}, up, {1, 0, 0}, {emission(Rgb(4))}, 0);
    look(s);
    const Haze haze({0.3, 0.7});
    s.view.media.air = &haze;
    for (const int lanes : {1, 8}) {
        double sum[3] = {0, 0, 0};
        const auto pixels = s.render(64, lanes);
        for (int y = 0; y < Size; y++)
            for (int x = 0; x < Size; x++) {
                const Vec3f d = s.pixel_direction(x, y);
                const double distance = 2 * std::sqrt(double(dot(d, d))), at = 2 * double(d.x);
                const double expected = at < -0.09  ? haze.seen(1, distance, 2)
                                        : at < 0.09 ? 1
                                                    : haze.seen(0, distance, 4);
                const float* rgb = pixels[size_t(y * Size + x)].rgb;
                for (int c = 0; c < 3; c++) {
                    EXPECT_NEAR(rgb[c], expected, 0.08 * expected) << x << " " << y;
                    sum[c] += double(rgb[c]) / expected / (Size * Size);
                }
            }
        for (const double share : sum)
            EXPECT_NEAR(share, 1, 2e-3) << lanes;
    }
    EXPECT_EQ(haze.evaluated, (std::set<int>{0, 1}));
    for (const auto& [from, to] : haze.segments) {
        EXPECT_EQ(from, Vec3f(0.0f));
        EXPECT_NEAR(to.z, 2, 1e-5f);
    }
}

// In a mirror the light has gone through the air before the wall, then through that before the mirror: their
// places.
TEST(Air, LiesBeforeMirrorsAndInThem) {
    TestScene s;
    add_quad(s, {0, 0, 3}, {0, 8, 0}, {8, 0, 0}, {metal(0)}, 0);
    add_quad(s, {0, 0, -1}, {9, 0, 0}, {0, 9, 0}, {emission(Rgb(3))}, 1);
    look(s);
    const Haze haze({0.2, 0.4});
    s.view.media.air = &haze;
    const auto pixels = s.render(64, 8);
    double sum[3] = {0, 0, 0};
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++) {
            const double slant = std::sqrt(double(dot(s.pixel_direction(x, y), s.pixel_direction(x, y))));
            const double expected = haze.seen(0, 3 * slant, haze.seen(1, 4 * slant, 3));
            for (int c = 0; c < 3; c++) {
                const float rgb = pixels[size_t(y * Size + x)].rgb[c];
                EXPECT_NEAR(rgb, expected, 0.08 * expected) << x << " " << y;
                sum[c] += double(rgb) / expected / (Size * Size);
            }
        }
    for (const double share : sum)
        EXPECT_NEAR(share, 1, 2e-3);
    for (const auto& [from, to] : haze.segments)
        EXPECT_TRUE(std::abs(from.z - (to.z > 0 ? 0.0f : 3.0f)) < 1e-4f) << from.z << " " << to.z;
}

// What is no camera's nor a mirror's knows of no air.
TEST(Air, IsNotBeforeWhatLightsSurfaces) {
    double mean[2];
    for (const bool air : {false, true}) {
        TestScene s;
        add_quad(s, {0, 0, 3}, {0, 8, 0}, {8, 0, 0}, {matte(Rgb(0.5f))}, -1);
        add_quad(s, {0, 0, -1}, {9, 0, 0}, {0, 9, 0}, {emission(Rgb(3))}, air ? 0 : -1);
        s.inputs.max_depth = 1;
        look(s);
        const Haze haze({0.5});
        s.view.media.air = air ? &haze : nullptr;
        mean[air] = s.estimate(16, 1).channel[1].mean();
        EXPECT_TRUE(haze.segments.empty());
    }
    EXPECT_EQ(mean[0], mean[1]);
}

} // namespace kanuka::transport
