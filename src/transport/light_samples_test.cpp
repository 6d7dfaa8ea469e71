// Several light samples at a hit: the same light as with one, with less noise, and the same bits on any
// lanes.
#include <cstring>
#include <gtest/gtest.h>

#include "transport/test_media.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;

// A sky that is brighter to one side.
LatLong uneven_sky() {
    LatLong m{32, 16, {}};
    for (int j = 0; j < m.height; j++)
        for (int i = 0; i < m.width; i++)
            for (int c = 0; c < 3; c++)
                m.rgb.push_back(0.2f + (i > 20 && j < 8 ? 3.0f : 0.0f));
    return m;
}

enum class Under { Lamps, Panel, LampsAndSky, LampInWater };

// A glossy and a matte floor under lights of one kind or another.
void fill(TestScene& s, Under what) {
    int water = -1;
    if (what == Under::LampInWater)
        water = s.store.add_interior(medium(Rgb(0.1f, 0.2f, 0.3f), Rgb(0.05f)));
    s.add_quad({-2, -1, 3}, {0, 0, 4}, {2, 0, 0}, {matte(Rgb(0.7f, 0.5f, 0.3f))});
    s.add_quad({2, -1, 3}, {0, 0, 4}, {2, 0, 0}, {metal(0.4f), matte(Rgb(0.3f), 0.5f)});
    if (what == Under::LampInWater)
        add_box(s, {0, -0.4f, 3}, 0.5f, {glass(0)}, water);
    if (what != Under::Panel)
        for (int k = 0; k < 5; k++)
            s.add_quad({float(k) - 2, 0.5f + 0.2f * float(k), 2 + 0.5f * float(k)}, {0.1f, 0, 0},
                       {0, 0, 0.1f}, {emission(Rgb(3.0f + 4 * float(k)))});
    else
        s.add_quad({0, 1, 3}, {2, 0, 0}, {0, 0, 2}, {emission(Rgb(2))});
    if (what == Under::LampsAndSky) {
        s.inputs.map = uneven_sky();
        scene::Light sky = constant_sky(Rgb(1));
        sky.texture = "sky";
        s.inputs.lights.push_back(sky);
        scene::Light point;
        point.kind = Kind::Point;
        point.amount = Rgb(2);
        point.world_from_light = Transform::translate(0, 0.3, 2.5);
        s.inputs.lights.push_back(point);
    }
    s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.7f, Size, Size);
    s.inputs.max_depth = 4;
}

std::unique_ptr<TestScene> scene_of(Under what, int light_samples) {
    auto s = std::make_unique<TestScene>();
    fill(*s, what);
    s->inputs.light_samples = light_samples;
    s->finish();
    return s;
}

// Squared deviation of pixels from their mean over seeds, without what all seeds share: the noise of one
// picture.
double noise(TestScene& s, int progressions, int seeds) {
    std::vector<kanuka::testing::RunningMean> pixels(size_t(Size) * Size);
    for (int seed = 0; seed < seeds; seed++) {
        s.view.settings.seed = uint32_t(seed);
        const auto picture = s.render(progressions, 8);
        for (size_t i = 0; i < picture.size(); i++)
            pixels[i].add(double(picture[i].rgb[1]));
    }
    double sum = 0;
    for (const auto& p : pixels)
        sum += p.variance();
    return sum;
}

} // namespace

TEST(LightSamples, AreInTheSettings) {
    EXPECT_EQ(scene_of(Under::Lamps, 1)->view.settings.light_samples, 1);
    EXPECT_EQ(scene_of(Under::Lamps, 5)->view.settings.light_samples, 5);
}

// Paired by seed: the mean of the differences is none.
TEST(LightSamples, BringTheSameLight) {
    for (Under what : {Under::Lamps, Under::Panel, Under::LampsAndSky, Under::LampInWater})
        for (int n : {3, 8}) {
            const auto one = scene_of(what, 1), several = scene_of(what, n);
            ASSERT_EQ(one->view.media.tracked, what == Under::LampInWater);
            ASSERT_EQ(one->view.lights.samples, what == Under::LampsAndSky ? 2 : 1);
            kanuka::testing::RunningMean difference, level;
            for (int seed = 0; seed < 24; seed++) {
                double sums[2] = {0, 0};
                for (int k = 0; k < 2; k++) {
                    TestScene& s = k ? *several : *one;
                    s.view.settings.seed = uint32_t(seed);
                    for (const PixelSums& p : s.render(32, 8))
                        sums[k] += double(p.rgb[1]) / (Size * Size);
                    EXPECT_EQ(s.nan_samples, 0u);
                }
                difference.add(sums[1] - sums[0]);
                level.add(sums[0]);
            }
            EXPECT_GT(level.mean(), 0.02);
            EXPECT_LT(std::abs(difference.mean()), 4.5 * difference.error() + 1e-4 * level.mean())
                << int(what) << ", " << n << " samples";
            EXPECT_LT(difference.error(), 0.03 * level.mean());
        }
}

// What a wide light, or many, leave of noise falls with the number of samples; halved or better by 8 of them.
TEST(LightSamples, HaveLessNoise) {
    for (Under what : {Under::Lamps, Under::Panel, Under::LampsAndSky}) {
        const auto one = scene_of(what, 1), several = scene_of(what, 8);
        for (const auto& s : {one.get(), several.get()})
            s->view.settings.max_depth = 1;
        const double before = noise(*one, 4, 12), after = noise(*several, 4, 12);
        EXPECT_GT(before, 0);
        EXPECT_LT(after, 0.5 * before) << int(what);
        RecordProperty("noise_" + std::to_string(int(what)), std::to_string(after / before));
    }
}

// White balls in a room that shines with radiance 1 vanish, however often its walls are sampled. A queue of
// shadow rays of 64 a path has to hold them all.
TEST(LightSamples, Furnace) {
    for (int n : {1, 4, 64})
        for (const Lobe& lobe : {matte(Rgb(1)), metal(0.5f)}) {
            TestScene s;
            const Vec3f x(4, 0, 0), y(0, 4, 0), z(0, 0, 4);
            for (const auto& [p, a, b] : {std::array{-z, x, y}, std::array{z, y, x}, std::array{-x, y, z},
                                          std::array{x, z, y}, std::array{-y, z, x}, std::array{y, x, z}})
                s.add_quad(p, a, b, {emission(Rgb(1))});
            s.add_sphere({0, 0, 3}, 0.8f, 48, {lobe});
            s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.19f, 32, 32);
            s.inputs.max_depth = 32;
            s.inputs.light_samples = n;
            s.finish();
            const auto e = s.estimate(n == 64 ? 4 : 16, 8);
            EXPECT_EQ(e.nan_samples, 0u);
            for (const auto& c : e.channel)
                EXPECT_NEAR(c.mean(), 1, 0.006 + 4.5 * c.error()) << n;
        }
}

TEST(LightSamples, SameBitsOnAnyLanes) {
    for (Under what : {Under::LampsAndSky, Under::LampInWater}) {
        const auto s = scene_of(what, 3);
        const auto one = s->render(4, 1);
        for (int lanes : {8, 16}) {
            const auto many = s->render(4, lanes);
            for (size_t i = 0; i < one.size(); i++)
                ASSERT_EQ(std::memcmp(one[i].rgb, many[i].rgb, sizeof one[i].rgb), 0) << lanes << " at " << i;
        }
    }
}

} // namespace kanuka::transport
