#include "hierarchy/content.h"

#include <algorithm>
#include <span>

namespace kanuka::hierarchy {

void put(Digester& d, const GridView& grid) {
    d('g', grid.columns, grid.rows, grid.finer);
    d.bytes(grid.positions, sizeof(float) * 3 * size_t(grid.columns + 1) * size_t(grid.rows + 1));
}

void put(Digester& d, const MeshView& mesh) {
    d('m', uint64_t(mesh.vertices), uint64_t(mesh.faces), mesh.sides, mesh.is_grid);
    d.bytes(mesh.positions, sizeof(float) * 3 * mesh.vertices);
    d.bytes(mesh.corners, sizeof(uint32_t) * size_t(mesh.sides) * mesh.faces);
}

void put(Digester& d, const FibreView& fibre) {
    d('f', uint64_t(fibre.count), uint64_t(fibre.segments), fibre.balls);
    d.bytes(fibre.vertices, sizeof(float) * 4 * fibre.count);
    d.bytes(fibre.first, sizeof(uint32_t) * fibre.segments);
}

void put(Digester& d, const Lattices& lattices) {
    d(lattices.grids.exponent, lattices.meshes.exponent, lattices.fibres.places.exponent,
      lattices.fibres.least_radius);
}

std::string names_refusal_of(const Page& page, const ContentSize& of) {
    const Header& h = page.header();
    const std::span tiles(reinterpret_cast<const Tile*>(page.bytes() + h.tiles), h.tile_count);
    bool fits = std::ranges::all_of(tiles, [&](const Tile& t) { return t.grid < of.grids; });
    for (int k = 1; k < int(Kind::Count) && fits; k++) {
        const Kind kind = Kind(k);
        const Section& s = h.section[k];
        if (s.leaf_bytes == 0)
            continue;
        // What no name says is the first.
        const uint64_t count = is_of_grids(kind) ? of.grids : is_of_fibres(kind) ? of.segments : of.triangles;
        fits = count > 0;
        if (is_of_grids(kind)) // by tiles: cell_of()
            continue;
        const std::span names(reinterpret_cast<const uint32_t*>(page.bytes() + s.names), s.name_count);
        fits = fits && std::ranges::all_of(names, [&](uint32_t name) { return name < count; });
    }
    return fits ? "" : "it names what its content does not have";
}

} // namespace kanuka::hierarchy
