// Blobbies to meshes: surface nets (Gibson, "Constrained Elastic Surface Nets", 1998) over a lattice of cells
// as large as a micropolygon, every vertex then moved onto the surface by Newton's method. One vertex in each
// cell that the surface enters, one quad around each lattice edge that it crosses: closed by construction. An
// octree whose boxes bound the field finds the cells, so that work and memory go with the surface's area.
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/tasks.h"
#include "geom/blobby_field.h"
#include "geom/traced_mesh.h"

namespace kanuka::geom {
namespace {

constexpr int Block = 8;                                      // cells a side
constexpr size_t LeastBlocks = 1 << 10, MostBlocks = 1 << 17; // some 30 million cells at a time
constexpr double VerticesABlock = 256;                        // at the most, nearly
constexpr int MostHalvings = 16;

struct Place {
    int x, y, z; // block or cell
    auto operator<=>(const Place&) const = default;
};

uint64_t key(int x, int y, int z) {
    const auto part = [](int i) { return uint64_t(uint32_t(i + (1 << 20)) & 0x1fffff); };
    return part(z) << 42 | part(y) << 21 | part(x);
}

// What a block gives: its own cells' vertices, and the quads around its own edges.
struct Piece {
    std::vector<uint64_t> keys;
    std::vector<double> positions; // object space, xyz
    std::vector<double> gradients;
    std::vector<std::vector<double>> influences;
    std::vector<std::array<uint64_t, 4>> quads;
};

class Polygoniser {
  public:
    Polygoniser(const BlobbyField& field, double cell, const double* origin, bool wants_influences)
        : m_field(field), m_cell(cell), m_origin(origin), m_influences(wants_influences) {}

    // Blocks that the surface may pass through, within a number of them. False: there are more, or bounds of
    // the field are so loose that finding them takes too long.
    bool find_blocks(int blocks_a_side, size_t most) {
        m_most = most;
        BlobbyField::Local all;
        int size = 1;
        while (size < blocks_a_side)
            size *= 2;
        box(all, {0, 0, 0}, size, nullptr);
        return descend({0, 0, 0}, size, all);
    }
    size_t blocks() const { return m_blocks.size(); }

    std::vector<Piece> run() const {
        std::vector<Piece> pieces(m_blocks.size());
        tasks::parallel_for(m_blocks.size(), [&](size_t i) { polygonise(m_blocks[i], pieces[i]); });
        return pieces;
    }

  private:
    // The field in `size` blocks a side, with the cells that touch them.
    void box(BlobbyField::Local& local, const Place& b, int size, const BlobbyField::Local* outer) const {
        const int at[3] = {b.x, b.y, b.z};
        double lo[3], hi[3];
        for (int c = 0; c < 3; c++) {
            lo[c] = m_origin[c] + m_cell * (double(at[c]) * Block - 1.5);
            hi[c] = m_origin[c] + m_cell * (double(at[c] + size) * Block + 1.5);
        }
        m_field.localize(lo, hi, outer, local);
    }

    bool descend(const Place& b, int size, const BlobbyField::Local& local) {
        if (!local.crosses)
            return true;
        constexpr size_t VisitsABlock = 32; // a surface takes some 3: half of the children of a box on it
        if (++m_visited > VisitsABlock * m_most)
            return false;
        if (size == 1) {
            m_blocks.push_back(b);
            return m_blocks.size() <= m_most;
        }
        const int h = size / 2;
        for (int k = 0; k < 8; k++) {
            const Place child{b.x + (k & 1 ? h : 0), b.y + (k & 2 ? h : 0), b.z + (k & 4 ? h : 0)};
            BlobbyField::Local inner;
            box(inner, child, h, &local);
            if (!descend(child, h, inner))
                return false;
        }
        return true;
    }

    void corner(int x, int y, int z, double* p) const {
        p[0] = m_origin[0] + m_cell * x;
        p[1] = m_origin[1] + m_cell * y;
        p[2] = m_origin[2] + m_cell * z;
    }

    void polygonise(const Place& block, Piece& out) const {
        constexpr int N = Block + 1;
        BlobbyField::Local local;
        box(local, block, 1, nullptr);
        const int x0 = block.x * Block, y0 = block.y * Block, z0 = block.z * Block;
        std::vector<double> values(size_t(N) * N * N);
        const auto at = [&](int i, int j, int k) -> double& { return values[size_t((k * N + j) * N + i)]; };
        bool any_in = false, any_out = false;
        for (int k = 0; k < N; k++)
            for (int j = 0; j < N; j++)
                for (int i = 0; i < N; i++) {
                    double p[3];
                    corner(x0 + i, y0 + j, z0 + k, p);
                    const double v = m_field.value(p, local) - BlobbyField::Surface;
                    at(i, j, k) = v;
                    (v > 0 ? any_in : any_out) = true;
                }
        if (!any_in || !any_out)
            return;
        for (int k = 0; k < Block; k++)
            for (int j = 0; j < Block; j++)
                for (int i = 0; i < Block; i++) {
                    double v[8];
                    int inside = 0;
                    for (int c = 0; c < 8; c++) {
                        v[c] = at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                        inside += v[c] > 0;
                    }
                    if (inside > 0 && inside < 8)
                        add_vertex(x0 + i, y0 + j, z0 + k, v, local, out);
                    add_quads(x0 + i, y0 + j, z0 + k, v, out);
                }
    }

    // The mean of where the surface crosses the cell's edges, then onto the surface, but not out of the cell.
    void add_vertex(int x, int y, int z, const double* v, BlobbyField::Local& local, Piece& out) const {
        double p[3] = {0, 0, 0}, low[3], high[3];
        int crossings = 0;
        for (int c = 0; c < 8; c++)
            for (int axis = 0; axis < 3; axis++) {
                const int d = c | 1 << axis;
                if (d == c || (v[c] > 0) == (v[d] > 0))
                    continue;
                double q[3] = {double(c & 1), double(c >> 1 & 1), double(c >> 2)};
                q[axis] = v[c] / (v[c] - v[d]);
                for (int a = 0; a < 3; a++)
                    p[a] += q[a];
                crossings++;
            }
        corner(x, y, z, low);
        for (int a = 0; a < 3; a++) {
            high[a] = low[a] + m_cell;
            p[a] = low[a] + m_cell * p[a] / crossings;
        }
        Dual f;
        for (int step = 0; step < 4; step++) {
            f = m_field.dual(p, local);
            const double g2 = f.x * f.x + f.y * f.y + f.z * f.z;
            const double s = g2 > 0 ? (BlobbyField::Surface - f.v) / g2 : 0;
            if (!std::isfinite(s) || s == 0 || step == 3)
                break;
            const double g[3] = {f.x, f.y, f.z};
            for (int a = 0; a < 3; a++)
                p[a] = std::clamp(p[a] + s * g[a], low[a], high[a]);
        }
        out.keys.push_back(key(x, y, z));
        out.positions.insert(out.positions.end(), p, p + 3);
        out.gradients.insert(out.gradients.end(), {f.x, f.y, f.z});
        if (m_influences) {
            out.influences.emplace_back();
            m_field.influences(p, local, out.influences.back());
        }
    }

    // Around the three edges that start at the cell's first corner; counterclockwise as seen from outside.
    void add_quads(int x, int y, int z, const double* v, Piece& out) const {
        for (int axis = 0; axis < 3; axis++) {
            const bool from = v[0] > 0, to = v[1 << axis] > 0;
            if (from == to)
                continue;
            int b[3] = {0, 0, 0}, c[3] = {0, 0, 0};
            b[(axis + 1) % 3] = 1, c[(axis + 2) % 3] = 1;
            std::array<uint64_t, 4> q = {key(x, y, z), key(x - b[0], y - b[1], z - b[2]),
                                         key(x - b[0] - c[0], y - b[1] - c[1], z - b[2] - c[2]),
                                         key(x - c[0], y - c[1], z - c[2])};
            if (!from)
                std::swap(q[1], q[3]);
            out.quads.push_back(q);
        }
    }

    const BlobbyField& m_field;
    const double m_cell;
    const double* m_origin;
    const bool m_influences;
    std::vector<Place> m_blocks;
    size_t m_most = 0, m_visited = 0;
};

// Cells as large as the finest micropolygon that any blob asks for, in object space; smaller where a chord
// across one, along its diagonal, would be further off the tightest bend than the tolerance.
double cell_size(const BlobbyField& field, const Transform& m, const Viewpoint& view) {
    double finest = 0;
    for (const BlobbyField::Ball& b : field.supports()) {
        const Vec3f center(float(b.center[0]), float(b.center[1]), float(b.center[2]));
        const double r = b.radius * 0.25;
        for (int axis = 0; axis < 3; axis++)
            for (const int side : {-1, 1}) {
                Vec3f p = center, q = center;
                p[axis] += float(side * 2 * r);
                q[axis] += float(side * r);
                const double cells = double(view.cells(m.point(p), m.point(q))) / r;
                if (!std::isfinite(cells))
                    continue;
                const double tolerance = double(view.chord_pixels()), edge = double(view.edge_pixels());
                const double bend = std::max(b.bend * cells * edge, tolerance); // pixels
                finest = std::max(finest, cells * std::max(1.0, edge / (2 * std::sqrt(bend * tolerance))));
            }
    }
    return finest > 0 ? 1 / finest : 0;
}

// A cube around all supports, in object space.
struct Cube {
    double lo[3], size = 0;
};
Cube cube_around(const BlobbyField& field) {
    Cube cube;
    for (int c = 0; c < 3; c++) {
        double hi = -1e300;
        cube.lo[c] = 1e300;
        for (const BlobbyField::Ball& b : field.supports()) {
            cube.lo[c] = std::min(cube.lo[c], b.center[c] - b.radius);
            hi = std::max(hi, b.center[c] + b.radius);
        }
        cube.size = std::max(cube.size, hi - cube.lo[c]);
    }
    return cube;
}

// The surface within the cube, of cells that are doubled until their blocks are few enough. Empty: they never
// are.
std::optional<std::vector<Piece>> polygonise(const BlobbyField& field, const Cube& cube, double cell,
                                             size_t most_blocks, bool influences, const Location& where,
                                             Journal& journal) {
    for (int halvings = 0; halvings <= MostHalvings; halvings++, cell *= 2) {
        double origin[3];
        for (int c = 0; c < 3; c++) // off the centres, where symmetric fields would meet lattice points
            origin[c] = cube.lo[c] - cell * 0.371;
        Polygoniser polygoniser(field, cell, origin, influences);
        if (!polygoniser.find_blocks(int(std::ceil(cube.size / cell / Block)) + 1, most_blocks))
            continue;
        if (halvings > 0)
            journal.warning(where, "a Blobby was made of cells " + std::to_string(1 << halvings) +
                                       " times larger than micropolygons, to bound memory; a "
                                       "larger shading rate would do, or splitting it up");
        return polygoniser.run();
    }
    journal.error(where, "a Blobby is too large to be made of polygons and was left out");
    return std::nullopt;
}

// One mesh of all pieces.
class Assembly {
  public:
    Assembly(const std::vector<Piece>& pieces, const Primvars& primvars, size_t leaves, const Transform& m)
        : m_pieces(pieces), m_primvars(primvars), m_leaves(leaves), m_m(m), m_inverse(m.inverse()),
          m_begin(pieces.size() + 1, 0), m_quad_begin(pieces.size() + 1, 0) {
        for (size_t i = 0; i < pieces.size(); i++) {
            for (const uint64_t k : pieces[i].keys)
                m_numbers.emplace_back(k, uint32_t(m_numbers.size()));
            m_begin[i + 1] = m_begin[i] + pieces[i].keys.size();
            m_quad_begin[i + 1] = m_quad_begin[i] + pieces[i].quads.size();
        }
        std::sort(m_numbers.begin(), m_numbers.end());
    }
    size_t vertices() const { return m_numbers.size(); }

    void fill(MeshParts& out) const {
        out.mesh.vertices_per_face = 4;
        out.mesh.indices.resize(4 * m_quad_begin.back());
        tasks::parallel_for(m_pieces.size(), [&](size_t i) {
            add_vertices(i, out.vertices);
            add_quads(i, out.mesh);
        });
    }

  private:
    void add_vertices(size_t i, grid::Grid& g) const {
        const Piece& p = m_pieces[i];
        const double outward = g.flips ? 1 : -1; // the field falls towards the outside
        for (size_t k = 0; k < p.keys.size(); k++) {
            const size_t v = m_begin[i] + k;
            const double* q = p.positions.data() + 3 * k;
            const double* d = p.gradients.data() + 3 * k;
            for (size_t c = 0; c < 3; c++) {
                g.P[v + c * size_t(g.stride)] =
                    float(m_m.m[c][0] * q[0] + m_m.m[c][1] * q[1] + m_m.m[c][2] * q[2] + m_m.m[c][3]);
                // Normals go with the transpose of the inverse.
                const double n = outward * (m_inverse.m[0][c] * d[0] + m_inverse.m[1][c] * d[1] +
                                            m_inverse.m[2][c] * d[2]);
                g.N[v + c * size_t(g.stride)] = g.Ng[v + c * size_t(g.stride)] = float(n);
            }
            for (const Primvar& x : m_primvars.list)
                for (int c = 0; c < x.components; c++)
                    x.destination(g, c)[v] = float(mean(x, c, p, k));
        }
    }

    // A primvar at vertex k of a piece: the leaves' values by their influence.
    double mean(const Primvar& x, int c, const Piece& p, size_t k) const {
        if (x.detail == scene::Detail::Uniform || p.influences.empty())
            return double(x(0, c));
        double sum = 0;
        for (size_t leaf = 0; leaf < std::min(m_leaves, p.influences[k].size()); leaf++)
            sum += p.influences[k][leaf] * double(x(leaf, c));
        return sum;
    }

    void add_quads(size_t i, grid::TracedMesh& mesh) const {
        const bool mirrored = m_m.determinant3() < 0;
        const Piece& p = m_pieces[i];
        for (size_t k = 0; k < p.quads.size(); k++) {
            uint32_t* to = mesh.indices.data() + 4 * (m_quad_begin[i] + k);
            bool whole = true;
            for (size_t c = 0; c < 4; c++) {
                to[c] = number(p.quads[k][mirrored ? 3 - c : c]);
                whole &= to[c] != UINT32_MAX;
            }
            if (!whole) // at the border of the cube, where a constant holds the field up
                to[0] = to[1] = to[2] = to[3] = 0;
        }
    }

    uint32_t number(uint64_t k) const {
        const auto at = std::lower_bound(m_numbers.begin(), m_numbers.end(), std::pair{k, uint32_t(0)});
        return at != m_numbers.end() && at->first == k ? at->second : UINT32_MAX;
    }

    const std::vector<Piece>& m_pieces;
    const Primvars& m_primvars;
    const size_t m_leaves;
    const Transform &m_m, m_inverse;
    std::vector<std::pair<uint64_t, uint32_t>> m_numbers; // of vertices, by their keys
    std::vector<size_t> m_begin, m_quad_begin;            // by piece
};

} // namespace

bool mesh_from_blobby(const scene::Primitive& primitive, const scene::Blobby& blobby, const Transform& m,
                      const Viewpoint& view, Journal& journal, MeshParts& out,
                      const scene::Primitive* first) {
    if (first)
        return false; // another shape has other cells
    BlobbyField field;
    if (!field.prepare(blobby, primitive.world_from_object, primitive.where, journal)) {
        journal.error(primitive.where, "a Blobby has no blobs and was left out");
        return false;
    }
    const size_t leaves = size_t(std::max(blobby.leaves, 0));
    const Primvars primvars = collect_primvars(primitive, m, {1, leaves, leaves, leaves}, journal);
    const Cube cube = cube_around(field);
    if (!std::isfinite(cube.size) || !(cube.size > 0)) {
        journal.error(primitive.where, "a Blobby is not finite and was left out");
        return false;
    }
    // Cells of one micropolygon.
    const double cell = std::clamp(cell_size(field, m, view), cube.size / double(1 << 18), cube.size / 16);
    const auto most_blocks =
        size_t(std::clamp(view.most_vertices() / VerticesABlock, double(LeastBlocks), double(MostBlocks)));
    const auto pieces = polygonise(field, cube, cell, most_blocks, leaves > 0 && !primvars.list.empty(),
                                   primitive.where, journal);
    if (!pieces)
        return false;
    const Assembly assembly(*pieces, primvars, leaves, m);
    if (assembly.vertices() == 0) {
        journal.warning(primitive.where, "a Blobby has no surface: its field nowhere reaches 0.42");
        return false;
    }
    allocate_mesh(out, assembly.vertices(), primvars);
    out.vertices.flips = primitive.attributes && primitive.attributes->reverse_orientation;
    assembly.fill(out);
    out.mesh.P = standing_off(out.vertices, out.mesh);
    return true;
}

} // namespace kanuka::geom
