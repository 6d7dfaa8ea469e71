#include "shade/point_lights.h"

#include <algorithm>
#include <cmath>

#include "shade/spaces.h"

namespace kanuka::shade {

namespace {

struct Lit {
    Vec3f L{0, 0, 0}, Cl{0, 0, 0};
};

// RISpec 3.2, appendix A.3. Amounts are pi times Cl: shade/lights.cpp.
Lit standard(const scene::Light& light, const Vec3f& P) {
    using Kind = scene::Light::Kind;
    const Vec3f axis = normalize(light.world_from_light.vector({0, 0, 1}));
    const Vec3f Cl = light.amount * InvPi;
    if (light.kind == Kind::Distant)
        return {-axis, Cl};
    const Vec3f L = light.world_from_light.point({0, 0, 0}) - P;
    const float distance = std::max(length(L), 1e-12f);
    float strength = std::pow(distance, -float(light.table ? light.table->falloff : 2));
    if (light.kind == Kind::Spot) {
        constexpr float Degrees = Pi / 180;
        const float cosine = -dot(L, axis) / distance, outer = std::cos(light.cone_angle * Degrees),
                    inner = std::cos((light.cone_angle - light.cone_delta_angle) * Degrees);
        const float t = cosine < outer ? 0 : cosine >= inner ? 1 : (cosine - outer) / (inner - outer);
        strength *= t * t * (3 - 2 * t) * std::pow(std::max(cosine, 0.0f), light.beam_distribution);
    }
    return {L, Cl * strength};
}

} // namespace

const std::vector<PointLights::One>& PointLights::all() const {
    std::call_once(m_made, [this] { m_all = m_make(); });
    return m_all;
}

bool PointLights::at(const sl::LightRequest& q, const Transform& current_from_world) const {
    const One& one = all()[size_t(q.light)];
    const Transform world_from_current = inverse_or_identity(current_from_world);
    grid::Grid points; // no neighbours: what the shader looks up is not filtered
    points.allocate(std::max(q.count - 1, 0), 0);
    const size_t stride = size_t(points.stride);
    for (int i = 0; i < q.count; i++) {
        const Vec3f p = world_from_current.point({q.P[0][i], q.P[1][i], q.P[2][i]});
        for (int c = 0; c < 3; c++)
            points.P[size_t(c) * stride + size_t(i)] = p[c];
    }
    sl::Emission emission;
    if (one.shader)
        emission = one.shader(points);
    for (int i = 0; i < q.count; i++) {
        const auto triple = [&](const std::vector<float>& v) {
            return Vec3f(v[size_t(i)], v[stride + size_t(i)], v[2 * stride + size_t(i)]);
        };
        const Vec3f p = triple(points.P);
        Lit lit;
        if (!one.shader)
            lit = standard(one.light, p);
        else if (emission.form == sl::Emission::Illuminate)
            lit = {emission.from - p, triple(emission.Cl)};
        else if (emission.form == sl::Emission::Solar)
            lit = {-normalize(emission.axis), triple(emission.Cl)};
        const Vec3f L = current_from_world.vector(lit.L);
        for (int c = 0; c < 3; c++) {
            q.L[c][i] = L[c];
            q.Cl[c][i] = std::isfinite(lit.Cl[c]) ? lit.Cl[c] : 0;
        }
    }
    return one.shader ? emission.form != sl::Emission::Illuminate
                      : one.light.kind == scene::Light::Kind::Distant;
}

} // namespace kanuka::shade
