#include "dice/surfaces.h"

#include <atomic>
#include <optional>
#include <utility>

#include "base/tasks.h"
#include "dice/coarsen.h"
#include "dice/displace.h"
#include "dice/merge.h"
#include "dice/meshes.h"
#include "dice/outline.h"
#include "dice/simplify.h"
#include "dice/trim.h"

namespace kanuka::dice {
namespace {

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
        out.push_back(geom::make_surface(later, target.page_from_object, quiet, hints));
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

bool reads_texture(const DiceTarget& target) {
    return target.displacing.texture || target.shading.texture;
}

// Many small pieces become one mesh. A grid of its own costs each of them some two kilobytes, and a vertex on
// every side that its neighbour has as well: at 3 x 3 cells a mesh has 0.6 of the vertices to shade. From 4 x
// 4 cells on grids win, since flat ones are traced coarser. Vertices of meshes that may be displaced are not
// moved outwards (outline.h), so their long micropolygons stay grids, but where they hardly divide their
// pieces or these are very many.
bool is_merged(const Splitter& splitter, const RateRule& rule, bool displaced) {
    constexpr double Many = 256, VeryMany = 200000;
    constexpr double FinerThanRate = 1.5, Few = 6, Some = 12; // micropolygons a piece
    const double pieces = double(splitter.pieces.size()), each = splitter.cells() / std::max(1.0, pieces);
    const double most = !displaced || !rule.is_coarse() ? Some : pieces >= VeryMany ? Few : FinerThanRate;
    return pieces >= Many && each < most;
}

// Bytes and vertices that the pieces become at all steps.
std::pair<uint64_t, uint64_t> size_of(const Splitter& splitter, bool merged, bool outlines, size_t steps) {
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
        floats += outlines ? 10 : 0; // where it is traced, and how that is found
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

// A surface, and what it is at later steps.
Diced dice_steps(const geom::Surface& surface, std::vector<std::unique_ptr<geom::Surface>> later,
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
    const bool merged = !surface.trim() && is_merged(*splitter, rule, bool(displace));
    // Polygons are what they are; trim curves cut triangles of the shading lattice.
    const bool curved = !std::holds_alternative<scene::PolygonMesh>(primitive.geometry) && !surface.trim();
    // Micropolygons of a pixel miss so little that it does not show.
    const bool outlines = merged && curved && !displace && (rule.shape_only || rule.is_coarse());
    if (target.fits) {
        const auto [bytes, vertices] = size_of(*splitter, merged, outlines, 1 + later.size());
        out.too_large = !target.fits(bytes, vertices);
        if (out.too_large)
            return out;
    }
    if (merged)
        return dice_mesh(
            merge_pieces(*splitter, later,
                         reads_parameters(target) || (reads_texture(target) && !surface.has_texture()),
                         outlines),
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
    place_traced(*splitter, *seams, displaced, steps, curved, out);
    if (region)
        drop_grids(out, kept);
    return out;
}

} // namespace

bool reads_parameters(const DiceTarget& target) {
    return target.displacing.parameters || target.shading.parameters;
}

Diced dice_surface(const scene::Primitive& primitive, const DiceTarget& target,
                   const geom::SurfaceHints& hints, const RateRule& rule, bool simplify,
                   const Displace& displace, Journal& journal) {
    const auto surface = geom::make_surface(primitive, target.page_from_object, journal, hints);
    if (!surface)
        return {};
    return dice_steps(*surface, later_surfaces(*surface, primitive, target, hints, journal), primitive,
                      target, rule, simplify, displace, journal);
}

} // namespace kanuka::dice
