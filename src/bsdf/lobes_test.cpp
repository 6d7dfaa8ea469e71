// Each lobe of the table, over its inputs: what is sampled has the density that is stated, densities
// integrate to the share of samples that are valid, reflection is reciprocal, no more leaves than comes in.
#include "bsdf/test_lobes.h"

#include <gtest/gtest.h>
#include <numbers>
#include <numeric>

#include "base/test_statistics.h"

namespace kanuka::bsdf {
namespace {

using namespace testing;
using kanuka::testing::chi_square;
using kanuka::testing::normal_p;
using kanuka::testing::RunningMean;
using kanuka::testing::sidak;

bool gives(const LobeCase& c, const char* name) {
    for (const auto& [n, v] : c.given)
        if (n == name)
            return true;
    return false;
}
// Part of their value is noise, and exact in the mean alone: see microsurface_test.cpp.
bool walks(const LobeCase& c) {
    for (const auto& [n, v] : c.given)
        if (n == "walks")
            return v.x > 0.5f;
    return false;
}
bool stretched(const LobeCase& c) {
    return gives(c, "anisotropy") || gives(c, "tail");
}

double value_of(const LobeCase& c, const char* name) {
    for (const auto& [n, v] : c.given)
        if (n == name)
            return double(v.x);
    return -1;
}
bool is_interface(const LobeCase& c) {
    return c.id == LobeId::MicrosurfaceDielectricBsdfRgb_v1;
}

// What energy may be off by: the tables' share; more where an interface's facets are stretched or filmed, for
// which it has no table of its own.
double gain_slack(const LobeCase& c) {
    if (is_interface(c) && stretched(c))
        return 0.03;
    if (is_interface(c) && gives(c, "filmThickness"))
        return 0.02;
    return is_interface(c) ? 0.008 : 0.006;
}
double loss_slack(const LobeCase& c) {
    if (is_interface(c) && value_of(c, "tail") > 0.5)
        return 0.22; // by intent: it could only gain
    if (is_interface(c) && stretched(c))
        return 0.05;
    if (is_interface(c) && gives(c, "filmThickness"))
        return 0.03;
    return is_interface(c) ? 0.025 : 0.008; // 0.0234 by walks that end after 32 facets
}
// What a lobe may state of its albedo too much or too little: it shares samples by it, and dims what lies
// below.
double stated_slack(const LobeCase& c) {
    if (is_interface(c) && value_of(c, "tail") > 0.5)
        return 0.22;
    if (c.id == LobeId::MetalBrdf && gives(c, "filmThickness"))
        return 0.135; // a film of index 4
    if (c.id == LobeId::ThinWalledDielectricBsdf)
        return 0.1; // with two colours: facets spread what is reflected at grazing angles
    if (is_interface(c) && !c.outside)
        return 0.09; // of two colours, too: by the smooth interface
    if (c.id == LobeId::GratingBrdf || gives(c, "filmThickness"))
        return 0.045;
    return stretched(c) ? 0.062 : 0.02;
}

// Counts of sampled directions over a grid of the sphere, 10 rings a hemisphere; the last cell holds the
// invalid ones.
std::vector<double> histogram(const LobeCase& c, int count) {
    Uniform u(uint32_t(std::hash<std::string>()(c.str())));
    const auto in = c.inputs<8>();
    const V8 wo = c.wo<8>();
    std::vector<double> cells(Rings * Sectors + 1, 0.0);
    for (int i = 0; i < count; i += 8) {
        const auto s = sample_lobe(c.id, in, wo, u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
        const F8 turn = turn_of(s.wi.y, s.wi.x);
        for (int k = 0; k < 8; k++) {
            if (!s.valid[k]) {
                cells.back()++;
                continue;
            }
            const int ring = std::clamp(int((s.wi.z[k] + 1) * 0.5f * Rings), 0, Rings - 1);
            const int sector = std::min(int(turn[k] * Sectors), Sectors - 1);
            cells[size_t(ring * Sectors + sector)]++;
        }
    }
    return cells;
}

std::vector<double> expectation(const LobeCase& c) {
    const auto in = c.inputs<8>();
    const V8 wo = c.wo<8>();
    const auto pdf = [&](const V8& wi) { return eval_lobe(c.id, in, wo, wi).pdf[0]; };
    std::vector<double> cells = integrate_cells(pdf);
    const double total = std::accumulate(cells.begin(), cells.end(), 0.0);
    cells.push_back(std::max(1 - total, 0.0));
    return cells;
}

V8 random_direction(Uniform& u, float low, float high) {
    return direction(F8(low) + u.lanes<8>() * F8(high - low), u.lanes<8>());
}

} // namespace

// The histogram's last cell is the invalid share, so this also says that densities integrate to the valid
// one.
TEST(Lobes, SamplesFollowTheirDensity) {
    const auto cases = rough_cases({0.999f, 0.6f, 0.1f}, false);
    constexpr int Count = 40000;
    for (const LobeCase& c : cases) {
        const auto seen = histogram(c, Count);
        auto expected = expectation(c);
        double total = 0;
        for (size_t i = 0; i + 1 < expected.size(); i++)
            total += expected[i];
        EXPECT_LE(total, 1 + 2e-4) << c.str();
        EXPECT_NEAR(1 - seen.back() / Count, total,
                    5 * std::sqrt(total * std::max(1 - total, 1e-4) / Count) + 3e-4)
            << c.str();
        for (double& e : expected)
            e *= Count;
        const auto test = chi_square(seen, expected);
        EXPECT_GT(test.p, sidak(1e-3, int(cases.size()))) << c.str();
        EXPECT_LE(test.impossible, 1e-4 * Count) << c.str() << ": sampled where the density is zero";
    }
}

// Every wavelength's density is what sampling with that wavelength as the hero would have.
TEST(Lobes, DensitiesOfOtherWavelengths) {
    for (const LobeCase& c : rough_cases({0.7f})) {
        Uniform u(5);
        for (int i = 0; i < 20; i++) {
            const V8 wi = random_direction(u, -1, 1);
            const auto in = c.inputs<8>();
            const auto all = eval_lobe(c.id, in, c.wo<8>(), wi);
            for (int k = 1; k < Wavelengths; k++) {
                const auto alone = eval_lobe(c.id, c.inputs<8>(k), c.wo<8>(), wi);
                for (int lane = 0; lane < 8; lane++) {
                    ASSERT_NEAR(all.pdf[k][lane], alone.pdf[0][lane], 1e-5f * (1 + all.pdf[k][lane]))
                        << c.str();
                    ASSERT_NEAR(all.f[k][lane], alone.f[0][lane], 1e-5f * (1 + all.f[k][lane])) << c.str();
                }
            }
        }
    }
}

// f(wo, wi) = f(wi, wo) for reflection. Paths carry radiance over the square of the index, for which Walter
// et al.'s transmission (2007, eq. 21) obeys f(wo, wi) = eta^2 f(wi, wo), eta = index on the side of wi over
// that of wo.
TEST(Lobes, Reciprocity) {
    for (const LobeCase& c : rough_cases({0.6f})) {
        if (!c.decl().reciprocal || walks(c))
            continue;
        Uniform u(11);
        int compared = 0, apart = 0;
        for (int i = 0; i < 200; i++) {
            V8 wo = random_direction(u, 0.05f, 1), wi = random_direction(u, c.transmits() ? -1 : 0.05f, 1);
            // What is derived holds for one view: all lanes look the same way.
            const V8 from(F8(wo.x[0]), F8(wo.y[0]), F8(wo.z[0])), to(F8(wi.x[0]), F8(wi.y[0]), F8(wi.z[0]));
            if (std::abs(to.z[0]) < 0.05f)
                continue;
            const bool through = to.z[0] < 0;
            const auto evaluate = [&](const V8& a, const V8& b, bool outside) {
                return eval_lobe(c.id, c.inputs<8>(a, outside), a, b);
            };
            const auto flip = [](const V8& w) { return V8(w.x, w.y, -w.z); };
            const auto there = evaluate(from, to, c.outside);
            const auto back =
                through ? evaluate(flip(to), flip(from), !c.outside) : evaluate(to, from, c.outside);
            auto in = c.inputs<8>();
            for (int l = 0; l < Wavelengths; l += 3) {
                const bool bends = c.id == LobeId::MicrosurfaceDielectricBsdfRgb_v1;
                const double eta = through && bends ? double(in.eta[l][0]) : 1;
                const double a = double(there.f[l][0]) / std::abs(double(to.z[0]));
                const double b = double(back.f[l][0]) / double(from.z[0]) * eta * eta;
                if (std::max(a, b) < 1e-3) // near the critical angle, where digits are few
                    continue;
                apart += std::abs(a / b - 1) > 3e-3;
                compared++;
            }
        }
        EXPECT_EQ(apart, 0) << c.str() << " of " << compared;
    }
}

TEST(Lobes, LambertianIsConstant) {
    Uniform u(1);
    for (bool transmits : {false, true}) {
        const LobeCase c{transmits ? LobeId::LambertBtdf : LobeId::LambertBrdf, {}, 0.6f};
        for (int i = 0; i < 20; i++) {
            const V8 wi = random_direction(u, -1, 1);
            const auto v = eval_lobe(c.id, c.inputs<8>(), c.wo<8>(), wi);
            for (int k = 0; k < 8; k++)
                EXPECT_FLOAT_EQ(v.f[0][k], std::max(transmits ? -wi.z[k] : wi.z[k], 0.0f) * InvPi);
        }
    }
}

// Energy: no lobe gives back more than it gets; f / pdf averages to the integral of f; what the lobe says of
// its albedo is so.
TEST(Lobes, AlbedoIsAtMostOne) {
    for (const LobeCase& c : rough_cases({0.999f, 0.6f, 0.1f}, false)) {
        Uniform u(3);
        const auto in = c.inputs<8>();
        const V8 wo = c.wo<8>();
        RunningMean mean;
        for (int i = 0; i < 4000; i++) {
            const auto s = sample_lobe(c.id, in, wo, u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
            const auto v = eval_lobe(c.id, in, wo, s.wi);
            for (int k = 0; k < 8; k++)
                mean.add(s.valid[k] && v.pdf[0][k] > 0 ? double(v.f[0][k] / v.pdf[0][k]) : 0.0);
        }
        EXPECT_LE(mean.mean(), 1 + gain_slack(c) + 4 * mean.error()) << c.str();
        if (c.cosine == 0.6f && !walks(c)) {
            const auto cells =
                integrate_cells([&](const V8& wi) { return eval_lobe(c.id, in, wo, wi).f[0]; });
            const double integral = std::accumulate(cells.begin(), cells.end(), 0.0);
            EXPECT_NEAR(mean.mean(), integral, 4 * mean.error() + 3e-3) << c.str();
        }
        const double stated = double(albedo_of_lobe(c.id, in, wo)[0][0]);
        EXPECT_NEAR(stated, mean.mean(), 4 * mean.error() + stated_slack(c)) << c.str();
    }
}

// White furnace: lobes that are declared to lose nothing do not, whatever their inputs; colours are white.
TEST(Lobes, LosslessLobesLoseNothing) {
    for (const LobeCase& c : rough_cases()) {
        bool white = c.decl().lossless;
        for (const auto& [name, value] : c.given)
            for (const auto& input : c.decl().inputs)
                white = white &&
                        !(input.name == name && name != "roughness" && input.type == grid::InputType::Color);
        if (!white)
            continue;
        Uniform u(8);
        const auto in = c.inputs<8>();
        RunningMean mean;
        for (int i = 0; i < 8000; i++) {
            const auto s = sample_lobe(c.id, in, c.wo<8>(), u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
            const auto v = eval_lobe(c.id, in, c.wo<8>(), s.wi);
            for (int k = 0; k < 8; k++)
                mean.add(s.valid[k] && v.pdf[0][k] > 0 ? double(v.f[0][k] / v.pdf[0][k]) : 0.0);
        }
        EXPECT_LE(mean.mean(), 1 + gain_slack(c) + 4 * mean.error()) << c.str();
        EXPECT_GE(mean.mean(), 1 - loss_slack(c) - 4 * mean.error()) << c.str();
    }
}

TEST(Lobes, MirrorsReflect) {
    const LobeCase c = LobeCase{LobeId::MicrofacetConductorBrdf}
                           .with("roughness", 0)
                           .with("reflectance", 0.5f)
                           .seen_at(0.3f);
    const auto in = c.inputs<8>();
    const auto s = sample_lobe(c.id, in, c.wo<8>(), F8(0.5f), F8(0.25f), F8(0.75f));
    for (int k = 0; k < 8; k++) {
        EXPECT_TRUE(s.valid[k] && s.delta[k]);
        EXPECT_FLOAT_EQ(s.value.f[0][k], 0.5f + 0.5f * std::pow(0.7f, 5.0f));
        EXPECT_FLOAT_EQ(s.wi.x[k], -c.wo<8>().x[k]);
        EXPECT_FLOAT_EQ(s.wi.z[k], 0.3f);
    }
    // A smooth lobe has no value between directions.
    EXPECT_EQ(eval_lobe(c.id, in, c.wo<8>(), s.wi).f[0][0], 0.0f);
    EXPECT_EQ(eval_lobe(c.id, in, c.wo<8>(), s.wi).pdf[0][0], 0.0f);
}

// Where the geometry degenerates, numbers stay finite.
TEST(Lobes, DegenerateDirections) {
    for (const LobeCase& base : rough_cases({1}))
        for (float cosine : {1.0f, 1e-4f}) {
            LobeCase c = base;
            c.cosine = cosine;
            const V8 wo = c.wo<8>();
            for (const V8& wi :
                 {wo, -wo, V8(wo.x, wo.y, -wo.z), V8(-wo.x, -wo.y, wo.z), V8(F8(1.0f), F8(0.0f), F8(0.0f)),
                  V8(F8(0.0f), F8(0.0f), F8(1.0f)), V8(F8(0.0f), F8(0.0f), F8(-1.0f))}) {
                const auto v = eval_lobe(c.id, c.inputs<8>(), wo, wi);
                EXPECT_TRUE(std::isfinite(v.f[0][0]) && v.f[0][0] >= 0) << c.str();
                EXPECT_TRUE(std::isfinite(v.pdf[0][0]) && v.pdf[0][0] >= 0) << c.str();
            }
            for (float a : {0.0f, 0.5f, 0.99999994f})
                for (float b : {0.0f, 0.5f, 0.99999994f}) {
                    const auto s = sample_lobe(c.id, c.inputs<8>(), wo, F8(b), F8(a), F8(b));
                    EXPECT_TRUE(std::isfinite(s.wi.x[0] + s.wi.y[0] + s.wi.z[0])) << c.str();
                }
        }
}

TEST(Lobes, LaneCountsAgree) {
    const auto compare = [](const LobeCase& c, auto width) {
        constexpr int W = decltype(width)::value;
        Uniform u(21);
        float a[16], b[16], d[16];
        for (int i = 0; i < 16; i++)
            a[i] = u.one(), b[i] = u.one(), d[i] = u.one();
        for (int base = 0; base < 16; base += W) {
            const auto wide = sample_lobe(c.id, c.inputs<W>(), c.wo<W>(), Float<W>::load(a + base),
                                          Float<W>::load(b + base), Float<W>::load(d + base));
            const auto value = eval_lobe(c.id, c.inputs<W>(), c.wo<W>(), wide.wi);
            for (int k = 0; k < W; k++) {
                const auto one = sample_lobe(c.id, c.inputs<1>(), c.wo<1>(), Float<1>(a[base + k]),
                                             Float<1>(b[base + k]), Float<1>(d[base + k]));
                ASSERT_EQ(one.valid[0], wide.valid[k]) << c.str();
                for (int x = 0; x < 3; x++)
                    ASSERT_EQ(one.wi[x][0], wide.wi[x][k]) << c.str();
                const auto alone = eval_lobe(c.id, c.inputs<1>(), c.wo<1>(), one.wi);
                for (int l = 0; l < Wavelengths; l++) {
                    ASSERT_EQ(alone.f[l][0], value.f[l][k]) << c.str();
                    ASSERT_EQ(alone.pdf[l][0], value.pdf[l][k]) << c.str();
                }
            }
        }
    };
    for (const LobeCase& c : rough_cases({0.6f})) {
        compare(c, std::integral_constant<int, 8>());
        compare(c, std::integral_constant<int, 16>());
    }
}

// Estevez and Kulla (2017), D = (2 + 1/r) sin^(1/r) / 2 pi: down to where tables end, and no further.
TEST(Sheen, RoughnessEndsWhereTablesDo) {
    for (const float roughness : {0.0f, 0.01f, 0.02f, 0.04f, 0.3f, 1.0f})
        for (const float cosine : {0.02f, 0.1f, 0.3f}) {
            const double r = std::max(double(roughness), 0.02);
            const double sine = std::sqrt(1 - double(cosine) * double(cosine));
            const double is = (2 + 1 / r) * std::pow(sine, 1 / r) / (2 * std::numbers::pi);
            EXPECT_NEAR(double(SheenLobe<8>::D(F8(roughness), F8(cosine))[0]), is, 1e-4 * is) << roughness;
        }
}

// A groove a nanometre wide is the narrowest there is: orders are told apart by wavelength / period.
TEST(Grating, PeriodsAreOneNanometreAtLeast) {
    const auto eta = [](float period) {
        const auto in = LobeCase{LobeId::GratingBrdf}.with("period", period).inputs<8>();
        return double(in.eta[1][0]) / double(in.wavelength(1)[0]);
    };
    EXPECT_NEAR(eta(0), 1, 1e-6);
    EXPECT_NEAR(eta(0.25f), 1, 1e-6);
    EXPECT_NEAR(eta(1600), 1 / 1600.0, 1e-9);
}

} // namespace kanuka::bsdf
