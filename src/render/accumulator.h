// What a picture has gathered so far, pixel by pixel, in buckets that are traced one at a time.
#pragma once

#include <vector>

#include "transport/kernel.h"

namespace kanuka::render {

struct Window { // pixels of the whole picture: x0 <= x < x1
    int x0, y0, x1, y1;
    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
};

// RISpec: a pixel is in the crop window if its number is at least ceil(res * min) and at most ceil(res * max
// - 1). Throws Error where it is empty.
Window crop_window(const std::array<float, 4>& crop, int width, int height);

class Accumulator {
  public:
    static constexpr int BucketSize = 16; // pixels a side: one transport batch

    Accumulator() = default;
    Accumulator(const Window& window, size_t aovs);

    const Window& window() const { return m_window; }
    size_t buckets() const { return m_done.size(); }
    const std::vector<transport::PixelSums>& pixels() const { return m_pixels; }
    const std::vector<float>& aov_sums() const { return m_aov_sums; } // `aovs` a pixel

    // What a kernel is to trace into; its progression is still to be said.
    transport::BatchRequest request(size_t bucket);
    void set_done(size_t bucket, int progressions) { m_done[bucket] = progressions; }
    int done(size_t bucket) const { return m_done[bucket]; }
    const std::vector<int>& done() const { return m_done; } // progressions of each bucket
    // What another of the same window and AOVs had.
    void restore(std::vector<int> done, std::vector<transport::PixelSums> pixels,
                 std::vector<float> aov_sums) {
        m_done = std::move(done), m_pixels = std::move(pixels), m_aov_sums = std::move(aov_sums);
    }
    int done_at(int x, int y) const; // in the window
    int least_done() const;

    // What a bucket's pixels hold, to be put back.
    struct Sums {
        std::vector<transport::PixelSums> pixels;
        std::vector<float> aovs;
    };
    Sums take(size_t bucket) const;
    void put(size_t bucket, const Sums& sums);

  private:
    template <class Visit> // visit(first pixel of a row, pixels)
    void rows_of(size_t bucket, Visit visit) const;

    Window m_window{};
    size_t m_aovs = 0;
    int m_across = 0; // buckets
    std::vector<transport::PixelSums> m_pixels;
    std::vector<float> m_aov_sums;
    std::vector<int> m_done; // progressions of each bucket
};

} // namespace kanuka::render
