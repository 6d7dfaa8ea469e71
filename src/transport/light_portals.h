// Portals: rectangles before windows that the environments' light comes through. Where a scene has some,
// light sampling looks for the environments through them alone: a portal by the solid angle that it fills,
// then a direction even over it. All that light sampling does not find there has the density 0, and the
// weight 1 for directions of the material: nothing is lost, whatever the portals leave out, and nothing
// counts twice where they overlap.
#pragma once

#include "transport/light_shapes.h"

namespace kanuka::transport {

// What comes from where nothing is, along d; `set`: of the receiver, for light linking.
template <int W>
Spectrum<W> environment_radiance(const SceneView& scene, const Vec3<Float<W>>& d, Int<W> set,
                                 const Float<W> l[Wavelengths]) {
    Spectrum<W> sum(Float<W>(0.0f));
    const auto shines = [&](int32_t sets) { return (set & Int<W>(sets)) != Int<W>(0); };
    if (scene.lights.constant.present)
        sum = bsdf::select(shines(scene.lights.constant.sets),
                           emission_spectrum(scene, scene.lights.constant.c, l), sum);
    if (scene.lights.map.width > 0) {
        const EnvironmentMap& map = scene.lights.map;
        const MapCell<W> c(map, map_place(map, d));
        sum += bsdf::select(shines(map.sets), map_radiance(scene, MapTexels<W>(map, c), c, l),
                            Spectrum<W>(Float<W>(0.0f)));
    }
    return sum;
}

template <int W>
class PortalChooser {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using A = AnalyticLight;

  public:
    PortalChooser(const SceneView& scene, const V& P, Mask<W> m)
        : m_portals(scene.lights.portals), m_P(P), m_active(m) {
        for (int k = 0; k < count(); k++)
            m_total += size(k);
    }

    // Density of a direction over solid angle: 0 where it leads through none.
    F pdf(const V& wi) const { return pdf(wi, I(-1), F(0.0f)); }

    // Fills in all of a sample but its radiance.
    void sample(F u0, F u1, LightSample<W>& s) const {
        const F target = u0 * m_total;
        F before(0.0f), from(0.0f), share(1.0f);
        I chosen(-1);
        Mask<W> open = m_active & (m_total > F(0.0f));
        for (int k = 0; k < count() && any(open); k++) {
            const F part = size(k), to = before + part;
            // The last one with a share takes what rounding leaves.
            const Mask<W> here = open & (part > F(0.0f)) & ((target < to) | (to >= m_total));
            chosen = select(here, I(k), chosen);
            from = select(here, before, from);
            share = select(here, part, share);
            before = to;
            open &= !here;
        }
        const Mask<W> m = m_active & (chosen >= I(0));
        const F within = clamp((target - from) / share, F(0.0f), F(0.99999994f));
        const LightLanes<W> light(m_portals, select(m, chosen, I(0)));
        const LightPoint<W> point = sample_shape(A::Quad, light, m_P, within, u1, m);
        s.wi = select(m_active, select(m, point.wi, V(F(0.0f), F(0.0f), F(1.0f))), s.wi);
        s.pdf_solid_angle = select(m_active, pdf(s.wi, chosen, point.pdf_solid_angle), s.pdf_solid_angle);
        s.valid &= (m & point.valid & (s.pdf_solid_angle > F(0.0f))) | !m_active;
    }

  private:
    int count() const { return int(m_portals.size()); }
    LightLanes<W> portal(int k) const { return {m_portals, I(k)}; }

    // The solid angle that a portal fills; nearly, where that is little.
    F size(int k) const {
        const LightLanes<W> light = portal(k);
        const QuadView<W> view(light, m_P, m_active);
        const F x = F(0.5f) * (view.x0 + view.x1), y = F(0.5f) * (view.y0 + view.y1), z = view.z0;
        const F d2 = max(fma(x, x, fma(y, y, z * z)), F(1e-20f));
        const F little = light.get(&A::area) * -z / (d2 * sqrt(d2));
        return select(view.wide, view.solid_angle, select(view.faces, little, F(0.0f)));
    }
    // `sampled`: where the direction is a sample of that portal, which has this density there.
    F pdf(const V& wi, I sampled, F density) const {
        F sum(0.0f);
        for (int k = 0; k < count(); k++) {
            const LightPoint<W> hit = intersect_shape(A::Quad, portal(k), m_P, wi, m_active);
            const Mask<W> own = sampled == I(k);
            if (any(hit.valid | own))
                sum += select(hit.valid | own, size(k) * select(own, density, hit.pdf_solid_angle), F(0.0f));
        }
        return select(m_total > F(0.0f), sum / max(m_total, F(1e-30f)), F(0.0f));
    }

    std::span<const AnalyticLight> m_portals;
    const V m_P;
    const Mask<W> m_active;
    F m_total{0.0f};
};

} // namespace kanuka::transport
