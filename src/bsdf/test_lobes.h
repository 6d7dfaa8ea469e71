// Lobes at given parameters, and integrals over directions: what the tests of this folder share.
#pragma once

#include <array>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "bsdf/lobes.h"

namespace kanuka::bsdf::testing {

using F8 = Float<8>;
using V8 = Vec3<F8>;

// Four wavelengths; `hero` is the one that stands first.
template <int W>
const Float<W>* test_wavelengths(int hero = 0) {
    static const auto all = [] {
        std::array<std::array<Float<W>, Wavelengths>, Wavelengths> l;
        for (int h = 0; h < Wavelengths; h++) {
            for (int i = 0; i < Wavelengths; i++)
                l[size_t(h)][size_t(i)] = Float<W>(0.15f + 0.2f * float(i));
            std::swap(l[size_t(h)][0], l[size_t(h)][size_t(h)]);
        }
        return l;
    }();
    return all[size_t(hero)].data();
}

// A lobe with some inputs given by name; the others hold their defaults.
struct LobeCase {
    LobeId id;
    std::vector<std::pair<std::string, Vec3f>> given = {};
    float cosine = 1; // of wo
    bool outside = true;

    const grid::LobeDecl& decl() const { return grid::lobe(id); }
    LobeCase with(const std::string& name, float value) const {
        return with(name, Vec3f(value, value, value));
    }
    LobeCase with(const std::string& name, Vec3f value) const {
        LobeCase c = *this;
        for (auto& [n, v] : c.given)
            if (n == name) {
                v = value;
                return c;
            }
        c.given.emplace_back(name, value);
        return c;
    }
    LobeCase seen_at(float cosine, bool outside = true) const {
        LobeCase c = *this;
        c.cosine = cosine;
        c.outside = outside;
        return c;
    }
    // As declared; colours change places with the wavelengths.
    template <int W>
    LobeInputs<W> raw(int hero = 0) const {
        LobeInputs<W> in;
        int color = 0, number = 0;
        for (size_t i = 0; i < decl().inputs.size(); i++) {
            const grid::LobeInput& input = decl().inputs[i];
            if (input.type == grid::InputType::Normal)
                continue;
            Vec3f value = input.fallback;
            for (const auto& [name, v] : given)
                if (name == input.name) {
                    value = v;
                    in.given |= 1u << i;
                }
            if (input.type == grid::InputType::Color) {
                Spectrum<W>& s = in.color[color++]; // three steps and their mean
                s[0] = Float<W>(value.x), s[1] = Float<W>(value.y), s[2] = Float<W>(value.z);
                s[3] = Float<W>((value.x + value.y + value.z) / 3);
                std::swap(s[0], s[hero]);
            } else {
                in.number[number++] = Float<W>(value.x);
            }
        }
        return in;
    }
    template <int W>
    LobeInputs<W> inputs(const Vec3<Float<W>>& wo, bool outside, int hero = 0) const {
        LobeInputs<W> in = raw<W>(hero);
        prepare_lobe(id, in, wo, Mask<W>(outside), test_wavelengths<W>(hero));
        return in;
    }
    template <int W>
    LobeInputs<W> inputs(int hero = 0) const {
        return inputs<W>(wo<W>(), outside, hero);
    }
    template <int W>
    Vec3<Float<W>> wo() const {
        const float s = std::sqrt(1 - cosine * cosine);
        return {Float<W>(0.8f * s), Float<W>(-0.6f * s), Float<W>(cosine)};
    }
    bool transmits() const {
        return decl().kind == grid::LobeKind::Transmission ||
               decl().kind == grid::LobeKind::ReflectionTransmission;
    }
    std::string str() const {
        std::string s(decl().name);
        for (const auto& [name, v] : given)
            s += " " + name + " " + std::to_string(v.x);
        return s + " cos " + std::to_string(cosine) + (outside ? "" : " inside");
    }
};

inline bool scatters(const grid::LobeDecl& decl) {
    return decl.kind != grid::LobeKind::Emission && decl.kind != grid::LobeKind::Phase &&
           decl.id != LobeId::AimedBsdf; // a direction, and no distribution
}

// Every lobe of the table, with each of its inputs over its range in turn; rough where there is a choice.
// `cosines`: of wo; interfaces are seen from both sides.
inline std::vector<LobeCase> rough_cases(const std::vector<float>& cosines = {0.999f, 0.6f, 0.1f},
                                         bool all_views = true) {
    std::vector<LobeCase> all;
    for (const grid::LobeDecl& decl : grid::lobe_table()) {
        if (!scatters(decl))
            continue;
        std::vector<LobeCase> mine;
        LobeCase base{decl.id};
        if (grid::find_input(decl, "roughness") >= 0)
            base = base.with("roughness", 0.45f);
        mine.push_back(base);
        for (const grid::LobeInput& input : decl.inputs) {
            if (input.type == grid::InputType::Normal)
                continue;
            const std::string name(input.name);
            LobeCase c = base;
            if (name == "rotation" && grid::find_input(decl, "anisotropy") >= 0)
                c = c.with("anisotropy", 0.7f);
            if (name == "filmIor")
                c = c.with("filmThickness", 380);
            std::vector<float> values;
            if (name == "roughness")
                values = {decl.id == LobeId::GratingBrdf ? 0.3f : 0.15f, 0.7f, 1.0f};
            else if (name == "ior") // nearer to 1 it is a direction, next to
                values = {1.05f, 1.4f, 4};
            else if (name == "exponent")
                values = {0, 10, 1000};
            else if (name == "walks") {
                mine.push_back(c.with("walks", 1).with("roughness", 0.8f));
                mine.push_back(c.with("walks", 1).with("roughness", 0.7f).with("anisotropy", 0.6f));
                if (decl.id == LobeId::MicrosurfaceDielectricBsdfRgb_v1)
                    mine.push_back(c.with("walks", 1).with("roughness", 0.7f).with("abbe", 30));
                values = {0.3f, 1};
            } else if (!input.names.empty())
                values = {1, float(input.names.size() - 1)};
            else if (input.storage == grid::Storage::Amount)
                values = {0.3f, 5};
            else if (input.type == grid::InputType::Color)
                values = {0.4f};
            else
                for (float f : {0.0f, 0.13f, 1.0f})
                    values.push_back(input.low + f * (input.high - input.low));
            for (float v : values)
                mine.push_back(c.with(name, v));
        }
        for (size_t i = 0; i < mine.size(); i++)
            for (size_t k = 0; k < cosines.size(); k++) {
                if (!all_views && i > 0 &&
                    k != i % cosines.size()) // the base case from everywhere, others in turn
                    continue;
                const LobeCase& c = mine[i];
                const float cosine = cosines[k];
                all.push_back(c.seen_at(cosine));
                if (decl.id == LobeId::MicrosurfaceDielectricBsdfRgb_v1)
                    all.push_back(c.seen_at(cosine, false));
            }
    }
    return all;
}

class Uniform {
  public:
    explicit Uniform(uint32_t seed) : m_engine(seed) {}
    float one() { return float(m_engine() >> 8) * 0x1p-24f; }
    template <int W>
    Float<W> lanes() {
        Float<W> f;
        for (int i = 0; i < W; i++)
            f.v[i] = one();
        return f;
    }

  private:
    std::mt19937 m_engine;
};

// Directions of cosine z and azimuth phi, eight at once.
inline V8 direction(F8 z, F8 turn) {
    F8 s, c;
    sincos_2pi(turn, s, c);
    const F8 r = sqrt(max(F8(1.0f) - z * z, F8(0.0f)));
    return {r * c, r * s, z};
}

// Integral over [z0, z1] x [t0, t1] (cosine, azimuth in turns) of f over solid angle, halved until parts
// agree.
inline double integrate(const std::function<F8(const V8&)>& f, double z0, double z1, double t0, double t1,
                        double tolerance, int depth = 0) {
    const auto gauss = [&](double za, double zb, double ta, double tb) {
        constexpr float Node[4] = {-0.861136312f, -0.339981044f, 0.339981044f, 0.861136312f};
        constexpr double Weight[4] = {0.347854845, 0.652145155, 0.652145155, 0.347854845};
        double sum = 0;
        for (int half = 0; half < 2; half++) {
            F8 z, t;
            for (int k = 0; k < 8; k++) {
                z.v[k] = float(0.5 * (za + zb) + 0.5 * (zb - za) * Node[2 * half + k / 4]);
                t.v[k] = float(0.5 * (ta + tb) + 0.5 * (tb - ta) * Node[k % 4]);
            }
            const F8 v = f(direction(z, t));
            for (int k = 0; k < 8; k++)
                sum += Weight[2 * half + k / 4] * Weight[k % 4] * double(v[k]);
        }
        return sum * 0.25 * (zb - za) * (tb - ta) * 6.283185307179586;
    };
    const double zm = 0.5 * (z0 + z1), tm = 0.5 * (t0 + t1), whole = gauss(z0, z1, t0, t1);
    const double parts =
        gauss(z0, zm, t0, tm) + gauss(zm, z1, t0, tm) + gauss(z0, zm, tm, t1) + gauss(zm, z1, tm, t1);
    if (std::abs(whole - parts) <= tolerance || depth >= 14)
        return parts;
    const double t = tolerance * 0.5;
    return integrate(f, z0, zm, t0, tm, t, depth + 1) + integrate(f, zm, z1, t0, tm, t, depth + 1) +
           integrate(f, z0, zm, tm, t1, t, depth + 1) + integrate(f, zm, z1, tm, t1, t, depth + 1);
}

// The same over each cell of a grid of the sphere, rings of equal area from -z up, and sectors.
inline constexpr int Rings = 20, Sectors = 24;
inline std::vector<double> integrate_cells(const std::function<F8(const V8&)>& f) {
    std::vector<double> cells;
    for (int ring = 0; ring < Rings; ring++)
        for (int sector = 0; sector < Sectors; sector++)
            cells.push_back(integrate(f, 2.0 * ring / Rings - 1, 2.0 * (ring + 1) / Rings - 1,
                                      double(sector) / Sectors, double(sector + 1) / Sectors, 1e-6));
    return cells;
}

} // namespace kanuka::bsdf::testing
