// Phase functions: densities that integrate to one, samples that follow them, means and limits that are
// known, the same bits for every lane count.
#include "bsdf/phase.h"

#include <gtest/gtest.h>
#include <random>

#include "base/test_statistics.h"
#include "bsdf/oracles/highlights.h"

namespace kanuka::bsdf {
namespace {

using kanuka::testing::chi_square;
using kanuka::testing::RunningMean;
using kanuka::testing::sidak;

struct Case {
    const char* name;
    Phase<1> phase;
    double mean_cosine;
};

Phase<1> phase(PhaseKind kind, float g = 0, float other = 0, float share = 0, float alpha = 0) {
    return {kind, Float<1>(g), Float<1>(other), Float<1>(share), Float<1>(alpha)};
}

double draine_mean(double g, double alpha) { // Draine 2003, eq. 6
    return g * (1 + alpha * (3 + 2 * g * g) / 5) / (1 + alpha * (1 + 2 * g * g) / 3);
}

std::vector<Case> cases() {
    using enum PhaseKind;
    std::vector<Case> all{{"isotropic", phase(Isotropic), 0}, {"Rayleigh", phase(Rayleigh), 0}};
    for (float g : {-0.6f, -0.3f, 0.0f, 0.0005f, 0.5f, 0.97f})
        all.push_back({"Henyey-Greenstein", phase(HenyeyGreenstein, g), double(g)});
    all.push_back({"double", phase(DoubleHenyeyGreenstein, 0.8f, -0.4f, 0.3f), 0.7 * 0.8 - 0.3 * 0.4});
    for (float g : {0.05f, 0.4f, 0.9f})
        for (float alpha : {0.0f, 1.0f, 30.0f})
            all.push_back({"Draine", phase(Draine, g, 0, 0, alpha), draine_mean(double(g), double(alpha))});
    for (float d : {5.0f, 12.0f, 50.0f}) {
        const Phase<1> p = mie_phase(Float<1>(d));
        const double w = double(p.share[0]);
        all.push_back(
            {"Mie", p, (1 - w) * double(p.g[0]) + w * draine_mean(double(p.other_g[0]), double(p.alpha[0]))});
    }
    return all;
}

// Integral over cosines [a, b] of the density, dense towards the forward peak.
double integral(const Phase<1>& p, double a, double b) {
    // 1 - c = x^2, so that peaks are wide.
    const double x0 = std::sqrt(1 - b), x1 = std::sqrt(1 - a);
    double sum = 0;
    constexpr int N = 2000;
    for (int i = 0; i < N; i++) {
        const double x = x0 + (x1 - x0) * (i + 0.5) / N;
        sum += double(eval_phase(p, Float<1>(float(1 - x * x)))[0]) * 2 * x * (x1 - x0) / N;
    }
    return sum * 2 * 3.14159265358979;
}

} // namespace

TEST(Phase, DensitiesIntegrateToOne) {
    for (const Case& c : cases())
        EXPECT_NEAR(integral(c.phase, -1, 1), 1, c.phase.g[0] > 0.99f ? 1e-2 : 2e-3)
            << c.name << " " << c.phase.g[0];
}

TEST(Phase, SamplesFollowTheirDensity) {
    const auto all = cases();
    for (const Case& c : all) {
        std::mt19937 g(3);
        const auto u = [&] { return Float<1>(float(g() >> 8) * 0x1p-24f); };
        const Vec3<Float<1>> d(Float<1>(0.48f), Float<1>(-0.6f), Float<1>(0.64f));
        constexpr int Count = 60000, Cells = 40;
        std::vector<double> seen(Cells, 0.0), expected;
        RunningMean mean;
        for (int i = 0; i < Count; i++) {
            const Float<1> choice = u(), a = u(), b = u();
            const auto w = sample_phase(c.phase, d, choice, a, b);
            const float cosine = dot(w, d)[0];
            ASSERT_NEAR(dot(w, w)[0], 1, 1e-4f) << c.name;
            mean.add(double(cosine));
            // Cells of equal steps in the root of 1 - c: narrow where the peak is.
            seen[size_t(std::clamp(int(std::sqrt(std::max(0.0f, 1 - cosine) / 2) * Cells), 0, Cells - 1))]++;
        }
        for (int i = 0; i < Cells; i++) {
            const auto at = [&](int k) { return 1 - 2.0 * k * k / double(Cells * Cells); };
            expected.push_back(integral(c.phase, at(i + 1), at(i)) * Count);
        }
        EXPECT_GT(chi_square(seen, expected).p, sidak(1e-3, int(all.size())))
            << c.name << " " << c.phase.g[0];
        EXPECT_NEAR(mean.mean(), c.mean_cosine, 4.5 * mean.error() + 1e-3) << c.name << " " << c.phase.g[0];
    }
}

TEST(Phase, LimitsAgree) {
    for (float c : {-1.0f, -0.4f, 0.0f, 0.7f, 1.0f}) {
        const Float<1> x(c);
        EXPECT_NEAR(draine(Float<1>(0.0f), Float<1>(1.0f), x)[0], rayleigh(x)[0], 1e-6f);
        EXPECT_NEAR(draine(Float<1>(0.6f), Float<1>(0.0f), x)[0], henyey_greenstein(Float<1>(0.6f), x)[0],
                    1e-6f);
        EXPECT_NEAR(henyey_greenstein(Float<1>(0.0f), x)[0], InvFourPi, 1e-7f);
    }
    // Rayleigh: twice as much forwards and backwards as across.
    EXPECT_FLOAT_EQ(rayleigh(Float<1>(1.0f))[0], 2 * rayleigh(Float<1>(0.0f))[0]);
    // Larger droplets scatter more forwards.
    EXPECT_GT(mie_phase(Float<1>(40.0f)).g[0], mie_phase(Float<1>(6.0f)).g[0]);
}

TEST(Phase, LaneCountsAgree) {
    for (const Case& c : cases()) {
        std::mt19937 g(9);
        float u[3][8];
        for (auto& row : u)
            for (float& x : row)
                x = float(g() >> 8) * 0x1p-24f;
        Phase<8> wide{c.phase.kind, Float<8>(c.phase.g[0]), Float<8>(c.phase.other_g[0]),
                      Float<8>(c.phase.share[0]), Float<8>(c.phase.alpha[0])};
        const Vec3<Float<8>> d8(Float<8>(0.48f), Float<8>(-0.6f), Float<8>(0.64f));
        const Vec3<Float<1>> d1(Float<1>(0.48f), Float<1>(-0.6f), Float<1>(0.64f));
        const auto w8 =
            sample_phase(wide, d8, Float<8>::load(u[0]), Float<8>::load(u[1]), Float<8>::load(u[2]));
        for (int k = 0; k < 8; k++) {
            const auto w1 =
                sample_phase(c.phase, d1, Float<1>(u[0][k]), Float<1>(u[1][k]), Float<1>(u[2][k]));
            for (int x = 0; x < 3; x++)
                ASSERT_EQ(w1[x][0], w8[x][k]) << c.name;
            ASSERT_EQ(eval_phase(c.phase, w1.x)[0], eval_phase(wide, w8.x)[k]) << c.name;
        }
    }
}

// Phase functions, over the ranges of their inputs.
TEST(PhaseOracles, Formulas) {
    using enum PhaseKind;
    const auto compare = [](const Phase<1>& p, const auto& right, const std::string& where) {
        for (int i = 0; i <= 400; i++) {
            const float x = float(i) / 400, c = 1 - 2 * x * x * x; // dense forwards
            const double found = double(eval_phase(p, Float<1>(c))[0]), is = right(double(c));
            EXPECT_NEAR(found, is, 2e-5 * is) << where << " cos " << c;
        }
    };
    const auto phase = [](PhaseKind kind, float g, float other, float share, float alpha) {
        return Phase<1>{kind, Float<1>(g), Float<1>(other), Float<1>(share), Float<1>(alpha)};
    };
    const float Gs[] = {-0.9995f, -0.5f, 0, 0.3f, 0.9f, 0.9995f};
    compare(phase(Isotropic, 0, 0, 0, 0), [](double) { return 1 / (2 * oracle::Tau); }, "isotropic");
    compare(phase(Rayleigh, 0, 0, 0, 0), oracle::rayleigh_phase, "Rayleigh");
    for (float g : Gs) {
        const double d = double(g);
        compare(
            phase(HenyeyGreenstein, g, 0, 0, 0),
            [&](double c) { return oracle::henyey_greenstein_phase(d, c); }, "HG " + std::to_string(g));
        for (float other : Gs)
            compare(
                phase(DoubleHenyeyGreenstein, g, other, 0.3f, 0),
                [&](double c) {
                    const double share = double(0.3f);
                    return (1 - share) * oracle::henyey_greenstein_phase(d, c) +
                           share * oracle::henyey_greenstein_phase(double(other), c);
                },
                "double HG");
        for (float alpha : {0.0f, 1.0f, 30.0f, 1000.0f})
            if (g > 0)
                compare(
                    phase(Draine, g, 0, 0, alpha),
                    [&](double c) { return oracle::draine_phase(d, double(alpha), c); },
                    "Draine " + std::to_string(g) + " " + std::to_string(alpha));
    }
}

// Water droplets: parameters are exponentials in single precision, so peaks are compared more loosely.
TEST(PhaseOracles, Mie) {
    for (float d : {5.0f, 8.0f, 20.0f, 50.0f})
        for (int i = 0; i <= 200; i++) {
            const float x = float(i) / 200, c = 1 - 2 * x * x * x;
            const double is = oracle::mie_phase(double(d), double(c));
            EXPECT_NEAR(eval_phase(mie_phase(Float<1>(d)), Float<1>(c))[0], is, 1e-3 * is)
                << d << " cos " << c;
        }
}

} // namespace kanuka::bsdf
