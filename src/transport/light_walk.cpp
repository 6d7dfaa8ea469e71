// Down the hierarchy, eight children at a time, for up to MostWalks points together: all go down one level
// before any goes down the next, so that while one waits for memory or for its sums, the others are at work.
#include "transport/light_tree.h"

namespace kanuka::transport {

namespace {

using F = Float<8>;

// The importances of the children of a node, and the sums of the first 1, 2, … 8 (Hillis and Steele 1986:
// three additions, not eight in a row). Rounding may let a sum fall a hair below the one before it, so a
// child's share is its importance itself.
struct Sums {
    alignas(32) float share[8];
    alignas(32) float up_to[8];
    uint32_t some; // bits of the children that are not 0

    [[gnu::always_inline]] void fill(const LightTreeView& tree, const LightNode& n, const LightQuery& q) {
        const LightChild<8> child{{F::load(n.x), F::load(n.y), F::load(n.z)},
                                  F::load(n.radius),
                                  {F::load(n.axis_x), F::load(n.axis_y), F::load(n.axis_z)},
                                  F::load(n.cos_spread),
                                  F::load(n.cos_reach),
                                  F::load(n.power)};
        const Mask<8> oriented(q.N.x != 0 || q.N.y != 0 || q.N.z != 0);
        F x = light_importance(child, {F(q.P.x), F(q.P.y), F(q.P.z)}, {F(q.N.x), F(q.N.y), F(q.N.z)},
                               oriented, tree.round);
        if (tree.linked)
            x = select((Int<8>::load(n.sets) & Int<8>(q.set)) != Int<8>(0), x, F(0.0f));
        x.store(share);
        some = (x > F(0.0f)).bits();
        const F::F zero{};
        x.v += __builtin_shufflevector(zero, x.v, 0, 8, 9, 10, 11, 12, 13, 14);
        x.v += __builtin_shufflevector(zero, x.v, 0, 0, 8, 9, 10, 11, 12, 13);
        x.v += __builtin_shufflevector(zero, x.v, 0, 0, 0, 0, 8, 9, 10, 11);
        x.store(up_to);
    }
    float total() const { return up_to[7]; }
    bool usable() const { return some != 0 && total() < 1e38f; }
    // The first child whose sum is past the target. Rounding may leave none: then the last with a share.
    int past(float target) const {
        const uint32_t open = (F::load(up_to) > F(target)).bits() & some;
        return open ? __builtin_ctz(open) : 31 - __builtin_clz(some);
    }
};

struct Walk {
    int32_t node = 0;
    double u = 0, chance = 1;
};

// One level down. True = at a leaf, or where no light can reach.
bool step(const LightTreeView& tree, const Sums& sums, Walk& w, LightPick& pick) {
    if (!sums.usable()) {
        pick = {-1, 0};
        return true;
    }
    const double total = double(sums.total()), target = w.u * total;
    const int k = sums.past(float(target));
    // What is left of the random number after a choice is as good as new: one serves all levels.
    const double share = double(sums.share[k]);
    w.u = std::clamp((target - (double(sums.up_to[k]) - share)) / share, 0.0, 1 - 1e-12);
    w.chance *= share / total;
    const int32_t child = tree.nodes[size_t(w.node)].child[k];
    if (child < 0) {
        pick = {~child, float(w.chance)};
        return true;
    }
    w.node = child;
    tree.prefetch(child, tree.round && !tree.linked ? LightNode::FirstHalf : sizeof(LightNode));
    return false;
}

} // namespace

void pick_lights(const LightTreeView& tree, int count, const LightQuery* queries, const double* u,
                 LightPick* picks) {
    Walk walks[MostWalks];
    Sums sums[MostWalks];
    int8_t on_way[MostWalks];
    for (int i = 0; i < count; i++) {
        walks[i].u = u[i];
        on_way[i] = int8_t(i);
    }
    while (count > 0) {
        for (int i = 0; i < count; i++)
            sums[i].fill(tree, tree.nodes[size_t(walks[on_way[i]].node)], queries[on_way[i]]);
        int left = 0;
        for (int i = 0; i < count; i++) {
            const int at = on_way[i];
            on_way[left] = int8_t(at);
            left += !step(tree, sums[i], walks[at], picks[at]);
        }
        count = left;
    }
}

LightPick pick_light(const LightTreeView& tree, const LightQuery& query, double u) {
    LightPick pick;
    pick_lights(tree, 1, &query, &u, &pick);
    return pick;
}

float chance_of_light(const LightTreeView& tree, const LightQuery& query, int32_t leaf) {
    double chance = 1;
    int32_t place = tree.place[size_t(leaf)];
    if (place < 0)
        return 0;
    for (; place >= 0; place = tree.parent[size_t(place >> 3)]) {
        Sums sums;
        sums.fill(tree, tree.nodes[size_t(place >> 3)], query);
        if (!sums.usable())
            return 0;
        chance *= double(sums.share[place & 7]) / double(sums.total());
    }
    return float(chance);
}

} // namespace kanuka::transport
