// Lights with an area: directions against their density, densities of ray hits against those of sampling,
// lanes.
#include <gtest/gtest.h>
#include <random>

#include "base/test_statistics.h"
#include "transport/lights.h"
#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;

struct Case {
    const char* name;
    Kind kind;
    float width, height, radius;
    Vec3f point; // seen from here; lights are at (0.2, 0.1, 0.3), turned
};

const Case Cases[] = {
    {"quad, near", Kind::Quad, 1.2f, 0.7f, 0, {0.4f, 0.1f, 0.9f}},
    {"quad, off its edge", Kind::Quad, 2, 0.5f, 0, {2.0f, 0.9f, 0.7f}},
    {"quad, far", Kind::Quad, 0.3f, 0.2f, 0, {2, 3, 5}},
    {"disk", Kind::Disk, 0, 0, 0.6f, {0.9f, 0.3f, 1}},
    {"sphere, near", Kind::Sphere, 0, 0, 0.5f, {0.9f, 0.3f, 0.5f}},
    {"sphere, far", Kind::Sphere, 0, 0, 0.5f, {3, -4, 5}},
    {"cylinder", Kind::Cylinder, 0, 1.5f, 0.2f, {0.9f, -0.6f, 0.5f}},
    {"cylinder, from its end", Kind::Cylinder, 0, 0.6f, 0.4f, {1.9f, 0.5f, 1.4f}},
};

struct OneLight {
    TestScene s;
    explicit OneLight(const Case& c) {
        scene::Light light;
        light.kind = c.kind;
        light.width = c.width, light.height = c.height, light.radius = c.radius;
        light.world_from_light = Transform::translate(0.2, 0.1, 0.3) * Transform::rotate(20, 1, 2, 0);
        s.inputs.lights.push_back(light);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish();
    }
};

template <int W>
Vec3<Float<W>> lanes(const Vec3f& v) {
    return Vec3<Float<W>>(Float<W>(v.x), Float<W>(v.y), Float<W>(v.z));
}

} // namespace

// Cells of a cylinder map about the direction to the light: counts of samples against the density of
// intersect_shape(), which is what a ray that comes by chance is weighed with.
TEST(LightShapes, DirectionsFollowTheirDensity) {
    for (const Case& c : Cases) {
        const OneLight one(c);
        const int shape = one.s.view.lights.analytic[0].shape;
        const LightLanes<8> light(one.s.view, Int<8>(0));
        const Vec3f P = c.point;
        const Vec3f z = normalize(Vec3f(0.2f, 0.1f, 0.3f) - P);
        Vec3<Float<1>> x1, y1;
        coordinate_frame(lanes<1>(z), x1, y1);
        const Vec3f x(x1.x[0], x1.y[0], x1.z[0]), y(y1.x[0], y1.y[0], y1.z[0]);
        // As wide as the light is seen.
        float low = 1;
        std::mt19937 g(1);
        std::uniform_real_distribution<float> u(0, 1);
        constexpr int Rows = 12, Columns = 24, N = 400000;
        std::vector<Vec3f> directions;
        const auto sample = [&](int count) {
            for (int i = 0; i < count; i += 8) {
                Float<8> u0, u1;
                for (int k = 0; k < 8; k++)
                    u0.v[k] = u(g), u1.v[k] = u(g);
                const auto p = sample_shape(shape, light, lanes<8>(P), u0, u1, Mask<8>(true));
                const auto hit = intersect_shape(shape, light, lanes<8>(P), p.wi, Mask<8>(true));
                for (int k = 0; k < 8; k++) {
                    ASSERT_TRUE(p.valid[k]) << c.name;
                    directions.push_back({p.wi.x[k], p.wi.y[k], p.wi.z[k]});
                    low = std::min(low, dot(directions.back(), z));
                    if (hit.valid[k] && p.pdf_solid_angle[k] < 1e3f) { // not where rays graze
                        EXPECT_NEAR(hit.pdf_solid_angle[k], p.pdf_solid_angle[k],
                                    0.02f * p.pdf_solid_angle[k])
                            << c.name;
                        EXPECT_NEAR(hit.distance[k], p.distance[k], 2e-3f * p.distance[k]) << c.name;
                    }
                }
            }
        };
        sample(N);
        low = std::max(low - 0.02f * (1 - low), -1.0f);
        std::vector<double> seen(Rows * Columns + 1), expected(Rows * Columns + 1);
        for (const Vec3f& d : directions) {
            const int row = int((1 - dot(d, z)) / (1 - low) * Rows);
            const int column = int((std::atan2(dot(d, y), dot(d, x)) / (2 * Pi) + 0.5f) * Columns);
            seen[size_t(std::clamp(row, 0, Rows - 1) * Columns + std::clamp(column, 0, Columns - 1))]++;
        }
        // The integral of the density over each cell, by many rays.
        constexpr int Fine = 48;
        double all = 0;
        for (int row = 0; row < Rows * Fine; row++)
            for (int column = 0; column < Columns * Fine; column += 8) {
                Vec3<Float<8>> w;
                for (int k = 0; k < 8; k++) {
                    const float cosine = 1 - (1 - low) * (float(row) + 0.5f) / (Rows * Fine),
                                sine = std::sqrt(std::max(1 - cosine * cosine, 0.0f)),
                                phi = 2 * Pi * ((float(column + k) + 0.5f) / (Columns * Fine) - 0.5f);
                    const Vec3f d = x * (sine * std::cos(phi)) + y * (sine * std::sin(phi)) + z * cosine;
                    w.x.v[k] = d.x, w.y.v[k] = d.y, w.z.v[k] = d.z;
                }
                const auto hit = intersect_shape(shape, light, lanes<8>(P), w, Mask<8>(true));
                for (int k = 0; k < 8; k++)
                    if (hit.valid[k]) {
                        const double part = double(hit.pdf_solid_angle[k]) * 2 * 3.141592653589793 *
                                            double(1 - low) / (double(Rows) * Fine * Columns * Fine);
                        expected[size_t(row / Fine * Columns + (column + k) / Fine)] += N * part;
                        all += part;
                    }
            }
        EXPECT_NEAR(all, 1, 0.005) << c.name;
        // What the grid of rays misses at edges is an error of the test: cells that a light half fills are
        // compared loosely by a floor on the variance.
        double statistic = 0;
        int cells = 0;
        for (size_t i = 0; i + 1 < seen.size(); i++)
            if (expected[i] > 20) {
                const double slack = 0.01 * expected[i] + 2;
                statistic +=
                    (seen[i] - expected[i]) * (seen[i] - expected[i]) / (expected[i] + slack * slack);
                cells++;
            }
        EXPECT_GT(cells, 10) << c.name;
        EXPECT_GT(kanuka::testing::chi_square_p(statistic, cells), 1e-4)
            << c.name << " " << statistic << " " << cells;
    }
}

TEST(LightShapes, LanesAgree) {
    for (const Case& c : Cases) {
        const OneLight one(c);
        const int shape = one.s.view.lights.analytic[0].shape;
        std::mt19937 g(2);
        std::uniform_real_distribution<float> u(0, 1);
        for (int n = 0; n < 200; n++) {
            Float<16> u0, u1;
            for (int k = 0; k < 16; k++)
                u0.v[k] = u(g), u1.v[k] = u(g);
            const auto wide = sample_shape(shape, LightLanes<16>(one.s.view, Int<16>(0)), lanes<16>(c.point),
                                           u0, u1, Mask<16>(true));
            for (int k = 0; k < 16; k++) {
                const auto p = sample_shape(shape, LightLanes<1>(one.s.view, Int<1>(0)), lanes<1>(c.point),
                                            Float<1>(u0[k]), Float<1>(u1[k]), Mask<1>(true));
                for (int a = 0; a < 3; a++)
                    EXPECT_EQ(wide.wi[a][k], p.wi[a][0]) << c.name;
                EXPECT_EQ(wide.pdf_solid_angle[k], p.pdf_solid_angle[0]) << c.name;
                EXPECT_EQ(wide.distance[k], p.distance[0]) << c.name;
            }
        }
    }
}

// Quads that are seen under more than 0.03 steradians, and whose nearest point is within four roots of their
// area, are sampled evenly over what is seen of them; others over their area.
TEST(LightShapes, QuadsAreSampledAsTheyAreSeen) {
    struct Seen {
        double width, height;
        double x, y, z; // of the point; the quad lies about the origin and shines along z
        bool by_angle;
    };
    const Seen all[] = {{1, 1, 0, 0, 3.9, true},     {1, 1, 0, 0, 4.1, false},
                        {1, 1, 0.3, 2.4, 3.4, true}, {1, 1, 0.3, 2.9, 3.4, false}, // beside it
                        {4, 0.25, 1, -1, 3.8, true}, {4, 0.25, 0, -1, 4, false},
                        {4, 0.25, 3, 0, 3.8, true},  {4, 0.25, 3.1, 0.3, 3.9, false},
                        {1, 1, 0, 1.5, 0.09, true},  {1, 1, 0, 1.5, 0.082, false}, // grazing
                        {1, 1, -1.5, 0, 0.09, true}, {1, 1, -1.5, 0, 0.082, false}};
    for (const Seen& c : all) {
        TestScene s;
        scene::Light light;
        light.kind = Kind::Quad;
        light.width = float(c.width), light.height = float(c.height);
        s.inputs.lights.push_back(light);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish();
        // Of a right-angled corner below the point: atan(x y / (z d)).
        const auto corner = [&](double x, double y) {
            return std::atan(x * y / (c.z * std::sqrt(x * x + y * y + c.z * c.z)));
        };
        const double x0 = -c.width / 2 - c.x, x1 = c.width / 2 - c.x, y0 = -c.height / 2 - c.y,
                     y1 = c.height / 2 - c.y;
        const double angle = corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
        const Vec3f P{float(c.x), float(c.y), float(c.z)};
        for (const float u : {0.1f, 0.45f, 0.8f})
            for (const float v : {0.15f, 0.5f, 0.9f}) {
                const auto p = sample_shape(s.view.lights.analytic[0].shape, LightLanes<1>(s.view, Int<1>(0)),
                                            lanes<1>(P), Float<1>(u), Float<1>(v), Mask<1>(true));
                ASSERT_TRUE(p.valid[0]);
                const double d = double(p.distance[0]), cosine = c.z / d;
                const double pdf = c.by_angle ? 1 / angle : d * d / (cosine * c.width * c.height);
                EXPECT_NEAR(double(p.pdf_solid_angle[0]) / pdf, 1, 2e-3)
                    << c.x << " " << c.y << " " << c.z << ", of " << angle;
            }
    }
}

// From behind, from inside, in the plane: dark, and no NaN gets out.
TEST(LightShapes, DarkSides) {
    struct Dark {
        Kind kind;
        Vec3f point;
    };
    for (const Dark& d :
         {Dark{Kind::Quad, {0, 0, -1}}, Dark{Kind::Quad, {0.1f, 0, 0}}, Dark{Kind::Disk, {0, 0, -1}},
          Dark{Kind::Disk, {2, 0, 0}}, Dark{Kind::Sphere, {0.1f, 0.2f, 0}},
          Dark{Kind::Cylinder, {0.1f, 0.1f, 0.2f}}, Dark{Kind::Cylinder, {0, 0, 5}}}) {
        TestScene s;
        scene::Light light;
        light.kind = d.kind;
        light.radius = 0.5f;
        s.inputs.lights.push_back(light);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish();
        for (float u : {0.0f, 0.3f, 0.99f}) {
            const auto p = sample_shape(s.view.lights.analytic[0].shape, LightLanes<1>(s.view, Int<1>(0)),
                                        lanes<1>(d.point), Float<1>(u), Float<1>(u), Mask<1>(true));
            EXPECT_FALSE(p.valid[0]) << int(d.kind);
        }
    }
}

} // namespace kanuka::transport
