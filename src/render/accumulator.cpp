#include "render/accumulator.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/tasks.h"

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

Accumulator::Accumulator(const Window& window, size_t aovs, bool stops)
    : m_window(window), m_aovs(aovs), m_across((window.width() + BucketSize - 1) / BucketSize) {
    const int down = (window.height() + BucketSize - 1) / BucketSize;
    m_pixels.assign(size_t(window.width()) * size_t(window.height()), transport::PixelSums{});
    m_aov_sums.assign(m_pixels.size() * aovs, 0.0f);
    m_done.assign(size_t(m_across) * size_t(down), 0);
    if (stops) {
        m_stopped.assign(m_pixels.size(), 0);
        m_takes_part.assign(m_pixels.size(), 1);
    }
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
    if (!m_takes_part.empty())
        r.takes_part = m_takes_part.data() - to_window;
    return r;
}

void Accumulator::restore(std::vector<int> done, std::vector<int> stopped,
                          std::vector<transport::PixelSums> pixels, std::vector<float> aov_sums) {
    m_done = std::move(done), m_stopped = std::move(stopped), m_pixels = std::move(pixels),
    m_aov_sums = std::move(aov_sums);
    for (size_t i = 0; i < m_stopped.size(); i++)
        m_takes_part[i] = m_stopped[i] == 0;
}

int Accumulator::done_at(int x, int y) const {
    if (!m_stopped.empty())
        if (const int at = m_stopped[size_t(y) * size_t(m_window.width()) + size_t(x)]; at > 0)
            return at;
    return m_done[size_t(y / BucketSize) * size_t(m_across) + size_t(x / BucketSize)];
}

int Accumulator::least_done() const {
    return *std::min_element(m_done.begin(), m_done.end());
}

int Accumulator::next_decision(int progressions) {
    for (int64_t at = 16;; at *= 2) {
        for (const int64_t decision : {at, at + at / 2})
            if (decision > progressions)
                return int(std::min(decision, int64_t(INT_MAX)));
    }
}

// Dammertz, Hanika, Keller and Lensch 2010, A Hierarchical Automatic Stopping Condition for Monte Carlo
// Global Illumination: half of the samples against all, over the root of the brightness, as eyes see noise.
void Accumulator::decide(float most, float exposure, bool filter_weighted) {
    const int at = m_done.empty() ? 0 : m_done[0];
    if (next_decision(at - 1) != at || std::ranges::any_of(m_done, [&](int done) { return done != at; }))
        return;
    const int width = m_window.width(), height = m_window.height();
    struct Seen {
        double error2 = 0, light = 0;
    };
    const auto seen = [&](const transport::PixelSums& p, int x, int y) {
        const double all = double(done_at(x, y)) - double(p.dropped), one = double(p.halves),
                     other = all - one;
        const float* rgb = filter_weighted ? p.plain : p.rgb;
        const double sum = double(transport::luminance(rgb[0], rgb[1], rgb[2]));
        if (!(one > 0) || !(other > 0)) // nothing is known
            return Seen{std::numeric_limits<double>::infinity(), 0};
        const double difference = double(p.half) / one - (sum - double(p.half)) / other;
        return Seen{0.25 * difference * difference, sum / all};
    };
    tasks::parallel_for(size_t(height), [&](size_t row) {
        const int y = int(row);
        for (int x = 0; x < width; x++) {
            const size_t pixel = row * size_t(width) + size_t(x);
            if (m_stopped[pixel] > 0)
                continue;
            Seen sum;
            int count = 0;
            for (int v = std::max(y - Neighbours, 0); v <= std::min(y + Neighbours, height - 1); v++)
                for (int u = std::max(x - Neighbours, 0); u <= std::min(x + Neighbours, width - 1); u++) {
                    const Seen one = seen(m_pixels[size_t(v) * size_t(width) + size_t(u)], u, v);
                    sum.error2 += one.error2, sum.light += one.light;
                    count++;
                }
            const double error = std::sqrt(sum.error2 / count) * double(exposure),
                         light = std::max(sum.light / count * double(exposure), DarkestLight);
            m_takes_part[pixel] = !(error <= double(most) * std::sqrt(light));
        }
    });
    for (size_t i = 0; i < m_stopped.size(); i++)
        if (m_stopped[i] == 0 && m_takes_part[i] == 0)
            m_stopped[i] = at;
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

bool Accumulator::is_traced(size_t bucket) const {
    if (m_takes_part.empty())
        return true;
    bool some = false;
    rows_of(bucket, [&](size_t first, size_t count) {
        some |=
            std::any_of(m_takes_part.begin() + ptrdiff_t(first),
                        m_takes_part.begin() + ptrdiff_t(first + count), [](uint8_t on) { return on != 0; });
    });
    return some;
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
