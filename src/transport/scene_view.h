// What the kernels read: flat arrays and plain structs, prepared once by SceneData. Nothing here is written
// while tracing.
#pragma once

#include <cstddef>
#include <vector>

#include "bsdf/material.h"
#include "bsdf/phase.h"
#include "bvh/bvh.h"
#include "grid/ways.h"
#include "scene/scene.h"
#include "store/store.h"
#include "transport/integrator.h"
#include "transport/light_tree.h"
#include "transport/path_state.h"
#include "transport/picture_cells.h"
#include "transport/wavelengths.h"

namespace kanuka::transport {

// Words of four bytes, gathered by lanes; see light_shapes.h. What most lights are asked for lies in the
// first cache line: there may be many, and each is asked seldom.
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
    int32_t picture; // quads: its density in SceneView::light_densities; -1 = none
    int32_t source;  // place in SceneInputs::lights
};
static_assert(offsetof(AnalyticLight, axis) == 64);
inline constexpr int AnalyticWords = sizeof(AnalyticLight) / 4;

// Where the shadows of a light end that surfaces are lit by in ways of their own: grid::LitBy.
struct PointLight {
    Vec3f place; // render space; far: the direction to it
    bool far = false;
    int32_t passes = 0; // as AnalyticLight has it
};

struct EnvironmentMap {
    int width = 0, height = 0;
    std::vector<float> rgb;           // 3 a texel, rows from +z (theta = 0) down; bounded and finite
    PictureCells cells;               // of what is above the mean; no rows = nothing is
    float mean = 0, density = 0;      // of weights over the sphere; see map_pdf()
    float environment_from_render[9]; // rows
    bool visible_camera = true;
};

struct ConstantEnvironment {
    bool present = false, visible_camera = false;
    float c[4] = {0, 0, 0, 0};
};

struct CameraView {
    Projection projection = Projection::Perspective;
    // Film coordinates (base/projection.h): x = left + (right - left) * px / width, y downwards.
    float left, right, top, bottom;
    int width, height;
    float half_angle = 0.5f * Pi; // of fisheyes' image circle, radians
    float render_from_camera[12];
    // A moving camera: MotionSteps + 1 matrices like that, evenly over the shutter; linear in between. Empty
    // = still.
    static constexpr int MotionSteps = 256;
    std::vector<float> motion;
    float lens_radius = 0, focal_distance = 0;
    // Iris: a regular polygon of `blades` sides inscribed in the lens, the first corner turned by an angle
    // from x; below 3 = round. Anamorphic lenses see it narrower by `squeeze`.
    int blades = 0;
    float blade_cos = 1, blade_sin = 0, squeeze = 1;
    float near_clip = 0;
};

// An interior, as lanes read it.
struct MediumRow {
    enum Field {
        Absorption = 0, // c0 c1 c2 scale, as store::Interior
        Scattering = 4,
        Ior = 8,
        Priority = 9,
        Scatters = 10, // 1 or 0
        Angstrom = 11, // scattering goes with (550 nm / wavelength) to this power
        Field = 12,    // bits of the place in SceneView::fields; -1 = the same everywhere
        Fields = 16
    };
    static constexpr int Shift = 4; // rows are 16 floats apart
};

struct SceneView {
    const uint32_t* words;
    const float* floats;
    const int32_t* shapes; // ShapeRecord as words
    const store::Emitter* emitters;
    const store::Links* links; // ShapeRecord::links
    const bvh::Scene* bvh;
    std::vector<bsdf::MaterialCode> materials; // by program
    std::vector<int> airs;                     // that materials lie behind
    const grid::Air* air = nullptr;            // null = there is none; set when the view is there, to ask it
    bool tinted = false; // some shape stops some colours more than others: store::ShapeRecord::Tinted
    bool keeps_ratios =
        false; // densities differ between wavelengths: something disperses, or scatters inside
    bool instanced = false;
    // Channels of the output variables that displays ask for, three to each; which of them count as colours
    // (filtered with the picture) and not as data (a mean over what was hit).
    std::vector<bool> aov_is_color;

    bsdf::UpliftView uplift;
    WavelengthTable wavelengths;
    float sensor_matrix[9];     // output RGB from the sensor's values
    std::vector<float> spectra; // tables of the palette, 480 floats each; empty = none
    const float* filter_x;      // inverse cumulative tables of the pixel filter, offsets in pixels
    const float* filter_y;
    const float* filter_weight_x; // signs of negative lobes; may be null
    const float* filter_weight_y;
    int filter_size;
    bool filter_weighted() const { return filter_weight_x || filter_weight_y || filter_cells.nx > 0; }
    // A filter given as a table of ny rows of nx cells over its width: masses of |f| from 0 to 1, of rows and
    // of the cells of each row, and signed weights of cells. nx = 0: there are the tables above instead.
    struct FilterCells {
        int nx = 0, ny = 0;
        const float* rows = nullptr;   // ny + 1
        const float* cells = nullptr;  // (nx + 1) * ny
        const float* weight = nullptr; // nx * ny
        float width[2] = {0, 0};       // in pixels
    };
    FilterCells filter_cells;

    CameraView camera;
    bool moving = false;                  // paths have a time: something moves while the shutter is open
    std::vector<float> shutter_quantiles; // scene::shutter_quantiles; empty = open all the time
    // Some shape has it: store::Links::seen, and levels of detail in transition.
    bool holds_out = false, hides = false, fades = false, backdrops = false;
    IntegratorChoice integrator;
    float clamp_direct = Unclamped, clamp_indirect = Unclamped; // most radiance of one contribution
    int max_depth = 8;                                          // surface events of a path
    int volume_depth = 1024;                                    // events inside of media
    int roulette_depth = 4;
    bool interreflection =
        true; // false: paths end where they come from anything but the camera and smooth lobes
    uint32_t seed = 0;

    // Lights: the choices are all of the hierarchy together (if any), the environment map, and each analytic
    // light that is not in the hierarchy.
    std::vector<PointLight> point_lights; // that surfaces are LitBy, by number
    LargeVector<AnalyticLight> lights;    // choices first_light_choice, …; then those of the hierarchy
    std::vector<LightBound> bounds;       // of `lights`; distant ones: power is the irradiance
    int lights_by_choice = 0, distant_lights = 0; // the distant ones come first
    bool points_in_tree = false;                  // lights that nothing but the hierarchy finds
    uint32_t light_shapes = 0; // bits by AnalyticLight::Shape, of all; by_tables: some have one
    bool light_tables_used = false;
    std::vector<float> light_tables, light_densities;
    EnvironmentMap map;
    ConstantEnvironment constant;
    // Ambient lights: surfaces show it without shadows, to the camera and in mirrors; nothing else sees it.
    struct {
        bool present = false;
        float c[4] = {0, 0, 0, 0};
        int32_t sets = 0;
    } ambient;
    // Lights asked at a vertex: two where some are at infinity and some are not. Far choices are then the
    // picture of the sky and the distant lights.
    int asks = 1;
    static constexpr int FewChoices = 24;
    int choices = 0, emitter_choice = -1, map_choice = -1, first_light_choice = 0;
    // What the environment brings to a surface that sees all of it, and all of the hierarchy as one sphere:
    // estimates that decide how often each is asked (LightChances in lights.h).
    float map_brings = 0, emitter_power = 0, emitter_radius2 = 0;
    Vec3f emitter_center{0, 0, 0};
    bool linked = false;        // light linking: some lights do not shine on all
    bool shadow_linked = false; // some shapes let some lights through
    bool shadowless = false;    // some lights shine through everything
    int32_t map_sets = -1, constant_sets = -1;

    // Leaves of the hierarchy: emitting triangles by slot (bvh::number_emitters), then analytic lights.
    LightTree tree;
    int triangle_slots = 0, world_slots = 0; // of all; of those not in instances, which come first
    int first_emitter = 0;                   // of the world; slots of instanced triangles are looked up:
    std::vector<int32_t> slot_emitter, slot_placement;
    std::vector<float> placements; // 12 floats each, world_from_group
    // One flat patch of one or two triangles needs no hierarchy: a table by area.
    std::vector<float> alias_probability;
    std::vector<int32_t> alias_other;
    std::vector<float> emitter_density; // chance of the emitter among all, over its area; 0 = not sampled
    std::vector<int32_t> sampled_emitters;
    // Analytic lights that rays can meet: those sampled by choice in turn, those of the hierarchy by one of
    // their own.
    std::vector<int32_t> met_lights;
    LightTree met_tree;        // leaves: as `lights`
    std::vector<int32_t> suns; // distant lights with a cone
    // Lamps without size, by choice of their own, where some fog is the same everywhere: stage_fog.h.
    static constexpr int MostFogLamps = 16;
    std::vector<int32_t> fog_lamps;
    // What light sampling needs to know again where a ray meets a light: paths carry the normal they left.
    bool keeps_normals = false;
    bool meets_lights() const { return !met_lights.empty() || !met_tree.empty(); }

    std::vector<bsdf::Phase<1>> phases; // of interiors
    // Paths keep track of the media around them: there are several interiors, or one that absorbs or
    // scatters, or one whose boundary lets light pass as it comes (`clear`: by program, no lobes).
    bool media = false, scatters = false, clear_boundaries = false;
    bool has_fog = false; // something scatters that is the same everywhere
    std::vector<int32_t> clear;
    // Some materials let light go on as it came (`straight`: by program): shadow rays ask how much.
    bool thin_walls = false;
    std::vector<int32_t> straight;
    std::vector<float> media_rows;              // MediumRow, of nothing, then of each interior
    std::vector<float> fields;                  // see fields.h; empty = all interiors are the same everywhere
    int32_t camera_media[4] = {-1, -1, -1, -1}; // where the camera stands; as MediaStack has it
    int last_step() const { return media ? max_depth + volume_depth : max_depth; }
};

} // namespace kanuka::transport
