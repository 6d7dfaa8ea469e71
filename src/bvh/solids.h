// Set operations on solids (constructive solid geometry), resolved ray by ray: Roth, "Ray Casting for
// Modeling Solids" (1982). All crossings of a ray with the surfaces of solids, from its start to infinity,
// are put in order; a crossing is a hit if the value of its tree of operations changes there.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace kanuka::bvh {

// A node of a tree of set operations, by number; children come after their parents.
struct SolidNode {
    enum class Kind : uint8_t { Primitive, Union, Intersection, Difference } kind = Kind::Primitive;
    int parent = -1;
};

// Is what lies in primitive solid `node` taken away from what is left in the end? A tree rises or falls with
// each of its primitives, so the answer is one for all places: what bounds it turns its inside out.
bool subtracted(std::span<const SolidNode> nodes, int node);

class SolidTrees {
  public:
    SolidTrees() = default;
    explicit SolidTrees(std::span<const SolidNode> nodes);
    bool empty() const { return m_nodes.empty(); }
    bool holds(int node) const { return node >= 0 && size_t(node) < m_nodes.size(); }
    // What a shape bounds that names `node`: without trees it is one of the group's that it is placed in.
    int bounded_by(int node) const { return empty() || holds(node) ? node : -1; }

    // Where a ray is: what is true of a point at a time, starting outside of everything.
    class Walk {
      public:
        explicit Walk(const SolidTrees& trees) : m_trees(trees) {}
        // Into the primitive solid, or out of it. Returns the root of its tree if that changed its value,
        // else -1.
        int cross(int node);

      private:
        struct State {
            int node;
            int children; // that are true
            bool first;   // the first child is
        };
        State& of(int node);
        bool value(const State& s) const;
        const SolidTrees& m_trees;
        std::vector<State> m_touched; // mostly few: those along the ray
        std::vector<int> m_place;     // of a node among them, once they are many; -1 = untouched
    };

  private:
    struct Node {
        SolidNode::Kind kind;
        int parent, first_child, children;
    };
    void leave_out_only_children();
    std::vector<Node> m_nodes;
};

// One passage of a ray through a surface that bounds a solid.
struct Crossing {
    float t, u, v;
    Vec3f Ng;      // as the hit has it
    bool entering; // against the normal of the winding
    int solid;
    uint32_t geometry, primitive;
    int shape;
    int place; // among Crossings::places; -1 = in the group of the tree itself
};

// How far apart in t crossings of one place may lie: positions have a rounding that grows with their size.
struct Precision {
    float base, slope;
    Precision(const Vec3f& o, const Vec3f& d);
    float at(float t) const { return base + slope * t; }
};

// Puts crossings in order and removes what was met twice: where a ray passes an edge that triangles share,
// both report it.
void order_crossings(std::vector<Crossing>& crossings, const Precision& precision);

// Does a primitive solid have an odd number of crossings?
bool any_odd(const std::vector<Crossing>& crossings);

// A line crosses a closed surface evenly often: where those ahead of a ray's start are odd and those behind
// it even, the line went through a crack, as between a cylinder's rim and its lid, which are diced apart.
// Without its fellow a crossing tells nothing, and is left out: the one without which entering and leaving
// take turns.
void drop_unpaired(std::vector<Crossing>& ahead, const std::vector<Crossing>& behind);

// Calls accept(crossing) for crossings that a tree's value changes at, nearest first, until one is taken.
// Coincident surfaces count as one: what is taken away up to a common face leaves no skin there.
template <class Accept>
const Crossing* first_boundary(const SolidTrees& trees, const std::vector<Crossing>& crossings,
                               const Precision& precision, Accept&& accept) {
    SolidTrees::Walk walk(trees);
    // A ray ends outside of all: so an odd number of crossings ahead means that it starts inside.
    for (const Crossing& c : crossings)
        walk.cross(c.solid);
    struct Change {
        int root;
        const Crossing* last;
        bool changed;
    };
    std::vector<Change> changes; // of a run of coincident crossings, by root
    for (size_t i = 0; i < crossings.size();) {
        changes.clear();
        const float start = crossings[i].t;
        for (; i < crossings.size() && crossings[i].t - start <= precision.at(start); i++) {
            const int root = walk.cross(crossings[i].solid);
            if (root < 0)
                continue;
            Change* change = nullptr;
            for (Change& c : changes)
                if (c.root == root)
                    change = &c;
            if (!change)
                change = &changes.emplace_back(Change{root, nullptr, false});
            change->changed = !change->changed;
            change->last = &crossings[i];
        }
        for (const Change& c : changes)
            if (c.changed && accept(*c.last))
                return c.last;
    }
    return nullptr;
}

} // namespace kanuka::bvh
