#include "dice/dice.h"

#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "base/tasks.h"
#include "dice/merge.h"
#include "dice/outline.h"
#include "dice/simplify.h"
#include "dice/trim.h"
#include "grid/mesh_patches.h"

namespace kanuka::dice {
namespace {

constexpr int MostHalvings = 14; // of micropolygon lengths

// Vertices that displacement made infinite or not a number go back to where they were. Counts them among the
// first `own`. Says in `moved` if it changed any.
size_t displace_grid(grid::Grid& g, const Displace& displace, size_t own, char* moved = nullptr) {
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

// Displaces a mesh's vertices, patch by patch. `rest`: takes what P was. N is what the shader leaves, as on
// grids.
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

void report_other_topology(const scene::Primitive& primitive, Journal& journal) {
    journal.error(
        primitive.where,
        "a primitive that changes its shape has other faces or vertices at a later time and was left as "
        "it is at first; all its samples must have one topology");
}

// `parts`: the mesh at every step, the first one first.
Diced dice_mesh(std::vector<geom::MeshParts> parts, const scene::Primitive& primitive,
                const DiceTarget& target, const Displace& displace, Journal& journal) {
    for (size_t k = 1; k < parts.size(); k++)
        if (parts[k].vertices.nu != parts[0].vertices.nu) {
            report_other_topology(primitive, journal);
            parts.resize(1);
        }
    std::vector<std::vector<float>> later_radius;
    Diced out;
    const int rings = target.displacing.rings;
    for (geom::MeshParts& p : parts) {
        const bool first = &p == &parts[0];
        if (!first) {
            later_radius.push_back(std::move(p.mesh.radius));
            p.mesh = parts[0].mesh;
        }
        if (rings > 0 || target.displacing.frame ||
            (first && (target.shading.rings > 0 || target.shading.frame)))
            grid::complete_frames(p.vertices, p.mesh);
        std::vector<float> rest;
        if (displace) {
            displace_mesh(p, displace, rings, rest, primitive.where, journal);
            if (p.vertices.P != rest)
                p.mesh.P.clear();
        }
        if (first && target.shading.rings > 0)
            out.mesh_rest = std::move(rest);
    }
    out.is_mesh = true;
    out.mesh_vertices = std::move(parts[0].vertices);
    out.mesh = std::move(parts[0].mesh);
    for (size_t k = 1; k < parts.size(); k++)
        out.mesh_vertices.later.push_back({std::move(parts[k].vertices.P), std::move(parts[k].vertices.N)});
    out.mesh.later_radius = std::move(later_radius);
    return out;
}

// Makes something, and coarser until it keeps within bounds.
template <class Make> // make(): false = it would take too much
bool make_within(const scene::Primitive& primitive, RateRule& rule, Journal& journal, Make make) {
    int halvings = 0;
    while (!make()) {
        const int step = halvings < 2 ? 1 : 2;
        if (halvings + step > MostHalvings) {
            journal.error(primitive.where,
                          "a primitive cannot be diced to any sensible number of micropolygons and was left "
                          "out; check its size and transform");
            return false;
        }
        halvings += step;
        rule.coarsen(step, MostHalvings);
    }
    if (halvings > 0)
        journal.warning(primitive.where, "a primitive would be diced to more than " +
                                             std::to_string(int64_t(rule.density.most_vertices())) +
                                             " micropolygons; they were made " +
                                             std::to_string(1 << halvings) +
                                             " times longer. Check its size and transform; else a larger "
                                             "shading rate, or splitting it up, would do");
    return true;
}

// A mesh at every step: make(primitive, first, journal, parts), `first` null for the first one. What was
// reported of that is not repeated.
template <class Make>
Diced dice_mesh_steps(const scene::Primitive& primitive, const DiceTarget& target, RateRule& rule,
                      const Displace& displace, Journal& journal, Make make) {
    std::vector<geom::MeshParts> parts(1);
    bool made = false;
    Journal quiet;
    Journal* reports = &journal;
    const bool fits = make_within(primitive, rule, journal, [&] {
        parts[0] = {};
        made = make(primitive, nullptr, *std::exchange(reports, &quiet), parts[0]);
        return !parts[0].too_many;
    });
    if (!fits || !made)
        return {};
    for (const scene::Primitive& later : target.later) {
        Journal quiet;
        parts.emplace_back();
        if (!make(later, &primitive, quiet, parts.back()))
            parts.back().vertices.nu = -1; // no such mesh
    }
    return dice_mesh(std::move(parts), primitive, target, displace, journal);
}

bool same_topology(const geom::Topology& a, const geom::Topology& b) {
    const auto same_side = [](const geom::Topology::Side& x, const geom::Topology::Side& y) {
        return x.edge == y.edge && x.part == y.part && x.reversed == y.reversed;
    };
    const auto same_face = [&](const auto& x, const auto& y) {
        return std::ranges::equal(x.sides, y.sides, same_side);
    };
    const auto same_edge = [](const geom::Topology::Edge& x, const geom::Topology::Edge& y) {
        return x.a == y.a && x.b == y.b && x.middle == y.middle && x.point == y.point;
    };
    return a.vertices == b.vertices && std::ranges::equal(a.faces, b.faces, same_face) &&
           std::ranges::equal(a.edges, b.edges, same_edge);
}

// The surface at later steps; none where it is another one then.
std::vector<std::unique_ptr<geom::Surface>> later_surfaces(geom::Surface& surface,
                                                           const scene::Primitive& primitive,
                                                           const DiceTarget& target, geom::SurfaceHints hints,
                                                           Journal& journal) {
    std::vector<std::unique_ptr<geom::Surface>> out;
    hints.first = &primitive;
    for (const scene::Primitive& later : target.later) {
        Journal quiet;
        out.push_back(geom::make_surface(later, target.render_from_object, quiet, hints));
        if (!out.back()) {
            report_other_topology(primitive, journal);
            return {};
        }
    }
    geom::share_lattice(surface, out);
    for (const auto& s : out)
        if (!same_topology(s->topology(), surface.topology())) {
            report_other_topology(primitive, journal);
            return {};
        }
    return out;
}

bool reads_parameters(const DiceTarget& target) {
    return target.displacing.parameters || target.shading.parameters;
}
bool reads_texture(const DiceTarget& target) {
    return target.displacing.texture || target.shading.texture;
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

// Bytes and vertices that the pieces become at all steps.
std::pair<uint64_t, uint64_t> size_of(const Splitter& splitter, bool merged, size_t steps) {
    grid::Grid one;
    one.allocate(0, 0);
    splitter.surface().allocate_channels(one);
    uint64_t floats = 0; // a vertex
    for (const auto* a : {&one.P, &one.N, &one.Ng, &one.dPdu, &one.dPdv, &one.u, &one.v, &one.s, &one.t})
        floats += a->size() / size_t(one.stride);
    for (const grid::Channel& c : one.primvars)
        floats += uint64_t(c.components);
    floats += 6 * (steps - 1);
    constexpr uint64_t AGrid = 2048, ASide = 16, Traced = 3; // bytes, bytes a vertex of it, floats
    uint64_t vertices = 0, padded = 0, sides = 0;
    for (const Piece& p : splitter.pieces) {
        const uint64_t n = uint64_t(p.nu + 1) * uint64_t(p.nv + 1);
        vertices += n;
        padded += (n + grid::LanePadding - 1) / grid::LanePadding * grid::LanePadding;
        sides += 2 * uint64_t(p.nu + p.nv);
    }
    if (merged) {
        vertices = vertices - sides + uint64_t(splitter.points());
        return {vertices * floats * 4 + uint64_t(splitter.cells()) * 16, vertices};
    }
    return {padded * (floats + Traced * steps) * 4 + splitter.pieces.size() * AGrid + sides * ASide,
            vertices};
}

// All grids of a surface at one step, their seams joined, displaced.
std::vector<grid::Grid> make_grids(const Splitter& splitter, const geom::Surface& surface,
                                   const Displace& displace, std::atomic<size_t>& bad,
                                   std::vector<char>& displaced, std::unique_ptr<Seams>& seams) {
    std::vector<grid::Grid> grids(splitter.pieces.size());
    tasks::parallel_chunks(grids.size(), 8, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            grids[i] = make_grid(splitter, surface, splitter.pieces[i]);
    });
    seams = std::make_unique<Seams>(splitter, grids);
    seams->join(grids);
    if (displace) {
        tasks::parallel_for(grids.size(), [&](size_t i) {
            bad += displace_grid(grids[i], displace, size_t(grids[i].vertices()), &displaced[i]);
        });
        seams->weld(grids);
    }
    return grids;
}

// Positions of the traced lattices at all steps. `later`: the grids of those after the first, whose P and N
// are with the first.
void place_traced(const Splitter& splitter, const Seams& seams, const std::vector<char>& displaced,
                  const std::vector<std::vector<grid::Grid>>& later, bool curved, Diced& out) {
    std::optional<Outline> outline;
    if (curved)
        outline.emplace(splitter, seams, out.traced, displaced);
    for (size_t step = 0; step <= later.size(); step++) {
        const GridsAtStep at{out.grids, step, step == 0 ? out.grids : later[step - 1]};
        const std::vector<Vec3f> points = outline ? outline->of_points(at) : std::vector<Vec3f>{};
        tasks::parallel_chunks(out.grids.size(), 8, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                grid::Grid& g = out.grids[i];
                std::vector<float>& P = step == 0 ? g.P : g.later[step - 1].P;
                std::vector<float> traced = outline
                                                ? outline->trace(i, at, P, points)
                                                : traced_positions(splitter.pieces[i], g, P, out.traced[i]);
                if (step == 0)
                    out.traced[i].P = std::move(traced);
                else
                    out.traced[i].later.push_back(std::move(traced));
            }
        });
    }
}

void drop_grids(Diced& diced, const std::vector<Kept>& kept) {
    size_t to = 0;
    for (size_t i = 0; i < kept.size(); i++) {
        if (kept[i] == Kept::None)
            continue;
        if (to != i) {
            diced.grids[to] = std::move(diced.grids[i]);
            diced.traced[to] = std::move(diced.traced[i]);
            diced.trimmed[to] = std::move(diced.trimmed[i]);
        }
        to++;
    }
    diced.grids.resize(to);
    diced.traced.resize(to);
    diced.trimmed.resize(to);
}

Diced dice_surface(const geom::Surface& surface, std::vector<std::unique_ptr<geom::Surface>> later,
                   const scene::Primitive& primitive, const DiceTarget& target, RateRule rule, bool simplify,
                   const Displace& displace, Journal& journal) {
    Diced out;
    std::vector<const geom::Surface*> shapes;
    for (const auto& s : later)
        shapes.push_back(s.get());
    std::unique_ptr<Splitter> splitter;
    if (!make_within(primitive, rule, journal, [&] {
            splitter = std::make_unique<Splitter>(surface, rule, shapes);
            return splitter->run(rule.density.most_vertices());
        }))
        return {};
    const bool merged = !surface.trim() && is_merged(*splitter, rule);
    if (target.fits) {
        const auto [bytes, vertices] = size_of(*splitter, merged, 1 + later.size());
        out.too_large = !target.fits(bytes, vertices);
        if (out.too_large)
            return out;
    }
    if (merged)
        return dice_mesh(
            merge_pieces(*splitter, later,
                         reads_parameters(target) || (reads_texture(target) && !surface.has_texture())),
            primitive, target, displace, journal);
    std::atomic<size_t> bad{0};
    std::unique_ptr<Seams> seams;
    std::vector<char> displaced(splitter->pieces.size(), 0);
    std::vector<std::vector<grid::Grid>> steps; // those after the first
    for (const auto& shape : later)
        steps.push_back(make_grids(*splitter, *shape, displace, bad, displaced, seams));
    out.grids = make_grids(*splitter, surface, displace, bad, displaced, seams);
    if (bad > 0)
        report_bad_displacement(bad, primitive.where, journal);
    for (std::vector<grid::Grid>& step : steps)
        for (size_t i = 0; i < step.size(); i++)
            out.grids[i].later.push_back({std::move(step[i].P), std::move(step[i].N)});
    choose_edge_steps(*splitter, out.grids, *seams, rule, simplify);
    out.traced.resize(out.grids.size());
    std::optional<geom::TrimRegion> region;
    std::vector<Kept> kept(out.grids.size(), Kept::All);
    if (surface.trim()) {
        region = make_region(surface, rule, primitive.where, journal);
        out.trimmed.resize(out.grids.size());
    }
    tasks::parallel_chunks(out.grids.size(), 8, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const Piece& piece = splitter->pieces[i];
            if (region)
                kept[i] = kept_of(*region, out.grids[i]);
            out.traced[i] =
                choose_steps(*splitter, piece, out.grids[i], rule, simplify && kept[i] != Kept::Part);
            if (kept[i] != Kept::Part)
                continue;
            out.trimmed[i] = cut_grid(*region, piece, out.grids[i], out.traced[i]);
            if (out.trimmed[i].indices.empty())
                kept[i] = Kept::None;
        }
    });
    // Polygons are what they are; trim curves cut triangles of the shading lattice.
    const bool curved = !std::holds_alternative<scene::PolygonMesh>(primitive.geometry) && !surface.trim();
    place_traced(*splitter, *seams, displaced, steps, curved, out);
    if (region)
        drop_grids(out, kept);
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
    RateRule rule{Density(target, options, attributes.shading_rate), target.shade_uniform && !displace,
                  std::max(0.0f, options.geometry_tolerance), std::max(0.0f, options.normal_tolerance),
                  max_cells};
    if (target.shines_along_normals) {
        constexpr float Degrees = 0.5f; // a cone's edge of that width is a line
        rule.normal_tolerance = std::min(rule.normal_tolerance, Degrees);
    }
    const bool simplify = options.geometry_tolerance > 0 && attributes.dice_flatness && !target.keep_density;
    const Transform& m = target.render_from_object;
    using P = scene::Primitive;
    if (const auto* curves = std::get_if<scene::Curves>(&primitive.geometry))
        return dice_mesh_steps(primitive, target, rule, displace, journal,
                               [&](const P& p, const P* first, Journal& j, geom::MeshParts& parts) {
                                   return geom::mesh_from_curves(p, *curves, m, rule.density,
                                                                 target.polygons || displace, j, parts,
                                                                 first);
                               });
    if (std::holds_alternative<scene::Points>(primitive.geometry))
        return dice_mesh_steps(primitive, target, rule, displace, journal,
                               [&](const P& p, const P* first, Journal& j, geom::MeshParts& parts) {
                                   return geom::mesh_from_points(p, m, rule.density, j, parts, first);
                               });
    if (const auto* blobby = std::get_if<scene::Blobby>(&primitive.geometry))
        return dice_mesh_steps(primitive, target, rule, displace, journal,
                               [&](const P& p, const P* first, Journal& j, geom::MeshParts& parts) {
                                   return geom::mesh_from_blobby(p, *blobby, m, rule.density, j, parts,
                                                                 first);
                               });
    geom::SurfaceHints hints;
    hints.moving = !target.later.empty();
    if (const auto* mesh = std::get_if<scene::PolygonMesh>(&primitive.geometry)) {
        const PolygonSizes sizes = polygon_sizes(primitive, *mesh, target, rule);
        if (sizes.finer_than_rate)
            return dice_mesh_steps(
                primitive, target, rule, displace, journal,
                [&](const P& p, const P* first, Journal& j, geom::MeshParts& parts) {
                    if (!geom::mesh_from_polygons(p, *mesh, m, reads_parameters(target), j, parts, first))
                        return false;
                    geom::vertex_normals(parts.vertices, parts.mesh, parts.vertices.flips, parts.vertices.Ng);
                    return true;
                });
        hints.small_triangles = sizes.small;
    }
    const auto surface = geom::make_surface(primitive, m, journal, hints);
    if (!surface)
        return {};
    return dice_surface(*surface, later_surfaces(*surface, primitive, target, hints, journal), primitive,
                        target, rule, simplify, displace, journal);
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
