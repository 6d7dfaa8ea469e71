// Films and metals against the same physics in double precision and complex numbers, written another way: the
// sum of all reflections, one after the other.
#include "bsdf/fresnel.h"

#include <complex>
#include <gtest/gtest.h>

#include "bsdf/lobe_tables.h"
#include "bsdf/lobes.h"

namespace kanuka::bsdf {
namespace {

using C = std::complex<double>;

struct Amplitudes {
    C reflected, transmitted;
};

// Fresnel's amplitudes between indices, with sines by Snell's law; `p` polarised or `s`.
Amplitudes interface(C n0, C n1, double sine, bool p) {
    const C c0 = std::sqrt(1.0 - C(sine * sine) / (n0 * n0)),
            c1 = std::sqrt(1.0 - C(sine * sine) / (n1 * n1));
    if (p)
        return {(n1 * c0 - n0 * c1) / (n1 * c0 + n0 * c1), 2.0 * n0 * c0 / (n1 * c0 + n0 * c1)};
    return {(n0 * c0 - n1 * c1) / (n0 * c0 + n1 * c1), 2.0 * n0 * c0 / (n0 * c0 + n1 * c1)};
}

// Light that is reflected at once, and after 1, 2, … trips through the film.
double film(double cosine, double n1, double d_over_lambda, C n2) {
    const double sine = std::sqrt(1 - cosine * cosine);
    double R = 0;
    for (bool p : {false, true}) {
        const Amplitudes in = interface(1, n1, sine, p), out = interface(n1, 1, sine, p),
                         base = interface(n1, n2, sine, p);
        const C c1 = std::sqrt(1.0 - C(sine * sine) / (n1 * n1));
        const C trip = std::exp(C(0, 4 * 3.14159265358979) * n1 * c1 * d_over_lambda);
        C sum = in.reflected, wave = in.transmitted * base.reflected * trip * out.transmitted;
        for (int k = 0; k < 400; k++) {
            sum += wave;
            wave *= out.reflected * base.reflected * trip;
        }
        R += 0.5 * std::norm(sum);
    }
    return R;
}

} // namespace

TEST(Fresnel, FilmsAreAirysSum) {
    for (double n1 : {1.0, 1.33, 1.8, 2.6})
        for (double d : {0.0, 0.1, 0.25, 0.77, 3.2})
            for (C n2 : {C(1.5, 0), C(1.0, 0), C(0.2, 3.4), C(2.9, 3.1)})
                for (double cosine : {1.0, 0.7, 0.25, 0.05}) {
                    const double expected = film(cosine, n1, d, n2);
                    const float got =
                        film_reflectance(Float<1>(float(cosine)), Float<1>(float(n1)), Float<1>(float(d)),
                                         Float<1>(float(n2.real())), Float<1>(float(n2.imag())))[0];
                    EXPECT_NEAR(double(got), expected, 3e-5)
                        << n1 << " " << d << " " << n2 << " cos " << cosine;
                }
}

TEST(Fresnel, NoFilmIsABareSurface) {
    for (float cosine : {1.0f, 0.6f, 0.1f}) {
        Float<1> cos_t;
        EXPECT_NEAR(film_reflectance(Float<1>(cosine), Float<1>(1.0f), Float<1>(0.0f), Float<1>(1.5f),
                                     Float<1>(0.0f))[0],
                    fresnel_dielectric(Float<1>(cosine), Float<1>(1.5f), cos_t)[0], 2e-6f);
        // Half a wave of film changes nothing.
        EXPECT_NEAR(film_reflectance(Float<1>(1.0f), Float<1>(1.38f), Float<1>(0.5f / 1.38f), Float<1>(1.5f),
                                     Float<1>(0.0f))[0],
                    0.04f, 1e-5f);
    }
    // A quarter wave of the root of the index extinguishes.
    const float root = std::sqrt(1.5f);
    EXPECT_NEAR(film_reflectance(Float<1>(1.0f), Float<1>(root), Float<1>(0.25f / root), Float<1>(1.5f),
                                 Float<1>(0.0f))[0],
                0, 1e-6f);
}

// Reflectances of metals head-on, measured: CRC Handbook of Chemistry and Physics, from the same n and k.
TEST(Fresnel, MetalsHaveTheirColours) {
    const auto reflectance = [](const char* name, double nm) {
        const auto& names =
            grid::lobe(LobeId::MetalBrdf).inputs[size_t(input_of(LobeId::MetalBrdf, "metal"))].names;
        LobeInputs<1> in;
        for (Float<1>& number : in.number)
            number = Float<1>(0.0f);
        for (size_t k = 0; k < names.size(); k++)
            if (names[k] == name)
                in.number[number_of(LobeId::MetalBrdf, "metal")] = Float<1>(float(k));
        in.color[0] = in.color[1] = Spectrum<1>(Float<1>(1.0f));
        const Float<1> l(float((nm - 360) / 470)), all[Wavelengths] = { l, l, l, l };
        const Vec3<Float<1>> up(Float<1>(0.0f), Float<1>(0.0f), Float<1>(1.0f));
        prepare_lobe(LobeId::MetalBrdf, in, up, Mask<1>(true), all);
        return double(MetalFresnel<1>::value(in, Float<1>(1.0f))[0][0]);
    };
    EXPECT_NEAR(reflectance("Au", 450), 0.38, 0.03); // yellow: blue is absorbed
    EXPECT_NEAR(reflectance("Au", 650), 0.96, 0.02);
    EXPECT_NEAR(reflectance("Cu", 500), 0.57, 0.05);
    EXPECT_NEAR(reflectance("Cu", 650), 0.94, 0.03);
    EXPECT_NEAR(reflectance("Ag", 550), 0.98, 0.02);
    EXPECT_NEAR(reflectance("Al", 550), 0.92, 0.02);
    EXPECT_NEAR(reflectance("Cr", 550), 0.56, 0.12);
}

} // namespace kanuka::bsdf
