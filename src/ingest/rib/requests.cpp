#include "ingest/rib/requests.h"

#include <algorithm>
#include <unordered_map>

#include "base/spelling.h"
#include "ingest/rib/handlers.h"

namespace kanuka::ingest {

namespace {

using A = ArgType;
namespace h = handlers;

constexpr uint8_t Outside = InOuter | InFrame; // options: before the world
constexpr uint8_t Anywhere = Outside | InWorld | InObject;
constexpr uint8_t Moving = Anywhere | InMotion;
constexpr uint8_t Solid = InWorld | InObject; // geometry
constexpr uint8_t MovingSolid = Solid | InMotion;

constexpr Since V31 = Since::V31, V32 = Since::V32, Ext = Since::Extension;
constexpr Params No = Params::None;

// clang-format off
constexpr RequestSpec Table[] = {
    // ---- structure ----------------------------------------------------------------------------------
    {"version", V31, Anywhere, {{{"number", A::Float}}}, No, Support::Ignored, nullptr, ""},
    {"Declare", V31, Anywhere, {{{"name", A::String}, {"declaration", A::String}}}, No, Support::Full, h::declare, ""},
    {"FrameBegin", V31, InOuter, {{{"number", A::Integer}}}, No, Support::Full, h::frame_begin,
     "one frame is read: the one asked for, else the first that writes more than depth"},
    {"FrameEnd", V31, InFrame | InWorld | InObject, {}, No, Support::Full, h::frame_end, ""},
    {"WorldBegin", V31, Outside, {}, No, Support::Full, h::world_begin, ""},
    {"WorldEnd", V31, InWorld | InObject, {}, No, Support::Full, h::world_end, ""},
    {"AttributeBegin", V31, Anywhere, {}, No, Support::Full, h::attribute_begin, ""},
    {"AttributeEnd", V31, Anywhere, {}, No, Support::Full, h::attribute_end, ""},
    {"TransformBegin", V31, Anywhere, {}, No, Support::Full, h::transform_begin, ""},
    {"TransformEnd", V31, Anywhere, {}, No, Support::Full, h::transform_end, ""},
    {"SolidBegin", V31, Solid, {{{"operation", A::String}}}, No, Support::Full, h::solid_begin,
     "an instance inside of one is copied into it"},
    {"SolidEnd", V31, Solid, {}, No, Support::Full, h::solid_end, ""},
    {"ObjectBegin", V31, Outside | InWorld | InObject, {{{"handle", A::NewHandle}}}, No, Support::Full, h::object_begin,
     ""},
    {"ObjectEnd", V31, InObject, {}, No, Support::Full, h::object_end, ""},
    {"ObjectInstance", V31, Solid, {{{"handle", A::Handle}}}, No, Support::Full, h::object_instance, ""},
    {"MotionBegin", V31, Anywhere, {{{"times", A::FloatArray}}}, No, Support::Partial, h::motion_begin,
     "of transformations and primitives; of other requests the mean over the shutter stands for all times"},
    {"MotionEnd", V31, Anywhere | InMotion, {}, No, Support::Full, h::motion_end, ""},
    {"ReadArchive", V32, Anywhere, {{{"name", A::String}}}, Params::Other, Support::Full, h::read_archive, ""},
    {"ArchiveBegin", Ext, Anywhere, {{{"name", A::String}}}, Params::Other, Support::Full, h::archive_begin, ""},
    {"ArchiveEnd", Ext, Anywhere, {}, No, Support::Full, h::archive_end, ""},
    {"ArchiveRecord", V31, Anywhere, {{{"type", A::String}, {"text", A::String}}}, No, Support::Ignored, nullptr, ""},
    {"IfBegin", Ext, Anywhere, {{{"condition", A::String}}}, Params::Other, Support::Full, h::if_begin, ""},
    {"ElseIf", Ext, Anywhere, {{{"condition", A::String}}}, Params::Other, Support::Full, h::else_if, ""},
    {"Else", Ext, Anywhere, {}, No, Support::Full, h::else_branch, ""},
    {"IfEnd", Ext, Anywhere, {}, No, Support::Full, h::if_end, ""},
    {"ErrorHandler", V31, Anywhere, {{{"handler", A::String}}}, No, Support::Full, h::error_handler,
     "print; ignore: what is wrong is said as information; abort: reading ends at the first mistake in the file"},

    // ---- options ------------------------------------------------------------------------------------
    {"Format", V31, Outside, {{{"xresolution", A::Integer}, {"yresolution", A::Integer}, {"pixelaspect", A::Float, 0, true}}},
     No, Support::Full, h::format, ""},
    {"FrameAspectRatio", V31, Outside, {{{"ratio", A::Float}}}, No, Support::Full, h::frame_aspect_ratio, ""},
    {"ScreenWindow", V31, Outside, {{{"left right bottom top", A::Floats, 4}}}, No, Support::Full, h::screen_window, ""},
    {"CropWindow", V31, Outside, {{{"xmin xmax ymin ymax", A::Floats, 4}}}, No, Support::Full, h::crop_window, ""},
    {"Projection", V31, Outside, {{{"name", A::String}}}, Params::Other, Support::Full, h::projection,
     "perspective, orthographic, fisheye, equisolid, spherical"},
    {"Clipping", V31, Outside, {{{"near", A::Float}, {"far", A::Float}}}, No, Support::Full, h::clipping, ""},
    {"ClippingPlane", V32, Outside, {{{"x y z nx ny nz", A::Floats, 6}}}, No, Support::Full, h::clipping_plane,
     ""},
    {"DepthOfField", V31, Outside,
     {{{"fstop", A::Float, 0, true}, {"focallength", A::Float, 0, true}, {"focaldistance", A::Float, 0, true}}}, No,
     Support::Full, h::depth_of_field, "without arguments: a pinhole"},
    {"Shutter", V31, Outside, {{{"min", A::Float}, {"max", A::Float}}}, No, Support::Full, h::shutter, ""},
    {"PixelVariance", V31, Outside, {{{"variance", A::Float}}}, No, Support::Kept, h::pixel_variance, ""},
    {"PixelSamples", V31, Outside, {{{"xsamples", A::Float}, {"ysamples", A::Float}}}, No, Support::Full, h::pixel_samples,
     "the product is the number of samples"},
    {"PixelFilter", V31, Outside, {{{"filter", A::String}, {"xwidth", A::Float}, {"ywidth", A::Float}}}, No, Support::Full,
     h::pixel_filter, "box, triangle, gaussian, catmull-rom, sinc, mitchell, blackman-harris; table: the values of Option \"pixelfilter\""},
    {"Exposure", V31, Outside, {{{"gain", A::Float}, {"gamma", A::Float}}}, No, Support::Full, h::exposure,
     "of PNGs; a gamma other than 1 takes the place of sRGB's curve"},
    {"Imager", V31, Anywhere, {{{"name", A::String}}}, Params::Shader, Support::Full, h::imager, "of the picture, wherever it stands"},
    {"Quantize", V31, Outside, {{{"type", A::String}, {"one", A::Float}, {"min", A::Float}, {"max", A::Float},
     {"dither", A::Float}}}, No, Support::Kept, h::quantize, "pictures are written in floating point"},
    {"Display", V31, Outside, {{{"name", A::String}, {"type", A::String}, {"mode", A::String}}}, Params::Other,
     Support::Partial, h::display,
     "a name with + adds a display, without it replaces all; the first one's file has all layers, each other "
     "file those of its mode; framebuffers show nothing, drivers' parameters do nothing"},
    {"Hider", V31, Outside, {{{"type", A::String}}}, Params::Other, Support::Kept, h::hider,
     "aperture, dofaspect and shutteropening count, as in Option \"camera\""},
    {"ColorSamples", V31, Outside, {{{"nRGB", A::FloatArray}, {"RGBn", A::FloatArray}}}, No, Support::Full,
     h::color_samples, "for Color, Opacity and all parameters and primvars of type color"},
    {"RelativeDetail", V31, Outside, {{{"scale", A::Float}}}, No, Support::Full, h::relative_detail, ""},
    {"Option", V31, Outside, {{{"name", A::String}}}, Params::Option, Support::Full, h::option, ""},

    // ---- attributes ---------------------------------------------------------------------------------
    {"Color", V31, Moving, {{{"color", A::FloatArray}}}, No, Support::Full, h::color, ""},
    {"Opacity", V31, Moving, {{{"color", A::FloatArray}}}, No, Support::Full, h::opacity, ""},
    {"TextureCoordinates", V31, Anywhere, {{{"s1 t1 s2 t2 s3 t3 s4 t4", A::Floats, 8}}}, No, Support::Full,
     h::texture_coordinates, ""},
    {"LightSource", V31, Moving, {{{"name", A::String}, {"handle", A::NewHandle}}}, Params::Shader, Support::Full,
     h::light_source, ""},
    {"AreaLightSource", V31, Moving, {{{"name", A::String}, {"handle", A::NewHandle}}}, Params::Shader, Support::Full,
     h::area_light_source, ""},
    {"Illuminate", V31, Anywhere, {{{"light", A::Handle}, {"on", A::Integer}}}, No, Support::Full, h::illuminate,
     "area lights are turned off by Attribute \"lighting\""},
    {"Surface", V31, Moving, {{{"name", A::String}}}, Params::Shader, Support::Full, h::surface, ""},
    {"Displacement", V31, Moving, {{{"name", A::String}}}, Params::Shader, Support::Full, h::displacement, ""},
    {"Atmosphere", V31, Moving, {{{"name", A::String}}}, Params::Shader, Support::Full, h::atmosphere,
     "what the camera sees through it, also in mirrors and through panes"},
    {"Interior", V31, Moving, {{{"name", A::String}}}, Params::Shader, Support::Kept, h::interior,
     "interior shaders are not run yet; class shaders say by mnk_interior what is inside"},
    {"Exterior", V31, Moving, {{{"name", A::String}}}, Params::Shader, Support::Kept, h::exterior,
     "exterior shaders are not run yet"},
    {"ShadingRate", V31, Anywhere, {{{"size", A::Float}}}, No, Support::Full, h::shading_rate, ""},
    {"ShadingInterpolation", V31, Anywhere, {{{"type", A::String}}}, No, Support::Ignored, nullptr,
     "always smooth"},
    {"Matte", V31, Anywhere, {{{"on", A::Integer}}}, No, Support::Full, h::matte,
     "a hole of alpha 0 to the camera; seen in mirrors, casts shadows"},
    {"Bound", V31, Anywhere, {{{"xmin xmax ymin ymax zmin zmax", A::Floats, 6}}}, No, Support::Ignored, nullptr,
     "bounds are computed"},
    {"Detail", V31, Moving, {{{"xmin xmax ymin ymax zmin zmax", A::Floats, 6}}}, No, Support::Full, h::detail, ""},
    {"DetailRange", V31, Anywhere, {{{"minvisible lowertransition uppertransition maxvisible", A::Floats, 4}}}, No,
     Support::Full, h::detail_range, "in a transition each path meets one of two levels"},
    {"GeometricApproximation", V31, Anywhere, {{{"type", A::String}, {"value", A::Float}}}, No, Support::Ignored, nullptr,
     "see Option \"kanuka\" \"geometrytolerance\""},
    {"GeometricRepresentation", V31, Anywhere, {{{"type", A::String}}}, No, Support::Ignored, nullptr, ""},
    {"Orientation", V31, Anywhere, {{{"orientation", A::String}}}, No, Support::Full, h::orientation, ""},
    {"ReverseOrientation", V31, Anywhere, {}, No, Support::Full, h::reverse_orientation, ""},
    {"Sides", V31, Anywhere, {{{"sides", A::Integer}}}, No, Support::Full, h::sides,
     "1: no ray meets the inside; but for solids, curves, points and what has an interior"},
    {"Basis", V31, Anywhere,
     {{{"ubasis", A::BasisMatrix}, {"ustep", A::Integer}, {"vbasis", A::BasisMatrix}, {"vstep", A::Integer}}}, No,
     Support::Full, h::basis, ""},
    {"TrimCurve", V31, Anywhere, {{{"ncurves", A::IntegerArray}, {"order", A::IntegerArray}, {"knot", A::FloatArray},
     {"min", A::FloatArray}, {"max", A::FloatArray}, {"n", A::IntegerArray}, {"u", A::FloatArray}, {"v", A::FloatArray},
     {"w", A::FloatArray}}}, No, Support::Full, h::trim_curve, "Attribute \"trimcurve\" \"sense\" [\"outside\"] keeps what is outside"},
    {"Attribute", V31, Anywhere, {{{"name", A::String}}}, Params::Attribute, Support::Full, h::attribute, ""},

    // ---- transformations ----------------------------------------------------------------------------
    {"Identity", V31, Moving, {}, No, Support::Full, h::identity, ""},
    {"Transform", V31, Moving, {{{"matrix", A::Floats, 16}}}, No, Support::Full, h::transform, ""},
    {"ConcatTransform", V31, Moving, {{{"matrix", A::Floats, 16}}}, No, Support::Full, h::concat_transform, ""},
    {"Perspective", V31, Moving, {{{"fov", A::Float}}}, No, Support::Full, h::perspective, ""},
    {"Translate", V31, Moving, {{{"dx dy dz", A::Floats, 3}}}, No, Support::Full, h::translate, ""},
    {"Rotate", V31, Moving, {{{"angle dx dy dz", A::Floats, 4}}}, No, Support::Full, h::rotate, ""},
    {"Scale", V31, Moving, {{{"sx sy sz", A::Floats, 3}}}, No, Support::Full, h::scale, ""},
    {"Skew", V31, Moving, {{{"angle dx1 dy1 dz1 dx2 dy2 dz2", A::Floats, 7}}}, No, Support::Full, h::skew, ""},
    {"Deformation", V31, Moving, {{{"name", A::String}}}, Params::Shader, Support::Partial, h::deformation,
     "a displacement shader that runs before Displacement; it ends with the attributes, not with the transformation"},
    {"CoordinateSystem", V31, Anywhere, {{{"space", A::String}}}, No, Support::Full, h::coordinate_system, ""},
    {"ScopedCoordinateSystem", Ext, Anywhere, {{{"space", A::String}}}, No, Support::Full, h::scoped_coordinate_system,
     "known up to AttributeEnd"},
    {"CoordSysTransform", V32, Anywhere, {{{"space", A::String}}}, No, Support::Full, h::coord_sys_transform, ""},

    // ---- geometry -----------------------------------------------------------------------------------
    {"Polygon", V31, MovingSolid, {}, Params::Primitive, Support::Full, h::polygon, ""},
    {"GeneralPolygon", V31, MovingSolid, {{{"nverts", A::IntegerArray}}}, Params::Primitive, Support::Full,
     h::general_polygon, ""},
    {"PointsPolygons", V31, MovingSolid, {{{"nverts", A::IntegerArray}, {"verts", A::IntegerArray}}}, Params::Primitive,
     Support::Full, h::points_polygons, ""},
    {"PointsGeneralPolygons", V31, MovingSolid,
     {{{"nloops", A::IntegerArray}, {"nverts", A::IntegerArray}, {"verts", A::IntegerArray}}}, Params::Primitive,
     Support::Full, h::points_general_polygons, ""},
    {"Patch", V31, MovingSolid, {{{"type", A::String}}}, Params::Primitive, Support::Full, h::patch, ""},
    {"PatchMesh", V31, MovingSolid, {{{"type", A::String}, {"nu", A::Integer}, {"uwrap", A::String}, {"nv", A::Integer},
     {"vwrap", A::String}}}, Params::Primitive, Support::Full, h::patch_mesh, ""},
    {"NuPatch", V31, MovingSolid, {{{"nu", A::Integer}, {"uorder", A::Integer}, {"uknot", A::FloatArray},
     {"umin", A::Float}, {"umax", A::Float}, {"nv", A::Integer}, {"vorder", A::Integer}, {"vknot", A::FloatArray},
     {"vmin", A::Float}, {"vmax", A::Float}}}, Params::Primitive, Support::Full, h::nu_patch, ""},
    {"SubdivisionMesh", V32, MovingSolid, {{{"scheme", A::String}, {"nverts", A::IntegerArray}, {"verts", A::IntegerArray},
     {"tags", A::StringArray, 0, true}, {"nargs", A::IntegerArray, 0, true}, {"intargs", A::IntegerArray, 0, true},
     {"floatargs", A::FloatArray, 0, true}}}, Params::Primitive, Support::Full, h::subdivision_mesh,
     "catmull-clark, loop, bilinear"},
    {"HierarchicalSubdivisionMesh", Ext, MovingSolid, {{{"scheme", A::String}, {"nverts", A::IntegerArray},
     {"verts", A::IntegerArray}, {"tags", A::StringArray}, {"nargs", A::IntegerArray}, {"intargs", A::IntegerArray},
     {"floatargs", A::FloatArray}, {"stringargs", A::StringArray}}}, Params::Primitive, Support::Partial,
     h::subdivision_mesh, "with edits of vertices, edges and faces at finer levels; not \"attributes\""},
    {"Sphere", V31, MovingSolid, {{{"radius zmin zmax thetamax", A::Floats, 4}}}, Params::Primitive, Support::Full,
     h::quadric, ""},
    {"Cone", V31, MovingSolid, {{{"height radius thetamax", A::Floats, 3}}}, Params::Primitive, Support::Full, h::quadric, ""},
    {"Cylinder", V31, MovingSolid, {{{"radius zmin zmax thetamax", A::Floats, 4}}}, Params::Primitive, Support::Full,
     h::quadric, ""},
    {"Hyperboloid", V31, MovingSolid, {{{"x1 y1 z1 x2 y2 z2 thetamax", A::Floats, 7}}}, Params::Primitive, Support::Full,
     h::quadric, ""},
    {"Paraboloid", V31, MovingSolid, {{{"rmax zmin zmax thetamax", A::Floats, 4}}}, Params::Primitive, Support::Full,
     h::quadric, ""},
    {"Disk", V31, MovingSolid, {{{"height radius thetamax", A::Floats, 3}}}, Params::Primitive, Support::Full, h::quadric, ""},
    {"Torus", V31, MovingSolid, {{{"majorradius minorradius phimin phimax thetamax", A::Floats, 5}}}, Params::Primitive,
     Support::Full, h::quadric, ""},
    {"Curves", V32, MovingSolid, {{{"type", A::String}, {"nvertices", A::IntegerArray}, {"wrap", A::String}}},
     Params::Primitive, Support::Full, h::curves, ""},
    {"Points", V32, MovingSolid, {}, Params::Primitive, Support::Full, h::points, ""},
    {"Blobby", V32, MovingSolid, {{{"nleaf", A::Integer}, {"code", A::IntegerArray}, {"floats", A::FloatArray},
     {"strings", A::StringArray, 0, true}}}, Params::Primitive, Support::Partial, h::blobby,
     "plug-ins (operation 1004) and operations above add nothing; operation 4 takes its first operand from its second"},
    {"Procedural", V32, Solid, {{{"type", A::String}, {"arguments", A::StringArray}, {"bound", A::FloatArray}}}, No,
     Support::Partial, h::procedural, "DelayedReadArchive, RunProgram and DynamicLoad, when a ray meets their bound"},
    {"Procedural2", Ext, Solid, {{{"type", A::String}, {"boundtype", A::String}}}, Params::Other, Support::Partial, h::procedural2,
     "DelayedReadArchive2, DynamicLoad2, RunProgram2, when a ray meets their bound"},
    {"Geometry", V31, Solid, {{{"type", A::String}}}, Params::Primitive, Support::Full, h::geometry, "teapot, cube"},

    // ---- textures -----------------------------------------------------------------------------------
    {"MakeTexture", V31, Outside, {{{"picture", A::String}, {"texture", A::String}, {"swrap", A::String},
     {"twrap", A::String}, {"filter", A::String}, {"swidth", A::Float}, {"twidth", A::Float}}}, Params::Other,
     Support::Full, h::make_texture, "a tiled, mip-mapped OpenEXR file"},
    {"MakeBump", V31, Outside, {{{"picture", A::String}, {"texture", A::String}, {"swrap", A::String},
     {"twrap", A::String}, {"filter", A::String}, {"swidth", A::Float}, {"twidth", A::Float}}}, Params::Other,
     Support::Full, h::make_texture, "a tiled, mip-mapped OpenEXR file"},
    {"MakeLatLongEnvironment", V31, Outside, {{{"picture", A::String}, {"texture", A::String}, {"filter", A::String},
     {"swidth", A::Float}, {"twidth", A::Float}}}, Params::Other, Support::Full,
     h::make_latlong_environment, "as MakeTexture"},
    {"MakeCubeFaceEnvironment", V31, Outside, {{{"px", A::String}, {"nx", A::String}, {"py", A::String},
     {"ny", A::String}, {"pz", A::String}, {"nz", A::String}, {"texture", A::String}, {"fov", A::Float},
     {"filter", A::String}, {"swidth", A::Float}, {"twidth", A::Float}}}, Params::Other, Support::Full,
     h::make_cube_face_environment, "as MakeTexture; kept by latitude and longitude"},
    {"MakeShadow", V31, Outside, {{{"picture", A::String}, {"texture", A::String}}}, Params::Other, Support::Needless,
     nullptr, "shadows are traced and need no maps"},
    {"MakeOcclusion", Ext, Outside, {{{"pictures", A::StringArray}, {"texture", A::String}}}, Params::Other,
     Support::Needless, nullptr, "occlusion is traced and needs no maps"},
    {"MakeBrickMap", Ext, Outside, {{{"pointclouds", A::StringArray}, {"brickmap", A::String}}}, Params::Other,
     Support::Needless, nullptr, "point clouds are not used"},

    // ---- of other renderers -------------------------------------------------------------------------
    {"ShaderLayer", Ext, Anywhere, {{{"type", A::String}, {"name", A::String}, {"layer", A::String}}}, Params::Shader,
     Support::Partial, h::shader_layer, "of surfaces and displacements: all run, the last is the shader"},
    {"ConnectShaderLayers", Ext, Anywhere, {{{"type", A::String}, {"layer1", A::String}, {"variable1", A::String},
     {"layer2", A::String}, {"variable2", A::String}}}, No, Support::Partial,
     h::connect_shader_layers, "output parameters to parameters; shaders excepted"},
    {"Shader", Ext, Anywhere, {{{"name", A::String}, {"handle", A::String}}}, Params::Shader, Support::Full, h::coshader,
     "a co-shader: the attributes' shaders call it by its handle"},
    {"System", Ext, Anywhere, {{{"command", A::String}}}, No, Support::Partial, h::system_command,
     "run by the shell where who reads allows it, kanuka render --allow-system; else reported"},
    {"ResourceBegin", Ext, Anywhere, {}, No, Support::Full, h::resource_begin, ""},
    {"ResourceEnd", Ext, Anywhere, {}, No, Support::Full, h::resource_end, ""},
    {"Resource", Ext, Anywhere, {{{"handle", A::String}, {"type", A::String}}}, Params::Other, Support::Partial, h::resource,
     "\"attributes\": saved, and restored whole or by the subsets shading and transform"},
    {"EditBegin", Ext, Anywhere, {{{"name", A::String}}}, Params::Other, Support::Partial, h::edit_begin,
     "edits of a running render are passed over"},
    {"EditEnd", Ext, Anywhere, {}, No, Support::Ignored, nullptr, ""},
    {"PixelSampleImager", Ext, Outside, {{{"name", A::String}}}, Params::Shader, Support::Missing, nullptr, "use Imager"},
    {"VPAtmosphere", Ext, Anywhere, {{{"name", A::String}}}, Params::Shader, Support::Full, h::atmosphere, "as Atmosphere"},
    {"VPInterior", Ext, Anywhere, {{{"name", A::String}}}, Params::Shader, Support::Kept, h::interior,
     "interior shaders are not run yet: as Interior"},
    {"VPSurface", Ext, Anywhere, {{{"name", A::String}}}, Params::Shader, Support::Full, h::surface, "as Surface"},
    {"Camera", Ext, Outside, {{{"name", A::String}}}, Params::Other, Support::Partial, h::camera,
     "a picture is taken by one camera: the one that the first Display or the Hider names by \"string camera\", else the state at WorldBegin"},
    {"Integrator", Ext, Outside, {{{"name", A::String}, {"handle", A::String}}}, Params::Other, Support::Partial,
     h::integrator, "the depth of paths; Kanuka's own are chosen by Option \"kanuka\" \"integrator\""},
    {"Bxdf", Ext, Anywhere, {{{"name", A::String}, {"handle", A::String}}}, Params::Shader, Support::Partial, h::bxdf,
     "the common ones become standard shaders, below"},
    {"Displace", Ext, Anywhere, {{{"name", A::String}, {"handle", A::String}}}, Params::Shader, Support::Full, h::displace,
     "a displacement shader of that name, fed by Patterns; PxrDisplace ships"},
    {"Pattern", Ext, Anywhere, {{{"name", A::String}, {"handle", A::String}}}, Params::Shader, Support::Partial, h::pattern,
     "a shader of that name, whose outputs reach a Bxdf's parameters"},
    {"Light", Ext, Anywhere, {{{"name", A::String}, {"handle", A::String}}}, Params::Shader, Support::Partial, h::ris_light,
     "rectangle, disk, sphere, cylinder, distant, dome, mesh"},
    {"LightFilter", Ext, Anywhere, {{{"name", A::String}, {"handle", A::String}}}, Params::Shader, Support::Partial, h::light_filter,
     "PxrIntMultLightFilter multiplies a light's colour; use a light shader for what varies"},
    {"EnableLightFilter", Ext, Anywhere, {{{"light", A::Handle}, {"filter", A::Handle}, {"on", A::Integer}}}, No,
     Support::Partial, h::enable_light_filter, "see LightFilter"},
    {"DisplayFilter", Ext, Outside, {{{"name", A::String}, {"handle", A::String}}}, Params::Other, Support::Partial,
     h::display_filter, "PxrBackground…: the colour behind everything; grade the picture afterwards"},
    {"SampleFilter", Ext, Outside, {{{"name", A::String}, {"handle", A::String}}}, Params::Other, Support::Partial,
     h::display_filter, "PxrBackground…: the colour behind everything; grade the picture afterwards"},
    {"DisplayChannel", Ext, Outside, {{{"channel", A::String}}}, Params::Other, Support::Full, h::display_channel,
     "the shader says of what type it is; a Display names it as its mode"},
    {"Volume", Ext, MovingSolid, {{{"type", A::String}, {"bound", A::FloatArray}, {"nvertices", A::IntegerArray}}},
     Params::Primitive, Support::Partial, h::volume, "box, ellipsoid, cylinder, cone; not blobbydso"},
};
// clang-format on

const std::unordered_map<std::string_view, const RequestSpec*>& by_name() {
    static const auto map = [] {
        std::unordered_map<std::string_view, const RequestSpec*> m;
        for (const RequestSpec& r : Table)
            m.emplace(r.name, &r);
        return m;
    }();
    return map;
}

} // namespace

std::span<const RequestSpec> requests() {
    return Table;
}

const RequestSpec* find_request(std::string_view name) {
    const auto it = by_name().find(name);
    return it == by_name().end() ? nullptr : it->second;
}

std::string_view nearest_request(std::string_view name) {
    Nearest nearest(name);
    for (const RequestSpec& r : Table)
        nearest.offer(r.name);
    return nearest.best();
}

size_t RequestSpec::arg_count() const {
    size_t n = 0;
    while (n < args.size() && args[n].type != ArgType::None)
        n++;
    return n;
}

std::string RequestSpec::usage() const {
    std::string s(name);
    for (size_t i = 0; i < arg_count(); i++) {
        const bool array = args[i].type == ArgType::FloatArray || args[i].type == ArgType::IntegerArray ||
                           args[i].type == ArgType::StringArray;
        const std::string shown = array ? "[" + std::string(args[i].name) + "]" : std::string(args[i].name);
        s += args[i].optional ? " (" + shown + ")" : " " + shown;
    }
    if (params != Params::None)
        s += " …parameters…";
    return s;
}

} // namespace kanuka::ingest
