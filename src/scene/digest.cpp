// Structured bindings name every member, so that one which is added does not compile until somebody has said
// whether it counts.
#include "scene/digest.h"

#include "scene/members.h"

namespace kanuka {

void put(Digester& d, const Vec3f& v) {
    d(v.x, v.y, v.z);
}
void put(Digester& d, const Transform& t) {
    d(t.m);
}
void put(Digester& d, const TransformKey& key) {
    const auto& [time, transform] = key;
    d(time, transform);
}

} // namespace kanuka

namespace kanuka::scene {

template <class T>
static void put(Digester& d, const Buffer<T>& values) {
    d(std::span<const T>(values.data(), values.size()));
}

void put(Digester& d, const Value& value) {
    const auto& [name, type, detail, array_size, floats, ints, strings, where] = value;
    d(name, type, detail, array_size, floats, ints, strings);
}
void put(Digester& d, const ValueList& values) {
    d(values.values);
}
void put(Digester& d, const ShaderRef& shader) {
    const auto& [name, handle, parameters, world_from_shader, where, coshaders, stand_in, shadows, node] =
        shader;
    d(name, handle, parameters, world_from_shader, coshaders, shadows, stand_in != nullptr);
    if (stand_in)
        d(stand_in->name, stand_in->parameters);
}
void put(Digester& d, const Attributes& attributes) {
    std::apply([&](const auto&... members) { d(members...); }, members_of(attributes));
}

// ---- geometry -----------------------------------------------------------------------------------------

static void put(Digester& d, const PolygonMesh& mesh) {
    const auto& [loops_per_face, vertices_per_loop, vertices] = mesh;
    d(loops_per_face, vertices_per_loop, vertices);
}
static void put(Digester& d, const SubdivisionMesh::Tag& tag) {
    const auto& [name, ints, floats, strings] = tag;
    d(name, ints, floats, strings);
}
static void put(Digester& d, const SubdivisionMesh& mesh) {
    const auto& [scheme, vertices_per_face, vertices, tags] = mesh;
    d(scheme, vertices_per_face, vertices, tags);
}
static void put(Digester& d, const Basis& basis) {
    const auto& [m, step] = basis;
    d(m, step);
}
static void put(Digester& d, const PatchMesh& mesh) {
    const auto& [cubic, nu, nv, u_periodic, v_periodic, u_basis, v_basis] = mesh;
    d(cubic, nu, nv, u_periodic, v_periodic, u_basis, v_basis);
}
static void put(Digester& d, const TrimCurves& trim) {
    const auto& [curves_per_loop, order, points, knots, min, max, u, v, w, outside, where] = trim;
    d(curves_per_loop, order, points, knots, min, max, u, v, w, outside);
}
static void put(Digester& d, const NuPatch& patch) {
    const auto& [nu, u_order, nv, v_order, u_knots, v_knots, u_min, u_max, v_min, v_max, trim] = patch;
    d(nu, u_order, nv, v_order, u_knots, v_knots, u_min, u_max, v_min, v_max, trim);
}
static void put(Digester& d, const Quadric& quadric) {
    const auto& [kind, arguments] = quadric;
    d(kind, arguments);
}
static void put(Digester& d, const Curves& curves) {
    const auto& [cubic, periodic, basis, vertices_per_curve] = curves;
    d(cubic, periodic, basis, vertices_per_curve);
}
static void put(Digester&, const Points&) {}
static void put(Digester& d, const Blobby& blobby) {
    const auto& [leaves, code, floats, strings] = blobby;
    d(leaves, code, floats, strings);
}
static void put(Digester& d, const Volume& volume) {
    const auto& [shape, bound, size] = volume;
    d(shape, bound, size);
}
static void put(Digester& d, const Motion::Shape& shape) {
    const auto& [time, geometry, primvars] = shape;
    d(time, geometry, primvars);
}
static void put(Digester& d, const Motion& motion) {
    const auto& [places, shapes] = motion;
    d(places, shapes);
}
void put(Digester& d, const Primitive& primitive) {
    const auto& [geometry, primvars, world_from_object, attributes, id, where, motion, solid, node] =
        primitive;
    d(geometry, primvars, world_from_object, id, motion, solid);
}

void put(Digester& d, const Variation& of) {
    const auto& [variant, tint, roughness, primvars] = of;
    d(variant, tint, roughness, primvars);
}

void put_shape(Digester& d, const Primitive& primitive) {
    d(primitive.geometry, primitive.primvars, primitive.motion != nullptr);
    if (primitive.motion)
        d(primitive.motion->shapes);
}

static void stand_nowhere(ShaderRef& shader) {
    shader.world_from_shader = {};
    for (ShaderRef& s : shader.coshaders)
        stand_nowhere(s);
}
static void stand_nowhere(std::optional<ShaderRef>& shader) {
    if (shader)
        stand_nowhere(*shader);
}

Digest digest_apart(const Attributes& attributes) {
    Attributes apart = attributes;
    for (std::optional<ShaderRef>* shader : {&apart.surface, &apart.displacement, &apart.interior,
                                             &apart.exterior, &apart.atmosphere, &apart.area_light})
        stand_nowhere(*shader);
    for (ShaderRef& shader : apart.coshaders)
        stand_nowhere(shader);
    return digest_of(apart);
}

// ---- lights, camera, options --------------------------------------------------------------------------

static void put(Digester& d, const LightTable& table) {
    const auto& [width, height, layers, angle, nearest, falloff, extent, rgb] = table;
    d(width, height, layers, angle, nearest, falloff, extent, rgb);
}
void put(Digester& d, const Light& light) {
    const auto& [kind, amount, world_from_light, angle, cone_angle, cone_delta_angle, beam_distribution,
                 radius, width, height, texture, profile, spectrum, unit, visible_camera, shadows, lobes,
                 table, name, group, lit_sets, passes, where, node, source] = light;
    d(kind, amount, world_from_light, angle, cone_angle, cone_delta_angle, beam_distribution, radius, width,
      height, texture, profile, spectrum, unit, visible_camera, shadows, lobes.diffuse, lobes.specular, table,
      name, group, lit_sets, passes);
}
void put(Digester& d, const Camera& camera) {
    const auto& [projection, fov, screen_window, camera_from_world, motion, near_clip, far_clip,
                 clipping_planes, f_stop, focal_length, focal_distance, blades, blade_rotation, squeeze] =
        camera;
    d(projection, fov, screen_window, camera_from_world, motion, near_clip, far_clip, clipping_planes, f_stop,
      focal_length, focal_distance, blades, blade_rotation, squeeze);
}
void put(Digester& d, const ColorOptions& color) {
    const auto& [space, output, observer, sensor, training, white_balance, display, f_stop, shutter, iso,
                 stops, where] = color;
    d(space, output, observer, sensor, training, white_balance, f_stop, shutter, iso, stops);
}
void put(Digester& d, const Options& options) {
    const auto& [width, height, pixel_aspect, crop, filter, filter_width, filter_values, filter_cells,
                 filter_where, exposure_gain, exposure_gamma, color, samples, adaptive, max_depth,
                 volume_depth, light_samples, integrator, transport, clamp_direct, clamp_indirect,
                 geometry_tolerance, normal_tolerance, watertight, instance_levels, instance_variants,
                 unique_up_to, procedural_memory, seed, strict_directions, specular, array_room, shader_path,
                 texture_path, archive_path, displays, imager, shutter_open, shutter_close, shutter_opening,
                 user] = options;
    d(width, height, pixel_aspect, crop, filter, filter_width, filter_values, filter_cells, color, adaptive,
      max_depth, volume_depth, light_samples, integrator, transport, clamp_direct, clamp_indirect,
      geometry_tolerance, normal_tolerance, watertight, instance_levels, instance_variants, unique_up_to,
      procedural_memory, seed, strict_directions, specular, array_room, shader_path, texture_path,
      archive_path, shutter_open, shutter_close, shutter_opening, user);
}
Digest digest_of_lights(const Scene& scene) {
    return Digester()(scene.lights, scene.light_shaders, scene.coordinate_systems).digest();
}

} // namespace kanuka::scene
