#include "dice/dice.h"

#include <cmath>

#include "dice/meshes.h"
#include "dice/surfaces.h"

namespace kanuka::dice {
namespace {

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
    geom::sample_polygons(primitive, mesh, target.page_from_object, Samples, [&](const Vec3f* p, int n) {
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

// As what its kind, and its size in the picture, make of it.
Diced dice_primitive(const scene::Primitive& primitive, const DiceTarget& target, const DiceOptions& options,
                     const Displace& displace, Journal& journal) {
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
    const Transform& m = target.page_from_object;
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
                                   return geom::mesh_from_points(
                                       p, m, rule.density, target.polygons || displace, j, parts, first);
                               });
    if (const auto* blobby = std::get_if<scene::Blobby>(&primitive.geometry))
        return dice_mesh_steps(primitive, target, rule, displace, journal,
                               [&](const P& p, const P* first, Journal& j, geom::MeshParts& parts) {
                                   return geom::mesh_from_blobby(p, *blobby, m, rule.density, j, parts,
                                                                 first);
                               });
    geom::SurfaceHints hints;
    hints.shape_alone = rule.shape_only;
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
    return dice_surface(primitive, target, hints, rule, simplify, displace, journal);
}

} // namespace

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
