// Tables of microfacets: GGX's, stretched ones and other tails, as mirrors and as interfaces.
#include <algorithm>

#include "bsdf/make_tables.h"

namespace kanuka::bsdf::tables {
namespace {

// Directions that a lobe scatters light to, and how much of it.
struct Scattered {
    Vec3f wi;
    float share;
};

// Reflection of Fresnel 1 from wo.
template <class Facets>
std::vector<Scattered> reflected(const Facets& facets, const V& wo, int n, float all_normals,
                                 int halves = 0) {
    std::vector<Scattered> all;
    const F lambda_o = facets.lambda(wo), one(1.0f), zero(0.0f);
    const auto add = [&](const V& m, F weight) {
        const V wi = reflect(wo, m);
        const F g =
            select((wi.z > zero) & (dot(wo, m) > zero), weight / (one + lambda_o + facets.lambda(wi)), zero);
        for (int k = 0; k < 8; k++)
            if (g[k] > 0)
                all.push_back({{wi.x[k], wi.y[k], wi.z[k]}, g[k]});
    };
    stratify(facets, wo, n, all_normals, add, halves);
    return all;
}

// Linear interpolation on a uniform axis over [0, 1].
struct Between {
    int i;
    float f;
    Between(float x, int count) {
        const float at = std::clamp(x, 0.0f, 1.0f) * float(count - 1);
        i = std::min(int(at), count - 2);
        f = at - float(i);
    }
};

// Shares of light from one knot of a balance to others.
struct Row {
    std::vector<int> to;
    std::vector<float> share;
    void add(int at, float w) {
        for (size_t k = 0; k < to.size(); k++)
            if (to[k] == at) {
                share[k] += w;
                return;
            }
        to.push_back(at);
        share.push_back(w);
    }
};

// s with s_a sum_b K_ab s_b = 1, bounded; none is gained where that keeps it from 1.
std::vector<float> balance(const std::vector<Row>& rows) {
    std::vector<double> s(rows.size(), 1.0), whole(rows.size());
    const auto update = [&] {
        double worst = 0;
        for (size_t a = 0; a < rows.size(); a++) {
            double sum = 0;
            for (size_t k = 0; k < rows[a].to.size(); k++)
                sum += double(rows[a].share[k]) * s[size_t(rows[a].to[k])];
            whole[a] = std::max(s[a] * sum, 1e-9);
            worst = std::max(worst, std::abs(whole[a] - 1));
        }
        return worst;
    };
    for (int pass = 0; pass < 300 && update() > 1e-5; pass++)
        for (size_t a = 0; a < s.size(); a++)
            s[a] = std::clamp(s[a] / std::sqrt(whole[a]), 1 / 32.0, 32.0);
    for (int pass = 0; pass < 30; pass++) {
        update();
        for (size_t a = 0; a < s.size(); a++)
            s[a] /= std::max(whole[a], 1.0);
    }
    return {s.begin(), s.end()};
}

// Directional albedos with Fresnel = 1, Schlick's weight, the dip, and dielectrics.
void fill_albedos(int at, float cosine, float alpha) {
    LobeTables& t = made();
    if (alpha == 0) { // smooth
        t.ggx[at] = 1;
        t.schlick[at] = 0;
        t.dip[at] = dip_weight(Float<1>(cosine))[0];
        for (int n = 0; n < T::Indices; n++)
            t.dielectric[n * T::Plane + at] = 1;
        return;
    }
    const Ggx<8> ggx{F(alpha)};
    const V wo = view(cosine);
    const F one(1.0f), zero(0.0f), lambda_o = ggx.lambda(wo);
    F whole(0.0f), schlick(0.0f), dip(0.0f), dielectric[T::Indices];
    for (F& d : dielectric)
        d = zero;
    stratify(ggx, wo, 32, 0, [&](const V& m, F weight) {
        const V wi = reflect(wo, m);
        const F cos_m = max(dot(wo, m), zero);
        const F g = select(wi.z > zero, weight / (one + lambda_o + ggx.lambda(wi)), zero);
        whole += g;
        schlick = fma(schlick_weight(cos_m), g, schlick);
        dip = fma(dip_weight(cos_m), g, dip);
        F cos_t;
        for (int n = 0; n < T::Indices; n++)
            dielectric[n] = fma(fresnel_dielectric(cos_m, F(T::index_of(n)), cos_t), g, dielectric[n]);
    });
    const Float<1> soft = softened(Float<1>(cosine), Float<1>(alpha));
    t.ggx[at] = float(sum_of(whole));
    t.schlick[at] = float(sum_of(schlick) - double(schlick_weight(soft)[0]) * sum_of(whole));
    t.dip[at] = float(sum_of(dip));
    for (int n = 0; n < T::Indices; n++) {
        Float<1> cos_t;
        t.dielectric[n * T::Plane + at] = float(
            sum_of(dielectric[n]) / double(fresnel_dielectric(soft, Float<1>(T::index_of(n)), cos_t)[0]));
    }
}

// The mean of a function of sqrt(cos), linear between knots, over the cosine: integral of 2 c f(c) dc, c =
// x^2.
double cosine_mean(const float* f, int count, int stride = 1) {
    double sum = 0;
    constexpr int Parts = 16;
    for (int i = 0; i + 1 < count; i++)
        for (int k = 0; k < Parts; k++) {
            const double p = (k + 0.5) / Parts, x = (i + p) / (count - 1);
            sum += (double(f[i * stride]) * (1 - p) + double(f[(i + 1) * stride]) * p) * 4 * x * x * x /
                   (Parts * (count - 1));
        }
    return sum;
}

// The balance, and means of albedos.
void fill_balance(int k) {
    LobeTables& t = made();
    constexpr int Knots = T::BalanceCosines;
    float* s = t.balance + k * Knots;
    std::fill(s, s + Knots, 1.0f);
    t.ggx_mean[k] = 1;
    if (k == 0)
        return;
    const Ggx<8> ggx{F(T::balance_alpha_of(k))};
    std::vector<Row> rows(Knots);
    float whole[Knots] = {};
    for (int c = 0; c < Knots; c++)
        for (const Scattered& w : reflected(ggx, view(T::cosine_of(c, Knots)), 96, 0, 48)) {
            const Between x(std::sqrt(w.wi.z), Knots);
            whole[c] += w.share;
            rows[size_t(c)].add(x.i, w.share * (1 - x.f));
            rows[size_t(c)].add(x.i + 1, w.share * x.f);
        }
    const auto solved = balance(rows);
    std::copy(solved.begin(), solved.end(), s);
    t.ggx_mean[k] = float(cosine_mean(whole, Knots));
}

// Of light from wo, what one facet of an interface neither reflects nor lets through. Fine steps over the
// angle
// (`around` of them, 2 `around` / 8 of the others): total reflection begins at an edge.
template <class Facets>
float lost_by_interface(const Facets& facets, const V& wo, float index, int n, int halves,
                        float all_normals) {
    const F lambda_o = facets.lambda(wo), eta(index), one(1.0f), zero(0.0f);
    double whole = 0;
    const auto add = [&](const V& m, F weight) {
        F cos_t;
        const F reflects = fresnel_dielectric(max(dot(wo, m), zero), eta, cos_t);
        for (const bool passes : {false, true}) {
            const V wi = passes ? refract(wo, m, eta, cos_t) : reflect(wo, m);
            const Mask<8> valid = passes ? (wi.z < zero) & (reflects < one) : wi.z > zero;
            const F share =
                (passes ? one - reflects : reflects) * weight / (one + lambda_o + facets.lambda(wi));
            whole += sum_of(select(valid & (share > zero), share, zero));
        }
    };
    stratify(facets, wo, n, all_normals, add, halves);
    return float(std::clamp(1 - whole, 0.0, 1.0));
}

void fill_round_glass(int n, int k) {
    LobeTables& t = made();
    const Ggx<8> ggx{F(T::alpha_of(k))};
    for (int side = 0; side < 2; side++) {
        const int at = side * T::GlassIndices + n;
        float* loss = t.glass_loss + at * T::Plane + k * T::Cosines;
        const float index = side ? 1 / T::glass_index_of(n) : T::glass_index_of(n);
        for (int c = 0; c < T::Cosines; c++)
            loss[c] = k == 0 ? 0 : lost_by_interface(ggx, view(T::cosine_of(c)), index, 96, 24, 0);
        t.glass_mean_loss[at * T::Alphas + k] = float(cosine_mean(loss, T::Cosines));
    }
}

void fill_stretched_balance(int tail_index, int stretch_index, int k) {
    LobeTables& t = made();
    const int at = (tail_index * T::Stretches + stretch_index) * T::WideAlphas + k;
    constexpr int Knots = T::Azimuths * T::WideCosines;
    float* s = t.stretched_balance + at * Knots;
    std::fill(s, s + Knots, 1.0f);
    t.stretched_mean[at] = 1;
    t.stretched_round[at] = 0;
    if (k == 0)
        return;
    const float tail = T::MaxTail * float(tail_index) / (T::Tails - 1);
    const float alpha = T::alpha_of(k, T::WideAlphas);
    const float across =
        stretched_width(Float<1>(alpha), Float<1>(float(stretch_index) / (T::Stretches - 1)))[0];
    const StretchedFacets<8> facets{F(across), F(alpha), F(tail)};
    std::vector<Row> rows(Knots);
    std::vector<float> whole(Knots, 0.0f);
    for (int p = 0; p < T::Azimuths; p++)
        for (int c = 0; c < T::WideCosines; c++) {
            const int from = p * T::WideCosines + c;
            const V wo = view(T::cosine_of(c, T::WideCosines), 0.25f * float(p) / (T::Azimuths - 1));
            for (const Scattered& w : reflected(facets, wo, 24, tail > 0.505f ? 0.5f : 0.0f)) {
                const Between x(std::sqrt(w.wi.z), T::WideCosines);
                const float turn = turn_of(Float<1>(std::abs(w.wi.y)), Float<1>(std::abs(w.wi.x)))[0];
                const Between y(4 * turn, T::Azimuths);
                whole[size_t(from)] += w.share;
                for (int corner = 0; corner < 4; corner++)
                    rows[size_t(from)].add((y.i + (corner >> 1)) * T::WideCosines + x.i + (corner & 1),
                                           w.share * (corner & 1 ? x.f : 1 - x.f) *
                                               (corner & 2 ? y.f : 1 - y.f));
            }
        }
    const auto solved = balance(rows);
    std::copy(solved.begin(), solved.end(), s);
    double mean = 0; // trapezoids over the quarter turn
    for (int p = 0; p < T::Azimuths; p++)
        mean += cosine_mean(whole.data() + p * T::WideCosines, T::WideCosines) *
                (p == 0 || p == T::Azimuths - 1 ? 0.5 : 1.0) / (T::Azimuths - 1);
    t.stretched_mean[at] = float(mean);
    float low = 0, high = 1;
    for (int i = 0; i < 24; i++) {
        const float x = 0.5f * (low + high);
        (double(ggx_mean_albedo(Float<1>(x * x * x * x))[0]) > mean ? low : high) = x;
    }
    t.stretched_round[at] = low;
}

// The same as fill_round_glass, of facets that are stretched or have another tail.
void fill_stretched_glass(int at) {
    LobeTables& t = made();
    using G = LobeTables::StretchedGlass;
    const int k = at % G::Alphas, stretch = at / G::Alphas % G::Stretches,
              tail_index = at / (G::Alphas * G::Stretches) % G::Tails,
              n = at / (G::Alphas * G::Stretches * G::Tails);
    const float tail = G::tail_of(tail_index), alpha = T::alpha_of(k, G::Alphas);
    const float across = stretched_width(Float<1>(alpha), Float<1>(float(stretch) / (G::Stretches - 1)))[0];
    const StretchedFacets<8> facets{F(across), F(alpha), F(tail)};
    const float index = G::index_of(n % G::Indices);
    float* loss = t.stretched_glass.loss + at * G::Azimuths * G::Cosines;
    double mean = 0; // trapezoids over the quarter turn
    for (int p = 0; p < G::Azimuths; p++) {
        float* row = loss + p * G::Cosines;
        for (int c = 0; c < G::Cosines; c++)
            row[c] =
                k == 0 ? 0
                       : lost_by_interface(
                             facets, view(T::cosine_of(c, G::Cosines), 0.25f * float(p) / (G::Azimuths - 1)),
                             n < G::Indices ? index : 1 / index, 40, 0, tail > 0.505f ? 0.5f : 0.0f);
        mean +=
            cosine_mean(row, G::Cosines) * (p == 0 || p == G::Azimuths - 1 ? 0.5 : 1.0) / (G::Azimuths - 1);
    }
    t.stretched_glass.mean[at] = float(mean);
}

} // namespace

void fill_ggx() {
    for (int k = 0; k < T::Alphas; k++)
        for (int c = 0; c < T::Cosines; c++)
            fill_albedos(k * T::Cosines + c, T::cosine_of(c), T::alpha_of(k));
    for (int k = 0; k < T::BalanceAlphas; k++)
        fill_balance(k);
}

// Lambda(a) = (1 / a) int_a^inf (x - a) P2(x) dx, with P2 the marginal of Student's t over slopes (Ribardière
// et al. 2017): C (1 + x^2 / (g - 1))^(1/2 - g). Stored is a Lambda(a), over a / (1 + a).
void fill_lambda() {
    LobeTables& t = made();
    for (int y = 0; y < T::LambdaTails; y++) {
        const double tail = std::max(1e-5, double(T::MaxTail) * y / (T::LambdaTails - 1)), g = 1 / tail;
        const double scale =
            std::exp(std::lgamma(g - 0.5) - std::lgamma(g)) * std::sqrt((g - 1) / 3.14159265358979);
        for (int x = 0; x < T::LambdaCotangents; x++) {
            const double a = double(x) / (T::LambdaCotangents - 1) /
                             std::max(1e-9, 1 - double(x) / (T::LambdaCotangents - 1));
            if (x == T::LambdaCotangents - 1) {
                t.student_lambda[y * T::LambdaCotangents + x] = 0;
                continue;
            }
            // The first moment has a closed form; the probability beyond a is taken over v = 1 / (1 + x).
            const double base = 1 + a * a / (g - 1);
            const double moment = scale * (g - 1) / (2 * g - 3) * std::pow(base, 1.5 - g);
            double beyond = 0;
            constexpr int Parts = 4000;
            const double end = 1 / (1 + a);
            for (int i = 0; i < Parts; i++) {
                const double v = end * (i + 0.5) / Parts, s = 1 / v - 1;
                beyond += scale * std::pow(1 + s * s / (g - 1), 0.5 - g) / (v * v) * end / Parts;
            }
            t.student_lambda[y * T::LambdaCotangents + x] = float(std::max(moment - a * beyond, 0.0));
        }
    }
}

void fill_stretched() {
    for (int t = 0; t < T::Tails; t++)
        for (int s = 0; s < T::Stretches; s++)
            for (int k = 0; k < T::WideAlphas; k++)
                fill_stretched_balance(t, s, k);
}

void fill_glass() {
    for (int n = 0; n < T::GlassIndices; n++)
        for (int k = 0; k < T::Alphas; k++)
            fill_round_glass(n, k);
    for (int at = 0; at < LobeTables::StretchedGlass::Corners; at++)
        fill_stretched_glass(at);
}

} // namespace kanuka::bsdf::tables
