#include "hierarchy/nodes.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "hierarchy/lattice.h"
#include "hierarchy/page.h"

namespace kanuka::hierarchy {

namespace {

constexpr int Widest = 255;                 // planes from the node's origin
constexpr int64_t FurthestOrigin = 1 << 23; // of origins, in steps of the node

// The planes around, in steps.
double first_step(float lo, double per_step) {
    return std::floor(double(lo) * per_step - Node::Slack);
}
double last_step(float hi, double per_step) {
    return std::ceil(double(hi) * per_step + Node::Slack);
}

struct Axis {
    int64_t origin;
    int exponent;
};
// Where an axis begins, and its step, for 255 steps to reach from `lo` to `hi`.
Axis fit_axis(float lo, float hi) {
    const float largest = std::max(std::abs(lo), std::abs(hi));
    int e = std::max({exponent_of(hi - lo) - 8, exponent_of(largest) - 23, -125});
    for (;; e++) {
        const double per_step = double_power_of_two(-e);
        const double origin = first_step(lo, per_step), last = last_step(hi, per_step);
        if (origin >= -double(FurthestOrigin) && origin < double(FurthestOrigin) && last - origin <= Widest)
            return {int64_t(origin), e};
    }
}

// What planes of a node that is as large as a box make of the boxes in it: larger ones, by a step of each
// axis in the mean.
struct Coarse {
    float step[3];
    explicit Coarse(const Bounds3f& node) {
        for (int a = 0; a < 3; a++)
            step[a] = power_of_two(fit_axis(node.lo[a], node.hi[a]).exponent);
    }
    float half_area(const SplitTree::Branch& b) const {
        const float x = b.hi[0] - b.lo[0] + step[0], y = b.hi[1] - b.lo[1] + step[1],
                    z = b.hi[2] - b.lo[2] + step[2];
        return x * y + y * z + z * x;
    }
};

class Collapse {
  public:
    // `groups`: of each branch that is a leaf. `moves`: of each group; none = all do where `at_ends` is
    // there.
    Collapse(const SplitTree& tree, LargeVector<uint32_t> groups, size_t nodes_at,
             const BoxesAtEnds* at_ends = nullptr, std::span<const uint8_t> moves = {})
        : m_tree(tree), m_groups(std::move(groups)), m_first_unit(uint32_t(nodes_at / UnitBytes)),
          m_two(moves.empty() ? Kind::Changing : Kind::MovingNodes) {
        m_out.leaf_at.resize((tree.branches.size() + 1) / 2);
        m_out.leaf_ends.resize(m_out.leaf_at.size());
        if (at_ends)
            measure(*at_ends, moves);
    }
    NodeTree run() {
        const uint32_t ends = ends_of(0);
        // A node for each group and, as a rule, less than a fourth of them above.
        m_out.nodes.reserve(ends * (m_out.leaf_at.size() + m_out.leaf_at.size() / 4 + 1));
        m_out.nodes.resize(ends);
        m_out.root = kind_of(ends);
        write(0, 0, 0, ends);
        return std::move(m_out);
    }

  private:
    using Branch = SplitTree::Branch;
    const Branch& branch(int32_t i) const { return m_tree.branches[size_t(i)]; }
    Kind kind_of(uint32_t ends) const { return ends == 1 ? Kind::Nodes : m_two; }
    // Of a node: 2 where it has to be of two ends.
    uint32_t ends_of(int32_t of) const { return m_moves.empty() ? 1 : 1 + m_moves[size_t(of)]; }
    Bounds3f box(int32_t of, uint32_t end) const {
        return m_box[0].empty() ? branch(of).box() : m_box[end][size_t(of)];
    }
    void measure(const BoxesAtEnds& at_ends, std::span<const uint8_t> moves) {
        m_moves.resize(m_tree.branches.size());
        for (size_t end = 0; end < 2; end++)
            m_box[end].resize(m_tree.branches.size());
        for (size_t b = m_tree.branches.size(); b-- > 0;) { // children come after their parent
            const Branch& of = m_tree.branches[b];
            for (size_t end = 0; end < 2; end++) {
                Bounds3f& all = m_box[end][b];
                if (of.left < 0) {
                    all = at_ends[end][m_groups[b]];
                    continue;
                }
                all = m_box[end][size_t(of.left)];
                all.extend(m_box[end][size_t(of.right)]);
            }
            if (moves.empty())
                m_moves[b] = 1;
            else
                m_moves[b] =
                    of.left < 0 ? moves[m_groups[b]] : m_moves[size_t(of.left)] | m_moves[size_t(of.right)];
        }
    }

    // What rays save by the surface area heuristic: a node where the branch is, at the price of halves that
    // are as coarse as the node above. Of what is small in a large node that is nothing, or less.
    float gain_of_opening(const Branch& b, const Coarse& coarse) const {
        const Branch &left = branch(b.left), &right = branch(b.right);
        return coarse.half_area(b) + left.half_area + right.half_area - coarse.half_area(left) -
               coarse.half_area(right);
    }

    // `ends` of the node itself, which stands at `at`.
    void write(int32_t of, uint32_t at, int depth, uint32_t ends) {
        if (branch(of).left < 0) {
            m_out.leaf_at[m_groups[size_t(of)]] = at;
            m_out.leaf_ends[m_groups[size_t(of)]] = uint8_t(ends);
            return;
        }
        // Opens the largest child until there are eight; or, where the tree is too high to end within
        // DeepestNode, the highest, which takes three from its height.
        const bool by_height = depth + (branch(of).height + 2) / 3 + 1 >= DeepestNode;
        int32_t child[8] = {of};
        Group g{Kind::Nodes, 1};
        const Coarse coarse(branch(of).box());
        while (g.count < 8) {
            int best = -1;
            float most = g.count == 1 ? -FLT_MAX : 0;
            for (int i = 0; i < g.count; i++) {
                const Branch& b = branch(child[i]);
                if (b.left < 0)
                    continue;
                const float gain = by_height ? float(b.height) : gain_of_opening(b, coarse);
                if (gain > most)
                    most = gain, best = i;
            }
            if (best < 0)
                break;
            const Branch& b = branch(child[best]);
            child[best] = b.left, child[g.count++] = b.right;
        }
        uint32_t child_ends = 1; // children are of one kind
        for (int i = 0; i < g.count; i++)
            child_ends = std::max(child_ends, ends_of(child[i]));
        const uint32_t first = uint32_t(m_out.nodes.size());
        m_out.nodes.resize(first + g.count * child_ends);
        const uint32_t unit = m_first_unit + first * UnitsOf[int(Kind::Nodes)];
        for (uint32_t end = 0; end < ends; end++) {
            for (int i = 0; i < g.count; i++)
                g.box[i] = box(child[i], end);
            write_node(m_out.nodes[at + end], g, Children{kind_of(child_ends), g.count, unit}.word());
        }
        for (uint32_t i = 0; i < g.count; i++)
            write(child[i], first + i * child_ends, depth + 1, child_ends);
    }

    const SplitTree& m_tree;
    const LargeVector<uint32_t> m_groups;
    uint32_t m_first_unit;
    Kind m_two;                   // which kind nodes have that are two
    BoxesAtEnds m_box;            // of branches; none where nothing changes
    LargeVector<uint8_t> m_moves; // something in a branch does
    NodeTree m_out;
};

} // namespace

void write_node(Node& node, const Group& group, uint32_t children) {
    const Bounds3f all = group.bounds();
    for (int a = 0; a < 3; a++) {
        std::memset(node.plane[a][0], Widest, 8);
        std::memset(node.plane[a][1], 0, 8);
        const Axis axis = fit_axis(all.lo[a], all.hi[a]);
        const double per_step = double_power_of_two(-axis.exponent);
        for (int i = 0; i < group.count; i++) {
            const Bounds3f& b = group.box[i];
            const double origin = double(axis.origin);
            node.plane[a][0][i] = uint8_t(first_step(b.lo[a], per_step) - origin);
            node.plane[a][1][i] = uint8_t(last_step(b.hi[a], per_step) - origin);
        }
        node.frame[a] = int32_t(uint32_t(axis.origin) << 8) | (axis.exponent + 127);
    }
    node.children = children;
}

NodeTree make_nodes(std::span<const Group> groups, size_t nodes_at, const BoxesAtEnds* at_ends) {
    LargeVector<Item> items(groups.size());
    for (size_t i = 0; i < groups.size(); i++)
        items[i] = Item(groups[i].bounds(), uint32_t(i));
    if (items.empty())
        return {};
    const SplitTree tree = split_all(std::move(items), 1);
    LargeVector<uint32_t> numbers(tree.branches.size());
    for (size_t b = 0; b < numbers.size(); b++)
        if (tree.branches[b].left < 0)
            numbers[b] = tree.items[tree.branches[b].begin].index();
    return Collapse(tree, std::move(numbers), nodes_at, at_ends).run();
}

NodeTree make_nodes(const SplitTree& tree, size_t nodes_at, const MovingGroups* moving) {
    if (tree.branches.empty())
        return {};
    LargeVector<uint32_t> numbers(tree.branches.size());
    uint32_t next = 0;
    for (size_t b = 0; b < numbers.size(); b++)
        if (tree.branches[b].left < 0)
            numbers[b] = next++;
    if (!moving)
        return Collapse(tree, std::move(numbers), nodes_at).run();
    return Collapse(tree, std::move(numbers), nodes_at, &moving->at_ends, moving->moves).run();
}

Bounds3f box_of_child(const Node& node, int child) {
    Bounds3f box;
    for (int a = 0; a < 3; a++) {
        const double step = double_power_of_two((node.frame[a] & 255) - 127), origin = node.frame[a] >> 8;
        box.lo[a] = float((origin + node.plane[a][0][child]) * step); // exact
        box.hi[a] = float((origin + node.plane[a][1][child]) * step);
    }
    return box;
}

Bounds3f bounds_at(const ChangingNode& root, int end) {
    const Node& node = end == 0 ? root.begin : root.end;
    Bounds3f all;
    for (int i = 0; i < Children::of(node.children).count; i++)
        all.extend(box_of_child(node, i));
    return all;
}

} // namespace kanuka::hierarchy
