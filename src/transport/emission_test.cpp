// Surfaces whose emission depends on the angle: cones and powers of the cosine, against their formulas and
// quadrature.
#include "transport/test_floor.h"

namespace kanuka::transport {

using namespace testing;

namespace {

Lobe cone_emission(float radiance, float angle, float softness) {
    return {grid::LobeId::ConeEmission, {Rgb(radiance), Vec3f(angle), Vec3f(softness)}};
}
Lobe profile_emission(float radiance, float exponent) {
    return {grid::LobeId::ProfileEmission, {Rgb(radiance), Vec3f(exponent)}};
}
double falloff_of(const Lobe& lobe, double cosine) {
    if (cosine <= 0)
        return 0;
    if (lobe.id == grid::LobeId::ProfileEmission)
        return std::pow(cosine, double(lobe.inputs[1].x));
    const double angle = double(lobe.inputs[1].x) * 3.141592653589793 / 180, soft = double(lobe.inputs[2].x);
    const double outer = std::cos(angle), inner = std::cos(angle * (1 - soft));
    const double t = std::clamp((cosine - outer) / std::max(inner - outer, 1e-9), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}
const Lobe Shapes[] = {cone_emission(5, 50, 0.5f), cone_emission(5, 80, 1), cone_emission(5, 35, 0),
                       profile_emission(5, 0.5f),  profile_emission(5, 3),  profile_emission(5, 40)};

} // namespace

// What the camera sees of a quad that turns away from it, and the radiant exitance that the record states.
TEST(Emission, RadianceByAngle) {
    for (const Lobe& shape : Shapes) {
        double sent = 0;
        for (int i = 0; i < 4096; i++)
            sent += falloff_of(shape, (i + 0.5) / 4096) * 2 * (i + 0.5) / 4096 / 4096;
        for (float degrees : {0.0f, 20.0f, 33.0f, 37.0f, 48.0f, 60.0f, 78.0f}) {
            TestScene s;
            const float a = degrees * Pi / 180, c = std::cos(a), x = std::sin(a);
            s.add_quad({0, 0, 2}, {0, 1, 0}, {c, 0, x}, {shape}); // its normal has the cosine c to the camera
            s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.001f, 4, 4);
            s.finish();
            const double seen = double(s.render(1024, 8)[5].rgb[1]),
                         expected = 5 * falloff_of(shape, double(c));
            EXPECT_NEAR(seen, expected, 0.02 * expected + 0.002) << degrees << " degrees";
            const store::Emitter& e = s.store.emitters()[0];
            EXPECT_NEAR(double(e.power) / (double(e.area) * 5), sent, 0.003 * sent + 1e-4);
        }
    }
}

TEST(Emission, IrradianceOfShapes) {
    const Vec3f center(0.3f, 0.5f, 0.2f), ex(0.3f, 0, 0), ey(0, 0, 0.2f);
    for (const Lobe& shape : Shapes) {
        FloorScene s;
        s.add_quad(center, ex, ey, {shape});
        s.finish();
        // Means over pixels, for cones have edges.
        const Vec3f pixel = s.point(1, 1) - s.point(0, 0);
        const auto irradiance = [&](const Vec3f& middle) {
            double sum = 0;
            constexpr int N = 24, Parts = 4;
            for (int k = 0; k < Parts * Parts; k++) {
                const Vec3f P = middle + Vec3f(pixel.x * ((float(k % Parts) + 0.5f) / Parts - 0.5f), 0,
                                               pixel.z * ((float(k / Parts) + 0.5f) / Parts - 0.5f));
                for (int i = 0; i < N * N; i++) {
                    const Vec3f to = center + ex * ((float(i % N) + 0.5f) * 2 / N - 1) +
                                     ey * ((float(i / N) + 0.5f) * 2 / N - 1) - P;
                    const double d2 = dot(to, to);
                    sum += 5 * falloff_of(shape, double(to.y) / std::sqrt(d2)) * double(to.y) * double(to.y) /
                           (d2 * d2);
                }
            }
            return sum * 4 * 0.3 * 0.2 / (N * N * Parts * Parts);
        };
        expect_irradiance(s, irradiance, 0.005, 32, 1024);
    }
}

// A glossy floor: next-event estimation by a table and by the hierarchy, and BSDF hits alone.
TEST(Emission, NextEventEstimationAndHitsAgree) {
    for (const Lobe& shape : {cone_emission(6, 60, 0.6f), profile_emission(6, 2)}) {
        double mean[3] = {}, error[3] = {};
        for (int mode = 0; mode < 3; mode++) {
            TestScene s;
            s.add_quad({0, -1, 0}, {0, 0, 8}, {8, 0, 0}, {metal(0.45f)});
            s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, 20, 20);
            s.inputs.max_depth = 1;
            s.add_quad({0.1f, 0.6f, 3.4f}, {0.3f, 0, 0}, {0, -0.1f, 0.2f}, {shape});
            s.add_quad({-0.6f, 0.8f, 3}, {0.2f, 0.05f, 0}, {0, -0.05f, 0.2f}, {shape});
            if (mode == 1)
                for (int k = 0; k < 8; k++)
                    s.add_quad({float(k), 40, -60}, {0.01f, 0, 0}, {0, 0, 0.01f}, {emission(Rgb(1e-4f))});
            s.finish();
            if (mode == 2)
                s.view.lights.choices = 0;
            const auto e = s.estimate(mode == 2 ? 256 : 64, 12);
            mean[mode] = e.channel[1].mean(), error[mode] = e.channel[1].error();
        }
        EXPECT_GT(mean[0], 0.01);
        EXPECT_NEAR(mean[1], mean[0], 0.005 * mean[0] + 4.5 * std::hypot(error[0], error[1]));
        EXPECT_NEAR(mean[2], mean[0], 0.005 * mean[0] + 4.5 * std::hypot(error[0], error[2]));
        EXPECT_LT(error[0], error[2]);
    }
}

} // namespace kanuka::transport
