// The scene model: what every source of scenes (RIB, the C binding, Python, USD) fills in, and every driver
// renders. Data only: no rendering code. Right-handed or left-handed makes no difference here; transforms
// carry it.
#pragma once

#include <map>
#include <set>

#include "base/motion.h"
#include "base/projection.h"
#include "base/shared_value.h"
#include "scene/lobe_multipliers.h"
#include "scene/node.h"
#include "scene/values.h"

namespace kanuka::scene {

// A shader by name, with the values given to it and the space it was declared in.
struct ShaderRef {
    std::string
        name; // looked up as NAME.slo or NAME.sl along Options::shader_path, then among the standard shaders
    std::string handle;
    ValueList parameters;
    Transform world_from_shader; // its "shader" coordinate system
    Location where;
    std::vector<ShaderRef> coshaders; // that it may call by their handles, besides those of the attributes
    // Of a light: a standard light shader, for where its own is not found. No name: tracing finds its light.
    struct StandIn {
        std::string name;
        ValueList parameters;
    };
    std::shared_ptr<const StandIn> stand_in; // null = nobody said
    // Of a light: do things stand in its way? Not said: lights of RISpec's four kinds, and those that are
    // run, ask for shadows by a parameter that names one; all others have them.
    std::optional<bool> shadows;
    NodeId node = NodeId::None; // of a light; other shaders are known by what they belong to, and their slot
};

inline void transform_shader(const Transform& world_from_here, ShaderRef& shader) {
    shader.world_from_shader = world_from_here * shader.world_from_shader;
    for (ShaderRef& c : shader.coshaders)
        transform_shader(world_from_here, c);
}

// The RenderMan attribute state that holds when a primitive is declared. Shared by many primitives; never
// changed after.
struct Attributes {
    Rgb color{1, 1, 1};
    Rgb opacity{1, 1, 1};
    float shading_rate = 1; // micropolygon area in pixels
    int sides = 2;
    bool reverse_orientation = false; // "inside"/"rh" against the handedness of the transform
    bool matte = false;
    std::optional<ShaderRef> surface; // none = the default surface: matte
    std::optional<ShaderRef> displacement;
    std::optional<ShaderRef> interior, exterior, atmosphere;
    std::optional<ShaderRef> area_light; // AreaLightSource: the primitive emits
    std::vector<ShaderRef> coshaders;    // Shader: what its shaders may call, by handle
    float displacement_bound = 0;
    std::string displacement_bound_space = "object";
    std::string name; // Attribute "identifier" "name"
    bool visible_camera = true;
    bool dice_flatness = true; // false: traced geometry = shading density
    std::array<float, 8> texture_coordinates{0, 0, 1, 0, 0, 1, 1, 1};
    bool shadow_terminator = true; // false: coarse polygons with smooth normals hide light as facets
    std::string density_primvar = "density"; // of a Volume
    std::string color_spectrum;              // in place of color; empty = none
    // Names of the lights that are on for it (Illuminate); null = all.
    std::shared_ptr<const std::set<std::string>> lights_on;
    // Lights by name or group: those that alone shine on it (none = all), that do not, and that shine through
    // it.
    std::vector<std::string> lights_only, lights_off, shadows_off;
    bool casts_shadows = true;            // false: all lights shine through it
    bool area_light_by_intensity = false; // of "arealight": see scene/schema/attributes.cpp
    // Of the paths' numbers from 0 to 1 those that meet it: a level of detail in transition.
    float level_from = 0, level_to = 1;
    // Of a primitive that is instanced: its surface is shaded so many times, with the variable "variant" from
    // 0 on, and instances show any of them, or what lies between two (Variation).
    int variants = 1;
    ValueList user; // every other Attribute call, as "category:name"
};

// ---- geometry
// -------------------------------------------------------------------------------------------------------
// Names, orders and defaults are RISpec 3.2's. Positions are the primvar "P" (or "Pw"), in object space.

struct PolygonMesh {                   // Polygon, GeneralPolygon, PointsPolygons, PointsGeneralPolygons
    Buffer<int32_t> loops_per_face;    // empty = one loop each
    Buffer<int32_t> vertices_per_loop; // empty = triangles
    Buffer<int32_t> vertices;          // indices into P; empty = 0, 1, 2, …
};

struct SubdivisionMesh {
    std::string scheme = "catmull-clark"; // catmull-clark, loop, bilinear
    Buffer<int32_t> vertices_per_face, vertices;
    struct Tag { // crease, corner, hole, interpolateboundary, facevaryinginterpolateboundary, …
        std::string name;
        std::vector<int32_t> ints;
        std::vector<float> floats;
        std::vector<std::string> strings;
    };
    std::vector<Tag> tags;
};

struct Basis {
    std::array<std::array<float, 4>, 4> m; // row k = coefficients of t^(3-k), as in RiBasis
    int step = 3;
    bool operator==(const Basis&) const = default;
};
Basis basis_by_name(std::string_view name); // bezier, b-spline, catmull-rom, hermite, power; throws Error

struct PatchMesh { // Patch (nu = nv = 2 or 4) and PatchMesh, vertices in u-fastest order
    bool cubic = true;
    int nu = 4, nv = 4;
    bool u_periodic = false, v_periodic = false;
    Shared<Basis> u_basis, v_basis;
};

// TrimCurve: loops of rational B-splines in the parameters of a NuPatch. A point is kept if a line from it
// to infinity crosses them an odd number of times (`outside`: an even number).
struct TrimCurves {
    Buffer<int32_t> curves_per_loop;
    Buffer<int32_t> order, points; // of each curve
    Buffer<float> knots;           // points + order of each curve
    Buffer<float> min, max;        // of each curve
    Buffer<float> u, v, w;         // homogeneous control points
    bool outside = false;
    Location where;
};

struct NuPatch {
    int nu, u_order, nv, v_order;
    Buffer<float> u_knots, v_knots;
    float u_min, u_max, v_min, v_max;
    std::shared_ptr<const TrimCurves> trim = nullptr;
};

struct Quadric {
    enum class Kind { Sphere, Cone, Cylinder, Hyperboloid, Paraboloid, Disk, Torus } kind;
    // Sphere radius zmin zmax theta; Cone height radius theta; Cylinder radius zmin zmax theta; Paraboloid
    // rmax zmin zmax theta; Disk height radius theta; Torus majorrad minorrad phimin phimax theta;
    // Hyperboloid p1 p2 theta (7 floats).
    std::vector<float> arguments; // angles in degrees
};

struct Curves {
    bool cubic = true;
    bool periodic = false;
    Shared<Basis> basis;
    Buffer<int32_t> vertices_per_curve; // primvars: P, width or constantwidth, N
};

// primvars: P, width or constantwidth; "type": particle, sphere (spheres both), disk (facing the camera, or
// across N), patch (a square, with patchaspectratio and patchangle)
struct Points {};

// RISpec 5.6: an implicit surface made of blobs, as a program: each operation takes the results of earlier
// ones.
struct Blobby {
    int leaves = 0; // vertex and varying primvars have so many values
    Buffer<int32_t> code;
    Buffer<float> floats;
    Buffer<std::string> strings; // files of repelling planes' heights
};

// What fills a box, or the body of a shape that touches its sides (cylinder and cone along z, the cone's tip
// at zmax): vertex and varying primvars lie on a lattice over the box, x fastest. The surface shader's
// interior says what it is made of; the primvar that Attributes::density_primvar names
// how thick it is here and there.
struct Volume {
    enum class Shape { Box, Ellipsoid, Cylinder, Cone } shape = Shape::Box;
    std::array<float, 6> bound; // xmin xmax ymin ymax zmin zmax
    std::array<int, 3> size{1, 1, 1};
};

using Geometry =
    std::variant<PolygonMesh, SubdivisionMesh, PatchMesh, NuPatch, Quadric, Curves, Points, Blobby, Volume>;

// How a primitive moves and changes its shape. Times are those of Options::shutter_open and shutter_close;
// between them everything goes linearly (turns: evenly), before the first and after the last it stands still.
struct Motion {
    std::vector<TransformKey> places; // world_from_object; none = it stays where Primitive says
    struct Shape {
        double time;
        Geometry geometry; // of the same kind and topology
        ValueList primvars;
    };
    std::vector<Shape>
        shapes; // the first repeats the primitive's own (they share their buffers); none = keeps it
};

struct Primitive {
    Geometry geometry;
    ValueList primvars;
    Shared<Transform> world_from_object;
    std::shared_ptr<const Attributes> attributes;
    int id = 0; // counts from 1 in order of declaration: the "object id" AOV
    Location where;
    std::shared_ptr<const Motion> motion; // null = still
    int solid = -1;                       // it bounds this one of Scene::solids (or the group's); -1 = none
    NodeId node = NodeId::None;
};

// A node of a tree of set operations. A Primitive is what its surfaces enclose together; a difference takes
// all others from its first child. Children come after their parents.
struct Solid {
    enum class Kind : uint8_t { Primitive, Union, Intersection, Difference } kind = Kind::Primitive;
    int parent = -1;
    NodeId node = NodeId::None;
};

// ---- instances
// ------------------------------------------------------------------------------------------------------

// How instances of one thing differ in looks. Each is empty (they do not), or has a value, or one for each
// instance. Of nested instances the innermost that has any counts.
struct Variation {
    Buffer<float> variant;   // of Attributes::variants; between whole numbers the two are blended
    Buffer<float> tint;      // RGB, from 0 on: multiplies the colours of bodies (grid::LobeInput::body)
    Buffer<float> roughness; // is added to that of lobes, which stays within 0 and 1
    // Variables that surface shaders read: constant, or uniform (a value for each instance).
    ValueList primvars;
    bool empty() const {
        return variant.empty() && tint.empty() && roughness.empty() && primvars.values.empty();
    }
};

struct Group { // ObjectBegin … ObjectEnd; primitives' world_from_object is relative to the group
    std::string name;
    std::vector<Primitive> primitives;
    std::vector<Solid> solids;
    struct Instances {
        int group; // index into Scene::groups, a lower one than the group's own
        // Row-major 3x4 group_from_child matrices, 12 floats each.
        Buffer<float> transforms;
        int first_id = 0;
        // Two times or more: `transforms` holds all instances at the first, then all at the second, …
        std::vector<double> times = {};
        Variation variation = {};
        bool unique = false; // each is diced and shaded where it stands, as a thing of its own
        bool moves() const { return times.size() > 1; }
        size_t count() const { return transforms.size() / 12 / (moves() ? times.size() : 1); }
        NodeId node = NodeId::None;
    };
    std::vector<Instances> instances;
    NodeId node = NodeId::None;
    Unnamed unnamed{};
};

// ---- lights, camera, options
// ----------------------------------------------------------------------------------------

// What a light shader sends out, tabulated once: light is shaded before it is sampled, as surfaces are.
// Values are relative to Light::amount; rows and columns hold cell centres.
struct LightTable {
    int width = 1, height = 1, layers = 1;
    // Lights with a place: rows are angles from the light's +z, from 0 to `angle` radians (beyond it is
    // dark), columns turn about it, layers are distances, each twice the one before; between them light falls
    // off with the distance to the power of -falloff.
    float angle = 0, nearest = 1;
    int falloff = 2;
    // Distant lights: columns and rows are x and y in light space from -extent to extent.
    float extent = 1;
    std::vector<float> rgb; // layer by layer, row by row
    const float* at(int layer, int row, int column) const {
        return rgb.data() +
               3 * ((size_t(layer) * size_t(height) + size_t(row)) * size_t(width) + size_t(column));
    }
};

struct LightSource; // scene/schema/lights.h

// Analytic lights. Radiometric amounts are RGB with D65 as (1, 1, 1); the classic light shaders' intensities
// arrive here already converted (L = Cl for a matte white surface facing a classic light: irradiance is pi
// Cl).
struct Light {
    enum class Kind {
        Distant,
        Point,
        Spot,
        Environment,
        Ambient,
        Quad,
        Disk,
        Sphere,
        Cylinder,
        Portal // shines with what the environments send through it
    } kind = Kind::Distant;
    Rgb amount{1, 1, 1};         // distant: irradiance; point, spot: radiant intensity; all others: radiance
    Transform world_from_light;  // points along +z, environment poles along +z
    float angle = 0;             // distant: angular diameter in degrees; 0 = a delta direction
    float cone_angle = 30;       // spot: half angle in degrees
    float cone_delta_angle = 5;  // spot: width of the smooth edge, degrees, inside the cone
    float beam_distribution = 2; // spot: exponent of the cosine (RISpec spotlight)
    float radius = 0;            // point, spot: of a soft one; 0 = a delta position. disk, sphere, cylinder
    float width = 1, height = 1; // quad, portal: along x and y; flat ones shine to +z. cylinder: along z
    std::string texture;         // environment: latitude-longitude picture; quad: picture; empty = constant
    std::string profile;         // point, spot: IES file; empty = none
    std::string spectrum;        // of the light (color::resolve_light); the amount filters it; empty = white
    std::string unit;            // of the amount: lumen, candela, lux, nit, watt; empty = radiometric
    bool visible_camera = true;
    bool shadows = true; // false: it shines through everything
    LobeMultipliers lobes;
    // Scales the amount, by direction or place; null = one. Of a quad: its picture, from the top (+y) down.
    std::shared_ptr<const LightTable> table;
    std::string name;
    std::string group; // names, parted by blanks
    // Linking: bits of the sets of receivers that it shines on, and its bit where objects let it through.
    int32_t lit_sets = -1, passes = 0;
    Location where;
    NodeId node = NodeId::None;
    std::shared_ptr<const LightSource> source; // what it was made from; null = it was given as it is
};

struct Camera {
    using Projection = kanuka::Projection;
    Projection projection = Projection::Perspective;
    float fov = 90; // degrees, across the shorter side, as RISpec; fisheyes: of the whole image circle
    std::optional<std::array<float, 4>> screen_window; // left right bottom top
    // RISpec's camera space: x right, y up, +z into the picture (left-handed). World may be anything.
    Transform camera_from_world;
    std::vector<TransformKey> motion; // of camera_from_world; none = still
    float near_clip = 1e-4f, far_clip = 1e30f;
    // In camera space: a point and a direction each; what lies on that side of the point is cut away.
    std::vector<std::array<float, 6>> clipping_planes;
    float f_stop = 0, focal_length = 0, focal_distance = 0; // 0 = pinhole
    int blades = 0;                                         // of the iris: a regular polygon; below 3 = round
    float blade_rotation = 0;                               // degrees, anticlockwise as the camera sees it
    float squeeze = 1; // anamorphic: how many times higher than wide blurred lights are
};

struct Display {
    std::string file, driver, mode; // mode: rgb, rgba, z, or an AOV's name
    ValueList parameters;
    Location where;
};

// Colour of the whole scene and picture; names as docs/color.md has them.
struct ColorOptions {
    std::string space = "rec709"; // of all RGB in the scene
    std::string output;           // of the picture; empty = the scene's
    std::string observer = "1931";
    std::string sensor;                       // file of a camera's sensitivities; empty = the observer
    std::string training;                     // file of reflectances for the camera's matrix; empty = our own
    std::string white_balance;                // light that is white in the picture; empty = the space's white
    std::string display = "srgb";             // encoding of PNGs
    float f_stop = 0, shutter = 0, iso = 100; // exposure of physical light; 0 = not given. Shutter in seconds
    float stops = 0;                          // exposure on top
    Location where;
};

struct Options {
    int width = 640, height = 480;
    float pixel_aspect = 1;
    std::array<float, 4> crop{0, 1, 0, 1}; // xmin xmax ymin ymax in [0, 1], y down
    std::string filter = "gaussian"; // box, triangle, gaussian, catmull-rom, sinc, mitchell, blackman-harris
    float filter_width[2] = {2, 2};
    std::vector<float> filter_values; // of the filter "table", by cells, rows from -y
    std::array<int, 2> filter_cells{0, 0};
    Location filter_where;
    float exposure_gain = 1, exposure_gamma = 1; // gamma goes into the PNG only
    ColorOptions color;
    int samples = 64;        // paths a pixel: PixelSamples x*y
    float adaptive = 0;      // error over the root of brightness at which a pixel has no more; 0 = none stops
    int max_depth = 8;       // surface scattering events
    int volume_depth = 1024; // events inside of media: scattering, boundaries that only are passed
    int light_samples = 1;   // of next-event estimation, at each surface hit
    std::string integrator = "path";
    // Which light is found: `Full`: between surfaces too, with shadows of all lights. `Classic`: what
    // RISpec's renderers found: of light sources alone and along mirrors, with shadows where lights ask for
    // them. `Auto`: classic if no surface is of Kanuka's own kind.
    enum class Transport : uint8_t { Full, Classic, Auto } transport = Transport::Full;
    float clamp_direct = 0, clamp_indirect = 0; // most radiance that one contribution brings; 0 = unbounded
    float geometry_tolerance =
        0.25f;                  // traced geometry: distance in pixels from the diced surface; 0 = off (1:1)
    float normal_tolerance = 3; // and degrees between their normals
    bool watertight = true;     // rays never pass between polygons that share an edge
    // What stands at many places, near and far, is diced and shaded at a few rates: so many times as fine as
    // each place asks for. 0 = as fine as the closest needs, everywhere.
    float instance_levels = 0;
    // What surfaces are shaded with at most of the values of instances' variables; others are blended, or the
    // nearest.
    int instance_variants = 8;
    // Instances whose shaders ask where in the world they are become things of their own, of up to so many
    // vertices; 0 = none does by itself.
    int unique_up_to = 4000000;
    int procedural_memory =
        0; // MB that may grow out of procedurals which wait for rays; 0 or less = unbounded
    uint32_t seed = 0;
    bool strict_directions = false; // what shaders do that no material can do is an error, not approximated
    std::string specular = "prman"; // exponent of specular(): 8 / roughness; rispec: 1 / roughness
    int array_room = 64;            // values that shaders' arrays hold which grow in loops of unseen length
    std::vector<std::string> shader_path, texture_path, archive_path; // "&" expanded on ingest
    std::vector<Display> displays;
    std::optional<ShaderRef> imager;
    float shutter_open = 0, shutter_close = 0; // equal = no motion blur
    std::vector<float> shutter_opening;        // how it opens and closes: scene/shutter.h; empty = at once
    ValueList user;                            // every other Option call, as "category:name"
};

struct Scene {
    std::string file;
    Options options;
    Camera camera;
    std::vector<Primitive> primitives;
    std::vector<Solid> solids;
    std::vector<Group> groups;
    std::vector<Group::Instances> instances; // world_from_group
    std::vector<Light> lights;
    std::vector<ShaderRef>
        light_shaders; // light sources by shader, in declaration order; shade/ turns them to Lights
    std::map<std::string, Transform> coordinate_systems; // world_from_named
    Journal* journal = nullptr;                          // where ingest reported; may be null
    Unnamed unnamed{};
};

} // namespace kanuka::scene
