// A material at a hit: the layering program run over decoded inputs. Mix, over and coat depend on the view
// direction alone, so the tree reduces to one weight a lobe; the material is then a weighted sum of lobes,
// sampled as a mixture.
#pragma once

#include <algorithm>

#include "bsdf/material_code.h"

namespace kanuka::bsdf {

// Fetch: color(place) -> Spectrum, number(place) -> Float, weight and inputs of this hit; see
// transport/fetch.h.
template <int W>
class Material {
  public:
    // `outside`: wo is on the outside of the surface. l: normalised wavelengths; outer: index of refraction
    // of what is outside, null = 1. normals: of the lobes that have their own, by leaf, in the frame of wo;
    // null = nobody has. All must outlive the material.
    template <class Fetch>
    Material(const MaterialCode& code, const Fetch& fetch, Mask<W> outside, const Vec3<Float<W>>& wo,
             const Float<W> l[Wavelengths], const Float<W>* outer = nullptr,
             const Vec3<Float<W>>* normals = nullptr)
        : m_code(code), m_turned(normals ? code.turned : 0) {
        if (code.leaves == 0) { // boundaries of media alone may have none
            m_black = Mask<W>(true);
            return;
        }
        for (uint32_t bits = m_turned; bits; bits &= bits - 1)
            m_turn[__builtin_ctz(bits)] = Turn<W>(normals[__builtin_ctz(bits)]);
        for (size_t i = 0; i < code.nodes.size(); i++) {
            const MaterialCode::Node& n = code.nodes[i];
            m_node_weight[i] = n.weight.word < 0 ? Float<W>(1.0f) : fetch.number(n.weight);
            if (n.leaf >= 0) {
                decode(n, fetch);
                m_lobe[n.leaf] = n.lobe;
                if (n.lobe != LobeId::LambertBrdf && code.beds.empty())
                    prepare_lobe(n.lobe, m_inputs[n.leaf], view_of(n.leaf, wo), outside, l, outer);
            }
        }
        if (!code.beds.empty())
            enter_layers(wo, outside, l, outer);
        if (code.has_coat)
            upward_albedo(wo);
        downward_weights(int(code.nodes.size()) - 1, m_weight);
        if (code.absorbs)
            absorb(wo);
        if (!code.beds.empty())
            give_back(wo);
        Float<W> total(0.0f);
        for (size_t i = 0; i < code.nodes.size(); i++) {
            const int leaf = code.nodes[i].leaf;
            if (leaf < 0)
                continue;
            Spectrum<W> albedo =
                m_weight[leaf] * (code.bed_of_leaf[leaf] >= 0 ? m_seen[leaf] : albedo_of(leaf, wo));
            if (code.absorbs) // on the way in at 45 degrees, about the mean
                albedo *= crossing(leaf, Float<W>(0.7f));
            m_albedo += albedo;
            total += m_share[leaf] = max(mean(albedo), Float<W>(0.0f));
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
            LobeValue<W> v = eval_leaf(0, wo, wi);
            v.f *= m_weight[0];
            return v;
        }
        if (!m_code.beds.empty())
            return eval_layered(wo, wi, ~0u);
        LobeValue<W> sum{Spectrum<W>(Float<W>(0.0f)), Spectrum<W>(Float<W>(0.0f))};
        for (int k = 0; k < m_code.leaves; k++) {
            const LobeValue<W> v = eval_leaf(k, wo, wi);
            sum.f += m_code.absorbs ? v.f * m_weight[k] * way_in(k, wi) : v.f * m_weight[k];
            sum.pdf += v.pdf * m_share[k];
        }
        return sum;
    }

    // The part that some lobes have of eval(); `leaves`: bits.
    [[gnu::noinline]] Spectrum<W> eval_some(uint32_t leaves, const Vec3<Float<W>>& wo,
                                            const Vec3<Float<W>>& wi) const {
        const uint32_t all = (1u << m_code.leaves) - 1;
        Spectrum<W> sum(Float<W>(0.0f));
        if ((leaves & all) == 0)
            return sum;
        if ((leaves & all) == all)
            return eval(wo, wi).f;
        if (!m_code.beds.empty())
            return eval_layered(wo, wi, leaves).f;
        for (int k = 0; k < m_code.leaves; k++)
            if (leaves >> k & 1) {
                const Spectrum<W> f = eval_leaf(k, wo, wi).f * m_weight[k];
                sum += m_code.absorbs ? f * way_in(k, wi) : f;
            }
        return sum;
    }

    // One-sample mixture. `value` is complete for every valid lane: delta lanes hold the chosen lobe's,
    // others the sum.
    LobeSample<W> sample(const Vec3<Float<W>>& wo, Float<W> u_lobe, Float<W> u0, Float<W> u1) const {
        LobeSample<W> s;
        if (m_code.leaves == 1) {
            s = sample_leaf(0, wo, u_lobe, u0, u1);
            const LobeValue<W> v = eval_leaf(0, wo, s.wi);
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
                const LobeSample<W> one = m_code.bed_of_leaf[k] >= 0 ? sample_below(k, again, u0, u1)
                                                                     : sample_leaf(k, wo, again, u0, u1);
                s.wi = kanuka::select(chosen, one.wi, s.wi);
                s.valid |= chosen & one.valid;
                s.delta |= chosen & one.delta;
                s.leaf = kanuka::select(chosen, Int<W>(k), s.leaf);
                Spectrum<W> f = one.value.f * m_weight[k];
                if (m_code.absorbs)
                    f *= way_in(k, one.wi);
                s.value.f = select(chosen & one.delta, f, s.value.f);
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

    // What goes on as it came, through smooth thin walls: how much, and the chance of it in sample().
    LobeValue<W> straight(const Vec3<Float<W>>& wo) const {
        LobeValue<W> sum = no_value<W>();
        for (int k = 0; k < m_code.leaves; k++) {
            if (!(m_code.straight >> k & 1))
                continue;
            const LobeValue<W> v = ThinWallLobe<W>::straight(m_inputs[k], wo);
            sum.f += v.f * m_weight[k];
            sum.pdf += v.pdf * m_share[k];
        }
        return {select(m_black, no_value<W>().f, sum.f), select(m_black, no_value<W>().f, sum.pdf)};
    }
    Mask<W> goes_straight(const LobeSample<W>& s) const {
        return s.valid & s.delta & (s.wi.z < Float<W>(0.0f)) &
               ((Int<W>(int(m_code.straight)) & (Int<W>(1) << s.leaf)) != Int<W>(0));
    }

  private:
    template <class Fetch>
    void decode(const MaterialCode::Node& n, const Fetch& fetch) {
        LobeInputs<W>& in = m_inputs[n.leaf];
        in.given = n.given;
        int color = 0, number = 0;
        for (int i = 0; i < n.input_count; i++)
            if (n.colors >> i & 1)
                in.color[color++] = fetch.color(n.inputs[i]);
            else if (n.numbers >> i & 1 &&
                     n.lobe != LobeId::AimedBsdf) // directions are SurfaceHit's: aim(), lobe_normals()
                in.number[number++] = fetch.number(n.inputs[i]);
    }

    // ---- lobes in their own frames: own_normal.h
    Vec3<Float<W>> view_of(int leaf, const Vec3<Float<W>>& wo) const {
        return m_turned >> leaf & 1 ? m_turn[leaf].seen(wo) : wo;
    }
    Vec3<Float<W>> normal_of(int leaf) const {
        return m_turned >> leaf & 1 ? m_turn[leaf].n
                                    : Vec3<Float<W>>(Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f));
    }
    Spectrum<W> albedo_of(int leaf, const Vec3<Float<W>>& wo) const {
        return albedo_of_lobe(m_lobe[leaf], m_inputs[leaf], view_of(leaf, wo));
    }
    LobeValue<W> eval_leaf(int leaf, const Vec3<Float<W>>& wo, const Vec3<Float<W>>& wi) const {
        return m_turned >> leaf & 1 ? eval_turned(leaf, wo, wi)
                                    : eval_lobe(m_lobe[leaf], m_inputs[leaf], wo, wi);
    }
    [[gnu::noinline]] LobeValue<W> eval_turned(int leaf, const Vec3<Float<W>>& wo,
                                               const Vec3<Float<W>>& wi) const {
        const Turn<W>& turn = m_turn[leaf];
        const Vec3<Float<W>> view = turn.seen(wo);
        const auto value = [&](const Vec3<Float<W>>& w) {
            return eval_lobe(m_lobe[leaf], m_inputs[leaf], view, turn.to(w));
        };
        const LobeValue<W> own = value(wi), image = value(mirrored_at_horizon(wi)), none = no_value<W>();
        const Mask<W> reflects = wi.z > Float<W>(0.0f);
        return {select(reflects, own.f + image.f, none.f), select(reflects, own.pdf + image.pdf, none.pdf)};
    }
    LobeSample<W> sample_leaf(int leaf, const Vec3<Float<W>>& wo, Float<W> u_lobe, Float<W> u0,
                              Float<W> u1) const {
        LobeSample<W> s = sample_lobe(m_lobe[leaf], m_inputs[leaf], view_of(leaf, wo), u_lobe, u0, u1);
        if (m_turned >> leaf & 1) {
            s.wi = m_turn[leaf].from(s.wi);
            s.wi.z = abs(s.wi.z);
        }
        return s;
    }

    void upward_albedo(const Vec3<Float<W>>& wo) {
        const Float<W> one(1.0f);
        for (size_t i = 0; i < m_code.nodes.size(); i++) {
            const MaterialCode::Node& n = m_code.nodes[i];
            if (!n.need_albedo)
                continue;
            const Float<W> w = m_node_weight[i];
            switch (n.op) {
            case grid::LayerOp::Lobe:
                m_node_albedo[i] =
                    n.leaf < 0 ? Spectrum<W>(Float<W>(0.0f)) : albedo_of(n.leaf, seen_from(n.bed, wo)) * w;
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
            case grid::LayerOp::Thick:
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
        case grid::LayerOp::Thick:
            c = coverage(n.upper) * w + coverage(n.lower) * (one - w * coverage(n.upper));
            break;
        default:
            c = coverage(n.upper) + coverage(n.lower);
            break;
        }
        return min(c, one);
    }

    // Weights of the lobes below a node.
    void downward_weights(int root, Spectrum<W> of_leaf[MaxLobes]) const {
        Spectrum<W> weight[MaxNodes];
        const Float<W> one(1.0f);
        weight[root] = Spectrum<W>(one);
        uint32_t reached = 1u << root;
        for (int i = root; i >= 0; i--) {
            if (!(reached >> i & 1))
                continue;
            const MaterialCode::Node& n = m_code.nodes[size_t(i)];
            const Float<W> w = m_node_weight[i];
            if (n.op != grid::LayerOp::Lobe)
                reached |= 1u << n.upper | 1u << n.lower;
            switch (n.op) {
            case grid::LayerOp::Lobe:
                if (n.leaf >= 0)
                    of_leaf[n.leaf] = weight[i] * w;
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
            case grid::LayerOp::Thick:
                weight[n.upper] = weight[i] * w;
                weight[n.lower] = weight[i] * remaining(m_node_albedo[n.upper], w);
                break;
            case grid::LayerOp::Add:
                weight[n.upper] = weight[n.lower] = weight[i];
                break;
            }
        }
    }

    // Coats that absorb: light crosses the layer along refracted directions, from wo's side and from wi's, so
    // that the way down counts 1 / cos (Beer and Lambert). What a leaf's light loses: its depth is the sum of
    // the coats' above it, log2, and bends by the index of the uppermost.
    void absorb(const Vec3<Float<W>>& wo) {
        const Float<W> one(1.0f);
        Spectrum<W> depth[MaxNodes];
        Float<W> index[MaxNodes];
        const int root = int(m_code.nodes.size()) - 1;
        depth[root] = Spectrum<W>(Float<W>(0.0f));
        index[root] = one;
        for (int i = root; i >= 0; i--) {
            const MaterialCode::Node& n = m_code.nodes[size_t(i)];
            if (n.op == grid::LayerOp::Lobe) {
                if (n.leaf < 0)
                    continue;
                m_depth[n.leaf] = depth[i];
                m_index[n.leaf] = index[i];
                const Spectrum<W> out = crossing(n.leaf, wo.z);
                m_weight[n.leaf] *= out;
                continue;
            }
            for (int child : {n.upper, n.lower})
                depth[child] = depth[i], index[child] = index[i];
            if (n.absorber < 0)
                continue;
            const LobeInputs<W>& coat = m_inputs[n.absorber];
            depth[n.lower] = depth[i] + depth_of(coat, m_node_weight[i]);
            index[n.lower] = max(index[i], coat.eta[0]);
        }
    }
    // -log2 of what a straight way through a layer leaves; one of weight w lets 1 - w (1 - T) through.
    static Spectrum<W> depth_of(const LobeInputs<W>& coat, Float<W> w) {
        constexpr LobeId Coat = MaterialCode::Coat;
        const Float<W> one(1.0f);
        Spectrum<W> depth;
        for (int k = 0; k < Wavelengths; k++) {
            Float<W> T = coat.color[color_of(Coat, "transmittance")][k];
            if (coat.has(input_of(Coat, "absorption"))) // 1 / ln 2
                T = T * exp2(-(coat.color[color_of(Coat, "absorption")][k] *
                               coat.number[number_of(Coat, "thickness")] * Float<W>(1.44269504f)));
            depth[k] = -log2(clamp(fma(w, T - one, one), Float<W>(1e-6f), one));
        }
        return depth;
    }
    Spectrum<W> crossing(int leaf, Float<W> cosine) const {
        const Float<W> one(1.0f), sine2 = max(one - cosine * cosine, Float<W>(0.0f));
        const Float<W> cos_t = sqrt(max(one - sine2 / (m_index[leaf] * m_index[leaf]), Float<W>(1e-4f)));
        Spectrum<W> t;
        for (int k = 0; k < Wavelengths; k++)
            t[k] = exp2(-(m_depth[leaf][k] / cos_t));
        return t;
    }
    Spectrum<W> way_in(int leaf, const Vec3<Float<W>>& wi) const { // what leaves below crosses no coat again
        return select(wi.z > Float<W>(0.0f), crossing(leaf, wi.z), Spectrum<W>(Float<W>(1.0f)));
    }

    // ---- thick coats: material_layers.h
    const Vec3<Float<W>>& seen_from(int bed, const Vec3<Float<W>>& wo) const {
        return bed < 0 ? wo : m_layer[bed].wo;
    }
    void enter_layers(const Vec3<Float<W>>& wo, Mask<W> outside, const Float<W> l[Wavelengths],
                      const Float<W>* outer);
    void give_back(const Vec3<Float<W>>& wo);
    Float<W> escape_by_directions(const MaterialCode::Node& n, int coat) const;
    LobeValue<W> eval_layered(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& wi, uint32_t leaves) const;
    LobeSample<W> sample_below(int leaf, Float<W> u_lobe, Float<W> u0, Float<W> u1) const;

    const MaterialCode& m_code;
    uint32_t m_turned; // bits by leaf: those of
    Turn<W> m_turn[MaxLobes];
    Spectrum<W> m_depth[MaxLobes]; // of materials that absorb
    Float<W> m_index[MaxLobes];
    ThickLayer<W> m_layer[MaxThickCoats]; // of materials with thick coats
    Spectrum<W> m_seen[MaxLobes];         // below them: albedo, of what gets out
    Float<W> m_above[MaxLobes];           // part of the samples that drawn_above() says
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

#include "bsdf/material_layers.h"
