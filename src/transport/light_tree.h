// A hierarchy of lights with bounding cones, after Conty Estevez and Kulla 2018, Importance Sampling of Many
// Lights with Adaptive Tree Splitting: which light to sample at a point, in a time that hardly grows with
// their number, by a bound of each one's contribution there. How we differ: nodes have eight children, whose
// importances are one vector operation; there is no splitting, one light is sampled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lanes.h"
#include "base/large_pages.h"

namespace kanuka::transport {

// What the hierarchy knows of one light.
struct LightBound {
    Vec3f center{0, 0, 0}; // a sphere about all that shines
    float radius = 0;
    Vec3f axis{0, 0, 1};   // a cone about all normals of it,
    float cos_spread = -1; // -1 = normals everywhere
    float cos_reach = 0;   // how far from a normal light goes: 0 for a surface; spots less
    float power = 0;       // irradiance at a far place that it faces, times the squared distance
    int32_t sets = -1;     // bits of the sets of receivers it shines on
};

// Eight children, structure of arrays. power 0: no child. What every walk reads comes first: where lights
// shine to all sides, the other half never enters a cache.
struct alignas(64) LightNode {
    static constexpr int Width = 8;
    float x[8], y[8], z[8], radius[8];
    float power[8];
    int32_t child[8]; // a node, or ~leaf
    float axis_x[8], axis_y[8], axis_z[8], cos_spread[8], cos_reach[8];
    int32_t sets[8];
    static constexpr size_t FirstHalf = 192;
};
static_assert(offsetof(LightNode, axis_x) == LightNode::FirstHalf);

struct LightTree {
    LargeVector<LightNode> nodes; // root first; children behind their parents
    std::vector<int32_t> parent;  // of each node its place in its parent, 8 * node + child; root: -1
    std::vector<int32_t> place;   // of each leaf; -1 = not in the hierarchy
    bool linked = false;          // some lights do not shine on all sets
    bool round = false;           // all shine to all sides
    bool empty() const { return nodes.empty(); }
    uint64_t bytes() const {
        return nodes.size() * (sizeof(LightNode) + sizeof(int32_t)) + place.size() * sizeof(int32_t);
    }
};

// The same, owned by another.
struct LightTreeView {
    std::span<const LightNode> nodes;
    std::span<const int32_t> parent, place;
    bool linked = false, round = false;

    LightTreeView() = default;
    LightTreeView(const LightTree& tree)
        : nodes(tree.nodes), parent(tree.parent), place(tree.place), linked(tree.linked), round(tree.round) {}
    bool empty() const { return nodes.empty(); }
    bool flat() const { return nodes.size() == 1; }
    void prefetch(int32_t node, size_t bytes) const {
        const char* from = reinterpret_cast<const char*>(&nodes[size_t(node)]);
        for (size_t line = 0; line < bytes; line += 64)
            __builtin_prefetch(from + line);
    }
};

// Leaf i is bounds[i]; those without power are left out. Parallel; the same tree for any thread count.
LightTree build_light_tree(std::span<const LightBound> bounds);

// A place that light is sampled for. N: on the side that light comes from; zero = light counts from
// everywhere.
struct LightQuery {
    Vec3f P, N;
    int32_t set = 1; // bit of the set that the receiver is in
};
struct LightPick {
    int32_t leaf; // -1: no light can reach
    float chance;
};

// u in [0, 1), of more digits than a float has where lights are millions.
LightPick pick_light(const LightTreeView& tree, const LightQuery& query, double u);
// The same for some at once, at most MostWalks.
inline constexpr int MostWalks = 16;
void pick_lights(const LightTreeView& tree, int count, const LightQuery* queries, const double* u,
                 LightPick* picks);
// The chance that pick_light() picks `leaf`.
float chance_of_light(const LightTreeView& tree, const LightQuery& query, int32_t leaf);

// Calls found(ray, leaf) for every leaf whose sphere a ray hits before its `t_max`; of one ray in an order
// of the tree's own. At most MostWalks rays: they take turns, so that one waits for memory while the others
// work.
struct LightRay {
    Vec3f o, d; // d is unit
    float t_max;
};
template <class Found>
void lights_along(const LightTreeView& tree, int count, const LightRay* rays, Found&& found);

// A bound of the irradiance of children at points, both in lanes: one may be the same in all of them.
template <int W>
struct LightChild {
    Vec3<Float<W>> center;
    Float<W> radius;
    Vec3<Float<W>> axis;
    Float<W> cos_spread, cos_reach, power;
};

template <int W>
[[gnu::always_inline]] inline Float<W> light_importance(const LightChild<W>& child, const Vec3<Float<W>>& P,
                                                        const Vec3<Float<W>>& N, Mask<W> oriented,
                                                        bool round = false) {
    using F = Float<W>;
    const F zero(0.0f), one(1.0f);
    const Vec3<F> to = child.center - P;
    const F d2 = dot(to, to), r2 = child.radius * child.radius;
    // The sphere fills the angle theta_b. From inside it, which is every direction, points are taken to its
    // surface: sin theta_b = 1 there, and the cosines below lose nothing.
    const F inv_d = one / sqrt(max(max(d2, r2), F(1e-30f)));
    const F sin_b = child.radius * inv_d;
    // Of the receiver: cos(theta_i - theta_b) is at most cos theta_i + sin theta_b, and near it where the
    // sphere is small. Nothing where all of it is below the horizon.
    const F cos_n = dot(N, to) * inv_d;
    const F cos_i = min(max(cos_n, zero) + sin_b, one);
    const F taken = select(oriented, select(cos_n + sin_b > F(-1e-3f), cos_i + F(1e-3f), zero), F(0.5f));
    const F reaches = child.power * taken * (inv_d * inv_d);
    if (round)
        return reaches;
    const Mask<W> inside = r2 >= d2;
    const auto sine = [&](F c) { return sqrt(max(one - c * c, zero)); };
    const F cos_b = select(inside, F(-1.0f), sine(sin_b));
    // Of light: theta' = theta - theta_spread - theta_b, not below 0.
    const F cos_w = -dot(child.axis, to) * inv_d, sin_w = sine(cos_w), sin_o = sine(child.cos_spread);
    const Mask<W> within = cos_w >= child.cos_spread;
    const F cos_x = select(within, one, cos_w * child.cos_spread + sin_w * sin_o);
    const F sin_x = select(within, zero, sin_w * child.cos_spread - cos_w * sin_o);
    const F cos_e = select(cos_x >= cos_b, one, cos_x * cos_b + sin_x * sin_b); // inside: one
    // A hair more than the bound: what rounding took must not darken a light.
    const F sent = select(cos_e > child.cos_reach - F(1e-3f), max(cos_e, F(1e-3f)), zero);
    return reaches * sent;
}

template <class Found>
void lights_along(const LightTreeView& tree, int count, const LightRay* rays, Found&& found) {
    using F = Float<8>;
    constexpr int Most = 256; // a level takes seven places at most
    struct Turn {
        int32_t ray, top;
        int32_t stack[Most + LightNode::Width]; // places to write in vain
    };
    if (tree.empty())
        return;
    Turn turns[MostWalks];
    Turn* on_way[MostWalks];
    for (int i = 0; i < count; i++) {
        turns[i].ray = i;
        turns[i].stack[0] = 0;
        turns[i].top = 1;
        on_way[i] = &turns[i];
    }
    while (count > 0) {
        int left = 0;
        for (int i = 0; i < count; i++) {
            Turn& turn = *on_way[i];
            const LightRay& ray = rays[turn.ray];
            const LightNode& n = tree.nodes[size_t(turn.stack[--turn.top])];
            const Vec3<F> to(F::load(n.x) - F(ray.o.x), F::load(n.y) - F(ray.o.y), F::load(n.z) - F(ray.o.z));
            const Vec3<F> d(F(ray.d.x), F(ray.d.y), F(ray.d.z));
            const F r = F::load(n.radius) * F(1.0001f), along = dot(to, d);
            const Vec3<F> off = to - d * along;
            const Mask<8> m = (dot(off, off) <= r * r) & (along >= -r) & (along - r <= F(ray.t_max)) &
                              (F::load(n.power) > F(0.0f));
            const Int<8> child = Int<8>::load(n.child);
            // How many children a ray hits is anybody's guess: nodes go to the stack without a branch.
            const uint32_t leaves = (m & (child < Int<8>(0))).bits(), nodes = m.bits() & ~leaves;
            turn.top += compress_store(turn.stack + turn.top, child, nodes);
            turn.top = std::min(turn.top, Most);
            for (uint32_t bits = leaves; bits; bits &= bits - 1)
                found(turn.ray, ~n.child[__builtin_ctz(bits)]);
            if (turn.top == 0)
                continue;
            tree.prefetch(turn.stack[turn.top - 1], LightNode::FirstHalf);
            on_way[left++] = &turn;
        }
        count = left;
    }
}

} // namespace kanuka::transport
