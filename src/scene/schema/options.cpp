#include "scene/schema/options.h"

#include "base/error.h"
#include "scene/shutter.h"

namespace kanuka::scene {

namespace {

using O = Options;
using C = ColorOptions;

template <auto... Path>
constexpr auto at = At<Path...>::template in<Options>();
template <auto... Members>
constexpr auto together = Together<Members...>::template in<Options>();

std::optional<std::string> fault_of_crop(const Setting& v) {
    const auto& n = v.numbers;
    if (n[0] < n[1] && n[2] < n[3])
        return std::nullopt;
    return "expected xmin < xmax and ymin < ymax";
}

std::optional<std::string> fault_of_shutter(const Setting& v) {
    if (v.numbers[0] <= v.numbers[1])
        return std::nullopt;
    return "it must open before it closes";
}

std::optional<std::string> fault_of_shutter_opening(const Setting& v) {
    const std::vector<float> numbers(v.numbers.begin(), v.numbers.end());
    return scene::fault_of_opening(numbers);
}

std::optional<std::string> fault_of_pixels(const Setting& v) {
    if (v.numbers[0] * v.numbers[1] <= double(1 << 30))
        return std::nullopt;
    return "at most 2^30 pixels";
}

// clang-format off
const OptionParameter Rows[] = {
    // ---- the picture
    {{.name = "resolution", .rib = "", .flag = "resolution", .about = "width and height",
      .unit = "pixels", .range = {1, 1 << 30}, .fault = fault_of_pixels},
     together<&O::width, &O::height>},
    {{.name = "pixel_aspect", .rib = "", .flag = "pixel-aspect", .about = "width of a pixel over its height",
      .range = Positive},
     at<&O::pixel_aspect>},
    {{.name = "crop", .rib = "", .flag = "crop", .about = "xmin, xmax, ymin, ymax as fractions of the picture, y down",
      .range = {0, 1}, .fault = fault_of_crop},
     at<&O::crop>},
    {{.name = "samples", .rib = "kanuka:progressions kanuka:samples", .flag = "progressions",
      .about = "paths a pixel", .range = {1, 2147483647.0}},
     at<&O::samples>},
    {{.name = "adaptive", .rib = "kanuka:adaptive", .flag = "adaptive",
      .about = "noise at which a pixel takes no more paths: the error of its neighbourhood over the root of the "
               "brightness, where white is 1, as 0.01; 0 = all pixels take all",
      .range = NotNegative},
     at<&O::adaptive>},
    {{.name = "seed", .rib = "kanuka:seed", .flag = "seed", .about = "another seed, another noise",
      .range = {0, 4294967295.0}},
     at<&O::seed>},
    {{.name = "filter", .rib = "", .flag = "filter", .about = "of pixels",
      .choices = "box triangle gaussian catmull-rom sinc mitchell blackman-harris table"},
     at<&O::filter>},
    {{.name = "filter_width", .rib = "", .flag = "filter-width", .about = "along x and y", .unit = "pixels",
      .range = {0, 64, true}},
     at<&O::filter_width>},
    {{.name = "filter_values", .rib = "pixelfilter:values", .flag = "",
      .about = "of the filter `table`: in the middle of its cells, rows from the top"},
     at<&O::filter_values>},
    {{.name = "filter_cells", .rib = "pixelfilter:cells", .flag = "",
      .about = "of the filter `table`: how many there are along x and y", .range = {0, 1 << 15}},
     at<&O::filter_cells>},
    {{.name = "exposure_gain", .rib = "", .flag = "", .about = "of Exposure: multiplies the picture"},
     at<&O::exposure_gain>},
    {{.name = "exposure_gamma", .rib = "", .flag = "",
      .about = "of Exposure: where it is not 1, PNGs have it in place of sRGB's curve", .range = Positive},
     at<&O::exposure_gamma>},
    {{.name = "shutter", .rib = "Ri:Shutter", .flag = "shutter-interval",
      .about = "when it opens and closes, in the times that moving things are given at; equal = no motion blur",
      .fault = fault_of_shutter},
     together<&O::shutter_open, &O::shutter_close>},
    {{.name = "shutter_opening", .rib = "", .flag = "",
      .about = "how it opens and closes, in fractions of its time: none = at once; a, b = open from a, closing "
               "from b, linearly; ten numbers = along Bezier curves",
      .fault = fault_of_shutter_opening},
     at<&O::shutter_opening>},
    // ---- light
    {{.name = "integrator", .rib = "kanuka:integrator", .flag = "integrator",
      .about = "a name and parameters, as ao:distance=2"},
     at<&O::integrator>},
    {{.name = "transport", .rib = "kanuka:transport", .flag = "transport",
      .about = "which light is found. full: between surfaces too, with shadows of all lights. classic: as RISpec's "
               "renderers did, of light sources alone, with shadows where lights ask for them, and along mirrors. "
               "auto: classic if all shaders and lights are RISpec's",
      .choices = "full classic auto"},
     at<&O::transport>},
    {{.name = "max_depth", .rib = "kanuka:maxdepth", .flag = "max-depth", .about = "surface scattering events of a path",
      .range = {0, 1000}},
     at<&O::max_depth>},
    {{.name = "volume_depth", .rib = "kanuka:volumedepth", .flag = "volume-depth",
      .about = "events of a path inside of media: scattering, boundaries that are passed", .range = {0, 60000}},
     at<&O::volume_depth>},
    {{.name = "light_samples", .rib = "kanuka:lightsamples", .flag = "light-samples",
      .about = "light samples at each surface hit: more lessen the noise of large and of many lights", .range = {1, 64}},
     at<&O::light_samples>},
    {{.name = "clamp_direct", .rib = "kanuka:clampdirect", .flag = "clamp-direct",
      .about = "most radiance that one contribution of light that reaches the first surface straight adds to a "
               "sample; 0 = unbounded",
      .range = NotNegative},
     at<&O::clamp_direct>},
    {{.name = "clamp_indirect", .rib = "kanuka:clampindirect", .flag = "clamp-indirect",
      .about = "and one of all other light; 0 = unbounded", .range = NotNegative},
     at<&O::clamp_indirect>},
    // ---- geometry
    {{.name = "geometry_tolerance", .rib = "kanuka:geometrytolerance", .flag = "geometry-tolerance",
      .about = "how far traced geometry may be off the diced surface; 0 traces every micropolygon",
      .unit = "pixels", .range = NotNegative},
     at<&O::geometry_tolerance>},
    {{.name = "normal_tolerance", .rib = "kanuka:normaltolerance", .flag = "normal-tolerance",
      .about = "and between their normals", .unit = "degrees", .range = NotNegative},
     at<&O::normal_tolerance>},
    {{.name = "watertight", .rib = "kanuka:watertight", .flag = "watertight",
      .about = "rays never pass between polygons that share an edge; without it they are up to a tenth faster"},
     at<&O::watertight>},
    {{.name = "instance_levels", .rib = "kanuka:instancelevels", .flag = "instance-levels",
      .about = "what stands at many places, near and far, is diced and shaded at a few rates, so many times as finely "
               "as each place asks for; 0 = all as the closest",
      .range = NotNegative},
     at<&O::instance_levels>},
    {{.name = "instance_variants", .rib = "kanuka:instancevariants", .flag = "instance-variants",
      .about = "primitive variables of instances: so many of their values at most does a shape's surface run with; of "
               "more, numbers are blended, texts and matrices are the most frequent, and all others the nearest of so many",
      .range = {1, 64}},
     at<&O::instance_variants>},
    {{.name = "unique_up_to", .rib = "kanuka:uniqueupto", .flag = "unique-up-to",
      .about = "instances whose shaders ask where in the world they are become things of their own, if these have no "
               "more vertices together; 0 = none does, unless it says `unique`",
      .range = {0, 2147483647.0}},
     at<&O::unique_up_to>},
    {{.name = "procedural_memory", .rib = "limits:proceduralmemory", .flag = "",
      .about = "that may grow out of procedurals which wait for rays; 0 and -1 = unbounded", .unit = "MB",
      .range = {-1, 1 << 30}},
     at<&O::procedural_memory>},
    // ---- shaders
    {{.name = "strict_directions", .rib = "kanuka:strictdirections", .flag = "strict-directions",
      .about = "what a surface shader does that no material can do is an error at its line, not approximated"},
     at<&O::strict_directions>},
    {{.name = "specular", .rib = "kanuka:specular", .flag = "specular",
      .about = "exponent of specular() and specularbrdf() in classic shaders. prman: 8 / roughness, as nearly all "
               "published pictures have it; rispec: 1 / roughness, as RISpec 3.2 writes",
      .choices = "prman rispec"},
     at<&O::specular>},
    {{.name = "array_room", .rib = "kanuka:arrayroom", .flag = "",
      .about = "values that shaders' arrays hold which grow in loops of unseen length", .range = {1, 65536}},
     at<&O::array_room>},
    {{.name = "shader_path", .rib = "", .flag = "", .about = "folders of shaders"}, at<&O::shader_path>},
    {{.name = "texture_path", .rib = "", .flag = "", .about = "folders of textures"}, at<&O::texture_path>},
    {{.name = "archive_path", .rib = "", .flag = "", .about = "folders of archives"}, at<&O::archive_path>},
    // ---- colour
    {{.name = "color_space", .rib = "color:space", .flag = "color-space",
      .about = "of all RGB in the scene: rec709, rec2020 or acescg"},
     at<&O::color, &C::space>},
    {{.name = "output_space", .rib = "color:output", .flag = "output-space",
      .about = "of the picture: one of those, aces2065 or xyz; empty = the scene's"},
     at<&O::color, &C::output>},
    {{.name = "observer", .rib = "color:observer", .flag = "observer", .about = "of the CIE: 1931 (2 degrees) or 1964 (10 degrees)"},
     at<&O::color, &C::observer>},
    {{.name = "sensor", .rib = "color:sensor", .flag = "sensor",
      .about = "file of a camera's sensitivities, lines of nm, red, green, blue; in place of the observer"},
     at<&O::color, &C::sensor>},
    {{.name = "sensor_training", .rib = "color:training", .flag = "",
      .about = "file of reflectances that the camera's matrix is fitted to; empty = Kanuka's own"},
     at<&O::color, &C::training>},
    {{.name = "white_balance", .rib = "color:whitebalance", .flag = "white-balance",
      .about = "the light that is white in the picture: D65, A, F11, blackbody:3200, a file; empty = the scene's white",
      .spectrum = true},
     at<&O::color, &C::white_balance>},
    {{.name = "display", .rib = "color:display", .flag = "display",
      .about = "encoding of PNGs: srgb; rec709 is BT.1886; linear writes the values as they are but for exposure_gain",
      .choices = "srgb rec709 linear"},
     at<&O::color, &C::display>},
    {{.name = "f_stop", .rib = "exposure:fstop", .flag = "f-stop",
      .about = "with shutter_time: exposure of physical light; 0 = none", .range = NotNegative},
     at<&O::color, &C::f_stop>},
    {{.name = "shutter_time", .rib = "exposure:shutter", .flag = "shutter", .about = "that light is gathered",
      .unit = "seconds", .range = NotNegative},
     at<&O::color, &C::shutter>},
    {{.name = "iso", .rib = "exposure:iso", .flag = "iso", .about = "sensitivity", .range = NotNegative},
     at<&O::color, &C::iso>},
    {{.name = "exposure_stops", .rib = "exposure:stops", .flag = "exposure", .about = "the picture times 2 to this"},
     at<&O::color, &C::stops>},
};
// clang-format on

} // namespace

std::span<const OptionParameter> option_parameters() {
    return Rows;
}

const OptionParameter* find_option(std::string_view name) {
    return find_parameter(option_parameters(), name);
}
const OptionParameter* find_rib_option(std::string_view rib_name) {
    return find_rib_parameter(option_parameters(), rib_name);
}

void OptionEdits::set(std::string_view name, Setting value) {
    const OptionParameter* row = find_option(name);
    if (!row)
        throw Error("there is no option " + std::string(name), ExitCode::Usage);
    if (const auto fault = row->refused(value))
        throw Error(*fault, ExitCode::Usage);
    m_edits.emplace_back(row, std::move(value));
}

bool OptionEdits::has(std::string_view name) const {
    return std::ranges::any_of(m_edits, [&](const auto& e) { return e.first->name == name; });
}

void OptionEdits::apply(Options& to) const {
    for (const auto& [row, value] : m_edits)
        row->put(to, value);
}

} // namespace kanuka::scene
