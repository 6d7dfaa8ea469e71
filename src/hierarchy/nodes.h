// Nodes: boxes in eight bits a plane, and the tree of nodes over groups of leaves.
#pragma once

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
    Bounds3f box[8];
    uint32_t source = 0; // whatever the maker of the leaves knows it by

    Bounds3f bounds() const {
        Bounds3f all;
        for (int i = 0; i < count; i++)
            all.extend(box[i]);
        return all;
    }
};

// Writes boxes, rounded outwards, and where the children are; unused places hold nothing.
void write_node(Node& node, const Group& group, uint32_t children);

// The nodes over all groups. `leaf_at[i]` is where the node of group i itself stands, which the caller
// writes.
struct NodeTree {
    LargeVector<Node> nodes; // the first is the root; children count from `first_unit`
    LargeVector<uint32_t> leaf_at;
};
NodeTree make_nodes(std::span<const Group> groups, size_t nodes_at);

} // namespace kanuka::hierarchy
