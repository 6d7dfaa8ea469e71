// Generate: camera rays for a rectangle of pixels at one progression.
#pragma once

#include "base/sampling.h"
#include "transport/camera.h"
#include "transport/kernel.h"
#include "transport/path_state.h"

namespace kanuka::transport {

// Offset and signed weight of the pixel filter at u, from its inverse cumulative table.
template <int W>
Float<W> filter_offset(const float* table, const float* signs, int size, Float<W> u, Float<W>& weight) {
    const Float<W> x = u * Float<W>(float(size));
    const Int<W> i = min(to_int(x), Int<W>(size - 1));
    const Float<W> a = gather(table, i), b = gather(table + 1, i);
    if (signs)
        weight *= gather(signs, i);
    return fma(x - Float<W>(i), b - a, a);
}

// Keeps the paths of pixels that see something, dense and in order.
inline int drop_blind(PathState& paths, const bool* sees, int count) {
    int kept = 0;
    for (int i = 0; i < count; i++) {
        if (!sees[i])
            continue;
        for (int c = 0; c < 3; c++) {
            paths.o[c][kept] = paths.o[c][i];
            paths.d[c][kept] = paths.d[c][i];
        }
        paths.path[kept++] = paths.path[i]; // all else is the same for all
    }
    return kept;
}

// Fills the batch and its paths; returns how many paths there are: one a pixel, but for pixels outside of a
// fisheye's image circle.
template <int W>
int generate(const SceneView& scene, const BatchRequest& request, BatchState& batch, PathState& paths) {
    using F = Float<W>;
    using I = Int<W>;
    const int width = request.x1 - request.x0, count = width * (request.y1 - request.y0);
    const uint32_t reversed = reverse_bits_scalar(request.progression);
    const CameraView& cam = scene.camera;
    bool blind = false;
    bool sees[BatchPadded];
    for (int first = 0; first < count; first += W) {
        const I index = I::lane_index() + I(first);
        // Lanes past the end repeat the last pixel; nobody reads them.
        I row;
        for (int k = 0; k < W; k++)
            row.v[k] = std::min(first + k, count - 1) / width;
        const I column = min(index, I(count - 1)) - row * I(width);
        const I px = column + I(request.x0), py = row + I(request.y0);
        const I pixel = hash_bits(px ^ hash_bits(py ^ I(int(scene.seed * 0x9e3779b9u + 0x7f4a7c15u))));
        pixel.store(batch.pixel_hash + first);
        const Sampler<W> sampler{pixel, reversed};

        // Position on the film, filter importance sampled.
        F u0, u1, weight(1.0f);
        sampler.sample_2d(int(Dimension::Filter), u0, u1);
        const F dx = filter_offset(scene.filter_x, scene.filter_weight_x, scene.filter_size, u0, weight);
        const F dy = filter_offset(scene.filter_y, scene.filter_weight_y, scene.filter_size, u1, weight);
        weight.store(batch.filter_weight + first);
        const F sx = (F(px) + F(0.5f) + dx) * F(1.0f / float(cam.width)),
                sy = (F(py) + F(0.5f) + dy) * F(1.0f / float(cam.height));
        const F fx = fma(sx, F(cam.right - cam.left), F(cam.left)),
                fy = fma(sy, F(cam.bottom - cam.top), F(cam.top));

        // Hero wavelength and time share a pair; time is drawn as the shutter lets light in.
        F uw, time(0.0f);
        sampler.sample_2d(int(Dimension::WavelengthTime), uw, time);
        if (scene.moving) {
            if (!scene.shutter_quantiles.empty())
                time = quantile(scene.shutter_quantiles.data(), scene::ShutterSegments, time);
            time.store(batch.time + first);
        }

        F lens_x(0.0f), lens_y(0.0f);
        if (cam.lens_radius > 0) {
            sampler.sample_2d(int(Dimension::Lens), u0, u1);
            sample_lens(cam, u0, u1, lens_x, lens_y);
        }
        Vec3<F> o, d;
        const Mask<W> seen = camera_ray(cam, fx, fy, lens_x, lens_y, o, d);
        if (is_fisheye(cam.projection)) {
            blind |= !all(seen);
            for (int k = 0; k < W && first + k < count; k++)
                sees[first + k] = seen[k];
        }
        Vec3<F> O, D;
        leave_camera(cam, o, d, time, O, D);

        // Hero wavelength by the table of quantiles; the others rotated equidistantly.
        for (int k = 0; k < 4; k++) {
            F u = uw + F(0.25f * float(k));
            u = select(u >= F(1.0f), u - F(1.0f), u) * F(float(WavelengthTable::Segments));
            const I i = min(to_int(u), I(WavelengthTable::Segments - 1));
            const F a = gather(scene.wavelengths.quantile.data(), i),
                    b = gather(scene.wavelengths.quantile.data() + 1, i);
            fma(u - F(i), b - a, a).store(batch.l[k] + first);
            ((b - a) * F(float(WavelengthTable::Segments))).store(batch.inv_pdf[k] + first);
            F(0.0f).store(batch.radiance[k] + first);
            F(0.0f).store(batch.albedo[k] + first);
            F(1.0f).store(paths.beta[k] + first);
            F(1.0f).store(paths.ratio[k] + first);
        }
        for (int c = 0; c < 3; c++) {
            O[c].store(paths.o[c] + first);
            D[c].store(paths.d[c] + first);
            F(0.0f).store(batch.normal[c] + first);
            F(0.0f).store(batch.position[c] + first);
        }
        F(0.0f).store(batch.depth + first);
        F(0.0f).store(batch.alpha + first);
        F(0.0f).store(batch.hit + first);
        F(0.0f).store(paths.mis + first); // camera rays meet lights with full weight
        F(0.0f).store(paths.ask_emitters + first);
        F(0.0f).store(paths.ask_map + first);
        F(0.0f).store(paths.ask_constant + first);
        I(0).store(batch.id + first);
        index.store(paths.path + first);
        I(-1).store(paths.interior + first);
    }
    return blind ? drop_blind(paths, sees, count) : count;
}

} // namespace kanuka::transport
