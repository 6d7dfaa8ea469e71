// Generate: camera rays for a rectangle of pixels at one progression.
#pragma once

#include <bit>

#include "base/sampling.h"
#include "transport/camera.h"
#include "transport/kernel.h"
#include "transport/media.h"
#include "transport/path_state.h"
#include "transport/wavelengths.h"

namespace kanuka::transport {

// Offset and signed weight of the pixel filter at u, from its inverse cumulative table.
template <int W>
Float<W> filter_offset(std::span<const float> table, std::span<const float> signs, Float<W> u,
                       Float<W>& weight) {
    const int segments = int(table.size()) - 1;
    const Float<W> x = u * Float<W>(float(segments));
    const Int<W> i = min(to_int(x), Int<W>(segments - 1));
    const Float<W> a = gather(table.data(), i), b = gather(table.data() + 1, i);
    if (!signs.empty())
        weight *= gather(signs.data(), i);
    return fma(x - Float<W>(i), b - a, a);
}

// Which of the `count` steps of a table of masses, which rises from 0 at `first` to 1, holds u; u becomes the
// place within the step.
template <int W>
Int<W> filter_step(const float* mass, Int<W> first, int count, Float<W>& u) {
    Int<W> found(0);
    for (int step = int(std::bit_ceil(unsigned(count))) / 2; step > 0; step /= 2) {
        const Int<W> next = min(found + Int<W>(step), Int<W>(count - 1));
        found = select(gather(mass, first + next) <= u, next, found);
    }
    const Float<W> low = gather(mass, first + found), high = gather(mass + 1, first + found);
    u = (u - low) / (high - low);
    return found;
}

// The same of a filter given as a table: a row, then a cell of it, then a place in the cell.
template <int W>
void filter_offset(const FilterView::Cells& table, Float<W> u0, Float<W> u1, Float<W>& dx, Float<W>& dy,
                   Float<W>& weight) {
    const Int<W> y = filter_step(table.rows, Int<W>(0), table.ny, u1);
    const Int<W> x = filter_step(table.cells, y * Int<W>(table.nx + 1), table.nx, u0);
    weight = gather(table.weight, y * Int<W>(table.nx) + x);
    dx = fma(Float<W>(x) + u0, Float<W>(table.width[0] / float(table.nx)), Float<W>(-0.5f * table.width[0]));
    dy = fma(Float<W>(y) + u1, Float<W>(table.width[1] / float(table.ny)), Float<W>(-0.5f * table.width[1]));
}

// Keeps the paths of pixels that see something, dense and in order.
inline void drop_blind(PathQueue& paths, const bool* sees) {
    int kept = 0;
    for (int i = 0; i < paths.count; i++) {
        if (!sees[i])
            continue;
        std::memmove(paths.row[kept++], paths.row[i], sizeof paths.row[i]); // ratios are 1 for all
    }
    paths.count = kept;
}

// Fills the batch and its paths: one a pixel, but for pixels outside of a fisheye's image circle.
template <int W>
void generate(const SceneView& scene, const BatchRequest& request, BatchState& batch, PathQueue& paths) {
    using F = Float<W>;
    using I = Int<W>;
    const int width = request.x1 - request.x0, count = width * (request.y1 - request.y0);
    const uint32_t reversed = reverse_bits_scalar(request.progression);
    const CameraView& cam = scene.camera;
    std::fill(batch.aovs.begin(), batch.aovs.end(), 0.0f);
    batch.reversed_progression = reversed;
    bool blind = false;
    bool sees[BatchPadded];
    for (int first = 0; first < count; first += W) {
        const I index = I::lane_index() + I(first);
        // Lanes past the end repeat the last pixel; nobody reads them.
        I y;
        for (int k = 0; k < W; k++)
            y.v[k] = std::min(first + k, count - 1) / width;
        const I column = min(index, I(count - 1)) - y * I(width);
        const I px = column + I(request.x0), py = y + I(request.y0);
        const I pixel = pixel_seed(px, py, scene.settings.seed);
        const Sampler<W> sampler{pixel, reversed};

        // Position on the film, filter importance sampled.
        F u0, u1, weight(1.0f);
        sampler.sample_2d(int(Net::Filter), u0, u1);
        F dx, dy;
        if (scene.camera.filter.cells.nx > 0) {
            filter_offset(scene.camera.filter.cells, u0, u1, dx, dy, weight);
        } else {
            dx = filter_offset(scene.camera.filter.x, scene.camera.filter.signs_x, u0, weight);
            dy = filter_offset(scene.camera.filter.y, scene.camera.filter.signs_y, u1, weight);
        }
        weight.store(batch.filter_weight + first);
        const F sx = (F(px) + F(0.5f) + dx) * F(1.0f / float(cam.width)),
                sy = (F(py) + F(0.5f) + dy) * F(1.0f / float(cam.height));
        const F fx = fma(sx, F(cam.right - cam.left), F(cam.left)),
                fy = fma(sy, F(cam.bottom - cam.top), F(cam.top));

        F level, time(0.0f);
        if (scene.geometry.moving || scene.geometry.fades) {
            sampler.sample_2d(int(Net::LevelTime), level, time);
            level.store(batch.level + first);
            if (!scene.camera.shutter_quantiles.empty()) // as the shutter lets light in
                time = quantile(scene.camera.shutter_quantiles.data(), scene::ShutterSegments, time);
            time.store(batch.time + first);
        }

        F lens_x(0.0f), lens_y(0.0f);
        if (cam.lens_radius > 0) {
            sampler.sample_2d(int(Net::Lens), u0, u1);
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

        // Wavelengths by the table of quantiles, a quarter apart. What they see together is the same
        // whichever of them is the hero: so that is drawn apart, and a pixel's samples spread over one
        // quarter.
        F in_quarter, hero;
        sampler.sample_2d(int(Net::Wavelength), in_quarter, hero);
        const F first_u = (in_quarter + floor(hero * F(4.0f))) * F(0.25f);
        Row<W, 4> l;
        for (int k = 0; k < 4; k++) {
            F u = first_u + F(0.25f * float(k));
            u = select(u >= F(1.0f), u - F(1.0f), u) * F(float(WavelengthTable::Segments));
            const I i = min(to_int(u), I(WavelengthTable::Segments - 1));
            const F a = gather(scene.spectra.wavelengths.data(), i),
                    b = gather(scene.spectra.wavelengths.data() + 1, i);
            l[size_t(k)] = fma(u - F(i), b - a, a);
            ((b - a) * F(float(WavelengthTable::Segments))).store(batch.inv_pdf[k] + first);
            F(1.0f).store(paths.ratio[k] + first);
        }
        const F zero(0.0f), one(1.0f); // camera rays hit lights with full weight: mis = 0
        const Row<W, PathQueue::Fields> row{O.x,  O.y,  O.z,  bitcast_float(pixel),
                                            D.x,  D.y,  D.z,  bitcast_float(index),
                                            one,  one,  one,  one,
                                            zero, zero, zero, bitcast_float(I(scene.media.around_camera[0]))};
        const uint32_t all = Mask<W>(true).bits();
        compress_rows(paths.row[first], row, all);
        compress_rows(batch.l[first], l, all);
        if (scene.media.tracked) {
            for (int k = 0; k < 3; k++)
                I(scene.media.around_camera[k + 1]).store(paths.under[k] + first);
            zero.store(paths.start + first);
            I(Events::Camera).store(paths.events + first);
        }
    }
    std::memset(batch.radiance, 0, sizeof batch.radiance[0] * size_t(count));
    std::memset(batch.first, 0, sizeof batch.first[0] * size_t(count));
    paths.count = count;
    if (blind)
        drop_blind(paths, sees);
}

} // namespace kanuka::transport
