// Motion blur against closed forms: how much of the time a pixel is covered.
#include <functional>
#include <gtest/gtest.h>

#include "scene/shutter.h"
#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using kanuka::testing::normal_p;
using kanuka::testing::RunningMean;
using kanuka::testing::sidak;

constexpr int Size = 16; // pixels a side: film coordinates from -1 to 1, orthographic
const Vec3f X{1, 0, 0}, Y{0, 1, 0}, Z{0, 0, 1};

void flat_camera(TestScene& s) {
    s.camera(X, Y, Z, 1, Size, Size);
    s.inputs.camera.projection = Projection::Orthographic;
}

// Whether a point of the film is covered at a time.
using Covered = std::function<bool(double x, double y, double time)>;

// Coverage of pixels against that of a fine regular sampling, each by a z-test over independent renders.
void expect_coverage(TestScene& s, const Covered& covered, std::span<const float> opening = {}) {
    constexpr int Renders = 96, Paths = 16, Fine = 12, Times = 1600;
    std::vector<RunningMean> means(size_t(Size * Size));
    for (int seed = 0; seed < Renders; seed++) {
        s.view.settings.seed = uint32_t(seed);
        const auto pixels = s.render(Paths, 8);
        for (size_t i = 0; i < pixels.size(); i++)
            means[i].add(double(pixels[i].alpha) / Paths);
    }
    int wrong = 0, partly = 0;
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++) {
            double light = 0, all = 0;
            for (int k = 0; k < Times; k++) {
                const double time = (k + 0.5) / Times,
                             w = double(scene::shutter_openness(opening, float(time)));
                all += w;
                if (w <= 0)
                    continue;
                // The grid is shifted from time to time, so that no still edge runs along one.
                const double u = std::fmod(k * 0.7548776662466927, 1.0),
                             v = std::fmod(k * 0.5698402909980532, 1.0);
                int n = 0;
                for (int b = 0; b < Fine; b++)
                    for (int a = 0; a < Fine; a++)
                        n += covered((x + (a + u) / Fine) / Size * 2 - 1, 1 - (y + (b + v) / Fine) / Size * 2,
                                     time);
                light += w * n / (Fine * Fine);
            }
            const double expected = light / all;
            const RunningMean& m = means[size_t(y * Size + x)];
            partly += expected > 0.02 && expected < 0.98;
            // Where nothing varies there is no error to divide by; then the grid's own is what is allowed.
            // A few hits, too, say little of their error; then it is that of so many coins.
            const double hits = expected * (1 - expected) * Renders * Paths;
            const double error =
                std::max(hits > 30 ? m.error() : std::sqrt(hits) / (Renders * Paths), 1.5e-3);
            wrong += normal_p((m.mean() - expected) / error) < sidak(1e-3, Size * Size);
        }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(partly, Size);
}

std::array<Vec3f, 4> quad(double x0, double x1, double y0, double y1, double z = 2) {
    return {Vec3f(float(x0), float(y0), float(z)), Vec3f(float(x1), float(y0), float(z)),
            Vec3f(float(x0), float(y1), float(z)), Vec3f(float(x1), float(y1), float(z))};
}

bool inside(double x, double y, double x0, double x1, double y0, double y1) {
    return x > x0 && x < x1 && y > y0 && y < y1;
}

// A quad that an instance moves.
struct Moved {
    TestScene s;
    std::vector<MotionPath> paths;
    std::vector<bvh::GroupDesc> groups{2};
    explicit Moved(const std::vector<TransformKey>& keys,
                   const std::array<Vec3f, 4>& p = quad(-0.5, 0.5, -0.5, 0.5)) {
        s.add_quad((p[0] + p[3]) * 0.5f, (p[1] - p[0]) * 0.5f, (p[2] - p[0]) * 0.5f, {matte(Rgb(0.5f))});
        flat_camera(s);
        paths.emplace_back(keys);
        groups[0].shapes.push_back({0, 1});
        groups[1].instances.push_back({0, {}, paths});
        s.inputs.moving = true;
        s.finish(groups);
    }
};

} // namespace

// Narrower than its path: a trapezoid of coverage with linear ramps.
TEST(MotionBlur, AMovingInstanceLeavesLinearRamps) {
    Moved m({{0, Transform::translate(-0.4, 0, 0)}, {1, Transform::translate(0.4, 0.2, 0)}});
    expect_coverage(m.s, [](double x, double y, double t) {
        const double dx = -0.4 + 0.8 * t, dy = 0.2 * t;
        return inside(x - dx, y - dy, -0.5, 0.5, -0.5, 0.5);
    });
}

TEST(MotionBlur, SeveralKeysAtUnevenTimes) {
    Moved m(
        {{-0.5, Transform::translate(-1, 0, 0)}, {0.3, Transform::translate(0.3, 0, 0)}, {0.8, Transform{}}});
    expect_coverage(m.s, [](double x, double y, double t) {
        const double d = t < 0.3 ? -1 + 1.3 * (t + 0.5) / 0.8 : t < 0.8 ? 0.3 * (0.8 - t) / 0.5 : 0;
        return inside(x - d, y, -0.5, 0.5, -0.5, 0.5);
    });
}

// A quarter plane that turns by a right angle, evenly: coverage is linear in the angle.
TEST(MotionBlur, TurnsAreEven) {
    Moved m({{0, Transform{}}, {1, Transform::rotate(90, 0, 0, 1)}}, quad(0, 4, 0, 4));
    expect_coverage(m.s, [](double x, double y, double t) {
        const double a = t * 90 * 3.14159265358979 / 180, c = std::cos(a), s = std::sin(a);
        return inside(c * x + s * y, c * y - s * x, 0, 4, 0, 4);
    });
}

TEST(MotionBlur, ShapesThatChange) {
    TestScene s;
    s.add_moving_quad({quad(-0.9, -0.1, -0.7, 0.1), quad(-0.2, 0.1, -0.7, 0.6), quad(0.1, 0.9, -0.2, 0.1)},
                      {matte(Rgb(0.5f))});
    flat_camera(s);
    s.inputs.moving = true;
    s.finish();
    expect_coverage(s, [](double x, double y, double t) {
        const double k[3][4] = {{-0.9, -0.1, -0.7, 0.1}, {-0.2, 0.1, -0.7, 0.6}, {0.1, 0.9, -0.2, 0.1}};
        const int i = t < 0.5 ? 0 : 1;
        const double f = 2 * t - i;
        double r[4];
        for (int c = 0; c < 4; c++)
            r[c] = k[i][c] + (k[i + 1][c] - k[i][c]) * f;
        return inside(x, y, r[0], r[1], r[2], r[3]);
    });
}

TEST(MotionBlur, FollowsTheShutter) {
    const std::vector<std::vector<float>> openings = {{0.5f, 0.6f},
                                                      {0.2f, 0.9f, 0.1f, 0, 0.2f, 0, 0.9f, 0, 0.95f, 0}};
    for (const auto& opening : openings) {
        Moved m({{0, Transform::translate(-0.5, 0, 0)}, {1, Transform::translate(0.5, 0, 0)}});
        const std::vector<float> quantiles = scene::shutter_quantiles(opening);
        m.s.view.camera.shutter_quantiles = quantiles;
        expect_coverage(
            m.s, [](double x, double y, double t) { return inside(x - (t - 0.5), y, -0.5, 0.5, -0.5, 0.5); },
            opening);
    }
}

// The camera going one way is the scene going the other: the same samples see the same.
TEST(MotionBlur, AMovingCameraIsTheSceneMovingTheOtherWay) {
    const std::vector<std::vector<TransformKey>> cameras = {
        {{0, Transform::translate(-0.2, 0, -0.5)}, {1, Transform::translate(0.3, 0.1, 0)}},
        {{0, Transform::rotate(-8, 0, 1, 0)}, {1, Transform::rotate(12, 0, 1, 1)}}};
    for (const auto& keys : cameras) {
        const MotionPath camera(keys);
        TestScene moving;
        moving.add_quad({0, 0, 2}, X * 0.5f, Y * 0.5f, {matte(Rgb(0.5f))});
        moving.camera(X, Y, Z, 1, Size, Size);
        std::vector<float> table(12 * size_t(CameraView::MotionSteps + 1));
        moving.inputs.camera.motion = table;
        std::vector<TransformKey> inverse;
        for (int i = 0; i <= CameraView::MotionSteps; i++) {
            const double t = double(i) / CameraView::MotionSteps;
            camera.at(t, table.data() + 12 * i);
            inverse.push_back({t, camera.at(t).inverse()});
        }
        moving.finish();
        Moved still(inverse);
        still.s.inputs.camera.projection = Projection::Perspective;
        still.s.view.camera.projection = Projection::Perspective;
        const auto a = moving.render(64, 8), b = still.s.render(64, 8);
        double far = 0, partly = 0;
        for (size_t i = 0; i < a.size(); i++) {
            far += std::abs(double(a[i].alpha) - double(b[i].alpha));
            partly += a[i].alpha > 0.5f && a[i].alpha < 63.5f;
        }
        EXPECT_LE(far, 3) << "of " << 64 * a.size() << " paths";
        EXPECT_GT(partly, Size);
    }
}

// Normals and light are those of the time: a floor that tilts, under a lamp far away.
TEST(MotionBlur, NormalsMoveWithTheShape) {
    TestScene s;
    s.add_moving_quad(
        {quad(-2, 2, -2, 2), {Vec3f(-2, -2, 4), Vec3f(2, -2, 4), Vec3f(-2, 2, 0), Vec3f(2, 2, 0)}},
        {matte(Rgb(0.8f))});
    flat_camera(s);
    scene::Light sun;
    sun.kind = scene::Light::Kind::Distant;
    s.inputs.lights = {sun}; // along +z, irradiance 1
    s.inputs.moving = true;
    s.finish();
    for (const float time : {0.0f, 0.25f, 0.75f}) {
        const std::vector<float> quantiles(size_t(scene::ShutterSegments) + 1, time);
        s.view.camera.shutter_quantiles = quantiles;
        const auto e = s.estimate(4, 16);
        // Shading normals are interpolated between the steps.
        const Vec3f n = normalize(lerp(time, Vec3f(0, 0, 1), normalize(Vec3f(0, 1, 1))));
        for (int c = 0; c < 3; c++)
            EXPECT_LT(std::abs(e.channel[c].mean() - 0.8 / 3.14159265 * double(n.z)),
                      4.5 * e.channel[c].error())
                << time;
        const auto pixels = s.render(4, 8);
        const PixelSums& p = pixels[size_t(Size * Size / 2 + Size / 2)];
        const Vec3f seen = normalize(Vec3f(p.normal[0], p.normal[1], p.normal[2]));
        EXPECT_NEAR(std::abs(dot(seen, n)), 1, 1e-5f) << time;
    }
}

// A time costs nothing and changes nothing where all stands still.
TEST(MotionBlur, StillScenesKeepTheirBits) {
    TestScene s;
    s.add_quad({0, 0, 3}, X, Y, {matte(Rgb(0.5f))});
    s.add_sphere({0.3f, 0.2f, 2}, 0.4f, 16, {metal(0.3f)});
    s.camera(X, Y, Z, 0.5f, Size, Size);
    s.inputs.lights = {constant_sky(Rgb(1))};
    s.finish();
    const auto still = s.render(4, 8);
    s.view.geometry.moving = true;
    const auto timed = s.render(4, 8);
    for (size_t i = 0; i < still.size(); i++)
        for (int c = 0; c < 3; c++)
            EXPECT_EQ(still[i].rgb[c], timed[i].rgb[c]);
}

TEST(MotionBlur, LaneCountsAgree) {
    Moved m({{0, Transform::rotate(-20, 0, 0, 1)},
             {1, Transform::translate(0.4, 0.2, 0) * Transform::rotate(60, 0, 0, 1)}});
    const auto one = m.s.render(32, 1);
    for (const int lanes : {8, 16}) {
        const auto wide = m.s.render(32, lanes);
        double far = 0;
        for (size_t i = 0; i < one.size(); i++)
            far += std::abs(double(one[i].alpha) - double(wide[i].alpha));
        EXPECT_LE(far, 2) << lanes;
    }
}

} // namespace kanuka::transport
