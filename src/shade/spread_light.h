// Light shaders that shine from a place of their own (a point light's, BMRT's uberlight), spread over a
// surface by AreaLightSource: they say how much light arrives, not what the surface sends.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/vec.h"
#include "scene/scene.h"
#include "sl/sl.h"

namespace kanuka::shade {

// The surfaces of one AreaLightSource, in pieces, in world space.
struct Spread {
    struct Piece {
        Vec3f middle, area; // area: along the normal
    };
    std::vector<Piece> pieces;
    Vec3f middle{0, 0, 0};
    float area = 0;
};

// An "arealight" whose Cl falls off by the square of the distance, as BMRT's does: its radiance is pi times
// the intensity, over the area.
bool shines_by_intensity(const scene::Attributes& attributes);

// By spread_key(); those that are not Kanuka's "arealight" and not in objects. `lit`: the middle of all else.
std::map<std::string, Spread> spread_lights(const scene::Scene& scene, Vec3f& lit);
std::string spread_key(const scene::ShaderRef& light);

// The radiance all over the surface that makes arrive at `lit` what the shader says there, on average over
// the surface: L = pi Cl d^2 / A, where A is the area as seen from there. Nothing where the shader's place is
// that of the surface: its Cl is a radiance (area_light.h). All in current space; `shader` was compiled for
// an area. The answer's Cl is that radiance, its cone the shader's.
std::optional<sl::Emission> spread_radiance(const sl::Instance& shader, const Spread& spread,
                                            const Transform& current_from_world, const Vec3f& lit,
                                            sl::Services& services);

} // namespace kanuka::shade
