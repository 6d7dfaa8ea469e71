// Points to small spheres.
#include <map>

#include "base/tasks.h"
#include "geom/traced_mesh.h"

namespace kanuka::geom {
namespace {

constexpr int Levels = 5;
// A level serves spheres of less than this radius in pixels.
constexpr float LevelRadius[Levels] = {1.5f, 5, 16, 60, 1e30f};

struct Ball {
    std::vector<Vec3f> directions;
    std::vector<uint32_t> triangles;
    float scale =
        1; // makes the mean silhouette that of the sphere: a quarter of a convex body's surface (Cauchy)
};

// An octahedron, every triangle cut in four `level` times.
Ball make_ball(int level) {
    Ball b;
    b.directions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    b.triangles = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    for (int l = 0; l < level; l++) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t i, uint32_t j) {
            const auto [at, fresh] =
                middles.try_emplace({std::min(i, j), std::max(i, j)}, uint32_t(b.directions.size()));
            if (fresh)
                b.directions.push_back(normalize(b.directions[i] + b.directions[j]));
            return at->second;
        };
        std::vector<uint32_t> next;
        for (size_t t = 0; t < b.triangles.size(); t += 3) {
            const uint32_t i = b.triangles[t], j = b.triangles[t + 1], k = b.triangles[t + 2];
            const uint32_t ij = middle(i, j), jk = middle(j, k), ki = middle(k, i);
            for (const uint32_t v : {i, ij, ki, ij, j, jk, ki, jk, k, ij, jk, ki})
                next.push_back(v);
        }
        b.triangles = std::move(next);
    }
    float area = 0;
    for (size_t t = 0; t < b.triangles.size(); t += 3) {
        const Vec3f &p = b.directions[b.triangles[t]], &q = b.directions[b.triangles[t + 1]],
                    &r = b.directions[b.triangles[t + 2]];
        area += 0.5f * length(cross(q - p, r - p));
    }
    b.scale = std::sqrt(4 * Pi / area);
    return b;
}

} // namespace

bool mesh_from_points(const scene::Primitive& primitive, const Transform& m, const Viewpoint& view,
                      Journal& journal, MeshParts& out, const scene::Primitive* first) {
    const ControlPoints points = control_points(primitive, m);
    const Widths widths(primitive, m);
    const ControlPoints first_points = first ? control_points(*first, m) : ControlPoints{};
    const Widths first_widths(first ? *first : primitive, m);
    const ControlPoints& sized = first ? first_points : points; // what decides the refinement
    const size_t n = points.size();
    const Primvars primvars = collect_primvars(primitive, m, {1, n, n, n}, journal);
    const bool own_widths = widths.varying() && widths.varying()->floats.size() >= n;
    std::array<Ball, Levels> balls;
    for (int l = 0; l < Levels; l++)
        balls[l] = make_ball(l);

    // Level of every point; -1 = left out.
    std::vector<int8_t> level(n);
    Dropped dropped;
    std::vector<size_t> first_vertex(n + 1, 0), first_index(n + 1, 0);
    const bool own_first_widths = first_widths.varying() && first_widths.varying()->floats.size() >= n;
    for (size_t i = 0; i < n; i++) {
        const float radius = 0.5f * first_widths.at(own_first_widths ? i : 0);
        level[i] = -1;
        if (i >= sized.size() || !sized.finite(i) || !std::isfinite(radius))
            dropped.non_finite++;
        else if (radius > 0) {
            const float pixels = radius * view.pixels_per_unit(sized[i]);
            level[i] = int8_t(
                std::find_if(LevelRadius, LevelRadius + Levels - 1, [&](float r) { return pixels < r; }) -
                LevelRadius);
        }
        first_vertex[i + 1] = first_vertex[i] + (level[i] < 0 ? 0 : balls[level[i]].directions.size());
        first_index[i + 1] = first_index[i] + (level[i] < 0 ? 0 : balls[level[i]].triangles.size());
    }
    dropped.report(n, "points", primitive.where, journal);
    if (first_index[n] == 0)
        return false;
    allocate_mesh(out, first_vertex[n], primvars);
    out.mesh.indices.resize(first_index[n]);
    grid::Grid& g = out.vertices;
    tasks::parallel_chunks(n, 1024, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            if (level[i] < 0)
                continue;
            const Ball& ball = balls[level[i]];
            const float radius = 0.5f * widths.at(own_widths ? i : 0) * ball.scale;
            const Vec3f center = points.finite(i) ? points[i] : sized[i];
            for (size_t k = 0; k < ball.directions.size(); k++) {
                const size_t v = first_vertex[i] + k;
                for (int c = 0; c < 3; c++) {
                    const size_t at = v + size_t(c) * g.stride;
                    g.P[at] = center[c] + ball.directions[k][c] * radius;
                    g.N[at] = g.Ng[at] = ball.directions[k][c];
                }
                for (const Primvar& p : primvars.list)
                    for (int c = 0; c < p.components; c++)
                        p.destination(g, c)[v] = p(p.detail == scene::Detail::Uniform ? 0 : i, c);
            }
            for (size_t k = 0; k < ball.triangles.size(); k++)
                out.mesh.indices[first_index[i] + k] = uint32_t(first_vertex[i] + ball.triangles[k]);
        }
    });
    return true;
}

} // namespace kanuka::geom
