#include "dice/dice.h"

#include <atomic>
#include <cmath>

#include "base/tasks.h"
#include "dice/merge.h"
#include "dice/simplify.h"

namespace kanuka::dice {
namespace {

constexpr int MostHalvings = 12; // of micropolygon lengths

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

// Sizes of polygons, judged by a sample of them.
struct PolygonSizes {
    bool finer_than_rate = false; // traced as the mesh they are
    bool small = false;           // a few micropolygons each
};
PolygonSizes polygon_sizes(const scene::Primitive& primitive, const scene::PolygonMesh& mesh,
                           const DiceTarget& target, const RateRule& rule) {
    constexpr size_t FewFaces = 8, Samples = 2048;
    constexpr float LargestFace = 1, Share = 0.75f; // micropolygons; of the sampled faces
    constexpr float SmallFace = 8;
    size_t faces = 0, finer = 0, small = 0;
    geom::sample_polygons(primitive, mesh, target.render_from_object, Samples, [&](const Vec3f* p, int n) {
        float area = 0;
        for (int i = 1; i + 1 < n; i++)
            area += rule.density.area(p[0], p[i], p[i + 1]);
        faces++;
        finer += area <= LargestFace;
        small += area <= SmallFace;
    });
    // Where the material is uniform and nothing moves, flat faces need no cutting at all.
    return {faces > FewFaces && (rule.shape_only || float(finer) >= Share * float(faces)),
            float(small) >= Share * float(faces)};
}

// Displaces a mesh's vertices. Their neighbours are not beside them in the arrays, so normals are made anew.
void displace_mesh(geom::MeshParts& parts, const Displace& displace, const Location& where,
                   Journal& journal) {
    grid::Grid& g = parts.vertices;
    if (parts.flat)
        g.N = g.Ng;
    constexpr size_t Chunk = 1 << 13; // vertices a call, so that calls can run side by side
    const size_t vertices = size_t(g.vertices());
    std::atomic<size_t> bad{0};
    // What displacement leaves for the surface, channels that the vertices do not have yet.
    std::vector<std::vector<grid::Channel>> left((vertices + Chunk - 1) / Chunk);
    tasks::parallel_chunks(vertices, Chunk, [&](size_t begin, size_t end) {
        grid::Grid part;
        part.allocate(int(end - begin) - 1, 0);
        part.flips = g.flips;
        for (const grid::Channel& c : g.primvars)
            part.primvars.push_back(
                {c.name, c.components, part.stride, std::vector<float>(size_t(c.components) * part.stride)});
        copy_vertices(g, begin, part, 0, end - begin);
        bad += displace_grid(part, displace);
        left[begin / Chunk].assign(
            std::make_move_iterator(part.primvars.begin() + ptrdiff_t(g.primvars.size())),
            std::make_move_iterator(part.primvars.end()));
        part.primvars.resize(g.primvars.size());
        copy_vertices(part, 0, g, begin, end - begin);
    });
    for (size_t k = 0; k < (left.empty() ? 0 : left[0].size()); k++) {
        grid::Channel all{left[0][k].name, left[0][k].components, g.stride, {}};
        all.data.resize(size_t(all.components) * size_t(g.stride));
        for (size_t chunk = 0; chunk < left.size(); chunk++)
            for (int c = 0; c < all.components; c++)
                std::copy_n(left[chunk][k].component(c), std::min(Chunk, vertices - chunk * Chunk),
                            all.component(c) + chunk * Chunk);
        g.primvars.push_back(std::move(all));
    }
    if (bad > 0)
        report_bad_displacement(bad, where, journal);
    geom::vertex_normals(g, parts.mesh, g.flips, g.Ng);
    if (parts.flat)
        std::fill(g.N.begin(), g.N.end(), 0.0f);
    else
        g.N = g.Ng;
}

Diced dice_mesh(geom::MeshParts parts, const scene::Primitive& primitive, const Displace& displace,
                Journal& journal) {
    if (displace)
        displace_mesh(parts, displace, primitive.where, journal);
    Diced out;
    out.is_mesh = true;
    out.mesh_vertices = std::move(parts.vertices);
    out.mesh = std::move(parts.mesh);
    return out;
}

// Many pieces of hardly more than a micropolygon are a mesh already finer than the rate. Very many small ones
// go the same way, since a grid of its own costs each of them some two kilobytes.
bool is_merged(const Splitter& splitter, const RateRule& rule) {
    constexpr double Many = 256, VeryMany = 200000;
    constexpr double FinerThanRate = 1.5, Small = 6; // micropolygons a piece
    const double pieces = double(splitter.pieces.size()), each = splitter.cells() / std::max(1.0, pieces);
    return !rule.shape_only &&
           ((pieces >= Many && each < FinerThanRate) || (pieces >= VeryMany && each < Small));
}

Diced dice_surface(const geom::Surface& surface, const scene::Primitive& primitive, RateRule rule,
                   const DiceOptions& options, bool simplify, const Displace& displace, Journal& journal) {
    Diced out;
    auto splitter = std::make_unique<Splitter>(surface, rule);
    int halvings = 0;
    while (!splitter->run(options.max_micropolygons)) {
        if (++halvings > MostHalvings) {
            journal.error(primitive.where,
                          "a primitive cannot be diced to any sensible number of micropolygons and was "
                          "left out; check its size and transform");
            return {};
        }
        rule.density.coarsen(0.5f);
        splitter = std::make_unique<Splitter>(surface, rule);
    }
    if (halvings > 0)
        journal.warning(primitive.where,
                        "a primitive would be diced to more than " +
                            std::to_string(options.max_micropolygons * 1e-6) +
                            " million micropolygons; they were made " + std::to_string(1 << halvings) +
                            " times longer. A larger shading rate, or splitting it up, would do");
    if (is_merged(*splitter, rule))
        return dice_mesh(merge_pieces(*splitter), primitive, displace, journal);
    out.grids.resize(splitter->pieces.size());
    tasks::parallel_chunks(out.grids.size(), 8, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            out.grids[i] = make_grid(*splitter, splitter->pieces[i]);
    });
    Seams seams(*splitter, out.grids);
    seams.join(out.grids);
    if (displace) {
        std::atomic<size_t> bad{0};
        tasks::parallel_for(out.grids.size(),
                            [&](size_t i) { bad += displace_grid(out.grids[i], displace); });
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

} // namespace

static Diced dice_primitive(const scene::Primitive& primitive, const DiceTarget& target,
                            const DiceOptions& options, const Displace& displace, Journal& journal) {
    const scene::Attributes defaults;
    const scene::Attributes& attributes = primitive.attributes ? *primitive.attributes : defaults;
    int max_cells = 1;
    while (max_cells * 2 <= std::clamp(options.max_grid_cells, 1, 256))
        max_cells *= 2;
    const RateRule rule{Density(target, options, attributes.shading_rate), target.shade_uniform && !displace,
                        std::max(0.0f, options.geometry_tolerance), std::max(0.0f, options.normal_tolerance),
                        max_cells};
    const bool simplify = options.geometry_tolerance > 0 && attributes.dice_flatness && !target.keep_density;
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
    geom::SurfaceHints hints;
    if (const auto* mesh = std::get_if<scene::PolygonMesh>(&primitive.geometry)) {
        const PolygonSizes sizes = polygon_sizes(primitive, *mesh, target, rule);
        if (sizes.finer_than_rate) {
            if (!geom::mesh_from_polygons(primitive, *mesh, m, journal, parts))
                return {};
            geom::vertex_normals(parts.vertices, parts.mesh, parts.vertices.flips, parts.vertices.Ng);
            return dice_mesh(std::move(parts), primitive, displace, journal);
        }
        hints.small_triangles = sizes.small;
    }
    const auto surface = geom::make_surface(primitive, m, journal, hints);
    if (!surface)
        return {};
    return dice_surface(*surface, primitive, rule, options, simplify, displace, journal);
}

Diced dice(const scene::Primitive& primitive, const DiceTarget& target, const DiceOptions& options,
           const Displace& displace, Journal& journal) {
    try {
        return dice_primitive(primitive, target, options, displace, journal);
    } catch (const std::exception& e) {
        journal.error(primitive.where, std::string("a primitive was left out: ") + e.what());
        return {};
    }
}

} // namespace kanuka::dice
