// Generate: camera rays for a rectangle of pixels at one progression.
#pragma once

#include <bit>

#include "base/sampling.h"
#include "transport/camera.h"
#include "transport/kernel.h"
#include "transport/media.h"
#include "transport/path_state.h"
#include "transport/roulette.h"
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

// Keeps the paths of pixels that see something and take part, dense and in order.
inline void drop_blind(PathQueue& paths, const BatchRequest& request, const bool* sees) {
    int kept = 0;
    for (int i = 0; i < paths.count; i++) {
        if (!sees[i] || !request.is_traced(i))
            continue;
        std::memmove(paths.row[kept++], paths.row[i], sizeof paths.row[i]); // ratios are 1 for all
    }
    paths.count = kept;
}

// Where on the film the samples of some pixels lie, filter importance sampled; in film coordinates.
template <int W>
struct FilmPlace {
    using F = Float<W>;
    F x, y, weight{1.0f};

    FilmPlace(const CameraView& cam, const Sampler<W>& sampler, Int<W> px, Int<W> py) {
        F u0, u1, dx, dy;
        sampler.sample_2d(int(Net::Filter), u0, u1);
        if (cam.filter.cells.nx > 0) {
            filter_offset(cam.filter.cells, u0, u1, dx, dy, weight);
        } else {
            dx = filter_offset(cam.filter.x, cam.filter.signs_x, u0, weight);
            dy = filter_offset(cam.filter.y, cam.filter.signs_y, u1, weight);
        }
        const F sx = (F(px) + F(0.5f) + dx) * F(1.0f / float(cam.width)),
                sy = (F(py) + F(0.5f) + dy) * F(1.0f / float(cam.height));
        x = fma(sx, F(cam.right - cam.left), F(cam.left));
        y = fma(sy, F(cam.bottom - cam.top), F(cam.top));
    }
};

// Which level of detail paths see, and when: noted for those from `first` on. Returns the time.
template <int W>
Float<W> sample_time(const SceneView& scene, const Sampler<W>& sampler, BatchState& batch, int first) {
    Float<W> level, time(0.0f);
    if (!scene.geometry.moving && !scene.geometry.fades)
        return time;
    sampler.sample_2d(int(Net::LevelTime), level, time);
    level.store(batch.level + first);
    if (!scene.camera.shutter_quantiles.empty()) // as the shutter lets light in
        time = quantile(scene.camera.shutter_quantiles.data(), scene::ShutterSegments, time);
    time.store(batch.time + first);
    return time;
}

// Wavelengths by the table of quantiles, a quarter apart. What they see together is the same whichever of
// them is the hero: so that is drawn apart, and a pixel's samples spread over one quarter.
template <int W>
void sample_wavelengths(const SceneView& scene, const Sampler<W>& sampler, BatchState& batch, int first) {
    using F = Float<W>;
    using I = Int<W>;
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
    }
    compress_rows(batch.l[first], l, Mask<W>(true).bits());
}

// Paths at their start, from `first` on.
template <int W>
void start_paths(const SceneView& scene, PathQueue& paths, int first, const Vec3<Float<W>>& o,
                 const Vec3<Float<W>>& d, Int<W> pixel) {
    using F = Float<W>;
    using I = Int<W>;
    const F zero(0.0f), one(1.0f); // camera rays hit lights with full weight: mis = 0
    const I path = I::lane_index() + I(first);
    const Row<W, PathQueue::Fields> row{o.x,  o.y,  o.z,  bitcast_float(pixel),
                                        d.x,  d.y,  d.z,  bitcast_float(path),
                                        one,  one,  one,  one,
                                        zero, zero, zero, bitcast_float(I(scene.media.around_camera[0]))};
    compress_rows(paths.row[first], row, Mask<W>(true).bits());
    for (auto& ratio : paths.ratio)
        one.store(ratio + first);
    if (!scene.media.tracked)
        return;
    for (int k = 0; k < 3; k++)
        I(scene.media.around_camera[k + 1]).store(paths.under[k] + first);
    zero.store(paths.start + first);
    I(Events::Camera).store(paths.events + first);
}

// Fills the batch and its paths: one a pixel, but for pixels outside of a fisheye's image circle and those
// that take no part.
template <int W>
void generate(const SceneView& scene, const BatchRequest& request, BatchState& batch, PathQueue& paths) {
    using F = Float<W>;
    using I = Int<W>;
    const int width = request.x1 - request.x0, count = width * (request.y1 - request.y0);
    const CameraView& cam = scene.camera;
    std::fill(batch.aovs.begin(), batch.aovs.end(), 0.0f);
    batch.reversed_progression = reverse_bits_scalar(request.progression);
    const bool drops = is_fisheye(cam.projection) || request.takes_part;
    bool blind = request.takes_part != nullptr;
    bool sees[BatchPadded];
    for (int first = 0; first < count; first += W) {
        // Lanes past the end repeat the last pixel; nobody reads them.
        I y;
        for (int k = 0; k < W; k++)
            y.v[k] = std::min(first + k, count - 1) / width;
        const I column = min(I::lane_index() + I(first), I(count - 1)) - y * I(width);
        I px = column + I(request.x0), py = y + I(request.y0);
        if (request.pilot)
            for (int k = 0; k < W; k++) {
                const PilotBatch::Place& place = request.pilot->places[size_t(column[k])];
                px.v[k] = place.x, py.v[k] = place.y;
            }
        const I pixel = pixel_seed(px, py, scene.settings.seed);
        const Sampler<W> sampler{pixel, batch.reversed_progression};
        const FilmPlace<W> film(cam, sampler, px, py);
        film.weight.store(batch.filter_weight + first);
        const F time = sample_time(scene, sampler, batch, first);
        F lens_x(0.0f), lens_y(0.0f);
        if (cam.lens_radius > 0) {
            F u0, u1;
            sampler.sample_2d(int(Net::Lens), u0, u1);
            sample_lens(cam, u0, u1, lens_x, lens_y);
        }
        Vec3<F> o, d, O, D;
        const Mask<W> seen = camera_ray(cam, film.x, film.y, lens_x, lens_y, o, d);
        if (drops) {
            blind |= !all(seen);
            for (int k = 0; k < W && first + k < count; k++)
                sees[first + k] = seen[k];
        }
        leave_camera(cam, o, d, time, O, D);
        sample_wavelengths(scene, sampler, batch, first);
        start_paths(scene, paths, first, O, D, pixel);
    }
    std::memset(batch.radiance, 0, sizeof batch.radiance[0] * size_t(count));
    std::memset(batch.first, 0, sizeof batch.first[0] * size_t(count));
    paths.count = count;
    if (blind)
        drop_blind(paths, request, sees);
}

} // namespace kanuka::transport
