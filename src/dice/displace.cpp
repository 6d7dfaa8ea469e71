#include "dice/displace.h"

#include <atomic>
#include <cmath>
#include <mutex>

#include "base/tasks.h"
#include "grid/mesh_patches.h"

namespace kanuka::dice {

size_t displace_grid(grid::Grid& g, const Displace& displace, size_t own, char* moved) {
    const std::vector<float> before = g.P;
    displace(g);
    if (moved)
        *moved |= g.P != before;
    size_t bad = 0;
    for (int i = 0; i < int(own); i++) {
        const Vec3f p = g.position(i);
        if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
            continue;
        bad++;
        for (int c = 0; c < 3; c++)
            g.P[i + size_t(c) * g.stride] = before[i + size_t(c) * g.stride];
    }
    return bad;
}

void report_bad_displacement(size_t vertices, const Location& where, Journal& journal) {
    journal.error(where, "displacement gave positions that are not finite at " + std::to_string(vertices) +
                             " vertices; they were left undisplaced");
}

void displace_mesh(geom::MeshParts& parts, const Displace& displace, int rings, std::vector<float>& rest,
                   const Location& where, Journal& journal) {
    grid::Grid& g = parts.vertices;
    if (g.facets)
        g.N = g.Ng;
    g.facets = false;
    const size_t n = size_t(g.stride);
    std::atomic<size_t> bad{0};
    const grid::MeshPatches patches(g, parts.mesh, g.P, rings);
    std::vector<float> moved = g.P, normals = g.N;
    // What displacement leaves for the surface: channels that the vertices do not have yet.
    std::vector<grid::Channel> left;
    std::once_flag once;
    tasks::parallel_for(patches.count(), [&](size_t k) {
        grid::Grid patch;
        std::vector<uint32_t> vertices;
        patches.cut(k, patch, vertices);
        const size_t own = size_t(patch.stencils->own), had = patch.primvars.size();
        bad += displace_grid(patch, displace, own);
        std::call_once(once, [&] {
            for (size_t c = had; c < patch.primvars.size(); c++) {
                const grid::Channel& made = patch.primvars[c];
                left.push_back(
                    {made.name, made.components, g.stride, std::vector<float>(size_t(made.components) * n)});
            }
        });
        const auto put = [&](const float* from, int components, float* to) {
            for (size_t c = 0; c < size_t(components); c++)
                for (size_t i = 0; i < own; i++)
                    to[vertices[i] + c * n] = from[i + c * size_t(patch.stride)];
        };
        put(patch.P.data(), 3, moved.data());
        put(patch.N.data(), 3, normals.data());
        for (size_t c = 0; c < left.size(); c++)
            put(patch.primvars[had + c].data.data(), left[c].components, left[c].data.data());
    });
    rest = std::move(g.P);
    g.P = std::move(moved);
    g.N = std::move(normals);
    for (grid::Channel& c : left)
        g.primvars.push_back(std::move(c));
    if (bad > 0)
        report_bad_displacement(bad, where, journal);
}

} // namespace kanuka::dice
