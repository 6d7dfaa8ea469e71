// Portals: the environments' light as it is without them, with less noise in rooms; their directions against
// geometry.
#include <array>
#include <cstring>
#include <gtest/gtest.h>
#include <random>

#include "transport/light_portals.h"
#include "transport/test_media.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;

struct Double3 {
    double x, y, z;
};
double dot(const Double3& a, const Double3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Double3 cross(const Double3& a, const Double3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// A rectangle about `center` that shines along the cross product of its sides.
struct Rectangle {
    Vec3f center, x, y; // unit sides, at right angles
    float width, height;

    scene::Light light() const {
        scene::Light l;
        l.kind = Kind::Portal;
        l.width = width, l.height = height;
        const Vec3f axis = kanuka::cross(x, y);
        for (int r = 0; r < 3; r++)
            l.world_from_light.m[size_t(r)] = {x[r], y[r], axis[r], center[r]};
        return l;
    }
    Double3 corner(double a, double b) const {
        const auto at = [&](int c) {
            return double(center[c]) + 0.5 * a * double(width) * double(x[c]) +
                   0.5 * b * double(height) * double(y[c]);
        };
        return {at(0), at(1), at(2)};
    }
    // As seen from the origin: of two triangles, by van Oosterom and Strackee (1983).
    double solid_angle() const {
        const auto of = [](const Double3& a, const Double3& b, const Double3& c) {
            const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
            return 2 * std::atan2(std::abs(dot(a, cross(b, c))),
                                  la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
        };
        return of(corner(-1, -1), corner(1, -1), corner(1, 1)) +
               of(corner(-1, -1), corner(1, 1), corner(-1, 1));
    }
    // Does the direction lead from the origin through it, out of where it shines to?
    bool passes(const Double3& w) const {
        const Double3 px{x.x, x.y, x.z}, py{y.x, y.y, y.z}, n = cross(px, py),
                                                            c{center.x, center.y, center.z};
        const double along = dot(n, w), t = dot(n, c) / along;
        if (!(along < 0 && t > 0))
            return false;
        const Double3 at{w.x * t - c.x, w.y * t - c.y, w.z * t - c.z};
        return std::abs(dot(at, px)) <= 0.5 * double(width) && std::abs(dot(at, py)) <= 0.5 * double(height);
    }
};

// Wide ones: two overlap, one lies behind another, one turns its back.
const std::vector<Rectangle> Wide = {
    {{0.2f, 0.1f, 1}, {0, 1, 0}, {1, 0, 0}, 1, 1.4f},
    {{0.5f, 0.3f, 1.5f}, {0, 1, 0}, {1, 0, 0}, 1.2f, 0.8f},
    {{-1, 0.5f, 0.2f}, {0, 1, 0}, {0, 0, 1}, 0.7f, 1.1f},
    {{0, -1, 0}, {-1, 0, 0}, {0, 0, -1}, 2, 2},
};

struct Sky : TestScene {
    explicit Sky(const std::vector<Rectangle>& portals) {
        add_quad({0, -5, 0}, {0, 0, 1}, {1, 0, 0}, {matte(Rgb(0.5f))});
        camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 8, 8);
        inputs.lights.push_back(constant_sky(Rgb(1)));
        for (const Rectangle& r : portals)
            inputs.lights.push_back(r.light());
        finish();
    }
    PortalChooser<8> chooser() const {
        const Float<8> zero(0.0f);
        return PortalChooser<8>(view, {zero, zero, zero}, Mask<8>(true));
    }
};

// Calls use(direction, density) for as many samples.
template <class Use>
void sample_portals(const Sky& sky, int count, Use&& use) {
    std::mt19937 g(7);
    const auto one = [&] { return float(g() >> 8) * 0x1p-24f; };
    const PortalChooser<8> chooser = sky.chooser();
    for (int i = 0; i < count; i += 8) {
        Float<8> u0, u1;
        for (int k = 0; k < 8; k++)
            u0.v[k] = one(), u1.v[k] = one();
        LightSample<8> s;
        s.valid = Mask<8>(true);
        s.wi = {Float<8>(0.0f), Float<8>(0.0f), Float<8>(1.0f)};
        s.pdf_solid_angle = Float<8>(1.0f);
        chooser.sample(u0, u1, s);
        for (int k = 0; k < 8; k++) {
            ASSERT_TRUE(s.valid[k]);
            use(Double3{double(s.wi.x[k]), double(s.wi.y[k]), double(s.wi.z[k])},
                double(s.pdf_solid_angle[k]));
        }
    }
}

constexpr int Rings = 20, Sectors = 24;
Double3 direction(double z, double turn) {
    const double r = std::sqrt(std::max(1 - z * z, 0.0)), phi = 2 * 3.141592653589793 * turn;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

// A room with a window to the sky, at x = 1.2; seen from its middle, away from the window.
void add_room(TestScene& s) {
    const float h = 1.2f, hole = 0.45f, side = 0.5f * (h - hole), off = 0.5f * (h + hole);
    const Vec3f x(h, 0, 0), y(0, h, 0), z(0, 0, h);
    const auto wall = [&](Vec3f p, Vec3f a, Vec3f b, const Rgb& c) { s.add_quad(p, a, b, {matte(c)}); };
    wall(-z, x, y, Rgb(0.7f)), wall(z, y, x, Rgb(0.7f)), wall(-x, y, z, Rgb(0.8f, 0.5f, 0.3f));
    wall(-y, z, x, Rgb(0.5f)), wall(y, x, z, Rgb(0.8f));
    wall({h, off, 0}, {0, 0, h}, {0, side, 0}, Rgb(0.7f)),
        wall({h, -off, 0}, {0, 0, h}, {0, side, 0}, Rgb(0.7f));
    wall({h, 0, off}, {0, 0, side}, {0, hole, 0}, Rgb(0.7f)),
        wall({h, 0, -off}, {0, 0, side}, {0, hole, 0}, Rgb(0.7f));
    s.camera({0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, 0.9f, Size, Size);
    s.inputs.max_depth = 3;
}
// In the window: all of it, or half.
Rectangle window(float height) {
    return {{1.2f, 0, 0}, {0, 0, 1}, {0, 1, 0}, 0.9f, height};
}

enum class Outside { Even, Picture, Both };

void add_sky(TestScene& s, Outside what) {
    if (what != Outside::Picture)
        s.inputs.lights.push_back(constant_sky(Rgb(2, 3, 4)));
    if (what == Outside::Even)
        return;
    LatLong& m = s.inputs.map;
    m = {32, 16, {}};
    for (int j = 0; j < m.height; j++)
        for (int i = 0; i < m.width; i++)
            for (int c = 0; c < 3; c++)
                m.rgb.push_back(j < 8 ? 3 + 2 * float(i % 3) : 0.5f);
    scene::Light sky = constant_sky(Rgb(1));
    sky.texture = "sky";
    s.inputs.lights.push_back(sky);
}

std::unique_ptr<TestScene> room(Outside what, const std::vector<Rectangle>& portals) {
    auto s = std::make_unique<TestScene>();
    add_room(*s);
    add_sky(*s, what);
    for (const Rectangle& r : portals)
        s->inputs.lights.push_back(r.light());
    s->finish();
    return s;
}

struct Compared {
    kanuka::testing::RunningMean difference, level; // of the means of pictures, paired by seed
    double noise[2] = {0, 0};                       // squared, of pixels
};
Compared compare(TestScene& a, TestScene& b) {
    Compared result;
    std::array<std::vector<kanuka::testing::RunningMean>, 2> pixels;
    for (auto& p : pixels)
        p.resize(size_t(Size) * Size);
    for (int seed = 0; seed < 24; seed++) {
        double sums[2] = {0, 0};
        for (int k = 0; k < 2; k++) {
            TestScene& s = k ? b : a;
            s.view.settings.seed = uint32_t(seed);
            const auto picture = s.render(32, 8);
            EXPECT_EQ(s.nan_samples, 0u);
            for (size_t i = 0; i < picture.size(); i++) {
                sums[k] += double(picture[i].rgb[1]) / (Size * Size);
                pixels[size_t(k)][i].add(double(picture[i].rgb[1]));
            }
        }
        result.difference.add(sums[1] - sums[0]);
        result.level.add(sums[0]);
    }
    for (size_t k = 0; k < 2; k++)
        for (const auto& p : pixels[k])
            result.noise[k] += p.variance();
    return result;
}

} // namespace

TEST(Portals, DirectionsFollowTheirDensity) {
    const Sky sky(Wide);
    ASSERT_EQ(sky.view.lights.portals.size(), 4u);
    double all = 0;
    for (size_t k = 0; k < 3; k++) // the fourth turns its back
        all += Wide[k].solid_angle();
    const auto density = [&](const Double3& w) {
        double n = 0;
        for (const Rectangle& r : Wide)
            n += r.passes(w) ? 1 : 0;
        return n / all;
    };
    std::vector<double> seen(size_t(Rings * Sectors), 0.0), expected(seen);
    constexpr int Count = 1 << 18, Sub = 128;
    int off = 0;
    sample_portals(sky, Count, [&](const Double3& w, double pdf) {
        const double turn = std::atan2(w.y, w.x) / (2 * 3.141592653589793);
        const int ring = std::clamp(int((w.z + 1) * 0.5 * Rings), 0, Rings - 1),
                  sector = std::clamp(int((turn < 0 ? turn + 1 : turn) * Sectors), 0, Sectors - 1);
        seen[size_t(ring * Sectors + sector)]++;
        off += std::abs(pdf - density(w)) > 1e-3 * pdf; // but for rounding at edges
    });
    EXPECT_LT(off, Count / 10000);
    for (int cell = 0; cell < Rings * Sectors; cell++)
        for (int i = 0; i < Sub; i++)
            for (int j = 0; j < Sub; j++)
                expected[size_t(cell)] +=
                    density(direction(-1 + 2 * (cell / Sectors + (i + 0.5) / Sub) / Rings,
                                      (cell % Sectors + (j + 0.5) / Sub) / Sectors)) *
                    Count * 4 * 3.141592653589793 / (double(Rings * Sectors) * Sub * Sub);
    double whole = 0;
    for (double e : expected)
        whole += e;
    EXPECT_NEAR(whole / Count, 1, 0.002);
    const auto test = kanuka::testing::chi_square(seen, expected);
    EXPECT_GT(test.p, 1e-4);
}

// Where a ray leads, whoever made it.
TEST(Portals, DensityOfAnyDirection) {
    const Sky sky(Wide);
    double all = 0;
    for (size_t k = 0; k < 3; k++)
        all += Wide[k].solid_angle();
    std::mt19937 g(3);
    std::uniform_real_distribution<double> u(0, 1);
    int through = 0;
    for (int i = 0; i < 4000; i++) {
        const Double3 w = direction(2 * u(g) - 1, u(g));
        double n = 0;
        for (const Rectangle& r : Wide)
            n += r.passes(w) ? 1 : 0;
        through += n > 0;
        const Float<8> pdf =
            sky.chooser().pdf({Float<8>(float(w.x)), Float<8>(float(w.y)), Float<8>(float(w.z))});
        EXPECT_NEAR(double(pdf[0]), n / all, 1e-3 * n / all);
    }
    EXPECT_GT(through, 300);
}

// The mean of 1 / density is the solid angle of what is sampled: of small ones too, which are sampled by
// area.
TEST(Portals, DensitiesIntegrateToOne) {
    for (float distance : {0.02f, 1.0f, 9.0f, 400.0f}) {
        const Rectangle r{{0.1f, -0.2f, distance}, {0, 1, 0}, {1, 0, 0}, 0.8f, 0.5f};
        const Sky sky({r});
        kanuka::testing::RunningMean inverse;
        sample_portals(sky, 1 << 14, [&](const Double3&, double pdf) { inverse.add(1 / pdf); });
        const double truth = r.solid_angle();
        EXPECT_NEAR(inverse.mean(), truth, 4.5 * inverse.error() + 2e-3 * truth) << distance;
    }
}

TEST(Portals, RoomsHaveTheSameLightWithLessNoise) {
    for (Outside what : {Outside::Even, Outside::Picture, Outside::Both}) {
        const auto plain = room(what, {}), portal = room(what, {window(0.9f)});
        ASSERT_TRUE(portal->view.lights.map_choice >= 0);
        const Compared c = compare(*plain, *portal);
        EXPECT_GT(c.level.mean(), 0.01);
        EXPECT_LT(std::abs(c.difference.mean()), 4.5 * c.difference.error()) << int(what);
        EXPECT_LT(c.difference.error(), 0.03 * c.level.mean());
        EXPECT_LT(c.noise[1], 0.5 * c.noise[0]) << int(what);
        RecordProperty("noise_" + std::to_string(int(what)), std::to_string(c.noise[1] / c.noise[0]));
    }
}

// What they leave out is found by directions; what two of them cover counts once.
TEST(Portals, NeedNotFitTheWindow) {
    const Rectangle half = window(0.45f);
    Rectangle elsewhere = window(0.9f);
    elsewhere.center = {0, 3, 0};
    for (const std::vector<Rectangle>& portals :
         {std::vector<Rectangle>{half}, {window(0.9f), half}, {elsewhere}, {half, elsewhere, window(2)}}) {
        const auto plain = room(Outside::Both, {}), portal = room(Outside::Both, portals);
        const Compared c = compare(*plain, *portal);
        EXPECT_LT(std::abs(c.difference.mean()), 4.5 * c.difference.error()) << portals.size();
        EXPECT_LT(c.difference.error(), 0.03 * c.level.mean());
    }
}

// With several light samples too: the balance counts them.
TEST(Portals, SeveralLightSamples) {
    const auto plain = room(Outside::Both, {}), portal = room(Outside::Both, {window(0.45f)});
    portal->view.settings.light_samples = 4;
    const Compared c = compare(*plain, *portal);
    EXPECT_LT(std::abs(c.difference.mean()), 4.5 * c.difference.error());
}

TEST(Portals, Furnace) {
    for (const Lobe& lobe : {matte(Rgb(1)), metal(0.4f), glass(0)}) {
        TestScene s;
        s.add_sphere({0, 0, 3}, 1, 96, {lobe});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.24f, 24, 24);
        s.inputs.lights = {constant_sky(Rgb(1)), Rectangle{{2.5f, 0, 2}, {0, 0, 1}, {0, 1, 0}, 2, 3}.light(),
                           Rectangle{{0, 1.5f, 0.5f}, {1, 0, 0}, {0, 0, 1}, 2, 2}.light()};
        s.inputs.max_depth = 64;
        s.finish();
        const auto e = s.estimate(24, 10);
        EXPECT_EQ(e.nan_samples, 0u);
        for (const auto& c : e.channel)
            EXPECT_NEAR(c.mean(), 1, 0.006 + 4.5 * c.error());
    }
}

TEST(Portals, SameBitsOnAnyLanes) {
    const auto s = room(Outside::Both, {window(0.45f), window(2)});
    const auto one = s->render(4, 1);
    for (int lanes : {8, 16}) {
        const auto many = s->render(4, lanes);
        for (size_t i = 0; i < one.size(); i++)
            ASSERT_EQ(std::memcmp(one[i].rgb, many[i].rgb, sizeof one[i].rgb), 0) << lanes << " at " << i;
    }
}

TEST(Portals, WithoutAnEnvironmentAreTold) {
    TestScene s;
    add_room(s);
    s.inputs.lights.push_back(window(1).light());
    s.finish();
    EXPECT_EQ(s.view.lights.choices, 0);
    ASSERT_EQ(s.journal.entries().size(), 1u);
    EXPECT_NE(s.journal.entries()[0].message.find("portal"), std::string::npos);
}

} // namespace kanuka::transport
