// Media that are thicker here than there: transmittance, furnaces and lights against what is known, and
// against the same medium without a field.
#include "transport/fields.h"

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

// What passes is the exponential of the thickness along the way, at every wavelength, whether it is scattered
// away or absorbed.
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
            ASSERT_TRUE(s.view.media && s.view.scatters && !s.view.fields.empty());
            s.view.volume_depth = 2; // in and out, or in and one particle
            const auto a = amount(sigma);
            const double thickness = n == 1 ? 2 : 1;
            expect_mean(s.estimate(128, 16),
                        seen([&](int i) { return std::exp(-thickness * amount_at(a, i)); }), 0.005,
                        "lattice of " + std::to_string(n) + (scatters ? ", scattering" : ", absorbing"));
        }
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
            s.view.volume_depth = 2;
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
// asked for and met, from within and without.
TEST(DensityField, EvenOnesAreNone) {
    for (const bool asked : {true, false}) {
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
                s.add_quad({0, 2.5f, 4}, {1, 0, 0}, {0, 0, 1}, {glow(Rgb(8))});
            look_along_z(s, 0.5f);
            s.inputs.max_depth = 5;
            s.finish();
            if (!asked)
                s.view.choices = 0, s.view.emitter_choice = -1;
            return s.estimate(asked ? 128 : 256, 16);
        };
        for (const bool analytic : {false, true})
            expect_same(picture(0.4f, analytic), picture(1, analytic), 0.01,
                        std::string(analytic ? "a ball that rays pass" : "a quad that shines") +
                            (asked ? ", asked" : ", met"));
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
    s.add_quad({0, 2.5f, 4}, {1, 0, 0}, {0, 0, 1}, {glow(Rgb(8))});
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
