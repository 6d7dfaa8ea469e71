// Coloured opacity (RISpec's Oi): rays pass a surface as often as its presence leaves, and what they then see
// is coloured. Of each colour c, Oi_c of the light comes from the surface and 1 - Oi_c passes it; a ray stops
// with the chance p, so that its light counts Oi_c / p, or (1 - Oi_c) / (1 - p). Used where
// GeometryView::tinted.
#pragma once

#include "transport/light_environment.h"

namespace kanuka::transport {

// A factor of light that may be above one.
template <int W>
Spectrum<W> tint(const SceneView& scene, const Vec3<Float<W>>& rgb, const Float<W> l[Wavelengths]) {
    using F = Float<W>;
    // Twice the largest component, to stay where spectra are smooth, as encode.cpp has it.
    const F scale = max(max(max(rgb.x, rgb.y), rgb.z) * F(2.0f), F(1e-20f));
    F c0, c1, c2;
    bsdf::uplift(scene.spectra.uplift, rgb * (F(1.0f) / scale), c0, c1, c2);
    return bsdf::sigmoid_spectrum(c0, c1, c2, l) * scale;
}

template <int W>
class Passages {
  public:
    // Of what the rays pass from now on; must outlive their query.
    void note(bvh::RayPacket<W>& rays) {
        forget();
        rays.passages = m_of_lane;
    }
    void forget() {
        for (bvh::LetThrough& p : m_of_lane)
            p.count = 0;
    }
    // Of all that was passed before `end`; one for lanes that passed nothing.
    Spectrum<W> before(const SceneView& scene, Float<W> end, const Float<W> l[Wavelengths]) const {
        Vec3<Float<W>> rgb(Float<W>(1.0f), Float<W>(1.0f), Float<W>(1.0f));
        Mask<W> passed(false);
        for (int i = 0; i < W; i++) {
            if (m_of_lane[i].count == 0)
                continue;
            passed |= Int<W>::lane_index() == Int<W>(i);
            const Rgb part = m_of_lane[i].before(end[i]);
            for (int c = 0; c < 3; c++)
                rgb[c].v[i] = part[c];
        }
        const Spectrum<W> one(Float<W>(1.0f));
        return any(passed) ? bsdf::select(passed, tint(scene, rgb, l), one) : one;
    }

  private:
    bvh::LetThrough m_of_lane[W];
};

} // namespace kanuka::transport
