// Tables and fits: directional albedos against Monte Carlo, dispersion against the Abbe number, uplift in
// lanes against color's own.
#include "bsdf/material.h"
#include "color/color.h"

#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <sstream>

#include "base/test_statistics.h"
#include "bsdf/test_lobes.h"

namespace kanuka::bsdf {
namespace {

using namespace testing;
using kanuka::testing::RunningMean;

enum class Fresnel { One, Schlick, Dielectric };

RunningMean sampled_albedo(float cosine, float alpha, float eta, Fresnel fresnel, Uniform& u) {
    const Ggx<8> ggx{F8(alpha)};
    const V8 wo(F8(std::sqrt(1 - cosine * cosine)), F8(0.0f), F8(cosine));
    RunningMean mean;
    constexpr int N = 128;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j += 8) {
            F8 a, b;
            for (int k = 0; k < 8; k++)
                a.v[k] = (float(i) + u.one()) / N, b.v[k] = (float(j + k) + u.one()) / N;
            const V8 m = ggx.sample(wo, a, b), wi = reflect(wo, m);
            const F8 c = max(dot(wo, m), F8(0.0f));
            F8 cos_t, f(1.0f);
            if (fresnel == Fresnel::Dielectric)
                f = fresnel_dielectric(c, F8(eta), cos_t);
            if (fresnel == Fresnel::Schlick)
                f = schlick_weight(c);
            const F8 lo = ggx.lambda(wo), li = ggx.lambda(wi), one(1.0f);
            for (int k = 0; k < 8; k++)
                mean.add(wi.z[k] > 0 ? double((f * (one + lo) / (one + lo + li))[k]) : 0.0);
        }
    return mean;
}

} // namespace

TEST(AlbedoTable, AgreesWithMonteCarlo) {
    Uniform u(31);
    for (int i = 0; i < 400; i++) {
        const float x = u.one(), r = u.one(), y = u.one();
        const float cosine = std::max(i & 1 ? x : x * x * x, 0.02f), alpha = std::max(r * r, SmoothAlpha);
        const float eta = 1.001f + 2.99f * y * y;
        const auto where = [&] {
            return "cos " + std::to_string(cosine) + " alpha " + std::to_string(alpha) + " eta " +
                   std::to_string(eta);
        };
        const Float<1> c(cosine), a(alpha);
        // Strata leave far less noise than error() says; half a percent of white in all.
        EXPECT_NEAR(ggx_albedo(c, a)[0], sampled_albedo(cosine, alpha, eta, Fresnel::One, u).mean(), 0.005)
            << where();
        EXPECT_NEAR(schlick_albedo(c, a)[0], sampled_albedo(cosine, alpha, eta, Fresnel::Schlick, u).mean(),
                    0.005)
            << where();
        EXPECT_NEAR(dielectric_albedo(c, a, Float<1>(eta))[0],
                    sampled_albedo(cosine, alpha, eta, Fresnel::Dielectric, u).mean(), 0.005)
            << where();
    }
}

TEST(AlbedoTable, SmoothIsFresnel) {
    for (float eta : {1.0001f, 1.2f, 1.5f, 4.0f})
        for (float cosine : {0.001f, 0.1f, 0.5f, 1.0f}) {
            Float<1> cos_t;
            const float F = fresnel_dielectric(Float<1>(cosine), Float<1>(eta), cos_t)[0];
            EXPECT_NEAR(dielectric_albedo(Float<1>(cosine), Float<1>(0.0f), Float<1>(eta))[0], F, 1e-6f);
            EXPECT_NEAR(ggx_albedo(Float<1>(cosine), Float<1>(0.0f))[0], 1, 1e-6f);
        }
}

TEST(AlbedoTable, StaysInRange) {
    Uniform u(32);
    for (int i = 0; i < 20000; i++) {
        const F8 c = u.lanes<8>() * u.lanes<8>(), a = u.lanes<8>() * F8(1.2f),
                 n = F8(0.9f) + u.lanes<8>() * F8(4.0f);
        const F8 g = ggx_albedo(c, a), d = dielectric_albedo(c, a, n), s = schlick_albedo(c, a);
        for (int k = 0; k < 8; k++) {
            ASSERT_TRUE(g[k] > 0 && g[k] <= 1.0001f) << c[k] << " " << a[k];
            ASSERT_TRUE(d[k] >= 0 && d[k] <= 1.0001f) << c[k] << " " << a[k] << " " << n[k];
            ASSERT_TRUE(s[k] >= -1e-4f && s[k] <= 1.0001f) << c[k] << " " << a[k];
        }
    }
}

TEST(Dispersion, ReproducesTheAbbeNumber) {
    for (float n_d : {1.33f, 1.5168f, 1.755f, 2.417f})
        for (float abbe : {20.0f, 27.6f, 64.2f, 95.0f}) {
            Float<1> l[Wavelengths];
            const double lines[] = {587.56, 486.13, 656.28, 800};
            for (int k = 0; k < 4; k++)
                l[k] = Float<1>(float((lines[k] - 360) / 470));
            const auto n = index_of_refraction(Float<1>(n_d), Float<1>(abbe), l);
            EXPECT_NEAR(n[0][0], n_d, 2e-6f);
            EXPECT_NEAR((n_d - 1) / (n[1][0] - n[2][0]), abbe, 2e-3 * abbe);
            EXPECT_LT(n[3][0], n[2][0]); // falls towards the red
        }
    Float<1> l[Wavelengths] = {Float<1>(0.0f), Float<1>(0.3f), Float<1>(0.6f), Float<1>(1.0f)};
    const auto n = index_of_refraction(Float<1>(1.5f), Float<1>(0.0f), l); // 0 = none
    for (int k = 0; k < 4; k++)
        EXPECT_EQ(n[k][0], 1.5f);
}

// Spectra of metals: those of the file, linear between its entries.
TEST(Metals, SpectraAreThoseOfTheFile) {
    std::ifstream file(std::string(KANUKA_SOURCE_DIR) + "/src/color/data/metals.csv");
    std::map<std::string, std::map<double, std::pair<double, double>>> metals;
    for (std::string line; std::getline(file, line);) {
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream s(line);
        std::string name;
        double nm, n, k;
        if (line[0] != '#' && s >> name >> nm >> n >> k)
            metals[name][nm] = {n, k};
    }
    const auto& input = grid::lobe(LobeId::MetalBrdf).inputs[0];
    ASSERT_EQ(input.names.size(), 10u);
    for (size_t m = 1; m < input.names.size(); m++) {
        const auto& rows = metals.at(std::string(input.names[m]));
        const auto in = LobeCase{LobeId::MetalBrdf}.with("metal", float(m)).inputs<8>();
        for (int i = 0; i < Wavelengths; i++) {
            const double nm = 360 + 470 * double(test_wavelengths<8>()[i][0]);
            const auto above = rows.lower_bound(nm), below = std::prev(above);
            const double t = (nm - below->first) / (above->first - below->first);
            const double n = below->second.first + t * (above->second.first - below->second.first);
            const double k = below->second.second + t * (above->second.second - below->second.second);
            EXPECT_NEAR(in.eta[i][0], n, 0.02 * n + 0.005) << input.names[m] << " " << nm;
            EXPECT_NEAR(in.k[i][0], k, 0.02 * k) << input.names[m] << " " << nm;
        }
    }
}

TEST(Uplift, LanesFollowColor) {
    const color::UpliftTable& t = color::uplift_table();
    const UpliftView view{t.coefficients.data(), t.resolution, t.z_factor, t.z_offset};
    std::vector<Rgb> colors = {{0, 0, 0},
                               {1, 1, 1},
                               {1, 0, 0},
                               {0, 1, 0},
                               {0, 0, 1},
                               {1, 1, 0},
                               {1, 0, 1},
                               {0, 1, 1},
                               {2, -1, 0.5f},
                               {1e-6f, 0, 0},
                               {1e-4f, 2e-4f, 3e-4f},
                               {0.9999f, 1, 1},
                               {std::numeric_limits<float>::quiet_NaN(), 0.5f, 0.5f}};
    for (int i = 0; i <= 40; i++)
        colors.push_back(Rgb(float(i) / 40));
    Uniform u(33);
    while (colors.size() < 4096) {
        const float dark = u.one() < 0.3f ? 0.01f : 1.0f;
        colors.push_back(Rgb(u.one(), u.one(), u.one()) * dark);
    }
    double worst = 0;
    for (size_t base = 0; base + 8 <= colors.size(); base += 8) {
        V8 rgb;
        for (size_t k = 0; k < 8; k++)
            for (int c = 0; c < 3; c++)
                rgb[c].v[k] = colors[base + k][c];
        F8 c0, c1, c2, l[Wavelengths];
        uplift(view, rgb, c0, c1, c2);
        for (int w = 0; w < Wavelengths; w++)
            l[w] = F8(0.1f + 0.25f * float(w));
        const auto s = sigmoid_spectrum(c0, c1, c2, l);
        for (size_t k = 0; k < 8; k++) {
            const auto c = color::uplift(colors[base + k]);
            for (int w = 0; w < Wavelengths; w++) {
                const double d = std::abs(s[w][int(k)] - color::uplift_eval(c, 360 + 470 * l[w][0]));
                worst = std::max(worst, d);
                ASSERT_LT(d, 1e-5) << colors[base + k].x << " " << colors[base + k].y << " "
                                   << colors[base + k].z;
            }
        }
    }
    EXPECT_LT(worst, 1e-5);
}

} // namespace kanuka::bsdf
