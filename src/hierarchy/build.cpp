#include "hierarchy/build.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/tasks.h"
#include "hierarchy/fibre_leaves.h"
#include "hierarchy/grid_leaves.h"
#include "hierarchy/mesh_leaves.h"
#include "hierarchy/nodes.h"

namespace kanuka::hierarchy {

namespace {

constexpr size_t GroupsATask = 256;

size_t aligned(size_t bytes) {
    return (bytes + sizeof(Node) - 1) / sizeof(Node) * sizeof(Node);
}

// Where everything goes: header, tiles, leaves by kind, names by kind, nodes.
class Layout {
  public:
    // `ends`: leaves at each place, 2 of what changes.
    Layout(std::span<const Group> groups, size_t tiles, uint32_t ends)
        : m_offset(groups.size()), m_ends(ends) {
        size_t at = sizeof(Header);
        header.tiles = at, header.tile_count = uint32_t(tiles);
        at = aligned(at + tiles * sizeof(Tile));
        for (int k = 1; k < int(Kind::Count); k++) {
            Section& s = header.section[k];
            s.leaves = at;
            for (size_t i = 0; i < groups.size(); i++)
                if (int(groups[i].kind) == k) {
                    m_offset[i] = at;
                    at = aligned(at + groups[i].count * stride(Kind(k)));
                }
            s.leaf_bytes = at - s.leaves;
        }
        at = aligned(at + PaddingBytes);
        for (int k = 1; k < int(Kind::Count); k++) {
            Section& s = header.section[k];
            s.names = at;
            s.name_count = (s.leaf_bytes / stride(Kind(k)) + 1) * names_of_leaf(Kind(k));
            if (s.leaf_bytes == 0)
                s.name_count = 0;
            at = aligned(at + s.name_count * sizeof(uint32_t));
        }
        header.nodes = at;
    }
    size_t stride(Kind kind) const { return UnitsOf[int(kind)] * UnitBytes * m_ends; }
    size_t leaf(size_t group, const Group& g, int i) const {
        return m_offset[group] + unsigned(i) * stride(g.kind);
    }
    size_t offset(size_t group) const { return m_offset[group]; }

    Header header{};

  private:
    LargeVector<size_t> m_offset;
    uint32_t m_ends;
};

// Leaves of all kinds, and groups of them one kind behind the other.
class AllLeaves {
  public:
    AllLeaves(const Content& content, const Lattices& lattices)
        : m_grids(content.grids, lattices.grids),
          m_triangles(content.meshes, 3, lattices.meshes, lattices.grids),
          m_quads(content.meshes, 4, lattices.meshes, lattices.grids),
          m_fibres(content.fibres, lattices.fibres), m_ends(content.changes() ? 2 : 1),
          m_groups(m_grids.groups()) {
        m_end_of_grids = m_groups.size();
        m_end_of_triangles = add(m_triangles.groups());
        m_end_of_quads = add(m_quads.groups());
        add(m_fibres.groups());
    }

    const GridLeaves& grids() const { return m_grids; }
    const LargeVector<Group>& groups() const { return m_groups; }
    uint32_t ends() const { return m_ends; } // leaves at each place: 2 of what changes
    // Calls `with` with whatever made the group.
    template <class With>
    auto of_group(size_t g, const With& with) const {
        return g < m_end_of_grids       ? with(m_grids)
               : g < m_end_of_triangles ? with(m_triangles)
               : g < m_end_of_quads     ? with(m_quads)
                                        : with(m_fibres);
    }
    // Boxes of the leaves of a group of what changes, at both ends of the interval. What is between is
    // rounded to floats, vertices and planes alike: the boxes are so much wider (docs/hierarchy.md,
    // "Robustness").
    std::array<Group, 2> at_ends(size_t g) const {
        std::array<Group, 2> both{m_groups[g], m_groups[g]};
        of_group(g, [&](const auto& leaves) {
            for (int i = 0; i < both[0].count; i++) {
                Bounds3f box[2] = {leaves.box(m_groups[g], i, 0), leaves.box(m_groups[g], i, 1)};
                for (int a = 0; a < 3; a++) {
                    float largest = 0;
                    for (const Bounds3f& b : box)
                        largest = std::max({largest, std::abs(b.lo[a]), std::abs(b.hi[a])});
                    for (Bounds3f& b : box)
                        b.lo[a] -= 0x1p-20f * largest, b.hi[a] += 0x1p-20f * largest;
                }
                both[0].box[i] = box[0], both[1].box[i] = box[1];
            }
        });
        return both;
    }

  private:
    size_t add(const LargeVector<Group>& more) {
        m_groups.insert(m_groups.end(), more.begin(), more.end());
        return m_groups.size();
    }

    const GridLeaves m_grids;
    const MeshLeaves m_triangles, m_quads;
    const FibreLeaves m_fibres;
    uint32_t m_ends;
    LargeVector<Group> m_groups;
    size_t m_end_of_grids, m_end_of_triangles, m_end_of_quads;
};

BoxesAtEnds boxes_at_ends(const AllLeaves& all) {
    BoxesAtEnds boxes;
    for (LargeVector<Bounds3f>& b : boxes)
        b.resize(all.groups().size());
    tasks::parallel_chunks(all.groups().size(), GroupsATask, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; g++) {
            const std::array<Group, 2> both = all.at_ends(g);
            boxes[0][g] = both[0].bounds(), boxes[1][g] = both[1].bounds();
        }
    });
    return boxes;
}

// Writes what a group has: leaves, their names, its node or, of what changes, two.
void write_group(const AllLeaves& all, const Layout& layout, size_t g, Node* nodes, uint8_t* bytes) {
    const Group& group = all.groups()[g];
    const Section& s = layout.header.section[int(group.kind)];
    uint32_t* const names = reinterpret_cast<uint32_t*>(bytes + s.names);
    const size_t size = UnitsOf[int(group.kind)] * UnitBytes;
    all.of_group(g, [&]<class Leaves>(const Leaves& leaves) {
        for (int i = 0; i < group.count; i++) {
            const size_t at = layout.leaf(g, group, i), number = (at - s.leaves) / layout.stride(group.kind);
            for (uint32_t end = 0; end < all.ends(); end++)
                leaves.write(group, i, bytes + at + end * size, int(end));
            if constexpr (std::is_same_v<Leaves, GridLeaves>) {
                names[number] = leaves.name(group, i);
            } else {
                uint32_t eight[8];
                leaves.names(group, i, eight);
                std::memcpy(names + number * 8, eight, sizeof eight);
            }
        }
    });
    const uint32_t children =
        Children{group.kind, group.count, uint32_t(layout.offset(g) / UnitBytes)}.word();
    if (all.ends() == 1)
        return write_node(*nodes, group, children);
    const std::array<Group, 2> both = all.at_ends(g);
    for (size_t end = 0; end < 2; end++)
        write_node(nodes[end], both[end], children);
}

} // namespace

bool Content::changes() const {
    const auto later = [](const auto& view) { return view.later != nullptr; };
    return std::ranges::any_of(grids, later) || std::ranges::any_of(meshes, later) ||
           std::ranges::any_of(fibres, later);
}

StepVotes votes_of(const Content& content) {
    constexpr size_t GridsATask = 64, FacesATask = 65536;
    std::vector<StepVotes> votes((content.grids.size() + GridsATask - 1) / GridsATask);
    tasks::parallel_chunks(content.grids.size(), GridsATask, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; g++)
            GridLeaves::vote(content.grids[g], votes[begin / GridsATask]);
    });
    StepVotes all;
    for (const StepVotes& v : votes)
        all.add(v);
    for (const MeshView& m : content.meshes) {
        std::vector<StepVotes> of_faces((m.triangles() + FacesATask - 1) / FacesATask);
        tasks::parallel_chunks(m.triangles(), FacesATask, [&](size_t begin, size_t end) {
            for (size_t f = begin; f < end; f++)
                MeshLeaves::vote(m, f, content.fine_meshes, of_faces[begin / FacesATask]);
        });
        for (const StepVotes& v : of_faces)
            all.add(v);
    }
    return all;
}

FibreLattice fibre_lattice_of(std::span<const FibreView> fibres) {
    constexpr size_t SegmentsATask = 65536;
    FibreVotes all;
    for (const FibreView& f : fibres) {
        std::vector<FibreVotes> votes((f.segments + SegmentsATask - 1) / SegmentsATask);
        tasks::parallel_chunks(f.segments, SegmentsATask, [&](size_t begin, size_t end) {
            for (size_t s = begin; s < end; s++)
                FibreLeaves::vote(f, s, votes[begin / SegmentsATask]);
        });
        for (const FibreVotes& v : votes)
            all.add(v);
    }
    return all.lattice();
}

PageMemory build(const Content& content, const Lattice& lattice) {
    return build(content, {lattice, lattice, fibre_lattice_of(content.fibres)});
}

PageMemory build(const Content& content, const Lattices& lattices) {
    const AllLeaves all(content, lattices);
    const std::span<const Group> groups = all.groups();
    const bool changes = all.ends() == 2;
    const std::vector<Tile>& tiles = all.grids().tiles();
    Layout layout(groups, tiles.size(), all.ends());
    Header& h = layout.header;
    BoxesAtEnds at_ends;
    if (changes)
        at_ends = boxes_at_ends(all);
    NodeTree tree = make_nodes(groups, h.nodes, changes ? &at_ends : nullptr);
    h.node_bytes = tree.nodes.size() * sizeof(Node);
    h.magic = Magic, h.version = Version;
    h.bytes = h.nodes + h.node_bytes;
    if (h.bytes > Children::MostBytes)
        throw Error("a page of the ray tracer is larger than 2 GiB");
    h.step = power_of_two(std::min(lattices.grids.exponent, lattices.meshes.exponent));
    h.root = groups.empty() ? NoRef : make_ref(changes ? Kind::Changing : Kind::Nodes, h.nodes);
    h.tile_log = uint32_t(all.grids().tile_log());
    Bounds3f bounds;
    for (size_t g = 0; g < groups.size(); g++)
        if (changes)
            bounds.extend(at_ends[0][g]), bounds.extend(at_ends[1][g]);
        else
            bounds.extend(groups[g].bounds());
    for (int a = 0; a < 3; a++)
        h.lower[a] = bounds.lo[a], h.upper[a] = bounds.hi[a];

    PageMemory memory(h.bytes);
    uint8_t* const bytes = reinterpret_cast<uint8_t*>(memory.data());
    if (!tiles.empty()) // of nothing there is no address
        std::memcpy(bytes + h.tiles, tiles.data(), tiles.size() * sizeof(Tile));
    tasks::parallel_chunks(groups.size(), GroupsATask, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; g++)
            write_group(all, layout, g, &tree.nodes[tree.leaf_at[g]], bytes);
    });
    if (!tree.nodes.empty())
        std::memcpy(bytes + h.nodes, tree.nodes.data(), h.node_bytes);
    std::memcpy(bytes, &h, sizeof h);
    h.checksum = checksum_of(memory.bytes());
    std::memcpy(bytes, &h, sizeof h);
    return memory;
}

Cell cell_of(const Page& page, Ref leaf, uint32_t cell) {
    const Header& h = page.header();
    const uint32_t name = page.name(leaf), side = (1u << h.tile_log) - 1;
    const uint64_t number = uint64_t(name) >> (2 * h.tile_log);
    if (number >= h.tile_count)
        return {0, 0, 0}; // damaged
    const Tile& tile = reinterpret_cast<const Tile*>(page.bytes() + h.tiles)[number];
    const uint32_t u = (uint32_t(tile.u) << h.tile_log) + (name & side),
                   v = (uint32_t(tile.v) << h.tile_log) + (name >> h.tile_log & side);
    return {tile.grid, int(u * 4 + cell % 4), int(v * 4 + cell / 4)};
}

} // namespace kanuka::hierarchy
