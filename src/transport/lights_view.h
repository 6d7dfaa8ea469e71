// Lights, as kernels read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "transport/light_tree.h"
#include "transport/picture_cells.h"

namespace kanuka::transport {

struct LightMultipliers;

// Words of four bytes, gathered by lanes; see light_shapes.h. What most lights are sampled by lies in the
// first cache line: there may be many, and each is sampled seldom.
struct alignas(64) AnalyticLight {
    // What it is to be sampled: Delta lights have a place alone.
    enum Shape : int32_t { Delta, Distant, Quad, Disk, Sphere, Cylinder };
    int32_t shape;
    float c[4]; // amount, as color::Palette::emission has it; of a soft point or spot: radiance
    Vec3f position;
    float half_x, half_y; // quad: half its sides; others: radius, cylinder: half its length
    float area;           // quad, disk
    float cos_outer;      // spot; -2: no cone
    int32_t width;        // of the table; 0 = none
    int32_t visible_camera;
    int32_t sets;   // light linking: bits of the receivers' sets it shines on
    int32_t passes; // shadow linking: its bit in store::Links::lets_through; Shadowless
    static constexpr int32_t Shadowless = INT32_MIN; // it shines through everything

    Vec3f axis, x, y; // unit vectors; axis: the way light travels
    float cos_inner;
    int32_t exponent;
    float cone; // distant: 1 - cosine of the angular radius; 0 = delta
    // scene::LightTable
    int32_t table, height, layers, falloff;
    float angle, nearest, extent;
    int32_t picture; // quads: its density in LightsView::densities; -1 = none
    int32_t source;  // place in SceneInputs::lights
};
static_assert(offsetof(AnalyticLight, axis) == 64);
inline constexpr int AnalyticWords = sizeof(AnalyticLight) / 4;

// Where the shadows of a light end that shaders have baked into a surface: grid::LitBy.
struct PointLight {
    Vec3f place; // render space; far: the direction to it
    bool far = false;
    int32_t passes = 0; // as AnalyticLight has it
};

struct EnvironmentMap {
    int width = 0, height = 0;
    // 3 a texel, rows from +z (theta = 0) down; bounded and finite. Each row ends with its first texel, and
    // two values follow the last: lanes read two texels side by side as eight values.
    std::span<const float> rgb;
    PictureCellsView cells;           // of what is above the mean; no rows = nothing is
    float mean = 0, density = 0;      // of weights over the sphere; see map_pdf()
    float environment_from_render[9]; // rows
    bool visible_camera = true;
    int32_t sets = -1; // light linking
};

struct ConstantEnvironment {
    bool present = false, visible_camera = false;
    float c[4] = {0, 0, 0, 0};
    int32_t sets = -1;
};

// Surfaces show it without shadows, to the camera and in mirrors; nothing else sees it.
struct AmbientLight {
    bool present = false;
    float c[4] = {0, 0, 0, 0};
    int32_t sets = 0;
};

// Emitting triangles by slot (bvh::number_emitters).
struct EmitterSlots {
    int count = 0, in_world = 0; // of all; of those not in instances, which come first
    int first_emitter = 0;       // of the world; slots of instanced triangles are looked up:
    std::span<const int32_t> emitter, placement;
    std::span<const float> placements; // 12 floats each, world_from_group
    std::span<const float> power;      // of each slot: area times luminance
};

// One flat patch of one or two triangles needs no hierarchy: a table by area (Vose 1991).
struct AliasTable {
    std::span<const float> probability;
    std::span<const int32_t> other, emitters;
    std::span<const float> pdf_area; // of each emitter of the store, the choice included; 0 = not sampled
};

struct LightsView {
    // The choices are all of the hierarchy together (if any), the environment (its picture, or all of it
    // through portals), and each analytic light that is not in the hierarchy.
    std::span<const AnalyticLight> analytic; // choices first_light_choice, …; then those of the hierarchy
    std::span<const LightBound> bounds;      // of `analytic`; distant ones: power is the irradiance
    int by_choice = 0, distant = 0;          // the distant ones come first
    bool points_in_tree = false;             // lights that nothing but the hierarchy finds
    uint32_t shapes = 0;                     // bits by AnalyticLight::Shape, of all
    bool has_tables = false;
    std::span<const float> tables, densities;
    EnvironmentMap map;
    ConstantEnvironment constant;
    AmbientLight ambient;
    std::span<const AnalyticLight> portals;   // quads; none where no environment is
    std::span<const PointLight> point_lights; // that surfaces are LitBy, by number

    // Light samples at a vertex: two where some lights are at infinity and some are not. Far choices are then
    // the picture of the sky and the distant lights.
    int samples = 1;
    static constexpr int FewChoices = 24;
    int choices = 0, emitter_choice = -1, map_choice = -1, first_light_choice = 0;
    int32_t map_choice_sets = -1; // light linking
    // The irradiance of the environment at a surface that sees all of it, and all of the hierarchy as one
    // sphere: estimates that decide how often each is sampled (LightChooser in light_choice.h).
    float map_irradiance = 0, emitter_power = 0, emitter_radius2 = 0;
    Vec3f emitter_center{0, 0, 0};
    LightTreeView tree; // leaves: emitting triangles by slot, then analytic lights
    EmitterSlots slots;
    AliasTable alias;

    // May paths search the sky along pairs of directions? Where it is the same everywhere; of pictures, which
    // are sampled where they are bright, it was worth nothing.
    bool pairs_sky() const { return constant.present && map.width == 0 && portals.empty(); }

    bool linked = false;        // light linking: some lights do not shine on all
    bool shadow_linked = false; // some shapes let some lights through
    bool shadowless = false;    // some lights shine through everything

    // Analytic lights that rays can hit: those sampled by choice in turn, those of the hierarchy by one of
    // their own.
    std::span<const int32_t> hittable;
    LightTreeView hittable_tree;   // leaves: as `analytic`
    std::span<const int32_t> suns; // distant lights with a cone
    bool any_hittable() const { return !hittable.empty() || !hittable_tree.empty(); }
    // Lamps without size, by choice of their own, where some fog is the same everywhere: stage_fog.h.
    static constexpr int MostFogLamps = 16;
    std::span<const int32_t> fog_lamps;
    // What light sampling needs to know again where a ray hits a light: paths carry the normal they left.
    bool keeps_normals = false;
    const LightMultipliers* multipliers = nullptr; // null = no light has some
};

} // namespace kanuka::transport
