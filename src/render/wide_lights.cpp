#include "render/wide_lights.h"

#include <algorithm>
#include <cmath>

#include "transport/lights.h"

namespace kanuka::render {

using namespace transport;
using F = Float<1>;
using I = Int<1>;
using V = Vec3<F>;
using A = AnalyticLight;

namespace {

Vec3f plain(const V& v) {
    return {v.x[0], v.y[0], v.z[0]};
}
V lane(const Vec3f& v) {
    return V(F(v.x), F(v.y), F(v.z));
}
Vec3f anywhere(float u0, float u1) {
    const float z = 1 - 2 * u0, r = std::sqrt(std::max(1 - z * z, 0.0f)), phi = 2 * Pi * u1;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

} // namespace

WideLights::WideLights(const SceneView& view, const std::vector<scene::Light>& lights) : m_view(view) {
    using Of = scene::Light::Kind;
    for (size_t k = 0; k < view.lights.analytic.size(); k++) {
        const A& light = view.lights.analytic[k];
        const Of of = lights[size_t(light.source)].kind;
        if (light.shape >= A::Quad && of != Of::Point && of != Of::Spot) // those are told of as points
            m_kinds.push_back({Kind::Analytic, int(k), rgb_of(light.c)});
    }
    if (view.lights.constant.present)
        m_kinds.push_back({Kind::Constant, 0, rgb_of(view.lights.constant.c)});
    if (view.lights.map.width > 0)
        m_kinds.push_back({Kind::Picture, 0, Rgb(0)});
    find_surfaces();
    if (!m_triangles.empty())
        m_kinds.push_back({Kind::Surfaces, 0, Rgb(0)});
}

Rgb WideLights::rgb_of(const float c[4]) const {
    double sensed[3] = {0, 0, 0};
    for (int i = 0; i <= 470; i++) {
        const float u = float(i) / 470;
        const F l[4] = {F(u), F(u), F(u), F(u)};
        const float light = emission_spectrum(m_view, c, l)[0][0];
        for (size_t k = 0; k < 3; k++)
            sensed[k] += double(light * m_view.spectra.sensor[4 * i + k]);
    }
    Rgb rgb;
    for (int k = 0; k < 3; k++)
        rgb[k] = std::max(0.0f, m_view.spectra.sensor_matrix[3 * k] * float(sensed[0]) +
                                    m_view.spectra.sensor_matrix[3 * k + 1] * float(sensed[1]) +
                                    m_view.spectra.sensor_matrix[3 * k + 2] * float(sensed[2]));
    return rgb;
}

// By their power, places counted.
void WideLights::find_surfaces() {
    double sum = 0;
    const float* last = nullptr;
    Rgb rgb(0);
    for (int slot = 0; slot < m_view.lights.slots.count; slot++) {
        const bool world = slot < m_view.lights.slots.in_world;
        const int emitter = world ? m_view.lights.slots.first_emitter + slot
                                  : m_view.lights.slots.emitter[size_t(slot - m_view.lights.slots.in_world)],
                  placement =
                      world ? -1 : m_view.lights.slots.placement[size_t(slot - m_view.lights.slots.in_world)];
        const store::Emitter& e = m_view.geometry.emitters[emitter];
        if (!(e.power > 0) || !std::isfinite(e.power))
            continue;
        const float c[4] = {e.c0, e.c1, e.c2, e.scale};
        if (!last || !std::equal(c, c + 4, last)) // neighbours mostly shine alike
            rgb = rgb_of(c);
        last = &e.c0;
        const EmitterLanes<1> at(m_view, I(emitter), I(placement));
        const double area = 0.5 * double(length(plain(at.n)));
        sum += area * double(std::max({rgb.x, rgb.y, rgb.z}));
        m_triangles.push_back({emitter, placement, rgb, sum});
    }
    if (!(sum > 0))
        m_triangles.clear();
}

WideLights::Sample WideLights::sample(int light, const Vec3f& P, float u0, float u1) const {
    const Kind& kind = m_kinds[size_t(light)];
    switch (kind.what) {
    case Kind::Analytic:
        return of_analytic(kind, P, u0, u1);
    case Kind::Surfaces:
        return of_surfaces(P, u0, u1);
    case Kind::Picture:
        return of_picture(u0, u1);
    default: // pi Cl is the irradiance: 4 pi times the radiance of one direction
        return {anywhere(u0, u1), kind.rgb * 4, true};
    }
}

WideLights::Sample WideLights::of_analytic(const Kind& kind, const Vec3f& P, float u0, float u1) const {
    const A& light = m_view.lights.analytic[size_t(kind.index)];
    const F l[4] = {F(m_wavelengths[0]), F(m_wavelengths[1]), F(m_wavelengths[2]), F(m_wavelengths[3])};
    LightSample<1> s{
        lane({0, 0, 1}), F(1e30f), Spectrum<1>(F(0.0f)), F(1.0f), Mask<1>(false), Mask<1>(true), I(0), I(-1)};
    sample_analytic(m_view, light.shape, I(kind.index), lane(P), I(-1), F(u0), F(u1), s, l, Mask<1>(true),
                    F(1.0f));
    if (!s.valid[0] || !(s.pdf_solid_angle[0] > 0))
        return {};
    // What its picture leaves there is taken at four wavelengths.
    const Spectrum<1> whole = emission_spectrum(m_view, light.c, l);
    float part = 0;
    for (int k = 0; k < 4; k++)
        part += 0.25f * s.radiance[k][0] / std::max(whole[k][0], 1e-30f);
    const bool shadows = light.passes != A::Shadowless;
    return {plain(s.wi) * (shadows ? s.distance[0] : 1.0f), kind.rgb * (part * InvPi / s.pdf_solid_angle[0]),
            false, shadows ? light.passes : 0, shadows};
}

WideLights::Sample WideLights::of_surfaces(const Vec3f& P, float u0, float u1) const {
    const double all = m_triangles.back().chance, at = double(u0) * all;
    const size_t k = size_t(
        std::min<ptrdiff_t>(std::upper_bound(m_triangles.begin(), m_triangles.end(), at,
                                             [](double x, const Triangle& t) { return x < t.chance; }) -
                                m_triangles.begin(),
                            ptrdiff_t(m_triangles.size()) - 1));
    const Triangle& t = m_triangles[k];
    const double before = k > 0 ? m_triangles[k - 1].chance : 0;
    float a = float(std::clamp((at - before) / std::max(t.chance - before, 1e-300), 0.0, 0.99999994)), b = u1;
    if (a + b > 1) // the unit square, folded along its diagonal
        a = 1 - a, b = 1 - b;
    const EmitterLanes<1> e(m_view, I(t.emitter), I(t.placement));
    const Vec3f n = plain(e.n), L = plain(e.p0) + plain(e.e1) * a + plain(e.e2) * b - P;
    const float d2 = dot(L, L), twice = length(n),
                facing = -dot(n, L) / (twice * std::sqrt(std::max(d2, 1e-30f)));
    if (!(facing > 1e-6f) || !(d2 > 0))
        return {};
    const float falloff = emission_falloff(e.flags, F(facing))[0];
    const double density = (t.chance - before) / all / (0.5 * double(twice)); // over area
    return {L, t.rgb * (falloff * InvPi * facing / (d2 * float(density)))};
}

// Half of the directions by the picture, as far as it is brighter than its mean, and half anywhere.
WideLights::Sample WideLights::of_picture(float u0, float u1) const {
    const EnvironmentMap& map = m_view.lights.map;
    const F l[4] = {F(m_wavelengths[0]), F(m_wavelengths[1]), F(m_wavelengths[2]), F(m_wavelengths[3])};
    const bool contrast = map.cells.rows > 0, by_picture = contrast && u0 < 0.5f;
    const float u = contrast ? (by_picture ? 2 * u0 : 2 * u0 - 1) : u0;
    Vec3f d = anywhere(u, u1);
    if (by_picture) {
        LightSample<1> s{lane({0, 0, 1}),
                         F(1e30f),
                         Spectrum<1>(F(0.0f)),
                         F(1.0f),
                         Mask<1>(false),
                         Mask<1>(true),
                         I(0),
                         I(-1)};
        sample_map(m_view, F(u), F(u1), s, l, Mask<1>(true));
        d = plain(s.wi);
    }
    const MapPlace<1> p = map_place(map, lane(d));
    const MapCell<1> cell(map, p);
    const MapTexels<1> texels(map, cell);
    const auto& t = texels.rgb;
    const Rgb rgb = plain(lerp(cell.y, lerp(cell.x, t[0][0], t[0][1]), lerp(cell.x, t[1][0], t[1][1])));
    float pdf = InvPi / 4;
    if (contrast)
        pdf = 0.5f * (pdf + map_pdf(map, texels.weights(map, cell), cell, p.sin_theta)[0]);
    return {d, rgb * (InvPi / pdf), true};
}

} // namespace kanuka::render
