#include "dice/merge_outline.h"

#include <algorithm>
#include <cmath>

#include "base/tasks.h"
#include "dice/seams.h"
#include "geom/bend.h"

namespace kanuka::dice {
namespace {

// Cosine between the two ways on at a vertex of a smooth line. Where a corner is taken for one, what it moves
// by is a twentieth of its edges.
constexpr float Straight = -0.7f;

Vec3f at(const std::vector<float>& a, int stride, uint32_t i) {
    return {a[i], a[i + size_t(stride)], a[i + 2 * size_t(stride)]};
}

bool is_crease(const Vec3f& a, const Vec3f& b) {
    return !(abs(dot(a, b)) > SameNormal);
}

// What one quad adds to its corners, or all quads to a point: bends of its edges, their number, and the part
// of a saddle that stands off.
struct Bends {
    float sum = 0, edges = 0, part = 1;
    void add(const Bends& other) {
        sum += other.sum, edges += other.edges;
        part = std::min(part, other.part);
    }
};

void bends_of(const grid::Grid& g, const uint32_t* quad, Bends* out) {
    Vec3f p[4], n[4];
    float bend[4];
    bool any[4]; // of the edge from a corner to the next
    for (int k = 0; k < 4; k++) {
        p[k] = at(g.P, g.stride, quad[k]);
        n[k] = at(g.Ng, g.stride, quad[k]);
    }
    for (int k = 0; k < 4; k++) {
        const Vec3f edge = p[(k + 1) % 4] - p[k];
        any[k] = length_squared(edge) > 0;
        bend[k] = any[k] ? geom::bend_of(n[k], n[(k + 1) % 4], edge) : 0;
    }
    for (int k = 0; k < 4; k++) {
        const int next = (k + 1) % 4, before = (k + 3) % 4;
        out[k] = {bend[k] + bend[before], float(any[k]) + float(any[before]), 1};
        const int u = k % 2 == 0 ? next : before, v = k % 2 == 0 ? before : next; // as the lattice runs
        if (any[k] && any[before])
            out[k].part = geom::part_of_saddle(bend[k], bend[before], dot(n[u] - n[k], p[v] - p[k]));
    }
}

// By point: chunk by chunk in tasks, added up in the order of the quads.
std::vector<Bends> sum_bends(const grid::Grid& g, const grid::TracedMesh& mesh,
                             std::span<const uint32_t> points) {
    constexpr size_t Chunk = 1 << 16, Grain = 1 << 10; // quads
    std::vector<Bends> sums(points.size());
    const size_t quads = mesh.indices.size() / 4;
    std::vector<Bends> corners(4 * std::min(quads, Chunk));
    for (size_t first = 0; first < quads; first += Chunk) {
        const size_t count = std::min(Chunk, quads - first);
        const uint32_t* const indices = &mesh.indices[4 * first];
        tasks::parallel_chunks(count, Grain, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                bends_of(g, indices + 4 * i, &corners[4 * i]);
        });
        for (size_t i = 0; i < 4 * count; i++)
            sums[points[indices[i]]].add(corners[i]);
    }
    return sums;
}

// The neighbours of points along borders and creases, sorted by point.
using Neighbours = std::vector<std::pair<uint32_t, uint32_t>>;
Neighbours neighbours_on_lines(const grid::Grid& g, const grid::TracedMesh& mesh,
                               std::span<const uint32_t> points, const std::vector<char>& on_line) {
    struct Side {
        uint32_t a, b, at_a, at_b; // points, a < b; vertices
    };
    std::vector<Side> sides;
    for (size_t q = 0; q < mesh.indices.size(); q += 4)
        for (size_t k = 0; k < 4; k++) {
            const uint32_t v = mesh.indices[q + k], w = mesh.indices[q + (k + 1) % 4];
            const uint32_t a = points[v], b = points[w];
            if (a != b && (on_line[a] || on_line[b]))
                sides.push_back(a < b ? Side{a, b, v, w} : Side{b, a, w, v});
        }
    std::ranges::sort(sides, {}, [](const Side& s) { return std::pair(s.a, s.b); });
    Neighbours out;
    const auto normal = [&](uint32_t v) { return at(g.Ng, g.stride, v); };
    for (size_t i = 0, end = 0; i < sides.size(); i = end) {
        const Side& first = sides[i];
        bool line_at_a = false, line_at_b = false;
        for (end = i + 1; end < sides.size() && sides[end].a == first.a && sides[end].b == first.b; end++) {
            line_at_a |= is_crease(normal(first.at_a), normal(sides[end].at_a));
            line_at_b |= is_crease(normal(first.at_b), normal(sides[end].at_b));
        }
        const bool border = end == i + 1;
        if (on_line[first.a] && (border || line_at_a))
            out.push_back({first.a, first.b});
        if (on_line[first.b] && (border || line_at_b))
            out.push_back({first.b, first.a});
    }
    std::ranges::sort(out);
    return out;
}

// Of a line from a through p to b, across it. outline.h takes the second difference of each edge from the
// line's tangents, which a vertex of several faces has not; of a circle through evenly spaced points this is
// the same.
Vec3f of_line(const Vec3f& a, const Vec3f& p, const Vec3f& b) {
    const Vec3f to_a = a - p, to_b = b - p;
    const float la = length(to_a), lb = length(to_b);
    if (!(la > 0) || !(lb > 0))
        return Vec3f(0.0f);
    const Vec3f ta = to_a * (1 / la), tb = to_b * (1 / lb), turn = ta + tb;
    const float along = dot(ta, tb);
    if (!(along < Straight) || !(length_squared(turn) > geom::LeastTurn * geom::LeastTurn))
        return Vec3f(0.0f);
    return turn * (-geom::BendOfAnEdge * 2 * (la * la + lb * lb) / (la + lb) * std::sqrt((1 - along) / 2));
}

} // namespace

std::vector<float> standing_off(const grid::Grid& g, const grid::TracedMesh& mesh,
                                std::span<const uint32_t> points, std::vector<char> borders) {
    std::vector<char>& on_line = borders;
    bool lines = std::ranges::find(on_line, 1) != on_line.end();
    for (uint32_t v = 0; v < points.size(); v++)
        if (points[v] != v && is_crease(at(g.Ng, g.stride, v), at(g.Ng, g.stride, points[v])))
            lines = on_line[points[v]] = 1;
    const std::vector<Bends> bends = sum_bends(g, mesh, points);
    std::vector<Vec3f> off(points.size(), Vec3f(0.0f));
    for (uint32_t v = 0; v < points.size(); v++)
        if (points[v] == v && !on_line[v] && bends[v].edges > 0)
            off[v] = at(g.Ng, g.stride, v) *
                     (bends[v].sum * bends[v].part * 4 * geom::BendOfAnEdge / bends[v].edges);
    if (lines) {
        const Neighbours n = neighbours_on_lines(g, mesh, points, on_line);
        for (size_t i = 0, end = 0; i < n.size(); i = end) {
            for (end = i + 1; end < n.size() && n[end].first == n[i].first;)
                end++;
            if (end - i == 2)
                off[n[i].first] = of_line(at(g.P, g.stride, n[i].second), at(g.P, g.stride, n[i].first),
                                          at(g.P, g.stride, n[i + 1].second));
        }
    }
    std::vector<float> out = g.P;
    for (uint32_t v = 0; v < points.size(); v++)
        for (size_t c = 0; c < 3; c++)
            out[v + c * size_t(g.stride)] += off[points[v]][int(c)];
    return out;
}

} // namespace kanuka::dice
