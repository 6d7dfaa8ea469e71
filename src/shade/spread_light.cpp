#include "shade/spread_light.h"

#include <algorithm>
#include <cmath>

#include "geom/surface.h"
#include "scene/bounds.h"

namespace kanuka::shade {

bool shines_by_intensity(const scene::Attributes& attributes) {
    const scene::ShaderRef& light = *attributes.area_light;
    return attributes.area_light_by_intensity && light.name == "arealight" && !light.parameters.find("unit");
}

namespace {

bool is_spread(const scene::Primitive& p) {
    return p.attributes && p.attributes->area_light &&
           (p.attributes->area_light->name != "arealight" || shines_by_intensity(*p.attributes));
}

void add(Spread& spread, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3f area = cross(b - a, c - a) * 0.5f;
    if (std::isfinite(area.x + area.y + area.z) && length(area) > 0)
        spread.pieces.push_back({(a + b + c) * (1.0f / 3), area});
}

// Coarse: what counts is how large it looks from afar.
void add(Spread& spread, const scene::Primitive& primitive) {
    constexpr int Fine = 16, Many = 64;
    Journal said_later; // by who dices it
    const auto surface = geom::make_surface(primitive, primitive.world_from_object, said_later);
    if (!surface)
        return;
    const int n = surface->faces() > Many ? 2 : Fine;
    float at[Fine], xyz[3 * Fine * Fine];
    for (int i = 0; i < n; i++)
        at[i] = float(i) / float(n - 1);
    const geom::Line line{at, n};
    const auto point = [&](int i, int j) {
        const int k = j * n + i;
        return Vec3f(xyz[k], xyz[n * n + k], xyz[2 * n * n + k]);
    };
    for (int face = 0; face < surface->faces(); face++) {
        surface->positions(face, line, line, xyz, n * n);
        for (int j = 0; j + 1 < n; j++)
            for (int i = 0; i + 1 < n; i++) {
                add(spread, point(i, j), point(i + 1, j), point(i + 1, j + 1));
                add(spread, point(i, j), point(i + 1, j + 1), point(i, j + 1));
            }
    }
}

// A point at P that looks to `to`: run there, an area's shader lights exactly that place.
sl::Emission run_at(const sl::Instance& shader, const Vec3f& P, const Vec3f& to, sl::Services& services) {
    grid::Grid point;
    point.allocate(0, 0);
    const auto stride = size_t(point.stride);
    for (int c = 0; c < 3; c++)
        point.P[size_t(c) * stride] = P[c], point.N[size_t(c) * stride] = to[c] - P[c];
    sl::GridGlobals globals;
    sl::Emission e = shader.emit(point, globals, services);
    e.Cl = {e.Cl[0], e.Cl[stride], e.Cl[2 * stride]};
    return e;
}

} // namespace

std::string spread_key(const scene::ShaderRef& light) {
    return light.handle + " " + light.where.str();
}

std::map<std::string, Spread> spread_lights(const scene::Scene& scene, Vec3f& lit) {
    std::map<std::string, Spread> all;
    for (const scene::Primitive& p : scene.primitives)
        if (is_spread(p))
            add(all[spread_key(*p.attributes->area_light)], p);
    if (all.empty())
        return all;
    for (auto& [key, spread] : all) {
        for (const Spread::Piece& piece : spread.pieces) {
            spread.area += length(piece.area);
            spread.middle = spread.middle + piece.middle * length(piece.area);
        }
        if (spread.area > 0)
            spread.middle = spread.middle * (1 / spread.area);
    }
    Bounds3f bounds;
    for (const scene::Primitive& p : scene.primitives)
        if (!p.attributes || !p.attributes->area_light)
            bounds.extend(scene::world_bounds(p));
    if (!scene.instances.empty() || bounds.empty())
        bounds.extend(scene::bounds(scene));
    lit = bounds.empty() ? Vec3f(0, 0, 0) : bounds.center();
    return all;
}

std::optional<sl::Emission> spread_radiance(const sl::Instance& shader, const Spread& spread,
                                            const Transform& current_from_world, const Vec3f& lit,
                                            sl::Services& services) {
    if (!(spread.area > 0))
        return std::nullopt;
    const Vec3f middle = current_from_world.point(spread.middle), there = current_from_world.point(lit);
    const float size = std::sqrt(spread.area), distance = length(there - middle);
    if (!(distance > 1e-3f * size))
        return std::nullopt;
    sl::Emission said = run_at(shader, middle, there, services);
    const Vec3f beside(0.7f * size, 0.4f * size, -0.6f * size);
    const sl::Emission other = run_at(shader, middle + beside, there, services);
    const bool stays = said.form == sl::Emission::Illuminate && other.form == sl::Emission::Illuminate &&
                       length(other.from - said.from) < 1e-3f * size;
    if (!stays)
        return std::nullopt;
    // As large as it looks: of closed shapes the half that is turned here.
    double front = 0, back = 0;
    for (const Spread::Piece& piece : spread.pieces) {
        const Vec3f to = lit - piece.middle;
        const double a = length(to) > 0 ? double(dot(piece.area, to) / length(to)) : 0;
        (a > 0 ? front : back) += std::abs(a);
    }
    const double seen = std::max({front, back, 0.05 * double(spread.area)});
    for (float& Cl : said.Cl) {
        const double L = double(Pi) * double(Cl) * double(distance) * double(distance) / seen;
        Cl = std::isfinite(L) ? float(std::clamp(L, 0.0, 1e9)) : 0.0f;
    }
    return said;
}

} // namespace kanuka::shade
