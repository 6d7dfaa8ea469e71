// Occlude: shadow rays, whose light then counts. Finish: spectra to the sensor's values, and those to the
// pixels.
#pragma once

#include "transport/kernel.h"
#include "transport/stage_intersect.h"
#include "transport/stage_transmittance.h"

namespace kanuka::transport {

// Shadow rays from `first` on.
template <int W>
void load_shadow_rays(const SceneView& scene, const BatchState& batch, const RayQueue& shadows, int first,
                      bvh::RayPacket<W>& rays) {
    rays = {};
    for (int c = 0; c < 3; c++) {
        rays.o[c] = Float<W>::load(shadows.o[c] + first);
        rays.d[c] = Float<W>::load(shadows.d[c] + first);
    }
    rays.t_max = Float<W>::load(shadows.t_max + first);
    rays.active = Int<W>::lane_index() + Int<W>(first) < Int<W>(shadows.count);
    rays.seed = Int<W>::load(shadows.seed + first);
    const Int<W> path = select(rays.active, Int<W>::load(shadows.path + first), Int<W>(0));
    if (scene.geometry.moving)
        rays.time = gather(batch.time, path);
    if (scene.geometry.fades)
        rays.level = gather(batch.level, path);
    if (scene.lights.shadow_linked)
        rays.passes = Int<W>::load(shadows.passes + first);
}

template <int W>
void occlude(const SceneView& scene, BatchState& batch, const RayQueue& shadows, WallScratch* walls,
             RayBatch<W>& all) {
    if (scene.media.tracked)
        return occlude_in_media<W>(scene, batch, shadows, walls, all);
    const bool tinted = scene.geometry.tinted;
    for (int begin = 0; begin < shadows.count; begin += BatchSize) {
        const int end = std::min(begin + BatchSize, shadows.count);
        all.resize(end - begin, tinted);
        for (int first = begin; first < end; first += W)
            load_shadow_rays(scene, batch, shadows, first, all.rays[size_t((first - begin) / W)]);
        if (tinted)
            all.note_passages();
        scene.geometry.ray_query.find_occluded<W>(all.rays, all.hidden);
        for (int first = begin; first < end; first += W) {
            const size_t packet = size_t((first - begin) / W);
            const bvh::RayPacket<W>& rays = all.rays[packet];
            Spectrum<W> contribution;
            for (int k = 0; k < Wavelengths; k++)
                contribution[k] = Float<W>::load(shadows.contribution[k] + first);
            const Int<W> path = Int<W>::load(shadows.path + first);
            if (tinted) {
                const auto l = load_rows<4>(batch.l, select(rays.active, path, Int<W>(0)) << 2);
                contribution = contribution * all.passages[packet].before(scene, rays.t_max, l.data());
            }
            contribute_shadow_rays(scene, batch, path, first, contribution,
                                   rays.active & !all.hidden[packet]);
        }
    }
}

// The sensor along the wavelengths of some paths, those from `first` on.
template <int W>
class SensorLanes {
    using F = Float<W>;
    using I = Int<W>;

  public:
    F unit[Wavelengths];  // of a spectrum that is drawn over [0, 1]
    F white[Wavelengths]; // that albedos are seen under

    SensorLanes(const SceneView& scene, const BatchState& batch, int first)
        : m_matrix(scene.spectra.sensor_matrix) {
        const auto l = load_rows<4>(batch.l, (I::lane_index() + I(first)) << 2);
        for (size_t k = 0; k < Wavelengths; k++) {
            const F x = l[k] * F(470.0f);
            const I i = min(to_int(x), I(469));
            const F f = x - F(i);
            // Sensor and white at the knots before and after.
            const auto knots = load_rows<8>(scene.spectra.sensor.data(), i << 2);
            const auto at = [&](size_t c) { return fma(f, knots[c + 4] - knots[c], knots[c]); };
            for (size_t c = 0; c < 3; c++)
                m_response[k][c] = at(c);
            white[k] = at(3);
            unit[k] = F::load(batch.inv_pdf[k] + first) * F(470.0f);
        }
    }
    // Linear RGB of the output. `s` has its units in it.
    std::array<F, 3> rgb(const Spectrum<W>& s) const {
        F sensed[3] = {F(0.0f), F(0.0f), F(0.0f)};
        for (int k = 0; k < Wavelengths; k++)
            for (int c = 0; c < 3; c++)
                sensed[c] = fma(s[k], m_response[k][c], sensed[c]);
        const auto row = [&](int c) {
            return fma(F(m_matrix[3 * c]), sensed[0],
                       fma(F(m_matrix[3 * c + 1]), sensed[1], F(m_matrix[3 * c + 2]) * sensed[2]));
        };
        return {row(0), row(1), row(2)};
    }

  private:
    const float* m_matrix;
    F m_response[Wavelengths][3];
};

// Samples on their way to pixels, one at a time.
class PixelAdder {
  public:
    PixelAdder(const SceneView& scene, const BatchState& batch, const BatchRequest& request,
               BatchCounts& counts)
        : m_scene(scene), m_batch(batch), m_request(request), m_counts(counts),
          m_weighted(scene.camera.filter.weighted()) {}

    void add(int path, const float (&rgb)[3], const float (&albedo)[3]) {
        const int width = m_request.x1 - m_request.x0;
        const int x = m_request.x0 + path % width, y = m_request.y0 + path / width;
        const size_t pixel = m_request.pixel_of(path);
        PixelSums& p = m_request.pixels[pixel];
        const float* hit = m_batch.first[path];
        if (m_request.progression == m_request.first) {
            int32_t id;
            std::memcpy(&id, hit + BatchState::Id, sizeof id);
            p.id = float(id);
        }
        // A sample that is no number is as if it had not been taken: a black one in its place would darken
        // the picture.
        if (!std::isfinite(rgb[0] + rgb[1] + rgb[2])) {
            if (m_counts.nan_samples++ == 0)
                m_counts.nan_x = x, m_counts.nan_y = y;
            p.dropped++;
            return;
        }
        const float brightness = luminance(rgb[0], rgb[1], rgb[2]);
        look_for_fireflies(pixel, x, y, brightness);
        if (is_of_first_half(m_request.progression))
            p.half += brightness, p.halves++;
        const float w = m_batch.filter_weight[path], surface = hit[BatchState::Hit];
        for (int c = 0; c < 3; c++)
            p.rgb[c] += w * rgb[c];
        p.alpha += w * hit[BatchState::Alpha];
        if (m_weighted) {
            for (int c = 0; c < 3; c++)
                p.plain[c] += rgb[c];
            p.plain[3] += hit[BatchState::Alpha];
        }
        p.hits += surface;
        p.weight += w;
        p.depth += finite(surface * hit[BatchState::Depth]);
        for (int c = 0; c < 3; c++) {
            p.albedo[c] += finite(w * albedo[c]);
            p.normal[c] += finite(surface * hit[BatchState::Normal + c]);
            p.position[c] += finite(surface * hit[BatchState::Position + c]);
        }
        add_aovs(path, pixel, w, surface);
    }

  private:
    static float finite(float x) { return std::isfinite(x) ? x : 0.0f; }

    void look_for_fireflies(size_t pixel, int x, int y, float brightness) {
        if (m_request.progression - m_request.first < Firefly::FirstLooked)
            return;
        const PixelSums& p = m_request.pixels[pixel];
        float weight = p.weight, light = luminance(p.rgb[0], p.rgb[1], p.rgb[2]);
        if (m_request.before) {
            const PixelSums& before = m_request.before[pixel];
            weight += before.weight, light += luminance(before.rgb[0], before.rgb[1], before.rgb[2]);
        }
        if (!(weight > 0))
            return;
        const Firefly f{x, y, m_request.progression, brightness, std::max(light / weight, 0.0f)};
        if (f.luminance > Firefly::Factor * (f.mean + 0.01f)) {
            m_counts.fireflies++;
            m_counts.note(f);
        }
    }
    void add_aovs(int path, size_t pixel, float w, float surface) {
        const std::span<const uint8_t> is_color = m_scene.settings.aov_is_color;
        for (size_t a = 0; a < is_color.size(); a++)
            m_request.aovs[pixel * is_color.size() + a] +=
                finite((is_color[a] ? w : surface) * m_batch.aovs[a * BatchPadded + size_t(path)]);
    }

    const SceneView& m_scene;
    const BatchState& m_batch;
    const BatchRequest& m_request;
    BatchCounts& m_counts;
    const bool m_weighted;
};

// What expressions have gathered becomes AOVs.
template <int W>
[[gnu::noinline]] void sense_expressions(const PathShares& shares, const SensorLanes<W>& sensor, int first,
                                         std::vector<float>& aovs) {
    for (int e = 0; e < shares.count(); e++) {
        const auto radiance = load_rows<4>(shares.radiance(e), (Int<W>::lane_index() + Int<W>(first)) << 2);
        Spectrum<W> light;
        for (size_t k = 0; k < Wavelengths; k++)
            light[int(k)] = radiance[k] * sensor.unit[k];
        const auto rgb = sensor.rgb(light);
        for (size_t c = 0; c < 3; c++)
            rgb[c].store(aovs.data() + (size_t(shares.first_channel() + 3 * e) + c) * BatchPadded +
                         size_t(first));
    }
}

template <int W>
void finish(const SceneView& scene, BatchState& batch, int count, const BatchRequest& request,
            BatchCounts& counts) {
    using F = Float<W>;
    using I = Int<W>;
    PixelAdder pixels(scene, batch, request, counts);
    for (int first = 0; first < count; first += W) {
        const I path = I::lane_index() + I(first);
        const SensorLanes<W> sensor(scene, batch, first);
        const auto radiance = load_rows<4>(batch.radiance, path << 2);
        const auto albedos = load_rows<4>(batch.first, path << 4);
        // Radiance contributions are divided by the sum over wavelengths already; albedos are a mean of four,
        // seen under white.
        Spectrum<W> light, seen;
        for (size_t k = 0; k < Wavelengths; k++) {
            light[int(k)] = radiance[k] * sensor.unit[k];
            seen[int(k)] = albedos[k] * sensor.unit[k] * sensor.white[k] * F(1.0f / Wavelengths);
        }
        const auto rgb = sensor.rgb(light), albedo = sensor.rgb(seen);
        if (batch.shares)
            sense_expressions(*batch.shares, sensor, first, batch.aovs);
        for (int i = 0; i < W && first + i < count; i++) {
            if (!request.is_traced(first + i))
                continue;
            pixels.add(first + i, {rgb[0].v[i], rgb[1].v[i], rgb[2].v[i]},
                       {albedo[0].v[i], albedo[1].v[i], albedo[2].v[i]});
            counts.paths++;
        }
    }
}

} // namespace kanuka::transport
