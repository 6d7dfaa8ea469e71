#include "scene/schema/lights.h"

namespace kanuka::scene {

namespace schema {
template <>
struct Many<Vec3f> : ManyOf<float, 3, Vec3f> {};
} // namespace schema

namespace {

using S = LightSettings;
using L = Light;

// clang-format off
constexpr LightKind Kinds[] = {
    {"distant", "distantlight", L::Kind::Distant, "irradiance",
     "parallel light along `direction`; with an `angle`, a disk in the sky", false, "shadowdistant"},
    {"point", "pointlight", L::Kind::Point, "radiant intensity",
     "light from a place to all sides, or as a `profile` says", false, "shadowpoint"},
    {"spot", "spotlight", L::Kind::Spot, "radiant intensity on its axis",
     "a cone of light about `direction`", false, "shadowspot"},
    {"environment", "environmentlight", L::Kind::Environment, "radiance",
     "light from all around, alike or as a picture has it"},
    {"ambient", "ambientlight", L::Kind::Ambient, "radiance",
     "what the shadeop ambient() answers; it lights nothing else"},
    {"quad", "quadlight", L::Kind::Quad, "radiance",
     "a rectangle that shines along `direction`, alike or as a picture has it"},
    {"disk", "disklight", L::Kind::Disk, "radiance", "a disk that shines along `direction`"},
    {"sphere", "spherelight", L::Kind::Sphere, "radiance", "a sphere that shines outwards"},
    {"cylinder", "cylinderlight", L::Kind::Cylinder, "radiance",
     "an open tube along `direction` that shines outwards"},
    {"sky", "skylight", L::Kind::Environment, "radiance in 1000 cd/m²",
     "a clear sky by day (Preetham, Shirley and Smits 1999)", true},
    {"sun", "sunlight", L::Kind::Distant, "irradiance in 1000 lux", "the sun of that sky", true},
    {"portal", "portallight", L::Kind::Portal, "none: the environments' own",
     "a rectangle in a window; environments are sampled through portals, along `direction`, where there are some"},
};

// Of the rows above.
enum : uint32_t {
    Distant = 1 << 0, Point = 1 << 1, Spot = 1 << 2, Environment = 1 << 3, Ambient = 1 << 4, Quad = 1 << 5,
    Disk = 1 << 6, Sphere = 1 << 7, Cylinder = 1 << 8, Sky = 1 << 9, Sun = 1 << 10,
    Portal = 1 << 11,
    Daylight = Sky | Sun,
    Dome = Environment | Sky,
    Area = Quad | Disk | Sphere | Cylinder,
    Placed = Point | Spot | Area | Portal,
    Aimed = Distant | Point | Spot | Quad | Disk | Cylinder | Portal,
    All = (1 << 12) - 1,
    Shining = All & ~Portal,
    Scaled = Shining & ~Ambient,
};
static_assert(std::size(Kinds) == 12);

template <auto... Path>
constexpr auto at = At<Path...>::template in<S>();
template <auto... Path>
constexpr auto of_light = At<&S::light, Path...>::template in<S>();

std::optional<std::string> fault_of_unit(const Setting& v) {
    if (v.texts[0].empty() || is_word_of(v.texts[0], "lumen candela lux nit watt"))
        return std::nullopt;
    return "expected lumen, candela, lux, nit or watt, got \"" + v.texts[0] + "\"";
}
std::optional<std::string> fault_of_vector(const Setting& v) {
    if (std::ranges::any_of(v.numbers, [](double x) { return x != 0; }))
        return std::nullopt;
    return "a vector of length zero";
}

const LightParameter Rows[] = {
    {Shining, {.name = "amount", .rib = "intensity lightcolor", .about =
      "how bright: the quantity that the kind's row names, or in `unit`; one number stands for all three",
      .unit = "RGB", .spreads = true},
     of_light<&L::amount>},
    {Shining & ~Daylight, {.name = "spectrum", .rib = "spectrum",
      .about = "of the light; the amount is a filter before it", .unit = "a Spectrum, or the text that makes one",
      .spectrum = true},
     of_light<&L::spectrum>},
    {Shining & ~Daylight, {.name = "unit", .rib = "unit", .about = "of the amount; empty = radiometric",
      .unit = "lumen, candela, lux, nit or watt", .fault = fault_of_unit},
     of_light<&L::unit>},
    {Placed, {.name = "position", .about = "where it is", .unit = "scene units"}, at<&S::position>},
    {Aimed, {.name = "direction",
      .about = "where it shines to; a tube's axis. The light's +y is turned as far to the world's +y as that allows",
      .unit = "a vector of any length", .fault = fault_of_vector},
     at<&S::direction>},
    {Distant | Sun, {.name = "angle", .rib = "angle", .about = "diameter in the sky; 0 = a sharp shadow",
      .unit = "degrees", .range = {0, 180}},
     of_light<&L::angle>},
    {Spot, {.name = "cone_angle", .rib = "coneangle", .about = "from the axis to the cone's edge",
      .unit = "degrees", .range = {0, 180}},
     of_light<&L::cone_angle>},
    {Spot, {.name = "cone_delta_angle", .rib = "conedeltaangle", .about = "width of the soft edge, inside the cone",
      .unit = "degrees"},
     of_light<&L::cone_delta_angle>},
    {Spot, {.name = "beam_distribution", .rib = "beamdistribution",
      .about = "of the cosine to the axis, by which light falls off in the cone", .unit = "exponent"},
     of_light<&L::beam_distribution>},
    {Point | Spot | Disk | Sphere | Cylinder, {.name = "radius", .rib = "radius",
      .about = "of points and spots 0 = sharp shadows", .unit = "scene units", .range = NotNegative},
     of_light<&L::radius>},
    {Quad | Portal, {.name = "width", .rib = "width", .about = "along its x", .unit = "scene units", .range = NotNegative},
     of_light<&L::width>},
    {Quad | Cylinder | Portal, {.name = "height", .rib = "height", .about = "along its y; of a tube, along its axis",
      .unit = "scene units", .range = NotNegative},
     of_light<&L::height>},
    {Environment | Quad, {.name = "texture", .rib = "texture mapname", .about =
      "a picture: of an environment by latitude and longitude, of a quad upright as seen from where it shines to",
      .unit = "file", .file = true},
     of_light<&L::texture>},
    {Point | Spot, {.name = "profile", .rib = "iesprofile", .about =
      "IES LM-63, type C; vertical angle 0 along `direction`, horizontal angle 0 along the light's +x",
      .unit = "file", .file = true},
     of_light<&L::profile>},
    {Point | Spot, {.name = "decay", .rib = "decay",
      .about = "the power of the distance that it falls off with; but for 2 such a light has no extent",
      .unit = "exponent", .range = {0, 4}},
     at<&S::decay>},
    {Daylight, {.name = "sun", .rib = "sundirection", .about = "towards the sun; +y is the zenith",
      .unit = "a vector of any length", .fault = fault_of_vector},
     at<&S::sun>},
    {Daylight, {.name = "turbidity", .rib = "turbidity",
      .about = "of the air: 2 a clear day, 10 haze, and held to those"},
     at<&S::turbidity>},
    {Area | Dome | Distant | Sun, {.name = "visible_camera", .rib = "visible",
      .about = "whether the camera sees the light itself"},
     of_light<&L::visible_camera>},
    {Scaled, {.name = "diffuse", .rib = "diffuse", .about = "how much of its light diffuse lobes show",
      .unit = "factor", .range = NotNegative},
     of_light<&L::lobes, &LobeMultipliers::diffuse>},
    {Scaled, {.name = "specular", .rib = "specular", .about = "and all other lobes", .unit = "factor",
      .range = NotNegative},
     of_light<&L::lobes, &LobeMultipliers::specular>},
    {All, {.name = "name", .about = "by which `lights_off` and `shadows_off` of objects mean it"},
     of_light<&L::name>},
    {Shining, {.name = "group", .rib = "group __group", .about = "by which they mean several",
      .unit = "names, parted by blanks", .links = true},
     of_light<&L::group>},
};
// clang-format on

} // namespace

LightSettings LightKind::defaults() const {
    LightSettings s;
    s.light.kind = kind;
    const uint32_t bit = 1u << (this - Kinds);
    if (bit & Area)
        s.light.radius = 0.5f;
    if (bit & Sun)
        s.light.angle = 0.53f; // as wide as the sun is
    if (bit & Ambient)
        s.light.visible_camera = false;
    return s;
}

bool LightKind::is_placed_by_points() const {
    return !daylight &&
           (kind == Light::Kind::Distant || kind == Light::Kind::Point || kind == Light::Kind::Spot);
}

std::vector<std::string_view> LightKind::shader_parameters() const {
    std::vector<std::string_view> all;
    for (const LightParameter& row : light_parameters())
        if (row.is_of(*this))
            for (const std::string_view name : words_of(row.rib))
                all.push_back(name);
    if (is_placed_by_points())
        all.insert(all.end(), {"from", "to"});
    return all;
}

void remake(Light& light, LightSource source) {
    const NodeId node = light.node;
    light = source.finish(source);
    light.node = node;
    light.source = std::make_shared<const LightSource>(std::move(source));
}

std::span<const LightKind> light_kinds() {
    return Kinds;
}
const LightKind* find_light_kind(std::string_view name) {
    const auto kind = std::ranges::find(Kinds, name, &LightKind::name);
    return kind == std::end(Kinds) ? nullptr : kind;
}
const LightKind* find_light_shader(std::string_view name) {
    const auto kind = std::ranges::find_if(Kinds, [&](const LightKind& k) {
        return k.shader == name || (k.mapped_shader == name && !name.empty());
    });
    return kind == std::end(Kinds) ? nullptr : kind;
}

std::span<const LightParameter> light_parameters() {
    return Rows;
}
const LightParameter* find_light_parameter(std::string_view name) {
    const auto row = std::ranges::find_if(Rows, [&](const LightParameter& r) { return r.name == name; });
    return row == std::end(Rows) ? nullptr : row;
}

} // namespace kanuka::scene
