#include "bvh/solids.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace kanuka::bvh {

using Kind = SolidNode::Kind;

namespace {

// Parents that come later (or are no nodes at all) are none: no walk goes round in circles.
int parent_of(std::span<const SolidNode> nodes, int node) {
    const int parent = nodes[size_t(node)].parent;
    return parent >= 0 && parent < node ? parent : -1;
}

} // namespace

bool subtracted(std::span<const SolidNode> nodes, int node) {
    bool odd = false;
    while (node >= 0 && size_t(node) < nodes.size()) {
        const int parent = parent_of(nodes, node);
        if (parent >= 0 && nodes[size_t(parent)].kind == Kind::Difference) {
            int first = parent + 1;
            while (parent_of(nodes, first) != parent)
                first++;
            odd ^= node != first;
        }
        node = parent;
    }
    return odd;
}

SolidTrees::SolidTrees(std::span<const SolidNode> nodes) {
    m_nodes.resize(nodes.size());
    for (size_t i = 0; i < nodes.size(); i++) {
        m_nodes[i] = {nodes[i].kind, parent_of(nodes, int(i)), -1, 0};
        if (m_nodes[i].parent < 0)
            continue;
        Node& parent = m_nodes[size_t(m_nodes[i].parent)];
        if (parent.children++ == 0)
            parent.first_child = int(i);
    }
    leave_out_only_children();
}

// An operation on one solid is that solid: its place in the tree goes to it, however many such lie on the
// way.
void SolidTrees::leave_out_only_children() {
    std::vector<int> stands_for(m_nodes.size()); // what is left of a node
    for (size_t i = m_nodes.size(); i-- > 0;) {
        const Node& n = m_nodes[i];
        const bool operation = n.kind != Kind::Primitive;
        stands_for[i] = operation && n.children == 1 ? stands_for[size_t(n.first_child)] : int(i);
    }
    for (size_t i = 0; i < m_nodes.size(); i++) { // parents come first
        Node& n = m_nodes[i];
        if (n.parent >= 0 && stands_for[size_t(n.parent)] != n.parent)
            n.parent = m_nodes[size_t(n.parent)].parent;
        if (n.first_child >= 0)
            n.first_child = stands_for[size_t(n.first_child)];
    }
}

SolidTrees::Walk::State& SolidTrees::Walk::of(int node) {
    constexpr size_t Few = 32;
    if (m_place.empty()) {
        for (State& s : m_touched)
            if (s.node == node)
                return s;
        if (m_touched.size() < Few)
            return m_touched.emplace_back(State{node, 0, false});
        m_place.assign(m_trees.m_nodes.size(), -1);
        for (size_t i = 0; i < m_touched.size(); i++)
            m_place[size_t(m_touched[i].node)] = int(i);
    }
    int& place = m_place[size_t(node)];
    if (place < 0) {
        place = int(m_touched.size());
        m_touched.push_back({node, 0, false});
    }
    return m_touched[size_t(place)];
}

bool SolidTrees::Walk::value(const State& s) const {
    const Node& node = m_trees.m_nodes[size_t(s.node)];
    switch (node.kind) {
    case Kind::Intersection:
        return s.children > 0 && s.children == node.children;
    case Kind::Difference:
        return s.first && s.children == 1;
    default:
        return s.children > 0;
    }
}

int SolidTrees::Walk::cross(int node) {
    State& leaf = of(node);
    bool now = !leaf.first; // of a primitive: whether the point is inside, by parity
    leaf.first = now;
    // Primitives within a primitive are part of what it encloses.
    bool before = value(leaf);
    leaf.children += now ? 1 : -1;
    bool after = value(leaf);
    while (before != after) {
        const int parent = m_trees.m_nodes[size_t(node)].parent;
        if (parent < 0)
            return node;
        State& s = of(parent);
        before = value(s);
        s.children += after ? 1 : -1;
        if (m_trees.m_nodes[size_t(parent)].kind != Kind::Primitive &&
            m_trees.m_nodes[size_t(parent)].first_child == node)
            s.first = after;
        after = value(s);
        node = parent;
    }
    return -1;
}

Precision::Precision(const Vec3f& o, const Vec3f& d) {
    constexpr float Rounding = 1e-6f; // less than rays start clear of surfaces
    const auto largest = [](const Vec3f& v) {
        return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    };
    const float size = std::max(length(d), 1e-30f);
    base = Rounding * largest(o) / size;
    slope = Rounding * largest(d) / size;
}

void order_crossings(std::vector<Crossing>& crossings, const Precision& precision) {
    constexpr float Grazing = 32; // that much less precise
    std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
        return std::tie(a.t, a.solid, a.shape, a.primitive, a.place, a.entering) <
               std::tie(b.t, b.solid, b.shape, b.primitive, b.place, b.entering);
    });
    size_t kept = 0;
    for (const Crossing& c : crossings) {
        // A closed surface is entered again only after it was left.
        bool again = false, last = true;
        for (size_t k = kept; k-- > 0 && !again;) {
            const Crossing& b = crossings[k];
            const float apart = c.t - b.t, least = precision.at(c.t);
            if (apart > Grazing * least)
                break;
            if (b.solid != c.solid)
                continue;
            again = b.entering == c.entering && (last || apart <= least);
            last = false;
        }
        if (!again)
            crossings[kept++] = c;
    }
    crossings.resize(kept);
}

namespace {

bool is_odd(const std::vector<Crossing>& crossings, int solid) {
    return std::ranges::count(crossings, solid, &Crossing::solid) % 2 != 0;
}

} // namespace

bool any_odd(const std::vector<Crossing>& crossings) {
    constexpr size_t Few = 16;
    if (crossings.size() <= Few)
        return std::ranges::any_of(crossings, [&](const Crossing& c) { return is_odd(crossings, c.solid); });
    std::vector<int> solids;
    for (const Crossing& c : crossings)
        solids.push_back(c.solid);
    std::ranges::sort(solids);
    for (auto at = solids.begin(); at != solids.end();) {
        const auto end = std::ranges::find_if(at, solids.end(), [&](int s) { return s != *at; });
        if ((end - at) % 2 != 0)
            return true;
        at = end;
    }
    return false;
}

void drop_unpaired(std::vector<Crossing>& ahead, const std::vector<Crossing>& behind) {
    std::vector<int> torn;
    for (const Crossing& c : ahead)
        if (std::ranges::find(torn, c.solid) == torn.end() && is_odd(ahead, c.solid) &&
            !is_odd(behind, c.solid))
            torn.push_back(c.solid);
    for (const int solid : torn) {
        std::vector<size_t> of_it;
        for (size_t i = 0; i < ahead.size(); i++)
            if (ahead[i].solid == solid)
                of_it.push_back(i);
        const auto takes_turns_without = [&](size_t left_out) {
            const Crossing* before = nullptr;
            for (const size_t i : of_it) {
                if (i == left_out)
                    continue;
                if (before && before->entering == ahead[i].entering)
                    return false;
                before = &ahead[i];
            }
            return true;
        };
        const auto found = std::ranges::find_if(of_it, takes_turns_without);
        ahead.erase(ahead.begin() + ptrdiff_t(found != of_it.end() ? *found : of_it.back()));
    }
}

} // namespace kanuka::bvh
