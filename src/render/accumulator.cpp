#include "render/accumulator.h"

#include <algorithm>
#include <bit>
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

size_t buckets_of(const Window& window) {
    const auto along = [](int pixels) {
        return size_t(pixels + Accumulator::BucketSize - 1) / size_t(Accumulator::BucketSize);
    };
    return along(window.width()) * along(window.height());
}

namespace {

// Of later progressions: the id stays.
void add(transport::PixelSums& sums, const transport::PixelSums& later) {
    constexpr size_t Floats = sizeof(transport::PixelSums) / sizeof(float);
    using Values = std::array<float, Floats>;
    auto to = std::bit_cast<Values>(sums);
    const auto from = std::bit_cast<Values>(later);
    for (size_t k = 0; k < Floats; k++)
        to[k] += from[k];
    const float id = sums.id;
    sums = std::bit_cast<transport::PixelSums>(to);
    sums.id = id;
}

size_t place_in(const Accumulator::Bucket& bucket, int x, int y) {
    constexpr int Size = Accumulator::BucketSize;
    return size_t(y % Size) * size_t(bucket.area.width()) + size_t(x % Size);
}

} // namespace

void Sums::add(const Sums& later) {
    for (size_t i = 0; i < pixels.size(); i++)
        render::add(pixels[i], later.pixels[i]);
    for (size_t i = 0; i < aovs.size(); i++)
        aovs[i] += later.aovs[i];
}

Accumulator::Accumulator(const Window& window, size_t aovs, bool stops, int first)
    : m_window(window), m_aovs(aovs), m_stops(stops), m_first(first),
      m_across((window.width() + BucketSize - 1) / BucketSize), m_buckets(buckets_of(window)) {
    for (size_t b = 0; b < m_buckets.size(); b++) {
        Bucket& bucket = m_buckets[b];
        Window& area = bucket.area;
        area.x0 = window.x0 + int(b) % m_across * BucketSize;
        area.y0 = window.y0 + int(b) / m_across * BucketSize;
        area.x1 = std::min(area.x0 + BucketSize, window.x1);
        area.y1 = std::min(area.y0 + BucketSize, window.y1);
        bucket.done = first;
        if (stops) {
            bucket.stopped.assign(area.pixels(), 0);
            bucket.takes_part.assign(area.pixels(), 1);
        }
    }
}

size_t Accumulator::block_of(int progression) const {
    const int block = (progression - m_first) / BlockSize;
    return m_first == 0 ? size_t(std::min(block, 1)) : size_t(block);
}

size_t Accumulator::sums_at(int done) const {
    if (done <= m_first)
        return 0;
    if (m_first == 0 && done % BlockSize == 0)
        return 1;
    return block_of(done - 1) + 1;
}

Sums Accumulator::zeros(const Bucket& bucket) const {
    return {std::vector<transport::PixelSums>(bucket.area.pixels()),
            std::vector<float>(bucket.area.pixels() * m_aovs)};
}

transport::BatchRequest Accumulator::request(size_t index) {
    Bucket& bucket = m_buckets[index];
    const size_t block = block_of(bucket.done);
    while (bucket.sums.size() <= block)
        bucket.sums.push_back(zeros(bucket));
    transport::BatchRequest r;
    r.x0 = bucket.area.x0, r.y0 = bucket.area.y0, r.x1 = bucket.area.x1, r.y1 = bucket.area.y1;
    r.stride = bucket.area.width();
    const ptrdiff_t to_area = ptrdiff_t(r.y0) * r.stride + r.x0;
    r.pixels = bucket.sums[block].pixels.data() - to_area;
    r.aovs = bucket.sums[block].aovs.data() - to_area * ptrdiff_t(m_aovs);
    if (m_stops)
        r.takes_part = bucket.takes_part.data() - to_area;
    if (block > 0)
        r.before = bucket.sums[block - 1].pixels.data() - to_area;
    r.first = uint32_t(m_first);
    return r;
}

void Accumulator::finish(size_t index, int done) {
    m_buckets[index].done = done;
    fold(m_buckets[index]);
}

void Accumulator::fold(Bucket& bucket) {
    if (m_first != 0 || bucket.sums.size() < 2 || bucket.done % BlockSize != 0)
        return;
    bucket.sums[0].add(bucket.sums[1]);
    bucket.sums.pop_back();
}

void Accumulator::append(Accumulator&& next) {
    for (size_t b = 0; b < m_buckets.size(); b++) {
        Bucket& to = m_buckets[b];
        Bucket& from = next.m_buckets[b];
        for (Sums& block : from.sums) {
            to.sums.push_back(std::move(block));
            to.done = std::min(block_end(to.done), from.done);
            fold(to);
        }
        from.sums.clear();
    }
}

const Accumulator::Bucket& Accumulator::bucket_at(int x, int y) const {
    return m_buckets[size_t(y / BucketSize) * size_t(m_across) + size_t(x / BucketSize)];
}

int Accumulator::samples_at(int x, int y) const {
    const Bucket& bucket = bucket_at(x, y);
    const int stopped = m_stops ? bucket.stopped[place_in(bucket, x, y)] : 0;
    return (stopped > 0 ? stopped : bucket.done) - m_first;
}

transport::PixelSums Accumulator::pixel(int x, int y) const {
    const Bucket& bucket = bucket_at(x, y);
    if (bucket.sums.empty())
        return {};
    const size_t place = place_in(bucket, x, y);
    transport::PixelSums sum = bucket.sums[0].pixels[place];
    for (size_t k = 1; k < bucket.sums.size(); k++)
        add(sum, bucket.sums[k].pixels[place]);
    return sum;
}

void Accumulator::aovs_of(int x, int y, std::span<float> sums) const {
    const Bucket& bucket = bucket_at(x, y);
    const size_t place = place_in(bucket, x, y) * m_aovs;
    std::ranges::fill(sums, 0.0f);
    for (const Sums& block : bucket.sums)
        for (size_t a = 0; a < m_aovs; a++)
            sums[a] += block.aovs[place + a];
}

int Accumulator::least_done() const {
    return std::ranges::min_element(m_buckets, {}, &Bucket::done)->done;
}
int Accumulator::most_done() const {
    return std::ranges::max_element(m_buckets, {}, &Bucket::done)->done;
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
    const int at = m_buckets.empty() ? 0 : m_buckets[0].done;
    if (next_decision(at - 1) != at ||
        std::ranges::any_of(m_buckets, [&](const Bucket& bucket) { return bucket.done != at; }))
        return;
    const int width = m_window.width(), height = m_window.height();
    struct Seen {
        double error2 = 0, light = 0;
    };
    std::vector<Seen> seen(m_window.pixels());
    tasks::parallel_for(size_t(height), [&](size_t row) {
        for (int x = 0; x < width; x++) {
            const transport::PixelSums p = pixel(x, int(row));
            const double all = double(samples_at(x, int(row))) - double(p.dropped), one = double(p.halves),
                         other = all - one;
            const float* rgb = filter_weighted ? p.plain : p.rgb;
            const double sum = double(transport::luminance(rgb[0], rgb[1], rgb[2]));
            Seen& to = seen[row * size_t(width) + size_t(x)];
            if (!(one > 0) || !(other > 0)) { // nothing is known
                to = {std::numeric_limits<double>::infinity(), 0};
                continue;
            }
            const double difference = double(p.half) / one - (sum - double(p.half)) / other;
            to = {0.25 * difference * difference, sum / all};
        }
    });
    tasks::parallel_for(m_buckets.size(), [&](size_t b) {
        Bucket& bucket = m_buckets[b];
        for (size_t pixel = 0; pixel < bucket.stopped.size(); pixel++) {
            if (bucket.stopped[pixel] > 0)
                continue;
            const int x = bucket.area.x0 - m_window.x0 + int(pixel) % bucket.area.width(),
                      y = bucket.area.y0 - m_window.y0 + int(pixel) / bucket.area.width();
            Seen sum;
            int count = 0;
            for (int v = std::max(y - Neighbours, 0); v <= std::min(y + Neighbours, height - 1); v++)
                for (int u = std::max(x - Neighbours, 0); u <= std::min(x + Neighbours, width - 1); u++) {
                    const Seen& one = seen[size_t(v) * size_t(width) + size_t(u)];
                    sum.error2 += one.error2, sum.light += one.light;
                    count++;
                }
            const double error = std::sqrt(sum.error2 / count) * double(exposure),
                         light = std::max(sum.light / count * double(exposure), DarkestLight);
            if (error <= double(most) * std::sqrt(light))
                bucket.stopped[pixel] = at, bucket.takes_part[pixel] = 0;
        }
    });
}

bool Accumulator::is_traced(size_t bucket) const {
    return !m_stops || std::ranges::any_of(m_buckets[bucket].takes_part, [](uint8_t on) { return on != 0; });
}

} // namespace kanuka::render
