// Media that are thicker here than there: transmittance, furnaces and lights against what is known, and
// against the same medium without a field.
#include "transport/fields.h"

#include <random>
#include <set>

#include "transport/majorants.h"
#include "transport/test_media.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using store::DensityField;

// A box around c, half a side each way; density(x, y, z) at the lattice, all in [0, 1].
std::shared_ptr<const DensityField> field(Vec3f c, float half, int n,
                                          const std::function<double(double, double, double)>& density,
                                          DensityField::Shape shape = DensityField::Box) {
    DensityField f;
    f.shape = shape;
    f.size = {n, n, n};
    const float s = 0.5f / half;
    f.unit_from_render = {s, 0, 0, 0.5f - s * c.x, 0, s, 0, 0.5f - s * c.y, 0, 0, s, 0.5f - s * c.z};
    for (int z = 0; z < n; z++)
        for (int y = 0; y < n; y++)
            for (int x = 0; x < n; x++)
                f.density.push_back(float(density(x / std::max(n - 1.0, 1.0), y / std::max(n - 1.0, 1.0),
                                                  z / std::max(n - 1.0, 1.0))));
    return std::make_shared<const DensityField>(std::move(f));
}
double even(double, double, double) {
    return 1;
}

TEST(DensityField, TrilinearWithinItsShape) {
    const auto density = [](double x, double y, double z) {
        return 0.1 + 0.2 * x + 0.3 * y * z + 0.4 * z * x * y;
    };
    for (auto shape :
         {DensityField::Box, DensityField::Ellipsoid, DensityField::Cylinder, DensityField::Cone}) {
        TestScene s;
        store::Interior in = medium(Rgb(0), Rgb(1));
        in.field = field({0, 0, 4}, 1, 2, density, shape);
        add_box(s, {0, 0, 4}, 1, {}, s.store.add_interior(in));
        look_along_z(s, 0.01f);
        s.finish();
        int inside = 0;
        for (int k = 0; k < 1000; k++) {
            const float x = 0.001f * float(k), y = float((k * 37) % 100) / 100, z = float((k * 61) % 90) / 90;
            const FieldLanes<8> lanes(s.view, Int<8>(0),
                                      Vec3<Float<8>>(Float<8>(2 * x - 1), Float<8>(2 * y - 1), Float<8>(2)),
                                      Vec3<Float<8>>(Float<8>(0.0f), Float<8>(0.0f), Float<8>(1.0f)));
            const float got = lanes.density(Float<8>(1 + 2 * z))[5];
            const float a = 2 * x - 1, b = 2 * y - 1, c = 2 * z - 1, r = std::sqrt(a * a + b * b);
            const float depth = shape == DensityField::Box         ? 1.0f
                                : shape == DensityField::Ellipsoid ? 1 - std::sqrt(r * r + c * c)
                                : shape == DensityField::Cylinder  ? 1 - r
                                                                   : 1 - z - r;
            if (std::abs(depth) < 1e-4f)
                continue;
            inside += depth > 0;
            EXPECT_NEAR(got, depth > 0 ? density(double(x), double(y), double(z)) : 0, 2e-6)
                << shape << " " << k;
        }
        EXPECT_GT(inside, 200);
        EXPECT_EQ(inside == 1000, shape == DensityField::Box);
    }
}

// What passes is the exponential of the optical thickness along the ray, at every wavelength, whether it is
// scattered away or absorbed.
TEST(DensityField, Transmittance) {
    const auto ramp = [](double, double, double z) { return z; };
    for (const bool scatters : {true, false}) {
        const Rgb sigma(0.4f, 1.0f, 2.2f);
        for (int n : {1, 2, 9}) {
            TestScene s;
            store::Interior in = scatters ? medium(Rgb(0), sigma) : medium(sigma, Rgb(0));
            in.field = field({0, 0, 4}, 1, n, n == 1 ? even : ramp);
            add_box(s, {0, 0, 4}, 1, {}, s.store.add_interior(in));
            look_along_z(s, 0.001f);
            s.inputs.lights.push_back(visible_sky(Rgb(1)));
            s.finish();
            ASSERT_TRUE(s.view.media.tracked && s.view.media.scatters && !s.view.media.fields.empty());
            s.view.settings.volume_depth = 2; // in and out, or in and one particle
            const auto a = amount(sigma);
            const double thickness = n == 1 ? 2 : 1;
            expect_mean(s.estimate(128, 16),
                        seen([&](int i) { return std::exp(-thickness * amount_at(a, i)); }), 0.005,
                        "lattice of " + std::to_string(n) + (scatters ? ", scattering" : ", absorbing"));
        }
    }
}

// Thin air but for one corner.
DensityField corner(double thin, const Vec3f& at = Vec3f(0, 0, 4)) {
    return *field(at, 1, 33, [thin](double x, double y, double z) {
        return x > 0.99 && y > 0.99 && z > 0.99 ? 1.0 : thin * (1 + z);
    });
}

TEST(Majorants, AreFineWhereThatSavesSteps) {
    const Majorants m = make_majorants(corner(0.001), 1000);
    EXPECT_GT(m.values.size(), 8u);
    EXPECT_EQ(m.values.size(), size_t(m.cells[0] * m.cells[1] * m.cells[2]));
    EXPECT_EQ(m.values.back(), 1.0f);
    EXPECT_NEAR(m.values.front(), 0.001 * (1 + 1.0 / m.cells[2] + 1 / 32.0), 1e-6);
    EXPECT_EQ(make_majorants(corner(0.001), 0.1f).values.size(), 1u) << "a cell more is a step more";
    EXPECT_EQ(make_majorants(*field({0, 0, 4}, 1, 33, even), 1000).values.size(), 1u);
}

// How fine they are depends on how thick the box is on the mean, whichever way its sides lie.
TEST(Majorants, AreAsFineWhicheverWayTheBoxLies) {
    const float sides[][3] = {{0.01f, 1, 40}, {1, 40, 0.01f}, {40, 0.01f, 1}, {0.01f, 40, 1}};
    std::set<size_t> counts;
    for (float extinction = 0.01f; extinction < 1e5f; extinction *= 1.5f) {
        size_t first = 0;
        for (const auto& side : sides) {
            DensityField f = corner(0.01);
            for (float& d : f.density)
                d = d < 1 ? 0.01f : 1;
            for (int r = 0; r < 3; r++)
                f.unit_from_render[size_t(5 * r)] = 1 / side[r];
            const size_t count = make_majorants(f, extinction).values.size();
            first = first ? first : count;
            EXPECT_EQ(count, first) << extinction << ' ' << side[0] << ' ' << side[1];
            counts.insert(count);
        }
    }
    EXPECT_GT(counts.size(), 2u);
}

// Along any ray the cells follow each other up to the end of the box, and no density is above its cell's
// majorant.
TEST(Majorants, BoundTheDensityAlongRays) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    TestScene s;
    store::Interior in = medium(Rgb(0), Rgb(400));
    in.field =
        field({0, 0, 4}, 1, 14, [&](double, double, double) { return std::pow(double(unit(random)), 8); });
    add_box(s, {0, 0, 4}, 1, {}, s.store.add_interior(in));
    s.finish();
    ASSERT_GT(s.view.media.fields[FieldRow::CellsX], 1);
    for (int k = 0; k < 2000; k++) {
        Vec3<Float<8>> o, d;
        for (int c = 0; c < 3; c++)
            for (int lane = 0; lane < 8; lane++) {
                o[c].v[lane] = (c == 2 ? 4 : 0) + 2.4f * (unit(random) - 0.5f);
                d[c].v[lane] = lane < 3 && lane != c ? 0.0f : unit(random) - 0.5f; // the first along axes
            }
        const FieldLanes<8> lanes(s.view, Int<8>(0), o, d);
        Float<8> from(0.0f), to(100.0f);
        lanes.clip(from, to);
        FieldLanes<8>::Cells cells(lanes, from);
        Float<8> t = from;
        for (int step = 0; step < 60 && any(t < to); step++, cells.next(t < to)) {
            const Float<8> end = max(min(cells.end(), to), t), most = cells.majorant() + Float<8>(1e-5f);
            for (int part = 0; part <= 8; part++)
                EXPECT_FALSE(any((lanes.density(t + (end - t) * Float<8>(0.125f * float(part))) > most) &
                                 (from < to)));
            t = end;
        }
        EXPECT_FALSE(any((t < to) & (from < to)));
    }
}

// Beside the corner the closed form passes; through a corner that is as good as solid nothing does.
TEST(Majorants, Transmittance) {
    struct Case {
        float extinction, thin, across;
    };
    for (const Case& c : {Case{300, 0.001f, 0}, Case{1e12f, 0, 0}, Case{1e12f, 0, 0.99f}}) {
        TestScene s;
        const Rgb sigma = Rgb(0.4f, 1.0f, 0.7f) * c.extinction;
        store::Interior in = medium(Rgb(0), sigma);
        const Vec3f at(-c.across, -c.across, 4);
        in.field = std::make_shared<const DensityField>(corner(double(c.thin), at));
        add_box(s, at, 1, {}, s.store.add_interior(in));
        look_along_z(s, 0.0001f);
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.finish();
        s.view.settings.volume_depth = 2;
        const auto a = amount(sigma);
        const double width = 2, mean = 1.5 * double(c.thin);
        expect_mean(c.extinction > 1e6f ? s.estimate(16, 8) : s.estimate(128, 16),
                    seen([&](int i) { return c.across > 0 ? 0 : std::exp(-width * mean * amount_at(a, i)); }),
                    0.005, "extinction " + std::to_string(c.extinction) + " at " + std::to_string(c.across));
    }
}

// Rays that visit too many collisions are marched: a wavelength that hardly anything happens to, beside one
// that sees a wall, still passes as the closed form has it; so it does where it is scattered, from both ends.
TEST(Majorants, MarchedRaysPassAsTheyShould) {
    for (const bool scatters : {false, true}) {
        TestScene s;
        // 60 000 / m at 400 nm, 3.4 at 595, 0.7 at 650.
        const std::array<float, 4> a{0, -660, 264, 60000};
        store::Interior in;
        in.ior = 1;
        (scatters ? in.scatters : in.absorbs) = true;
        (scatters ? in.scattering_spectrum : in.absorption_spectrum) = a;
        in.field = field({0, 0, 4}, 1, 3, [](double, double, double z) { return 0.25 + 0.75 * z; });
        add_box(s, {0, 0, 4}, 1, {}, s.store.add_interior(in));
        look_along_z(s, 0.001f);
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.finish();
        s.view.settings.volume_depth = 2;
        const double depth = 2 * (0.25 + 0.75 / 2);
        const Rgb expected = seen([&](int i) { return std::exp(-depth * amount_at(a, i)); });
        EXPECT_GT(expected.x, 0.01f) << "something passes";
        expect_mean(s.estimate(24, 8), expected, 0.01, scatters ? "scattering" : "absorbing");
    }
}

// Spray: one voxel in a hundred is thick, the others are empty, and no bound by cells is close. What passes
// is integrated along the lattice's own line in double.
TEST(Majorants, SparseVoxels) {
    constexpr int Voxels = 257;
    for (const float extinction : {150.0f, 500.0f}) {
        TestScene s;
        store::Interior in = medium(Rgb(0), Rgb(extinction));
        auto spray = std::make_shared<DensityField>();
        spray->size = {1, 1, Voxels};
        spray->unit_from_render = {0.5f, 0, 0, 0.5f, 0, 0.5f, 0, 0.5f, 0, 0, 0.5f, -1.5f};
        std::mt19937 random(3);
        for (int i = 0; i < Voxels; i++)
            spray->density.push_back(random() % 100 == 0 ? 1.0f : 0.0f);
        spray->density.front() = spray->density.back() = 0;
        spray->density[Voxels / 3] = 1;
        double mean = 0; // values fall to their neighbours' in straight lines: trapezia
        for (const float density : spray->density)
            mean += double(density) / (Voxels - 1);
        in.field = spray;
        add_box(s, {0, 0, 4}, 1, {}, s.store.add_interior(in));
        look_along_z(s, 0.0001f);
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.finish();
        s.view.settings.volume_depth = 2;
        const auto a = amount(Rgb(extinction));
        expect_mean(s.estimate(256, 16), seen([&](int i) { return std::exp(-2 * mean * amount_at(a, i)); }),
                    0.02, "extinction " + std::to_string(extinction));
    }
}

// A field whose box is smaller than the body that it is in: beside the box there is nothing, before it and
// behind it too.
TEST(DensityField, EndsWithItsBox) {
    const Rgb sigma(0.4f, 1.0f, 2.2f);
    const auto a = amount(sigma);
    for (const bool scatters : {true, false})
        for (const float aside : {0.0f, 1.0f}) {
            TestScene s;
            store::Interior in = scatters ? medium(Rgb(0), sigma) : medium(sigma, Rgb(0));
            DensityField f; // a cube of side 1 about (aside, 0, 4)
            f.unit_from_render = {1, 0, 0, 0.5f - aside, 0, 1, 0, 0.5f, 0, 0, 1, -3.5f};
            f.density = {1};
            in.field = std::make_shared<const DensityField>(f);
            add_box(s, {0, 0, 4}, 1.7f, {}, s.store.add_interior(in));
            look_along_z(s, 0.001f);
            s.inputs.lights.push_back(visible_sky(Rgb(1)));
            s.finish();
            s.view.settings.volume_depth = 2;
            const auto through = [&](int i) { return aside > 0 ? 1 : std::exp(-amount_at(a, i)); };
            expect_mean(s.estimate(128, 16), seen(through), 0.005, aside > 0 ? "beside" : "through");
        }
}

TEST(DensityField, WhiteMediaVanish) {
    const auto clumps = [](double x, double y, double z) {
        return std::pow(std::sin(5 * x + 3 * z) * std::cos(4 * y) * 0.5 + 0.5, 3);
    };
    for (const Rgb& sigma : {Rgb(1), Rgb(9), Rgb(0.5f, 2, 6)}) {
        TestScene s;
        store::Interior in = medium(Rgb(0), sigma, 0.4f);
        in.field = field({0, 0, 3}, 1, 8, clumps);
        add_box(s, {0, 0, 3}, 1, {}, s.store.add_interior(in));
        look_along_z(s, 0.24f);
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.finish();
        expect_mean(s.estimate(32, 10), Rgb(1), 0.008, "density " + std::to_string(sigma.y));
        EXPECT_EQ(s.nan_samples, 0u);
    }
}

// A field that is the same everywhere is the medium without one; one of half its density, half of it. Lights
// by next-event estimation and by BSDF hits, from within and without.
TEST(DensityField, EvenOnesAreNone) {
    for (const bool next_event : {true, false}) {
        const auto picture = [&](float share, bool analytic) {
            TestScene s;
            store::Interior in = medium(Rgb(0.1f, 0.2f, 0.3f), Rgb(2, 1, 0.5f), 0.3f);
            if (share < 1) {
                in = medium(Rgb(0.1f, 0.2f, 0.3f) * (1 / share), Rgb(2, 1, 0.5f) * (1 / share), 0.3f);
                in.field = field({0, 0, 4}, 1, 3, [&](double, double, double) { return double(share); });
            }
            add_box(s, {0, 0, 4}, 1, {}, s.store.add_interior(in));
            s.add_quad({0, -1.5f, 4}, {0, 0, 3}, {3, 0, 0}, {matte(Rgb(0.7f))});
            s.add_quad({0.3f, 0, 4.2f}, {0, 0.2f, 0}, {0.3f, 0, 0}, {matte(Rgb(0.5f))}); // in the fog
            if (analytic) {
                scene::Light ball;
                ball.kind = scene::Light::Kind::Sphere;
                ball.radius = 0.6f;
                ball.amount = Rgb(8);
                ball.world_from_light = Transform::translate(0.5, 0.9, 3.6); // in part within the fog
                ball.visible_camera = true;
                s.inputs.lights.push_back(ball);
            } else
                s.add_quad({0, 2.5f, 4}, {1, 0, 0}, {0, 0, 1}, {emission(Rgb(8))});
            look_along_z(s, 0.5f);
            s.inputs.max_depth = 5;
            s.finish();
            if (!next_event)
                s.view.lights.choices = 0, s.view.lights.emitter_choice = -1;
            return s.estimate(next_event ? 128 : 256, 16);
        };
        for (const bool analytic : {false, true})
            expect_same(picture(0.4f, analytic), picture(1, analytic), 0.01,
                        std::string(analytic ? "a ball that rays pass" : "a quad that shines") +
                            (next_event ? ", next-event estimation" : ", BSDF hits"));
    }
}

TEST(DensityField, LanesAgree) {
    TestScene s;
    store::Interior in = medium(Rgb(0.1f, 0.2f, 0.3f), Rgb(2, 4, 6), 0.3f);
    in.field = field(
        {0, 0, 4}, 1, 5, [](double x, double y, double z) { return x * y + (1 - x) * z * (1 - y); },
        DensityField::Ellipsoid);
    add_box(s, {0, 0, 4}, 1, {}, s.store.add_interior(in));
    s.add_quad({0, -1.2f, 4}, {0, 0, 3}, {3, 0, 0}, {matte(Rgb(0.7f))});
    s.add_quad({0, 2.5f, 4}, {1, 0, 0}, {0, 0, 1}, {emission(Rgb(8))});
    look_along_z(s, 0.4f);
    s.finish();
    const auto one = s.render(8, 1), eight = s.render(8, 8);
    EXPECT_EQ(s.nan_samples, 0u);
    int same = 0;
    for (size_t i = 0; i < one.size(); i++)
        same += std::abs(one[i].rgb[1] - eight[i].rgb[1]) <= 1e-3f * one[i].rgb[1];
    EXPECT_GT(same, int(one.size()) * 9 / 10);
}

} // namespace
} // namespace kanuka::transport
