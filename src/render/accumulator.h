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
    // stops: pixels may stop before others.
    Accumulator(const Window& window, size_t aovs, bool stops);

    const Window& window() const { return m_window; }
    size_t buckets() const { return m_done.size(); }
    const std::vector<transport::PixelSums>& pixels() const { return m_pixels; }
    const std::vector<float>& aov_sums() const { return m_aov_sums; } // `aovs` a pixel

    // What a kernel is to trace into; its progression is still to be said.
    transport::BatchRequest request(size_t bucket);
    void set_done(size_t bucket, int progressions) { m_done[bucket] = progressions; }
    int done(size_t bucket) const { return m_done[bucket]; }
    const std::vector<int>& done() const { return m_done; } // progressions of each bucket
    // Progressions at which pixels have stopped, 0 = not yet; empty = none may.
    const std::vector<int>& stopped() const { return m_stopped; }
    // What another of the same window and AOVs had.
    void restore(std::vector<int> done, std::vector<int> stopped, std::vector<transport::PixelSums> pixels,
                 std::vector<float> aov_sums);
    int done_at(int x, int y) const; // progressions of a pixel of the window
    int least_done() const;

    // ---- adaptive sampling
    // Where pixels are told to stop: 16, 24, 32, 48, … progressions.
    static int next_decision(int progressions); // the first that is more
    // If all buckets have come to a decision: stops pixels whose neighbourhood has an error of at most
    // `most` times the root of its brightness, both of the picture times `exposure`. Calling it again changes
    // nothing. filter_weighted: as develop() has it.
    void decide(float most, float exposure, bool filter_weighted);
    bool is_traced(size_t bucket) const; // some pixel of it has not stopped

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

    static constexpr int Neighbours = 2;          // each way: 25 pixels
    static constexpr double DarkestLight = 0.001; // what is darker may have the same error

    Window m_window{};
    size_t m_aovs = 0;
    int m_across = 0; // buckets
    std::vector<transport::PixelSums> m_pixels;
    std::vector<float> m_aov_sums;
    std::vector<int> m_done;           // progressions of each bucket
    std::vector<int> m_stopped;        // of each pixel; empty where none may
    std::vector<uint8_t> m_takes_part; // where that is 0
};

} // namespace kanuka::render
