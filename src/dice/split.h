// Splits a surface into pieces of at most max_grid_cells a side and decides the polylines along their edges.
//
// An edge decides from itself alone: it is cut in halves (recursively) while it needs more cells than a grid
// may have or needs them unevenly; what is left has a power of two of equal cells. Pieces follow: a piece is
// split across wherever one of its sides is cut, or where its interior asks for it. A piece that is split
// across an uncut side takes a part of that side's cells; where there is only one cell to share, the edge
// gets twice as many, up to max_cells; beyond that the middle goes to the cell's first end. In the end every
// side of a piece is a run of whole cells of one edge, and both neighbours of an edge visit all of its
// vertices in order: the surface is watertight whatever its neighbours' rates are. (The cutting rule is
// DiagSplit's, Fisher et al. 2009.)
#pragma once

#include <unordered_map>

#include "dice/density.h"
#include "geom/surface.h"

namespace kanuka::dice {

struct Edge {
    int topology = -1; // edge of the surface, or -1: a line inside `face` along `axis` at the other parameter
    int face = -1;
    uint8_t axis = 0; // 0: along u, 1: along v
    bool point = false;
    bool tiny = false; // LineMeasure's
    float fixed = 0;
    float t0 = 0, t1 = 1; // part of the topology edge, or range of u or v
    int a = -1, b = -1;   // vertices
    int middle = -1;      // vertex at cells / 2, if some piece has a corner there
    int child = -1;       // first of two children; -1 = not cut
    int twin = -1;        // edge that has its cells and steps, since both meet at some time
    int cells = 1;        // a power of two, if not cut
    int least = 1 << 24;  // fewest cells any piece takes of it at once
    int first_point = -1; // number of its first interior vertex among all points
    int step = 1;         // traced density: cells between kept vertices
    float error = 0;      // distance that leaving the others out makes
};

// A run of cells of an edge, as a piece's side has it. cells = 0: all of the side is the edge's vertex
// `begin`.
struct Segment {
    int edge = -1;
    int begin = 0, cells = 0;
    bool reversed = false; // the side runs against the edge
    int of = 1;            // cells of the edge when this was written: it may have got more since
};

struct Piece {
    int face = 0;
    float u0 = 0, u1 = 1, v0 = 0, v1 = 1;
    std::array<Segment, 4> sides; // in grid::Edge order
    int nu = 1, nv = 1;
    int twist = 1; // cells that its twist asks for either way, and of its sides too
};

// Which vertex of a side's coarser polyline, `spacing` lattice cells apart, lattice vertex i of n goes to:
// the nearest. From midway it goes towards the nearer end of the side; from the side's own middle, on VMin
// and UMin towards their first end, on VMax and UMax towards their second: so at the two corners that a
// cell's diagonal does not meet, both sides never pull away, which would fold the cell there. (Both
// neighbours need the same polyline, not the same choice.)
inline int nearest_kept(int i, int spacing, int n, int side) {
    const int rest = i % spacing, high = side == grid::UMax || side == grid::VMax;
    return i / spacing + (2 * rest > spacing || (2 * rest == spacing && 2 * i + high > n));
}

class Splitter {
  public:
    // `later`: the same surface in other shapes, which count for the rates.
    Splitter(const geom::Surface& surface, const RateRule& rule,
             std::vector<const geom::Surface*> later = {});
    // False = more cells than `limit`: the caller coarsens and starts again.
    bool run(double limit);

    const geom::Surface& surface() const { return m_surface; }
    std::vector<Edge> edges;
    std::vector<Piece> pieces;
    double cells() const;
    // visit(number of an edge, that of its twin), each pair once.
    template <class Visit>
    void each_twin(size_t begin, Visit visit) const {
        for (size_t i = begin; m_has_twins && i < edges.size(); i++)
            if (edges[i].twin > int(i))
                visit(i, size_t(edges[i].twin));
    }

    // Points: the vertices first, then the interior vertices of all uncut edges. Numbers of one point agree
    // everywhere.
    int points() const { return int(m_point_alias.size()); }
    int vertices() const { return m_vertices; }
    int point(const Edge& e, int index) const {
        const bool first = e.point || index == 0;
        return m_point_alias[first ? e.a : index == e.cells ? e.b : e.first_point + index - 1];
    }
    // Polyline vertex that lattice vertex i of n along a side (and its segment) is moved onto, and its
    // parameter in the piece's face.
    static int polyline_index(const Segment& s, int side, int i, int n);
    float parameter(const Piece& piece, int side, int polyline_index) const;

  private:
    static constexpr size_t Grain = 64; // edges, or pieces, of a task
    void start();

    // split_measure.cpp
    void grow_edges(size_t begin);
    void positions(const geom::Surface& surface, const Edge& edge, int samples, float* xyz) const;
    LineMeasure measure(const Edge& edge, int samples) const;
    void measure(const Edge* edges, const int* which, int count, int samples, LineMeasure* out) const;
    void measure(const Edge* edges, int count, LineMeasure* out) const;
    bool wants_cut(Edge& edge, const LineMeasure& measure) const;
    void plan(Piece& piece, int& split) const;
    struct Interior {
        float want_u, want_v, least_u, least_v;
        bool uneven_u, uneven_v;
        float twist = 1;
    };
    void measure_interior(const geom::Surface& surface, const Piece& piece, int samples, Interior& m) const;

    void double_cells(Edge& edge);
    void cut(const Piece& piece, int axis, std::vector<Piece>& out);
    Segment whole(int edge, bool reversed) const;
    Segment half(const Segment& s, int which) const;
    Segment current(Segment s) const; // in the cells that its edge has now
    Segment shared(const Segment& s); // with an even number of cells, if its edge may have them
    void refine_twisted(const Piece& piece);
    bool is_cut(const Segment& s) const { return s.cells < 0; }
    int middle_vertex(const Segment& s);
    int vertex_at(int edge, int index);
    void number_points();

    const geom::Surface& m_surface;
    const std::vector<const geom::Surface*> m_later;
    const RateRule& m_rule;
    int m_vertices = 0;
    size_t m_most_edges = 0;
    bool m_has_twins = false;
    // (edge, index) of a corner inside an uncut edge -> vertex. Indices as if it had MostCells.
    std::unordered_map<uint64_t, int> m_forced;
    std::vector<int> m_point_alias;
};

} // namespace kanuka::dice
