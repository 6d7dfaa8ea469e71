// Figures of one render, as written to the statistics file. Names here are the names there.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace kanuka {

struct Stats {
    struct Time {
        double ingest_s = 0, dice_s = 0, shade_s = 0, store_s = 0, bvh_s = 0, transport_s = 0, film_s = 0,
               total_s = 0, first_pixel_s = 0;
    } time;
    struct Count {
        std::atomic<uint64_t> primitives{0}, primitives_kept{0}, primitives_evicted{0}, primitives_stored{0},
            hierarchies_kept{0}, grids{0}, vertices{0}, micropolygons{0}, traced_polygons{0}, instances{0},
            instance_levels{0}, level_vertices{0},
            instances_coarser{0}, // groups at coarser rates; in them; that show them
            shader_evaluations{0}, textures_made{0}, paths{0}, rays{0}, nan_samples{0}, fireflies{0},
            procedurals{0}, procedurals_read{0}; // that wait for rays, and that they have met
    } count;
    // Samples far brighter than the rest of their pixels, the worst of them with what their paths did.
    struct Firefly {
        struct Vertex {
            std::string object, lobe; // empty: it left the scene; it ended here
            bool smooth = false, through = false;
            float distance = 0, lights_hit = 0, emitted = 0, light_samples = 0; // radiance: LoggedVertex
        };
        int x, y;
        uint32_t progression;
        float luminance, mean;
        std::vector<Vertex> path;
    };
    std::vector<Firefly> fireflies;
    std::vector<float> roulette; // transport::RouletteFactors; empty = none have been learned
    std::vector<int> sky_pairs;  // bounces that have some
    struct Bytes {
        uint64_t grids = 0, lobe_inputs = 0, bvh = 0, textures = 0, peak_rss = 0, store_read = 0,
                 store_written = 0, scratch = 0, given_back = 0; // the last two: base/paged_memory.h
        uint64_t hierarchy_built = 0, hierarchy_stored = 0;      // pages of our own, of `bvh`
    } bytes;
};

// Adds the time of its own life to `seconds`.
class ScopedTimer {
  public:
    explicit ScopedTimer(double& seconds) : m_seconds(seconds), m_start(std::chrono::steady_clock::now()) {}
    ~ScopedTimer() {
        m_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - m_start).count();
    }
    ScopedTimer(const ScopedTimer&) = delete;

  private:
    double& m_seconds;
    std::chrono::steady_clock::time_point m_start;
};

} // namespace kanuka
