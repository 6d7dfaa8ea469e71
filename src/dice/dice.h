// From primitives to grids: bound, split, choose rates, dice, displace, weld edges; then the traced density.
#pragma once

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

#include "base/error.h"
#include "dice/density_field.h"
#include "grid/grid.h"
#include "grid/trimmed.h"
#include "scene/scene.h"

namespace kanuka::dice {

// Rates are chosen as seen from here. `pixels_per_unit(P)`, for an edge or area at P, follows from it.
struct DicingCamera {
    // RISpec camera space: x right, y up, z forward; in the space of the page that is diced
    // (render/page_frame.h). Before a page is chosen, in render space.
    Transform page_from_camera;
    std::vector<Transform>
        also_from; // the same at other times while the shutter is open: the finest view counts
    // Of all frames of a shot that are rendered together: what stands still is diced for these instead, and
    // so alike in each of them. Empty = this is a picture by itself.
    std::vector<Transform> shot;
    Projection projection = Projection::Perspective;
    // Across the picture, in perspective: pixels per unit of tangent; orthographic: pixels per unit. Others:
    // pixels per radian, at the picture's centre, the root of those along both axes.
    float pixels_per_tangent = 0;
    // How many times as many there are up the picture, where pixels are not square (perspective,
    // orthographic).
    float pixel_stretch = 1;
    float finest_pixels() const { return pixels_per_tangent * std::max(1.0f, pixel_stretch); }
    float half_angle = 1; // of a fisheye's image circle, radians
    float near_clip = 1e-4f;
    int width = 0, height = 0;
    // Middle of the picture: a tangent (orthographic: units) right of the axis, and above it.
    float middle_x = 0, middle_y = 0;
    // Where all of a primitive lies: across the border, what is outside grows coarser step by step.
    enum class Border : uint8_t { Across, Within, Outside } border = Border::Across;
    // Primitives outside the frustum are diced too (rays reach them), but coarser: 0 = they are not, 1 = as
    // usual.
    float offscreen_falloff = 1;
};

struct DiceOptions {
    DicingCamera camera;
    float shading_rate_scale = 1;     // multiplies every attribute's shading rate (command line)
    int max_grid_cells = 32;          // a side; a power of two
    float geometry_tolerance = 0.25f; // pixels; 0 = traced geometry at shading density
    float normal_tolerance = 3;       // degrees
    // A primitive that would need more micropolygons is diced coarser, and reported.
    static constexpr double MostMicropolygons = double(1 << 25);
    double max_micropolygons = MostMicropolygons;
    // As many as a picture can show of a primitive, and what it reflects, at the finest shading rate there
    // is: a small picture of something endless must not take as long as a large one.
    static double most_for(int width, int height, float shading_rate) {
        constexpr double APixel = 64, Always = double(1 << 18);
        constexpr float Least = 1.0f / 16, Most = 1;
        return std::clamp(APixel * double(width) * double(height) /
                              double(std::clamp(shading_rate, Least, Most)),
                          Always, MostMicropolygons);
    }
};

// What a primitive became: grids (with their traced lattices, parallel), or a mesh: one that is finer than
// the rate, curves as ribbons, fibres or tubes, points as small spheres.
struct Diced {
    std::vector<grid::Grid> grids;
    std::vector<grid::TracedGrid> traced;
    // Of trimmed surfaces, parallel too: what is traced instead of the lattice where it is not empty.
    std::vector<grid::TrimmedMesh> trimmed;
    bool too_large = false; // for DiceTarget::fits: nothing was made
    bool is_mesh = false;
    grid::Grid mesh_vertices; // nu = vertices - 1, nv = 0
    grid::TracedMesh mesh;
    std::vector<float> mesh_rest; // P before displacement, if shading asks for neighbours and there was one
};

// Displaces one grid in place; empty = the surface is not displaced. Must depend on each vertex and its
// neighbours alone; of meshes it gets patches (grid/mesh_patches.h). Shapes that change are displaced at
// every step.
using Displace = std::function<void(grid::Grid&)>;
struct DiceTarget {
    Transform page_from_object;
    // Many instances: diced uniformly, as if `pixels_per_unit` held everywhere; 0 = use the camera.
    float pixels_per_unit = 0;
    // Few instances: page_from_camera of each of them, in place of the dicing camera's own. What is diced so
    // faces no camera.
    std::vector<Transform> instead_from = {};
    bool shade_uniform =
        false; // the material is constant: rates serve geometry alone, flat pieces need one cell
    // What displacement and shading read: a mesh has vertices of its own for each face where u and v matter
    // that are a face's own, and neighbours where those do.
    grid::Reads displacing = {}, shading = {};
    bool keep_density = false; // traced geometry is not simplified: emitters whose light varies over them,
                               // triangle by triangle
    bool shines_along_normals = false; // emitters whose facets show: their light goes by the angle to them
    bool polygons = false;             // curves, too: emitters are triangles
    float finer = 1; // how many times as many cells a side as its size in the picture asks for
    const DensityField* field = nullptr; // factors of that, place by place; null = 1 everywhere
    // A primitive that moves as a whole: more places to see it from, as DicingCamera has them.
    std::vector<Transform> also_from = {};
    // A primitive that changes its shape: what it is at further steps, evenly through the time that the
    // shutter is open. Diced with the first one's topology, as finely as the finest needs.
    std::span<const scene::Primitive> later = {};
    // Asked once a surface's grids are counted, before any is made: how many bytes they take at most, of how
    // many vertices. Null = all fits. (Meshes that are traced as they are take as much as was read.)
    std::function<bool(uint64_t bytes, uint64_t vertices)> fits = {};
};

// Never throws for bad geometry: NaN and degenerate parts are reported at primitive.where and dropped. The
// result is the same for any thread count. Uses tasks:: inside.
Diced dice(const scene::Primitive& primitive, const DiceTarget& target, const DiceOptions& options,
           const Displace& displace, Journal& journal);

} // namespace kanuka::dice
