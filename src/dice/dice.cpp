#include "dice/dice.h"

#include <atomic>
#include <cmath>

#include "base/tasks.h"
#include "dice/simplify.h"

namespace kanuka::dice {
namespace {

// A primitive that would need more micropolygons than this is diced coarser, and says so.
constexpr double MostCells = double(1 << 25);

// Vertices that displacement made infinite or not a number go back to where they were.
size_t displace_grid(grid::Grid& g, const Displace& displace) {
    const std::vector<float> before = g.P;
    displace(g);
    size_t bad = 0;
    for (int i = 0; i < g.vertices(); i++) {
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

Diced dice_surface(const geom::Surface& surface, const scene::Primitive& primitive, RateRule rule, bool simplify,
                   const Displace& displace, Journal& journal) {
    Diced out;
    auto splitter = std::make_unique<Splitter>(surface, rule);
    float coarser = 1;
    while (!splitter->run(MostCells)) {
        coarser *= 0.5f;
        rule.density.coarsen(0.5f);
        splitter = std::make_unique<Splitter>(surface, rule);
    }
    if (coarser < 1)
        journal.warning(primitive.where, "a primitive would be diced to more than " +
                                             std::to_string(int(MostCells * 1e-6)) +
                                             " million micropolygons; its micropolygons were made " +
                                             std::to_string(int(1 / coarser)) +
                                             " times longer. A larger shading rate, or splitting it up, would do");
    out.grids.resize(splitter->pieces.size());
    tasks::parallel_chunks(out.grids.size(), 8, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            out.grids[i] = make_grid(*splitter, splitter->pieces[i]);
    });
    Seams seams(*splitter, out.grids);
    seams.join(out.grids);
    if (displace) {
        std::atomic<size_t> bad{0};
        tasks::parallel_for(out.grids.size(), [&](size_t i) { bad += displace_grid(out.grids[i], displace); });
        seams.weld(out.grids);
        if (bad > 0)
            report_bad_displacement(bad, primitive.where, journal);
    }
    choose_edge_steps(*splitter, out.grids, seams, rule, simplify);
    out.traced.resize(out.grids.size());
    tasks::parallel_chunks(out.grids.size(), 8, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            out.traced[i] = trace_grid(*splitter, splitter->pieces[i], out.grids[i], rule, simplify);
    });
    return out;
}

// Is the mesh finer than the rate? Judged by a sample of its faces. Where the material is uniform and nothing moves, flat
// faces need no cutting at all.
bool is_traced_as_mesh(const scene::Primitive& primitive, const scene::PolygonMesh& mesh, const DiceTarget& target,
                       const RateRule& rule) {
    constexpr size_t FewFaces = 8, Samples = 2048;
    constexpr float LargestFace = 1, Share = 0.75f; // micropolygons; of the sampled faces
    size_t faces = 0, small = 0;
    geom::sample_polygons(primitive, mesh, target.render_from_object, Samples, [&](const Vec3f* p, int n) {
        float area = 0;
        for (int i = 1; i + 1 < n; i++)
            area += rule.density.area(p[0], p[i], p[i + 1]);
        faces++;
        small += area <= LargestFace;
    });
    return faces > FewFaces && (rule.shape_only || float(small) >= Share * float(faces));
}

// Displaces a mesh's vertices. Their neighbours are not beside them in the arrays, so normals are made anew.
void displace_mesh(geom::MeshParts& parts, const Displace& displace, const Location& where, Journal& journal) {
    grid::Grid& g = parts.vertices;
    if (parts.flat)
        g.N = g.Ng;
    const size_t bad = displace_grid(g, displace);
    if (bad > 0)
        report_bad_displacement(bad, where, journal);
    geom::vertex_normals(g, parts.mesh, g.flips, g.Ng);
    if (parts.flat)
        std::fill(g.N.begin(), g.N.end(), 0.0f);
    else
        g.N = g.Ng;
}

Diced dice_mesh(geom::MeshParts parts, const scene::Primitive& primitive, const Displace& displace, Journal& journal) {
    if (displace)
        displace_mesh(parts, displace, primitive.where, journal);
    Diced out;
    out.is_mesh = true;
    out.mesh_vertices = std::move(parts.vertices);
    out.mesh = std::move(parts.mesh);
    return out;
}

} // namespace

Diced dice(const scene::Primitive& primitive, const DiceTarget& target, const DiceOptions& options,
           const Displace& displace, Journal& journal) {
    const scene::Attributes defaults;
    const scene::Attributes& attributes = primitive.attributes ? *primitive.attributes : defaults;
    int max_cells = 1;
    while (max_cells * 2 <= std::clamp(options.max_grid_cells, 1, 256))
        max_cells *= 2;
    const RateRule rule{Density(target, options, attributes.shading_rate), target.shade_uniform && !displace,
                        std::max(0.0f, options.geometry_tolerance), std::max(0.0f, options.normal_tolerance), max_cells};
    const bool simplify = options.geometry_tolerance > 0 && attributes.dice_flatness;
    const Transform& m = target.render_from_object;
    geom::MeshParts parts;
    if (const auto* curves = std::get_if<scene::Curves>(&primitive.geometry)) {
        if (!geom::mesh_from_curves(primitive, *curves, m, rule.density, journal, parts))
            return {};
        return dice_mesh(std::move(parts), primitive, displace, journal);
    }
    if (std::holds_alternative<scene::Points>(primitive.geometry)) {
        if (!geom::mesh_from_points(primitive, m, rule.density, journal, parts))
            return {};
        return dice_mesh(std::move(parts), primitive, displace, journal);
    }
    if (const auto* mesh = std::get_if<scene::PolygonMesh>(&primitive.geometry);
        mesh && is_traced_as_mesh(primitive, *mesh, target, rule)) {
        if (!geom::mesh_from_polygons(primitive, *mesh, m, journal, parts))
            return {};
        geom::vertex_normals(parts.vertices, parts.mesh, parts.vertices.flips, parts.vertices.Ng);
        return dice_mesh(std::move(parts), primitive, displace, journal);
    }
    const auto surface = geom::make_surface(primitive, m, journal);
    if (!surface)
        return {};
    return dice_surface(*surface, primitive, rule, simplify, displace, journal);
}

} // namespace kanuka::dice
