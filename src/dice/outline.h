// Vertices on a curved surface have chords that lie inside, so what is traced would be too small. So traced
// vertices stand off by half of what chords are off at their middles: a thirty-second of the second
// difference along each of a vertex's four edges, which is half of one for each direction's sagitta. Of a
// sphere's outline from all sides, and of its volume's surface, that is right on the mean (docs/dice.md,
// "Outlines").
//
// Second differences come of each edge's two ends alone: of a curve from a to b with unit normals it is
// (Nb - Na) . (b - a), of a line on the surface that ends there (a border, a crease) the change of its unit
// tangent times the edge's length. So neighbours need no common rows, and straight edges do not change.
#pragma once

#include "dice/seams.h"

namespace kanuka::dice {

// Of every edge: faces lie on one side of it alone.
std::vector<char> open_edges(const geom::Topology& topology);

// All grids of a surface at one step, in which Ng, dPdu and dPdv are those of where P is.
struct GridsAtStep {
    const std::vector<grid::Grid>& grids;  // P, at this step
    size_t step;                           // 0: Grid::P, else that of Grid::later
    const std::vector<grid::Grid>& frames; // Ng, dPdu, dPdv
};

// Thread safety: const members may run at the same time.
class Outline {
  public:
    // `displaced`: of a grid, whose frame is that of another place; its vertices stay.
    Outline(const Splitter& splitter, const Seams& seams, const std::vector<grid::TracedGrid>& traced,
            const std::vector<char>& displaced);
    // Where the points that grids share stand off to, at a step; in tasks of its own.
    std::vector<Vec3f> of_points(const GridsAtStep& at) const;
    // The traced positions of a grid, with those. P is the grid's, changed and restored.
    std::vector<float> trace(size_t grid, const GridsAtStep& at, std::vector<float>& P,
                             const std::vector<Vec3f>& points) const;

  private:
    struct Frame;
    struct Run;
    Frame frame(const GridsAtStep& at, size_t grid) const;
    bool is_open(const Segment& s) const;
    Vec3f of_point(const GridsAtStep& at, int point) const;
    Vec3f of_line(const GridsAtStep& at, int point) const;
    template <class Visit>
    void each_side(const Seams::Member& m, Visit visit) const;
    void add_boundary(size_t grid, const std::vector<Vec3f>& points, std::vector<float>& out) const;
    std::vector<float> trace_collapsed(size_t grid, const GridsAtStep& at, std::vector<float>& P,
                                       const std::vector<Vec3f>& points) const;
    void add_interior(const Frame& f, const grid::TracedGrid& t, std::vector<float>& out) const;

    const Splitter& m_splitter;
    const Seams& m_seams;
    const std::vector<grid::TracedGrid>& m_traced;
    const std::vector<char>& m_displaced;
    std::vector<char> m_open; // of an edge of the topology: faces on one side alone
};

} // namespace kanuka::dice
