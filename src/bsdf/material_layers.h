// The part of a material that has thick coats: see thick_coat.h. Beds are what lies below them, outer ones
// first. Included by material.h, at its end.
#pragma once

namespace kanuka::bsdf {

// Directions in the layers, and lobes made ready for them.
template <int W>
[[gnu::noinline]] void Material<W>::enter_layers(const Vec3<Float<W>>& wo, Mask<W> outside,
                                                 const Float<W> l[Wavelengths], const Float<W>* outer) {
    const Float<W> one(1.0f);
    uint32_t ready = 0; // bits by leaf
    for (size_t b = 0; b < m_code.beds.size(); b++) {
        const MaterialCode::Bed& bed = m_code.beds[b];
        LobeInputs<W>& coat = m_inputs[bed.upper];
        const Vec3<Float<W>>& above = seen_from(bed.outer, wo);
        prepare_lobe(LobeId::MicrofacetDielectricBrdf, coat, view_of(bed.upper, above), outside, l, outer);
        ready |= 1u << bed.upper;
        // A coat of weight w bends less, too: at 0 it is none. Seen from within glass it does not lie on this
        // side.
        const Float<W> w = m_node_weight[bed.node];
        Float<W> n = max(fma(w, coat.eta[0] - one, one), Float<W>(LobeTables::MinIndex));
        if (m_code.transmits)
            n = kanuka::select(outside, n, Float<W>(LobeTables::MinIndex));
        ThickLayer<W>& layer = m_layer[b];
        layer.enter(above, n, coat.balance_alpha, m_turned >> bed.upper & 1 ? &m_turn[bed.upper] : nullptr);
        layer.depth = depth_of(coat, w);
        layer.index = n * (bed.outer >= 0 ? m_layer[bed.outer].index : outer ? *outer : one);
    }
    for (const MaterialCode::Node& n : m_code.nodes)
        if (n.leaf >= 0 && !(ready >> n.leaf & 1) && n.lobe != LobeId::LambertBrdf)
            prepare_lobe(n.lobe, m_inputs[n.leaf], view_of(n.leaf, seen_from(n.bed, wo)), outside, l,
                         n.bed < 0 ? outer : &m_layer[n.bed].index);
}

// The part of what a lobe reflects that leaves a coat and all below it: over two lattices, of the lobe's own
// samples and of directions above the coat by their cosine, weighed by the balance heuristic (Veach and
// Guibas 1995): one finds narrow lobes, the other the edge of the cone that leaves.
template <int W>
[[gnu::noinline]] Float<W> Material<W>::escape_by_directions(const MaterialCode::Node& n, int coat) const {
    const Float<W> zero(0.0f), one(1.0f), least(1e-20f);
    const Vec3<Float<W>>& from = m_layer[n.bed].wo;
    int chain[MaxThickCoats], length = 0; // from the lobe's coat out to this one
    for (int b = n.bed;; b = m_code.beds[size_t(b)].outer) {
        chain[length++] = b;
        if (b == coat)
            break;
    }
    Float<W> all(0.0f), out(0.0f), unused;
    for (int i = 0; i < EscapeDirections; i++) {
        const Float<W> u0((float(i) + 0.5f) / float(EscapeDirections)),
            u1((float(i * EscapeStep % EscapeDirections) + 0.5f) / float(EscapeDirections));
        const LobeSample<W> s = sample_leaf(n.leaf, from, Float<W>(0.5f), u0, u1);
        for (const bool own : {true, false}) {
            Vec3<Float<W>> inside = s.wi, over = s.wi;
            Mask<W> leaves = s.valid & (s.wi.z > zero);
            Float<W> passes(1.0f), jacobian(1.0f);
            if (own) {
                for (int k = 0; k < length; k++) {
                    const ThickLayer<W>& layer = m_layer[chain[k]];
                    const auto out_there = layer.out_of(over, leaves);
                    passes = passes * (one - fresnel_dielectric(out_there.over, layer.n, unused));
                    jacobian = jacobian * layer.jacobian(out_there.over, out_there.within);
                    over = out_there.direction;
                }
            } else {
                over = inside = sample_cosine(u0, u1);
                leaves = Mask<W>(true);
                for (int k = length - 1; k >= 0; k--) {
                    const ThickLayer<W>& layer = m_layer[chain[k]];
                    const auto below = layer.into(inside);
                    passes = passes * (one - fresnel_dielectric(below.over, layer.n, unused));
                    inside = below.direction;
                    jacobian = jacobian * layer.jacobian(below.over, below.within);
                }
                leaves = inside.z > zero;
            }
            const LobeValue<W> v = eval_leaf(n.leaf, from, inside);
            const Float<W> p = v.pdf[0], f = kanuka::select(p > zero, v.f[0], zero);
            if (own)
                all += kanuka::select(s.valid, kanuka::select(s.delta, one, f / max(p, least)), zero);
            leaves &= over.z > zero;
            const Float<W> density = fma(p, jacobian, max(over.z, zero) * Float<W>(InvPi));
            const Float<W> once = f * jacobian * passes / max(density, least);
            const Float<W> mirrored = own ? passes : zero; // smooth lobes have one direction
            out += kanuka::select(leaves, kanuka::select(s.delta, mirrored, once), zero);
        }
    }
    // The lattices err by up to 2 %: what is counted as leaving and does not is lost; none is gained.
    return min(Float<W>(1.02f) * out / max(all, least), one);
}

// The series of what is reflected back inside, coat by coat from the inside out.
template <int W>
[[gnu::noinline]] void Material<W>::give_back(const Vec3<Float<W>>& wo) {
    const Float<W> one(1.0f);
    Spectrum<W> gain[MaxLobes], reflected[MaxLobes], through[MaxLobes], relative[MaxLobes];
    Float<W> whole[MaxLobes], before[MaxLobes]; // see ThickLayer::escape
    for (const MaterialCode::Node& n : m_code.nodes) {
        if (n.leaf < 0)
            continue;
        m_above[n.leaf] = Float<W>(0.0f);
        if (n.bed < 0)
            continue;
        const Vec3<Float<W>>& from = seen_from(n.bed, wo);
        const Spectrum<W> albedo = albedo_of(n.leaf, from);
        reflected[n.leaf] = reflected_albedo(n.lobe, m_inputs[n.leaf], from, albedo);
        through[n.leaf] = albedo + reflected[n.leaf] * Float<W>(-1.0f);
        gain[n.leaf] = Spectrum<W>(one);
        whole[n.leaf] = before[n.leaf] = one;
    }
    for (int b = int(m_code.beds.size()) - 1; b >= 0; b--) {
        const ThickLayer<W>& layer = m_layer[b];
        // About the mean of the ways down and up again.
        const Spectrum<W> both = layer.way(Float<W>(0.7f)) * layer.way(Float<W>(0.7f));
        downward_weights(m_code.nodes[size_t(m_code.beds[size_t(b)].node)].lower, relative);
        Spectrum<W> inside(Float<W>(0.0f));
        for (const MaterialCode::Node& n : m_code.nodes) {
            if (n.leaf < 0 || !m_code.below(n.bed, b))
                continue;
            const int k = n.leaf;
            whole[k] = whole[k] * layer.n;
            const bool leans = layer.turn || m_turned >> k & 1, diffuse = is_diffuse(n.lobe);
            Float<W> out = escapes_by_directions(n.lobe, m_inputs[k]) || (leans && !diffuse)
                               ? escape_by_directions(n, b)
                               : layer.escape(n.lobe, m_inputs[k], whole[k], before[k]);
            if (leans && diffuse)
                out = out * layer.cone_seen_from(normal_of(k));
            const Float<W> kept = one - out / max(before[k], Float<W>(1e-6f));
            before[k] = out;
            if (n.bed == b)
                m_above[k] = drawn_above(n.lobe, m_inputs[k], kept);
            inside += relative[k] * gain[k] * reflected[k] * both * kept;
            reflected[k] = reflected[k] * (one - kept);
        }
        for (const MaterialCode::Node& n : m_code.nodes) {
            if (n.leaf < 0 || !m_code.below(n.bed, b))
                continue;
            for (int k = 0; k < Wavelengths; k++)
                gain[n.leaf][k] = gain[n.leaf][k] / max(one - inside[k], Float<W>(0.01f));
            const Spectrum<W> out = layer.way(layer.within);
            m_weight[n.leaf] *= out;
            reflected[n.leaf] = reflected[n.leaf] * layer.way(Float<W>(0.7f));
        }
    }
    for (const MaterialCode::Node& n : m_code.nodes)
        if (n.leaf >= 0 && n.bed >= 0) {
            m_weight[n.leaf] *= gain[n.leaf];
            m_seen[n.leaf] = reflected[n.leaf] + through[n.leaf];
        }
}

template <int W>
[[gnu::noinline]] LobeValue<W> Material<W>::eval_layered(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& wi,
                                                         uint32_t leaves) const { // bits
    const Float<W> zero(0.0f), one(1.0f);
    const Mask<W> reflects = wi.z > zero;
    Vec3<Float<W>> in[MaxThickCoats];
    Spectrum<W> way[MaxThickCoats];
    Float<W> smooth[MaxThickCoats], rough[MaxThickCoats], jacobian[MaxThickCoats];
    for (size_t b = 0; b < m_code.beds.size(); b++) {
        const int outer = m_code.beds[b].outer;
        const ThickLayer<W>& layer = m_layer[b];
        const auto below = layer.into(outer < 0 ? wi : in[outer]);
        in[b] = kanuka::select(reflects, below.direction, wi); // what leaves below crosses no layer again
        const Spectrum<W> all(one);
        way[b] = select(reflects, layer.way(below.within), all);
        smooth[b] = kanuka::select(reflects, layer.passes_smooth(max(below.over, zero)), one);
        rough[b] = kanuka::select(reflects, layer.passes(max(below.over, zero)), one);
        jacobian[b] = kanuka::select(reflects, layer.jacobian(below.over, below.within), one);
        if (layer.turn) // below the horizon of what lies there
            jacobian[b] = kanuka::select(reflects & (in[b].z <= zero), zero, jacobian[b]);
        if (outer >= 0) {
            way[b] *= way[outer];
            smooth[b] = smooth[b] * smooth[outer];
            rough[b] = rough[b] * rough[outer];
            jacobian[b] = jacobian[b] * jacobian[outer];
        }
    }
    const Float<W> cosine_density = max(wi.z, zero) * Float<W>(1 / Pi);
    LobeValue<W> sum = no_value<W>();
    for (int k = 0; k < m_code.leaves; k++) {
        if (!(leaves >> k & 1))
            continue;
        const int b = m_code.bed_of_leaf[k];
        LobeValue<W> v = eval_leaf(k, seen_from(b, wo), b < 0 ? wi : in[b]);
        if (b >= 0) {
            v.f = v.f * way[b] * ((is_diffuse(m_lobe[k]) ? rough[b] : smooth[b]) * jacobian[b]);
            v.pdf = v.pdf * (jacobian[b] * (one - m_above[k])) + Spectrum<W>(cosine_density * m_above[k]);
        }
        sum.f += m_code.absorbs ? v.f * m_weight[k] * way_in(k, wi) : v.f * m_weight[k];
        sum.pdf += v.pdf * m_share[k];
    }
    return sum;
}

// A direction of a lobe below coats: as the lobe has it, out through the layers, or of the cosine over them.
template <int W>
[[gnu::noinline]] LobeSample<W> Material<W>::sample_below(int leaf, Float<W> u_lobe, Float<W> u0,
                                                          Float<W> u1) const {
    const Float<W> zero(0.0f), one(1.0f), above = m_above[leaf];
    const int bed = m_code.bed_of_leaf[leaf];
    const Mask<W> cosine = u_lobe < above;
    LobeSample<W> s = sample_of(sample_cosine(u0, u1));
    s.value = no_value<W>();
    if (all(cosine))
        return s;
    const Float<W> again =
        clamp((u_lobe - above) / max(one - above, Float<W>(1e-6f)), zero, Float<W>(0.99999994f));
    LobeSample<W> own = sample_leaf(leaf, m_layer[bed].wo, again, u0, u1);
    const Mask<W> reflects = own.wi.z > zero;
    for (int b = bed; b >= 0; b = m_code.beds[size_t(b)].outer) {
        Mask<W> leaves(true);
        const auto out = m_layer[b].out_of(own.wi, leaves);
        if (m_layer[b].turn)
            leaves &= out.direction.z > zero;
        own.valid &= leaves | !reflects;
        const Spectrum<W> none(one);
        if (any(own.delta))
            own.value.f *= select(reflects, m_layer[b].lets_in(out.over, max(out.within, zero)), none);
        own.wi = kanuka::select(reflects, out.direction, own.wi);
    }
    s.wi = kanuka::select(cosine, s.wi, own.wi);
    s.valid = cosine | own.valid;
    s.delta = own.delta & !cosine;
    s.value.f = own.value.f;
    s.value.pdf = own.value.pdf;
    return s;
}

} // namespace kanuka::bsdf
