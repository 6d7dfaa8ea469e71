// Point lamps in fog: single scattering along camera rays against quadrature, and how little it varies.
#include "transport/test_media.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;
constexpr double DoublePi = 3.14159265358979323846;

struct Fog {
    TestScene s;
    std::array<float, 4> absorption, scattering;
    double g;
    std::vector<std::pair<Vec3f, double>> lamps;
    double wall = 0; // distance of a black wall across z; 0 = none

    Fog(const Rgb& absorbs, const Rgb& scatters, float g, std::vector<std::pair<Vec3f, double>> lamps,
        double wall = 0, Kind kind = Kind::Point)
        : absorption(absorbs.x > 0 ? amount(absorbs) : std::array<float, 4>{}), scattering(amount(scatters)),
          g(double(g)), lamps(lamps), wall(wall) {
        add_box(s, {0, 0, 0}, 6, {}, s.store.add_interior(medium(absorbs, scatters, g)));
        if (wall > 0)
            s.add_quad({0, 0, float(wall)}, {0, 20, 0}, {20, 0, 0}, {matte(Rgb(0))});
        for (const auto& [at, power] : lamps) {
            scene::Light l;
            l.kind = kind;
            l.amount = Rgb(float(power));
            l.cone_angle = 180;
            l.world_from_light = Transform::translate(at.x, at.y, at.z);
            s.inputs.lights.push_back(l);
        }
        look_along_z(s, 0.25f);
        s.inputs.volume_depth = 1; // one particle
        s.finish();
    }
    // Henyey and Greenstein's function, with the absorption before and after; even steps in the angle at the
    // lamp.
    double radiance(const Vec3f& direction, int wavelength) const {
        const double a = absorption[3] > 0 ? amount_at(absorption, wavelength) : 0,
                     b = amount_at(scattering, wavelength);
        const Vec3f d = normalize(direction);
        // The fog's border, or the wall.
        double end = 6 / std::max({std::abs(double(d.x)), std::abs(double(d.y)), double(d.z)});
        if (wall > 0)
            end = wall / double(d.z);
        double sum = 0;
        for (const auto& [at, power] : lamps) {
            const double along = double(dot(at, d)),
                         off = std::max(double(length(at - d * float(along))), 1e-6);
            const double first = std::atan2(-along, off), last = std::atan2(end - along, off);
            constexpr int N = 400;
            for (int i = 0; i < N; i++) {
                const double angle = first + (last - first) * (i + 0.5) / N, x = off * std::tan(angle),
                             t = along + x;
                const double r = std::hypot(x, off),
                             cosine = -x / r; // between the ray and the direction to the lamp
                const double hg = (1 - g * g) / (4 * DoublePi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
                // dt / r^2 = d angle / off
                sum += (last - first) / N / off * power * b * hg * std::exp(-(a + b) * (t + r));
            }
        }
        return sum;
    }
    Rgb expected() const {
        Rgb sum(0);
        for (int y = 0; y < Size; y++)
            for (int x = 0; x < Size; x++) {
                const Vec3f p = s.pixel_direction(x, y);
                double xyz[3] = {0, 0, 0};
                for (int i = 0; i < color::LambdaCount; i += 5) {
                    const double light =
                        5 * color::illuminant_d65()[size_t(i)] * radiance(p, i) / color::cie_y_integral();
                    xyz[0] += light * color::cie_x()[size_t(i)], xyz[1] += light * color::cie_y()[size_t(i)],
                        xyz[2] += light * color::cie_z()[size_t(i)];
                }
                sum +=
                    color::xyz_to_rgb({float(xyz[0]), float(xyz[1]), float(xyz[2])}) * (1.0f / (Size * Size));
            }
        return sum;
    }
};

} // namespace

TEST(Fog, SingleScatteringOfLamps) {
    // Beside the picture, where what pixels see is smooth.
    const std::vector<std::pair<Vec3f, double>> one = {{{0.7f, 0.21f, 2}, 3}},
                                                two = {{{0.7f, 0.21f, 2}, 3}, {{-1.2f, -0.4f, 3.5f}, 10}};
    const Rgb none(0);
    const Fog cases[] = {{none, Rgb(0.05f), 0, one},
                         {Rgb(0.05f), Rgb(0.1f, 0.2f, 0.5f), 0.6f, one},
                         {Rgb(0.3f, 0.1f, 0.05f), Rgb(1.5f), -0.3f, two},
                         {none, Rgb(0.2f), 0, two, 1.5},  // behind a wall
                         {none, Rgb(0.2f), 0.3f, one, 3}, // in front of it
                         {none, Rgb(0.2f), 0.3f, two, 3, Kind::Spot}};
    int k = 0;
    for (const Fog& fog : cases) {
        auto& s = const_cast<TestScene&>(fog.s);
        EXPECT_EQ(s.view.lights.fog_lamps.size(), fog.lamps.size());
        if (k == 3) {
            EXPECT_EQ(s.estimate(16, 1).channel[1].mean(), 0);
        } else if (k < 5)
            expect_mean(s.estimate(64, 8), fog.expected(), 0.006, "case " + std::to_string(k));
        else {
            const auto with = s.estimate(256, 8);
            s.view.lights.fog_lamps = {};
            expect_same(with, s.estimate(256, 8), 0.005, "spots");
        }
        k++;
    }
}

// A lamp that does not shine on what no set is named of is not sampled in fog either.
TEST(Fog, LampsAreLinked) {
    const std::pair<Vec3f, double> lit{{0.7f, 0.21f, 2}, 3}, unlit{{-0.9f, -0.4f, 2.5f}, 10};
    Fog fog(Rgb(0), Rgb(0.1f), 0, {lit, unlit});
    fog.s.inputs.lights[1].lit_sets = ~1;
    fog.s.finish();
    ASSERT_TRUE(fog.s.view.lights.linked);
    expect_mean(fog.s.estimate(64, 8), Fog(Rgb(0), Rgb(0.1f), 0, {lit}).expected(), 0.006, "one of two");
}

// Many scatterings, colours, a surface: with and without, the same; by the plain integrator, too.
TEST(Fog, TheSameWithAndWithout) {
    TestScene s;
    store::Interior mist = medium(Rgb(0.02f, 0.05f, 0.1f), Rgb(0.3f, 0.2f, 0.1f), 0.5f);
    add_box(s, {0, 0, 3}, 2.5f, {}, s.store.add_interior(mist)); // the camera is outside
    s.add_quad({0, -1, 3}, {0, 0, 2}, {2, 0, 0}, {matte(Rgb(0.7f))});
    scene::Light l;
    l.kind = Kind::Point;
    l.amount = Rgb(5);
    l.world_from_light = Transform::translate(0.3, 0.5, 2.5);
    s.inputs.lights.push_back(l);
    look_along_z(s, 0.4f);
    s.inputs.max_depth = 4;
    s.finish();
    ASSERT_EQ(s.view.lights.fog_lamps.size(), 1u);
    const auto with = s.estimate(128, 8);
    s.view.settings.integrator = IntegratorChoice::parse("reference");
    const auto plain = s.estimate(128, 8);
    s.view.settings.integrator = IntegratorChoice::parse("path");
    s.view.lights.fog_lamps = {};
    const auto without = s.estimate(256, 8);
    expect_same(with, without, 0.006, "without");
    expect_same(with, plain, 0.01, "plain");
}

TEST(Fog, VariesLittle) {
    Fog fog(Rgb(0), Rgb(0.05f), 0, {{{0.13f, 0.21f, 2}, 3}});
    const auto relative = [&] {
        const auto truth = fog.s.render(2048, 8);
        fog.s.view.settings.seed = 7;
        const auto pixels = fog.s.render(64, 8);
        fog.s.view.settings.seed = 0;
        double sum = 0;
        for (size_t i = 0; i < pixels.size(); i++)
            sum +=
                std::pow(double(pixels[i].rgb[1]) / double(truth[i].rgb[1]) - 1, 2) / double(pixels.size());
        return sum;
    };
    const double with = relative();
    const auto lamps = std::exchange(fog.s.view.lights.fog_lamps, {});
    const auto few = fog.s.render(64, 8);
    fog.s.view.lights.fog_lamps = lamps;
    const auto truth = fog.s.render(2048, 8);
    double without = 0;
    for (size_t i = 0; i < few.size(); i++)
        without += std::pow(double(few[i].rgb[1]) / double(truth[i].rgb[1]) - 1, 2) / double(few.size());
    RecordProperty("with", std::to_string(with));
    RecordProperty("without", std::to_string(without));
    EXPECT_LT(with, 0.002);
    EXPECT_LT(with, 0.05 * without);
}

} // namespace kanuka::transport
