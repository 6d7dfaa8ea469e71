// Tables of what lies below a thick coat.
#include <algorithm>

#include "bsdf/make_tables.h"

namespace kanuka::bsdf::tables {
namespace {

// What GGX of width alpha, all its light balanced, sends from a direction in the layer to those that leave
// it. Of rough ones over the directions above the layer: strata of normals see little of a narrow cone. Of
// others over normals.
double escape(float alpha, const V& wo, float index) {
    const Ggx<8> ggx{F(alpha)};
    const F lambda_o = ggx.lambda(wo), one(1.0f), zero(0.0f), n(index);
    const float own = ggx_balance(Float<1>(wo.z[0]), Float<1>(alpha))[0];
    if (alpha > 0.25f)
        return double(own) * hemisphere(128, [&](const V& over) {
                   F inside;
                   const F passes = one - fresnel_dielectric(over.z, n, inside);
                   const V wi(over.x / n, over.y / n, inside), m = normalize(wo + wi);
                   const F f = F(0.25f) * ggx.D(m) / (wo.z * (one + lambda_o + ggx.lambda(wi)));
                   return f * ggx_balance(inside, F(alpha)) * passes * over.z / (n * n * inside);
               });
    double out = 0;
    stratify(ggx, wo, 96, 0, [&](const V& m, F weight) {
        const V wi = reflect(wo, m);
        const F share =
            select((wi.z > zero) & (dot(wo, m) > zero),
                   weight * ggx_balance(abs(wi.z), F(alpha)) / (one + lambda_o + ggx.lambda(wi)), zero);
        F cos_t;
        out += sum_of(share * (one - fresnel_dielectric(max(wi.z, zero), one / n, cos_t)));
    });
    return double(own) * out;
}

void fill_escape_at(int at, float cosine, float x) {
    const float alpha = x * x * x * x;
    for (int n = 0; n < T::Indices; n++) {
        const float index = T::index_of(n);
        float& ratio = made().escape[n * T::Plane + at];
        ratio = 1;
        if (alpha == 0)
            continue;
        const float inside = std::sqrt(1 - (1 - cosine * cosine) / (index * index));
        Float<1> unused;
        const double smooth = 1 - double(fresnel_dielectric(softened(Float<1>(cosine), Float<1>(alpha)),
                                                            Float<1>(index), unused)[0]);
        ratio = float(std::min(escape(alpha, view(inside), index), 1.0) / std::max(smooth, 1e-6));
    }
}

} // namespace

void fill_dielectric_means() {
    for (int n = 0; n < T::Indices; n++)
        for (int k = 0; k < T::Alphas; k++) {
            const Float<1> index(T::index_of(n)), alpha(T::alpha_of(k));
            double sum = 0;
            constexpr int N = 4096;
            for (int i = 0; i < N; i++) { // over the cosine, by its square root's steps
                const double x = (i + 0.5) / N, c = x * x;
                sum += double(dielectric_albedo(Float<1>(float(c)), alpha, index)[0]) * 2 * c * 2 * x / N;
            }
            made().dielectric_mean[n * T::Alphas + k] = float(sum);
        }
}

void fill_escape() {
    for (int k = 0; k < T::Alphas; k++)
        for (int c = 0; c < T::Cosines; c++)
            fill_escape_at(k * T::Cosines + c, T::cosine_of(c), float(k) / (T::Alphas - 1));
}

} // namespace kanuka::bsdf::tables
