#include "hierarchy/world.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/tasks.h"
#include "hierarchy/instances.h"
#include "hierarchy/nodes.h"

namespace kanuka::hierarchy {

namespace {

constexpr size_t PlacesATask = 4096;

// An instance as a level is told of it.
struct Placed {
    Transform world_from_page;
    uint32_t page;
    bool stays = false;
};

bool is_affine(const Transform& t) {
    for (const auto& row : t.m)
        for (const double v : row)
            if (!std::isfinite(v))
                return false;
    return t.m[3][0] == 0 && t.m[3][1] == 0 && t.m[3][2] == 0 && t.m[3][3] == 1;
}

// The adjugate by the determinant, column by column. False where floats do not hold it.
bool invert(const Transform& t, float (&inverse)[9]) {
    const auto& m = t.m;
    const double det = t.determinant3();
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            const auto at = [&](int i, int j) { return m[size_t(i)][size_t(j)]; };
            const double v = (at(r1, c1) * at(r2, c2) - at(r1, c2) * at(r2, c1)) / det;
            if (!(std::abs(v) < double(LargestCoordinate)))
                return false;
            inverse[3 * c + r] = float(v);
        }
    return true;
}

// Around the eight corners. Rays are made for the page by numbers that are rounded: the box is a little
// larger.
Bounds3f box_of(const Transform& t, const Bounds3f& b) {
    Bounds3f box;
    for (size_t a = 0; a < 3; a++) {
        double middle = t.m[a][3], half = 0;
        for (int k = 0; k < 3; k++) {
            middle += t.m[a][size_t(k)] * (double(b.lo[k]) + double(b.hi[k])) / 2;
            half += std::abs(t.m[a][size_t(k)]) * (double(b.hi[k]) - double(b.lo[k])) / 2;
        }
        const double more = 0x1p-20 * (std::abs(middle) + half);
        box.lo[int(a)] = float(middle - half - more), box.hi[int(a)] = float(middle + half + more);
    }
    return box;
}

// False: no ray can be taken there.
bool make_leaf(const Placed& p, uint32_t number, InstanceLeaf& leaf) {
    if (!is_affine(p.world_from_page) || !invert(p.world_from_page, leaf.page_from_world))
        return false;
    for (size_t a = 0; a < 3; a++)
        leaf.origin[a] = float(p.world_from_page.m[a][3]);
    leaf.page = p.page, leaf.number = number, leaf.stays = p.stays, leaf.unused = 0;
    return true;
}

// Runs of at most eight instances that lie together; `source`: of the first in the order of the items.
LargeVector<Group> groups_of(const SplitTree& tree) {
    LargeVector<Group> groups;
    for (const SplitTree::Branch& b : tree.branches)
        if (b.left < 0)
            groups.push_back(
                {.kind = Kind::Instance, .count = uint8_t(b.end - b.begin), .box = {}, .source = b.begin});
    tasks::parallel_chunks(groups.size(), PlacesATask / 8, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k++)
            for (uint32_t i = 0; i < groups[k].count; i++) {
                const Item& item = tree.items[groups[k].source + i];
                groups[k].box[i] = {{item.lo[0], item.lo[1], item.lo[2]},
                                    {item.hi[0], item.hi[1], item.hi[2]}};
            }
    });
    return groups;
}

// `write(item, leaf)` makes the leaf of an instance.
template <class Write>
PageMemory build_level(LargeVector<Item> items, const Write& write) {
    const SplitTree order = items.empty() ? SplitTree() : split_all(std::move(items), 8);
    const LargeVector<Group> groups = groups_of(order);
    Header h{};
    h.magic = Magic, h.version = Version;
    const size_t first = sizeof(Header); // of the instances, a line each
    h.nodes = first + order.items.size() * sizeof(InstanceLeaf);
    NodeTree tree = make_nodes(groups, h.nodes);
    h.node_bytes = tree.nodes.size() * sizeof(Node);
    h.bytes = h.nodes + h.node_bytes;
    if (h.bytes + PaddingBytes > Children::MostBytes)
        throw Error("a level of instances of the ray tracer is larger than 2 GiB");
    h.root = groups.empty() ? NoRef : make_ref(Kind::Nodes, h.nodes);
    Bounds3f bounds;
    for (const Group& g : groups)
        bounds.extend(g.bounds());
    for (int a = 0; a < 3; a++)
        h.lower[a] = bounds.lo[a], h.upper[a] = bounds.hi[a];

    PageMemory memory(h.bytes + PaddingBytes);
    uint8_t* const bytes = reinterpret_cast<uint8_t*>(memory.data());
    tasks::parallel_chunks(groups.size(), PlacesATask / 8, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k++) {
            const Group& g = groups[k];
            const size_t at = first + g.source * sizeof(InstanceLeaf);
            for (uint32_t i = 0; i < g.count; i++)
                write(order.items[g.source + i].index,
                      *reinterpret_cast<InstanceLeaf*>(bytes + at + i * sizeof(InstanceLeaf)));
            write_node(tree.nodes[tree.leaf_at[k]], g,
                       Children{Kind::Instance, g.count, uint32_t(at / UnitBytes)}.word());
        }
    });
    if (!tree.nodes.empty())
        std::memcpy(bytes + h.nodes, tree.nodes.data(), h.node_bytes);
    std::memcpy(bytes, &h, sizeof h);
    return memory;
}

} // namespace

uint32_t World::add(const Page& page) {
    const uint32_t number = uint32_t(m_pages.size());
    m_pages.emplace_back(reinterpret_cast<const std::byte*>(page.bytes()), number);
    m_nesting.push_back(0);
    return number;
}

int World::nesting_of(uint32_t page) const {
    if (page >= m_pages.size())
        throw Error("an instance stands for page " + std::to_string(page) + " of " +
                    std::to_string(m_pages.size()));
    return m_nesting[page] + 1;
}

template <class PlacementOf>
uint32_t World::add_level(size_t count, int nesting, const PlacementOf& placement_of) {
    if (nesting > MostNesting)
        throw Error("instances lie " + std::to_string(nesting) + " deep in each other; at most " +
                    std::to_string(MostNesting) + " can be traced");
    LargeVector<Item> items(count);
    LargeVector<uint8_t> state(count); // 1: it stands; 2: it is left out
    tasks::parallel_chunks(count, PlacesATask, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const Placed p = placement_of(i);
            const Page& page = m_pages[p.page];
            if (page.header().root == NoRef) // of nothing there is nothing to see
                continue;
            InstanceLeaf leaf;
            const Bounds3f box = p.stays ? page.bounds() : box_of(p.world_from_page, page.bounds());
            const bool stands =
                make_leaf(p, uint32_t(i), leaf) && is_somewhere(box.lo) && is_somewhere(box.hi);
            state[i] = stands ? 1 : 2;
            items[i] = Item(box, uint32_t(i));
        }
    });
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        m_left_out += state[i] == 2;
        if (state[i] == 1)
            items[kept++] = items[i];
    }
    items.resize(kept);
    m_levels.push_back(build_level(
        std::move(items), [&](uint32_t i, InstanceLeaf& leaf) { make_leaf(placement_of(i), i, leaf); }));
    const uint32_t number = add(m_levels.back().page());
    m_nesting[number] = nesting;
    return number;
}

uint32_t World::add(std::span<const Placement> placements) {
    int nesting = 1;
    for (const Placement& p : placements)
        nesting = std::max(nesting, nesting_of(p.page));
    return add_level(placements.size(), nesting,
                     [&](size_t i) { return Placed{placements[i].world_from_page, placements[i].page}; });
}

uint32_t World::add(std::span<const Placements> runs) {
    int nesting = 1;
    std::vector<size_t> first; // instance of each run
    size_t count = 0;
    for (const Placements& run : runs) {
        nesting = std::max(nesting, nesting_of(run.page));
        first.push_back(count);
        count += run.world_from_page.empty() ? 1 : run.world_from_page.size();
    }
    return add_level(count, nesting, [&](size_t i) {
        const size_t r = size_t(std::upper_bound(first.begin(), first.end(), i) - first.begin()) - 1;
        Placed p{{}, runs[r].page, runs[r].world_from_page.empty()};
        if (p.stays)
            return p;
        const auto rows = runs[r].world_from_page[i - first[r]];
        for (size_t k = 0; k < 12; k++)
            p.world_from_page.m[k / 4][k % 4] = double(rows[k]);
        return p;
    });
}

size_t World::level_bytes() const {
    size_t bytes = 0;
    for (const PageMemory& level : m_levels)
        bytes += level.size();
    return bytes;
}

} // namespace kanuka::hierarchy
