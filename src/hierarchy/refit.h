// Levels of instances that have moved a little: the tree stays, and boxes are made anew from the leaves up
// [Lauterbach, Yoon, Tuft, Manocha 2006, "RT-DEFORM: interactive ray tracing of dynamic scenes using BVHs"],
// as long as rays meet few more of them than when the tree was made.
#pragma once

#include <atomic>
#include <functional>

#include "base/tasks.h"
#include "hierarchy/instances.h"
#include "hierarchy/nodes.h"

namespace kanuka::hierarchy {

struct Level {
    PageMemory memory;
    size_t count = 0; // of instances, those that are left out with them
    double made = -1; // areas of all boxes, added up, as the tree was made; below 0 = nobody has asked yet
};

// As many rays meet a box as its area says: a tree whose boxes have grown by more is made anew.
inline constexpr double MostGrowth = 1.2;

// Of the boxes of a node, half the area of all together.
double half_areas(const Node& node);

// The nodes of a level; children come behind their parent.
class LevelNodes {
  public:
    explicit LevelNodes(PageMemory& memory);
    Header& header() const { return *reinterpret_cast<Header*>(m_bytes); }
    size_t size() const { return header().node_bytes / sizeof(Node); }
    // Of a node 1; 2 where the next is its box as the interval ends; and of that 0.
    uint32_t ends(size_t i) const { return m_ends[i]; }
    Node& operator[](size_t i) const { return reinterpret_cast<Node*>(m_bytes + header().nodes)[i]; }
    size_t number(const Children& nodes) const { // of the first
        return (size_t(nodes.offset) * UnitBytes - header().nodes) / sizeof(Node);
    }
    template <class Leaf>
    Leaf* leaves(const Children& children) const {
        return reinterpret_cast<Leaf*>(m_bytes + size_t(children.offset) * UnitBytes);
    }

  private:
    uint8_t* m_bytes;
    std::vector<uint8_t> m_ends;
};

// Boxes of inner nodes, and of the whole, from those of the nodes above leaves. Returns the areas that they
// had, and have.
std::pair<double, double> refit_inner(const LevelNodes& nodes, std::span<BoxOfEnds> boxes);

// Gives a node, with its other end, the boxes of its children. Returns the areas that they had, and have.
std::pair<double, double> rewrite(const LevelNodes& nodes, size_t n, Group& group, const BoxOfEnds (&box)[8]);

// Puts instances where they stand now. False: another tree has to be made, and this one is of no use any
// more. `instances` tells of one by its number: look(i, box) whether it stands, and in which BoxOfEnds;
// moves(i); write(i, leaf). The same bytes for any number of threads, but for addresses.
template <class Instances>
bool refit(Level& level, const Instances& instances) {
    constexpr size_t NodesATask = 512;
    const LevelNodes nodes(level.memory);
    if (nodes.header().root == NoRef)
        return false;
    struct Part {
        size_t leaves = 0;
        double before = 0, now = 0; // areas
    };
    std::vector<Part> parts((nodes.size() + NodesATask - 1) / NodesATask);
    LargeVector<BoxOfEnds> boxes(nodes.size());
    std::atomic<bool> fits{true};
    const auto write = [&]<class Leaf>(Leaf* leaves, const Group& group, BoxOfEnds(&box)[8]) {
        for (size_t i = 0; i < group.count; i++) {
            uint32_t number = 0;
            if constexpr (std::is_same_v<Leaf, MovingLeaf>)
                number = leaves[i].place.number;
            else
                number = leaves[i].number;
            if ((group.kind == Kind::Instance && instances.moves(number)) || !instances.look(number, box[i]))
                return false;
            instances.write(number, leaves[i]);
        }
        return true;
    };
    tasks::parallel_chunks(nodes.size(), NodesATask, [&](size_t begin, size_t end) {
        Part& part = parts[begin / NodesATask];
        for (size_t n = begin; n < end && fits; n++) {
            const Children children = Children::of(nodes[n].children);
            if (nodes.ends(n) == 0 || is_of_nodes(children.kind))
                continue;
            Group group{children.kind, uint8_t(children.count)};
            BoxOfEnds box[8];
            if (!(children.kind == Kind::Moving ? write(nodes.leaves<MovingLeaf>(children), group, box)
                                                : write(nodes.leaves<InstanceLeaf>(children), group, box)) ||
                (nodes.ends(n) == 1 && std::any_of(box, box + group.count, std::mem_fn(&BoxOfEnds::moves)))) {
                fits = false;
                return;
            }
            part.leaves += group.count;
            const auto [before, now] = rewrite(nodes, n, group, box);
            part.before += before, part.now += now;
            for (size_t i = 0; i < group.count; i++)
                boxes[n].begin.extend(box[i].begin), boxes[n].end.extend(box[i].end);
        }
    });
    Part all;
    for (const Part& part : parts)
        all.leaves += part.leaves, all.before += part.before, all.now += part.now;
    if (!fits || all.leaves != level.count) // what was left out may stand now
        return false;
    const auto [before, now] = refit_inner(nodes, boxes);
    if (level.made < 0)
        level.made = all.before + before;
    return all.now + now <= MostGrowth * level.made;
}

} // namespace kanuka::hierarchy
