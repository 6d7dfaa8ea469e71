#include "python/lights.h"

#include "base/latlong.h"
#include "python/arrays.h"
#include "python/keywords.h"
#include "python/messages.h"
#include "python/parameters.h"
#include "shade/lights.h"

namespace kanuka::python {

namespace {

using Kind = scene::Light::Kind;
using scene::LightKind;
using scene::LightParameter;
using scene::LightSettings;

// Beside the rows of scene/schema/lights.
constexpr const char* Transform4x4 = "transform";
constexpr const char* TransformHelp = "places it in the world, after position and direction; without these a "
                                      "light shines along -z, a sky's +y is up";

bool has_place(const LightKind& kind) {
    return kind.kind != Kind::Ambient;
}

// ---- placing
// -----------------------------------------------------------------------------------------------

// Python's lights shine along -z of their own space with +y up, as USD's and Blender's do, and so look its
// cameras; the scene's, which are RISpec's, shine along +z. The frame is a rotation, so that pictures on
// quads are upright and the right way round from where they shine to. Photometric files turn anticlockwise as
// seen from above the luminaire (LM-63-2002, 3.0), which takes a reflection in a right-handed world.
Transform world_from_light(const LightKind& kind, const LightSettings& s, const Transform& placement) {
    if (kind.kind == Kind::Ambient)
        return {};
    if (kind.kind == Kind::Environment)
        return placement * openexr_from_rispec_latlong();
    const Vec3f direction = kind.daylight ? -s.sun : s.direction;
    // Straight down is straight ahead, nodded; and so is straight up.
    const Transform frame =
        shade::frame_of(s.position, direction, {0, 1, 0}, {0, 0, direction.y < 0 ? -1.0f : 1.0f});
    const bool by_profile = kind.kind == Kind::Point || kind.kind == Kind::Spot;
    return placement * frame * (by_profile ? Transform::scale(-1, 1, 1) : Transform());
}

scene::Light finished(const scene::LightSource& source) {
    const Vec3f sun = openexr_from_rispec_latlong().inverse().vector(source.settings.sun);
    scene::Light light = shade::finished_light(*source.kind, source.settings, sun);
    light.world_from_light = world_from_light(*source.kind, source.settings, source.placement);
    return light;
}

const LightKind& kind_by_name(const std::string& name) {
    if (const LightKind* kind = scene::find_light_kind(name))
        return *kind;
    std::string known;
    for (const LightKind& k : scene::light_kinds())
        known += (known.empty() ? "\"" : ", \"") + std::string(k.name) + "\"";
    throw nb::value_error(("kind: \"" + name + "\" is not one of " + known).c_str());
}

const LightParameter& row_by_name(const std::string& name) {
    if (const LightParameter* row = scene::find_light_parameter(name))
        return *row;
    std::vector<std::string> known;
    for (const LightParameter& row : scene::light_parameters())
        known.emplace_back(row.name);
    known.emplace_back(Transform4x4);
    unknown_argument("add_light", name, known);
}

// The same of all kinds that have it; nothing = their own.
std::optional<scene::Setting> fallback(const LightParameter& row) {
    std::optional<scene::Setting> same;
    for (const LightKind& kind : scene::light_kinds())
        if (row.is_of(kind)) {
            const scene::Setting own = row.get(kind.defaults());
            if (same && own != *same)
                return std::nullopt;
            same = own;
        }
    return same;
}

// None leaves these as they are.
bool takes_none(const LightParameter& row) {
    return row.spectrum || !fallback(row);
}

const std::string& name_of(const scene::Light& light) {
    return light.name;
}
const std::string& name_of(const scene::ShaderRef& light) {
    return light.handle;
}

// It shines on what is there already, and on what is read on demand.
template <class Light>
scene::NodeId added(Scene& s, Light light) {
    const std::string name = name_of(light);
    const bool is_new = !s.editor->has_light(name);
    const scene::NodeId id = applied(s, scene::Add{scene::NodeId::World, std::move(light)});
    if (s.delayed && is_new)
        s.delayed->shine(name);
    tell_of_repeat(s);
    return id;
}

Node add_light(std::shared_ptr<Scene> s, const std::string& kind_name, const nb::kwargs& given) {
    const LightKind& kind = kind_by_name(kind_name);
    scene::LightSource source{&kind, kind.defaults(), {}, finished};
    for (auto [key, value] : given) {
        const auto name = nb::cast<std::string>(key);
        bool used;
        if (name == Transform4x4) {
            source.placement = transform(value, Transform4x4);
            used = has_place(kind);
        } else {
            const LightParameter& row = row_by_name(name);
            if (!value.is_none() || !takes_none(row))
                row.put(source.settings, setting(row, value, row.name));
            used = row.is_of(kind);
        }
        if (!used)
            warn("add_light: " + name + " does nothing for a light of kind \"" + kind.name + "\"");
    }
    check_idle(*s);
    scene::Light light;
    remake(light, std::move(source));
    return {s, added(*s, std::move(light))};
}

// ---- what is told of them
// ----------------------------------------------------------------------------------

std::string signature() {
    std::string text = "def add_light(self, kind: str, *";
    for (const LightParameter& row : scene::light_parameters()) {
        const auto same = fallback(row);
        text += ", " + std::string(row.name) + ": " + annotation(row, false);
        text += takes_none(row) ? " | None = None"
                                : " = " + nb::cast<std::string>(nb::repr(object_of(row, *same)));
    }
    return text + ", " + Transform4x4 + ": ArrayLike | None = None) -> Node";
}

std::string doc() {
    std::string text = "Adds a light. Its node takes other values later.\n\n";
    for (const LightKind& k : scene::light_kinds())
        text += "    '" + std::string(k.name) + "': " + k.about + "; amount: " + k.amount + "\n";
    text += "\n";
    for (const LightParameter& row : scene::light_parameters()) {
        text += "`" + std::string(row.name) + "`: " + row.about;
        text += *row.unit ? " (" + std::string(row.unit) + ")" : "";
        std::string of;
        bool all = true;
        for (const LightKind& k : scene::light_kinds()) {
            all = all && row.is_of(k);
            if (row.is_of(k))
                of += (of.empty() ? "" : ", ") + std::string(k.name);
        }
        text += all ? "\n" : ". For " + of + "\n";
    }
    return text + "`" + Transform4x4 + "`: " + TransformHelp + " (4x4, acting on columns)\n";
}

nb::dict light_kinds() {
    nb::dict all;
    for (const LightKind& k : scene::light_kinds()) {
        nb::dict one, parameters;
        const LightSettings defaults = k.defaults();
        for (const LightParameter& row : scene::light_parameters())
            if (row.is_of(k))
                parameters[row.name] = description(row, row.get(defaults));
        if (has_place(k)) {
            nb::dict place;
            place["type"] = "ArrayLike | None";
            place["default"] = nb::none();
            place["help"] = TransformHelp;
            place["unit"] = place["expected"] = "4x4, acting on columns";
            place["choices"] = nb::list();
            place["rib"] = nb::list();
            place["flag"] = "";
            place["since"] = "0.1";
            parameters[Transform4x4] = place;
        }
        one["help"] = k.about;
        one["amount"] = k.amount;
        one["shader"] = k.shader;
        one["parameters"] = parameters;
        all[k.name] = one;
    }
    return all;
}

} // namespace

void bind_lights(nb::class_<Scene>& scene) {
    static const std::string sig = signature(), about = doc(); // nanobind keeps the pointers
    define(scene, "add_light", &add_light, nb::arg("kind"), nb::arg("parameters"), nb::sig(sig.c_str()),
           about.c_str());
    define(
        scene, "add_light_shader",
        [](std::shared_ptr<Scene> s, const scene::ShaderRef& shader, nb::handle placement,
           const std::string& name) {
            scene::ShaderRef light = shader;
            light.world_from_shader = transform(placement, "transform");
            light.shadows = true;
            light.handle = name;
            check_idle(*s);
            return Node{s, added(*s, std::move(light))};
        },
        nb::arg("shader"), nb::arg("transform") = nb::none(), nb::arg("name") = "",
        "Adds a light by its shader: Shader('spotlight', intensity=3, …). Its parameters, units and axes "
        "are\n"
        "RISpec's: shader space is left-handed, environments and skies have their zenith at +z.",
        nb::sig("def add_light_shader(self, shader: Shader, transform: ArrayLike | None = None, name: str "
                "= '') -> Node"));
}

void bind_light_kinds(nb::module_& m) {
    m.def("light_kinds", &light_kinds, nb::sig("def light_kinds() -> dict[str, dict]"),
          "What add_light() takes, by kind: 'help', 'amount' (the quantity that the amount is), 'shader' (of "
          "RIB), "
          "and\n"
          "'parameters', each told as option_parameters() tells options; 'rib' names those of the shader.");
}

} // namespace kanuka::python
