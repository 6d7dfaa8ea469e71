#include "render/accumulator.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace kanuka::render {

Window crop_window(const std::array<float, 4>& crop, int width, int height) {
    const auto clamp_to = [](double v, int hi) { return std::clamp(int(v), 0, hi); };
    Window w;
    w.x0 = clamp_to(std::ceil(double(width) * crop[0] - 1e-4), width);
    w.x1 = clamp_to(std::ceil(double(width) * crop[1] - 1e-4), width);
    w.y0 = clamp_to(std::ceil(double(height) * crop[2] - 1e-4), height);
    w.y1 = clamp_to(std::ceil(double(height) * crop[3] - 1e-4), height);
    if (w.x0 >= w.x1 || w.y0 >= w.y1)
        throw Error("the crop window is empty; it is xmin,xmax,ymin,ymax in [0, 1]", ExitCode::Usage);
    return w;
}

Accumulator::Accumulator(const Window& window, size_t aovs)
    : m_window(window), m_aovs(aovs), m_across((window.width() + BucketSize - 1) / BucketSize) {
    const int down = (window.height() + BucketSize - 1) / BucketSize;
    m_pixels.assign(size_t(window.width()) * size_t(window.height()), transport::PixelSums{});
    m_aov_sums.assign(m_pixels.size() * aovs, 0.0f);
    m_done.assign(size_t(m_across) * size_t(down), 0);
}

transport::BatchRequest Accumulator::request(size_t bucket) {
    transport::BatchRequest r;
    r.x0 = m_window.x0 + int(bucket) % m_across * BucketSize;
    r.y0 = m_window.y0 + int(bucket) / m_across * BucketSize;
    r.x1 = std::min(r.x0 + BucketSize, m_window.x1);
    r.y1 = std::min(r.y0 + BucketSize, m_window.y1);
    const ptrdiff_t to_window = ptrdiff_t(m_window.y0) * m_window.width() + m_window.x0;
    r.pixels = m_pixels.data() - to_window;
    r.stride = m_window.width();
    r.aovs = m_aov_sums.data() - to_window * ptrdiff_t(m_aovs);
    return r;
}

int Accumulator::done_at(int x, int y) const {
    return m_done[size_t(y / BucketSize) * size_t(m_across) + size_t(x / BucketSize)];
}

int Accumulator::least_done() const {
    return *std::min_element(m_done.begin(), m_done.end());
}

template <class Visit>
void Accumulator::rows_of(size_t bucket, Visit visit) const {
    const int x0 = int(bucket) % m_across * BucketSize, y0 = int(bucket) / m_across * BucketSize;
    for (int y = y0; y < std::min(y0 + BucketSize, m_window.height()); y++)
        visit(size_t(y) * size_t(m_window.width()) + size_t(x0),
              size_t(std::min(BucketSize, m_window.width() - x0)));
}

Accumulator::Sums Accumulator::take(size_t bucket) const {
    Sums sums;
    rows_of(bucket, [&](size_t first, size_t count) {
        sums.pixels.insert(sums.pixels.end(), m_pixels.begin() + ptrdiff_t(first),
                           m_pixels.begin() + ptrdiff_t(first + count));
        sums.aovs.insert(sums.aovs.end(), m_aov_sums.begin() + ptrdiff_t(m_aovs * first),
                         m_aov_sums.begin() + ptrdiff_t(m_aovs * (first + count)));
    });
    return sums;
}

void Accumulator::put(size_t bucket, const Sums& sums) {
    size_t at = 0;
    rows_of(bucket, [&](size_t first, size_t count) {
        std::copy_n(sums.pixels.begin() + ptrdiff_t(at), count, m_pixels.begin() + ptrdiff_t(first));
        std::copy_n(sums.aovs.begin() + ptrdiff_t(m_aovs * at), m_aovs * count,
                    m_aov_sums.begin() + ptrdiff_t(m_aovs * first));
        at += count;
    });
}

} // namespace kanuka::render
