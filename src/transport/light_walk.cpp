// Down the hierarchy for one point: eight children at a time.
#include "transport/light_tree.h"

namespace kanuka::transport {

namespace {

using F = Float<8>;

F importances(const LightNode& n, const LightQuery& q, const Vec3<F>& P, const Vec3<F>& N, Mask<8> oriented) {
    const LightChild<8> child{{F::load(n.x), F::load(n.y), F::load(n.z)},
                              F::load(n.radius),
                              {F::load(n.axis_x), F::load(n.axis_y), F::load(n.axis_z)},
                              F::load(n.cos_spread),
                              F::load(n.cos_reach),
                              F::load(n.power)};
    const F brings = light_importance(child, P, N, oriented);
    return select((Int<8>::load(n.sets) & Int<8>(q.set)) != Int<8>(0), brings, F(0.0f));
}

// Sums of the first 1, 2, … 8, one after the other: they never fall, and a child without importance adds
// nothing.
struct Sums {
    float up_to[9];
    explicit Sums(F x) {
        alignas(32) float v[8];
        x.store(v);
        up_to[0] = 0;
        for (int k = 0; k < 8; k++)
            up_to[k + 1] = up_to[k] + v[k];
    }
    float total() const { return up_to[8]; }
    float share(int k) const { return up_to[k + 1] - up_to[k]; }
    bool usable() const { return total() > 0 && total() < 1e38f; }
};

struct Lanes8 {
    Vec3<F> P, N;
    Mask<8> oriented;
    explicit Lanes8(const LightQuery& q)
        : P(F(q.P.x), F(q.P.y), F(q.P.z)), N(F(q.N.x), F(q.N.y), F(q.N.z)),
          oriented(q.N.x != 0 || q.N.y != 0 || q.N.z != 0) {}
};

} // namespace

// One random number serves all levels: what is left of it after a choice is as good as new.
LightPick pick_light(const LightTree& tree, const LightQuery& query, double u) {
    const Lanes8 at(query);
    double chance = 1;
    int32_t node = 0;
    while (true) {
        const LightNode& n = tree.nodes[size_t(node)];
        const Sums sums(importances(n, query, at.P, at.N, at.oriented));
        if (!sums.usable())
            return {-1, 0};
        // The first child whose sum is past the target. Rounding may leave none: then the last with a share.
        const double target = u * double(sums.total());
        int k = 0;
        for (int i = 1; i < 8; i++)
            k += double(sums.up_to[i]) <= target;
        while (!(sums.share(k) > 0))
            k--;
        const double share = double(sums.share(k));
        u = std::clamp((target - double(sums.up_to[k])) / share, 0.0, 1 - 1e-12);
        chance *= share / double(sums.total());
        const int32_t child = n.child[k];
        if (child < 0)
            return {~child, float(chance)};
        node = child;
    }
}

float chance_of_light(const LightTree& tree, const LightQuery& query, int32_t leaf) {
    const Lanes8 at(query);
    double chance = 1;
    int32_t place = tree.place[size_t(leaf)];
    if (place < 0)
        return 0;
    for (; place >= 0; place = tree.parent[size_t(place >> 3)]) {
        const LightNode& n = tree.nodes[size_t(place >> 3)];
        const Sums sums(importances(n, query, at.P, at.N, at.oriented));
        if (!sums.usable())
            return 0;
        chance *= double(sums.share(place & 7)) / double(sums.total());
    }
    return float(chance);
}

} // namespace kanuka::transport
