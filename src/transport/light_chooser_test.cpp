// How often each of a few lights is sampled, and by what shape an emitter's radiance falls off, against their
// formulas.
#include <cmath>

#include "transport/light_choice.h"
#include "transport/lights.h"
#include "transport/test_lights.h"

namespace kanuka::transport {

using namespace testing;

// A spot and a point light of one place and intensity: inside of the full cone they light alike, so each is
// as likely, from any distance; beyond the cone's edge the spot keeps its part of the 15 % that all share,
// and between them it goes with the smoothstep of the cosine.
TEST(LightChooser, SpotsAreAsLikelyAsTheyShine) {
    TestScene s;
    auto spot = light(Kind::Spot, Rgb(3), Downwards);
    spot.cone_angle = 40, spot.cone_delta_angle = 20, spot.beam_distribution = 0;
    s.inputs.lights = {light(Kind::Point, Rgb(3), Transform()), spot};
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
    s.finish();
    ASSERT_EQ(s.view.lights.choices, 2);
    const double degree = 3.141592653589793 / 180, outer = std::cos(40 * degree),
                 inner = std::cos(20 * degree);
    for (const double distance : {0.02, 0.3, 1.0, 5.0, 400.0})
        for (const double angle : {0.0, 19.0, 25.0, 30.0, 36.0, 39.5, 41.0, 90.0}) {
            const float x = float(distance * std::sin(angle * degree)),
                        y = float(-distance * std::cos(angle * degree));
            Receiver<8> r;
            r.P = Vec3<Float<8>>(Float<8>(x), Float<8>(y), Float<8>(0.0f));
            r.N = Vec3<Float<8>>(Float<8>(0.0f));
            r.oriented = Mask<8>(false);
            const LightChooser<8> chooser(s.view, r);
            const double t = std::clamp((std::cos(angle * degree) - outer) / (inner - outer), 0.0, 1.0);
            const double falloff = t * t * (3 - 2 * t), is = 0.85 * falloff / (1 + falloff) + 0.15 / 2;
            double chance[2];
            for (int k = 0; k < 2; k++)
                chance[k] = double(chooser.pdf(s.view.lights.first_light_choice + k)[0]);
            EXPECT_NEAR(chance[0] + chance[1], 1, 1e-6);
            EXPECT_NEAR(std::min(chance[0], chance[1]), is, 1e-3) << distance << ' ' << angle;
        }
}

// A smoothstep from a cone's cosine on, or a power of the cosine, of the numbers that the flags hold; and a
// cone that is closed altogether lets nothing through, and is a number.
TEST(EmissionFalloff, IsWhatTheFlagsSay) {
    using S = store::EmissionShape;
    for (const int cone : {0, 1000, 32768, 60000, 65534, 65535})
        for (const int more : {0, 1, 3000, 16383})
            for (const bool power : {false, true})
                for (const double cosine : {0.001, 0.2, 0.49, 0.51, 0.8, 0.95, 0.99999, 1.0}) {
                    const int flags =
                        cone << S::ConeShift | more << S::MoreShift | (power ? int(S::Power) : 0);
                    const double outer = cone / 65535.0, x = more / 16383.0;
                    const double t = std::clamp((cosine - outer) / std::max((1 - outer) * x, 1e-6), 0.0, 1.0);
                    const double exponent = std::exp2(x * 10) - 1;
                    const double inside = float(cosine) * 65535.0f >= float(cone) ? 1 : 0;
                    const double is = inside * (more == 0 ? 1
                                                : power   ? std::pow(cosine, exponent)
                                                          : t * t * (3 - 2 * t));
                    const Float<8> f = emission_falloff<8>(Int<8>(flags), Float<8>(float(cosine)));
                    EXPECT_NEAR(double(f[0]), is, 2e-3)
                        << cone << ' ' << more << ' ' << power << ' ' << cosine;
                }
}

// A picture's colour does not matter to where light is sampled, its sum does: red, green and blue spots are
// alike.
TEST(QuadDensity, ColoursCountAlike) {
    double pdf[3][2];
    for (size_t c = 0; c < 3; c++) {
        TestScene s;
        scene::Light l = light(Kind::Quad, Rgb(3), Downwards);
        l.width = l.height = 1;
        auto table = std::make_shared<scene::LightTable>();
        table->width = table->height = 4;
        table->rgb.assign(3 * 16, 0.01f);
        table->rgb[3 * 5 + c] = 30; // column 1 of row 1
        l.table = table;
        s.inputs.lights.push_back(l);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish();
        const LightLanes<8> lanes(s.view, Int<8>(0));
        const QuadPicture<8> picture(s.view, lanes, Mask<8>(true));
        const auto at = [&](float x, float y) {
            return double(picture.pdf(Vec3<Float<8>>(Float<8>(x), Float<8>(y), Float<8>(0.0f)))[0]);
        };
        pdf[c][0] = at(-0.25f, 0.25f), pdf[c][1] = at(0.7f, -0.7f);
        EXPECT_GT(pdf[c][0], 20 * pdf[c][1] + 0.1) << c;
    }
    for (size_t c = 0; c < 2; c++)
        EXPECT_NEAR(pdf[c][0], pdf[2][0], 1e-3 * pdf[2][0]) << c;
}

} // namespace kanuka::transport
