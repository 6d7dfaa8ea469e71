// What a tree of splits has at its ends, as leaves, eight of which are the children of a node.
#pragma once

#include "hierarchy/nodes.h"
#include "hierarchy/split.h"

namespace kanuka::hierarchy {

struct LeafGroups {
    struct Leaf {
        uint32_t begin, end; // of `items`
    };
    LargeVector<uint32_t> items; // by what they were called, in the order of leaves
    LargeVector<Leaf> leaves;    // those of a group one behind the other
    LargeVector<Group> groups;   // the largest parts of the tree that have eight leaves or fewer, as `kind`;
                                 // `source` is the first leaf

    // Of leaves of up to `most` items.
    void make(LargeVector<Item> items, uint32_t most, Kind kind);
    const Leaf& leaf(const Group& group, int i) const { return leaves[group.source + unsigned(i)]; }

  private:
    void collect(const SplitTree& tree, int32_t branch, Group& group);
};

} // namespace kanuka::hierarchy
