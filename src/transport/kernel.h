// The transport kernel: a batch of paths from film to light, stage by stage. One source for all lane counts.
#pragma once

#include <memory>

#include "transport/scene_view.h"

namespace kanuka::transport {

// What a pixel has gathered; sums over progressions.
struct alignas(16) PixelSums {
    float rgb[3], alpha;
    float albedo[3], depth;
    float normal[3], id;     // id: of the first progression's hit
    float position[3], hits; // hits: how many samples found a surface
    float weight;            // of the pixel filter
};

struct BatchCounts {
    uint64_t paths = 0, rays = 0, nan_samples = 0;
    int nan_x = -1, nan_y = -1; // first bad sample's pixel
};

// A rectangle of pixels, at most BatchSize of them, at one progression.
struct BatchRequest {
    int x0, y0, x1, y1;
    uint32_t progression;
    PixelSums* pixels;     // of pixel (0, 0) of the film
    int stride;            // pixels a row
    float* aovs = nullptr; // of pixel (0, 0): SceneView::aov_is_color.size() sums a pixel
};

// Scratch memory of one thread.
class Kernel {
  public:
    virtual ~Kernel() = default;
    // Adds one sample to each pixel of the rectangle. The result is a pure function of scene and request.
    virtual void trace(const BatchRequest& request, BatchCounts& counts) = 0;
};

// lanes: 1, 8 or 16; 0 = the widest that pays on this machine. The scene must outlive the kernel.
std::unique_ptr<Kernel> make_kernel(const SceneView& scene, int lanes);
int widest_lanes();

} // namespace kanuka::transport
