// Grids as leaves of 4x4 cells, in groups of 4x2 or 2x4 leaves.
#pragma once

#include <vector>

#include "hierarchy/build.h"
#include "hierarchy/encode.h"
#include "hierarchy/nodes.h"

namespace kanuka::hierarchy {

class GridLeaves {
  public:
    GridLeaves(std::span<const GridView> grids, const Lattice& lattice);

    const LargeVector<Group>& groups() const { return m_groups; } // `source` numbers them
    const std::vector<Tile>& tiles() const { return m_tiles; }
    int tile_log() const { return m_tile_log; }
    // Of a leaf of a group; at an end of the interval, 0 or 1.
    void write(const Group& group, int i, uint8_t* to, int end = 0) const;
    Bounds3f box(const Group& group, int i, int end) const;
    uint32_t name(const Group& group, int i) const;

    static void vote(const GridView& grid, StepVotes& votes);

  private:
    // Blocks of a group, within its tile.
    struct Part {
        uint32_t tile;
        uint8_t u[8], v[8];
    };
    struct Points {
        Vec3f at[LeafVertices];
        int columns, rows;
    };
    struct Block {
        // Where something of it is, in the middle of the interval; empty = nothing of it can be hit.
        Bounds3f box;
        Kind kind; // the smallest leaf that holds it, at both ends of the interval
    };
    struct Made { // of a tile
        std::vector<Part> parts;
        std::vector<Group> groups;
        std::vector<Block> blocks; // row by row, while it is made
        int width = 0;
    };
    void cut_into_tiles();
    Points points(uint32_t tile, int u, int v, int end) const;
    Block block(uint32_t tile, int u, int v) const;
    int ends(uint32_t tile) const { return m_grids[m_tiles[tile].grid].later ? 2 : 1; }
    Made groups_of(uint32_t tile) const;
    void add_part(Made& made, uint32_t tile, int u, int v, int width, int height) const;

    std::span<const GridView> m_grids;
    Lattice m_lattice;
    int m_tile_log = 0;
    std::vector<Tile> m_tiles;
    LargeVector<Part> m_parts;
    LargeVector<Group> m_groups;
};

} // namespace kanuka::hierarchy
