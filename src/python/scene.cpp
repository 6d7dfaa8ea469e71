#include <cctype>

#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "python/lights.h"
#include "python/parameters.h"
#include "python/values.h"
#include "scene/bounds.h"
#include "scene/counts.h"
#include "scene/display_layers.h"
#include "scene/edit_checks.h"
#include "scene/schema/attributes.h"
#include "scene/schema/camera.h"
#include "scene/schema/options.h"
#include "scene/summary.h"

namespace kanuka::python {

namespace {

// How instances differ, beside their places.
struct Differences {
    nb::handle variant, tint, roughness;
    const nb::dict& primvars;
    bool unique;
};

// A value, or one for each instance. Three numbers are a color where there are no three instances, four rows
// of four a matrix where there are no four.
scene::ValueList instance_primvars(const nb::dict& given, size_t instances) {
    const DetailCount counts[] = {{scene::Detail::Uniform, instances}, {scene::Detail::Constant, 1}};
    scene::ValueList list;
    for (auto [key, value] : given) {
        auto name = argument<std::string>(key, "primvars: a name");
        if (holds_texts(value)) {
            list.set(texts_of_instances(name, value, instances));
            continue;
        }
        const bool is_plain = name.find(' ') == std::string::npos;
        const std::vector<size_t> shape =
            is_plain ? float_array(value, name.c_str()).shape : std::vector<size_t>();
        if (instances != 3 && shape == std::vector<size_t>{3})
            name = "color " + name;
        if (instances != 4 && shape == std::vector<size_t>{4, 4})
            name = "matrix " + name;
        list.set(primvar(name, value, counts));
    }
    return list;
}

scene::Variation variation(const Differences& given) {
    const auto values = [](nb::handle value, const char* name, size_t components) {
        if (value.is_none())
            return scene::Buffer<float>();
        const FloatArray array = float_array(value, name);
        const size_t more = components > 1 ? 1 : 0; // the last dimension
        if (array.shape.size() > 1 + more ||
            (more && (array.shape.empty() || array.shape.back() != components)))
            throw nb::value_error((std::string(name) + ": expected shape " +
                                   (more ? "(3,) or (N, 3)" : "() or (N,)") + "; got " +
                                   shape_text(array.shape))
                                      .c_str());
        return array.buffer;
    };
    return {values(given.variant, "variant", 1),
            values(given.tint, "tint", 3),
            values(given.roughness, "roughness", 1),
            {}};
}

scene::Group::Instances instances(Scene& owner, const Group& group, nb::handle transforms, nb::handle times,
                                  const Differences& differences) {
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
    result.variation = variation(differences);
    result.variation.primvars = instance_primvars(differences.primvars, result.count());
    result.unique = differences.unique;
    if (result.unique && result.moves())
        throw nb::value_error("unique: what moves as an instance stays one; place its shapes one by one");
    if (const scene::Fault fault = scene::fault_of(result.variation, result.count()))
        throw nb::value_error(fault->c_str());
    check_idle(owner); // all code of the arguments has run, which may have moved groups
    result.group = group.index();
    result.first_id = owner.next_id;
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
    for (const scene::OptionParameter& row : scene::option_parameters())
        result[row.name] = object_of(row, row.get(o));
    result["displays"] = displays(o);
    result["projection"] = std::string(kind_of(s.camera.camera.projection).name);
    result["fov"] = s.camera.camera.fov;
    result["primitives"] = primitives;
    result["points"] = counted.control_points;
    result["groups"] = counted.groups;
    result["instances"] = placed;
    result["area_lights"] = counted.area_light_primitives;
    result["lights"] = lights;
    result["shaders"] = shaders;
    return result;
}

// Of a scene.
struct Options {
    std::shared_ptr<Scene> owner;
};

void bind_options(nb::module_& m) {
    nb::class_<Options> options(m, "Options", "Options of a scene; those of render() go over them.");
    bind_parameters(
        options, scene::option_parameters(),
        [](const Options& o) -> const scene::Options& { return o.owner->options; },
        [](Options& o, const char* row, const scene::Setting& value) {
            applied(*o.owner, scene::Set{scene::NodeId::World, {{row, value}}});
        });
    options.def_prop_ro(
        "displays", [](const Options& o) { return displays(o.owner->options); },
        nb::sig("def displays(self) -> list[dict[str, object]]"));
}

template <class Of>
nb::dict descriptions(std::span<const scene::Parameter<Of>> rows) {
    const Of fallback;
    nb::dict all;
    for (const auto& row : rows)
        all[row.name] = description(row, row.get(fallback));
    return all;
}

void bind_tables(nb::module_& m) {
    m.def(
        "option_parameters", [] { return descriptions(scene::option_parameters()); },
        nb::sig("def option_parameters() -> dict[str, dict]"),
        "What options there are, by name: 'type', 'default', 'help', 'unit', 'expected' (what it takes, in "
        "words),\n"
        "'choices', 'rib' (names in RIB), 'flag' (of the command line), 'since'.");
    m.def(
        "attribute_parameters", [] { return descriptions(scene::attribute_parameters()); },
        nb::sig("def attribute_parameters() -> dict[str, dict]"),
        "What attributes of RIB are declared, as option_parameters() tells options.");
    m.def(
        "camera_parameters", [] { return descriptions(scene::camera_parameters()); },
        nb::sig("def camera_parameters() -> dict[str, dict]"),
        "What cameras take, as option_parameters() tells options; defaults are RIB's (Camera: fov 45).");
    define(
        m, "check_option",
        [](const std::string& name, nb::handle value) {
            const scene::OptionParameter* row = scene::find_option(name);
            if (!row)
                throw nb::value_error(("there is no option " + name).c_str());
            setting(*row, value, name.c_str());
        },
        nb::arg("name"), nb::arg("value"),
        "Raises TypeError or ValueError, with what would do, unless the option takes the value.");
}

constexpr const char* InstancesSignature =
    "def add_instances(self, group: Group, transforms: ArrayLike, times: Sequence[float] | None = None, *, "
    "variant: ArrayLike | None = None, tint: ArrayLike | None = None, roughness: ArrayLike | None = None, "
    "primvars: dict[str, ArrayLike] = {}, unique: bool = False) -> Node";
constexpr const char* InstancesDoc =
    "Places a group once for each matrix of (N, 3, 4) or (N, 4, 4), acting on columns. "
    "Moving ones: (T, N, 3, 4) at `times` (default: evenly from 0 to 1).\n\n"
    "How they differ in looks, each a value or one for each instance: `variant`, of the `variants` of a "
    "shape, between whole numbers two of them are blended; `tint`, (3,) or (N, 3), multiplies the colours of "
    "bodies, as docs/lobes.md names them; `roughness` is added to that of lobes; `primvars` are bound to "
    "parameters of surface shaders by their name, as those of a shape are: \"wetness\", \"vector wind\", "
    "a text or a matrix (acting on columns). Of nested instances the innermost that says any of it "
    "counts.\n\n"
    "`unique`: each is diced and shaded where it stands, for shaders that ask where in the world that is.";

void bind_group(nb::class_<Group>& group) {
    group.def_prop_ro("node", [](const Group& g) { return Node{g.owner, g.id}; });
    group.def_prop_ro("name", [](const Group& g) { return g.get().name; });
    define(
        group, "add_instances",
        [](Group& g, const Group& child, nb::handle transforms, nb::handle times, nb::handle variant,
           nb::handle tint, nb::handle roughness, nb::dict primvars, bool unique) {
            const auto check_order = [&] {
                if (child.index() >= g.index())
                    throw nb::value_error("group: a group holds instances of groups made before it");
            };
            check_order();
            scene::Group::Instances places =
                instances(*g.owner, child, transforms, times, {variant, tint, roughness, primvars, unique});
            check_order(); // the group itself may be gone by now
            return Node{g.owner, g.owner->editor->add(g.get(), std::move(places)).node};
        },
        nb::arg("group"), nb::arg("transforms"), nb::arg("times") = nb::none(), nb::kw_only(),
        nb::arg("variant") = nb::none(), nb::arg("tint") = nb::none(), nb::arg("roughness") = nb::none(),
        nb::arg("primvars") = nb::dict(), nb::arg("unique") = false, InstancesDoc,
        nb::sig(InstancesSignature));
}

constexpr const char* BoundsDoc =
    "Lowest and highest corner of the box around all that is in the scene, at all times, in world space; "
    "None: there is nothing.\n\n"
    "Of control points, which surfaces stay within, as wide as curves and points are. Displacement, blobbies "
    "and what procedurals will make do not count.";

void bind_class(nb::class_<Scene>& scene) {
    scene.def(nb::init<>());
    scene.def_prop_ro("options", [](std::shared_ptr<Scene> s) { return Options{s}; });
    property(
        scene, "camera", [](Scene& s) -> Camera& { return s.camera; },
        [](Scene& s, const Camera& c) {
            applied(s, scene::Replace{scene::camera_node(), c.camera});
            s.camera.axis = c.axis;
        },
        nb::rv_policy::reference_internal);
    scene.def_prop_rw(
        "resolution", [](const Scene& s) { return std::pair(s.options.width, s.options.height); },
        [](nb::handle self, nb::handle size) { self.attr("options").attr("resolution") = size; },
        nb::for_setter(nb::sig("def resolution(self, size: tuple[int, int], /) -> None")));
    scene.def_prop_ro("file", [](const Scene& s) { return s.scene.file; });
    scene.def_prop_ro(
        "journal", [](const Scene& s) { return s.journal; }, "What reading the scene reported.");
    scene.def_prop_ro(
        "procedurals_shared", &shared_of, nb::sig("def procedurals_shared(self) -> dict[str, object]"),
        "What it has of other frames, where load() was given Expansions: how many times programs and "
        "plug-ins "
        "were 'asked', and\n'kept' of what they had made before; how many procedurals were read 'ahead', as "
        "rays of frames before had met them; and\n'again': why they were asked what they had not been asked "
        "before, as dicts of 'why' (\"new\", \"arguments\", \"parameters\",\n\"bound\", \"detail\", "
        "\"search path\", \"declarations\", \"no room\"), 'procedurals', how many, and 'name', of the "
        "first.");
    define(
        scene, "add_group",
        [](std::shared_ptr<Scene> s, const std::string& name) {
            check_idle(*s);
            scene::Group group;
            group.name = name;
            if (s->delayed)
                throw nb::value_error(
                    "a scene that is read on demand takes no more groups: those that are "
                    "read later are numbered on from its own. Load it with on_demand=False");
            return Group{s, applied(*s, scene::Add{scene::NodeId::World, std::move(group)})};
        },
        nb::arg("name") = "");
    define(
        scene, "add_instances",
        [](std::shared_ptr<Scene> s, const Group& g, nb::handle transforms, nb::handle times,
           nb::handle variant, nb::handle tint, nb::handle roughness, nb::dict primvars, bool unique) {
            return Node{s, s->editor
                               ->add(instances(*s, g, transforms, times,
                                               {variant, tint, roughness, primvars, unique}))
                               .node};
        },
        nb::arg("group"), nb::arg("transforms"), nb::arg("times") = nb::none(), nb::kw_only(),
        nb::arg("variant") = nb::none(), nb::arg("tint") = nb::none(), nb::arg("roughness") = nb::none(),
        nb::arg("primvars") = nb::dict(), nb::arg("unique") = false, InstancesDoc,
        nb::sig(InstancesSignature));
    scene.def(
        "bounds",
        [](const Scene& s) -> nb::object {
            const Bounds3f b = scene::bounds(s.scene);
            if (b.empty())
                return nb::none();
            return nb::make_tuple(nb::make_tuple(b.lo.x, b.lo.y, b.lo.z),
                                  nb::make_tuple(b.hi.x, b.hi.y, b.hi.z));
        },
        BoundsDoc,
        nb::sig("def bounds(self) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None"));
    scene.def("summary", &summary, "Counts and names of what is in the scene.",
              nb::sig("def summary(self) -> dict[str, object]"));
}

} // namespace

void bind_scene(nb::module_& m) {
    bind_options(m);
    bind_tables(m);
    bind_solids(m);
    nb::class_<Group> group(m, "Group",
                            "Geometry that is placed any number of times; made by Scene.add_group().");
    nb::class_<Scene> scene(m, "Scene", "What is rendered: geometry, lights, camera, options.");
    bind_meshes(scene), bind_meshes(group);
    bind_shapes(scene), bind_shapes(group);
    bind_solids_of(scene, group);
    bind_group(group);
    bind_class(scene);
    bind_nodes_of(scene);
    bind_archives(scene);
    bind_lights(scene);
    bind_light_kinds(m);
}

} // namespace kanuka::python
