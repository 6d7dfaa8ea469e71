// Tables that lobes look up: their knots lie where they are looked up, and what is between is near
// quadratures in double.
#include <gtest/gtest.h>

#include "bsdf/oracles/facets.h"
#include "bsdf/test_lobes.h"

namespace kanuka::bsdf {
namespace {

using namespace testing;
using oracle::Dir;
using T = LobeTables;
using F1 = Float<1>;

double at(const Knot<1>& k) {
    return double(k.i[0]) + double(k.f[0]);
}
// In a plane of `cosines` to a row.
template <int Cosines>
std::pair<double, double> at(const TableCell<1, Cosines>& c) {
    return {double(c.at[0] % Cosines) + double(c.fx[0]), double(c.at[0] / Cosines) + double(c.fy[0])};
}

// Smith's Lambda of Student's t by one integral, of P2 over slopes beyond the cotangent (Heitz 2014, eq. 73;
// Ribardière et al. 2017), whose scale is that of the whole.
class Student {
  public:
    explicit Student(double tail) : m_gamma(1 / tail) {
        m_scale = 0.5 / oracle::to_infinity([&](double x) { return shape(x); });
    }
    double lambda(double a) const {
        return m_scale / a * oracle::to_infinity([&](double x) { return x * shape(a + x); });
    }

  private:
    double shape(double x) const { return std::pow(1 + x * x / (m_gamma - 1), 0.5 - m_gamma); }
    double m_gamma, m_scale;
};

// Of light from wo, what one facet neither reflects nor lets through, over scaled slopes of facets.
double lost(double ax, double ay, double tail, double eta, Dir wo) {
    const Student student(tail);
    const auto lambda = [&](Dir w) {
        return student.lambda(std::abs(w.z) / std::max(std::hypot(ax * w.x, ay * w.y), 1e-9));
    };
    const double lambda_o = lambda(wo), gamma = 1 / tail;
    const auto ring = [&](double s) {
        constexpr int Turns = 48;
        double sum = 0;
        for (int k = 0; k < Turns; k++) {
            const double phi = oracle::Tau * (k + 0.5) / Turns;
            const Dir m = oracle::unit({-ax * s * std::cos(phi), -ay * s * std::sin(phi), 1});
            const double om = oracle::inner(wo, m);
            if (om <= 0)
                continue;
            const double R = oracle::glass_reflectance(om, eta);
            const Dir up = (2 * om * m) + (-1.0 * wo);
            double sent = up.z > 0 ? R / (1 + lambda_o + lambda(up)) : 0;
            if (R < 1) {
                const double t = std::sqrt(1 - (1 - om * om) / (eta * eta));
                const Dir down = ((om / eta - t) * m) + (-1 / eta * wo);
                sent += down.z < 0 ? (1 - R) / (1 + lambda_o + lambda(down)) : 0;
            }
            sum += sent * om / m.z * oracle::Tau / Turns;
        }
        return sum * s * std::pow(1 + s * s / (gamma - 1), -gamma) / oracle::HalfTau;
    };
    return 1 - oracle::to_infinity(ring) / wo.z;
}

} // namespace

TEST(Tables, KnotsLieWhereTheyAreLookedUp) {
    for (int k = 0; k < T::Alphas; k++)
        for (int c = 0; c < T::Cosines; c++) {
            const auto [x, y] = at(TableCell<1>(F1(T::cosine_of(c)), F1(T::alpha_of(k))));
            EXPECT_NEAR(x, c, c == 0 ? 0.1 : 1e-4); // a view along the surface stands for the first
            EXPECT_NEAR(y, k, 1e-4);
        }
    for (int k = 0; k < T::BalanceAlphas; k++)
        EXPECT_NEAR(at(balance_knot(F1(T::balance_alpha_of(k)))), k, 1e-4);
    for (int n = 0; n < T::Indices; n++)
        EXPECT_NEAR(at(index_knot(F1(T::index_of(n)))), n, 2e-3) << n;
    for (int n = 0; n < T::GlassIndices; n++)
        for (const bool outside : {true, false}) {
            const float index = T::glass_index_of(n);
            const GlassIndex<1> g(F1(outside ? index : 1 / index));
            EXPECT_NEAR(double(g.at[0]) + double(g.f[0]), n + (outside ? 0 : T::GlassIndices),
                        n ? 1e-3 : 0.2);
        }
    using G = T::StretchedGlass;
    for (const int n : {1, 5, G::Indices - 1})
        for (int t = 0; t < G::Tails; t++)
            for (const bool outside : {true, false}) {
                const float index = G::index_of(n);
                const StretchedGlassCell<1> cell(F1(G::tail_of(t)), F1(1.0f), F1(T::alpha_of(2, G::Alphas)),
                                                 F1(outside ? index : 1 / index));
                const int is =
                    (((outside ? 0 : G::Indices) + n) * G::Tails + t) * G::Stretches + G::Stretches - 1;
                double here = 0;
                for (int k = 0; k < 16; k++)
                    here += cell.at[k][0] == is * G::Alphas + 2 ? double(cell.weight[k][0]) : 0;
                EXPECT_NEAR(here, 1, 2e-3) << n << " " << t << " " << outside;
            }
}

// What stretched facets, and such of other tails than GGX's, lose of light that meets glass: at knots what
// the strata err by; between them tables of few knots, which the means over directions have to bear.
TEST(Tables, LossesOfStretchedGlass) {
    using G = T::StretchedGlass;
    const float knot_alpha = T::alpha_of(5, G::Alphas), knot_index = G::index_of(5);
    for (const auto& [tail, stretch, alpha, index, bound] :
         {std::tuple{0.6f, 1 / 3.0f, knot_alpha, knot_index, 0.011}, // strata see little of the longest tails
          {0.55f, 0.0f, knot_alpha, knot_index, 0.006},
          {0.25f, 2 / 3.0f, knot_alpha, knot_index, 0.004},
          {0.5f, 0.5f, 0.4f, 1.5f, 0.014}})
        for (const bool outside : {true, false})
            for (const int c : {6, 10})
                for (const int turn : {0, 2, 4}) {
                    const float eta = outside ? index : 1 / index, z = T::cosine_of(c, G::Cosines);
                    const V8 w = direction(F8(z), F8(0.25f * float(turn) / (G::Azimuths - 1)));
                    const float along = stretched_width(F1(alpha), F1(stretch))[0];
                    const double is = lost(double(along), double(alpha), double(tail), double(eta),
                                           {double(w.x[0]), double(w.y[0]), double(w.z[0])});
                    const StretchedGlassCell<8> cell{F8(tail), F8(stretch), F8(alpha), F8(eta)};
                    EXPECT_NEAR(cell.loss(w)[0], is, bound)
                        << "tail " << tail << " stretch " << stretch << " eta " << eta << " cos " << z
                        << " turn " << turn;
                }
}

} // namespace kanuka::bsdf
