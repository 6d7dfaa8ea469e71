// Takes the integrals of lobe_tables.h and writes them as they lie in memory.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>

#include "bsdf/make_tables.h"

namespace kanuka::bsdf::tables {
namespace {

void fill_sheen_seen(int at, float cosine, float roughness) {
    const V wo = view(cosine);
    const double seen = hemisphere(
        96, [&](const V& m) { return max(dot(wo, m), F(0.0f)) * SheenLobe<8>::D(F(roughness), m.z); });
    const double even = std::max(seen - 0.5 * double(cosine), 0.5 * double(cosine));
    made().sheen_seen[at] = float(even * std::sqrt(std::max(roughness, SheenLobe<8>::LeastTabulated)));
}

void fill_others(int at, float cosine, float x) {
    LobeTables& t = made();
    const V wo = view(std::max(cosine, 1e-4f));
    const F r(x), a(x * x * x * x); // a roughness; a width, up to 1
    const F n = F(2.0f) / max(a * a, F(1e-4f)) - F(2.0f);
    t.burley[at] = float(hemisphere(48, [&](const V& wi) { return BurleyLobe<8>::shape(r, wo, wi); }));
    t.sheen[at] = float(hemisphere(96, [&](const V& wi) { return SheenLobe<8>::shape(r, wo, wi); }));
    // Narrow lobes are summed over what sampling gives.
    double phong = 0, blinn = 0, highlight[2] = {0, 0};
    constexpr int N = 48;
    LobeInputs<8> in, at_most[2]; // highlights that reflect all there is around their axis
    for (int mirror = 0; mirror < 2; mirror++) {
        using H = HighlightLobe<8>;
        at_most[mirror].color[H::Height] = Spectrum<8>(F(1e30f));
        at_most[mirror].number[H::Exponent] = n;
        at_most[mirror].number[H::About] = F(float(mirror));
        H::prepare(at_most[mirror]);
    }
    static_assert(PhongLobe<8>::Reflectance == BlinnLobe<8>::Reflectance &&
                  PhongLobe<8>::Exponent == BlinnLobe<8>::Exponent);
    in.color[PhongLobe<8>::Reflectance] = Spectrum<8>(F(1.0f));
    in.number[PhongLobe<8>::Exponent] = n;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j += 8) {
            const F u0 = (F(Int<8>::lane_index()) + F(float(j) + 0.5f)) * F(1.0f / N),
                    u1((float(i) + 0.5f) / N);
            const auto mean_of = [&](const LobeSample<8>& s, const LobeValue<8>& v) {
                return sum_of(
                    select(s.valid & (v.pdf[0] > F(0.0f)), v.f[0] / max(v.pdf[0], F(1e-30f)), F(0.0f)));
            };
            const auto p = PhongLobe<8>::sample(in, wo, u0, u1), b = BlinnLobe<8>::sample(in, wo, u0, u1);
            phong += mean_of(p, PhongLobe<8>::eval(in, wo, p.wi)) / (N * N);
            blinn += mean_of(b, BlinnLobe<8>::eval(in, wo, b.wi)) / (N * N);
            for (int mirror = 0; mirror < 2; mirror++) {
                const auto s = HighlightLobe<8>::sample(at_most[mirror], wo, u0, u1);
                highlight[mirror] += mean_of(s, HighlightLobe<8>::eval(at_most[mirror], wo, s.wi)) / (N * N);
            }
        }
    t.phong[at] = float(phong);
    t.blinn[at] = float(blinn);
    for (int mirror = 0; mirror < 2; mirror++)
        t.highlight[mirror][at] = float(highlight[mirror]);
}

// Rows "metal,wavelength,n,k", linear between entries, in the order that the schema names the metals in.
void fill_metals(const char* path) {
    LobeTables& t = made();
    std::ifstream file(path);
    std::string line;
    std::vector<std::string> names;
    std::vector<std::vector<std::array<double, 3>>> rows;
    while (std::getline(file, line)) {
        char name[16];
        std::array<double, 3> row;
        if (line.empty() || line[0] == '#' ||
            std::sscanf(line.c_str(), "%15[^,],%lf,%lf,%lf", name, &row[0], &row[1], &row[2]) != 4)
            continue;
        if (names.empty() || names.back() != name) {
            names.emplace_back(name);
            rows.emplace_back();
        }
        rows.back().push_back(row);
    }
    constexpr grid::LobeId Id = grid::LobeId::MetalBrdf;
    const std::span<const std::string_view> declared =
        grid::lobe(Id).inputs[size_t(input_of(Id, "metal"))].names;
    for (int m = 0; m < T::Metals; m++) {
        const auto at = std::find(names.begin(), names.end(), declared[size_t(m) + 1]);
        if (at == names.end())
            throw std::runtime_error(std::string(path) + " lacks " + std::string(declared[size_t(m) + 1]));
        const auto& r = rows[size_t(at - names.begin())];
        for (int i = 0; i < T::MetalKnots; i++) {
            const double nm = 360 + 10.0 * i;
            size_t k = 0;
            while (k + 2 < r.size() && r[k + 1][0] <= nm)
                k++;
            const double f = std::clamp((nm - r[k][0]) / (r[k + 1][0] - r[k][0]), 0.0, 1.0);
            t.metal_n[m * T::MetalKnots + i] = float(r[k][1] + f * (r[k + 1][1] - r[k][1]));
            t.metal_k[m * T::MetalKnots + i] = float(r[k][2] + f * (r[k + 1][2] - r[k][2]));
        }
    }
}

void fill_all(const char* metals) {
    fill_metals(metals);
    fill_lambda();
    fill_ggx();
    const auto each = [](const auto& fill) {
        for (int k = 0; k < T::Alphas; k++)
            for (int c = 0; c < T::Cosines; c++)
                fill(k * T::Cosines + c, T::cosine_of(c), float(k) / (T::Alphas - 1));
    };
    each(fill_sheen_seen);
    each(fill_others);
    fill_dielectric_means();
    fill_escape();
    fill_glass();
    fill_stretched();
}

} // namespace
} // namespace kanuka::bsdf::tables

namespace kanuka::bsdf {
LobeTables kanuka_lobe_tables;
}

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: make_tables METALS.csv OUT\n");
        return 2;
    }
    try {
        kanuka::bsdf::tables::fill_all(argv[1]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "make_tables: %s\n", e.what());
        return 1;
    }
    std::ofstream out(argv[2], std::ios::binary);
    out.write(reinterpret_cast<const char*>(&kanuka::bsdf::lobe_tables()), sizeof(kanuka::bsdf::LobeTables));
    if (!out.flush()) {
        std::fprintf(stderr, "make_tables: %s: cannot be written\n", argv[2]);
        return 1;
    }
    return 0;
}
