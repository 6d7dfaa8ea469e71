// Lights against closed forms and numeric integration: quads, points, spots, distant ones, skies, tables, and
// which lights shine on what.
#include "transport/test_lights.h"
#include "transport/test_many_lights.h"

namespace kanuka::transport {

using namespace testing;

TEST(Lights, Quad) {
    const Vec3f center(0.3f, 0.5f, 0.2f), ex(0.3f, 0, 0), ey(0, 0, 0.2f); // cross(ex, ey) points down
    FloorScene s;
    s.add_quad(center, ex, ey, {emission(Rgb(5))});
    s.finish();
    const auto irradiance = [&](const Vec3f& p) {
        double sum = 0;
        constexpr int N = 48;
        for (int i = 0; i < N; i++)
            for (int j = 0; j < N; j++) {
                const Vec3f to =
                    center + ex * ((float(i) + 0.5f) * 2 / N - 1) + ey * ((float(j) + 0.5f) * 2 / N - 1) - p;
                const double d2 = dot(to, to);
                sum += 5 * double(to.y) * double(to.y) / (d2 * d2); // both cosines are to.y / d
            }
        return sum * 4 * 0.3 * 0.2 / (N * N);
    };
    expect_irradiance(s, irradiance, 0.003);
}

// The other side of an emitter is dark.
TEST(Lights, QuadsShineOnOneSide) {
    FloorScene s;
    s.add_quad({0.3f, 0.5f, 0.2f}, {0, 0, 0.2f}, {0.3f, 0, 0}, {emission(Rgb(5))});
    s.finish();
    for (const auto& c : s.estimate(4, 1).channel)
        EXPECT_EQ(c.mean(), 0);
}

TEST(Lights, Point) {
    FloorScene s;
    const Vec3f p(0.2f, 0.7f, -0.1f);
    s.inputs.lights.push_back(light(Kind::Point, Rgb(3), Transform::translate(p.x, p.y, p.z)));
    s.finish();
    expect_irradiance(
        s,
        [&](const Vec3f& x) {
            const Vec3f to = p - x;
            return 3 * double(to.y) / std::pow(double(dot(to, to)), 1.5);
        },
        0.003);
}

TEST(Lights, Spot) {
    FloorScene s;
    const Vec3f p(0.1f, 0.5f, 0.05f);
    auto l = light(Kind::Spot, Rgb(3), Transform::translate(p.x, p.y, p.z) * Downwards);
    l.cone_angle = 35;
    l.cone_delta_angle = 15;
    l.beam_distribution = 2;
    s.inputs.lights.push_back(l);
    s.finish();
    // RISpec 3.2, section 8: smoothstep between the cone's cosines, times a power of the cosine.
    expect_irradiance(
        s,
        [&](const Vec3f& x) {
            const Vec3f to = p - x;
            const double d2 = dot(to, to), cosine = to.y / std::sqrt(d2);
            const double outer = std::cos(35 * 3.14159265 / 180), inner = std::cos(20 * 3.14159265 / 180);
            const double t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
            return 3 * cosine / d2 * t * t * (3 - 2 * t) * cosine * cosine;
        },
        0.003);
}

TEST(Lights, Distant) {
    for (float angle : {0.0f, 6.0f}) {
        FloorScene s;
        auto l = light(Kind::Distant, Rgb(2), Transform::rotate(25, 0, 0, 1) * Downwards);
        l.angle = angle;
        s.inputs.lights.push_back(l);
        s.finish();
        expect_irradiance(s, [](const Vec3f&) { return 2 * std::cos(25 * 3.14159265 / 180); }, 0.003);
    }
}

TEST(Lights, SkiesAndAmbient) {
    {
        FloorScene s;
        s.inputs.lights.push_back(light(Kind::Environment, Rgb(1.5f), Transform()));
        s.finish();
        expect_irradiance(s, [](const Vec3f&) { return 1.5 * 3.141592653589793; }, 0.003);
    }
    {
        // Ambient light reaches into a closed box, and what it shows there lights nothing.
        FloorScene s;
        s.inputs.lights = {light(Kind::Ambient, Rgb(1), Transform()),
                           light(Kind::Ambient, Rgb(0.5f), Transform())};
        s.add_sphere({0, 0, 0}, 50, 16, {matte(Rgb(0.9f))});
        s.finish();
        EXPECT_FALSE(s.view.lights.constant.present);
        expect_irradiance(s, [](const Vec3f&) { return 1.5 * 3.141592653589793; }, 0.003);
    }
    // Two skies add up.
    FloorScene s;
    s.inputs.lights = {constant_sky(Rgb(1)), constant_sky(Rgb(0.5f))};
    s.finish();
    expect_irradiance(s, [](const Vec3f&) { return 1.5 * 3.141592653589793; }, 0.003);
}

// Whatever the number of lights, each contributes what it does alone.
// Tables of light shaders: by direction and distance, and over the plane of a distant light.
TEST(Lights, TableByDirectionAndDistance) {
    FloorScene s;
    const Vec3f p(0.1f, 0.6f, 0.05f);
    auto l = light(Kind::Point, Rgb(3), Transform::translate(p.x, p.y, p.z) * Downwards);
    auto table = std::make_shared<scene::LightTable>();
    table->width = 32, table->height = 64, table->layers = 4;
    table->angle = 0.9f, table->nearest = 0.5f, table->falloff = 1;
    const auto sent = [](float theta, float phi, float d) {
        return (1 - 0.8f * theta) * (0.6f + 0.4f * std::cos(phi)) / (1 + 0.3f * d);
    };
    for (int k = 0; k < 4; k++)
        for (int j = 0; j < 64; j++)
            for (int i = 0; i < 32; i++)
                table->rgb.insert(table->rgb.end(), 3,
                                  sent(0.9f * (float(j) + 0.5f) / 64, 2 * Pi * (float(i) + 0.5f) / 32,
                                       0.5f * float(1 << k)));
    l.table = table;
    s.inputs.lights.push_back(l);
    s.finish();
    const Transform light_from_world = l.world_from_light.inverse();
    expect_irradiance(
        s,
        [&](const Vec3f& x) {
            const Vec3f to = p - x, q = light_from_world.point(x);
            const float d = length(to), theta = std::acos(q.z / d), phi = std::atan2(q.y, q.x);
            return theta > 0.9f ? 0.0 : 3.0 * double(sent(theta, phi, d) * to.y / d / d);
        },
        0.01);
}

TEST(Lights, TableAcrossADistantLight) {
    FloorScene s;
    auto l = light(Kind::Distant, Rgb(2), Transform::translate(0, 3, 0) * Downwards);
    auto table = std::make_shared<scene::LightTable>();
    table->width = table->height = 64;
    table->extent = 2;
    for (int j = 0; j < 64; j++)
        for (int i = 0; i < 64; i++)
            table->rgb.insert(table->rgb.end(), 3,
                              0.5f + 0.4f * std::sin(0.1f * float(i)) * std::cos(0.07f * float(j)));
    l.table = table;
    s.inputs.lights.push_back(l);
    s.finish();
    const Transform light_from_world = l.world_from_light.inverse();
    expect_irradiance(
        s,
        [&](const Vec3f& x) {
            const Vec3f q = light_from_world.point(x);
            const double i = (q.x / 4 + 0.5) * 64 - 0.5, j = (q.y / 4 + 0.5) * 64 - 0.5;
            return 2 * (0.5 + 0.4 * std::sin(0.1 * i) * std::cos(0.07 * j));
        },
        0.005);
}

TEST(Lights, ManyAddUp) {
    for (int count : {3, 40}) {
        FloorScene s;
        std::vector<Vec3f> places;
        for (int i = 0; i < count; i++) {
            places.push_back({std::sin(float(i)), 0.3f + 0.02f * float(i), std::cos(3.0f * float(i))});
            const Vec3f& p = places.back();
            s.inputs.lights.push_back(
                light(Kind::Point, Rgb(1 + float(i % 3)), Transform::translate(p.x, p.y, p.z)));
        }
        s.inputs.lights.push_back(constant_sky(Rgb(0.3f)));
        s.finish();
        double expected = 0;
        for (int y = 0; y < Size; y++)
            for (int x = 0; x < Size; x++) {
                double sum = 0.3 * 3.141592653589793;
                for (int i = 0; i < count; i++) {
                    const Vec3f to = places[size_t(i)] - s.point(x, y);
                    sum += (1 + i % 3) * double(to.y) / std::pow(double(dot(to, to)), 1.5);
                }
                expected += sum * Reflectance / 3.141592653589793 / (Size * Size);
            }
        for (const auto& c : s.estimate(64, 12).channel)
            EXPECT_NEAR(c.mean(), expected, 0.003 * expected + 4.5 * c.error()) << count;
    }
}

// ---- linking

// A light shines on one half of the floor alone, and a board casts no shadow from one of two lamps.
TEST(Linking, LightsAndShadows) {
    for (int copies : {1, 30}) { // by choice; in the hierarchy
        for (bool off : {false, true}) {
            FloorScene s;
            auto l = light(Kind::Point, Rgb(3.0f / float(copies)), Transform::translate(0, 1, 0));
            l.lit_sets = off ? ~2 : -1;
            for (int k = 0; k < copies; k++)
                s.inputs.lights.push_back(l);
            const std::vector<store::ShapeRecord>& shapes = s.store.shapes();
            const_cast<store::ShapeRecord&>(shapes[0]).links =
                s.store.add_links({.lit_sets = 2}); // the floor is in the second set
            s.finish();
            EXPECT_TRUE(s.view.lights.linked);
            for (const auto& c : s.estimate(4, 1).channel)
                EXPECT_EQ(c.mean() > 0, !off) << copies;
        }
        double mean[2];
        for (bool through : {false, true}) {
            FloorScene s;
            s.add_quad({0, 0.5f, 0}, {0, 0, 4}, {4, 0, 0}, {matte(Rgb(0.5f))}); // between lamp and camera
            const_cast<store::ShapeRecord&>(s.store.shapes()[1]).links =
                s.store.add_links({.lets_through = through ? 4 : 0});
            for (Kind kind : {Kind::Point, Kind::Sphere}) {
                auto l = light(kind, Rgb(3.0f / float(copies)), Transform::translate(0, 1.5f, 0));
                l.radius = kind == Kind::Sphere ? 0.2f : 0;
                l.passes = 4;
                for (int k = 0; k < copies; k++)
                    s.inputs.lights.push_back(l);
            }
            s.finish();
            mean[through] = s.estimate(16, 1).channel[1].mean();
            if (through) {
                expect_irradiance(
                    s,
                    [&](const Vec3f& x) {
                        const Vec3f to = Vec3f(0, 1.5f, 0) - x;
                        return (3 + 3 * 3.141592653589793 * 0.04) * double(to.y) /
                               std::pow(double(dot(to, to)), 1.5);
                    },
                    0.005);
            }
        }
        EXPECT_EQ(mean[0], 0);
        EXPECT_GT(mean[1], 0);
    }
}

// ---- many

// The short form of bench/light_bench.cpp.
TEST(ManyLights, NoiseIsAFifthOfUniformChoice) {
    for (auto kind : {testing::ManyLights::Points, testing::ManyLights::Triangles}) {
        testing::ManyLightsScene s(kind, 3000, 32);
        const auto truth = s.render(256, 8);
        const auto noise = [&] {
            s.view.settings.seed = 5;
            double sum = 0;
            const auto pixels = s.render(4, 8);
            for (size_t i = 0; i < pixels.size(); i++) {
                const double d = double(pixels[i].rgb[1]) - double(truth[i].rgb[1]);
                sum += d * d / (double(truth[i].rgb[1]) * double(truth[i].rgb[1]) + 1e-3);
            }
            s.view.settings.seed = 0;
            return std::sqrt(sum);
        };
        const double ours = noise();
        s.make_uniform();
        EXPECT_LT(ours, noise() / 5);
    }
}

} // namespace kanuka::transport
