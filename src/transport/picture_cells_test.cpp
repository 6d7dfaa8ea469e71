// Pictures as densities: directions by a sky's picture, places by a quad's, against their integrals and
// counts; and how little their estimates vary.
#include <algorithm>
#include <random>

#include "transport/light_hits.h"
#include "transport/test_floor.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;
constexpr double DoublePi = 3.14159265358979323846;

struct Sky {
    TestScene s;
    explicit Sky(const std::function<Rgb(int, int)>& texel, int width = 64, int height = 32) {
        LatLong m{width, height, {}};
        for (int j = 0; j < height; j++)
            for (int i = 0; i < width; i++)
                for (int c = 0; c < 3; c++)
                    m.rgb.push_back(texel(i, j)[c]);
        s.inputs.map = m;
        scene::Light l;
        l.kind = Kind::Environment;
        l.texture = "a picture";
        l.world_from_light = Transform::rotate(40, 1, 2, 3);
        s.inputs.lights.push_back(l);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish();
    }
};

template <int W>
void wavelengths(Float<W> l[Wavelengths]) {
    for (int k = 0; k < Wavelengths; k++)
        l[k] = Float<W>(0.2f + 0.17f * float(k));
}

// Bilinear between texel centres, in double precision; the mean of its channels.
double bilinear(const LatLong& m, double x, double y) {
    x -= 0.5, y -= 0.5;
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const double fx = x - i, fy = y - j;
    const auto texel = [&](int a, int b) {
        const size_t at =
            3 * (size_t(std::clamp(b, 0, m.height - 1)) * size_t(m.width) + size_t((a + m.width) % m.width));
        return (double(m.rgb[at]) + double(m.rgb[at + 1]) + double(m.rgb[at + 2])) / 3;
    };
    return (texel(i, j) * (1 - fx) + texel(i + 1, j) * fx) * (1 - fy) +
           (texel(i, j + 1) * (1 - fx) + texel(i + 1, j + 1) * fx) * fy;
}

Rgb sun_of(float radius, int i, int j) { // about texel (20, 13) of 64 by 32
    const float dx = float(i) - 20, dy = float(j) - 13;
    return Rgb(dx * dx + dy * dy < radius * radius ? 5000.0f : 0.0f);
}

} // namespace

// Against the standard library's search, where tables rise, stand still and jump.
TEST(SearchGuide, FindsWhatTheTablesSay) {
    std::mt19937 g(7);
    std::uniform_real_distribution<float> uniform(0, 1);
    constexpr int Tables = 3;
    for (int steps : {1, 2, 3, 7, 64, 257, 1000}) {
        std::vector<float> tables;
        for (int t = 0; t < Tables; t++) {
            std::vector<double> sums{0};
            for (int i = 0; i < steps; i++) // of the second table one step has nearly all
                sums.push_back(sums.back() + (t == 1                       ? i == steps / 3 ? 1e6 : 1.0
                                              : uniform(g) < 0.7f && i > 0 ? 0.0
                                                                           : double(uniform(g)) + 0.01));
            for (double sum : sums)
                tables.push_back(float(sum / sums.back()));
        }
        const SearchGuide guide(tables, steps);
        std::vector<float> asked = tables;
        for (int k = 0; k < 2000; k++)
            asked.push_back(uniform(g));
        for (int k = 0; k < guide.shares; k++)
            asked.push_back(float(k) / float(guide.shares));
        for (float value : asked) {
            const float u = std::min(value, 0x1.fffffep-1f);
            Int<8> number;
            for (int k = 0; k < 8; k++)
                number.v[k] = k % Tables;
            const Int<8> found = search(SearchGuideView(guide), tables.data(), number,
                                        number * Int<8>(steps + 1), Float<8>(u));
            for (int k = 0; k < Tables; k++) {
                const auto first = tables.begin() + k * (steps + 1);
                ASSERT_EQ(found[k], std::upper_bound(first, first + steps, u) - first - 1)
                    << steps << " steps, table " << k << ", u " << u;
            }
        }
    }
}

// One sample of a sun's irradiance, of radii in texels: the variance over the mean squared.
TEST(SkyDensity, SmallSunsHardlyVary) {
    for (float radius : {1.0f, 3.0f, 6.0f}) {
        const Sky sky([&](int i, int j) { return sun_of(radius, i, j); });
        std::mt19937 g(3);
        std::uniform_real_distribution<float> u(0, 1);
        kanuka::testing::RunningMean mean;
        Float<8> l[Wavelengths];
        wavelengths(l);
        for (int n = 0; n < 20000; n++) {
            LightSample<8> s{};
            s.valid = Mask<8>(true);
            Float<8> u0, u1;
            for (int k = 0; k < 8; k++)
                u0.v[k] = u(g), u1.v[k] = u(g);
            sample_map(sky.s.view, u0, u1, s, l, Mask<8>(true));
            for (int k = 0; k < 8; k++)
                mean.add(double(s.radiance[1][k]) / double(s.pdf_solid_angle[k]));
        }
        const double relative = mean.variance() / (mean.mean() * mean.mean());
        RecordProperty("radius_" + std::to_string(int(radius)), std::to_string(relative));
        EXPECT_LT(relative, 0.01) << radius;
        // And the mean is the picture's, by sums in double precision.
        constexpr int Fine = 16;
        double sum = 0;
        const LatLong& m = sky.s.inputs.map;
        for (int y = 0; y < 32 * Fine; y++)
            for (int x = 0; x < 64 * Fine; x++)
                sum += bilinear(m, (x + 0.5) / Fine, (y + 0.5) / Fine) *
                       std::sin(DoublePi * (y + 0.5) / (32 * Fine));
        sum *= 2 * DoublePi * DoublePi / (64.0 * 32 * Fine * Fine);
        const auto white =
            emission_spectrum(sky.s.view, Float<8>(0.0f), Float<8>(0.0f), Float<8>(1e4f), Float<8>(1.0f), l);
        EXPECT_NEAR(mean.mean() / double(white[1][0]), sum, 0.005 * sum) << radius;
    }
}

// Directions over a lattice of cells against the density that rays which come by chance are weighed with;
// poles, the seam and a gradient are there.
TEST(SkyDensity, DirectionsFollowIt) {
    const std::function<Rgb(int, int)> pictures[] = {
        [](int i, int j) {
            return Rgb(1 + 0.8f * std::sin(0.4f * float(i)), 0.1f * float(j), 0.02f * float(i));
        },
        [](int i, int j) { return Rgb(i == 0 || i == 15 ? 9.0f : 0.1f, 0.3f, j == 0 ? 6.0f : 0.2f); },
        [](int, int j) { return Rgb(j == 0 || j == 7 ? 3.0f : 0.0f); },
        [](int i, int j) { return Rgb(i == 7 && j == 4 ? 100.0f : 0.01f); }};
    for (const auto& picture : pictures) {
        const Sky sky(picture, 16, 8);
        const EnvironmentMap& map = sky.s.view.lights.map;
        std::mt19937 g(5);
        std::uniform_real_distribution<float> u(0, 1);
        constexpr int Rows = 16, Columns = 32, N = 400000, Fine = 24;
        std::vector<double> seen(Rows * Columns), expected(Rows * Columns);
        Float<8> l[Wavelengths];
        wavelengths(l);
        const auto pdf_of = [&](const Vec3<Float<8>>& d, MapPlace<8>& p) {
            p = map_place(map, d);
            const MapCell<8> c(map, p);
            return map_pdf(map, MapTexels<8>(map, c).weights(map, c), c, p.sin_theta);
        };
        for (int n = 0; n < N; n += 8) {
            LightSample<8> s{};
            s.valid = Mask<8>(true);
            Float<8> u0, u1;
            for (int k = 0; k < 8; k++)
                u0.v[k] = u(g), u1.v[k] = u(g);
            sample_map(sky.s.view, u0, u1, s, l, Mask<8>(true));
            MapPlace<8> p;
            const Float<8> again = pdf_of(s.wi, p);
            for (int k = 0; k < 8; k++) {
                ASSERT_TRUE(s.valid[k]);
                seen[size_t(std::clamp(int(p.y[k] * Rows / 8), 0, Rows - 1) * Columns +
                            std::clamp(int(p.x[k] * Columns / 16), 0, Columns - 1))]++;
                // Sampled and hit: the same density, but where a direction tells less than a place.
                if (p.sin_theta[k] > 0.01f && s.pdf_solid_angle[k] > 0.01f) {
                    EXPECT_NEAR(again[k], s.pdf_solid_angle[k], 0.004f * s.pdf_solid_angle[k] + 0.002f);
                }
            }
        }
        double all = 0;
        const float* m = map.environment_from_render;
        for (int y = 0; y < Rows * Fine; y++)
            for (int x = 0; x < Columns * Fine; x += 8) {
                Vec3<Float<8>> d;
                double sine = 0;
                for (int k = 0; k < 8; k++) {
                    const double theta = DoublePi * (y + 0.5) / (Rows * Fine),
                                 phi = 2 * DoublePi * (x + k + 0.5) / (Columns * Fine);
                    sine = std::sin(theta);
                    const float e[3] = {float(sine * std::cos(phi)), float(sine * std::sin(phi)),
                                        float(std::cos(theta))};
                    for (int c = 0; c < 3; c++) // back by the transpose
                        d[c].v[k] = m[c] * e[0] + m[3 + c] * e[1] + m[6 + c] * e[2];
                }
                MapPlace<8> p;
                const Float<8> pdf = pdf_of(d, p);
                for (int k = 0; k < 8; k++) {
                    const double part = double(pdf[k]) * sine * 2 * DoublePi * DoublePi /
                                        (double(Rows) * Columns * Fine * Fine);
                    expected[size_t(y / Fine * Columns + (x + k) / Fine)] += N * part;
                    all += part;
                }
            }
        EXPECT_NEAR(all, 1, 0.002);
        double statistic = 0;
        int cells = 0;
        for (size_t i = 0; i < seen.size(); i++)
            if (expected[i] > 20) {
                const double slack = 0.004 * expected[i] + 1; // of the sums above
                statistic +=
                    (seen[i] - expected[i]) * (seen[i] - expected[i]) / (expected[i] + slack * slack);
                cells++;
            } else
                EXPECT_LT(seen[i], 60);
        EXPECT_GT(cells, 6);
        EXPECT_GT(kanuka::testing::chi_square_p(statistic, cells), 1e-4) << statistic << " " << cells;
    }
}

// What is left to directions is no brighter than the mean over the sphere: rows count by their solid angle.
TEST(SkyDensity, MeanIsThatOfTheSphere) {
    for (const int height : {4, 16}) {
        TestScene s;
        s.inputs.map = {2 * height, height, {}};
        double sum = 0;
        for (int j = 0; j < height; j++) {
            const float value = 1 + 3 * float(j * j) / float(height * height);
            s.inputs.map.rgb.insert(s.inputs.map.rgb.end(), size_t(6 * height), value);
            sum +=
                double(value) * (std::cos(DoublePi * j / height) - std::cos(DoublePi * (j + 1) / height)) / 2;
        }
        scene::Light l;
        l.kind = Kind::Environment;
        l.texture = "a picture";
        s.inputs.lights = {l};
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish();
        EXPECT_NEAR(s.view.lights.map.mean / sum, 1, 2e-4) << height;
    }
}

// A picture without contrast is not sampled by itself; BSDF hits find it.
TEST(SkyDensity, OfNoContrastIsNoChoice) {
    const Sky sky([](int, int) { return Rgb(0.3f, 0.7f, 0.2f); });
    EXPECT_EQ(sky.s.view.lights.choices, 0);
    const Sky sun([](int i, int j) { return sun_of(2, i, j); });
    EXPECT_EQ(sun.s.view.lights.choices, 1);
}

// ---- quads

namespace {

scene::Light pictured_quad(const std::function<float(int, int)>& texel, int width, int height) {
    scene::Light l;
    l.kind = Kind::Quad;
    l.width = 1.6f, l.height = 1.0f;
    l.amount = Rgb(3);
    l.visible_camera = false;
    auto table = std::make_shared<scene::LightTable>();
    table->width = width, table->height = height;
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++)
            table->rgb.insert(table->rgb.end(), 3, texel(i, j));
    l.table = table;
    l.world_from_light = Transform::translate(0.1, 0.2, 0) * Transform::rotate(90, 1, 0, 0);
    return l;
}

} // namespace

TEST(QuadDensity, PlacesFollowItAndRaysMeetThem) {
    const std::function<float(int, int)> pictures[] = {
        [](int i, int j) { return i == 3 && j == 1 ? 50.0f : 0.2f; },
        [](int i, int j) { return 0.2f + float(i * i) + 0.3f * float(j); },
        [](int i, int j) { return i == 0 && j == 3 ? 10.0f : 0.0f; }};
    for (const auto& picture : pictures) {
        TestScene s;
        s.inputs.lights.push_back(pictured_quad(picture, 6, 4));
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish();
        ASSERT_GE(s.view.lights.analytic[0].picture, 0);
        const LightLanes<8> light(s.view, Int<8>(0));
        const Vec3<Float<8>> P(Float<8>(0.5f), Float<8>(-0.7f), Float<8>(0.3f));
        constexpr int Rows = 8, Columns = 12, N = 400000, Fine = 32;
        std::vector<double> seen(Rows * Columns), expected(Rows * Columns);
        std::mt19937 g(7);
        std::uniform_real_distribution<float> u(0, 1);
        for (int n = 0; n < N; n += 8) {
            Float<8> u0, u1;
            for (int k = 0; k < 8; k++)
                u0.v[k] = u(g), u1.v[k] = u(g);
            const auto p = sample_quad(s.view, light, P, u0, u1, Mask<8>(true));
            const auto hit = intersect_quad(s.view, light, P, p.wi, Mask<8>(true));
            for (int k = 0; k < 8; k++) {
                ASSERT_TRUE(p.valid[k]);
                seen[size_t(std::clamp(int((0.5f - 0.5f * p.place.y[k]) * Rows), 0, Rows - 1) * Columns +
                            std::clamp(int((0.5f + 0.5f * p.place.x[k]) * Columns), 0, Columns - 1))]++;
                if (hit.valid[k]) {
                    EXPECT_NEAR(hit.pdf_solid_angle[k], p.pdf_solid_angle[k],
                                0.01f * p.pdf_solid_angle[k] + 0.01f);
                    EXPECT_NEAR(hit.distance[k], p.distance[k], 1e-3f * p.distance[k]);
                }
            }
        }
        double all = 0;
        const Transform t = s.inputs.lights[0].world_from_light;
        for (int y = 0; y < Rows * Fine; y++)
            for (int x = 0; x < Columns * Fine; x += 8) {
                Vec3<Float<8>> w;
                double jacobian[8];
                for (int k = 0; k < 8; k++) {
                    const float a = (float(x + k) + 0.5f) / (Columns * Fine),
                                b = (float(y) + 0.5f) / (Rows * Fine);
                    const Vec3f to =
                        t.point({1.6f * (a - 0.5f), 1.0f * (0.5f - b), 0}) - Vec3f(0.5f, -0.7f, 0.3f);
                    const double d2 = dot(to, to),
                                 cosine = -double(dot(to, t.vector({0, 0, 1}))) / std::sqrt(d2);
                    jacobian[k] = 1.6 * cosine / d2 / (double(Rows) * Columns * Fine * Fine);
                    const Vec3f d = normalize(to);
                    w.x.v[k] = d.x, w.y.v[k] = d.y, w.z.v[k] = d.z;
                }
                const auto hit = intersect_quad(s.view, light, P, w, Mask<8>(true));
                for (int k = 0; k < 8; k++)
                    if (hit.valid[k]) {
                        expected[size_t(y / Fine * Columns + (x + k) / Fine)] +=
                            N * double(hit.pdf_solid_angle[k]) * jacobian[k];
                        all += double(hit.pdf_solid_angle[k]) * jacobian[k];
                    }
            }
        EXPECT_NEAR(all, 1, 0.002);
        double statistic = 0;
        int cells = 0;
        for (size_t i = 0; i < seen.size(); i++)
            if (expected[i] > 20) {
                const double slack = 0.004 * expected[i] + 1;
                statistic +=
                    (seen[i] - expected[i]) * (seen[i] - expected[i]) / (expected[i] + slack * slack);
                cells++;
            }
        EXPECT_GT(cells, 10);
        EXPECT_GT(kanuka::testing::chi_square_p(statistic, cells), 1e-4) << statistic << " " << cells;
    }
}

// A floor under a quad of one bright texel: the mean is the integral over the picture, and its noise goes
// down.
TEST(QuadDensity, IrradianceOfABrightSpot) {
    FloorScene s;
    const auto texel = [](int i, int j) { return i == 11 && j == 4 ? 200.0f : 0.1f; };
    s.inputs.lights.push_back(pictured_quad(texel, 16, 10));
    s.finish();
    const Transform t = s.inputs.lights[0].world_from_light;
    LatLong m{16, 10, {}};
    for (int j = 0; j < 10; j++)
        for (int i = 0; i < 16; i++)
            m.rgb.insert(m.rgb.end(), 3, texel(i, j));
    const auto irradiance = [&](const Vec3f& p) {
        constexpr int N = 96;
        double sum = 0;
        for (int b = 0; b < N; b++)
            for (int a = 0; a < N; a++) {
                const double x = (a + 0.5) / N * 16, y = (b + 0.5) / N * 10;
                const Vec3f to = t.point({float(1.6 * (x / 16 - 0.5)), float(1.0 * (0.5 - y / 10)), 0}) - p;
                const double d2 = dot(to, to);
                sum += 3 * bilinear(m, std::clamp(x, 0.5, 15.499), y) * double(to.y) * double(to.y) /
                       (d2 * d2) * 1.6 / (N * N);
            }
        return sum;
    };
    expect_irradiance(s, irradiance, 0.004, 32, 64);
    const auto with = s.estimate(4, 24);
    s.data.lights.analytic[0].picture = -1;
    const auto without = s.estimate(4, 24);
    RecordProperty("noise2",
                   std::to_string(std::pow(with.channel[1].error() / without.channel[1].error(), 2)));
    EXPECT_LT(with.channel[1].error(), 0.4 * without.channel[1].error());
}

// ---- how often the sky is sampled

// A lamp in a closed room beneath a sky that nobody sees there.
TEST(ChoiceOfLight, AHiddenSkyCostsALampLittle) {
    const auto noise2 = [](float sky) {
        TestScene s;
        const Vec3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
        s.add_quad(-z, x, y, {matte(Rgb(0.5f))}), s.add_quad(z, y, x, {matte(Rgb(0.5f))});
        s.add_quad(-x, y, z, {matte(Rgb(0.5f))}), s.add_quad(x, z, y, {matte(Rgb(0.5f))});
        s.add_quad(-y, z, x, {matte(Rgb(0.5f))}), s.add_quad(y, x, z, {matte(Rgb(0.5f))});
        scene::Light lamp;
        lamp.kind = Kind::Sphere;
        lamp.radius = 0.1f;
        lamp.amount = Rgb(10);
        lamp.visible_camera = false;
        lamp.world_from_light = Transform::translate(0.2, 0.6, 0.3);
        s.inputs.lights.push_back(lamp);
        if (sky > 0) {
            s.inputs.map = LatLong{32, 16, {}};
            for (int j = 0; j < 16; j++)
                for (int i = 0; i < 32; i++)
                    s.inputs.map.rgb.insert(s.inputs.map.rgb.end(), 3,
                                            sky * (1 + 0.5f * std::sin(0.4f * float(i))));
            scene::Light l;
            l.kind = Kind::Environment;
            l.texture = "a picture";
            s.inputs.lights.push_back(l);
        }
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.9f, Size, Size);
        s.inputs.max_depth = 1;
        s.finish();
        const auto truth = s.render(512, 8);
        s.view.settings.seed = 9;
        double sum = 0;
        const auto pixels = s.render(4, 8);
        for (size_t i = 0; i < pixels.size(); i++)
            sum += std::pow(double(pixels[i].rgb[1]) - double(truth[i].rgb[1]), 2);
        return sum;
    };
    const double alone = noise2(0);
    for (float sky : {10.0f, 100.0f}) {
        const double more = noise2(sky) / alone;
        RecordProperty("sky_" + std::to_string(int(sky)), std::to_string(more));
        EXPECT_LT(more, 1.15) << sky;
    }
}

} // namespace kanuka::transport
