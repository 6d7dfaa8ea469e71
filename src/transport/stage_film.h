// Occlude: shadow rays, whose light then counts. Finish: spectra to the sensor's values, and those to the
// pixels.
#pragma once

#include "transport/kernel.h"
#include "transport/stage_intersect.h"

namespace kanuka::transport {

template <int W>
void occlude(const SceneView& scene, BatchState& batch, const ShadowState& shadows, int count) {
    for (int first = 0; first < count; first += W) {
        bvh::RayPacket<W> rays;
        for (int c = 0; c < 3; c++) {
            rays.o[c] = Float<W>::load(shadows.o[c] + first);
            rays.d[c] = Float<W>::load(shadows.d[c] + first);
        }
        rays.t_max = Float<W>::load(shadows.t_max + first);
        rays.active = Int<W>::lane_index() + Int<W>(first) < Int<W>(count);
        rays.seed = Int<W>::load(shadows.seed + first);
        if (scene.shadow_linked)
            rays.passes = Int<W>::load(shadows.passes + first);
        const Mask<W> lit = rays.active & !scene.bvh->occluded(rays);
        Spectrum<W> contribution;
        for (int k = 0; k < Wavelengths; k++)
            contribution[k] = Float<W>::load(shadows.contribution[k] + first);
        add_radiance(batch, Int<W>::load(shadows.path + first), contribution, lit);
    }
}

// Linear Rec.709 from XYZ whose white is D65 (IEC 61966-2-1).
struct RgbFromXyz {
    float m[9];
};

template <int W>
void sensor(const SceneView& scene, const BatchState& batch, int first, const Lane<float>* spectrum,
            bool times_d65, float scale, Float<W> rgb[3], const RgbFromXyz& matrix) {
    using F = Float<W>;
    F xyz[3] = {F(0.0f), F(0.0f), F(0.0f)};
    for (int k = 0; k < Wavelengths; k++) {
        const F l = F::load(batch.l[k] + first);
        F s = F::load(spectrum[k] + first) * F::load(batch.inv_pdf[k] + first) * F(scale * 470.0f);
        if (times_d65)
            s *= lookup_1nm(scene.wavelengths.lookup_d65, l);
        for (int c = 0; c < 3; c++)
            xyz[c] = fma(s, lookup_1nm(scene.wavelengths.lookup_cmf[c], l), xyz[c]);
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = fma(F(matrix.m[3 * c]), xyz[0],
                     fma(F(matrix.m[3 * c + 1]), xyz[1], F(matrix.m[3 * c + 2]) * xyz[2]));
}

template <int W>
void finish(const SceneView& scene, const BatchState& batch, int count, const BatchRequest& request,
            const RgbFromXyz& matrix, BatchCounts& counts) {
    const int width = request.x1 - request.x0;
    for (int first = 0; first < count; first += W) {
        Float<W> rgb[3], albedo[3];
        // Radiance contributions are divided by the sum over wavelengths already; albedos are a mean of four.
        sensor(scene, batch, first, batch.radiance, false, 1.0f, rgb, matrix);
        sensor(scene, batch, first, batch.albedo, true, 1.0f / Wavelengths, albedo, matrix);
        for (int i = 0; i < W && first + i < count; i++) {
            const int path = first + i, x = request.x0 + path % width, y = request.y0 + path / width;
            PixelSums& p = request.pixels[size_t(y) * request.stride + x];
            const float w = batch.filter_weight[path], hit = batch.hit[path];
            if (std::isfinite(rgb[0].v[i]) && std::isfinite(rgb[1].v[i]) && std::isfinite(rgb[2].v[i])) {
                for (int c = 0; c < 3; c++)
                    p.rgb[c] += w * rgb[c].v[i];
            } else if (counts.nan_samples++ == 0) {
                counts.nan_x = x;
                counts.nan_y = y;
            }
            p.alpha += w * batch.alpha[path];
            p.hits += hit;
            p.weight += w;
            const auto finite = [](float x) { return std::isfinite(x) ? x : 0.0f; };
            p.depth += finite(hit * batch.depth[path]);
            for (int c = 0; c < 3; c++) {
                p.albedo[c] += finite(w * albedo[c].v[i]);
                p.normal[c] += finite(hit * batch.normal[c][path]);
                p.position[c] += finite(hit * batch.position[c][path]);
            }
            if (request.progression == 0)
                p.id = float(batch.id[path]);
        }
    }
    counts.paths += uint64_t(count);
}

} // namespace kanuka::transport
