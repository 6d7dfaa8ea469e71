// Pixels to directions, and the shape of blurred points.
#include "transport/camera.h"

#include <gtest/gtest.h>

#include "base/sampling.h"
#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using kanuka::testing::chi_square;

const Vec3f X{1, 0, 0}, Y{0, 1, 0}, Z{0, 0, 1};
constexpr double Degree = 3.14159265358979323846 / 180;

// Where in a room of a sphere every pixel looks.
std::vector<Vec3f> directions(TestScene& s, int width, int height) {
    s.add_sphere({0, 0, 0}, 1, 128, {matte(Rgb(0.5f))});
    s.camera(X, Y, Z, 1, width, height);
    CameraView& c = s.inputs.camera;
    c.left = -1, c.right = 1, c.bottom = -1, c.top = 1;
    s.finish();
    std::vector<Vec3f> out;
    for (const PixelSums& p : s.render(64, 8))
        out.push_back(p.hits > 0 ? normalize(Vec3f(p.position[0], p.position[1], p.position[2]))
                                 : Vec3f(0.0f));
    return out;
}

// In the regular polygon about the origin with a corner at radius 1, turned by an angle.
bool in_polygon(double x, double y, int n, double turned) {
    const double apothem = std::cos(180 * Degree / n);
    for (int k = 0; k < n; k++) {
        const double a = turned + (2 * k + 1) * 180 * Degree / n;
        if (x * std::cos(a) + y * std::sin(a) > apothem)
            return false;
    }
    return true;
}

} // namespace

TEST(Cameras, FisheyesLookWhereTheyShould) {
    constexpr int N = 32;
    for (const Projection projection : {Projection::Fisheye, Projection::Equisolid}) {
        TestScene s;
        s.inputs.camera.projection = projection;
        s.inputs.camera.half_angle = float(110 * Degree);
        const auto d = directions(s, N, N);
        for (int y = 0; y < N; y++)
            for (int x = 0; x < N; x++) {
                const double fx = (x + 0.5) / N * 2 - 1, fy = 1 - (y + 0.5) / N * 2, r = std::hypot(fx, fy);
                const Vec3f& got = d[size_t(y * N + x)];
                EXPECT_TRUE(r < 1.05 || got == Vec3f(0.0f));
                if (r > 0.95)
                    continue;
                const double a = projection == Projection::Fisheye ? r * 110 * Degree
                                                                   : 2 * std::asin(r * std::sin(55 * Degree));
                EXPECT_NEAR(std::acos(double(got.z)), a, 0.02) << x << "," << y;
                EXPECT_NEAR(double(got.x), std::sin(a) * fx / r, 0.02);
                EXPECT_NEAR(double(got.y), std::sin(a) * fy / r, 0.02);
            }
        // Outside of the image circle nothing is seen, and nothing counted as seen.
        EXPECT_EQ(s.render(4, 8)[0].alpha, 0);
        EXPECT_EQ(s.render(4, 1)[0].alpha, 0);
    }
}

TEST(Cameras, SphericalOnesSeeEverything) {
    constexpr int W = 32, H = 16;
    TestScene s;
    s.inputs.camera.projection = Projection::Spherical;
    const auto d = directions(s, W, H);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            const double lon = ((x + 0.5) / W * 2 - 1) * 180 * Degree,
                         lat = (1 - (y + 0.5) / H * 2) * 90 * Degree;
            const Vec3f& got = d[size_t(y * W + x)];
            EXPECT_NEAR(double(got.y), std::sin(lat), 0.02);
            if (y > 1 && y < H - 2) {
                EXPECT_NEAR(double(got.x), std::sin(lon) * std::cos(lat), 0.03) << x << "," << y;
                EXPECT_NEAR(double(got.z), std::cos(lon) * std::cos(lat), 0.03);
            }
        }
}

// Every part of the iris as likely as any other, by chi-square over squares of the plane.
TEST(Cameras, LensesAreSampledEvenly) {
    struct Lens {
        int blades;
        double turned, squeeze;
    };
    constexpr int Cells = 16, Strata = 512;
    int test = 0;
    for (const Lens& lens : {Lens{0, 0, 1}, Lens{3, 0, 1}, Lens{6, 0.3, 1}, Lens{5, 1.1, 2}}) {
        CameraView c{};
        c.lens_radius = 2;
        c.blades = lens.blades;
        c.blade_cos = float(std::cos(lens.turned)), c.blade_sin = float(std::sin(lens.turned));
        c.squeeze = float(lens.squeeze);
        std::vector<double> seen(Cells * Cells, 0.0), expected(seen);
        const auto inside = [&](double x, double y) {
            return lens.blades < 3 ? x * x + y * y <= 1 : in_polygon(x, y, lens.blades, lens.turned);
        };
        uint32_t state = 12345u + uint32_t(test++);
        const auto random = [&] {
            state = uint32_t(hash_bits(Int<1>(int(state + 0x9e3779b9u)))[0]);
            return float(state >> 8) * 0x1p-24f;
        };
        int outside = 0;
        const int count = 200000;
        double widest = 0, highest = 0;
        for (int i = 0; i < count; i++) {
            Float<1> px, py;
            sample_lens<1>(c, Float<1>(random()), Float<1>(random()), px, py);
            widest = std::max(widest, double(std::abs(px[0])));
            highest = std::max(highest, double(std::abs(py[0])));
            const double x = double(px[0]) * lens.squeeze / 2, y = double(py[0]) / 2;
            outside += !inside(x * 0.9999, y * 0.9999);
            const int a = std::clamp(int((x + 1) / 2 * Cells), 0, Cells - 1),
                      b = std::clamp(int((y + 1) / 2 * Cells), 0, Cells - 1);
            seen[size_t(b * Cells + a)]++;
        }
        EXPECT_EQ(outside, 0) << lens.blades;
        EXPECT_LE(widest, 2 / lens.squeeze * 1.0001);
        double area = 0;
        for (int j = 0; j < Strata; j++)
            for (int i = 0; i < Strata; i++)
                if (inside((i + 0.5) / Strata * 2 - 1, (j + 0.5) / Strata * 2 - 1)) {
                    expected[size_t(j * Cells / Strata * Cells + i * Cells / Strata)]++;
                    area++;
                }
        for (double& e : expected)
            e *= count / area;
        // Expectations are counts of a lattice: cells that it cuts off at the rim are merged into their like.
        EXPECT_GT(chi_square(seen, expected).p, 1e-4) << lens.blades;
    }
}

// A small light out of focus has the shape of the iris in the picture, turned around if it lies before the
// focus, and the size that the thin lens says.
TEST(Cameras, BlurredLightsShowTheIris) {
    constexpr int N = 48;
    for (const double squeeze : {1.0, 2.0}) {
        TestScene s;
        const float far = 4, focus = 2, radius = 0.5f;
        s.add_quad({0, 0, far}, X * 0.015f, Y * -0.015f, {matte(Rgb(0.5f))});
        s.camera(X, Y, Z, 0.2f, N, N);
        CameraView& c = s.inputs.camera;
        c.lens_radius = radius;
        c.focal_distance = focus;
        c.blades = 3;
        c.squeeze = float(squeeze);
        s.finish();
        // A lens point p sees the light at film point p (1 / focus - 1 / far).
        const double scale = double(radius) * (1 / double(focus) - 1 / double(far));
        double in = 0, out = 0, sum_x2 = 0, sum_y2 = 0, sum_x = 0, sum = 0;
        const auto pixels = s.render(1000, 8);
        for (int y = 0; y < N; y++)
            for (int x = 0; x < N; x++) {
                const double fx = ((x + 0.5) / N * 2 - 1) * 0.2, fy = (1 - (y + 0.5) / N * 2) * 0.2;
                const double a = double(pixels[size_t(y * N + x)].alpha);
                (in_polygon(fx / scale * squeeze * 0.7, fy / scale * 0.7, 3, 0) ? in : out) += a;
                sum += a, sum_x += a * fx, sum_x2 += a * fx * fx, sum_y2 += a * fy * fy;
            }
        EXPECT_GT(in, 300);
        EXPECT_EQ(out, 0);
        // Moments of a triangle inscribed in the circle of radius r: mean 0, variances r^2 / 8.
        const double r = std::abs(scale);
        const double n = sum, error = 3.5 * r * r / 8 * std::sqrt(2 / n);
        EXPECT_NEAR(sum_x / sum, 0, 4 * r / std::sqrt(8 * n));
        EXPECT_NEAR(sum_x2 / sum, r * r / 8 / squeeze / squeeze, error / squeeze / squeeze + 2e-5);
        EXPECT_NEAR(sum_y2 / sum, r * r / 8, error + 2e-5);
    }
}

// In focus it stays a point.
TEST(Cameras, WhatIsInFocusIsSharp) {
    for (const Projection projection :
         {Projection::Perspective, Projection::Fisheye, Projection::Spherical}) {
        TestScene s;
        // Half of the sphere about the eye that is in focus: an edge through the middle of the picture.
        std::vector<Vec3f> points, normals;
        constexpr int M = 64;
        for (int j = 0; j <= M; j++)
            for (int i = 0; i <= M; i++) {
                const float a = Pi * (0.5f * float(i) / M), b = Pi * (float(j) / M - 0.5f);
                const Vec3f d =
                    projection == Projection::Perspective
                        ? Vec3f(4 * float(i) / M, 8 * float(j) / M - 4, 1)
                        : Vec3f(std::sin(a) * std::cos(b), std::sin(b), std::cos(a) * std::cos(b));
                points.push_back(d * 3.0f), normals.push_back(-d);
            }
        s.add_lattice(M, M, points, normals, {matte(Rgb(0.5f))});
        s.camera(X, Y, Z, 0.5f, 16, 16);
        s.inputs.camera.projection = projection;
        s.inputs.camera.half_angle = 1;
        s.inputs.camera.lens_radius = 0.3f;
        s.inputs.camera.focal_distance = 3;
        s.finish();
        const auto pixels = s.render(64, 8);
        for (int x = 0; x < 16; x++) {
            if (x == 7 || x == 8)
                continue;
            EXPECT_EQ(pixels[size_t(8 * 16 + x)].alpha, x > 8 ? 64 : 0) << int(projection) << " " << x;
        }
    }
}

} // namespace kanuka::transport
