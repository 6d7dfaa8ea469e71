// For tests: materials of several lobes and layers, and how much light they scatter.
#pragma once

#include <gtest/gtest.h>

#include "base/test_statistics.h"
#include "bsdf/material.h"
#include "bsdf/test_lobes.h"

namespace kanuka::bsdf::testing {

using grid::LayeringProgram;
using grid::LayerOp;
using kanuka::testing::RunningMean;

// A program whose every slot has one value.
class Tree {
  public:
    LayeringProgram program;
    std::vector<Vec3f> values;

    // Inputs in schema order.
    int lobe(LobeId id, std::vector<Vec3f> inputs, float weight = 1) {
        grid::LayerNode n;
        n.lobe = id;
        n.weight = slot(grid::InputType::Float, {weight, 0, 0});
        const auto& decl = grid::lobe(id);
        for (size_t i = 0; i < inputs.size(); i++)
            n.inputs.push_back(slot(decl.inputs[i].type, inputs[i]));
        return push(n);
    }
    int join(LayerOp op, int upper, int lower, float weight = 1) {
        grid::LayerNode n;
        n.op = op;
        n.upper = upper;
        n.lower = lower;
        n.weight = slot(grid::InputType::Float, {weight, 0, 0});
        return push(n);
    }

  private:
    int slot(grid::InputType type, Vec3f v) {
        program.slots.push_back({type, grid::Storage::Half, 0, 1, true, ""});
        values.push_back(v);
        return int(program.slots.size()) - 1;
    }
    int push(grid::LayerNode n) {
        program.nodes.push_back(n);
        return int(program.nodes.size()) - 1;
    }
};

// Reads a tree's values; colours are spectra of three steps and their mean.
template <int W>
struct TreeFetch {
    const Tree& tree;
    const grid::WordLayout layout;

    explicit TreeFetch(const Tree& tree) : tree(tree), layout(tree.program) {}
    Vec3f value(const MaterialCode::Place& p) const {
        return p.word < 0 ? p.fallback
                          : tree.values[size_t(layout.slots_of_word[size_t(p.word)][size_t(p.half)])];
    }
    Spectrum<W> color(const MaterialCode::Place& p) const {
        const Vec3f v = value(p);
        Spectrum<W> s;
        s[0] = Float<W>(v.x), s[1] = Float<W>(v.y), s[2] = Float<W>(v.z),
        s[3] = Float<W>((v.x + v.y + v.z) / 3);
        return s;
    }
    Float<W> number(const MaterialCode::Place& p) const { return Float<W>(value(p).x); }
};

template <int W>
void wavelengths(Float<W> l[Wavelengths]) {
    for (int k = 0; k < Wavelengths; k++)
        l[k] = Float<W>(0.2f + 0.2f * float(k));
}

template <int W>
Vec3<Float<W>> seen_from(float cosine) {
    return LobeCase{LobeId::LambertBrdf, {}, cosine}.wo<W>();
}

struct Energy {
    double mean[Wavelengths], error;
    Spectrum<8> albedo;
};

inline Energy scattered(const Tree& tree, float cosine, bool outside = true, int count = 6000) {
    const MaterialCode code(tree.program);
    F8 l[Wavelengths];
    wavelengths<8>(l);
    const Material<8> material(code, TreeFetch<8>(tree), Mask<8>(outside), seen_from<8>(cosine), l);
    const V8 wo = seen_from<8>(cosine);
    Uniform u(17);
    RunningMean mean[Wavelengths];
    for (int i = 0; i < count; i++) {
        const auto s = material.sample(wo, u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
        for (int k = 0; k < 8; k++)
            for (int w = 0; w < Wavelengths; w++)
                mean[w].add(s.valid[k] && s.value.pdf[0][k] > 0 ? double(s.value.f[w][k] / s.value.pdf[0][k])
                                                                : 0.0);
    }
    Energy e;
    e.error = 0;
    for (int w = 0; w < Wavelengths; w++) {
        e.mean[w] = mean[w].mean();
        e.error = std::max(e.error, mean[w].error());
    }
    e.albedo = material.albedo();
    return e;
}

inline void expect_energy(const Tree& tree, float cosine, double expected, const char* what,
                          double slack = 1e-5) {
    const Energy e = scattered(tree, cosine);
    for (int w = 0; w < Wavelengths; w++) {
        EXPECT_NEAR(e.mean[w], expected, 4.5 * e.error + slack) << what << " at cosine " << cosine;
        EXPECT_NEAR(e.albedo[w][0], expected, slack) << what << " at cosine " << cosine;
    }
}

inline const Vec3f White(1, 1, 1), Half(0.5f, 0.5f, 0.5f);
inline const float Cosines[] = {1.0f, 0.7f, 0.3f, 0.1f};

inline int white_lambert(Tree& t, float weight = 1) {
    return t.lobe(LobeId::LambertBrdf, {White}, weight);
}
inline int white_mirror(Tree& t, float weight = 1) {
    return t.lobe(LobeId::MicrofacetConductorBrdf, {White, White, Vec3f(0.0f)}, weight);
}
inline int glass(Tree& t, float roughness, float weight = 1) {
    return t.lobe(LobeId::MicrosurfaceDielectricBsdfRgb_v1, {Vec3f(roughness), White, White, Vec3f(1.5f)},
                  weight);
}
inline int varnish(Tree& t, float roughness, float weight = 1) {
    return t.lobe(LobeId::MicrofacetDielectricBrdf, {White, Vec3f(1.5f), Vec3f(roughness)}, weight);
}

} // namespace kanuka::bsdf::testing
