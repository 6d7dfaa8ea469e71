// Light shaders to analytic lights.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "color/palette.h"
#include "scene/schema/lights.h"
#include "shade/textures.h"

namespace kanuka::shade {

// The unit of light shaders: a white matte surface that faces their Cl shows Cl (RISpec 3.2, section 12.6:
// diffuse() multiplies Cl by the cosine alone). It reflects radiance E / pi, so an irradiance is this times
// Cl, and a radiant intensity this times `intensity`; what has a unit, and all lights from Python, are
// radiometric as they are.
inline constexpr float IrradianceOfCl = Pi;

// True for the standard light shaders, which are analytic.
bool is_standard_light(std::string_view name);
// Of RISpec's four kinds and without an extent.
bool is_classic_light(const scene::ShaderRef& ref);
// `shader`: the one that the scene brings, null if it is built in.
bool casts_shadows(const scene::ShaderRef& ref, const sl::Shader* shader);
// What stands in for a light shader that is not found in `searched`. Reported, with what there is.
std::optional<scene::Light> make_stand_in(const scene::ShaderRef& ref, const std::string& searched,
                                          const Textures& textures, Journal& journal);

// A rotation and a place: +z along `direction`, +y as far to `up` as that allows; to `other` where they are
// parallel.
Transform frame_of(const Vec3f& origin, const Vec3f& direction, const Vec3f& up, const Vec3f& other);
// That of RISpec's lights: +z towards `to`, all in one space.
Transform aimed(const Vec3f& from, const Vec3f& to);

// With what its kind computes: skies and suns, falloffs. `sun`: towards it; the zenith is +z.
scene::Light finished_light(const scene::LightKind& kind, const scene::LightSettings& settings,
                            const Vec3f& sun);
// One of the standard light shaders by name; null for others.
std::optional<scene::Light> make_light(const scene::ShaderRef& ref, const Textures& textures,
                                       Journal& journal);

// Replaces names of pictures and profiles by the files that they are found in; one that is missing is
// reported and left out.
void find_light_files(scene::Light& light, const Textures& textures, Journal& journal);

// Parameters of light shaders: intensity times lightcolor.
Rgb light_amount(const scene::ShaderRef& ref);
// Radiance of an area light; where it has a unit, the amount in it, watt as lumen.
Rgb area_light_amount(const scene::ShaderRef& ref, color::Palette* palette,
                      std::span<const std::string> folders, Journal& journal);
// Puts a light's spectrum and unit into its amount, by the palette. What is wrong is reported, and white or
// no unit stands in for it.
void resolve_light_color(scene::Light& light, color::Palette& palette, std::span<const std::string> folders,
                         Journal& journal);

// Reports area light shaders that are not known, and parameters that do nothing.
void check_area_light(const scene::ShaderRef& ref, Journal& journal);

} // namespace kanuka::shade
