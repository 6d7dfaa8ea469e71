// Receivers of light, and the probabilities with which lights are chosen for them: the choices one by one,
// and the hierarchy in lanes.
#pragma once

#include "transport/media.h"
#include "transport/quad_pictures.h"

namespace kanuka::transport {

// A place that light is sampled for.
template <int W>
struct Receiver {
    Vec3<Float<W>> P, N; // N: on the side that light comes from; zero = from everywhere
    Mask<W> oriented;    // N is not zero
    Int<W> set{1};       // light linking: store::Links::lit_sets
};

// What the links of each lane's shape say.
template <int W>
Int<W> links_of(const SceneView& scene, Int<W> shape, int32_t store::Links::* field) {
    const Int<W> at = gather(scene.geometry.shapes + offsetof(store::ShapeRecord, links) / 4,
                             shape * Int<W>(store::ShapeWords));
    return gather(&(scene.geometry.links->*field), at * Int<W>(int(sizeof(store::Links) / 4)));
}

// ---- the hierarchy, in lanes
// ---------------------------------------------------------------------------------------

// Importances of a hierarchy of one node; lanes are points, and no lane differs from what the walk of
// light_walk.cpp would do.
template <int W, class Use>
void flat_importances(const LightTreeView& tree, const Receiver<W>& r, Use&& use) {
    using F = Float<W>;
    const LightNode& n = tree.nodes[0];
    for (int k = 0; k < LightNode::Width && n.power[k] > 0; k++) {
        const LightChild<W> child{{F(n.x[k]), F(n.y[k]), F(n.z[k])},
                                  F(n.radius[k]),
                                  {F(n.axis_x[k]), F(n.axis_y[k]), F(n.axis_z[k])},
                                  F(n.cos_spread[k]),
                                  F(n.cos_reach[k]),
                                  F(n.power[k])};
        const F irradiance = light_importance(child, r.P, r.N, r.oriented, tree.round);
        use(k, select((Int<W>(n.sets[k]) & r.set) != Int<W>(0), irradiance, F(0.0f)));
    }
}

template <int W>
LightQuery query_of(const Receiver<W>& r, int i) {
    LightQuery q{{r.P.x[i], r.P.y[i], r.P.z[i]}, {0, 0, 0}, r.set[i]};
    if (r.oriented[i])
        q.N = {r.N.x[i], r.N.y[i], r.N.z[i]};
    return q;
}

// Picks a leaf for each lane of m; the chance is 0 where no light can reach. `u_more` goes on where the
// digits of `u` end.
template <int W>
void pick_leaf(const LightTreeView& tree, const Receiver<W>& r, Float<W> u, Float<W> u_more, Mask<W> m,
               Int<W>& leaf, Float<W>& chance) {
    using F = Float<W>;
    leaf = Int<W>(0);
    chance = F(0.0f);
    if (!tree.flat()) {
        static_assert(W <= MostWalks);
        LightQuery queries[W];
        LightPick picks[W];
        double numbers[W] = {};
        int count = 0;
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            queries[count] = query_of(r, i);
            numbers[count++] = double(u[i]) + 0x1p-24 * double(u_more[i]);
        }
        pick_lights(tree, count, queries, numbers, picks);
        count = 0;
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1, count++) {
            const int i = __builtin_ctz(bits);
            if (picks[count].leaf >= 0)
                leaf.v[i] = picks[count].leaf, chance.v[i] = picks[count].chance;
        }
        return;
    }
    F up_to[LightNode::Width], total(0.0f);
    int count = 0;
    flat_importances(tree, r, [&](int k, F irradiance) {
        total += irradiance;
        up_to[k] = total;
        count++;
    });
    const F target = u * total;
    F before(0.0f), share(0.0f);
    Mask<W> open = m & (total > F(0.0f)) & is_finite(total);
    for (int k = 0; k < count; k++) {
        // The last child with a share takes what rounding leaves.
        const Mask<W> here = open & (up_to[k] > before) & ((target < up_to[k]) | (up_to[k] >= total));
        leaf = select(here, Int<W>(~tree.nodes[0].child[k]), leaf);
        share = select(here, up_to[k] - before, share);
        before = up_to[k];
        open &= !here;
    }
    chance = select(m, share / max(total, F(1e-37f)), F(0.0f));
}

// The chance of pick_leaf() for a leaf a lane.
template <int W>
Float<W> chance_of_leaf(const LightTreeView& tree, const Receiver<W>& r, Int<W> leaf, Mask<W> m) {
    using F = Float<W>;
    F chance(0.0f);
    if (tree.empty())
        return chance;
    if (!tree.flat()) {
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            chance.v[i] = chance_of_light(tree, query_of(r, i), leaf[i]);
        }
        return chance;
    }
    F total(0.0f), share(0.0f);
    flat_importances(tree, r, [&](int k, F irradiance) {
        const F before = total;
        total += irradiance;
        share = select(leaf == Int<W>(~tree.nodes[0].child[k]), total - before, share);
    });
    return select(m & (total > F(0.0f)) & is_finite(total), share / max(total, F(1e-37f)), F(0.0f));
}

// ---- choosing
// ------------------------------------------------------------------------------------------------------

// The probabilities of the choices of light at a point: by an estimate of each one's irradiance there,
// unshadowed, mixed with equal shares, so that none starves where the estimate is wrong. Exact where lights
// are few; scenes with more have them in the hierarchy, or fall back on equal shares where they are distant.
//
// Estimates know nothing of what is in the way. Indoors the sky is hidden, and far brighter than lamps: where
// a scene has both, what comes from infinity and what is near are sampled apart, one of each
// (LightsView::samples).
template <int W>
class LightChooser {
    using F = Float<W>;
    using I = Int<W>;

  public:
    LightChooser(const SceneView& scene, const Receiver<W>& r)
        : m_count(scene.lights.choices), m_samples(scene.lights.samples) {
        m_equal = F(m_count > 0 ? 1.0f / float(m_count) : 0.0f);
        m_exact = m_count <= LightsView::FewChoices && (m_count > 1 || scene.lights.linked);
        if (!m_exact)
            return;
        m_first_far = scene.lights.emitter_choice >= 0 ? 1 : 0;
        m_end_far = m_samples > 1 ? scene.lights.first_light_choice + scene.lights.distant : m_first_far;
        Sums sums[2];
        const auto set = [&](int choice, F irradiance, int32_t sets) {
            F share(1.0f);
            if (scene.lights.linked) {
                const Mask<W> shines = (r.set & I(sets)) != I(0);
                irradiance = kanuka::select(shines, irradiance, F(0.0f));
                share = kanuka::select(shines, F(1.0f), F(0.0f));
                m_share[choice] = share;
            }
            m_chance[choice] = irradiance;
            sums[is_far(choice)].irradiance += irradiance;
            sums[is_far(choice)].open += share;
        };
        if (scene.lights.emitter_choice >= 0) {
            const Vec3f c = scene.lights.emitter_center;
            const Vec3<F> to = Vec3<F>(F(c.x), F(c.y), F(c.z)) - r.P;
            set(scene.lights.emitter_choice,
                F(scene.lights.emitter_power) / max(dot(to, to), F(scene.lights.emitter_radius2)), -1);
        }
        if (scene.lights.map_choice >= 0)
            set(scene.lights.map_choice, F(scene.lights.map_irradiance), scene.lights.map_choice_sets);
        for (int k = 0; k < scene.lights.by_choice; k++)
            set(scene.lights.first_light_choice + k, irradiance(scene, k, r),
                scene.lights.analytic[size_t(k)].sets);
        F scale[2], share[2], alone[2];
        Mask<W> some[2];
        for (int g = 0; g < m_samples; g++) {
            const F total = sums[g].irradiance, open = max(sums[g].open, F(1.0f));
            some[g] = total > F(1e-20f);
            scale[g] = F(0.85f) / max(total, F(1e-20f));
            share[g] = F(0.15f) / open, alone[g] = F(1.0f) / open;
        }
        for (int k = 0; k < m_count; k++) {
            const int g = is_far(k);
            m_chance[k] = kanuka::select(some[g], fma(m_chance[k], scale[g], share[g]), alone[g]);
            if (scene.lights.linked)
                m_chance[k] *= m_share[k];
        }
    }
    F pdf(int choice) const {
        if (choice < 0)
            return F(0.0f);
        return m_exact ? m_chance[choice] : m_equal;
    }
    F pdf(I choice) const {
        if (!m_exact)
            return m_equal;
        F chance(0.0f);
        for (int k = 0; k < m_count; k++)
            chance = kanuka::select(choice == I(k), m_chance[k], chance);
        return chance;
    }
    // sample: which of LightsView::samples.
    I choose(F u, int sample) const {
        if (!m_exact)
            return min(to_int(u * F(float(m_count))), I(m_count - 1));
        I choice(0);
        F up_to(0.0f);
        bool first = true;
        for (int k = 0; k < m_count; k++) {
            if (is_far(k) != sample)
                continue;
            choice = first ? I(k) : kanuka::select(u >= up_to, I(k), choice);
            up_to += m_chance[k];
            first = false;
        }
        return choice;
    }

  private:
    static F irradiance(const SceneView& scene, int k, const Receiver<W>& r) {
        const AnalyticLight& light = scene.lights.analytic[size_t(k)];
        const LightBound& b = scene.lights.bounds[size_t(k)];
        const Vec3<F> axis(F(b.axis.x), F(b.axis.y), F(b.axis.z)),
            center(F(b.center.x), F(b.center.y), F(b.center.z));
        if (light.shape == AnalyticLight::Distant) // surfaces may transmit, too
            return F(b.power) * kanuka::select(r.oriented, max(-dot(axis, r.N), F(0.02f)), F(0.5f));
        // What a spot sends into a direction is known: its bound's cosine would count twice.
        const bool spot = light.cos_outer > -2;
        const LightChild<W> child{center,         F(b.radius), axis, F(spot ? -1 : b.cos_spread),
                                  F(b.cos_reach), F(b.power)};
        F estimate = light_importance(child, r.P, r.N, r.oriented);
        if (spot) {
            const Vec3<F> from = r.P - center;
            const F cosine = dot(from, axis) / sqrt(max(dot(from, from), F(1e-20f)));
            estimate *= spot_falloff(F(light.cos_outer), F(light.cos_inner), Int<W>(light.exponent), cosine);
        }
        return estimate;
    }

    struct Sums {
        F irradiance{0.0f}, open{0.0f};
    };
    int is_far(int choice) const { return choice >= m_first_far && choice < m_end_far ? 1 : 0; }

    int m_count, m_samples, m_first_far = 0, m_end_far = 0; // what is far lies between what is near
    bool m_exact;
    F m_equal, m_chance[LightsView::FewChoices], m_share[LightsView::FewChoices];
};

} // namespace kanuka::transport
