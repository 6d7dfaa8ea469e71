#include <cctype>

#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "python/lights.h"
#include "python/values.h"
#include "scene/counts.h"
#include "scene/display_layers.h"
#include "scene/shutter.h"
#include "scene/summary.h"

namespace kanuka::python {

namespace {

scene::Group::Instances instances(Scene& owner, const Group& group, nb::handle transforms, nb::handle times) {
    check_idle(owner);
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

// ---- what `kanuka info` prints
// ---------------------------------------------------------------------------------------

// "PolygonMesh" as "polygon mesh".
std::string in_words(const std::string& name) {
    std::string words;
    for (const char c : name)
        words += std::isupper(static_cast<unsigned char>(c))
                     ? (words.empty() ? "" : " ") + std::string(1, char(c + 32))
                     : std::string(1, c);
    return words;
}

nb::list displays(const scene::Options& options) {
    nb::list list;
    for (const scene::Display& d : options.displays) {
        nb::dict entry;
        entry["file"] = d.file;
        entry["driver"] = d.driver;
        entry["mode"] = d.mode;
        entry["layers"] = scene::layers_of_mode(d.mode);
        list.append(entry);
    }
    return list;
}

nb::dict summary(const Scene& s) {
    const scene::Summary counted = scene::summarize(s.scene);
    nb::dict primitives, result, shaders;
    for (const auto& [kind, n] : counted.by_kind)
        primitives[in_words(kind).c_str()] = n;
    const auto names = [](const std::map<std::string, size_t>& counts) {
        nb::list list;
        for (const auto& [name, n] : counts)
            if (name != "(default)")
                list.append(name);
        return list;
    };
    shaders["surface"] = names(counted.surfaces);
    shaders["displacement"] = names(counted.displacements);
    nb::list lights;
    for (const scene::ShaderRef& l : s.scene.light_shaders)
        lights.append(l.name);
    for (const scene::Light& l : s.scene.lights)
        lights.append(std::string(scene::kind_name(l.kind)));
    size_t placed = counted.instances;
    for (const scene::Group& g : s.scene.groups)
        for (const auto& i : g.instances)
            placed += i.count();
    const scene::Options& o = s.options;
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
    result["points"] = counted.control_points;
    result["groups"] = counted.groups;
    result["instances"] = placed;
    result["area_lights"] = counted.area_light_primitives;
    result["lights"] = lights;
    result["shaders"] = shaders;
    return result;
}

void bind_options(nb::module_& m) {
    using O = scene::Options;
    nb::class_<O> options(m, "Options", "Options of a scene; those of render() go over them.");
    property(
        options, "resolution", [](const O& o) { return std::pair(o.width, o.height); },
        [](O& o, std::pair<int, int> size) {
            if (size.first < 1 || size.second < 1)
                throw nb::value_error("resolution: expected two positive numbers");
            o.width = size.first, o.height = size.second;
        });
    field(options, "pixel_aspect", &O::pixel_aspect);
    field(options, "crop", &O::crop, "xmin, xmax, ymin, ymax as fractions, y down");
    field(options, "filter", &O::filter);
    property(
        options, "filter_width", [](const O& o) { return std::pair(o.filter_width[0], o.filter_width[1]); },
        [](O& o, std::pair<float, float> w) { o.filter_width[0] = w.first, o.filter_width[1] = w.second; });
    field(options, "exposure_gain", &O::exposure_gain);
    field(options, "exposure_gamma", &O::exposure_gamma,
          "of Exposure: where it is not 1, PNGs have it in place of sRGB's curve");
    property(
        options, "color_space", [](const O& o) { return o.color.space; },
        [](O& o, const std::string& s) { o.color.space = s; },
        "of all RGB in the scene: rec709, rec2020 or acescg");
    property(
        options, "output_space", [](const O& o) { return o.color.output; },
        [](O& o, const std::string& s) { o.color.output = s; },
        "of the picture: one of those, aces2065 or xyz; empty = the scene's");
    property(
        options, "observer", [](const O& o) { return o.color.observer; },
        [](O& o, const std::string& s) { o.color.observer = s; }, "1931 (2 degrees) or 1964 (10 degrees)");
    property(
        options, "sensor", [](const O& o) { return o.color.sensor; },
        [](O& o, const std::string& s) { o.color.sensor = s; },
        "file of a camera's sensitivities, in place of the observer");
    property(
        options, "sensor_training", [](const O& o) { return o.color.training; },
        [](O& o, const std::string& s) { o.color.training = s; },
        "file of reflectances that the camera's matrix is fitted to; empty = Kanuka's own");
    property(
        options, "white_balance", [](const O& o) { return o.color.white_balance; },
        [](O& o, nb::handle s) { o.color.white_balance = spectrum_text(s, "white_balance"); },
        "the light that is white in the picture; empty = the scene's white",
        nb::for_setter(nb::sig("def white_balance(self, light: Spectrum | str, /) -> None")));
    property(
        options, "display", [](const O& o) { return o.color.display; },
        [](O& o, const std::string& s) {
            if (s != film::LinearDisplay && !color::find_display(s))
                throw nb::value_error("display: expected \"srgb\", \"rec709\" or \"linear\"");
            o.color.display = s;
        },
        "encoding of PNGs: srgb, rec709 (BT.1886), or linear: the values as they are but for exposure_gamma");
    property(
        options, "f_stop", [](const O& o) { return o.color.f_stop; },
        [](O& o, float v) { o.color.f_stop = v; }, "with shutter_time: exposure of physical light; 0 = none");
    property(
        options, "shutter_time", [](const O& o) { return o.color.shutter; },
        [](O& o, float v) { o.color.shutter = v; }, "seconds");
    property(options, "iso", [](const O& o) { return o.color.iso; }, [](O& o, float v) { o.color.iso = v; });
    property(
        options, "exposure_stops", [](const O& o) { return o.color.stops; },
        [](O& o, float v) { o.color.stops = v; }, "the picture times 2 to this");
    field(options, "samples", &O::samples, "paths a pixel; 0 = the renderer's default");
    field(options, "max_depth", &O::max_depth, "surface events of a path");
    field(options, "volume_depth", &O::volume_depth,
          "events of a path inside of media: scattering, boundaries that are passed");
    field(options, "integrator", &O::integrator);
    property(
        options, "transport",
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
        "all shaders and lights are RISpec's.");
    field(options, "clamp_direct", &O::clamp_direct,
          "most radiance that light brings which reaches the first surface straight; 0 = unbounded");
    field(options, "clamp_indirect", &O::clamp_indirect,
          "and all other light, a contribution; 0 = unbounded");
    field(options, "geometry_tolerance", &O::geometry_tolerance,
          "pixels; 0 = micropolygons are traced one to one");
    field(options, "normal_tolerance", &O::normal_tolerance, "degrees");
    field(options, "watertight", &O::watertight,
          "Rays never pass between polygons that share an edge; without it they are a fifth faster.");
    field(options, "seed", &O::seed);
    field(options, "strict_directions", &O::strict_directions,
          "What surface shaders do that no material can do is an error, not approximated.");
    property(
        options, "specular", [](const O& o) { return o.user.get_string("kanuka:specular", "prman"); },
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
        "The exponent that specular() of classic shaders has: prman, 8 / roughness; rispec, 1 / roughness.");
    field(options, "array_room", &O::array_room,
          "Values that shaders' arrays hold which grow in loops of unseen length.");
    property(
        options, "shutter", [](const O& o) { return std::pair(o.shutter_open, o.shutter_close); },
        [](O& o, std::pair<float, float> times) {
            if (!(times.first <= times.second))
                throw nb::value_error("shutter: it must open before it closes");
            o.shutter_open = times.first, o.shutter_close = times.second;
        },
        "when it opens and closes, in the times that moving things are given at; equal = no motion blur");
    property(
        options, "shutter_opening", [](const O& o) { return o.shutter_opening; },
        [](O& o, const std::vector<float>& opening) {
            if (const auto fault = scene::fault_of_opening(opening))
                throw nb::value_error(("shutter_opening: " + *fault).c_str());
            o.shutter_opening = opening;
        },
        "how it opens and closes, in fractions of its time: [] = at once; [a, b] = open from a, closing "
        "from\n"
        "b, linearly; ten numbers = along Bezier curves");
    field(options, "shader_path", &O::shader_path);
    field(options, "texture_path", &O::texture_path);
    field(options, "archive_path", &O::archive_path);
    options.def_prop_ro("displays", &displays, nb::sig("def displays(self) -> list[dict[str, object]]"));
}

} // namespace

void bind_scene(nb::module_& m) {
    bind_options(m);
    nb::class_<Group> group(m, "Group",
                            "Geometry that is placed any number of times; made by Scene.add_group().");
    nb::class_<Scene> scene(m, "Scene", "What is rendered: geometry, lights, camera, options.");
    bind_geometry(scene, group);
    const char* instances_doc = "Places a group once for each matrix of (N, 3, 4) or (N, 4, 4), acting on "
                                "columns. "
                                "Moving ones: (T, N, 3, 4) at `times` (default: evenly from 0 to 1).";

    group.def_prop_ro("name", [](const Group& g) { return g.get().name; });
    define(
        group, "add_instances",
        [](Group& g, const Group& child, nb::handle transforms, nb::handle times) {
            if (child.index >= g.index)
                throw nb::value_error("group: a group holds instances of groups made before it");
            g.get().instances.push_back(instances(*g.owner, child, transforms, times));
        },
        nb::arg("group"), nb::arg("transforms"), nb::arg("times") = nb::none(), instances_doc,
        nb::sig("def add_instances(self, group: Group, transforms: ArrayLike, times: Sequence[float] | "
                "None = "
                "None) -> None"));

    scene.def(nb::init<>());
    scene.def_prop_ro(
        "options", [](Scene& s) -> scene::Options& { return s.options; }, nb::rv_policy::reference_internal);
    property(
        scene, "camera", [](Scene& s) -> Camera& { return s.camera; },
        [](Scene& s, const Camera& c) { s.camera = c; }, nb::rv_policy::reference_internal);
    scene.def_prop_rw(
        "resolution", [](const Scene& s) { return std::pair(s.options.width, s.options.height); },
        [](nb::handle self, nb::handle size) { self.attr("options").attr("resolution") = size; },
        nb::for_setter(nb::sig("def resolution(self, size: tuple[int, int], /) -> None")));
    scene.def_prop_ro("file", [](const Scene& s) { return s.scene.file; });
    scene.def_prop_ro(
        "journal", [](const Scene& s) { return s.journal; }, "What reading the scene reported.");
    define(
        scene, "add_group",
        [](std::shared_ptr<Scene> s, const std::string& name) {
            check_idle(*s);
            s->scene.groups.emplace_back().name = name;
            return Group{s, int(s->scene.groups.size()) - 1};
        },
        nb::arg("name") = "");
    define(
        scene, "add_instances",
        [](Scene& s, const Group& g, nb::handle transforms, nb::handle times) {
            s.scene.instances.push_back(instances(s, g, transforms, times));
        },
        nb::arg("group"), nb::arg("transforms"), nb::arg("times") = nb::none(), instances_doc,
        nb::sig("def add_instances(self, group: Group, transforms: ArrayLike, times: Sequence[float] | "
                "None = None) -> None"));
    scene.def("summary", &summary, "Counts and names of what is in the scene.",
              nb::sig("def summary(self) -> dict[str, object]"));

    bind_lights(scene);
    bind_light_kinds(m);
}

} // namespace kanuka::python
