// The traced surfaces of a scene as meshes, with the colours of their materials: for other programs.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/stats.h"
#include "geom/decimate.h"
#include "render/session.h"

namespace kanuka::render {

class Albedos;
struct Geometry;

// What a primitive became: displaced, and welded where its grids meet. The outside is where faces wind
// against the clock. Where colours vary there is a vertex for each that was shaded, on the traced surface.
struct Surface {
    geom::ColoredMesh mesh;     // in the space of its group, about `SurfaceGroup::origin`
    std::string name;           // empty = it has none
    std::string kind;           // of primitive
    int id = 0;                 // as the layer `id` has it
    uint64_t micropolygons = 0; // that were shaded
};
struct SurfaceGroup {
    std::string name;
    std::array<double, 3> origin{}; // added to points, and to what instances of it are placed by
    std::vector<Surface> surfaces;
    struct Instances {
        int group; // a lower one
        std::vector<float>
            matrices; // row-major 3x4, 12 floats each: group_from_child, both about their origins
    };
    std::vector<Instances> instances;
};
// The last is the world. When the shutter opens.
std::vector<SurfaceGroup> surfaces_of(const Geometry& geometry, const std::array<double, 3>& world_origin,
                                      const Albedos& albedos, const scene::Scene& scene, Journal& journal,
                                      const Progress& progress);

// Dices and shades a scene as for a picture, or takes what is stored, and traces nothing. Empty: cancelled.
// The same bits for any number of threads. Throws Error as sessions do.
std::vector<SurfaceGroup> read_surfaces(const scene::Scene& scene, const Overrides& overrides,
                                        Journal& journal, Stats& stats, const Progress& progress);

} // namespace kanuka::render
