// Generate: camera rays for a rectangle of pixels at one progression.
#pragma once

#include "base/sampling.h"
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

// Fills the batch and its paths; returns how many.
template <int W>
int generate(const SceneView& scene, const BatchRequest& request, BatchState& batch, PathState& paths) {
    using F = Float<W>;
    using I = Int<W>;
    const int width = request.x1 - request.x0, count = width * (request.y1 - request.y0);
    const uint32_t reversed = reverse_bits_scalar(request.progression);
    const CameraView& cam = scene.camera;
    std::fill(batch.aovs.begin(), batch.aovs.end(), 0.0f);
    for (int first = 0; first < count; first += W) {
        const I index = I::lane_index() + I(first);
        // Lanes past the end repeat the last pixel; nobody reads them.
        I y;
        for (int k = 0; k < W; k++)
            y.v[k] = std::min(first + k, count - 1) / width;
        const I column = min(index, I(count - 1)) - y * I(width);
        const I px = column + I(request.x0), py = y + I(request.y0);
        const I pixel = hash_bits(px ^ hash_bits(py ^ I(int(scene.seed * 0x9e3779b9u + 0x7f4a7c15u))));
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

        // Camera space ray; a thin lens bends it through the plane of focus.
        Vec3<F> o(F(0.0f), F(0.0f), F(0.0f)), d(fx, fy, F(1.0f));
        if (!cam.perspective) {
            o = {fx, fy, F(0.0f)};
            d = {F(0.0f), F(0.0f), F(1.0f)};
        }
        if (cam.lens_radius > 0) {
            sampler.sample_2d(int(Dimension::Lens), u0, u1);
            F s, c;
            sincos_2pi(u0, s, c);
            const F r = sqrt(u1) * F(cam.lens_radius);
            const Vec3<F> focus = o + d * F(cam.focal_distance), shift(r * c, r * s, F(0.0f));
            o += shift;
            d = focus - o;
            d = d / d.z;
        }
        o += d * F(cam.near_clip);
        const float* m = cam.render_from_camera;
        const auto turn = [&](const Vec3<F>& v, int r, float w) {
            return fma(F(m[4 * r]), v.x,
                       fma(F(m[4 * r + 1]), v.y, fma(F(m[4 * r + 2]), v.z, F(m[4 * r + 3] * w))));
        };
        const Vec3<F> O(turn(o, 0, 1), turn(o, 1, 1), turn(o, 2, 1));
        const Vec3<F> D = normalize(Vec3<F>(turn(d, 0, 0), turn(d, 1, 0), turn(d, 2, 0)));

        // Hero wavelength by the table of quantiles; the others rotated equidistantly.
        F uw, time;
        sampler.sample_2d(int(Dimension::WavelengthTime), uw, time);
        Row<W, 4> l;
        for (int k = 0; k < 4; k++) {
            F u = uw + F(0.25f * float(k));
            u = select(u >= F(1.0f), u - F(1.0f), u) * F(float(WavelengthTable::Segments));
            const I i = min(to_int(u), I(WavelengthTable::Segments - 1));
            const F a = gather(scene.wavelengths.quantile.data(), i),
                    b = gather(scene.wavelengths.quantile.data() + 1, i);
            l[size_t(k)] = fma(u - F(i), b - a, a);
            ((b - a) * F(float(WavelengthTable::Segments))).store(batch.inv_pdf[k] + first);
            F(1.0f).store(paths.ratio[k] + first);
        }
        const F zero(0.0f), one(1.0f); // camera rays meet lights with full weight: mis = 0
        const Row<W, PathState::Fields> row{
            O.x,  O.y,  O.z,  bitcast_float(pixel), D.x, D.y, D.z, bitcast_float(index), one, one, one, one,
            zero, zero, zero, bitcast_float(I(-1))};
        const uint32_t all = Mask<W>(true).bits();
        compress_rows(paths.row[first], row, all);
        compress_rows(batch.l[first], l, all);
    }
    std::memset(batch.radiance, 0, sizeof batch.radiance[0] * size_t(count));
    std::memset(batch.first, 0, sizeof batch.first[0] * size_t(count));
    return count;
}

} // namespace kanuka::transport
