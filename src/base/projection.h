// How cameras map film to directions. Film coordinates are in units of the picture's half side that `fov`
// spans (perspective: times its tangent; orthographic: camera units), y up; camera space is RISpec's: x
// right, y up, z into the picture.
#pragma once

#include <optional>
#include <string_view>

#include "base/lanes_math.h"
#include "base/vec.h"

namespace kanuka {

enum class Projection : uint8_t {
    Perspective,
    Orthographic,
    Fisheye,   // equidistant: the angle from the axis is proportional to the distance from the centre
    Equisolid, // fisheye whose pixels span equal solid angles: sin(angle / 2) is proportional to the distance
    Spherical, // latitude and longitude: the whole sphere, forward in the middle
};

struct ProjectionKind {
    Projection projection;
    std::string_view name;
    float largest_fov; // degrees; 0 = has none
    std::string_view note;
};
inline constexpr ProjectionKind Projections[] = {
    {Projection::Perspective, "perspective", 179.9f, "straight lines stay straight"},
    {Projection::Orthographic, "orthographic", 0, "parallel rays"},
    {Projection::Fisheye, "fisheye", 360, "angle proportional to the distance from the centre"},
    {Projection::Equisolid, "equisolid", 360, "fisheye with equal solid angles a pixel"},
    {Projection::Spherical, "spherical", 0, "latitude and longitude, 360 by 180 degrees"},
};
inline constexpr const ProjectionKind& kind_of(Projection p) {
    return Projections[size_t(p)];
}
inline std::optional<Projection> projection_by_name(std::string_view name) {
    for (const ProjectionKind& k : Projections)
        if (k.name == name)
            return k.projection;
    return std::nullopt;
}
// "perspective, orthographic, …"
template <class String>
String projection_names(std::string_view separator) {
    String s;
    for (const ProjectionKind& k : Projections)
        s += (s.empty() ? String() : String(separator)) + String(k.name);
    return s;
}

inline constexpr bool is_fisheye(Projection p) {
    return p == Projection::Fisheye || p == Projection::Equisolid;
}

// The direction in which a film point looks, of unit length but for perspective, where z = 1; false where a
// fisheye's image circle has ended. `half_angle` is half the field of view of fisheyes, in radians. Not for
// orthographic cameras.
template <int W>
Mask<W> direction_of_film(Projection projection, float half_angle, Float<W> x, Float<W> y,
                          Vec3<Float<W>>& d) {
    using F = Float<W>;
    const F one(1.0f);
    switch (projection) {
    case Projection::Fisheye:
    case Projection::Equisolid: {
        const F r = sqrt(fma(x, x, y * y));
        F sine, cosine;
        if (projection == Projection::Fisheye) {
            sincos_2pi(min(r * F(half_angle * (0.5f * InvPi)), F(0.5f)), sine, cosine);
        } else {
            const F s = min(r * F(std::sin(0.5f * half_angle)), one); // of half the angle
            sine = F(2.0f) * s * sqrt(max(one - s * s, F(0.0f)));
            cosine = fma(F(-2.0f) * s, s, one);
        }
        const F scale = sine / max(r, F(1e-20f));
        d = {x * scale, y * scale, cosine};
        return r <= one;
    }
    case Projection::Spherical: {
        const auto turn = [](F t) { return t - floor(t); };
        F sin_lon, cos_lon, sin_lat, cos_lat;
        sincos_2pi(turn(x * F(0.5f)), sin_lon, cos_lon);
        sincos_2pi(turn(y * F(0.25f)), sin_lat, cos_lat); // beyond a pole it goes down on the other side
        d = {sin_lon * cos_lat, sin_lat, cos_lon * cos_lat};
        break;
    }
    default:
        d = {x, y, one};
    }
    return one > F(0.0f);
}

// Film units that a small angle spans at the centre.
inline float film_per_radian(Projection projection, float half_angle) {
    if (projection == Projection::Fisheye)
        return 1 / half_angle;
    if (projection == Projection::Equisolid)
        return 0.5f / std::sin(0.5f * half_angle);
    return 1; // perspective: of tangent; orthographic: of camera space
}

} // namespace kanuka
