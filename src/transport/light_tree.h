// A hierarchy of lights with bounding cones, after Conty Estevez and Kulla 2018, Importance Sampling of Many
// Lights with Adaptive Tree Splitting: which light to ask at a point, in a time that hardly grows with their
// number, by a bound of what each may bring there. How we differ: nodes have eight children, whose
// importances are one vector operation; there is no splitting, one light is asked.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/lanes.h"

namespace kanuka::transport {

// What the hierarchy knows of one light.
struct LightBound {
    Vec3f center{0, 0, 0}; // a sphere about all that shines
    float radius = 0;
    Vec3f axis{0, 0, 1};   // a cone about all normals of it,
    float cos_spread = -1; // -1 = normals everywhere
    float cos_reach = 0;   // how far from a normal light goes: 0 for a surface; spots less
    float power = 0;       // what it brings to a far place that it faces, times the squared distance
    int32_t sets = -1;     // bits of the sets of receivers it shines on
};

// Eight children, structure of arrays. power 0: no child.
struct alignas(64) LightNode {
    static constexpr int Width = 8;
    float x[8], y[8], z[8], radius[8];
    float axis_x[8], axis_y[8], axis_z[8], cos_spread[8], cos_reach[8];
    float power[8];
    int32_t sets[8];
    int32_t child[8]; // a node, or ~leaf
};

struct LightTree {
    std::vector<LightNode> nodes; // root first; children behind their parents
    std::vector<int32_t> parent;  // of each node its place in its parent, 8 * node + child; root: -1
    std::vector<int32_t> place;   // of each leaf; -1 = not in the hierarchy
    bool linked = false;          // some lights do not shine on all sets
    bool round = false;           // all shine to all sides
    bool empty() const { return nodes.empty(); }
    bool flat() const { return nodes.size() == 1; }
    uint64_t bytes() const {
        return nodes.size() * (sizeof(LightNode) + sizeof(int32_t)) + place.size() * sizeof(int32_t);
    }
};

// Leaf i is bounds[i]; those without power are left out. Parallel; the same tree for any thread count.
LightTree build_light_tree(std::span<const LightBound> bounds);

// Where light is asked for. N: on the side that light comes from; zero = light counts from everywhere.
struct LightQuery {
    Vec3f P, N;
    int32_t set = 1; // bit of the set that the receiver is in
};
struct LightPick {
    int32_t leaf; // -1: nothing can bring light
    float chance;
};

// u in [0, 1), of more digits than a float has where lights are millions.
LightPick pick_light(const LightTree& tree, const LightQuery& query, double u);
// The same for some at once, at most MostWalks.
inline constexpr int MostWalks = 16;
void pick_lights(const LightTree& tree, int count, const LightQuery* queries, const double* u,
                 LightPick* picks);
// The chance that pick_light() picks `leaf`.
float chance_of_light(const LightTree& tree, const LightQuery& query, int32_t leaf);

// Calls found(leaf) for every leaf whose sphere a ray meets before `t_max`, in an order of the tree's own.
struct LightRay {
    Vec3f o, d; // d is unit
    float t_max;
};
template <class Found>
void lights_along(const LightTree& tree, const LightRay& ray, Found&& found);

// A bound of what children bring to points, both in lanes: one may be the same in all of them.
template <int W>
struct LightChild {
    Vec3<Float<W>> center;
    Float<W> radius;
    Vec3<Float<W>> axis;
    Float<W> cos_spread, cos_reach, power;
};

template <int W>
Float<W> light_importance(const LightChild<W>& child, const Vec3<Float<W>>& P, const Vec3<Float<W>>& N,
                          Mask<W> oriented, bool round = false) {
    using F = Float<W>;
    const F zero(0.0f), one(1.0f);
    const Vec3<F> to = child.center - P;
    const F d2 = max(dot(to, to), F(1e-30f)), r2 = child.radius * child.radius;
    const F inv_d = one / sqrt(d2);
    // The angle that the sphere fills, theta_b; inside it, all directions.
    const F sin2_b = r2 / d2;
    const Mask<W> inside = sin2_b >= one;
    const F sin_b = select(inside, one, sqrt(sin2_b));
    // Of the receiver: cos(theta_i - theta_b) is at most cos theta_i + sin theta_b, and near it where the
    // sphere is small. Nothing where all of it is below the horizon.
    const F cos_n = dot(N, to) * inv_d;
    const F cos_i = min(max(cos_n, zero) + sin_b, one);
    const F taken =
        select(oriented, select(inside | (cos_n + sin_b > F(-1e-3f)), cos_i + F(1e-3f), zero), F(0.5f));
    const F reaches = child.power * (taken / max(d2, r2));
    if (round)
        return reaches;
    const auto sine = [&](F c) { return sqrt(max(one - c * c, zero)); };
    const F cos_b = select(inside, F(-1.0f), sqrt(max(one - sin2_b, zero)));
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
void lights_along(const LightTree& tree, const LightRay& ray, Found&& found) {
    using F = Float<8>;
    int32_t stack[256];
    int top = 0;
    if (!tree.empty())
        stack[top++] = 0;
    while (top > 0) {
        const LightNode& n = tree.nodes[size_t(stack[--top])];
        const Vec3<F> to(F::load(n.x) - F(ray.o.x), F::load(n.y) - F(ray.o.y), F::load(n.z) - F(ray.o.z));
        const Vec3<F> d(F(ray.d.x), F(ray.d.y), F(ray.d.z));
        const F r = F::load(n.radius) * F(1.0001f), along = dot(to, d);
        const Vec3<F> off = to - d * along;
        const Mask<8> m = (dot(off, off) <= r * r) & (along >= -r) & (along - r <= F(ray.t_max)) &
                          (F::load(n.power) > F(0.0f));
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
            const int32_t child = n.child[__builtin_ctz(bits)];
            if (child < 0)
                found(~child);
            else if (top < 256)
                stack[top++] = child;
        }
    }
}

} // namespace kanuka::transport
