#include "python/lights.h"

#include "base/latlong.h"
#include "python/arrays.h"
#include "python/keywords.h"
#include "python/messages.h"
#include "shade/lights.h"
#include "shade/sky.h"

namespace kanuka::python {

namespace {

using Kind = scene::Light::Kind;

// ---- the one declaration of what add_light() takes; its signature, its help, light_kinds() and
// docs/python.md come from here
// ---------------------------------------------------------------------------------------------

// What a parameter is for, as bits.
enum : uint32_t {
    Distant = 1 << 0,
    Point = 1 << 1,
    Spot = 1 << 2,
    Environment = 1 << 3,
    Ambient = 1 << 4,
    Quad = 1 << 5,
    Disk = 1 << 6,
    Sphere = 1 << 7,
    Cylinder = 1 << 8,
    Sky = 1 << 9,
    Sun = 1 << 10,
    Daylight = Sky | Sun,
    Dome = Environment | Sky,
    Area = Quad | Disk | Sphere | Cylinder,
    Placed = Point | Spot | Area,
    Aimed = Distant | Point | Spot | Quad | Disk | Cylinder,
    All = (1 << 11) - 1,
};

struct LightKind {
    const char* name;
    Kind kind;
    const char* amount; // what that is of such a light
    const char* doc;
};
constexpr LightKind Kinds[] = {
    {"distant", Kind::Distant, "irradiance",
     "parallel light along `direction`; with an `angle`, a disk in the sky"},
    {"point", Kind::Point, "radiant intensity", "light from a place to all sides, or as a `profile` says"},
    {"spot", Kind::Spot, "radiant intensity on its axis", "a cone of light about `direction`"},
    {"environment", Kind::Environment, "radiance", "light from all around, alike or as a picture has it"},
    {"ambient", Kind::Ambient, "radiance", "what the shadeop ambient() answers; it lights nothing else"},
    {"quad", Kind::Quad, "radiance",
     "a rectangle that shines along `direction`, alike or as a picture has it"},
    {"disk", Kind::Disk, "radiance", "a disk that shines along `direction`"},
    {"sphere", Kind::Sphere, "radiance", "a sphere that shines outwards"},
    {"cylinder", Kind::Cylinder, "radiance", "an open tube along `direction` that shines outwards"},
    {"sky", Kind::Environment, "radiance in 1000 cd/m²",
     "a clear sky by day (Preetham, Shirley and Smits 1999)"},
    {"sun", Kind::Distant, "irradiance in 1000 lux", "the sun of that sky"},
};

struct GivenLight {
    scene::Light light;
    Vec3f position{0, 0, 0}, direction{0, 0, -1}, sun{0.3f, 0.6f, 0.2f};
    Transform placement;
    std::optional<float> radius, angle;
    float turbidity = 3;
};
using G = GivenLight;

template <class T, T scene::Light::* Member>
void to_light(G& g, nb::handle value, const char* name) {
    g.light.*Member = argument<T>(value, name);
}
template <Vec3f G::* Member>
void to_vector(G& g, nb::handle value, const char* name) {
    g.*Member = vec3(value, name);
}

struct Row : Keyword<G> {
    uint32_t kinds;
};
using L = scene::Light;
const Row Parameters[] = {
    {{"amount", "Sequence[float] | float", "1", "RGB, or one number for all",
      "how bright: the quantity that the kind's row names, or in `unit`",
      [](G& g, nb::handle v, const char* n) { g.light.amount = rgb(v, n); }},
     All},
    {{"spectrum", "Spectrum | str | None", "None", "a Spectrum, or the text that makes one",
      "of the light; the amount is a filter before it",
      [](G& g, nb::handle v, const char* n) {
          g.light.spectrum = v.is_none() ? std::string() : spectrum_text(v, n);
      }},
     All & ~Daylight},
    {{"unit", "str", "''", "lumen, candela, lux, nit or watt", "of the amount; '' = radiometric",
      to_light<std::string, &L::unit>},
     All & ~Daylight},
    {{"position", "Sequence[float]", "(0, 0, 0)", "scene units", "where it is", to_vector<&G::position>},
     Placed},
    {{"direction", "Sequence[float]", "(0, 0, -1)", "a vector of any length",
      "where it shines to; a tube's axis. The light's +y is turned as far to the world's +y as that allows",
      to_vector<&G::direction>},
     Aimed},
    {{"transform", "ArrayLike | None", "None", "4x4, acting on columns",
      "places it in the world, after position and direction; without these a light shines along -z, a sky's "
      "+y "
      "is up",
      [](G& g, nb::handle v, const char* n) { g.placement = transform(v, n); }},
     All & ~Ambient},
    {{"angle", "float | None", "None", "degrees",
      "diameter in the sky; None = 0, a sharp shadow, and 0.53 for a sun",
      [](G& g, nb::handle v, const char* n) { g.angle = argument<std::optional<float>>(v, n); }},
     Distant | Sun},
    {{"cone_angle", "float", "30", "degrees", "from the axis to the cone's edge",
      to_light<float, &L::cone_angle>},
     Spot},
    {{"cone_delta_angle", "float", "5", "degrees", "width of the soft edge, inside the cone",
      to_light<float, &L::cone_delta_angle>},
     Spot},
    {{"beam_distribution", "float", "2", "exponent",
      "of the cosine to the axis, by which light falls off in the cone",
      to_light<float, &L::beam_distribution>},
     Spot},
    {{"radius", "float | None", "None", "scene units",
      "None = 0 for points and spots, whose shadows are sharp; else 0.5",
      [](G& g, nb::handle v, const char* n) { g.radius = argument<std::optional<float>>(v, n); }},
     Point | Spot | Disk | Sphere | Cylinder},
    {{"width", "float", "1", "scene units", "along its x", to_light<float, &L::width>}, Quad},
    {{"height", "float", "1", "scene units", "along its y; of a tube, along its axis",
      to_light<float, &L::height>},
     Quad | Cylinder},
    {{"texture", "str | os.PathLike", "''", "file",
      "a picture: of an environment by latitude and longitude, of a quad upright as seen from where it "
      "shines to",
      [](G& g, nb::handle v, const char* n) {
          g.light.texture = argument<std::filesystem::path>(v, n).string();
      }},
     Environment | Quad},
    {{"profile", "str | os.PathLike", "''", "file",
      "IES LM-63, type C; vertical angle 0 along `direction`, horizontal angle 0 along the light's +x",
      [](G& g, nb::handle v, const char* n) {
          g.light.profile = argument<std::filesystem::path>(v, n).string();
      }},
     Point | Spot},
    {{"sun", "Sequence[float]", "(0.3, 0.6, 0.2)", "a vector of any length",
      "towards the sun; +y is the zenith", to_vector<&G::sun>},
     Daylight},
    {{"turbidity", "float", "3", "2 a clear day to 10 haze", "of the air",
      [](G& g, nb::handle v, const char* n) { g.turbidity = argument<float>(v, n); }},
     Daylight},
    {{"visible_camera", "bool", "True", "", "whether the camera sees the light itself",
      to_light<bool, &L::visible_camera>},
     Area | Dome | Distant | Sun},
    {{"name", "str", "''", "", "by which `lights_off` and `shadows_off` of objects mean it",
      to_light<std::string, &L::name>},
     All},
    {{"group", "str", "''", "names, parted by blanks", "by which they mean several",
      to_light<std::string, &L::group>},
     All},
};

// ---- placing
// -----------------------------------------------------------------------------------------------

// Python's lights shine along -z of their own space with +y up, as USD's and Blender's do, and so look its
// cameras; the scene's, which are RISpec's, shine along +z. The frame is a rotation, so that pictures on
// quads are upright and the right way round from where they shine to. Photometric files turn anticlockwise as
// seen from above the luminaire (LM-63-2002, 3.0), which takes a reflection in a right-handed world.
Transform world_from_light(const LightKind& kind, const G& g) {
    if (kind.kind == Kind::Ambient)
        return {};
    if (kind.kind == Kind::Environment)
        return g.placement * openexr_from_rispec_latlong();
    const Vec3f direction = kind.name == std::string_view("sun") ? -g.sun : g.direction;
    if (!(length(direction) > 0))
        throw nb::value_error("direction: a vector of length zero");
    // Straight down is straight ahead, nodded; and so is straight up.
    const Transform frame =
        shade::frame_of(g.position, direction, {0, 1, 0}, {0, 0, direction.y < 0 ? -1.0f : 1.0f});
    const bool by_profile = kind.kind == Kind::Point || kind.kind == Kind::Spot;
    return g.placement * frame * (by_profile ? Transform::scale(-1, 1, 1) : Transform());
}

const LightKind& kind_by_name(const std::string& name) {
    std::string known;
    for (const LightKind& k : Kinds) {
        if (name == k.name)
            return k;
        known += (known.empty() ? "\"" : ", \"") + std::string(k.name) + "\"";
    }
    throw nb::value_error(("kind: \"" + name + "\" is not one of " + known).c_str());
}

const Row& row_by_name(const std::string& name) {
    for (const Row& row : Parameters)
        if (name == row.name)
            return row;
    std::vector<std::string> known;
    for (const Row& row : Parameters)
        known.push_back(row.name);
    unknown_argument("add_light", name, known);
}

void add_light(Scene& s, const std::string& kind_name, const nb::kwargs& given) {
    const LightKind& kind = kind_by_name(kind_name);
    const uint32_t bit = 1u << (&kind - Kinds);
    G g;
    for (auto [key, value] : given) {
        const Row& row = row_by_name(nb::cast<std::string>(key));
        row.take(g, value, row.name);
        if (!(row.kinds & bit))
            warn("add_light: " + std::string(row.name) + " does nothing for a light of kind \"" + kind.name +
                 "\"");
    }
    scene::Light light = std::move(g.light);
    light.kind = kind.kind;
    light.world_from_light = world_from_light(kind, g);
    light.angle = g.angle.value_or(0);
    light.radius = g.radius.value_or(bit & (Point | Spot) ? 0.0f : 0.5f);
    if (bit & Daylight) { // the model's zenith is +z
        const Transform rispec_from_openexr = openexr_from_rispec_latlong().inverse();
        const Vec3f sun = rispec_from_openexr.vector(g.sun);
        if (bit == Sky)
            light.table = shade::preetham_sky(sun, g.turbidity);
        else
            light.amount = light.amount * shade::preetham_sun(sun, g.turbidity),
            light.angle = g.angle.value_or(0.53f);
    }
    check_idle(s);
    s.scene.lights.push_back(std::move(light));
}

// ---- what is told of them
// ----------------------------------------------------------------------------------

std::string signature() {
    std::string text = "def add_light(self, kind: str, *";
    for (const Row& row : Parameters)
        text += ", " + std::string(row.name) + ": " + row.type + " = " + row.fallback;
    return text + ") -> None";
}

std::string names_of(uint32_t kinds) {
    std::string names;
    for (size_t k = 0; k < std::size(Kinds); k++)
        if (kinds & (1u << k))
            names += (names.empty() ? "" : ", ") + std::string(Kinds[k].name);
    return names;
}

std::string doc() {
    std::string text = "Adds a light.\n\n";
    for (const LightKind& k : Kinds)
        text += "    '" + std::string(k.name) + "': " + k.doc + "; amount: " + k.amount + "\n";
    text += "\n";
    for (const Row& row : Parameters) {
        text += "`" + std::string(row.name) + "`: " + row.doc;
        text += *row.unit ? " (" + std::string(row.unit) + ")" : "";
        text += row.kinds == All ? "\n" : ". For " + names_of(row.kinds) + "\n";
    }
    return text;
}

nb::dict light_kinds() {
    nb::dict all;
    for (size_t k = 0; k < std::size(Kinds); k++) {
        nb::dict one, parameters;
        for (const Row& row : Parameters)
            if (row.kinds & (1u << k))
                parameters[row.name] = nb::make_tuple(row.fallback, row.unit, row.doc);
        one["help"] = Kinds[k].doc;
        one["amount"] = Kinds[k].amount;
        one["parameters"] = parameters;
        all[Kinds[k].name] = one;
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
        [](Scene& s, const scene::ShaderRef& shader, nb::handle placement) {
            check_idle(s);
            s.scene.light_shaders.push_back(shader);
            s.scene.light_shaders.back().world_from_shader = transform(placement, "transform");
            s.scene.light_shaders.back().shadows = true;
        },
        nb::arg("shader"), nb::arg("transform") = nb::none(),
        "Adds a light by its shader: Shader('spotlight', intensity=3, …). Its parameters, units and axes "
        "are\n"
        "RISpec's: shader space is left-handed, environments and skies have their zenith at +z.",
        nb::sig("def add_light_shader(self, shader: Shader, transform: ArrayLike | None = None) -> None"));
}

void bind_light_kinds(nb::module_& m) {
    m.def("light_kinds", &light_kinds, nb::sig("def light_kinds() -> dict[str, dict]"),
          "What add_light() takes, by kind: 'help', 'amount' (the quantity that the amount is), and "
          "'parameters'\n"
          "(name: (default, unit, help)).");
}

} // namespace kanuka::python
