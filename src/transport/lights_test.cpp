// Lights against closed forms and numeric integration: quads, points, spots, distant ones, skies and their
// pictures.
#include "transport/test_floor.h"
#include "transport/test_many_lights.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;

scene::Light light(Kind kind, const Rgb& amount, const Transform& t) {
    scene::Light l;
    l.kind = kind;
    l.amount = amount;
    l.world_from_light = t;
    return l;
}

const Transform Downwards = Transform::rotate(90, 1, 0, 0); // +z to -y

} // namespace

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

// Whatever the number of lights, each brings what it brings alone.
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

// ---- lights with an area

// On a floor that sees all of it, a ball brings pi R^2 L cos / d^2; the others by sums over their surface.
TEST(AreaLights, IrradianceOfShapes) {
    const Vec3f at(0.15f, 0.3f, 0.1f);
    for (Kind kind : {Kind::Quad, Kind::Disk, Kind::Sphere, Kind::Cylinder}) {
        FloorScene s;
        auto l = light(kind, Rgb(4),
                       Transform::translate(at.x, at.y, at.z) * Transform::rotate(25, 0, 0, 1) * Downwards);
        l.width = 0.5f, l.height = 0.7f, l.radius = 0.3f;
        l.visible_camera = false;
        s.inputs.lights.push_back(l);
        s.finish();
        const Transform t = l.world_from_light;
        const auto irradiance = [&](const Vec3f& p) {
            if (kind == Kind::Sphere) {
                const Vec3f to = at - p;
                return 4 * 3.141592653589793 * 0.09 * double(to.y) / std::pow(double(dot(to, to)), 1.5);
            }
            constexpr int N = 64;
            double sum = 0;
            for (int i = 0; i < N; i++)
                for (int j = 0; j < N; j++) {
                    const float a = (float(i) + 0.5f) / N, b = (float(j) + 0.5f) / N;
                    Vec3f q(0.5f * (a - 0.5f), 0.7f * (b - 0.5f), 0), n(0, 0, 1);
                    double area = 0.35 / (N * N);
                    if (kind != Kind::Quad) {
                        const float r = kind == Kind::Disk ? 0.3f * std::sqrt(a) : 0.3f;
                        n = {std::cos(2 * Pi * b), std::sin(2 * Pi * b), 0};
                        q = {r * n.x, r * n.y, kind == Kind::Disk ? 0 : 0.7f * (a - 0.5f)};
                        area = 3.141592653589793 * 0.09 / (N * N);
                        if (kind == Kind::Disk)
                            n = {0, 0, 1};
                        else
                            area = 2 * 3.141592653589793 * 0.3 * 0.7 / (N * N);
                    }
                    const Vec3f to = t.point(q) - p;
                    const double d2 = dot(to, to), shines = -dot(to, t.vector(n));
                    if (shines > 0 && to.y > 0)
                        sum += 4 * area * shines * double(to.y) / (d2 * d2);
                }
            return sum;
        };
        expect_irradiance(s, irradiance, 0.004);
    }
}

// A ball of a point's intensity brings what the point brings, a spot inside its cone too.
TEST(AreaLights, SoftPointsAndSpots) {
    for (Kind kind : {Kind::Point, Kind::Spot}) {
        FloorScene s;
        auto l = light(kind, Rgb(3), Transform::translate(0.2, 0.5, -0.1) * Downwards);
        l.radius = 0.2f;
        l.cone_angle = 60, l.cone_delta_angle = 20, l.beam_distribution = 3;
        s.inputs.lights.push_back(l);
        s.finish();
        expect_irradiance(
            s,
            [&](const Vec3f& x) {
                const Vec3f to = Vec3f(0.2f, 0.5f, -0.1f) - x;
                const double d2 = dot(to, to), cosine = to.y / std::sqrt(d2);
                const double t =
                    std::clamp((cosine - 0.5) / (std::cos(40 * 3.14159265 / 180) - 0.5), 0.0, 1.0);
                const double cone = kind == Kind::Spot ? t * t * (3 - 2 * t) * cosine * cosine * cosine : 1;
                return 3 * cone * cosine / d2;
            },
            0.004);
    }
}

// A picture on a quad: each half brings its own; the camera sees it in place.
TEST(AreaLights, PicturesOnQuads) {
    TestScene s;
    auto l = light(Kind::Quad, Rgb(2), Transform::translate(0, 0, 2) * Transform::rotate(180, 0, 1, 0));
    l.width = l.height = 2;
    auto table = std::make_shared<scene::LightTable>();
    table->width = table->height = 2;
    table->rgb = {1, 1, 1, 0.5f, 0.5f, 0.5f, 0.25f, 0.25f, 0.25f, 0.125f, 0.125f, 0.125f};
    l.table = table;
    s.inputs.lights.push_back(l);
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.49f, 8, 8);
    s.finish();
    const auto pixels = s.render(64, 8);
    // The light's +x is the picture's left, since it is turned to the camera; rows run down from +y.
    EXPECT_NEAR(pixels[7].rgb[1], 2, 0.02);
    EXPECT_NEAR(pixels[0].rgb[1], 1, 0.02);
    EXPECT_NEAR(pixels[63].rgb[1], 0.5, 0.01);
    EXPECT_NEAR(pixels[56].rgb[1], 0.25, 0.01);
    for (const PixelSums& p : pixels)
        EXPECT_EQ(p.alpha, 64);
    s.inputs.lights[0].visible_camera = false;
    s.finish();
    EXPECT_EQ(s.render(4, 8)[0].rgb[1], 0);
}

// Lights asked for and lights met are one: glossy floors under lights in the hierarchy, and by choice.
TEST(AreaLights, GlossyFloorsSeeTheSameByEitherTechnique) {
    double expected[3] = {}, error[3] = {};
    for (int mode = 0; mode < 3; mode++) {
        TestScene s;
        s.add_quad({0, -1, 0}, {0, 0, 8}, {8, 0, 0}, {metal(0.3f)});
        s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, 20, 20);
        s.inputs.max_depth = 1;
        // By choice, in the hierarchy, and by directions alone.
        const int copies = mode == 1 ? 6 : 1;
        for (int k = 0; k < copies; k++)
            for (Kind kind : {Kind::Quad, Kind::Sphere, Kind::Disk}) {
                auto l = light(kind, Rgb(6.0f / float(copies)),
                               Transform::translate(0.5f * float(int(kind) % 3) - 0.5f, 0.5f, 3) * Downwards);
                l.width = 0.5f, l.height = 0.3f, l.radius = 0.2f;
                l.visible_camera = false;
                s.inputs.lights.push_back(l);
            }
        s.finish();
        EXPECT_EQ(s.view.lights.tree.empty(), mode != 1);
        if (mode == 2)
            s.view.lights.choices = 0; // nothing is asked for
        const auto e = s.estimate(mode == 2 ? 256 : 64, 12);
        expected[mode] = e.channel[1].mean(), error[mode] = e.channel[1].error();
    }
    EXPECT_NEAR(expected[1], expected[0], 0.004 * expected[0] + 4.5 * std::hypot(error[0], error[1]));
    EXPECT_NEAR(expected[2], expected[0], 0.004 * expected[0] + 4.5 * std::hypot(error[0], error[2]));
    EXPECT_LT(error[0], error[2]);
}

// Lights that shine through everything are asked for alone: what meets them would see them a second time.
TEST(AreaLights, WithoutShadowsAreCountedOnce) {
    for (Kind kind : {Kind::Quad, Kind::Disk, Kind::Sphere, Kind::Cylinder, Kind::Distant}) {
        double mean[2], error[2];
        for (int k = 0; k < 2; k++) {
            FloorScene s;
            auto l = light(kind, Rgb(3), Transform::translate(0.1f, 0.5f, 0) * Downwards);
            l.radius = 0.4f;
            l.angle = 40;
            l.shadows = k == 0;
            l.visible_camera = false;
            s.inputs.lights.push_back(l);
            if (k == 1)
                s.add_quad({0, 0.01f, 0}, {0, 0, 9}, {9, 0, 0}, {matte(Rgb(0))}); // in the way of others
            s.finish();
            const auto e = s.estimate(64, 10);
            mean[k] = e.channel[1].mean(), error[k] = e.channel[1].error();
        }
        EXPECT_NEAR(mean[1], mean[0], 0.003 * mean[0] + 4.5 * std::hypot(error[0], error[1])) << int(kind);
    }
}

TEST(AreaLights, OfNoAreaAreReported) {
    FloorScene s;
    auto l = light(Kind::Quad, Rgb(3), Transform());
    l.width = 0;
    s.inputs.lights = {l, light(Kind::Sphere, Rgb(3), Transform()), constant_sky(Rgb(1))};
    s.inputs.lights[1].radius = 0;
    s.finish();
    for (const auto& c : s.estimate(4, 1).channel)
        EXPECT_NEAR(c.mean(), Reflectance, 0.01);
    ASSERT_FALSE(s.journal.entries().empty());
    EXPECT_NE(s.journal.entries()[0].message.find("no area"), std::string::npos);
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

// ---- pictures of skies

namespace {

LatLong picture(int width, int height, const std::function<Rgb(int, int)>& f) {
    LatLong m{width, height, {}};
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++)
            for (int c = 0; c < 3; c++)
                m.rgb.push_back(f(i, j)[c]);
    return m;
}

scene::Light sky_picture(const Transform& t, const Rgb& amount = Rgb(1)) {
    auto l = light(Kind::Environment, amount, t);
    l.texture = "a picture";
    return l;
}

// Bilinear between texel centres, wrapping in azimuth.
Rgb look_up(const LatLong& m, const Vec3f& d) {
    double turn = std::atan2(double(d.y), double(d.x)) / 6.283185307179586;
    turn = turn < 0 ? turn + 1 : turn;
    const double x = turn * m.width - 0.5,
                 y = std::acos(std::clamp(double(d.z), -1.0, 1.0)) / 3.141592653589793 * m.height - 0.5;
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const float fx = float(x - i), fy = float(y - j);
    const auto texel = [&](int a, int b) {
        const size_t at =
            3 * (size_t(std::clamp(b, 0, m.height - 1)) * size_t(m.width) + size_t((a + m.width) % m.width));
        return Rgb(m.rgb[at], m.rgb[at + 1], m.rgb[at + 2]);
    };
    return lerp(fy, lerp(fx, texel(i, j), texel(i + 1, j)), lerp(fx, texel(i, j + 1), texel(i + 1, j + 1)));
}

Rgb floor_irradiance(const LatLong& m, const Transform& environment_from_world) {
    double sum[3] = {0, 0, 0};
    constexpr int N = 600;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < 2 * N; j++) {
            const double y = (i + 0.5) / N, phi = 3.141592653589793 * (j + 0.5) / N, r = std::sqrt(1 - y * y);
            const Vec3f d(float(r * std::cos(phi)), float(y), float(r * std::sin(phi)));
            const Rgb l = look_up(m, environment_from_world.vector(d));
            for (int c = 0; c < 3; c++)
                sum[c] += double(l[c]) * y;
        }
    const double cell = 3.141592653589793 / (double(N) * N);
    return {float(sum[0] * cell), float(sum[1] * cell), float(sum[2] * cell)};
}

} // namespace

TEST(SkyPictures, AConstantOneIsAConstantSky) {
    FloorScene s;
    s.inputs.map = picture(16, 8, [](int, int) { return Rgb(1.5f); });
    s.inputs.lights.push_back(sky_picture(Transform::rotate(40, 1, 1, 0)));
    s.finish();
    expect_irradiance(s, [](const Vec3f&) { return 1.5 * 3.141592653589793; }, 0.003);
}

TEST(SkyPictures, IrradianceOfColoursAndSuns) {
    const Transform turned = Transform::rotate(50, 1, 2, 3);
    const auto gradient = picture(64, 32, [](int i, int j) {
        return Rgb(1 + 0.5f * std::sin(0.2f * float(i)), 1 + 0.02f * float(j), 0.5f + 0.01f * float(i));
    });
    auto sun = gradient;
    for (int j = 0; j < 32; j++)
        for (int i = 0; i < 64; i++) {
            const Vec3f d(std::sin(Pi * (float(j) + 0.5f) / 32) * std::cos(2 * Pi * (float(i) + 0.5f) / 64),
                          std::sin(Pi * (float(j) + 0.5f) / 32) * std::sin(2 * Pi * (float(i) + 0.5f) / 64),
                          std::cos(Pi * (float(j) + 0.5f) / 32));
            if (turned.vector(d).y > 0.96f) // about overhead, some texels
                for (int c = 0; c < 3; c++)
                    sun.rgb[size_t(3 * (j * 64 + i) + c)] = c == 2 ? 1000 : 2000;
        }
    for (const LatLong* m : {&gradient, static_cast<const LatLong*>(&sun)}) {
        FloorScene s;
        s.inputs.map = *m;
        s.inputs.lights.push_back(sky_picture(turned));
        s.finish();
        const Rgb expected = floor_irradiance(*m, turned.inverse()) * (Reflectance / Pi);
        const auto e = s.estimate(64, 12);
        for (int c = 0; c < 3; c++)
            EXPECT_NEAR(e.channel[c].mean(), expected[c], 0.006 * expected[c] + 4.5 * e.channel[c].error())
                << c;
    }
}

// What the camera sees of it is the picture, in place.
TEST(SkyPictures, AreSeenWhereTheyAre) {
    const Transform turned = Transform::rotate(70, 3, 1, 2);
    TestScene s;
    s.inputs.map = picture(
        32, 16, [](int i, int j) { return Rgb(1 + 0.1f * float(i % 16), 0.5f + 0.1f * float(j), 1); });
    s.inputs.lights.push_back(sky_picture(turned, Rgb(0.5f)));
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
    s.finish();
    const auto pixels = s.render(1024, 8);
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++) {
            const Vec3f d = s.pixel_direction(x, y);
            const Rgb expected = look_up(s.inputs.map, turned.inverse().vector(normalize(d))) * 0.5f;
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(pixels[size_t(y * Size + x)].rgb[c], expected[c], 0.05f * expected[c])
                    << x << " " << y;
        }
}

TEST(SkyPictures, NaNTexelsAreBlackAndNaNDirectionsHarmless) {
    FloorScene s;
    s.inputs.map = picture(8, 4, [](int i, int) {
        return i == 3   ? Rgb(std::numeric_limits<float>::quiet_NaN())
               : i == 5 ? Rgb(std::numeric_limits<float>::infinity())
                        : Rgb(1);
    });
    s.inputs.lights.push_back(sky_picture(Transform()));
    s.finish();
    for (const auto& c : s.estimate(16, 1).channel) {
        EXPECT_TRUE(std::isfinite(c.mean()));
        EXPECT_GT(c.mean(), 0.1);
    }
    EXPECT_EQ(s.nan_samples, 0u);
}

} // namespace kanuka::transport
