// What light path expressions count of pictures, against pictures of less and closed forms.
#include <functional>
#include <gtest/gtest.h>

#include "transport/path_expression.h"
#include "transport/roulette.h"
#include "transport/test_media.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;

// A picture with what expressions count of it, as means of pixels.
struct Layers {
    std::vector<PixelSums> pixels;
    std::vector<std::vector<Rgb>> of; // by expression
};
Layers render_layers(TestScene& s, int progressions, int lanes) {
    const int w = s.inputs.camera.width, h = s.inputs.camera.height;
    const size_t channels = s.view.settings.aov_is_color.size(), expressions = s.inputs.expressions.size();
    Layers all{std::vector<PixelSums>(size_t(w * h), PixelSums{}), {}};
    std::vector<float> sums(all.pixels.size() * channels);
    const auto kernel = make_kernel(s.view, lanes);
    BatchCounts counts;
    for (int p = 0; p < progressions; p++) {
        BatchRequest r{0, 0, w, h, uint32_t(p), all.pixels.data(), w};
        r.aovs = sums.data();
        kernel->trace(r, counts);
    }
    EXPECT_EQ(counts.nan_samples, 0u);
    for (PixelSums& p : all.pixels)
        for (float& v : p.rgb)
            v /= float(progressions);
    for (size_t e = 0; e < expressions; e++) {
        all.of.emplace_back();
        for (size_t i = 0; i < all.pixels.size(); i++) {
            const float* v = sums.data() + i * channels + channels - 3 * (expressions - e);
            all.of.back().push_back(Rgb(v[0], v[1], v[2]) * (1 / float(progressions)));
        }
    }
    return all;
}
void ask(TestScene& s, const std::vector<std::string>& expressions) {
    s.inputs.expressions = expressions;
    s.inputs.aov_is_color.assign(3 * expressions.size(), true);
}

scene::Light point_at(double x, double y, double z, const Rgb& intensity, const char* group) {
    scene::Light l;
    l.kind = Kind::Point;
    l.world_from_light = Transform::translate(x, y, z);
    l.amount = intensity;
    l.group = group;
    return l;
}

// Diffuse and glossy lobes on one floor, a mirror, glass, a wall that shines, and lights of every place.
void add_room(TestScene& s, bool shines = true) {
    const Vec3f x(2, 0, 0), y(0, 2, 0), z(0, 0, 2);
    s.add_quad({0, -1, 3}, z, x,
               {matte(Rgb(0.6f, 0.3f, 0.2f)), metal(0.4f, Rgb(0.2f, 0.4f, 0.5f), Rgb(0.5f))});
    s.add_quad({0, 0, 5}, y, x, {matte(Rgb(0.3f, 0.5f, 0.8f))});
    s.add_quad({0, 1.5f, 3}, {0.5f, 0, 0}, {0, 0, 0.5f}, {shines ? emission(Rgb(6, 5, 4)) : matte(Rgb(0))});
    s.add_sphere({-0.6f, -0.4f, 3}, 0.5f, 24, {glass(0)});
    s.add_sphere({0.6f, -0.4f, 3.2f}, 0.5f, 24, {metal(0)});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, Size, Size);
    scene::Light ball;
    ball.kind = Kind::Sphere;
    ball.radius = 0.3f;
    ball.amount = Rgb(3, 2, 5);
    ball.world_from_light = Transform::translate(1, 1, 3);
    s.inputs.lights = {constant_sky(Rgb(0.3f)), point_at(-1, 1, 1, Rgb(2, 2, 3), "key"), ball};
}

// The layers add up to the picture, pixel by pixel.
void expect_whole(const Layers& all, const std::vector<size_t>& parts, const std::string& what) {
    for (size_t i = 0; i < all.pixels.size(); i++) {
        double size = 1e-3; // of the numbers that are rounded
        for (const size_t part : parts)
            for (int c = 0; c < 3; c++)
                size += std::abs(double(all.of[part][i][c]));
        for (int c = 0; c < 3; c++) {
            double sum = 0;
            for (const size_t part : parts)
                sum += double(all.of[part][i][c]);
            EXPECT_NEAR(sum, double(all.pixels[i].rgb[c]), 1e-5 * size) << what << ", pixel " << i;
        }
    }
}

Rgb mean_of(const std::vector<Rgb>& layer) {
    Rgb sum(0);
    for (const Rgb& v : layer)
        sum += v * (1 / float(layer.size()));
    return sum;
}

} // namespace

// pairs: paths search the sky along pairs of directions.
static void expect_layers_of(const RouletteFactors* pairs) {
    const std::vector<std::string> expressions = {
        "C.*",         "C.*L",        "C.*O",                        // all; by what shines
        "C[LO]",       "C<RD>.*[LO]", "C<RG>.*[LO]",  "C<RS>.*[LO]", // by what is seen
        "C<T.>.*[LO]", "CV.*[LO]",    "C.*<L.'key'>", "C.*[^<L.'key'>]"};
    TestScene s;
    add_room(s);
    ask(s, expressions);
    s.finish();
    s.view.settings.roulette = pairs;
    const Layers all = render_layers(s, 8, 8);
    expect_whole(all, {0}, "all");
    expect_whole(all, {1, 2}, "lights and surfaces");
    expect_whole(all, {3, 4, 5, 6, 7, 8}, "what is seen");
    for (const size_t k : {1u, 2u, 4u, 5u, 6u, 7u, 9u})
        EXPECT_GT(mean_of(all.of[k]).y, 1e-3f) << expressions[k];
    EXPECT_EQ(mean_of(all.of[8]).y, 0) << "there is no volume";
    expect_whole(all, {9, 10}, "a group and all others");
    // The picture is what it is without expressions, and lanes agree.
    TestScene plain;
    add_room(plain);
    plain.finish();
    plain.view.settings.roulette = pairs;
    const Layers without = render_layers(plain, 8, 8);
    for (size_t i = 0; i < all.pixels.size(); i++)
        for (int c = 0; c < 3; c++)
            EXPECT_EQ(all.pixels[i].rgb[c], without.pixels[i].rgb[c]);
    for (const int lanes : {1, 16}) {
        TestScene other;
        add_room(other);
        ask(other, expressions);
        other.finish();
        other.view.settings.roulette = pairs;
        const Layers same = render_layers(other, 8, lanes);
        for (size_t e = 0; e < expressions.size(); e++)
            for (size_t i = 0; i < all.pixels.size(); i++)
                for (int c = 0; c < 3; c++)
                    EXPECT_EQ(all.of[e][i][c], same.of[e][i][c]) << lanes << " " << expressions[e];
    }
}
TEST(PathExpression, LayersAddUpToThePicture) {
    expect_layers_of(nullptr);
}
TEST(PathExpression, LayersAddUpToThePictureWithPairs) {
    const RouletteFactors pairs{{1e6f, 1e6f, 1e6f, 1e6f, 1e6f, 1e6f, 1e6f, 4}, 0xff};
    expect_layers_of(&pairs);
}

// With fewer bounces the same samples find less: of the shorter paths, all.
TEST(PathExpression, DepthsAreThoseOfShorterPaths) {
    TestScene s, shallow;
    for (TestScene* one : {&s, &shallow}) {
        const Vec3f x(2, 0, 0), y(0, 2, 0), z(0, 0, 2);
        one->add_quad({0, -1, 3}, z, x, {matte(Rgb(0.6f, 0.3f, 0.2f))});
        one->add_quad({0, 0, 5}, y, x, {matte(Rgb(0.3f, 0.5f, 0.8f))});
        one->camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, Size, Size);
        one->inputs.lights = {constant_sky(Rgb(0.3f)), point_at(-1, 1, 1, Rgb(2, 2, 3), "")};
    }
    ask(s, {"C<RD>?L", "C<RD>{2,}L"});
    shallow.inputs.max_depth = 1;
    s.finish(), shallow.finish();
    const Layers all = render_layers(s, 8, 8), direct = render_layers(shallow, 8, 8);
    expect_whole(all, {0, 1}, "near and far");
    EXPECT_GT(mean_of(all.of[1]).y, 0.01f * mean_of(all.of[0]).y);
    for (size_t i = 0; i < all.pixels.size(); i++)
        for (int c = 0; c < 3; c++)
            EXPECT_NEAR(all.of[0][i][c], direct.pixels[i].rgb[c], 1e-5f * (1 + direct.pixels[i].rgb[c]));
}

namespace {

// The mean of a layer over several seeds, against the picture of a scene that has nothing else.
void expect_layer(const std::function<void(TestScene&)>& fill, const std::string& expression,
                  const std::function<void(TestScene&)>& fill_part) {
    TestScene whole, part;
    fill(whole), fill_part(part);
    ask(whole, {expression});
    whole.finish(), part.finish();
    kanuka::testing::RunningMean layer[3], alone[3];
    for (uint32_t seed = 0; seed < 12; seed++) {
        whole.view.settings.seed = seed, part.view.settings.seed = seed + 100;
        const Layers a = render_layers(whole, 32, 8), b = render_layers(part, 32, 8);
        Rgb sum(0);
        for (const PixelSums& p : b.pixels)
            sum += Rgb(p.rgb[0], p.rgb[1], p.rgb[2]) * (1 / float(b.pixels.size()));
        for (int c = 0; c < 3; c++)
            layer[c].add(double(mean_of(a.of[0])[c])), alone[c].add(double(sum[c]));
    }
    for (int c = 0; c < 3; c++) {
        const double error = std::hypot(layer[c].error(), alone[c].error());
        EXPECT_LT(error, 0.03 * alone[c].mean()) << expression << ": the test says nothing";
        EXPECT_NEAR(layer[c].mean(), alone[c].mean(), 4.5 * error + 1e-3 * alone[c].mean()) << expression;
    }
}

} // namespace

TEST(PathExpression, GroupsAreScenesWithoutOtherLights) {
    const auto fill = [](TestScene& s) { add_room(s, false); };
    expect_layer(fill, "C.*<L.'key'>", [&](TestScene& s) {
        fill(s);
        s.inputs.lights = {s.inputs.lights[1]};
    });
    const auto two = [](TestScene& s) {
        add_room(s, false);
        s.inputs.lights = {point_at(-1, 1, 1, Rgb(2, 2, 3), "key a"), point_at(1, 1, 1, Rgb(3, 1, 1), "b")};
        s.inputs.lights[1].name = "second";
    };
    expect_layer(two, "C.+<L.'a'>", [&](TestScene& s) {
        two(s);
        s.inputs.lights.pop_back();
    });
    expect_layer(two, "C.*<L.'second'>", [&](TestScene& s) {
        two(s);
        s.inputs.lights.erase(s.inputs.lights.begin());
    });
}

namespace {

constexpr int Nobody = 0, Key = 1, Rim = 2; // store::Links::area_light

// A glossy floor below things that shine, of which rays find as much as light sampling does.
struct Shining {
    int lamp, ball; // which area lights they are, or Nobody
    bool has_lamp = true, has_ball = true;
};
int add_shining(TestScene& s, const Shining& what) { // returns the first shape that shines
    s.add_quad({0, -1, 3}, {0, 0, 2}, {2, 0, 0},
               {matte(Rgb(0.6f, 0.3f, 0.2f)), metal(0.25f, Rgb(0.2f, 0.4f, 0.5f), Rgb(0.5f))});
    const int first = int(s.store.shapes().size());
    s.inputs.area_lights = {{"lamp 1", "warm key"}, {"rim", ""}};
    s.links.area_light = what.lamp;
    if (what.has_lamp)
        s.add_quad({-0.5f, 0.5f, 3}, {0.4f, 0, 0}, {0, 0, 0.4f}, {emission(Rgb(6, 5, 4))});
    s.links.area_light = what.ball;
    if (what.has_ball)
        s.add_sphere({0.7f, 0, 3}, 0.25f, 8, {emission(Rgb(1, 3, 5))});
    s.links.area_light = Nobody;
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, Size, Size);
    return first;
}
void finish(TestScene& s, int first, bool instanced) {
    if (instanced)
        s.finish(first, Transform::translate(0.1, 0.1, 0));
    else
        s.finish();
}
void expect_nothing(const std::vector<Rgb>& layer, const std::string& what) {
    for (const Rgb& v : layer)
        for (int c = 0; c < 3; c++)
            EXPECT_EQ(v[c], 0) << what;
}

} // namespace

// Light samples and rays that hit the light by chance share it between them: both are of one layer, so that
// the other is empty. By the table of one patch, by the hierarchy, and in instances.
TEST(PathExpression, AreaLightsAreLightsAndSurfacesThatShineAreNot) {
    for (const bool declared : {true, false})
        for (const int ways : {0, 1, 2})
            for (const int lanes : {1, 8, 16}) {
                const int lamp = declared ? Key : Nobody;
                TestScene s;
                ask(s, {"C.*L", "C.*O", "C<RG>L", "C<RG>O", "CL", "CO"});
                finish(s, add_shining(s, {lamp, lamp, true, ways > 0}), ways == 2);
                EXPECT_EQ(s.view.lights.tree.empty(), ways == 0);
                const Layers all = render_layers(s, 8, lanes);
                const std::string what = std::to_string(ways) + (declared ? " L" : " O");
                const size_t has = declared ? 0 : 1;
                expect_whole(all, {has}, what);
                for (const size_t part : {0u, 2u, 4u}) {
                    EXPECT_GT(mean_of(all.of[part + has]).y, 1e-3f) << what;
                    expect_nothing(all.of[part + 1 - has], what);
                }
            }
}

TEST(PathExpression, NamesOfAreaLightsAreScenesWithoutOthers) {
    for (const bool instanced : {false, true}) {
        TestScene s;
        ask(s, {"C.*L", "C.*O", "C.*<L.'key'>", "C.*<L.'rim'>", "C.*[^<L.'key'><L.'rim'>]", "C.*<L.'warm'>",
                "C.*<L.'lamp 1'>", "C.*<L.'other'>"});
        finish(s, add_shining(s, {Key, Rim}), instanced);
        const Layers all = render_layers(s, 8, 8);
        expect_whole(all, {0}, "lights");
        expect_whole(all, {2, 3}, "one and the other");
        expect_nothing(all.of[1], "O");
        expect_nothing(all.of[4], "neither of them");
        expect_nothing(all.of[7], "nobody's name");
        for (const size_t same : {5u, 6u})
            for (size_t i = 0; i < all.pixels.size(); i++)
                for (int c = 0; c < 3; c++)
                    EXPECT_EQ(all.of[same][i][c], all.of[2][i][c]);
    }
    const auto both = [](int lamp, int ball) { return [=](TestScene& s) { add_shining(s, {lamp, ball}); }; };
    const auto lamp = [](TestScene& s) { add_shining(s, {Nobody, Nobody, true, false}); };
    const auto ball = [](TestScene& s) { add_shining(s, {Nobody, Nobody, false, true}); };
    expect_layer(both(Key, Rim), "C.*<L.'key'>", lamp);
    expect_layer(both(Key, Rim), "C.*<L.'rim'>", ball);
    expect_layer(both(Key, Nobody), "C.*L", lamp);
    expect_layer(both(Key, Nobody), "C.*O", ball);
}

// A wall below a rectangle, and below a ball: the radiance is that of the light, times the albedo, times the
// form factor (Howell 1982, A Catalog of Radiation Configuration Factors, B-3 and B-46).
TEST(PathExpression, WallsBelowWhatShinesAreFormFactors) {
    constexpr double Albedo = 0.5, Radiance = 4, Distance = 2, Half = 0.7, Radius = 0.5;
    const double a = Half / Distance, root = std::sqrt(1 + a * a);
    const double rectangle = 4 * 2 * a / root * std::atan(a / root) / (2 * 3.141592653589793);
    const double sphere = Radius * Radius / (Distance * Distance);
    for (const bool ball : {false, true})
        for (const bool declared : {true, false}) {
            TestScene s;
            s.add_quad({0, -1, 0}, {0, 0, 4}, {4, 0, 0}, {matte(Rgb(float(Albedo)))});
            s.links.area_light = declared ? Key : Nobody;
            s.inputs.area_lights = {{"", ""}};
            if (ball)
                s.add_sphere({0, 1, 0}, float(Radius), 48, {emission(Rgb(float(Radiance)))});
            else
                s.add_quad({0, 1, 0}, {float(Half), 0, 0}, {0, 0, float(Half)},
                           {emission(Rgb(float(Radiance)))});
            s.camera({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, 1e-3f, 4, 4);
            ask(s, {declared ? "CDL" : "CDO", declared ? "CDO" : "CDL"});
            s.finish();
            kanuka::testing::RunningMean layer;
            for (uint32_t seed = 0; seed < 8; seed++) {
                s.view.settings.seed = seed;
                const Layers all = render_layers(s, 256, 8);
                expect_whole(all, {0}, "all of it");
                expect_nothing(all.of[1], "the other letter");
                layer.add(double(mean_of(all.of[0]).y));
            }
            const double expected = Albedo * Radiance * (ball ? sphere : rectangle);
            EXPECT_LT(layer.error(), 2e-3 * expected);
            EXPECT_NEAR(layer.mean(), expected, 4.5 * layer.error() + 3e-3 * expected) << ball << declared;
        }
}

// A floor of two lobes under one light: each layer is the floor with one of them, with its own colour.
TEST(PathExpression, LobesAreFloorsOfOneLobe) {
    const auto floor = [](const std::vector<Lobe>& lobes) {
        return [lobes](TestScene& s) {
            s.add_quad({0, -1, 0}, {0, 0, 4}, {4, 0, 0}, lobes);
            s.camera({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, 0.8f, Size, Size);
            s.inputs.max_depth = 1;
            scene::Light ball;
            ball.kind = Kind::Sphere;
            ball.radius = 0.3f;
            ball.amount = Rgb(3, 4, 5);
            ball.visible_camera = false;
            ball.world_from_light = Transform::translate(0.5, 1, 0);
            s.inputs.lights = {ball, constant_sky(Rgb(0.2f))};
        };
    };
    const Lobe diffuse = matte(Rgb(0.7f, 0.2f, 0.1f)),
               glossy = metal(0.5f, Rgb(0.05f, 0.2f, 0.3f), Rgb(0.3f));
    for (const bool first : {true, false}) {
        kanuka::testing::RunningMean layer[3], alone[3];
        TestScene both, one;
        floor({diffuse, glossy})(both), floor({first ? diffuse : glossy})(one);
        ask(both, {first ? "C<RD>L" : "C<RG>L"});
        both.finish(), one.finish();
        for (uint32_t seed = 0; seed < 12; seed++) {
            both.view.settings.seed = seed, one.view.settings.seed = seed + 100;
            const Layers a = render_layers(both, 64, 8), b = render_layers(one, 64, 8);
            Rgb sum(0);
            for (const PixelSums& p : b.pixels)
                sum += Rgb(p.rgb[0], p.rgb[1], p.rgb[2]) * (1 / float(b.pixels.size()));
            for (int c = 0; c < 3; c++)
                layer[c].add(double(mean_of(a.of[0])[c])), alone[c].add(double(sum[c]));
        }
        for (int c = 0; c < 3; c++) {
            const double error = std::hypot(layer[c].error(), alone[c].error());
            EXPECT_LT(error, 0.02 * alone[c].mean());
            EXPECT_NEAR(layer[c].mean(), alone[c].mean(), 4.5 * error + 1e-3 * alone[c].mean()) << first << c;
        }
    }
}

// In fog: nothing is lost between surfaces and volume, for lamps that are sampled along rays as well.
TEST(PathExpression, VolumesAreEvents) {
    TestScene s;
    const int fog = s.store.add_interior(medium(Rgb(0.05f), Rgb(0.3f, 0.4f, 0.5f), 0.3f));
    add_box(s, {0, 0, 0}, 10, {}, fog);
    s.add_quad({0, -1, 3}, {0, 0, 2}, {2, 0, 0}, {matte(Rgb(0.6f))});
    s.inputs.lights = {point_at(0.3, 1, 3, Rgb(4), "")};
    look_along_z(s, 0.6f);
    ask(s, {"CV+L", "CV*<RD>.*L", "C[^V]*L", "C.*V.*L"});
    s.finish();
    const Layers all = render_layers(s, 16, 8);
    expect_whole(all, {0, 1}, "scattered by fog alone, or by the floor");
    expect_whole(all, {2, 3}, "without fog and with");
    for (const auto& layer : all.of)
        EXPECT_GT(mean_of(layer).y, 1e-4f);
}

TEST(PathExpression, AreaLightsInFogAreLights) {
    for (const bool declared : {true, false}) {
        TestScene s;
        const int fog = s.store.add_interior(medium(Rgb(0.05f), Rgb(0.3f, 0.4f, 0.5f), 0.3f));
        add_box(s, {0, 0, 0}, 10, {}, fog);
        const int lamp = declared ? Key : Nobody;
        add_shining(s, {lamp, lamp});
        s.inputs.lights = {point_at(0.3, 1, 3, Rgb(1), "rim")};
        ask(s, {"C.*<L.'key'>", "C.*O", "C.*<L.'rim'>", "CV+<L.'key'>", "CV+O"});
        s.finish();
        const Layers all = render_layers(s, 16, 8);
        const size_t has = declared ? 0 : 1;
        expect_whole(all, {has, 2}, "what shines, and the lamp");
        for (const size_t part : {0u, 3u}) {
            EXPECT_GT(mean_of(all.of[part + has]).y, 1e-4f);
            expect_nothing(all.of[part + 1 - has], "the other letter");
        }
    }
}

} // namespace kanuka::transport
