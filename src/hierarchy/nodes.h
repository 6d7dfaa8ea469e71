// Nodes: boxes in eight bits a plane, and the tree of nodes over groups of leaves.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/vec.h"
#include "hierarchy/format.h"
#include "hierarchy/split.h"

namespace kanuka::hierarchy {

// Up to eight children: leaves of one kind, or nodes.
struct Group {
    Kind kind;
    uint8_t count = 0;
    Bounds3f box[8];     // of shapes that change halfway
    uint32_t source = 0; // whatever the maker of the leaves knows it by

    Bounds3f bounds() const {
        Bounds3f all;
        for (int i = 0; i < count; i++)
            all.extend(box[i]);
        return all;
    }
};

// Of what lies in the one box as an interval begins and in the other as it ends; empty where either is.
inline Bounds3f halfway(const Bounds3f& begin, const Bounds3f& end) {
    if (begin.empty() || end.empty())
        return {};
    return {begin.lo * 0.5f + end.lo * 0.5f, begin.hi * 0.5f + end.hi * 0.5f};
}

// A box that goes straight from where an interval of time begins to where it ends.
struct BoxOfEnds {
    Bounds3f begin, end;

    Bounds3f all() const {
        Bounds3f box = begin;
        box.extend(end);
        return box;
    }
    bool moves() const { return begin.lo != end.lo || begin.hi != end.hi; }
};

// Writes boxes, rounded outwards, and where the children are; unused places hold nothing.
void write_node(Node& node, const Group& group, uint32_t children);

// Boxes as an interval of time begins and as it ends, of what changes or moves.
using BoxesAtEnds = std::array<LargeVector<Bounds3f>, 2>;

// The nodes over all groups. `leaf_at[i]` is where the node of group i itself stands, which the caller
// writes.
struct NodeTree {
    LargeVector<Node> nodes; // the first is the root. Of what changes each is two, a ChangingNode
    Kind root = Kind::Nodes;
    LargeVector<uint32_t> leaf_at;
    LargeVector<uint8_t> leaf_ends; // 2 where that is a ChangingNode
};
// `at_ends`: boxes of the groups of what changes; null = nothing does.
NodeTree make_nodes(std::span<const Group> groups, size_t nodes_at, const BoxesAtEnds* at_ends = nullptr);
// Where the splits that groups come from are made already: group i is the i-th leaf among the branches.
// `moving`: above groups that move, and beside them, nodes are ChangingNodes; null = nothing moves.
struct MovingGroups {
    BoxesAtEnds at_ends;
    LargeVector<uint8_t> moves; // something in a group does, though its box as a whole may not
};
NodeTree make_nodes(const SplitTree& tree, size_t nodes_at, const MovingGroups* moving = nullptr);
Bounds3f box_of_child(const Node& node, int child);
// What is in a page of such nodes as the interval begins, and as it ends: end 0 or 1.
Bounds3f bounds_at(const ChangingNode& root, int end);

} // namespace kanuka::hierarchy
