// Occlude: shadow rays, whose light then counts. Finish: spectra to the sensor's values, and those to the
// pixels.
#pragma once

#include "transport/kernel.h"
#include "transport/stage_transmittance.h"

namespace kanuka::transport {

// Which rays get through, and how what they pass colours their light.
template <int W>
[[gnu::noinline]] Mask<W> occlude_tinted(const SceneView& scene, const BatchState& batch,
                                         bvh::RayPacket<W>& rays, Int<W> path, Spectrum<W>& contribution) {
    const Passages<W> passages(rays);
    const Mask<W> lit = rays.active & !scene.geometry.ray_query.occluded(rays);
    const auto l = load_rows<4>(batch.l, select(rays.active, path, Int<W>(0)) << 2);
    contribution = contribution * passages.before(scene, rays.t_max, l.data());
    return lit;
}

template <int W>
void occlude(const SceneView& scene, BatchState& batch, const RayQueue& shadows, WallScratch* walls) {
    if (scene.media.tracked)
        return occlude_in_media<W>(scene, batch, shadows, walls);
    const int count = shadows.count;
    for (int first = 0; first < count; first += W) {
        bvh::RayPacket<W> rays;
        for (int c = 0; c < 3; c++) {
            rays.o[c] = Float<W>::load(shadows.o[c] + first);
            rays.d[c] = Float<W>::load(shadows.d[c] + first);
        }
        rays.t_max = Float<W>::load(shadows.t_max + first);
        rays.active = Int<W>::lane_index() + Int<W>(first) < Int<W>(count);
        rays.seed = Int<W>::load(shadows.seed + first);
        if (scene.geometry.moving)
            rays.time =
                gather(batch.time, select(rays.active, Int<W>::load(shadows.path + first), Int<W>(0)));
        if (scene.geometry.fades)
            rays.level =
                gather(batch.level, select(rays.active, Int<W>::load(shadows.path + first), Int<W>(0)));
        if (scene.lights.shadow_linked)
            rays.passes = Int<W>::load(shadows.passes + first);
        Spectrum<W> contribution;
        for (int k = 0; k < Wavelengths; k++)
            contribution[k] = Float<W>::load(shadows.contribution[k] + first);
        const Int<W> path = Int<W>::load(shadows.path + first);
        Mask<W> lit(false);
        if (scene.geometry.tinted)
            lit = occlude_tinted(scene, batch, rays, path, contribution);
        else
            lit = rays.active & !scene.geometry.ray_query.occluded(rays);
        add_shadow_radiance(scene, batch, path, contribution, lit);
    }
}

// Rec.709's, of any linear RGB: it tells bright from dark.
inline float luminance(float r, float g, float b) {
    return 0.2126f * r + 0.7152f * g + 0.0722f * b;
}

template <int W>
void finish(const SceneView& scene, const BatchState& batch, int count, const BatchRequest& request,
            BatchCounts& counts) {
    using F = Float<W>;
    using I = Int<W>;
    const int width = request.x1 - request.x0;
    const bool weighted = scene.camera.filter.weighted();
    for (int first = 0; first < count; first += W) {
        const I path = I::lane_index() + I(first);
        const auto l = load_rows<4>(batch.l, path << 2), radiance = load_rows<4>(batch.radiance, path << 2);
        const auto albedos = load_rows<4>(batch.first, path << 4);
        // Radiance contributions are divided by the sum over wavelengths already; albedos are a mean of four,
        // seen under white.
        F sensed[2][3] = {{F(0.0f), F(0.0f), F(0.0f)}, {F(0.0f), F(0.0f), F(0.0f)}};
        for (size_t k = 0; k < Wavelengths; k++) {
            const F x = l[k] * F(470.0f);
            const I i = min(to_int(x), I(469));
            const F f = x - F(i);
            // Sensor and white at the knots before and after.
            const auto knots = load_rows<8>(scene.spectra.sensor.data(), i << 2);
            const auto at = [&](size_t c) { return fma(f, knots[c + 4] - knots[c], knots[c]); };
            const F unit = F::load(batch.inv_pdf[k] + first) * F(470.0f);
            const F light = radiance[k] * unit, seen = albedos[k] * unit * at(3) * F(1.0f / Wavelengths);
            for (size_t c = 0; c < 3; c++) {
                const F response = at(c);
                sensed[0][c] = fma(light, response, sensed[0][c]);
                sensed[1][c] = fma(seen, response, sensed[1][c]);
            }
        }
        const auto to_rgb = [&](const F* v, int c) {
            return fma(F(scene.spectra.sensor_matrix[3 * c]), v[0],
                       fma(F(scene.spectra.sensor_matrix[3 * c + 1]), v[1],
                           F(scene.spectra.sensor_matrix[3 * c + 2]) * v[2]));
        };
        const F rgb[3] = {to_rgb(sensed[0], 0), to_rgb(sensed[0], 1), to_rgb(sensed[0], 2)},
                albedo[3] = {to_rgb(sensed[1], 0), to_rgb(sensed[1], 1), to_rgb(sensed[1], 2)};
        for (int i = 0; i < W && first + i < count; i++) {
            const int at = first + i, x = request.x0 + at % width, y = request.y0 + at / width;
            PixelSums& p = request.pixels[size_t(y) * request.stride + x];
            const float* hit = batch.first[at];
            const float w = batch.filter_weight[at], surface = hit[BatchState::Hit];
            if (request.progression == 0) {
                int32_t id;
                std::memcpy(&id, hit + BatchState::Id, sizeof id);
                p.id = float(id);
            }
            // A sample that is no number is as if it had not been taken: a black one in its place would
            // darken the picture.
            const float v[3] = {rgb[0].v[i], rgb[1].v[i], rgb[2].v[i]};
            if (!std::isfinite(v[0] + v[1] + v[2])) {
                if (counts.nan_samples++ == 0)
                    counts.nan_x = x, counts.nan_y = y;
                p.dropped++;
                continue;
            }
            if (request.progression >= Firefly::FirstLooked && p.weight > 0) {
                const Firefly f{x, y, request.progression, luminance(v[0], v[1], v[2]),
                                std::max(luminance(p.rgb[0], p.rgb[1], p.rgb[2]) / p.weight, 0.0f)};
                if (f.luminance > Firefly::Factor * (f.mean + 0.01f)) {
                    counts.fireflies++;
                    counts.note(f);
                }
            }
            for (int c = 0; c < 3; c++)
                p.rgb[c] += w * v[c];
            if (weighted)
                for (int c = 0; c < 3; c++)
                    p.plain[c] += v[c];
            p.alpha += w * hit[BatchState::Alpha];
            if (weighted)
                p.plain[3] += hit[BatchState::Alpha];
            p.hits += surface;
            p.weight += w;
            const auto finite = [](float x) { return std::isfinite(x) ? x : 0.0f; };
            p.depth += finite(surface * hit[BatchState::Depth]);
            for (int c = 0; c < 3; c++) {
                p.albedo[c] += finite(w * albedo[c].v[i]);
                p.normal[c] += finite(surface * hit[BatchState::Normal + c]);
                p.position[c] += finite(surface * hit[BatchState::Position + c]);
            }
            for (size_t a = 0; a < scene.settings.aov_is_color.size(); a++) {
                const float value = batch.aovs[a * BatchPadded + size_t(at)];
                request.aovs[(size_t(y) * size_t(request.stride) + size_t(x)) *
                                 scene.settings.aov_is_color.size() +
                             a] += finite((scene.settings.aov_is_color[a] ? w : surface) * value);
            }
        }
    }
    counts.paths += uint64_t(count);
}

} // namespace kanuka::transport
