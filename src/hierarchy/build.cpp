#include "hierarchy/build.h"

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
    Layout(std::span<const Group> groups, size_t tiles) : m_offset(groups.size()) {
        size_t at = sizeof(Header);
        header.tiles = at, header.tile_count = uint32_t(tiles);
        at = aligned(at + tiles * sizeof(Tile));
        for (int k = 1; k < int(Kind::Count); k++) {
            Section& s = header.section[k];
            s.leaves = at;
            for (size_t i = 0; i < groups.size(); i++)
                if (int(groups[i].kind) == k) {
                    m_offset[i] = at;
                    at = aligned(at + groups[i].count * UnitsOf[k] * UnitBytes);
                }
            s.leaf_bytes = at - s.leaves;
        }
        at = aligned(at + PaddingBytes);
        for (int k = 1; k < int(Kind::Count); k++) {
            Section& s = header.section[k];
            s.names = at;
            s.name_count = (s.leaf_bytes / (UnitsOf[k] * UnitBytes) + 1) * names_of_leaf(Kind(k));
            if (s.leaf_bytes == 0)
                s.name_count = 0;
            at = aligned(at + s.name_count * sizeof(uint32_t));
        }
        header.nodes = at;
    }
    size_t leaf(size_t group, const Group& g, int i) const {
        return m_offset[group] + unsigned(i) * UnitsOf[int(g.kind)] * UnitBytes;
    }
    size_t offset(size_t group) const { return m_offset[group]; }

    Header header{};

  private:
    LargeVector<size_t> m_offset;
};

} // namespace

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
    const GridLeaves grids(content.grids, lattices.grids);
    const MeshLeaves triangles(content.meshes, 3, lattices.meshes, lattices.grids),
        quads(content.meshes, 4, lattices.meshes, lattices.grids);
    const FibreLeaves fibres(content.fibres, lattices.fibres);
    LargeVector<Group> groups = grids.groups();
    const auto add = [&groups](const LargeVector<Group>& more) {
        groups.insert(groups.end(), more.begin(), more.end());
        return groups.size();
    };
    const size_t end_of_grids = groups.size(), end_of_triangles = add(triangles.groups()),
                 end_of_quads = add(quads.groups());
    add(fibres.groups());
    Layout layout(groups, grids.tiles().size());
    Header& h = layout.header;
    NodeTree tree = make_nodes(groups, h.nodes);
    h.node_bytes = tree.nodes.size() * sizeof(Node);
    h.magic = Magic, h.version = Version;
    h.bytes = h.nodes + h.node_bytes;
    if (h.bytes > Children::MostBytes)
        throw Error("a page of the ray tracer is larger than 2 GiB");
    h.step = power_of_two(std::min(lattices.grids.exponent, lattices.meshes.exponent));
    h.root = groups.empty() ? NoRef : make_ref(Kind::Nodes, h.nodes);
    h.tile_log = uint32_t(grids.tile_log());
    Bounds3f bounds;
    for (const Group& g : groups)
        bounds.extend(g.bounds());
    for (int a = 0; a < 3; a++)
        h.lower[a] = bounds.lo[a], h.upper[a] = bounds.hi[a];

    PageMemory memory(h.bytes);
    uint8_t* const bytes = reinterpret_cast<uint8_t*>(memory.data());
    if (!grids.tiles().empty()) // of nothing there is no address
        std::memcpy(bytes + h.tiles, grids.tiles().data(), grids.tiles().size() * sizeof(Tile));
    tasks::parallel_chunks(groups.size(), GroupsATask, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; g++) {
            const Group& group = groups[g];
            const Section& s = h.section[int(group.kind)];
            const size_t size = UnitsOf[int(group.kind)] * UnitBytes;
            for (int i = 0; i < group.count; i++) {
                const size_t at = layout.leaf(g, group, i), number = (at - s.leaves) / size;
                uint32_t* const names = reinterpret_cast<uint32_t*>(bytes + s.names);
                const auto write_eight = [&](const auto& leaves) {
                    uint32_t eight[8];
                    leaves.write(group, i, bytes + at);
                    leaves.names(group, i, eight);
                    std::memcpy(names + number * 8, eight, sizeof eight);
                };
                if (g >= end_of_quads) {
                    write_eight(fibres);
                } else if (g >= end_of_grids) {
                    write_eight(g < end_of_triangles ? triangles : quads);
                } else {
                    grids.write(group, i, bytes + at);
                    names[number] = grids.name(group, i);
                }
            }
            const Children c{group.kind, group.count, uint32_t(layout.offset(g) / UnitBytes)};
            write_node(tree.nodes[tree.leaf_at[g]], group, c.word());
        }
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
