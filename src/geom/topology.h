// How the quad-domain faces of a surface are joined. Dicing needs nothing else to keep neighbours free of
// cracks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kanuka::geom {

//        VMax
//     3 ──────▶ 2        Corners of a face and its sides in the order of grid::Edge. Every side is walked
//     with u or v ▲         ▲        rising, and lies on an edge that faces share: on all of it or (a quad
//     that came of cutting a
// UMin│  face   │UMax    triangle or n-gon at the middles of its edges) on one half of it.
//     0 ──────▶ 1
//        VMin
struct Topology {
    enum class Part : uint8_t { Whole, First, Second };
    struct Side {
        int edge = -1;
        Part part = Part::Whole;
        bool reversed = false; // the side runs against the edge
    };
    struct Face {
        std::array<Side, 4> sides;
    };
    // An edge runs from vertex a to vertex b. `face`, `side`: who evaluates it (one place, or one a half).
    struct Edge {
        int a = -1, b = -1;
        int middle = -1;    // vertex at the middle, where some faces use halves
        bool point = false; // all of it is one point: a pole
        int twin = -1; // edge of a changing shape that it meets at some time, but not always: diced alike
        int face[2] = {-1, -1};
        uint8_t side[2] = {0, 0};
    };
    std::vector<Face> faces;
    std::vector<Edge> edges;
    int vertices = 0;

    void attach(int face, int side, int edge, Part part, bool reversed);
    // Gives vertices joined by point edges one number.
    void merge_points();
};

// A parameter of the edge to the parameter of a side on it, and where that is in the face.
float side_parameter(const Topology::Side& side, float t);
void side_position(int side, float x, float& u, float& v);

// Faces in nu columns and nv rows, possibly wrapping round: patch meshes, NURBS, quadrics. Face (i, j) = j *
// nu + i.
struct LatticeShape {
    int nu = 1, nv = 1;
    bool wrap_u = false, wrap_v = false;
    std::array<bool, 4> pole{};            // sides of the whole that are one point, in grid::Edge order
    bool twins_u = false, twins_v = false; // opposite sides meet at some time, but not always
};
Topology lattice_topology(const LatticeShape& shape);
// Only these faces, in their order, and their edges.
Topology kept_faces(const Topology& all, const std::vector<int>& faces);

// Edges of polygonal faces by their pair of vertices. Faces are given as cycles of vertex numbers.
struct PolygonEdges {
    struct Half {
        int edge;
        bool reversed; // the face walks it from b to a
    };
    std::vector<Half> halves; // one per corner: the edge from this corner to the next of its face
    std::vector<std::array<int, 2>> edges;
};
// first[f] … first[f + 1]: corners of face f in `vertices`.
PolygonEdges find_edges(const std::vector<int>& first, const std::vector<int>& vertices, int vertex_count);

// Polygonal faces as quad-domain faces: quads as they are, others as one quad at each corner: corner, middle
// of the edge to the next corner, centre, middle of the edge before. With `collapse_triangles` a triangle is
// one quad whose VMax side is its last corner. `quads` says what each face came from.
struct PieceQuad {
    int piece;
    int corner; // Quad, Triangle: the piece is the face
    static constexpr int Quad = -1, Triangle = -2;
};
Topology polygon_topology(const std::vector<int>& first, const std::vector<int>& vertices, int vertex_count,
                          bool collapse_triangles, std::vector<PieceQuad>& quads);
// The same of edges that are found.
Topology polygon_topology(const std::vector<int>& first, const std::vector<int>& vertices, int vertex_count,
                          bool collapse_triangles, const PolygonEdges& edges, std::vector<PieceQuad>& quads);

} // namespace kanuka::geom
