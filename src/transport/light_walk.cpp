// Down the hierarchy for one point: eight children at a time.
#include "transport/light_tree.h"

namespace kanuka::transport {

namespace {

using F = Float<8>;

F importances(const LightTree& tree, const LightNode& n, const LightQuery& q, const Vec3<F>& P,
              const Vec3<F>& N, Mask<8> oriented) {
    const LightChild<8> child{{F::load(n.x), F::load(n.y), F::load(n.z)},
                              F::load(n.radius),
                              {F::load(n.axis_x), F::load(n.axis_y), F::load(n.axis_z)},
                              F::load(n.cos_spread),
                              F::load(n.cos_reach),
                              F::load(n.power)};
    const F brings = light_importance(child, P, N, oriented, tree.round);
    if (!tree.linked)
        return brings;
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

namespace {

struct Walk {
    int32_t node = 0;
    double u = 0, chance = 1;
};

// One level down. True = at a leaf, or where nothing can bring light.
bool step(const LightTree& tree, const LightQuery& query, Walk& w, LightPick& pick) {
    const Lanes8 at(query);
    const LightNode& n = tree.nodes[size_t(w.node)];
    const Sums sums(importances(tree, n, query, at.P, at.N, at.oriented));
    pick = {-1, 0};
    if (!sums.usable())
        return true;
    // The first child whose sum is past the target. Rounding may leave none: then the last with a share.
    const double total = double(sums.total()), target = w.u * total;
    const uint32_t reached = (F::load(sums.up_to + 1) <= F(float(target))).bits();
    int k = std::min(__builtin_popcount(reached), 7);
    while (!(sums.share(k) > 0))
        k--;
    // What is left of the random number after a choice is as good as new: one serves all levels.
    const double share = double(sums.share(k));
    w.u = std::clamp((target - double(sums.up_to[k])) / share, 0.0, 1 - 1e-12);
    w.chance *= share / total;
    const int32_t child = n.child[k];
    if (child < 0) {
        pick = {~child, float(w.chance)};
        return true;
    }
    w.node = child;
    const char* next = reinterpret_cast<const char*>(&tree.nodes[size_t(child)]);
    for (size_t line = 0; line < sizeof(LightNode); line += 64)
        __builtin_prefetch(next + line);
    return false;
}

} // namespace

// All go down one level at a time: while one waits for memory or for its sums, the others are at work.
void pick_lights(const LightTree& tree, int count, const LightQuery* queries, const double* u,
                 LightPick* picks) {
    Walk walks[MostWalks];
    int8_t on_way[MostWalks];
    for (int i = 0; i < count; i++) {
        walks[i].u = u[i];
        on_way[i] = int8_t(i);
    }
    while (count > 0) {
        int left = 0;
        for (int i = 0; i < count; i++) {
            const int at = on_way[i];
            on_way[left] = int8_t(at);
            left += !step(tree, queries[at], walks[at], picks[at]);
        }
        count = left;
    }
}

LightPick pick_light(const LightTree& tree, const LightQuery& query, double u) {
    LightPick pick;
    pick_lights(tree, 1, &query, &u, &pick);
    return pick;
}

float chance_of_light(const LightTree& tree, const LightQuery& query, int32_t leaf) {
    const Lanes8 at(query);
    double chance = 1;
    int32_t place = tree.place[size_t(leaf)];
    if (place < 0)
        return 0;
    for (; place >= 0; place = tree.parent[size_t(place >> 3)]) {
        const LightNode& n = tree.nodes[size_t(place >> 3)];
        const Sums sums(importances(tree, n, query, at.P, at.N, at.oriented));
        if (!sums.usable())
            return 0;
        chance *= double(sums.share(place & 7)) / double(sums.total());
    }
    return float(chance);
}

} // namespace kanuka::transport
