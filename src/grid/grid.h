// The structure-of-arrays micropolygon grid: what dicing makes and shading fills in. Data only.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/vec.h"

namespace kanuka::grid {

// Arrays are padded to a multiple of this many floats, so that 16-lane code may read past the last vertex.
inline constexpr int LanePadding = 16;

// A varying quantity over a grid. Components one after another: value(c, i) = data[c * stride + i].
struct Channel {
    std::string name;
    int components = 1;
    int stride = 0;
    std::vector<float> data;

    float* component(int c) { return data.data() + size_t(c) * stride; }
    const float* component(int c) const { return data.data() + size_t(c) * stride; }
};

// What stands in for the vertices beside one, where a mesh has them anywhere (mesh_patches.h). The change of
// x to the next vertex along u is the sum of along_u[k] (x[vertex[k]] - x[i]), k from first[i] to first[i +
// 1].
struct Stencils {
    int own = 0;                         // vertices; those after are there as neighbours of these
    std::vector<uint32_t> first, vertex; // first: one more than there are vertices
    std::vector<float> along_u, along_v; // parallel to vertex
    std::vector<float> step_u, step_v;   // a vertex: the change of u along u, of v along v
};

// What shading at a vertex reads beside P and normals.
struct Reads {
    bool parameters = false; // u, v
    bool texture = false;    // s, t
    bool frame = false;      // dPdu, dPdv
    bool eye = false;        // E, I
    int rings = 0;           // how far off the vertices are that it depends on
};
inline Reads both(const Reads& a, const Reads& b, int rings) {
    return {a.parameters || b.parameters, a.texture || b.texture, a.frame || b.frame, a.eye || b.eye, rings};
}

// Edges of a grid in the order v = 0, u = 1, v = 1, u = 0 (walked with u, v rising).
enum Edge { VMin = 0, UMax = 1, VMax = 2, UMin = 3 };

// (nu + 1) x (nv + 1) vertices, u fastest: vertex(i, j) = j * (nu + 1) + i. Positions and normals are in the
// space of the primitive's page (render/page_frame.h). Normals point to the outside of the surface; they need
// not be unit length.
struct Grid {
    int nu = 0, nv = 0; // cells
    int stride = 0;     // padded vertex count
    // Every array below has 3 (or 1) components of `stride` floats.
    std::vector<float> P, N, Ng, dPdu, dPdv; // 3 each; dPdu and dPdv per unit of u and v, before displacement
    std::vector<float> u, v, s, t;           // 1 each: surface parameters, texture coordinates
    std::vector<Channel> primvars;           // the varying ones, by name; constants stay with the primitive
    int face = 0;                            // which face or sub-patch it came from: the "uniform" index
    // Number of cells of the shared boundary polyline, at shading density; at most nu or nv. Where it is
    // less, boundary vertices have been moved (in P, u, v and all primvars) onto its points, so neighbours
    // agree bit for bit. 0: the whole side has been moved to one point of a neighbour's coarser polyline. (A
    // pole is not: it keeps its u and v.)
    std::array<int, 4> edge_cells{};
    bool flips = false; // cross(dPdu, dPdv) points to the inside
    // N is zero: the tracer takes the normals of its faces. Shaders find Ng, the mean of those, in its place.
    bool facets = false;
    std::shared_ptr<const Stencils> stencils; // of patches of a mesh alone
    // Where it is later while the shutter is open, if it changes its shape: P and N at further times, evenly
    // apart, laid out like those above. Shading happens once, at the first.
    struct Step {
        std::vector<float> P, N;
    };
    std::vector<Step> later;

    int vertices() const { return (nu + 1) * (nv + 1); }
    void allocate(int nu, int nv);
    Vec3f position(int i) const { return {P[i], P[stride + i], P[2 * stride + i]}; }
    Vec3f normal(int i) const { return {N[i], N[stride + i], N[2 * stride + i]}; }
};

// Shading turned normals (bumps) after `before` was taken of Grid::N: those of the later steps turn with
// them, each by the rotation that takes the normal of the first step to that of the later one.
void carry_normals(Grid& grid, const std::vector<float>& before);

// The traced density: a subset of the shading lattice. Vertex (i, j) of the traced lattice is vertex (i *
// step_u, j * step_v) of the shading lattice, except on edges coarser than that, where it is collapsed to the
// nearest vertex of the edge's own polyline. Steps and edge steps are powers of two. A flat wall is one quad
// under a fine shading grid.
struct TracedGrid {
    int mu = 0, mv = 0;         // cells
    int step_u = 1, step_v = 1; // shading cells a traced cell
    std::array<int, 4> edge_step{1, 1, 1,
                                 1}; // shading cells between vertices of each edge (Edge order); >= step
    std::vector<float> P;            // (mu + 1) * (mv + 1) xyz triples, ready for the ray tracer
    std::vector<std::vector<float>> later; // the same for every Grid::Step
};

// A mesh that is already finer than the shading rate: traced as it is, shaded at its vertices (nu = vertices
// - 1, nv = 0 in its Grid; neighbours in the arrays are no neighbours on the surface). Triangles or quads; a
// triangle in a quad mesh repeats its last vertex. Quad (0, 1, 2, 3) stands for the triangles (0, 1, 3) and
// (2, 3, 1), flat each, with values interpolated linearly on each: as Embree traces quads.
struct TracedMesh {
    int vertices_per_face = 3;
    std::vector<uint32_t> indices;
    // Where its vertices are traced, laid out like Grid::P; empty = there.
    std::vector<float> P;
    // Where it is not empty: fibres, not faces (one index each). Every index begins a segment that ends at
    // the vertex after it, round, as thick as the radii of the two, with balls where nothing goes on. Normals
    // are the fibre's.
    std::vector<float> radius;
    std::vector<std::vector<float>> later_radius; // the same for every Grid::Step
    bool balls = false;                           // such segments end where they begin: each vertex is a ball
    // Closed around, but one layer of its material: what lets light through does so once (see
    // LayeringProgram::is_layer).
    bool around = false;
    bool of_grids = false; // cut out of grids: it shares vertices with those beside it
};

} // namespace kanuka::grid
