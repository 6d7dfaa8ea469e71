#include "hierarchy/world.h"

#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/tasks.h"
#include "hierarchy/instances.h"
#include "hierarchy/nodes.h"

namespace kanuka::hierarchy {

namespace {

constexpr size_t PlacesATask = 4096;

struct Place {
    InstanceLeaf leaf;
    Bounds3f box;
    bool stands = false; // false: no ray can be taken there
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

Place place_of(const Placement& p, const Page& page, uint32_t number) {
    Place out;
    if (!is_affine(p.world_from_page) || !invert(p.world_from_page, out.leaf.page_from_world))
        return out;
    for (size_t a = 0; a < 3; a++)
        out.leaf.origin[a] = float(p.world_from_page.m[a][3]);
    out.leaf.page = p.page, out.leaf.number = number;
    out.leaf.unused[0] = out.leaf.unused[1] = 0;
    out.box = box_of(p.world_from_page, page.bounds());
    out.stands = is_somewhere(out.box.lo) && is_somewhere(out.box.hi);
    return out;
}

// Runs of at most eight places that lie together.
struct Groups {
    std::vector<Group> groups;   // source: of the first in `order`
    std::vector<uint32_t> order; // places
};
Groups groups_of(const std::vector<Place>& places) {
    std::vector<Item> items;
    for (size_t i = 0; i < places.size(); i++)
        if (places[i].stands)
            items.emplace_back(places[i].box, uint32_t(i));
    Groups out;
    if (items.empty())
        return out;
    const SplitTree tree = split_all(std::move(items), 8);
    for (const Item& item : tree.items)
        out.order.push_back(item.index);
    for (const SplitTree::Branch& b : tree.branches)
        if (b.left < 0)
            out.groups.push_back(
                {.kind = Kind::Instance, .count = uint8_t(b.end - b.begin), .source = b.begin});
    tasks::parallel_chunks(out.groups.size(), PlacesATask / 8, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k++) {
            Group& g = out.groups[k];
            for (uint32_t i = 0; i < g.count; i++)
                g.box[i] = places[out.order[g.source + i]].box;
        }
    });
    return out;
}

PageMemory build_level(const std::vector<Place>& places) {
    const Groups all = groups_of(places);
    Header h{};
    h.magic = Magic, h.version = Version;
    const size_t first = sizeof(Header); // of the instances, a line each
    h.nodes = first + all.order.size() * sizeof(InstanceLeaf);
    NodeTree tree = make_nodes(all.groups, h.nodes);
    h.node_bytes = tree.nodes.size() * sizeof(Node);
    h.bytes = h.nodes + h.node_bytes;
    if (h.bytes + PaddingBytes > Children::MostBytes)
        throw Error("a level of instances of the ray tracer is larger than 2 GiB");
    h.root = all.groups.empty() ? NoRef : make_ref(Kind::Nodes, h.nodes);
    Bounds3f bounds;
    for (const Group& g : all.groups)
        bounds.extend(g.bounds());
    for (int a = 0; a < 3; a++)
        h.lower[a] = bounds.lo[a], h.upper[a] = bounds.hi[a];

    PageMemory memory(h.bytes + PaddingBytes);
    uint8_t* const bytes = reinterpret_cast<uint8_t*>(memory.data());
    tasks::parallel_chunks(all.groups.size(), PlacesATask / 8, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k++) {
            const Group& g = all.groups[k];
            const size_t at = first + g.source * sizeof(InstanceLeaf);
            for (int i = 0; i < g.count; i++)
                std::memcpy(bytes + at + unsigned(i) * sizeof(InstanceLeaf),
                            &places[all.order[g.source + uint32_t(i)]].leaf, sizeof(InstanceLeaf));
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
    m_pages.push_back(page);
    m_nesting.push_back(0);
    return uint32_t(m_pages.size() - 1);
}

uint32_t World::add(std::span<const Placement> placements) {
    int nesting = 1;
    for (const Placement& p : placements) {
        if (p.page >= m_pages.size())
            throw Error("an instance stands for page " + std::to_string(p.page) + " of " +
                        std::to_string(m_pages.size()));
        nesting = std::max(nesting, m_nesting[p.page] + 1);
    }
    if (nesting > MostNesting)
        throw Error("instances lie " + std::to_string(nesting) + " deep in each other; at most " +
                    std::to_string(MostNesting) + " can be traced");
    std::vector<Place> places(placements.size());
    tasks::parallel_chunks(placements.size(), PlacesATask, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            if (m_pages[placements[i].page].header().root != NoRef) // of nothing there is nothing to see
                places[i] = place_of(placements[i], m_pages[placements[i].page], uint32_t(i));
    });
    for (size_t i = 0; i < places.size(); i++)
        m_left_out += !places[i].stands && m_pages[placements[i].page].header().root != NoRef;
    m_levels.push_back(build_level(places));
    const uint32_t number = add(m_levels.back().page());
    m_nesting[number] = nesting;
    return number;
}

size_t World::level_bytes() const {
    size_t bytes = 0;
    for (const PageMemory& level : m_levels)
        bytes += level.size();
    return bytes;
}

} // namespace kanuka::hierarchy
