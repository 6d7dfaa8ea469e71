#include "geom/topology.h"

#include <algorithm>
#include <numeric>

#include "base/large_arrays.h"

namespace kanuka::geom {

void Topology::attach(int face, int side, int edge, Part part, bool reversed) {
    faces[face].sides[side] = {edge, part, reversed};
    Edge& e = edges[edge];
    const int half = part == Part::Second ? 1 : 0;
    if (e.face[half] < 0) {
        e.face[half] = face;
        e.side[half] = uint8_t(side);
    }
    if (part == Part::Whole) // evaluates both halves, and better than two faces would
        for (int h = 0; h < 2; h++) {
            const bool whole = e.face[h] >= 0 && faces[e.face[h]].sides[e.side[h]].part == Part::Whole;
            if (!whole || e.face[h] > face) {
                e.face[h] = face;
                e.side[h] = uint8_t(side);
            }
        }
}

void Topology::merge_points() {
    std::vector<int> root(vertices);
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](int v) {
        while (root[v] != v)
            v = root[v] = root[root[v]];
        return v;
    };
    for (const Edge& e : edges)
        if (e.point) {
            const int a = find(e.a), b = find(e.b);
            root[std::max(a, b)] = std::min(a, b);
        }
    for (Edge& e : edges) {
        e.a = find(e.a);
        e.b = find(e.b);
    }
}

float side_parameter(const Topology::Side& side, float t) {
    const float x = side.part == Topology::Part::Whole   ? t
                    : side.part == Topology::Part::First ? 2 * t
                                                         : 2 * t - 1;
    return side.reversed ? 1 - x : x;
}

void side_position(int side, float x, float& u, float& v) {
    u = side == 1 ? 1 : side == 3 ? 0 : x;
    v = side == 0 ? 0 : side == 2 ? 1 : x;
}

Topology lattice_topology(const LatticeShape& shape) {
    const int nu = shape.nu, nv = shape.nv;
    const int cols = shape.wrap_u ? nu : nu + 1, rows = shape.wrap_v ? nv : nv + 1;
    Topology t;
    t.vertices = cols * rows;
    t.faces.resize(size_t(nu) * nv);
    const auto vertex = [&](int i, int j) { return (j % rows) * cols + i % cols; };
    // Edges along u come first (row by row), then those along v.
    t.edges.resize(size_t(nu) * rows + size_t(cols) * nv);
    const auto along_u = [&](int i, int j) { return (j % rows) * nu + i; };
    const auto along_v = [&](int i, int j) { return nu * rows + j * cols + i % cols; };
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < nu; i++) {
            Topology::Edge& e = t.edges[along_u(i, j)];
            e.a = vertex(i, j);
            e.b = vertex(i + 1, j);
            e.point = (j == 0 && shape.pole[0]) || (j == nv && shape.pole[2]);
        }
    for (int j = 0; j < nv; j++)
        for (int i = 0; i < cols; i++) {
            Topology::Edge& e = t.edges[along_v(i, j)];
            e.a = vertex(i, j);
            e.b = vertex(i, j + 1);
            e.point = (i == nu && shape.pole[1]) || (i == 0 && shape.pole[3]);
        }
    for (int j = 0; j < nv; j++)
        for (int i = 0; i < nu; i++) {
            const int f = j * nu + i;
            t.attach(f, 0, along_u(i, j), Topology::Part::Whole, false);
            t.attach(f, 1, along_v(i + 1, j), Topology::Part::Whole, false);
            t.attach(f, 2, along_u(i, j + 1), Topology::Part::Whole, false);
            t.attach(f, 3, along_v(i, j), Topology::Part::Whole, false);
        }
    const auto twins = [&](int a, int b) { t.edges[a].twin = b, t.edges[b].twin = a; };
    for (int i = 0; shape.twins_v && i < nu; i++)
        twins(along_u(i, 0), along_u(i, nv));
    for (int j = 0; shape.twins_u && j < nv; j++)
        twins(along_v(0, j), along_v(nu, j));
    t.merge_points();
    return t;
}

Topology kept_faces(const Topology& all, const std::vector<int>& faces) {
    Topology t;
    t.vertices = all.vertices;
    std::vector<int> number(all.edges.size(), -1);
    for (const int f : faces) {
        const int to = int(t.faces.size());
        t.faces.emplace_back();
        for (int k = 0; k < 4; k++) {
            const Topology::Side& side = all.faces[f].sides[k];
            const Topology::Edge& e = all.edges[side.edge];
            int& edge = number[side.edge];
            if (edge < 0) {
                edge = int(t.edges.size());
                t.edges.push_back({e.a, e.b, e.middle, e.point});
            }
            t.attach(to, k, edge, side.part, side.reversed);
        }
    }
    for (size_t e = 0; e < number.size(); e++)
        if (number[e] >= 0 && all.edges[e].twin >= 0)
            t.edges[number[e]].twin = number[all.edges[e].twin];
    return t;
}

PolygonEdges find_edges(const std::vector<int>& first, const std::vector<int>& vertices, int vertex_count) {
    // Edges are bucketed by their lower vertex; a bucket holds a handful, so matching within it is a linear
    // search.
    PolygonEdges out;
    const int faces = int(first.size()) - 1;
    out.halves.resize(vertices.size());
    std::vector<int> head(vertex_count, -1), next;
    out.edges.reserve(vertices.size() / 2 + 16);
    next.reserve(vertices.size() / 2 + 16);
    for (int f = 0; f < faces; f++)
        for (int c = first[f]; c < first[f + 1]; c++) {
            const int a = vertices[c], b = vertices[c + 1 < first[f + 1] ? c + 1 : first[f]];
            const int low = std::min(a, b), high = std::max(a, b);
            int e = head[low];
            while (e >= 0 && std::max(out.edges[e][0], out.edges[e][1]) != high)
                e = next[e];
            if (e < 0) {
                e = int(out.edges.size());
                out.edges.push_back({a, b});
                next.push_back(head[low]);
                head[low] = e;
            }
            out.halves[c] = {e, out.edges[e][0] != a};
        }
    return out;
}

Topology polygon_topology(const std::vector<int>& first, const std::vector<int>& vertices, int vertex_count,
                          bool collapse_triangles, std::vector<PieceQuad>& quads) {
    return polygon_topology(first, vertices, vertex_count, collapse_triangles,
                            find_edges(first, vertices, vertex_count), quads);
}

Topology polygon_topology(const std::vector<int>& first, const std::vector<int>& vertices, int vertex_count,
                          bool collapse_triangles, const PolygonEdges& edges, std::vector<PieceQuad>& quads) {
    using Part = Topology::Part;
    Topology t;
    reserve_large(t.edges, edges.edges.size());
    for (const auto& e : edges.edges)
        t.edges.push_back({e[0], e[1]});
    t.vertices = vertex_count;
    reserve_large(t.faces, first.size());
    quads.reserve(first.size());
    for (int piece = 0; piece + 1 < int(first.size()); piece++) {
        const PolygonEdges::Half* h = &edges.halves[first[piece]];
        const int n = first[piece + 1] - first[piece];
        int f = int(t.faces.size());
        if (n == 3 && collapse_triangles) {
            quads.push_back({piece, PieceQuad::Triangle});
            t.faces.emplace_back();
            const int tip = int(t.edges.size()), corner = vertices[first[piece] + 2];
            t.edges.push_back({corner, corner});
            t.edges[tip].point = true;
            t.attach(f, 0, h[0].edge, Part::Whole, h[0].reversed);
            t.attach(f, 1, h[1].edge, Part::Whole, h[1].reversed);
            t.attach(f, 2, tip, Part::Whole, false);
            t.attach(f, 3, h[2].edge, Part::Whole, !h[2].reversed);
            continue;
        }
        if (n == 4) {
            quads.push_back({piece, PieceQuad::Quad});
            t.faces.emplace_back();
            for (int side = 0; side < 4; side++) // sides 2 and 3 are walked against the face's cycle
                t.attach(f, side, h[side].edge, Part::Whole, h[side].reversed != (side >= 2));
            continue;
        }
        const int center = t.vertices++, spokes = int(t.edges.size());
        for (int k = 0; k < n; k++) {
            if (t.edges[h[k].edge].middle < 0)
                t.edges[h[k].edge].middle = t.vertices++;
            const int middle = t.edges[h[k].edge].middle;
            t.edges.push_back({middle, center});
        }
        for (int k = 0; k < n; k++, f++) {
            const int before = (k + n - 1) % n;
            quads.push_back({piece, k});
            t.faces.emplace_back();
            t.attach(f, 0, h[k].edge, h[k].reversed ? Part::Second : Part::First, h[k].reversed);
            t.attach(f, 1, spokes + k, Part::Whole, false);
            t.attach(f, 2, spokes + before, Part::Whole, false);
            t.attach(f, 3, h[before].edge, h[before].reversed ? Part::First : Part::Second,
                     !h[before].reversed);
        }
    }
    return t;
}

} // namespace kanuka::geom
