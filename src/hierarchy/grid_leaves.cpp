#include "hierarchy/grid_leaves.h"

#include <algorithm>
#include <cstring>

#include "base/error.h"
#include "base/tasks.h"

namespace kanuka::hierarchy {

namespace {

constexpr int LargestTile = 6; // log2 of its blocks to a side
constexpr size_t TilesATask = 16;
constexpr size_t TilesAtOnce = 1024; // what becomes of them is there twice

int blocks(int cells) {
    return (cells + 3) / 4;
}
bool has_cells(const GridView& g) {
    return g.columns > 0 && g.rows > 0;
}

Bounds3f bounds_of(const Vec3f* points, int count) {
    Bounds3f box;
    for (int i = 0; i < count; i++)
        if (is_somewhere(points[i]))
            box.extend(points[i]);
    return box;
}

float half_area(const Bounds3f& b) {
    const Vec3f d = b.diagonal();
    return b.empty() ? 0 : d.x * d.y + d.y * d.z + d.z * d.x;
}

} // namespace

GridLeaves::GridLeaves(std::span<const GridView> grids, const Lattice& lattice)
    : m_grids(grids), m_lattice(lattice) {
    cut_into_tiles();
    for (size_t first = 0; first < m_tiles.size(); first += TilesAtOnce) {
        std::vector<Made> made(std::min(TilesAtOnce, m_tiles.size() - first));
        tasks::parallel_chunks(made.size(), TilesATask, [&](size_t begin, size_t end) {
            for (size_t t = begin; t < end; t++)
                made[t] = groups_of(uint32_t(first + t));
        });
        for (Made& m : made)
            for (size_t i = 0; i < m.groups.size(); i++) {
                m.groups[i].source = uint32_t(m_parts.size());
                m_parts.push_back(m.parts[i]);
                m_groups.push_back(m.groups[i]);
            }
    }
}

void GridLeaves::cut_into_tiles() {
    int most = 1;
    for (const GridView& g : m_grids)
        if (has_cells(g))
            most = std::max({most, blocks(g.columns), blocks(g.rows)});
    while (m_tile_log < LargestTile && 1 << m_tile_log < most)
        m_tile_log++;
    // Small tiles are cheap, and large ones need long names: as small as leaves all tiles a number.
    const auto tiles_along = [&](int cells) { return (blocks(cells) + (1 << m_tile_log) - 1) >> m_tile_log; };
    const auto count = [&] {
        uint64_t n = 0;
        for (const GridView& g : m_grids)
            if (has_cells(g))
                n += uint64_t(tiles_along(g.columns)) * uint64_t(tiles_along(g.rows));
        return n;
    };
    while (m_tile_log > 0 && count() > uint64_t(1) << (32 - 2 * m_tile_log))
        m_tile_log--;
    if (count() >= uint64_t(1) << 32)
        throw Error("a page of the ray tracer has more than 2^32 tiles of grids");
    m_tiles.reserve(count());
    for (size_t g = 0; g < m_grids.size(); g++)
        if (has_cells(m_grids[g]))
            for (int v = 0; v < tiles_along(m_grids[g].rows); v++)
                for (int u = 0; u < tiles_along(m_grids[g].columns); u++)
                    m_tiles.push_back({uint32_t(g), uint16_t(u), uint16_t(v)});
}

GridLeaves::Points GridLeaves::points(uint32_t tile, int u, int v, int end) const {
    const Tile& t = m_tiles[tile];
    const GridView& g = m_grids[t.grid];
    const int column = ((int(t.u) << m_tile_log) + u) * 4, row = ((int(t.v) << m_tile_log) + v) * 4;
    Points p;
    p.columns = std::min(g.columns - column, 4), p.rows = std::min(g.rows - row, 4);
    for (int y = 0; y < LeafRow; y++)
        for (int x = 0; x < LeafRow; x++) {
            const size_t at = size_t(row + std::min(y, p.rows)) * size_t(g.columns + 1) +
                              size_t(column + std::min(x, p.columns));
            const float* from = (end == 0 ? g.positions : g.later) + 3 * at;
            const Vec3f q(from[0], from[1], from[2]);
            p.at[y * LeafRow + x] =
                is_somewhere(q) ? m_lattice.snap(q) : Vec3f(std::numeric_limits<float>::quiet_NaN());
        }
    return p;
}

GridLeaves::Block GridLeaves::block(uint32_t tile, int u, int v) const {
    Block block{{}, Kind::Grid32};
    Bounds3f box[2];
    for (int end = 0; end < ends(tile); end++) {
        const Points p = points(tile, u, v, end);
        box[end] = bounds_of(p.at, LeafVertices);
        if (box[end].empty()) // and so is what is halfway
            return block;
        const Frame frame(m_lattice, p.at);
        block.kind = std::max(block.kind, frame.fields() >= 0 ? Kind::Grid32
                                          : frame.holds_48()  ? Kind::Grid48
                                                              : Kind::GridFloat);
    }
    block.box = ends(tile) == 1 ? box[0] : halfway(box[0], box[1]);
    return block;
}

Bounds3f GridLeaves::box(const Group& group, int i, int end) const {
    const Part& part = m_parts[group.source];
    return bounds_of(points(part.tile, part.u[i], part.v[i], end).at, LeafVertices);
}

GridLeaves::Made GridLeaves::groups_of(uint32_t tile) const {
    const Tile& t = m_tiles[tile];
    const GridView& g = m_grids[t.grid];
    const int side = 1 << m_tile_log;
    const int width = std::min(blocks(g.columns) - int(t.u) * side, side),
              height = std::min(blocks(g.rows) - int(t.v) * side, side);
    // Boxes of all blocks: a square of 4x4 of them becomes two groups, side by side or one above the other,
    // whichever has less area.
    Made made;
    made.width = width;
    made.blocks.reserve(size_t(width) * size_t(height));
    for (int v = 0; v < height; v++)
        for (int u = 0; u < width; u++)
            made.blocks.push_back(block(tile, u, v));
    const auto area = [&](int u, int v, int w, int h) {
        Bounds3f b;
        for (int y = v; y < v + h; y++)
            for (int x = u; x < u + w; x++)
                b.extend(made.blocks[size_t(y * width + x)].box);
        return half_area(b);
    };
    for (int v = 0; v < height; v += 4)
        for (int u = 0; u < width; u += 4) {
            const int w = std::min(width - u, 4), h = std::min(height - v, 4);
            const bool tall =
                w == 4 && h == 4 &&
                area(u, v, 2, 4) + area(u + 2, v, 2, 4) < area(u, v, 4, 2) + area(u, v + 2, 4, 2);
            if (tall) {
                add_part(made, tile, u, v, 2, 4);
                add_part(made, tile, u + 2, v, 2, 4);
            } else {
                add_part(made, tile, u, v, w, std::min(h, 2));
                if (h > 2)
                    add_part(made, tile, u, v + 2, w, h - 2);
            }
        }
    made.blocks = {};
    return made;
}

void GridLeaves::add_part(Made& made, uint32_t tile, int u, int v, int width, int height) const {
    Part part{tile, {}, {}};
    Group group{Kind::Grid32, 0};
    for (int y = v; y < v + height; y++)
        for (int x = u; x < u + width; x++) {
            const auto& [box, kind] = made.blocks[size_t(y * made.width + x)];
            if (box.empty())
                continue;
            group.kind = std::max(group.kind, kind); // all of a group are as the largest
            part.u[group.count] = uint8_t(x), part.v[group.count] = uint8_t(y);
            group.box[group.count++] = box;
        }
    if (group.count == 0)
        return;
    made.parts.push_back(part);
    made.groups.push_back(group);
}

void GridLeaves::write(const Group& group, int i, uint8_t* to, int end) const {
    const Part& part = m_parts[group.source];
    const Points p = points(part.tile, part.u[i], part.v[i], end);
    const uint32_t shape = leaf_shape(p.columns, p.rows);
    if (group.kind == Kind::GridFloat) {
        GridFloat& leaf = *reinterpret_cast<GridFloat*>(to);
        for (int k = 0; k < LeafVertices; k++)
            for (int a = 0; a < 3; a++)
                leaf.coordinate[a][k] = p.at[k][a];
        leaf.shape = shape;
        return;
    }
    const Frame frame(m_lattice, p.at);
    if (group.kind == Kind::Grid32) {
        Grid32& leaf = *reinterpret_cast<Grid32*>(to);
        const int fields = frame.fields();
        for (int k = 0; k < LeafVertices; k++)
            leaf.vertex[k] = frame.pack(p.at[k], fields);
        frame.write(leaf.frame, fields, shape);
    } else {
        Grid48& leaf = *reinterpret_cast<Grid48*>(to);
        for (int k = 0; k < LeafVertices; k++)
            for (int a = 0; a < 3; a++)
                leaf.coordinate[a][k] = uint16_t(frame.field(p.at[k], a));
        frame.write(leaf.frame, -1, shape);
    }
}

uint32_t GridLeaves::name(const Group& group, int i) const {
    const Part& part = m_parts[group.source];
    return part.tile << (2 * m_tile_log) | uint32_t(part.v[i]) << m_tile_log | part.u[i];
}

void GridLeaves::vote(const GridView& g, StepVotes& votes) {
    if (!has_cells(g))
        return;
    for (int row = 0; row < g.rows; row += 4)
        for (int column = 0; column < g.columns; column += 4) {
            Bounds3f box;
            for (int y = row; y <= std::min(row + 4, g.rows); y++)
                for (int x = column; x <= std::min(column + 4, g.columns); x++) {
                    const float* p = g.positions + 3 * (size_t(y) * size_t(g.columns + 1) + size_t(x));
                    if (is_somewhere({p[0], p[1], p[2]}))
                        box.extend(Vec3f(p[0], p[1], p[2]));
                }
            if (box.empty())
                continue;
            // A micropolygon has so many steps, and a sixteenth of them at least: see StepVotes::Slack.
            constexpr float StepsEach = 160;
            const Vec3f extent = box.diagonal();
            const int across = std::max(std::min(g.columns - column, 4), std::min(g.rows - row, 4));
            votes.add(extent, max(max(extent.x, extent.y), extent.z) /
                                  (StepsEach * float(across) * float(std::max(g.finer, 1))));
        }
}

} // namespace kanuka::hierarchy
