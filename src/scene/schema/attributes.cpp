#include "scene/schema/attributes.h"

namespace kanuka::scene {

namespace {

using A = Attributes;

template <auto... Path>
constexpr auto at = At<Path...>::template in<Attributes>();
template <auto... Members>
constexpr auto together = Together<Members...>::template in<Attributes>();

// clang-format off
const AttributeParameter Rows[] = {
    {{.name = "name", .rib = "identifier:name", .flag = "", .about = "of the primitives that follow"},
     at<&A::name>},
    {{.name = "visible_camera", .rib = "visibility:camera", .flag = "", .about = "the camera sees it"},
     at<&A::visible_camera>},
    {{.name = "displacement_bound", .rib = "displacementbound:sphere", .flag = "",
      .about = "how far displacement goes at most", .range = NotNegative},
     at<&A::displacement_bound>},
    {{.name = "displacement_bound_space", .rib = "displacementbound:coordinatesystem", .flag = "",
      .about = "the space that the bound is measured in"},
     at<&A::displacement_bound_space>},
    {{.name = "dice_flatness", .rib = "kanuka:diceflatness dice:flatness", .flag = "",
      .about = "off: traced geometry is as dense as shading"},
     at<&A::dice_flatness>},
    {{.name = "shadow_terminator", .rib = "kanuka:shadowterminator", .flag = "",
      .about = "off: coarse polygons with smooth normals hide light as the facets they are; on: as the curved "
               "surface that they stand for"},
     at<&A::shadow_terminator>},
    {{.name = "density_primvar", .rib = "kanuka:densityprimvar", .flag = "",
      .about = "of a Volume: the primvar that says how thick it is here and there"},
     at<&A::density_primvar>},
    {{.name = "color_spectrum", .rib = "color:spectrum", .flag = "",
      .about = "a measured spectrum in place of the colour, until the next Color", .spectrum = true},
     at<&A::color_spectrum>},
    {{.name = "lights_only", .rib = "lighting:subset", .flag = "",
      .about = "lights, by name or group, that alone shine on it; none = all", .links = true},
     at<&A::lights_only>},
    {{.name = "lights_off", .rib = "lighting:excludesubset", .flag = "",
      .about = "lights, by name or group, that do not shine on it", .links = true},
     at<&A::lights_off>},
    {{.name = "shadows_off", .rib = "shadow:excludesubset", .flag = "",
      .about = "lights, by name or group, that shine through it", .links = true},
     at<&A::shadows_off>},
    {{.name = "casts_shadows", .rib = "kanuka:castsshadows", .flag = "", .about = "off: all lights shine through it", .links = true},
     at<&A::casts_shadows>},
    {{.name = "area_light_by_intensity", .rib = "kanuka:arealightbyintensity", .flag = "",
      .about = "on: an AreaLightSource \"arealight\" shines with a radiance of pi times its intensity over its area, as "
               "BMRT's does; off: with its intensity"},
     at<&A::area_light_by_intensity>},
    {{.name = "level", .rib = "", .flag = "",
      .about = "of the paths' numbers from 0 to 1 those that meet it: a level of detail in transition", .range = {0, 1}},
     together<&A::level_from, &A::level_to>},
    {{.name = "variants", .rib = "instance:variants", .flag = "",
      .about = "of a primitive that is instanced: how many times its surface is shaded, with the variable \"variant\" from 0 on, "
               "for instances to show or to blend", .range = {1, 64}},
     at<&A::variants>},
};
// clang-format on

} // namespace

std::span<const AttributeParameter> attribute_parameters() {
    return Rows;
}
const AttributeParameter* find_attribute(std::string_view name) {
    return find_parameter(attribute_parameters(), name);
}
const AttributeParameter* find_rib_attribute(std::string_view rib_name) {
    return find_rib_parameter(attribute_parameters(), rib_name);
}

} // namespace kanuka::scene
