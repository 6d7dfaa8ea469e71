// One interior that only absorbs, and no other: what is in it sees lamps of all kinds through it.
#include "transport/test_floor.h"
#define Size MediaSize
#include "transport/test_media.h"
#undef Size

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;
constexpr double DoublePi = 3.14159265358979323846;

// A black box around camera, floor and lamps, of surfaces that have lobes: light cannot pass as it comes.
void fill_with(TestScene& s, const store::Interior& water) {
    add_box(s, {0, 0, 0}, 12, {matte(Rgb(0.0f))}, s.store.add_interior(water));
}

scene::Light lamp(Kind kind) {
    scene::Light l;
    l.kind = kind;
    l.amount = Rgb(4);
    l.world_from_light = Transform::translate(0.15, 0.3, 0.1) * Transform::rotate(25, 0, 0, 1) *
                         Transform::rotate(90, 1, 0, 0);
    l.width = 0.5f, l.height = 0.7f, l.radius = kind == Kind::Point ? 0 : 0.3f;
    l.visible_camera = false;
    return l;
}

// What of a lamp arrives at a point of the floor, and on at the camera in the origin: sums over the lamp's
// surface.
double arriving(Kind kind, const Transform& t, const Vec3f& p, double sigma) {
    const double back = std::exp(-sigma * double(length(p)));
    const auto part = [&](const Vec3f& q, const Vec3f& n, double area) {
        const Vec3f to = q - p;
        const double d2 = dot(to, to), shines = -dot(to, n);
        return shines > 0 && to.y > 0
                   ? 4 * area * shines * double(to.y) / (d2 * d2) * std::exp(-sigma * std::sqrt(d2))
                   : 0.0;
    };
    const Vec3f at = t.point({0, 0, 0});
    if (kind == Kind::Point) {
        const Vec3f to = at - p;
        const double d = double(length(to));
        return back * 4 * double(to.y) / (d * d * d) * std::exp(-sigma * d);
    }
    constexpr int N = 40;
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const float a = (float(i) + 0.5f) / N, b = (float(j) + 0.5f) / N, turn = 2 * Pi * b;
            Vec3f q(0.5f * (a - 0.5f), 0.7f * (b - 0.5f), 0), n(0, 0, 1);
            double area = 0.35 / (N * N);
            if (kind == Kind::Disk) {
                q = Vec3f(std::cos(turn), std::sin(turn), 0) * (0.3f * std::sqrt(a));
                area = DoublePi * 0.09 / (N * N);
            } else if (kind == Kind::Cylinder) {
                n = {std::cos(turn), std::sin(turn), 0};
                q = n * 0.3f + Vec3f(0, 0, 0.7f * (a - 0.5f));
                area = 2 * DoublePi * 0.3 * 0.7 / (N * N);
            } else if (kind == Kind::Sphere) {
                const float z = 2 * a - 1, r = std::sqrt(1 - z * z);
                n = {r * std::cos(turn), r * std::sin(turn), z};
                q = n * 0.3f;
                area = 4 * DoublePi * 0.09 / (N * N);
            }
            sum += part(t.point(q), t.vector(n), area);
        }
    return back * sum;
}

} // namespace

TEST(Absorption, LampsOfAllKindsInTintedWater) {
    const Rgb sigma(0.9f);
    const double number = amount_at(amount(sigma), 200); // grey: the same at all wavelengths
    for (Kind kind : {Kind::Point, Kind::Quad, Kind::Disk, Kind::Sphere, Kind::Cylinder})
        for (const char* integrator : {"path", "reference"}) {
            FloorScene s;
            fill_with(s, medium(sigma, Rgb(0)));
            const auto l = lamp(kind);
            s.inputs.lights.push_back(l);
            s.finish();
            s.view.settings.integrator = IntegratorChoice::parse(integrator);
            double expected = 0;
            for (int y = 0; y < Size; y++)
                for (int x = 0; x < Size; x++)
                    expected += arriving(kind, l.world_from_light, s.point(x, y), number) *
                                double(Reflectance) / DoublePi / (Size * Size);
            const auto e = s.estimate(s.view.settings.integrator.name == "reference" ? 256 : 32, 8);
            for (const auto& c : e.channel)
                EXPECT_NEAR(c.mean(), expected, 0.006 * expected + 4.5 * c.error())
                    << int(kind) << integrator;
        }
}

// In colours, wavelength by wavelength: an emitting panel above a floor, a disk before the camera.
TEST(Absorption, ColouredWaterByBeerAndLambert) {
    const Rgb sigma(0.2f, 0.6f, 1.4f);
    const auto a = amount(sigma);
    for (const char* integrator : {"path", "reference"}) {
        TestScene s;
        fill_with(s, medium(sigma, Rgb(0)));
        scene::Light disk = lamp(Kind::Disk);
        disk.world_from_light = Transform::translate(0, 0, 2) * Transform::rotate(180, 0, 1, 0);
        disk.radius = 1, disk.visible_camera = true;
        s.inputs.lights.push_back(disk);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.01f, Size, Size);
        s.finish();
        s.view.settings.integrator = IntegratorChoice::parse(integrator);
        expect_mean(s.estimate(64, 8), seen([&](int i) { return 4 * std::exp(-2 * amount_at(a, i)); }), 0.004,
                    integrator);
    }
    // Two patches that face each other, small beside their distance: L A / d^2 of irradiance.
    TestScene s;
    const Rgb faint(0.1f, 0.2f, 0.3f);
    const auto b = amount(faint);
    fill_with(s, medium(faint, Rgb(0)));
    s.add_quad({0, 0, 2}, {0, 4, 0}, {4, 0, 0}, {matte(Rgb(0.8f))});
    s.add_quad({0, 0, -1}, {0.05f, 0, 0}, {0, 0.05f, 0}, {emission(Rgb(1000))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.01f, Size, Size);
    s.inputs.max_depth = 1;
    s.finish();
    expect_mean(s.estimate(64, 8), seen([&](int i) {
                    return 1000 * 0.01 / 9 * 0.8 / DoublePi * std::exp(-5 * amount_at(b, i));
                }),
                0.01, "panel");
}

// What has no end leaves nothing of a sky, however it is found.
TEST(Absorption, WithoutEndAbsorbsAll) {
    for (bool picture : {false, true}) {
        TestScene s;
        // A box around the camera with a side missing, and a floor that the sky would light.
        const int interior = s.store.add_interior(medium(Rgb(0.3f), Rgb(0)));
        const Vec3f x(5, 0, 0), y(0, 5, 0), z(0, 0, 5);
        s.add_quad(-z, y, x, {matte(Rgb(0))}, interior);
        s.add_quad(-x, z, y, {matte(Rgb(0))}, interior), s.add_quad(x, y, z, {matte(Rgb(0))}, interior);
        s.add_quad(-y, x, z, {matte(Rgb(0))}, interior), s.add_quad(y, z, x, {matte(Rgb(0))}, interior);
        s.add_quad({0, -1, 2}, {0, 0, 1}, {1, 0, 0}, {matte(Rgb(0.5f))});
        auto sky = constant_sky(Rgb(1));
        sky.visible_camera = true;
        if (picture) {
            sky.texture = "a picture";
            s.inputs.map.width = 8, s.inputs.map.height = 4;
            for (int i = 0; i < 32; i++)
                s.inputs.map.rgb.insert(s.inputs.map.rgb.end(), 3, i % 3 ? 1.0f : 5.0f);
        }
        s.inputs.lights.push_back(sky);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.8f, Size, Size);
        s.finish();
        ASSERT_EQ(s.view.media.around_camera[0], 0);
        EXPECT_EQ(s.estimate(16, 1).channel[1].mean(), 0) << picture;
    }
}

} // namespace kanuka::transport
