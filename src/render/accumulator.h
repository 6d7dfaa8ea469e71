// What a picture has gathered so far, pixel by pixel, in buckets that are traced one at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/part.h"
#include "transport/kernel.h"

namespace kanuka::render {

struct Window { // pixels of the whole picture: x0 <= x < x1
    int x0, y0, x1, y1;
    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
    size_t pixels() const { return size_t(width()) * size_t(height()); }
    bool operator==(const Window&) const = default;
};

// RISpec: a pixel is in the crop window if its number is at least ceil(res * min) and at most ceil(res * max
// - 1). Throws Error where it is empty.
Window crop_window(const std::array<float, 4>& crop, int width, int height);

// What the pixels of a bucket have gathered in some progressions.
struct Sums {
    std::vector<transport::PixelSums> pixels; // row by row
    std::vector<float> aovs;
    void add(const Sums& later); // of later progressions: ids stay
};

class Accumulator {
  public:
    static constexpr int BucketSize = 16; // pixels a side: one transport batch

    struct Bucket {
        Window area{};
        int done = 0; // the first progression that is still to be traced
        // Of a picture that begins at progression 0, the sums of all whole blocks, then those of the block
        // that is under way if it is not the first. Of any other part each block's, since what comes before
        // is not known.
        std::vector<Sums> sums;
        std::vector<int> stopped; // of each pixel, at how many progressions; 0 = not yet; empty = none may
        std::vector<uint8_t> takes_part; // where that is 0
    };

    Accumulator() = default;
    // stops: pixels may stop before others. first: the progression to begin with.
    Accumulator(const Window& window, size_t aovs, bool stops, int first);

    const Window& window() const { return m_window; }
    size_t aovs() const { return m_aovs; } // sums a pixel
    bool stops() const { return m_stops; }
    int first() const { return m_first; }
    size_t buckets() const { return m_buckets.size(); }
    Bucket& bucket(size_t i) { return m_buckets[i]; }
    const Bucket& bucket(size_t i) const { return m_buckets[i]; }
    int least_done() const;
    int most_done() const;

    // Sums that a bucket has which has come to `done`.
    size_t sums_at(int done) const;
    Sums zeros(const Bucket& bucket) const;
    // What a kernel is to trace into, from the bucket's next progression to the end of its block; which of
    // them is still to be said. Then finish() says how far it came.
    transport::BatchRequest request(size_t bucket);
    void finish(size_t bucket, int done);

    // Of a pixel of the window, over all progressions.
    int samples_at(int x, int y) const;
    transport::PixelSums pixel(int x, int y) const;
    void aovs_of(int x, int y, std::span<float> sums) const;

    // Progressions that follow on all that are here: a part that begins where each bucket ends.
    void append(Accumulator&& next);

    // ---- adaptive sampling
    // Where pixels are told to stop: 16, 24, 32, 48, … progressions.
    static int next_decision(int progressions); // the first that is more
    // If all buckets have come to a decision: stops pixels whose neighbourhood has an error of at most
    // `most` times the root of its brightness, both of the picture times `exposure`. Calling it again changes
    // nothing. filter_weighted: as develop() has it.
    void decide(float most, float exposure, bool filter_weighted);
    bool is_traced(size_t bucket) const; // some pixel of it has not stopped

  private:
    const Bucket& bucket_at(int x, int y) const;
    // The block of the next progression: which of a bucket's sums it is.
    size_t block_of(int progression) const;
    void fold(Bucket& bucket); // a block that is whole is added to those before

    static constexpr int Neighbours = 2;          // each way: 25 pixels
    static constexpr double DarkestLight = 0.001; // what is darker may have the same error

    Window m_window{};
    size_t m_aovs = 0;
    bool m_stops = false;
    int m_first = 0;
    int m_across = 0; // buckets
    std::vector<Bucket> m_buckets;
};

// How many buckets a window has.
size_t buckets_of(const Window& window);

} // namespace kanuka::render
