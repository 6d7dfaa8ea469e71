// Light path expressions: which paths they mean, against std::regex over paths spelled out; and what they
// count of pictures, against pictures of less.
#include <chrono>
#include <functional>
#include <gtest/gtest.h>
#include <regex>

#include "transport/path_expression.h"
#include "transport/test_media.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;

// Letters of the steps behind the camera, and of the classes of lights below.
constexpr std::string_view StepLetters = "abcdefv", LightLetters = "olkm";
const LightNames Classes[] = {{}, {}, {"key"}, {"key", "rim"}};

// Every path of up to `most` steps before its light.
void each_path(int most, const std::function<void(const std::string&)>& visit) {
    std::vector<std::string> paths{""};
    for (size_t first = 0, length = 0; length <= size_t(most); length++) {
        const size_t end = paths.size();
        for (; first < end; first++) {
            for (const char light : LightLetters)
                visit(paths[first] + light);
            for (const char step : StepLetters)
                paths.push_back(paths[first] + step);
        }
    }
}

bool accepts(const PathAutomaton& a, const std::string& path) {
    uint8_t state = 0;
    for (const char c : path.substr(0, path.size() - 1)) {
        state = a.states[state].next[StepLetters.find(c) + 1];
        if (state == PathAutomaton::Dead)
            return false;
    }
    return a.states[state].accepts >> LightLetters.find(path.back()) & 1;
}

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

TEST(PathExpression, MeansThePathsOfItsRegularExpression) {
    const std::pair<const char*, const char*> cases[] = {
        {"C.*", ".*"},
        {"CL", "[lkm]"},
        {"CO", "o"},
        {"C<RD>L", "a[lkm]"},
        {"C<RD>[LO]", "a[olkm]"},
        {"C<RD>[<L.>O]", "a[olkm]"},
        {"CD+L", "[ad]+[lkm]"},
        {"C<R[DG]><.S>*<L.'key'>", "[ab][cf]*[km]"},
        {"C(S|V)*O", "([cf]|v)*o"},
        {"C<RD>{1,2}[^O]", "a{1,2}[^o]"},
        {"C[^<RD>]*L", "[^a]*[lkm]"},
        {"C<RD>?G{2}<[^R].>{0,}L", "a?[be]{2}[^abc]*[lkm]"},
        {"C(<RD>L|<TS><L.'rim'>)", "a[lkm]|fm"},
        {"C(<RD>V*){2}<T.>O", "(av*){2}[def]o"},
        {"C((D|G)+S){1,}L", "([adbe]+[cf])+[lkm]"},
        {"C.{3}L", ".{3}[lkm]"},
        {"C<L.'nobody'>", "[^\\s\\S]"},
        {"<RD>L", "[^\\s\\S]"},
    };
    for (const auto& [text, pattern] : cases) {
        const PathAutomaton a = compile_path_expression(text, Classes);
        const std::regex regex(pattern);
        int wrong = 0;
        each_path(
            4, [&](const std::string& path) { wrong += accepts(a, path) != std::regex_match(path, regex); });
        EXPECT_EQ(wrong, 0) << text;
    }
}

TEST(PathExpression, SaysWhatIsWrongAndWhere) {
    for (const char* text : {"C(", "C)", "C{", "*", "C<", "C<RX>", "C[", "C[]", "C<RD>{2,1}L", "CX", "C<L.'x",
                             "C.{99}L", "C<>", "C|*"}) {
        if (std::string(text) == "C[]") { // of nothing: no path
            EXPECT_EQ(compile_path_expression(text, Classes).states.size(), 1u);
            continue;
        }
        try {
            compile_path_expression(text, Classes);
            ADD_FAILURE() << text;
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find("expected"), std::string::npos) << error.what();
        }
    }
    // Too much to be read ends as well, and soon.
    std::string nested = "()", wide = "C";
    for (int k = 0; k < 60; k++)
        nested = "(" + nested + "){64}", wide += "(D|G)";
    const auto start = std::chrono::steady_clock::now();
    EXPECT_THROW(compile_path_expression(nested, Classes), Error);
    EXPECT_THROW(compile_path_expression(wide, Classes), Error);
    EXPECT_THROW(compile_path_expression(std::string(100000, '('), Classes), Error);
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 1.0);
}

TEST(PathExpression, LayersAddUpToThePicture) {
    const std::vector<std::string> expressions = {
        "C.*",         "C.*L",        "C.*O",                        // all; by what shines
        "C[LO]",       "C<RD>.*[LO]", "C<RG>.*[LO]",  "C<RS>.*[LO]", // by what is seen
        "C<T.>.*[LO]", "CV.*[LO]",    "C.*<L.'key'>", "C.*[^<L.'key'>]"};
    TestScene s;
    add_room(s);
    ask(s, expressions);
    s.finish();
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
    const Layers without = render_layers(plain, 8, 8);
    for (size_t i = 0; i < all.pixels.size(); i++)
        for (int c = 0; c < 3; c++)
            EXPECT_EQ(all.pixels[i].rgb[c], without.pixels[i].rgb[c]);
    for (const int lanes : {1, 16}) {
        TestScene other;
        add_room(other);
        ask(other, expressions);
        other.finish();
        const Layers same = render_layers(other, 8, lanes);
        for (size_t e = 0; e < expressions.size(); e++)
            for (size_t i = 0; i < all.pixels.size(); i++)
                for (int c = 0; c < 3; c++)
                    EXPECT_EQ(all.of[e][i][c], same.of[e][i][c]) << lanes << " " << expressions[e];
    }
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
                  const std::function<void(TestScene&)>& leave_out) {
    TestScene whole, part;
    fill(whole), fill(part);
    leave_out(part);
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
    expect_layer(fill, "C.*<L.'key'>", [](TestScene& s) { s.inputs.lights = {s.inputs.lights[1]}; });
    const auto two = [](TestScene& s) {
        add_room(s, false);
        s.inputs.lights = {point_at(-1, 1, 1, Rgb(2, 2, 3), "key a"), point_at(1, 1, 1, Rgb(3, 1, 1), "b")};
        s.inputs.lights[1].name = "second";
    };
    expect_layer(two, "C.+<L.'a'>", [](TestScene& s) { s.inputs.lights.pop_back(); });
    expect_layer(two, "C.*<L.'second'>",
                 [](TestScene& s) { s.inputs.lights.erase(s.inputs.lights.begin()); });
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

} // namespace kanuka::transport
