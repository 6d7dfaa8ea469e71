// Distant lights that fill a cone, in mirrors, by either technique, and many; where shadow rays end.
#include "transport/test_floor.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;
constexpr double DoublePi = 3.14159265358979323846;

scene::Light sun(double diameter, const Transform& t, const Rgb& irradiance) {
    scene::Light l;
    l.kind = Kind::Distant;
    l.amount = irradiance;
    l.angle = float(diameter);
    l.world_from_light = t;
    return l;
}

double radiance_of(double irradiance, double diameter) {
    const double sine = std::sin(diameter * DoublePi / 360);
    return irradiance / (DoublePi * sine * sine);
}

// Share of the picture that a cone covers, with `flip` turning camera rays about z = const.
double share_in_cone(const TestScene& s, const Vec3f& toward, double diameter, bool mirrored) {
    constexpr int N = 16;
    const int size = s.inputs.camera.width;
    const double half = s.inputs.camera.right;
    int inside = 0;
    for (int y = 0; y < size * N; y++)
        for (int x = 0; x < size * N; x++) {
            const double dx = half * (2 * (x + 0.5) / (size * N) - 1),
                         dy = half * (2 * (y + 0.5) / (size * N) - 1);
            const double dz = mirrored ? -1 : 1, n = std::sqrt(dx * dx + dy * dy + 1);
            const double cosine = (dx * double(toward.x) + dy * double(toward.y) + dz * double(toward.z)) / n;
            inside += cosine >= std::cos(diameter * DoublePi / 360);
        }
    return double(inside) / (double(size) * size * N * N);
}

} // namespace

TEST(Suns, AreSeenByTheCameraAndInMirrors) {
    for (double diameter : {0.5, 5.0, 24.0})
        for (bool mirrored : {false, true})
            for (bool visible : {true, false}) {
                TestScene s;
                const Transform t = Transform::rotate(mirrored ? 0.1 : 180.1, 0, 1, 0);
                auto l = sun(diameter, t, Rgb(2));
                l.visible_camera = visible;
                s.inputs.lights.push_back(l);
                if (mirrored)
                    s.add_quad({0, 0, 2}, {0, 3, 0}, {3, 0, 0}, {metal(0)});
                s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, float(std::tan(diameter * DoublePi / 180)), Size,
                         Size);
                s.inputs.max_depth = 2;
                s.finish();
                const double share = share_in_cone(s, -t.vector({0, 0, 1}), diameter, mirrored);
                ASSERT_GT(share, 0.15);
                const bool seen = visible || mirrored; // mirrors show what the camera alone does not
                for (const char* integrator : {"path", "reference"}) {
                    s.view.settings.integrator = IntegratorChoice::parse(integrator);
                    const bool plain = s.view.settings.integrator.name == "reference";
                    const auto e = s.estimate(plain ? 64 : 16, 6);
                    const double expected = seen ? share * radiance_of(2, diameter) : 0;
                    EXPECT_NEAR(e.channel[1].mean(), expected, 0.006 * expected + 4.5 * e.channel[1].error())
                        << diameter << mirrored << visible << integrator;
                }
                s.view.settings.integrator = IntegratorChoice::parse("path");
                double alpha = 0;
                for (const PixelSums& p : s.render(4, 8))
                    alpha += double(p.alpha) / (4.0 * Size * Size);
                EXPECT_NEAR(alpha, mirrored ? 1 : visible ? share : 0, 0.02);
            }
}

// Next-event estimation, BSDF hits, and both: the same light. A rough floor sees it through its lobe.
TEST(Suns, TheSameByEitherTechnique) {
    for (float roughness : {0.2f, 0.5f}) {
        double mean[3], error[3];
        for (int mode = 0; mode < 3; mode++) {
            TestScene s;
            s.add_quad({0, -1, 0}, {0, 0, 8}, {8, 0, 0}, {metal(roughness)});
            s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, Size, Size);
            s.inputs.max_depth = 1;
            const Transform t = Transform::rotate(-40, 1, 0, 0) * Transform::rotate(180, 0, 1, 0);
            s.inputs.lights.push_back(sun(20, t, Rgb(2)));
            s.inputs.lights.push_back(
                sun(3, Transform::rotate(20, 0, 0, 1) * Transform::rotate(90, 1, 0, 0), Rgb(1)));
            s.inputs.lights[0].visible_camera = s.inputs.lights[1].visible_camera = false;
            s.finish();
            if (mode == 1)
                s.view.lights.choices = 0; // no next-event estimation
            if (mode == 2)
                s.view.lights.suns = {}, s.view.lights.keeps_normals = false; // no BSDF hits
            const auto e = s.estimate(96, 40);
            mean[mode] = e.channel[1].mean(), error[mode] = e.channel[1].error();
        }
        // Sampled alone, light is weighed as if BSDF hits counted too: less than all.
        EXPECT_NEAR(mean[1], mean[0], 0.005 * mean[0] + 4.5 * std::hypot(error[0], error[1])) << roughness;
        EXPECT_LT(mean[2], 0.97 * mean[0]) << roughness;
        EXPECT_LT(error[0], error[1]) << roughness;
    }
}

// Irradiance is what the light says for a surface that faces it, at any angle; the hemisphere is pi L.
TEST(Suns, IrradianceOfWideOnes) {
    for (double diameter : {30.0, 180.0})
        for (const char* integrator : {"path", "reference"}) {
            FloorScene s;
            auto l = sun(diameter, Transform::rotate(90, 1, 0, 0), Rgb(2));
            l.visible_camera = false;
            s.inputs.lights.push_back(l);
            s.finish();
            s.view.settings.integrator = IntegratorChoice::parse(integrator);
            const auto e = s.estimate(s.view.settings.integrator.name == "reference" ? 256 : 32, 8);
            const double expected = 2 * double(Reflectance) / DoublePi;
            EXPECT_NEAR(e.channel[1].mean(), expected, 0.003 * expected + 4.5 * e.channel[1].error())
                << diameter << integrator;
        }
}

// More than the choices that are weighed one by one.
TEST(Suns, MoreThanAreWeighedOneByOne) {
    FloorScene s;
    double expected = 0;
    for (int k = 0; k < 30; k++) {
        const double tilt = 2.0 * k;
        auto l = sun(8, Transform::rotate(tilt, 0, 0, 1) * Transform::rotate(90, 1, 0, 0), Rgb(0.1f));
        l.visible_camera = false;
        s.inputs.lights.push_back(l);
        expected += 0.1 * std::cos(tilt * DoublePi / 180) * double(Reflectance) / DoublePi;
    }
    s.finish();
    const auto e = s.estimate(64, 10);
    EXPECT_NEAR(e.channel[1].mean(), expected, 0.003 * expected + 4.5 * e.channel[1].error());
}

// ---- where shadow rays end

// A cover close before a light, seen from far away: nothing gets through. Of lamps that lie in a ceiling, all
// does.
TEST(ShadowRays, EndAtTheirLight) {
    for (const char* name : {"quad", "disk", "sphere", "cylinder", "point", "emitter"})
        for (bool covered : {true, false}) {
            TestScene s;
            const std::string kind = name;
            const float far = 1000;
            s.add_quad({0, 0, 10}, {0, 4, 0}, {4, 0, 0}, {matte(Rgb(0.8f))}); // faces -z
            const Vec3f at(0, 0, 10 - far);
            scene::Light l;
            l.kind = kind == "disk"       ? Kind::Disk
                     : kind == "sphere"   ? Kind::Sphere
                     : kind == "cylinder" ? Kind::Cylinder
                     : kind == "point"    ? Kind::Point
                                          : Kind::Quad;
            l.amount = Rgb(1e4f);
            l.width = l.height = 2;
            l.radius = kind == "point" ? 0 : 0.5f;
            if (kind == "cylinder")
                l.height = 1;
            l.world_from_light = Transform::translate(at.x, at.y, at.z);
            const float bulge = kind == "sphere" || kind == "cylinder" ? 0.5f : 0;
            if (kind == "emitter")
                s.add_quad(at, {1, 0, 0}, {0, 1, 0}, {emission(Rgb(1e4f))});
            else
                s.inputs.lights.push_back(l);
            if (covered)
                s.add_quad({0, 0, at.z + bulge + 0.02f}, {0, 8, 0}, {8, 0, 0}, {matte(Rgb(0))});
            else if (bulge == 0) // the ceiling that it lies in
                s.add_quad({0, 0, at.z}, {0, 8, 0}, {8, 0, 0}, {matte(Rgb(0))});
            s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.2f, Size, Size);
            s.inputs.max_depth = 1;
            s.finish();
            const double mean = s.estimate(4, 1).channel[1].mean();
            if (covered)
                EXPECT_EQ(mean, 0) << name;
            else {
                // pi L A / d^2 of what faces the floor; a cylinder from its side does, its end does not.
                const double area = kind == "disk" || kind == "sphere" ? DoublePi * 0.25
                                    : kind == "point"                  ? 1
                                                                       : 4;
                if (kind != "cylinder" && kind != "emitter") {
                    EXPECT_NEAR(mean, 0.8 / DoublePi * 1e4 * area / (double(far) * far), 0.01 * mean) << name;
                }
            }
        }
}

// An emitter never covers itself, wherever it and what it lights are: tessellated, tilted, in an instance
// that was modelled far from its origin.
TEST(ShadowRays, EmittersDoNotCoverThemselves) {
    for (float offset : {0.0f, 30.0f, 3000.0f})
        for (bool instanced : {false, true}) {
            TestScene s;
            s.add_quad({offset, -1 + offset, 0}, {0, 0, 4}, {4, 0, 0}, {matte(Rgb(0.5f))});
            const int first = int(s.store.shapes().size());
            const Vec3f model = instanced ? Vec3f(0, -offset, offset) : Vec3f(0, 0, 0);
            const Vec3f place = Vec3f(offset, offset + 0.5f, 0) - model;
            const Vec3f base = model + (instanced ? Vec3f(0, 0, 0) : place);
            std::vector<Vec3f> points, normals;
            const Vec3f n = normalize(Vec3f(0.3f, -1, 0.2f)), ex = normalize(cross(Vec3f(0, 0, 1), n)),
                        ey = cross(n, ex);
            constexpr int M = 12;
            for (int j = 0; j <= M; j++)
                for (int i = 0; i <= M; i++) {
                    points.push_back(base + ex * (float(i) / M - 0.5f) + ey * (float(j) / M - 0.5f));
                    normals.push_back(n);
                }
            s.add_lattice(M, M, points, normals, {emission(Rgb(3))});
            s.camera({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, 0.5f, Size, Size);
            for (int c = 0; c < 3; c++)
                s.inputs.camera.render_from_camera[4 * c + 3] = Vec3f(offset, offset, 0)[c];
            s.inputs.max_depth = 1;
            s.finish(instanced ? first : -1, Transform::translate(place.x, place.y, place.z));
            const auto sampled = s.estimate(64, 4);
            // What is far from the origin is as thick as its rounding.
            double expected = 0;
            const Vec3f middle(offset, offset + 0.5f, 0);
            constexpr int N = 40;
            for (int y = 0; y < Size; y++)
                for (int x = 0; x < Size; x++) {
                    const Vec3f d = s.pixel_direction(x, y);
                    double sum = 0;
                    for (int j = 0; j < N; j++)
                        for (int i = 0; i < N; i++) {
                            const Vec3f to = Vec3f(0, 0.5f, 0) + ex * ((float(i) + 0.5f) / N - 0.5f) +
                                             ey * ((float(j) + 0.5f) / N - 0.5f) - Vec3f(d.x, -1, d.y);
                            const double d2 = dot(to, to), shines = -dot(to, n);
                            if (shines > 0)
                                sum += shines * double(to.y) / (d2 * d2);
                        }
                    expected += sum * 3 / (N * N) * 0.5 / DoublePi / (Size * Size);
                }
            EXPECT_NEAR(sampled.channel[1].mean(), expected,
                        0.006 * expected + 4.5 * sampled.channel[1].error())
                << offset << instanced;
        }
}

} // namespace kanuka::transport
