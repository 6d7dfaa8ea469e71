// The handlers that the table of requests names, by subject. Arguments are those of the table, checked for
// number and type.
#pragma once

#include <optional>

namespace kanuka::scene {
struct ShaderRef;
}

namespace kanuka::ingest {

class Context;
struct Call;

namespace handlers {

// handlers_blocks.cpp
void declare(Context&, Call&), frame_begin(Context&, Call&), frame_end(Context&, Call&),
    world_begin(Context&, Call&), world_end(Context&, Call&), attribute_begin(Context&, Call&),
    attribute_end(Context&, Call&), transform_begin(Context&, Call&), transform_end(Context&, Call&),
    solid_begin(Context&, Call&), solid_end(Context&, Call&), object_begin(Context&, Call&),
    object_end(Context&, Call&), object_instance(Context&, Call&), motion_begin(Context&, Call&),
    motion_end(Context&, Call&), read_archive(Context&, Call&), archive_begin(Context&, Call&),
    archive_end(Context&, Call&), if_begin(Context&, Call&), else_if(Context&, Call&),
    else_branch(Context&, Call&), if_end(Context&, Call&), error_handler(Context&, Call&),
    resource_begin(Context&, Call&), resource_end(Context&, Call&), resource(Context&, Call&),
    edit_begin(Context&, Call&), system_command(Context&, Call&);

// handlers_options.cpp
void format(Context&, Call&), frame_aspect_ratio(Context&, Call&), screen_window(Context&, Call&),
    crop_window(Context&, Call&), projection(Context&, Call&), clipping(Context&, Call&),
    depth_of_field(Context&, Call&), shutter(Context&, Call&), pixel_samples(Context&, Call&),
    pixel_filter(Context&, Call&), exposure(Context&, Call&), imager(Context&, Call&),
    quantize(Context&, Call&), display(Context&, Call&), display_channel(Context&, Call&),
    hider(Context&, Call&), camera(Context&, Call&), color_samples(Context&, Call&),
    relative_detail(Context&, Call&), pixel_variance(Context&, Call&), option(Context&, Call&),
    make_texture(Context&, Call&), make_latlong_environment(Context&, Call&),
    make_cube_face_environment(Context&, Call&);

// handlers_attributes.cpp
void color(Context&, Call&), opacity(Context&, Call&), texture_coordinates(Context&, Call&),
    light_source(Context&, Call&), area_light_source(Context&, Call&), illuminate(Context&, Call&),
    coshader(Context&, Call&), surface(Context&, Call&), displacement(Context&, Call&),
    interior(Context&, Call&), exterior(Context&, Call&), atmosphere(Context&, Call&),
    shading_rate(Context&, Call&), matte(Context&, Call&), detail(Context&, Call&),
    detail_range(Context&, Call&), orientation(Context&, Call&), reverse_orientation(Context&, Call&),
    sides(Context&, Call&), basis(Context&, Call&), trim_curve(Context&, Call&), attribute(Context&, Call&);

// handlers_transform.cpp
void identity(Context&, Call&), transform(Context&, Call&), concat_transform(Context&, Call&),
    perspective(Context&, Call&), translate(Context&, Call&), rotate(Context&, Call&), scale(Context&, Call&),
    skew(Context&, Call&), coordinate_system(Context&, Call&), scoped_coordinate_system(Context&, Call&),
    coord_sys_transform(Context&, Call&);

// handlers_layers.cpp
void shader_layer(Context&, Call&), connect_shader_layers(Context&, Call&), deformation(Context&, Call&);
// What displaces from here on, after the Deformations in force; none = these alone.
void put_displacement(Context&, std::optional<scene::ShaderRef>&&);

// handlers_ris.cpp, handlers_ris_lights.cpp
void integrator(Context&, Call&), bxdf(Context&, Call&), displace(Context&, Call&), pattern(Context&, Call&),
    ris_light(Context&, Call&), display_filter(Context&, Call&);
// Area lights of RenderMan 19 and 20: makes their parameters ours; does nothing to others.
void shaped_light(scene::ShaderRef& light);
// A shape that is the area light in force itself ("rectlight", "envsphere", …); false = it is none.
bool light_geometry(Context&, const Call&);

// handlers_light_filters.cpp
void light_filter(Context&, Call&), enable_light_filter(Context&, Call&);

// handlers_geometry.cpp, handlers_patches.cpp
void polygon(Context&, Call&), general_polygon(Context&, Call&), points_polygons(Context&, Call&),
    points_general_polygons(Context&, Call&), subdivision_mesh(Context&, Call&), patch(Context&, Call&),
    patch_mesh(Context&, Call&), nu_patch(Context&, Call&), quadric(Context&, Call&), curves(Context&, Call&),
    points(Context&, Call&);

// handlers_procedural.cpp
void procedural(Context&, Call&), procedural2(Context&, Call&);

// handlers_shapes.cpp
void blobby(Context&, Call&), geometry(Context&, Call&), clipping_plane(Context&, Call&),
    volume(Context&, Call&);

} // namespace handlers
} // namespace kanuka::ingest
