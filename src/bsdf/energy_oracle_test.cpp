// What microfacets give back of light that meets several of them (lobe_tables.h), against quadrature in
// double.
#include <vector>

#include <gtest/gtest.h>

#include "bsdf/oracles/lobes.h"

namespace kanuka::bsdf {
namespace {

using namespace testing;
using oracle::Dir;

// Round facets that scatter once, over cosines x^2 at Gauss's nodes x; azimuths crowd at the mirror
// direction.
class Mirror {
  public:
    Mirror(double alpha, int nodes, int azimuths) : m_facets{alpha, alpha} {
        const auto t = gauss(azimuths);
        for (const auto& [x, w] : t)
            m_azimuth.push_back({oracle::HalfTau * (1 - x * x * x), 6 * oracle::HalfTau * x * x * w});
        for (const auto& [x, w] : gauss(nodes))
            m_cosine.push_back({x * x, 2 * x * w});
        for (const auto& [c, w] : m_cosine)
            m_kernel.push_back(row(c));
        m_s.assign(m_cosine.size(), 1.0); // Sinkhorn 1964
        for (double off = 1; off > 1e-12;) {
            off = 0;
            std::vector<double> next;
            for (size_t i = 0; i < m_s.size(); i++) {
                next.push_back(std::sqrt(m_s[i] / reflected(m_kernel[i])));
                off = std::max(off, std::abs(next[i] / m_s[i] - 1));
            }
            m_s = next;
        }
    }
    double balance(double cosine) const { return 1 / reflected(row(cosine)); }
    double mean() const { // of albedos of a single facet
        double sum = 0;
        for (size_t i = 0; i < m_cosine.size(); i++)
            for (double k : m_kernel[i])
                sum += 2 * m_cosine[i].first * m_cosine[i].second * k;
        return sum;
    }

  private:
    using Rule = std::vector<std::pair<double, double>>;
    // Over [0, 1]; roots of Legendre's polynomial by Newton's steps (Abramowitz and Stegun, 25.4.29).
    static Rule gauss(int n) {
        Rule rule;
        for (int i = 0; i < n; i++) {
            double x = std::cos(oracle::HalfTau * (i + 0.75) / (n + 0.5)), slope = 1;
            for (int step = 0; step < 8; step++) {
                double p = 1, before = 0;
                for (int k = 1; k <= n; k++) {
                    const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
                    before = p, p = next;
                }
                slope = n * (x * p - before) / (x * x - 1);
                x -= p / slope;
            }
            rule.push_back({0.5 * (1 + x), 1 / ((1 - x * x) * slope * slope)});
        }
        return rule;
    }
    std::vector<double> row(double cosine) const {
        const Dir wo{std::sqrt(1 - cosine * cosine), 0, cosine};
        std::vector<double> all;
        for (const auto& [c, w] : m_cosine) {
            double sum = 0;
            const double sine = std::sqrt(1 - c * c);
            for (const auto& [phi, dphi] : m_azimuth)
                sum +=
                    dphi * oracle::reflected(m_facets, wo, {sine * std::cos(phi), sine * std::sin(phi), c});
            all.push_back(sum * w);
        }
        return all;
    }
    double reflected(const std::vector<double>& row) const {
        double sum = 0;
        for (size_t i = 0; i < row.size(); i++)
            sum += row[i] * m_s[i];
        return sum;
    }

    oracle::Facets m_facets;
    Rule m_cosine, m_azimuth;
    std::vector<std::vector<double>> m_kernel;
    std::vector<double> m_s;
};

} // namespace

// s, between knots of its table too.
TEST(EnergyOracles, BalanceOfRoundFacets) {
    for (float alpha : {0.03f, 0.08f, 0.11f, 0.2f, 0.3f, 0.4f, 0.5f, 0.53f, 0.7f, 0.9f, 1.0f}) {
        const Mirror mirror(double(alpha), alpha < 0.1f ? 128 : 64, alpha < 0.1f ? 160 : 64);
        for (float cosine : {0.05f, 0.11f, 0.2f, 0.33f, 0.45f, 0.6f, 0.77f, 0.9f, 0.97f, 1.0f}) {
            const double s = mirror.balance(double(cosine));
            EXPECT_NEAR(ggx_balance(Float<1>(cosine), Float<1>(alpha))[0], s,
                        (alpha < 0.1f ? 8e-4 : 4e-4) * s)
                << "alpha " << alpha << " cos " << cosine;
        }
        EXPECT_NEAR(ggx_mean_albedo(Float<1>(alpha))[0], mirror.mean(), 2e-4) << alpha;
    }
}

// Of metals the part c = F E / (1 - F (1 - E)) comes back (Kulla and Conty 2017; Hill 2018), with the means
// of Fresnel's term and of a facet's albedo over directions: what eval() has more than one facet, over s s'
// - 1.
TEST(EnergyOracles, MetalsGiveBackTheirPart) {
    constexpr float Roughness = 0.75f;
    const Mirror mirror(double(Roughness) * double(Roughness), 64, 64);
    const double E = mirror.mean();
    const auto part = [&](const LobeCase& c, int i) {
        const oracle::Given g(c);
        const double F =
            oracle::integral(0, 1, 40, [&](double z) { return 2 * z * oracle::metal_fresnel(g, z, i); });
        return F * E / (1 - F * (1 - E));
    };
    const LobeCase metal = LobeCase{LobeId::MetalBrdf}.with("roughness", Roughness);
    const Vec3f gold(0.2f, 0.4f, 1.6f), in_gold(3.5f, 2.4f, 1.9f), iron(2.9f, 2.9f, 2.6f),
        in_iron(3.1f, 3.0f, 2.8f);
    for (const auto& [c, bound] :
         {std::pair{metal.with("eta", gold).with("extinction", in_gold), 1e-3},
          {metal.with("eta", iron).with("extinction", in_iron), 1e-3},
          {metal.with("eta", 1.5f).with("extinction", 0), 2e-3},
          {metal.with("eta", iron).with("extinction", in_iron).with("filmThickness", 200), 2e-3},
          {metal.with("eta", gold).with("extinction", in_gold).with("filmThickness", 500), 8e-3}})
        for (float cosine : {0.9f, 0.3f}) {
            const LobeCase seen = c.seen_at(cosine);
            const auto in = seen.inputs<1>();
            auto bare = in;
            bare.compensated = false;
            const auto wo = seen.wo<1>();
            const Vec3<Float<1>> wi(Float<1>(0.36f), Float<1>(0.48f), Float<1>(0.8f));
            const double both = mirror.balance(double(cosine)) * mirror.balance(0.8);
            const auto all = eval_lobe(c.id, in, wo, wi), once = eval_lobe(c.id, bare, wo, wi);
            for (int i = 0; i < Wavelengths; i++)
                EXPECT_NEAR(double(all.f[i][0]) / double(once.f[i][0]), 1 + part(seen, i) * (both - 1),
                            bound * std::abs(both - 1) + 1e-3)
                    << seen.str() << " wave " << i;
        }
}

} // namespace kanuka::bsdf
