#include <set>

#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "python/arrays.h"
#include "python/values.h"
#include "scene/shutter.h"

namespace kanuka::python {

namespace {

scene::Group::Instances instances(Scene& owner, const Group& group, nb::handle transforms, nb::handle times) {
    if (group.owner.get() != &owner)
        throw nb::value_error("group: it belongs to another scene");
    const FloatArray array = float_array(transforms, "transforms");
    const auto& shape = array.shape;
    const size_t d = shape.size();
    if (d < 3 || d > 4 || shape[d - 1] != 4 || (shape[d - 2] != 3 && shape[d - 2] != 4) ||
        (d == 4 && shape[0] == 0))
        throw nb::value_error(("transforms: expected shape (N, 3, 4) or (N, 4, 4), or that for each time: "
                               "(T, N, 3, 4); got " +
                               shape_text(shape))
                                  .c_str());
    scene::Group::Instances result;
    result.group = group.index;
    result.first_id = owner.next_id;
    if (d == 4 && shape[0] > 1)
        result.times = sample_times(times, shape[0], "transforms");
    if (shape[d - 2] == 3) {
        result.transforms = array.buffer;
    } else {
        std::vector<float> rows(array.buffer.size() / 16 * 12); // drop the last row
        for (size_t i = 0; i < rows.size() / 12; i++)
            std::copy_n(array.buffer.data() + i * 16, 12, rows.begin() + ptrdiff_t(i * 12));
        result.transforms = std::move(rows);
    }
    owner.next_id += int(result.count());
    return result;
}

constexpr const char* LightNames[] = {"distant", "point", "spot",   "environment", "ambient",
                                      "quad",    "disk",  "sphere", "cylinder"};

scene::Light::Kind light_kind(const std::string& name) {
    std::string known;
    for (size_t i = 0; i < std::size(LightNames); i++) {
        if (name == LightNames[i])
            return scene::Light::Kind(i);
        known += (i > 0 ? ", \"" : "\"") + std::string(LightNames[i]) + "\"";
    }
    throw nb::value_error(("kind: \"" + name + "\" is not one of " + known).c_str());
}

// World from light: +z along `direction`, the origin at `position`.
Transform aim(const Vec3f& position, const Vec3f& direction) {
    if (!(length(direction) > 0))
        throw nb::value_error("direction: a vector of length zero");
    const Vec3f z = normalize(direction);
    const Vec3f side = std::abs(z.y) < 0.9f ? Vec3f(0, 1, 0) : Vec3f(1, 0, 0);
    const Vec3f x = normalize(cross(side, z)), y = cross(z, x);
    Transform t;
    for (int i = 0; i < 3; i++)
        t.m[size_t(i)] = {x[i], y[i], z[i], position[i]};
    return t;
}

void add_light(Scene& s, const std::string& kind, nb::handle amount, nb::handle position,
               nb::handle direction, nb::handle placement, float angle, float cone_angle,
               float cone_delta_angle, float beam_distribution, nb::handle radius, float width, float height,
               const std::string& texture, const std::string& profile, bool visible_camera,
               const std::string& name, const std::string& group, nb::handle spectrum,
               const std::string& unit) {
    scene::Light light;
    light.kind = light_kind(kind);
    light.amount = rgb(amount, "amount");
    if (!placement.is_none())
        light.world_from_light = transform(placement, "transform");
    else if (light.kind != scene::Light::Kind::Environment && light.kind != scene::Light::Kind::Ambient)
        light.world_from_light = aim(vec3(position, "position"), vec3(direction, "direction"));
    light.angle = angle;
    light.cone_angle = cone_angle;
    light.cone_delta_angle = cone_delta_angle;
    light.beam_distribution = beam_distribution;
    const bool point = light.kind == scene::Light::Kind::Point || light.kind == scene::Light::Kind::Spot;
    light.radius = radius.is_none() ? (point ? 0.0f : 0.5f) : nb::cast<float>(radius);
    light.width = width, light.height = height;
    light.texture = texture;
    light.profile = profile;
    light.visible_camera = visible_camera;
    light.name = name;
    light.group = group;
    if (!spectrum.is_none())
        light.spectrum = spectrum_text(spectrum);
    light.unit = unit;
    s.scene.lights.push_back(light);
}

// ---- what `kanuka info` prints
// ---------------------------------------------------------------------------------------

const char* kind_name(const scene::Geometry& geometry) {
    constexpr const char* names[] = {"polygon mesh", "subdivision mesh", "patch mesh",
                                     "NURBS patch",  "quadric",          "curves",
                                     "points",       "blobby",           "volume"};
    static_assert(std::size(names) == std::variant_size_v<scene::Geometry>);
    return names[geometry.index()];
}

nb::list displays(const scene::Options& options) {
    nb::list list;
    for (const scene::Display& d : options.displays) {
        nb::dict entry;
        entry["file"] = d.file;
        entry["driver"] = d.driver;
        entry["mode"] = d.mode;
        list.append(entry);
    }
    return list;
}

nb::dict summary(const Scene& s) {
    std::map<std::string, size_t> kinds;
    std::set<std::string> surfaces, displacements;
    size_t points = 0, area_lights = 0;
    const auto count = [&](const std::vector<scene::Primitive>& primitives) {
        for (const scene::Primitive& p : primitives) {
            kinds[kind_name(p.geometry)]++;
            if (const scene::Value* P = p.primvars.find("P"))
                points += P->items();
            if (!p.attributes)
                continue;
            if (p.attributes->surface)
                surfaces.insert(p.attributes->surface->name);
            if (p.attributes->displacement)
                displacements.insert(p.attributes->displacement->name);
            area_lights += p.attributes->area_light.has_value();
        }
    };
    count(s.scene.primitives);
    size_t placed = 0;
    const auto count_instances = [&](const std::vector<scene::Group::Instances>& list) {
        for (const auto& i : list)
            placed += i.count();
    };
    count_instances(s.scene.instances);
    for (const scene::Group& g : s.scene.groups) {
        count(g.primitives);
        count_instances(g.instances);
    }
    nb::list lights;
    for (const scene::ShaderRef& l : s.scene.light_shaders)
        lights.append(l.name);
    for (const scene::Light& l : s.scene.lights)
        lights.append(LightNames[int(l.kind)]);

    nb::dict primitives, result, shaders;
    for (const auto& [name, n] : kinds)
        primitives[name.c_str()] = n;
    nb::list surface_list, displacement_list;
    for (const auto& name : surfaces)
        surface_list.append(name);
    for (const auto& name : displacements)
        displacement_list.append(name);
    shaders["surface"] = surface_list;
    shaders["displacement"] = displacement_list;
    const scene::Options& o = s.scene.options;
    result["file"] = s.scene.file;
    result["resolution"] = nb::make_tuple(o.width, o.height);
    result["crop"] = nb::make_tuple(o.crop[0], o.crop[1], o.crop[2], o.crop[3]);
    result["filter"] = o.filter;
    result["samples"] = o.samples;
    result["max_depth"] = o.max_depth;
    result["volume_depth"] = o.volume_depth;
    result["integrator"] = o.integrator;
    result["displays"] = displays(o);
    result["projection"] = std::string(kind_of(s.camera.camera.projection).name);
    result["fov"] = s.camera.camera.fov;
    result["shutter"] = nb::make_tuple(o.shutter_open, o.shutter_close);
    result["primitives"] = primitives;
    result["points"] = points;
    result["groups"] = s.scene.groups.size();
    result["instances"] = placed;
    result["area_lights"] = area_lights;
    result["lights"] = lights;
    result["shaders"] = shaders;
    return result;
}

void bind_options(nb::module_& m) {
    using O = scene::Options;
    nb::class_<O>(m, "Options", "Options of a scene; those of render() go over them.")
        .def_prop_rw(
            "resolution", [](const O& o) { return std::pair(o.width, o.height); },
            [](O& o, std::pair<int, int> size) {
                if (size.first < 1 || size.second < 1)
                    throw nb::value_error("resolution: expected two positive numbers");
                o.width = size.first, o.height = size.second;
            })
        .def_rw("pixel_aspect", &O::pixel_aspect)
        .def_rw("crop", &O::crop, "xmin, xmax, ymin, ymax as fractions, y down")
        .def_rw("filter", &O::filter)
        .def_prop_rw(
            "filter_width", [](const O& o) { return std::pair(o.filter_width[0], o.filter_width[1]); },
            [](O& o, std::pair<float, float> w) {
                o.filter_width[0] = w.first, o.filter_width[1] = w.second;
            })
        .def_rw("exposure_gain", &O::exposure_gain)
        .def_rw("exposure_gamma", &O::exposure_gamma,
                "of Exposure: where it is not 1, PNGs have it in place of sRGB's curve")
        .def_prop_rw(
            "color_space", [](const O& o) { return o.color.space; },
            [](O& o, const std::string& s) { o.color.space = s; },
            "of all RGB in the scene: rec709, rec2020 or acescg")
        .def_prop_rw(
            "output_space", [](const O& o) { return o.color.output; },
            [](O& o, const std::string& s) { o.color.output = s; },
            "of the picture: one of those, aces2065 or xyz; empty = the scene's")
        .def_prop_rw(
            "observer", [](const O& o) { return o.color.observer; },
            [](O& o, const std::string& s) { o.color.observer = s; }, "1931 (2 degrees) or 1964 (10 degrees)")
        .def_prop_rw(
            "sensor", [](const O& o) { return o.color.sensor; },
            [](O& o, const std::string& s) { o.color.sensor = s; },
            "file of a camera's sensitivities, in place of the observer")
        .def_prop_rw(
            "sensor_training", [](const O& o) { return o.color.training; },
            [](O& o, const std::string& s) { o.color.training = s; },
            "file of reflectances that the camera's matrix is fitted to; empty = Kanuka's own")
        .def_prop_rw(
            "white_balance", [](const O& o) { return o.color.white_balance; },
            [](O& o, nb::handle s) { o.color.white_balance = spectrum_text(s); },
            "the light that is white in the picture; empty = the scene's white",
            nb::for_setter(nb::sig("def white_balance(self, light: Spectrum | str, /) -> None")))
        .def_prop_rw(
            "display", [](const O& o) { return o.color.display; },
            [](O& o, const std::string& s) {
                if (s != film::LinearDisplay && !color::find_display(s))
                    throw nb::value_error("display: expected \"srgb\", \"rec709\" or \"linear\"");
                o.color.display = s;
            },
            "encoding of PNGs: srgb, rec709 (BT.1886), or linear: the values as they are but for "
            "exposure_gamma")
        .def_prop_rw(
            "f_stop", [](const O& o) { return o.color.f_stop; }, [](O& o, float v) { o.color.f_stop = v; },
            "with shutter_time: exposure of physical light; 0 = none")
        .def_prop_rw(
            "shutter_time", [](const O& o) { return o.color.shutter; },
            [](O& o, float v) { o.color.shutter = v; }, "seconds")
        .def_prop_rw(
            "iso", [](const O& o) { return o.color.iso; }, [](O& o, float v) { o.color.iso = v; })
        .def_prop_rw(
            "exposure_stops", [](const O& o) { return o.color.stops; },
            [](O& o, float v) { o.color.stops = v; }, "the picture times 2 to this")
        .def_rw("samples", &O::samples, "paths a pixel; 0 = the renderer's default")
        .def_rw("max_depth", &O::max_depth, "surface events of a path")
        .def_rw("volume_depth", &O::volume_depth,
                "events of a path inside of media: scattering, boundaries that are passed")
        .def_rw("integrator", &O::integrator)
        .def_prop_rw(
            "transport",
            [](const O& o) {
                return o.transport == O::Transport::Full      ? "full"
                       : o.transport == O::Transport::Classic ? "classic"
                                                              : "auto";
            },
            [](O& o, const std::string& name) {
                if (name != "full" && name != "classic" && name != "auto")
                    throw nb::value_error("transport: expected full, classic or auto");
                o.transport = name == "full"      ? O::Transport::Full
                              : name == "classic" ? O::Transport::Classic
                                                  : O::Transport::Auto;
            },
            "Which light is found. full: between surfaces too, with shadows of all lights. classic: as "
            "RISpec's renderers\n"
            "did: of light sources alone, with shadows where lights ask for them, and along mirrors. auto: "
            "classic if\n"
            "all shaders and lights are RISpec's.")
        .def_rw("clamp_direct", &O::clamp_direct,
                "most radiance that light brings which reaches the first surface straight; 0 = unbounded")
        .def_rw("clamp_indirect", &O::clamp_indirect, "and all other light, a contribution; 0 = unbounded")
        .def_rw("geometry_tolerance", &O::geometry_tolerance,
                "pixels; 0 = micropolygons are traced one to one")
        .def_rw("normal_tolerance", &O::normal_tolerance, "degrees")
        .def_rw("watertight", &O::watertight,
                "Rays never pass between polygons that share an edge; without it they are a fifth faster.")
        .def_rw("seed", &O::seed)
        .def_rw("strict_directions", &O::strict_directions,
                "What surface shaders do that no material can do is an error, not approximated.")
        .def_prop_rw(
            "specular", [](const O& o) { return o.user.get_string("kanuka:specular", "prman"); },
            [](O& o, const std::string& which) {
                if (which != "prman" && which != "rispec")
                    throw nb::value_error(
                        "specular is \"prman\" (the exponent of specular() is 8 / roughness) or "
                        "\"rispec\" (1 / roughness)");
                scene::Value v;
                v.name = "kanuka:specular";
                v.type = scene::Type::String;
                v.strings = std::vector<std::string>{which};
                o.user.set(std::move(v));
            },
            "The exponent that specular() of classic shaders has: prman, 8 / roughness; rispec, 1 / "
            "roughness.")
        .def_rw("array_room", &O::array_room,
                "Values that shaders' arrays hold which grow in loops of unseen length.")
        .def_prop_rw(
            "shutter", [](const O& o) { return std::pair(o.shutter_open, o.shutter_close); },
            [](O& o, std::pair<float, float> times) {
                if (!(times.first <= times.second))
                    throw nb::value_error("shutter: it must open before it closes");
                o.shutter_open = times.first, o.shutter_close = times.second;
            },
            "when it opens and closes, in the times that moving things are given at; equal = no motion blur")
        .def_prop_rw(
            "shutter_opening", [](const O& o) { return o.shutter_opening; },
            [](O& o, const std::vector<float>& opening) {
                if (const auto fault = scene::fault_of_opening(opening))
                    throw nb::value_error(("shutter_opening: " + *fault).c_str());
                o.shutter_opening = opening;
            },
            "how it opens and closes, in fractions of its time: [] = at once; [a, b] = open from a, closing "
            "from\n"
            "b, linearly; ten numbers = along Bezier curves")
        .def_rw("shader_path", &O::shader_path)
        .def_rw("texture_path", &O::texture_path)
        .def_rw("archive_path", &O::archive_path)
        .def_prop_ro("displays", &displays, nb::sig("def displays(self) -> list[dict[str, str]]"));
}

} // namespace

void bind_scene(nb::module_& m) {
    bind_options(m);
    nb::class_<Group> group(m, "Group",
                            "Geometry that is placed any number of times; made by Scene.add_group().");
    nb::class_<Scene> scene(m, "Scene", "What is rendered: geometry, lights, camera, options.");
    bind_geometry(scene, group);
    const char* instances_doc =
        "Places a group once for each matrix of (N, 3, 4) or (N, 4, 4), acting on "
        "columns. Float32 (N, 3, 4) is kept "
        "by reference. Moving ones: (T, N, 3, 4) at `times` (default: evenly from 0 to 1).";

    group.def_prop_ro("name", [](const Group& g) { return g.get().name; })
        .def(
            "add_instances",
            [](Group& g, const Group& child, nb::handle transforms, nb::handle times) {
                if (child.index >= g.index)
                    throw nb::value_error("group: a group holds instances of groups made before it");
                g.get().instances.push_back(instances(*g.owner, child, transforms, times));
            },
            nb::arg("group"), nb::arg("transforms"), nb::arg("times") = nb::none(), instances_doc,
            nb::sig("def add_instances(self, group: Group, transforms: ArrayLike, times: Sequence[float] | "
                    "None = "
                    "None) -> None"));

    scene.def(nb::init<>())
        .def_prop_ro(
            "options", [](Scene& s) -> scene::Options& { return s.scene.options; },
            nb::rv_policy::reference_internal)
        .def_prop_rw(
            "camera", [](Scene& s) -> Camera& { return s.camera; },
            [](Scene& s, const Camera& c) { s.camera = c; }, nb::rv_policy::reference_internal)
        .def_prop_rw(
            "resolution",
            [](const Scene& s) { return std::pair(s.scene.options.width, s.scene.options.height); },
            [](nb::handle self, nb::handle size) { self.attr("options").attr("resolution") = size; },
            nb::for_setter(nb::sig("def resolution(self, size: tuple[int, int], /) -> None")))
        .def_prop_ro("file", [](const Scene& s) { return s.scene.file; })
        .def_prop_ro(
            "journal", [](const Scene& s) { return s.journal; }, "What reading the scene reported.")
        .def(
            "add_group",
            [](std::shared_ptr<Scene> s, const std::string& name) {
                s->scene.groups.emplace_back().name = name;
                return Group{s, int(s->scene.groups.size()) - 1};
            },
            nb::arg("name") = "")
        .def(
            "add_instances",
            [](Scene& s, const Group& g, nb::handle transforms, nb::handle times) {
                s.scene.instances.push_back(instances(s, g, transforms, times));
            },
            nb::arg("group"), nb::arg("transforms"), nb::arg("times") = nb::none(), instances_doc,
            nb::sig("def add_instances(self, group: Group, transforms: ArrayLike, times: Sequence[float] | "
                    "None = None) -> None"))
        .def(
            "add_light", &add_light, nb::arg("kind"), nb::kw_only(),
            nb::arg("amount") = nb::make_tuple(1, 1, 1), nb::arg("position") = nb::make_tuple(0, 0, 0),
            nb::arg("direction") = nb::make_tuple(0, 0, -1), nb::arg("transform") = nb::none(),
            nb::arg("angle") = 0.0f, nb::arg("cone_angle") = 30.0f, nb::arg("cone_delta_angle") = 5.0f,
            nb::arg("beam_distribution") = 2.0f, nb::arg("radius") = nb::none(), nb::arg("width") = 1.0f,
            nb::arg("height") = 1.0f, nb::arg("texture") = "", nb::arg("profile") = "",
            nb::arg("visible_camera") = true, nb::arg("name") = "", nb::arg("group") = "",
            nb::arg("spectrum") = nb::none(), nb::arg("unit") = "",
            "Adds a light: 'distant', 'point', 'spot', 'environment', 'ambient', 'quad', 'disk', 'sphere' or "
            "'cylinder'.\n\n"
            "`amount` is RGB: the irradiance of a distant light, the radiant intensity of a point or spot "
            "light, the\n"
            "radiance of all others. `angle` is a distant light's diameter, `cone_angle` a spot light's half "
            "angle, both\n"
            "in degrees. `radius` makes a point or spot light a soft one, and is the size of disks, spheres "
            "and "
            "cylinders\n"
            "(0.5); a quad is `width` by `height`, along x and y, and a cylinder `height` long, along z. "
            "Quads "
            "and disks shine\n"
            "along `direction`. `texture` is a picture for an environment or a quad, `profile` an IES file "
            "for "
            "a point or spot.\n"
            "`spectrum` is the light's, a Spectrum or the text that makes one; the amount is a filter before "
            "it. `unit`\n"
            "says that the amount is in lumen, candela, lux, nit or watt.",
            nb::sig("def add_light(self, kind: str, *, amount: Sequence[float] | float = (1, 1, 1), "
                    "position: Sequence[float] = (0, 0, 0), direction: Sequence[float] = (0, 0, -1), "
                    "transform: ArrayLike | None = None, angle: float = 0, cone_angle: float = 30, "
                    "cone_delta_angle: float = 5, beam_distribution: float = 2, radius: float | None = None, "
                    "width: float = 1, height: float = 1, texture: str = '', profile: str = '', "
                    "visible_camera: bool = True, name: str = '', group: str = '', spectrum: Spectrum | str "
                    "| None = None, "
                    "unit: str = '') -> None"))
        .def(
            "add_light_shader",
            [](Scene& s, const scene::ShaderRef& shader, nb::handle placement) {
                s.scene.light_shaders.push_back(shader);
                s.scene.light_shaders.back().world_from_shader = transform(placement, "transform");
                s.scene.light_shaders.back().shadows = true;
            },
            nb::arg("shader"), nb::arg("transform") = nb::none(),
            "Adds a light by its shader: Shader('spotlight', intensity=3, …).",
            nb::sig("def add_light_shader(self, shader: Shader, transform: ArrayLike | None = None) -> None"))
        .def("summary", &summary, "Counts and names of what is in the scene.",
             nb::sig("def summary(self) -> dict[str, object]"));
}

} // namespace kanuka::python
