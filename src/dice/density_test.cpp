// How finely things are diced, against what a camera does to angles: closed forms in double precision.
#include <cmath>
#include <gtest/gtest.h>

#include "dice/density.h"
#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;

namespace {

constexpr double Degree = M_PI / 180;

// A camera at the origin that looks along z, of 100 pixels a unit of tangent.
DiceOptions camera(int width, int height) {
    DiceOptions o;
    o.camera.width = width, o.camera.height = height;
    o.camera.pixels_per_tangent = 100;
    return o;
}

// Growth of lengths out of the picture, `sine` outside it.
double growth(double sine) {
    return 1 + 8 * std::min(5 * sine, 1.0);
}

struct Seen {
    double x, y, r; // angles from the axis, in degrees: to the right, then up; distance
    double pixels;  // a unit
    Vec3f at() const {
        return Vec3f(float(r * std::cos(y * Degree) * std::sin(x * Degree)), float(r * std::sin(y * Degree)),
                     float(r * std::cos(y * Degree) * std::cos(x * Degree)));
    }
};

} // namespace

// A picture of tangents up to 1 across and 0.5 up. In it depth counts; beside it depth too, as far as the
// cone around its corners goes, then distance.
TEST(Density, OfAPerspectiveCamera) {
    const double cone = 1 / std::sqrt(1 + 1 + 0.25); // cosine
    const auto beside = [&](double degrees) {
        const double cosine = std::cos(degrees * Degree);
        return 100 / std::max(cosine, cone) / growth(std::sin(degrees * Degree) - cosine);
    };
    const double up = std::sin(40 * Degree) - 0.5 * std::cos(40 * Degree);
    const Seen seen[] = {
        {0, 0, 5, 100},
        {44, 0, 5, 100 / std::cos(44 * Degree)},
        {46, 0, 5, beside(46)},
        {47, 0, 5, beside(47)},
        {-47, 0, 5, beside(47)},
        {50, 0, 5, beside(50)},
        {60, 0, 5, 100 / cone / 9},
        {0, 40, 5, 100 / std::cos(40 * Degree) / growth(up)},
        {0, -40, 5, 100 / std::cos(40 * Degree) / growth(up)},
        {0, 28, 5, 100 / std::cos(28 * Degree) / growth(std::sin(28 * Degree) - 0.5 * std::cos(28 * Degree))},
        {100, 0, 5, 100 / cone / 9},
        {180, 0, 5, 100 / cone / 9}};
    const Density density({}, camera(200, 100), 1);
    for (const Seen& s : seen)
        EXPECT_NEAR(density.pixels_per_unit(s.at()) * s.r / s.pixels, 1, 1e-4) << s.x << " " << s.y;
    // As everywhere else where what is outside counts as what is inside.
    DiceOptions all = camera(200, 100);
    all.camera.offscreen_falloff = 0;
    EXPECT_NEAR(Density({}, all, 1).pixels_per_unit(seen[10].at()) * 5, 100 / cone, 1e-2);
    // Nearer than the near plane nothing is larger.
    DiceOptions near = camera(200, 100);
    near.camera.near_clip = 2;
    EXPECT_NEAR(Density({}, near, 1).pixels_per_unit({0, 0, 0.5f}), 50, 1e-3);
}

// A picture whose middle lies beside the axis, as lens shift and cropping make it.
TEST(Density, OfAPictureBesideTheAxis) {
    DiceOptions o = camera(100, 100);
    o.camera.middle_x = 0.5f, o.camera.middle_y = -0.75f; // tangents from 0 to 1, from -1.25 to -0.25
    const Density density({}, o, 1);
    const auto at = [&](double x, double y) {
        return density.pixels_per_unit({float(x), float(y), 1}) / 100;
    };
    const auto outside = [](double x, double y, double by) {
        return 1 / growth(by / std::sqrt(x * x + y * y + 1));
    };
    EXPECT_NEAR(at(0.5, -0.75), 1, 1e-5);
    EXPECT_NEAR(at(0.99, -1.24), 1, 1e-5);
    EXPECT_NEAR(at(0.01, -0.26), 1, 1e-5);
    EXPECT_NEAR(at(1.05, -0.75), outside(1.05, -0.75, 0.05), 1e-5);
    EXPECT_NEAR(at(-0.05, -0.75), outside(-0.05, -0.75, 0.05), 1e-5);
    EXPECT_NEAR(at(0.5, -0.2), outside(0.5, -0.2, 0.05), 1e-5);
    EXPECT_NEAR(at(0.5, -1.3), outside(0.5, -1.3, 0.05), 1e-5);
    // The cone of the farthest corner: of tangents 1 and 1.25.
    EXPECT_NEAR(density.pixels_per_unit({5, 0, 0}) * 5 * 9 / 100, std::sqrt(1 + 1 + 1.25 * 1.25), 1e-4);
}

// Orthographic: in the picture a unit is a unit; what is outside is measured in halves of it.
TEST(Density, OfAnOrthographicCamera) {
    DiceOptions o = camera(200, 100);
    o.camera.projection = Projection::Orthographic;
    o.camera.middle_x = 0.25f; // units from -0.75 to 1.25, from -0.5 to 0.5
    const Density density({}, o, 1);
    for (const float z : {-3.0f, 0.5f, 70.0f}) {
        EXPECT_NEAR(density.pixels_per_unit({1.2f, 0.45f, z}), 100, 1e-3);
        EXPECT_NEAR(density.pixels_per_unit({1.3f, 0, z}), 100 / growth(0.05), 1e-2);
        EXPECT_NEAR(density.pixels_per_unit({-0.8f, 0, z}), 100 / growth(0.05), 1e-2);
        EXPECT_NEAR(density.pixels_per_unit({0, 0.55f, z}), 100 / growth(0.1), 1e-2);
        EXPECT_NEAR(density.pixels_per_unit({9, 0, z}), 100.0 / 9, 1e-3);
    }
    // Lines along the view keep an eighth.
    for (const double tilt : {0.0, 30.0, 60.0, 88.0, 90.0}) {
        const Vec3f half(float(0.01 * std::cos(tilt * Degree)), 0, float(0.01 * std::sin(tilt * Degree)));
        const Vec3f p(0.5f, 0.2f, 4);
        EXPECT_NEAR(density.cells(p - half, p + half), 2 * std::max(std::cos(tilt * Degree), 1.0 / 8), 1e-3);
    }
}

// Fisheye lenses of 90 degrees each way, and a camera for all directions.
TEST(Density, OfLensesThatSeeAllAround) {
    for (const Projection projection : {Projection::Fisheye, Projection::Equisolid, Projection::Spherical}) {
        DiceOptions o = camera(400, 400);
        o.camera.projection = projection;
        o.camera.half_angle = float(M_PI / 2);
        const Density density({}, o, 1);
        const auto of = [&](double degrees) {
            const Seen s{degrees, 0, 3, 0};
            return density.pixels_per_unit(s.at()) * s.r / 100;
        };
        for (const double degrees : {89.0, 92.0, 95.0, 150.0}) {
            const double inside = std::min(degrees, 90.0) * Degree,
                         stretch =
                             projection == Projection::Fisheye ? std::sqrt(inside / std::sin(inside)) : 1,
                         beyond = projection == Projection::Spherical ? 0 : degrees * Degree - inside;
            EXPECT_NEAR(of(degrees) * growth(beyond) / stretch, 1, 1e-4) << int(projection) << " " << degrees;
        }
        // Distance, to the near plane.
        EXPECT_NEAR(density.pixels_per_unit({0, 0, 8}) * 8, 100, 1e-2);
        o.camera.near_clip = 2;
        EXPECT_NEAR(Density({}, o, 1).pixels_per_unit({0, 0, 0.5f}), 50, 1e-3);
    }
    // Circles of latitude are stretched as 1 / cos, to sixteen times: the root of that either way.
    DiceOptions o = camera(400, 400);
    o.camera.projection = Projection::Spherical;
    const Density density({}, o, 1);
    for (const double degrees : {-80.0, 30.0, 60.0, 85.0, 89.0, 90.0}) {
        const Seen s{70, degrees, 2, 0};
        EXPECT_NEAR(density.pixels_per_unit(s.at()) * s.r / 100,
                    1 / std::sqrt(std::max(std::cos(degrees * Degree), 1.0 / 16)), 1e-4)
            << degrees;
    }
}

// Of a short line only what is across the ray counts, but an eighth at least; outside the picture all of it.
TEST(Density, LinesAreForeshortened) {
    for (const float rate : {1.0f, 4.0f, 0.25f}) {
        const Density density({}, camera(200, 200), rate);
        for (const double tilt : {0.0, 30.0, 60.0, 80.0, 85.0, 90.0}) {
            const Seen middle{20, 10, 5, 0};
            const Vec3f p = middle.at(), ray = normalize(p), beside = normalize(cross(ray, {0, 1, 0}));
            const Vec3f half =
                (beside * float(std::cos(tilt * Degree)) + ray * float(std::sin(tilt * Degree))) * 0.01f;
            const double expected = 0.02 * 100 / double(p.z) * std::max(std::cos(tilt * Degree), 1.0 / 8) /
                                    std::sqrt(double(rate));
            EXPECT_NEAR(density.cells(p - half, p + half) / expected, 1, 1e-3) << tilt;
            // One by one, many at once, and of many pairs.
            const Vec3f line[3] = {p - half, p + half, p - half};
            float out[2];
            density.cells(line, 3, out);
            EXPECT_NEAR(out[1] / expected, 1, 1e-3) << tilt;
            const Vec3f b = p + half, a = p - half;
            const float from[6] = {a.x, b.x, a.y, b.y, a.z, b.z}, to[6] = {b.x, a.x, b.y, a.y, b.z, a.z};
            density.cells(from, to, 2, 2, out);
            EXPECT_NEAR(out[0] / expected, 1, 1e-3) << tilt;
            EXPECT_NEAR(out[1] / expected, 1, 1e-3) << tilt;
        }
    }
    // Behind the camera a line along the ray counts as one across it.
    const Density density({}, camera(200, 200), 1);
    const double unit = 100.0 * std::sqrt(3.0) / 9 / 5;
    EXPECT_NEAR(density.cells(Vec3f(0, 0, -4.9f), Vec3f(0, 0, -5.1f)) / (0.2 * unit), 1, 1e-3);
    EXPECT_NEAR(density.cells(Vec3f(0.1f, 0, -5), Vec3f(-0.1f, 0, -5)) / (0.2 * unit), 1, 1e-3);
    // A little outside, the eighth grows by the sine.
    const double a = 46 * Degree, sine = std::sin(a) - std::cos(a);
    const Vec3f ray(float(std::sin(a)), 0, float(std::cos(a)));
    EXPECT_NEAR(density.cells(ray * 4.99f, ray * 5.01f) /
                    (0.02 * 20 / std::cos(a) / growth(sine) * (1.0 / 8 + sine)),
                1, 1e-3);
}

// A small triangle has as many micropolygons as it covers pixels; edge on an eighth of those face on.
TEST(Density, TrianglesHaveTheirPixels) {
    for (const bool orthographic : {false, true})
        for (const float rate : {1.0f, 4.0f}) {
            DiceOptions o = camera(200, 200);
            if (orthographic)
                o.camera.projection = Projection::Orthographic;
            const Density density({}, o, rate);
            const double unit = orthographic ? 100 : 20,
                         area = 0.5 * 0.02 * 0.03 * unit * unit / double(rate);
            for (const double tilt : {0.0, 40.0, 60.0, 84.0, 90.0}) {
                const Vec3f x(float(0.02 * std::cos(tilt * Degree)), 0,
                              float(0.02 * std::sin(tilt * Degree)));
                const Vec3f y(0, 0.03f, 0), p = Vec3f(0, 0, 5) - (x + y) * (1.0f / 3);
                EXPECT_NEAR(density.area(p, p + x, p + y) /
                                (area * std::max(std::cos(tilt * Degree), 1.0 / 8)),
                            1, 2e-3)
                    << tilt;
            }
        }
    // Instances: everywhere the same, whatever the camera sees.
    DiceTarget target;
    target.pixels_per_unit = 30;
    const Density uniform(target, camera(200, 200), 4);
    const Vec3f a(7, 0, -3), b(7, 0.5f, -3), c(7, 0, -2.5f);
    EXPECT_NEAR(uniform.area(a, b, c), 0.125 * 900 / 4, 1e-3);
    EXPECT_NEAR(uniform.cells(a, b), 0.5 * 30 / 2, 1e-4);
    EXPECT_EQ(uniform.pixels_per_unit(a), 30);
    EXPECT_FALSE(uniform.has_camera());
}

// Pixels half as high as they are wide, and a camera that is moved, turned and scaled.
TEST(Density, OfACameraThatStandsAnyhow) {
    DiceOptions o = camera(200, 200);
    o.camera.page_from_camera =
        Transform::translate(3, -2, 1) * Transform::rotate(70, 1, 2, 3) * Transform::scale(2, 2, 2);
    const Transform& m = o.camera.page_from_camera;
    const Density density({}, o, 1);
    // A unit of the page's space is half of one of the camera's.
    EXPECT_NEAR(density.pixels_per_unit(m.point({1, 0.5f, 4})), 100.0 / 4 / 2, 1e-3);
    EXPECT_NEAR(density.cells(m.point({-0.01f, 0, 4}), m.point({0.01f, 0, 4})), 0.5, 1e-3);
    o.camera.page_from_camera = Transform();
    o.camera.pixel_stretch = 2;
    o.camera.height = 400;
    const Density tall({}, o, 1);
    EXPECT_NEAR(tall.cells(Vec3f(-0.01f, 0, 4), Vec3f(0.01f, 0, 4)), 0.5, 1e-3);
    EXPECT_NEAR(tall.cells(Vec3f(0, -0.01f, 4), Vec3f(0, 0.01f, 4)), 1, 1e-3);
    EXPECT_NEAR(tall.pixels_per_unit({0, 0, 4}), 50, 1e-3); // the finer of both
    EXPECT_NEAR(tall.area({0, 0, 4}, {0.02f, 0, 4}, {0, 0.02f, 4}), 2 * 0.0002 * 625, 1e-3);
}

// A quadratic arc of sagitta s needs root(s / tolerance) chords: 1.41 times that, so that rounding to a power
// of two never leaves it. A twisted quad is a quarter of its twist beside its triangles.
TEST(Rates, FollowTheShape) {
    DiceOptions o = camera(200, 200);
    RateRule rule{Density({}, o, 1), true, 0.25f, 90, 32};
    for (const double sagitta : {0.02, 0.1, 0.4}) { // 20 pixels a unit
        Vec3f p[9];
        for (int i = 0; i < 9; i++) {
            const double x = (i - 4) / 4.0;
            p[i] = Vec3f(float(0.5 * x), float(sagitta * (1 - x * x)), 5);
        }
        const LineMeasure m = rule.line(p, 9);
        EXPECT_NEAR(m.cells, 1.41 * std::sqrt(sagitta * 20 / 0.25), 0.08 * m.cells) << sagitta;
    }
    const auto off = [](float by) {
        return std::array<Vec3f, 4>{Vec3f(-0.5f, -0.5f, 5 + by), Vec3f(0.5f, -0.5f, 5 - by),
                                    Vec3f(0.5f, 0.5f, 5 + by), Vec3f(-0.5f, 0.5f, 5 - by)};
    };
    for (const float by : {0.01f, 0.05f}) {
        const auto [a, b, c, d] = off(by);
        EXPECT_NEAR(rule.twist(a, b, c, d), std::sqrt(by * 100 / double(5 + by) / 0.25), 2e-3) << by;
        // By what normals turn, from corner to opposite corner: z = 4 by x y there has slopes of twice `by`.
        rule.normal_tolerance = 0.5f;
        const double turn = 2 * std::atan(2 * std::sqrt(2.0) * double(by));
        EXPECT_NEAR(rule.twist(a, b, c, d) * Degree / turn, 1, 2e-3) << by;
        // No finer than micropolygons along the diagonals.
        rule.normal_tolerance = 0.1f;
        EXPECT_NEAR(rule.twist(a, b, c, d), std::min(turn / Degree / 0.2, std::sqrt(2.0) * 100 / (5 - by)),
                    0.1)
            << by;
        rule.normal_tolerance = 90;
    }
    // A tolerance of a hundredth of a pixel is the finest.
    const auto [a, b, c, d] = off(0.05f);
    for (const float tolerance : {0.02f, 0.01f, 0.001f, 0.0f}) {
        rule.geometry_tolerance = tolerance;
        EXPECT_NEAR(rule.twist(a, b, c, d), std::sqrt(5 / 5.05 / std::max(double(tolerance), 0.01)), 0.02)
            << tolerance;
    }
}

// An arc whose chords turn by an angle in all has cells that turn by twice the tolerance, 1.41 times as many
// as that takes; never more than its micropolygons are.
TEST(Rates, FollowWhatArcsTurn) {
    DiceOptions o = camera(400, 400); // two units to either side
    o.camera.projection = Projection::Orthographic;
    for (const double degrees : {20.0, 70.0, 150.0})
        for (const double tolerance : {0.5, 2.0, 7.0}) {
            RateRule rule{Density({}, o, 1e-4f), true, 1000, float(tolerance), 32};
            Vec3f p[9];
            for (int i = 0; i < 9; i++) {
                const double a = degrees * Degree * (i - 4) / 8;
                p[i] = Vec3f(float(std::sin(a)), float(std::cos(a)), 5);
            }
            const double by_angle = 1.41 * degrees * 7 / 8 / (2 * tolerance); // of eight chords
            EXPECT_NEAR(rule.line(p, 9).cells / by_angle, 1, 2e-3) << degrees << " " << tolerance;
            rule.density = Density({}, o, 1e4f); // a micropolygon is a unit
            EXPECT_NEAR(rule.line(p, 9).cells, std::min(by_angle, 16 * std::sin(degrees * Degree / 16)), 2e-2)
                << degrees << " " << tolerance;
        }
}

// Factors of an oracle: those of its vertices there, between them on the line, beyond the box as at its
// border; points that are no numbers have one, too.
TEST(DensityField, IsTrilinear) {
    DensityField field;
    field.lower = {-1, -2, 3};
    field.per_unit = {4, 2, 8};
    const auto linear = [](double x, double y, double z) { return 0.5 + 0.25 * x + 0.125 * y - 0.03125 * z; };
    constexpr int V = DensityField::Vertices;
    for (int z = 0; z < V; z++)
        for (int y = 0; y < V; y++)
            for (int x = 0; x < V; x++)
                field.factor[size_t((z * V + y) * V + x)] = float(linear(x, y, z));
    for (double x : {0.0, 0.3, 4.0, 7.9, 8.0})
        for (double y : {0.0, 2.5, 8.0})
            for (double z : {0.0, 6.2, 8.0}) {
                const Vec3f p(float(-1 + x / 4), float(-2 + y / 2), float(3 + z / 8));
                EXPECT_NEAR(field.at(p), linear(x, y, z), 1e-5);
            }
    EXPECT_NEAR(field.at({100, -100, 100}), linear(8, 0, 8), 1e-6);
    const float none = NAN, far = INFINITY;
    for (const Vec3f& p : {Vec3f(none, 0, 0), Vec3f(far, none, -far), Vec3f(-far, far, none)}) {
        const float f = field.at(p);
        EXPECT_TRUE(f >= 0.25f && f <= 3.5f) << f;
    }
}

// Of a density: lengths by the factor in their middle, areas by its square.
TEST(DensityField, MultipliesWhatTheCameraAsks) {
    DensityField field;
    field.lower = {-1, -1, 4};
    field.per_unit = {4, 4, 4};
    field.factor.fill(0.5f);
    DiceTarget target;
    const Density plain(target, camera(200, 200), 1);
    target.field = &field;
    const Density half(target, camera(200, 200), 1);
    const Vec3f a(0.1f, 0.2f, 5), b(0.15f, 0.25f, 5.1f), c(0.1f, 0.3f, 5);
    EXPECT_FLOAT_EQ(half.cells(a, b), 0.5f * plain.cells(a, b));
    EXPECT_FLOAT_EQ(half.area(a, b, c), 0.25f * plain.area(a, b, c));
    EXPECT_FLOAT_EQ(half.pixels_per_unit(a), 0.5f * plain.pixels_per_unit(a));
    const Vec3f line[3] = {a, b, c};
    float with[2], without[2];
    half.cells(line, 3, with);
    plain.cells(line, 3, without);
    for (int i = 0; i < 2; i++)
        EXPECT_FLOAT_EQ(with[i], 0.5f * without[i]);
}
