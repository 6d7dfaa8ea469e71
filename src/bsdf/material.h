// A material at a hit: the layering program run over decoded inputs. Mix, over and coat depend on the view
// direction alone, so the tree reduces to one weight a lobe; the material is then a weighted sum of lobes,
// sampled as a mixture.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "bsdf/lobes.h"
#include "grid/word_layout.h"

namespace kanuka::bsdf {

inline constexpr int MaxNodes = 32, MaxLobes = 16, MaxInputs = 6;

// The layering program, flattened for lanes. Host data, one per program, read by every hit.
struct MaterialCode {
    struct Place {
        int word = -1, half = 0; // -1: not given, `fallback` holds
        Vec3f fallback{0, 0, 0};
    };
    struct Node {
        grid::LayerOp op;
        LobeId lobe;
        int upper, lower;
        int leaf = -1; // number of the lobe among those that scatter; -1 for operators and emission
        Place weight;
        Place inputs[MaxInputs];
        bool need_albedo = false; // below the upper side of a coat
    };
    struct Aov {
        int channel; // the first of its values among all
        int components;
        Place places[3];
    };
    std::vector<Node> nodes; // post-order
    Place filter, glow;      // of the atmosphere; word -1 = there is none
    std::vector<Aov> aovs;
    int leaves = 0;
    int words = 0; // of a vertex record; the normal's table entry follows
    bool dispersive = false, transmits = false, has_coat = false;

    explicit MaterialCode(const grid::LayeringProgram& program) {
        const grid::WordLayout layout(program);
        words = int(layout.words.size());
        const auto place = [&](int slot, Vec3f fallback) {
            Place p;
            p.fallback = fallback;
            if (slot >= 0)
                p.word = layout.places[size_t(slot)].word, p.half = layout.places[size_t(slot)].half;
            return p;
        };
        for (const grid::LayerNode& n : program.nodes) {
            Node node{n.op, n.lobe, n.upper, n.lower};
            node.weight = place(n.weight, Vec3f(1, 1, 1));
            if (n.op == grid::LayerOp::Lobe) {
                const grid::LobeDecl& decl = grid::lobe(n.lobe);
                for (size_t i = 0; i < decl.inputs.size(); i++)
                    node.inputs[i] = place(i < n.inputs.size() ? n.inputs[i] : -1, decl.inputs[i].fallback);
                const bool scatters =
                    decl.kind != grid::LobeKind::Emission && decl.kind != grid::LobeKind::Phase;
                node.leaf = scatters ? leaves++ : -1;
                if (n.lobe == LobeId::MicrosurfaceDielectricBsdfRgb_v1) {
                    transmits = true;
                    dispersive |= node.inputs[4].word >= 0;
                }
                transmits |= decl.kind == grid::LobeKind::Transmission;
            }
            has_coat |= n.op == grid::LayerOp::Coat;
            nodes.push_back(node);
        }
        filter = place(program.atmosphere.filter, Vec3f(1, 1, 1));
        glow = place(program.atmosphere.glow, Vec3f(0, 0, 0));
        for (const grid::Aov& a : program.aovs) {
            Aov aov{3 * a.index, a.components, {}};
            for (int c = 0; c < a.components; c++)
                aov.places[c] = place(a.slots[size_t(c)], Vec3f(0, 0, 0));
            aovs.push_back(aov);
        }
        if (nodes.size() > size_t(MaxNodes) || leaves > MaxLobes)
            throw std::length_error("a material has more than 16 lobes or 32 nodes");
        for (const Node& n : nodes)
            if (n.op == grid::LayerOp::Coat)
                mark_albedo(n.upper);
    }

  private:
    void mark_albedo(int node) {
        Node& n = nodes[size_t(node)];
        n.need_albedo = true;
        if (n.op != grid::LayerOp::Lobe) {
            mark_albedo(n.upper);
            mark_albedo(n.lower);
        }
    }
};

// Indices of refraction at the hero wavelengths: Cauchy's n = A + B / lambda^2 through n_d and the Abbe
// number V_d = (n_d - 1) / (n_F - n_C), Fraunhofer lines d 587.6, F 486.1, C 656.3 nm.
template <int W>
Spectrum<W> index_of_refraction(Float<W> n_d, Float<W> abbe, const Float<W> l[Wavelengths]) {
    constexpr float InvD2 = 1 / (587.56f * 587.56f), InvF2 = 1 / (486.13f * 486.13f),
                    InvC2 = 1 / (656.28f * 656.28f);
    const Mask<W> disperses = abbe > Float<W>(0.0f);
    const Float<W> B = kanuka::select(
        disperses, (n_d - Float<W>(1.0f)) / (max(abbe, Float<W>(1.0f)) * Float<W>(InvF2 - InvC2)),
        Float<W>(0.0f));
    Spectrum<W> n;
    for (int i = 0; i < Wavelengths; i++) {
        const Float<W> lambda = fma(l[i], Float<W>(470.0f), Float<W>(360.0f));
        n[i] = fma(B, Float<W>(1.0f) / (lambda * lambda) - Float<W>(InvD2), n_d);
    }
    return n;
}

// Fetch: color(place) -> Spectrum, number(place) -> Float, weight and inputs of this hit; see
// transport/fetch.h.
template <int W>
class Material {
  public:
    // `outside`: wo is on the outside of the surface. l: normalised wavelengths. cos_o: wo . N.
    template <class Fetch>
    Material(const MaterialCode& code, const Fetch& fetch, Mask<W> outside, Float<W> cos_o,
             const Float<W> l[Wavelengths])
        : m_code(code) {
        for (size_t i = 0; i < code.nodes.size(); i++) {
            const MaterialCode::Node& n = code.nodes[i];
            m_node_weight[i] = n.weight.word < 0 ? Float<W>(1.0f) : fetch.number(n.weight);
            if (n.leaf >= 0)
                decode(n, fetch, outside, l);
        }
        if (code.has_coat)
            upward_albedo(cos_o);
        downward_weights();
        Float<W> total(0.0f);
        for (size_t i = 0; i < code.nodes.size(); i++) {
            const int leaf = code.nodes[i].leaf;
            if (leaf < 0)
                continue;
            const Spectrum<W> albedo =
                m_weight[leaf] * albedo_of_lobe(code.nodes[i].lobe, m_inputs[leaf], cos_o);
            m_albedo += albedo;
            total += m_share[leaf] = max(mean(albedo), Float<W>(0.0f));
            m_lobe[leaf] = code.nodes[i].lobe;
        }
        const Float<W> inv = Float<W>(1.0f) / max(total, Float<W>(1e-20f));
        for (int k = 0; k < code.leaves; k++)
            m_share[k] = m_share[k] * inv;
        m_black = total <= Float<W>(1e-20f);
    }

    // Total scattered fraction, all lobes; black materials need no sampling.
    const Spectrum<W>& albedo() const { return m_albedo; }
    Mask<W> black() const { return m_black; }

    LobeValue<W> eval(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& wi) const {
        if (m_code.leaves == 1) {
            LobeValue<W> v = eval_lobe(m_lobe[0], m_inputs[0], wo, wi);
            v.f *= m_weight[0];
            return v;
        }
        LobeValue<W> sum{Spectrum<W>(Float<W>(0.0f)), Spectrum<W>(Float<W>(0.0f))};
        for (int k = 0; k < m_code.leaves; k++) {
            const LobeValue<W> v = eval_lobe(m_lobe[k], m_inputs[k], wo, wi);
            sum.f += v.f * m_weight[k];
            sum.pdf += v.pdf * m_share[k];
        }
        return sum;
    }

    // One-sample mixture. `value` is complete for every valid lane: delta lanes hold the chosen lobe's,
    // others the sum.
    LobeSample<W> sample(const Vec3<Float<W>>& wo, Float<W> u_lobe, Float<W> u0, Float<W> u1) const {
        LobeSample<W> s;
        if (m_code.leaves == 1) {
            s = sample_lobe(m_lobe[0], m_inputs[0], wo, u_lobe, u0, u1);
            const LobeValue<W> v = eval_lobe(m_lobe[0], m_inputs[0], wo, s.wi);
            s.value.f = select(s.delta, s.value.f, v.f) * m_weight[0];
            s.value.pdf = select(s.delta, s.value.pdf, v.pdf);
            s.valid &= !m_black;
            return s;
        }
        s.wi = {Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f)};
        s.valid = s.delta = Mask<W>(false);
        s.value = {Spectrum<W>(Float<W>(0.0f)), Spectrum<W>(Float<W>(0.0f))};
        Float<W> from(0.0f);
        Mask<W> open(true);
        for (int k = 0; k < m_code.leaves; k++) {
            const Float<W> to = from + m_share[k];
            const Mask<W> chosen =
                open & (m_share[k] > Float<W>(0.0f)) & ((u_lobe < to) | Mask<W>(k == m_code.leaves - 1));
            if (any(chosen)) {
                const Float<W> again = clamp((u_lobe - from) / max(m_share[k], Float<W>(1e-12f)),
                                             Float<W>(0.0f), Float<W>(0.99999994f));
                const LobeSample<W> one = sample_lobe(m_lobe[k], m_inputs[k], wo, again, u0, u1);
                s.wi = kanuka::select(chosen, one.wi, s.wi);
                s.valid |= chosen & one.valid;
                s.delta |= chosen & one.delta;
                s.value.f = select(chosen & one.delta, one.value.f * m_weight[k], s.value.f);
                s.value.pdf = select(chosen & one.delta, one.value.pdf * m_share[k], s.value.pdf);
            }
            open &= !chosen;
            from = to;
        }
        const LobeValue<W> all_lobes = eval(wo, s.wi);
        s.value.f = select(s.delta, s.value.f, all_lobes.f);
        s.value.pdf = select(s.delta, s.value.pdf, all_lobes.pdf);
        s.valid &= !m_black;
        return s;
    }

  private:
    template <class Fetch>
    void decode(const MaterialCode::Node& n, const Fetch& fetch, Mask<W> outside,
                const Float<W> l[Wavelengths]) {
        LobeInputs<W>& in = m_inputs[n.leaf];
        switch (n.lobe) {
        case LobeId::LambertBrdf:
        case LobeId::LambertBtdf:
            in.a = fetch.color(n.inputs[0]);
            break;
        case LobeId::MicrofacetConductorBrdf: {
            in.a = fetch.color(n.inputs[0]);
            in.b = fetch.color(n.inputs[1]);
            const Float<W> r = fetch.number(n.inputs[2]);
            in.alpha = r * r;
            break;
        }
        case LobeId::MicrofacetDielectricBrdf: {
            in.a = fetch.color(n.inputs[0]);
            in.eta = Spectrum<W>(max(fetch.number(n.inputs[1]), Float<W>(1.0001f)));
            const Float<W> r = fetch.number(n.inputs[2]);
            in.alpha = r * r;
            break;
        }
        case LobeId::MicrosurfaceDielectricBsdfRgb_v1: {
            const Float<W> r = fetch.mean_color(n.inputs[0]);
            in.alpha = r * r;
            in.a = fetch.color(n.inputs[1]);
            in.b = fetch.color(n.inputs[2]);
            in.dispersive = n.inputs[4].word >= 0;
            const Float<W> n_d = max(fetch.number(n.inputs[3]), Float<W>(1.0001f));
            const Spectrum<W> index =
                in.dispersive ? index_of_refraction(n_d, fetch.number(n.inputs[4]), l) : Spectrum<W>(n_d);
            for (int i = 0; i < Wavelengths; i++)
                in.eta[i] = kanuka::select(outside, index[i], Float<W>(1.0f) / index[i]);
            break;
        }
        default:
            break;
        }
    }

    void upward_albedo(Float<W> cos_o) {
        const Float<W> one(1.0f);
        for (size_t i = 0; i < m_code.nodes.size(); i++) {
            const MaterialCode::Node& n = m_code.nodes[i];
            if (!n.need_albedo)
                continue;
            const Float<W> w = m_node_weight[i];
            switch (n.op) {
            case grid::LayerOp::Lobe:
                m_node_albedo[i] = n.leaf < 0 ? Spectrum<W>(Float<W>(0.0f))
                                              : albedo_of_lobe(n.lobe, m_inputs[n.leaf], cos_o) * w;
                break;
            case grid::LayerOp::Mix:
                m_node_albedo[i] = m_node_albedo[n.upper] * w + m_node_albedo[n.lower] * (one - w);
                break;
            case grid::LayerOp::Add:
                m_node_albedo[i] = m_node_albedo[n.upper] + m_node_albedo[n.lower];
                break;
            case grid::LayerOp::Over:
                m_node_albedo[i] =
                    m_node_albedo[n.upper] * w + m_node_albedo[n.lower] * (one - w * coverage(n.upper));
                break;
            case grid::LayerOp::Coat:
                m_node_albedo[i] = m_node_albedo[n.upper] * w +
                                   m_node_albedo[n.lower] * remaining(m_node_albedo[n.upper], w);
                break;
            }
        }
    }

    static Spectrum<W> remaining(const Spectrum<W>& albedo, Float<W> w) {
        Spectrum<W> r;
        for (int k = 0; k < Wavelengths; k++)
            r[k] = clamp(Float<W>(1.0f) - w * albedo[k], Float<W>(0.0f), Float<W>(1.0f));
        return r;
    }

    // How much of what lies below a subtree covers: the sum of its lobes' weights.
    Float<W> coverage(int node) const {
        const MaterialCode::Node& n = m_code.nodes[size_t(node)];
        const Float<W> w = m_node_weight[node], one(1.0f);
        Float<W> c;
        switch (n.op) {
        case grid::LayerOp::Lobe:
            c = w;
            break;
        case grid::LayerOp::Mix:
            c = coverage(n.upper) * w + coverage(n.lower) * (one - w);
            break;
        case grid::LayerOp::Over:
        case grid::LayerOp::Coat:
            c = coverage(n.upper) * w + coverage(n.lower) * (one - w * coverage(n.upper));
            break;
        default:
            c = coverage(n.upper) + coverage(n.lower);
            break;
        }
        return min(c, one);
    }

    void downward_weights() {
        Spectrum<W> weight[MaxNodes];
        const int root = int(m_code.nodes.size()) - 1;
        const Float<W> one(1.0f);
        weight[root] = Spectrum<W>(one);
        for (int i = root; i >= 0; i--) {
            const MaterialCode::Node& n = m_code.nodes[size_t(i)];
            const Float<W> w = m_node_weight[i];
            switch (n.op) {
            case grid::LayerOp::Lobe:
                if (n.leaf >= 0)
                    m_weight[n.leaf] = weight[i] * w;
                break;
            case grid::LayerOp::Mix:
                weight[n.upper] = weight[i] * w;
                weight[n.lower] = weight[i] * (one - w);
                break;
            case grid::LayerOp::Over:
                weight[n.upper] = weight[i] * w;
                weight[n.lower] = weight[i] * (one - w * coverage(n.upper));
                break;
            case grid::LayerOp::Coat:
                weight[n.upper] = weight[i] * w;
                weight[n.lower] = weight[i] * remaining(m_node_albedo[n.upper], w);
                break;
            case grid::LayerOp::Add:
                weight[n.upper] = weight[n.lower] = weight[i];
                break;
            }
        }
    }

    const MaterialCode& m_code;
    Float<W> m_node_weight[MaxNodes];
    Spectrum<W> m_node_albedo[MaxNodes];
    LobeInputs<W> m_inputs[MaxLobes];
    Spectrum<W> m_weight[MaxLobes];
    Float<W> m_share[MaxLobes];
    LobeId m_lobe[MaxLobes];
    Spectrum<W> m_albedo{Float<W>(0.0f)};
    Mask<W> m_black;
};

} // namespace kanuka::bsdf
