#include "dice/meshes.h"

#include <utility>

#include "dice/coarsen.h"
#include "dice/displace.h"
#include "grid/mesh_patches.h"

namespace kanuka::dice {

void report_other_topology(const scene::Primitive& primitive, Journal& journal) {
    journal.error(
        primitive.where,
        "a primitive that changes its shape has other faces or vertices at a later time and was left as "
        "it is at first; all its samples must have one topology");
}

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

Diced dice_mesh_steps(const scene::Primitive& primitive, const DiceTarget& target, RateRule& rule,
                      const Displace& displace, Journal& journal, const MakeMesh& make) {
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

} // namespace kanuka::dice
