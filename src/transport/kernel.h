// The transport kernel: a batch of paths from film to light, stage by stage. One source for all lane counts.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <tuple>
#include <vector>

#include "transport/scene_view.h"

namespace kanuka::transport {

// Rec.709's, of any linear RGB: it tells bright from dark.
inline float luminance(float r, float g, float b) {
    return 0.2126f * r + 0.7152f * g + 0.0722f * b;
}

// What a pixel has gathered; sums over progressions.
struct alignas(16) PixelSums {
    float rgb[3], alpha;
    float albedo[3], depth;
    float normal[3], id;     // id: of the first progression's hit; it is no sum
    float position[3], hits; // hits: how many samples found a surface
    float weight;            // of the pixel filter; its mean is one
    float plain[4];          // rgb and alpha, unweighted: kept where weights differ
    float dropped;           // samples that were no numbers: they are in no sum
    // Luminance of one half of the samples, without weights, and how many there are: by how much it differs
    // from that of the other half tells the error.
    float half, halves;
};
static_assert(sizeof(PixelSums) == 96); // checkpoints have them as they are

// Which half a sample is of: by Thue's and Morse's sequence, so that of 2k samples each has k. Those of even
// and of odd progressions would not do: of a net they lie in two halves of the pixel.
inline bool is_of_first_half(uint32_t progression) {
    return std::popcount(progression) % 2 == 0;
}

// A sample far brighter than its pixel was up to then, in luminance.
struct Firefly {
    static constexpr float Factor = 16;        // over the mean
    static constexpr uint32_t FirstLooked = 4; // progressions that a mean takes
    int x = -1, y = -1;
    uint32_t progression = 0;
    float luminance = 0, mean = 0;

    // Worse first; no two samples are equal, so lists do not depend on who found what.
    bool operator<(const Firefly& o) const {
        return std::tuple(o.luminance - o.mean, y, x, progression) <
               std::tuple(luminance - mean, o.y, o.x, o.progression);
    }
};

struct BatchCounts {
    uint64_t paths = 0, rays = 0, nan_samples = 0, fireflies = 0;
    int nan_x = -1, nan_y = -1;   // first bad sample's pixel
    std::array<Firefly, 8> worst; // in order; those without a pixel are empty

    void note(const Firefly& f) {
        const auto at = std::upper_bound(worst.begin(), worst.end(), f);
        if (at != worst.end()) {
            std::move_backward(at, worst.end() - 1, worst.end());
            *at = f;
        }
    }
};

// What one path did, vertex by vertex: with requests of a single pixel.
struct LoggedVertex {
    int object = -1, program = -1; // -1: it left the scene
    int leaf = -1;                 // the lobe that sent it on; -1 = it ended
    bool smooth = false, through = false;
    float distance = 0;
    // Radiance that came in here: of the sky and lights that the segment hit, of the surface, of light
    // samples.
    float lights_hit = 0, emitted = 0, light_samples = 0;
};

struct PilotBatch;

// A rectangle of pixels, at most BatchSize of them, at one progression.
struct BatchRequest {
    int x0, y0, x1, y1;
    uint32_t progression;
    PixelSums* pixels;                        // of pixel (0, 0) of the film
    int stride;                               // pixels a row
    std::vector<LoggedVertex>* log = nullptr; // of the one path
    float* aovs = nullptr; // of pixel (0, 0): SettingsView::aov_is_color.size() sums a pixel
    // Of pixel (0, 0), a flag a pixel: pixels of 0 take no sample. Null = all take one.
    const uint8_t* takes_part = nullptr;
    uint32_t first = 0; // progression of all that are gathered: what it hits names the pixel
    // Not null: one row of pixels, which are those places, and all is told to it instead of `pixels`.
    PilotBatch* pilot = nullptr;
    // Of pixel (0, 0): what pixels have gathered beside `pixels`, to compare samples with. Null = nothing.
    const PixelSums* before = nullptr;

    // Of a path of the batch, which has one a pixel.
    size_t pixel_of(int path) const {
        const int width = x1 - x0;
        return size_t(y0 + path / width) * size_t(stride) + size_t(x0 + path % width);
    }
    bool is_traced(int path) const { return !takes_part || takes_part[pixel_of(path)] != 0; }
};

// Scratch memory of one thread.
class Kernel {
  public:
    virtual ~Kernel() = default;
    // Adds one sample to each pixel of the rectangle that takes part. The result is a pure function of scene
    // and request.
    virtual void trace(const BatchRequest& request, BatchCounts& counts) = 0;
};

// lanes: 1, 8 or 16; 0 = the widest that pays on this machine. The scene must outlive the kernel.
std::unique_ptr<Kernel> make_kernel(const SceneView& scene, int lanes);
int widest_lanes();

} // namespace kanuka::transport
