// Russian roulette and splitting that fit the scene: by what, and what paths are to tell for it.
//
// A path ends best where what it still costs is large for what it still brings. With the throughput b of a
// path at bounce d, relative to its start, the survival that makes variance times cost least is b sqrt(E[L²]
// / C_d) / sqrt(V / C): L is the light that a path of throughput one gathers from there on, C_d what that
// costs, V and C the variance and the cost of whole paths (Bolin and Meyer 1997; Veach 1997, section 10.4;
// Rath et al. 2022).
//
// Splitting: at a vertex the sky may be searched for along a pair of directions, of which one goes on. The
// mean of two has less variance than one by E[(a - b)²] / 4, whatever they have to do with each other, and
// costs a shadow ray more.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace kanuka::transport {

struct PathQueue;

// A path goes on after bounce d with the probability min(1, after(d) b).
struct RouletteFactors {
    static constexpr int Depths = 8;
    std::array<float, Depths> at; // the last is that of all bounces that follow
    // Over what the formula says. Paths that survive too often cost a little, too seldom much; and samples of
    // a net have less variance together than those that the pilot sees one by one (docs/transport.md). In
    // media, where walks are long and nets order little, there is none.
    static constexpr float Margin = 2.5f;
    uint32_t sky_pairs = 0; // bit d: paths search the sky for a pair of directions at bounce d
    bool pairs_sky(int bounce) const { return bounce < Depths && (sky_pairs >> bounce & 1) != 0; }
    float after(int bounce, bool in_medium) const {
        const float factor = at[size_t(std::min(bounce, Depths - 1))];
        return in_medium ? std::max(factor / Margin, 1.0f) : factor;
    }
};

// Paths of a pilot: where they start, and what they did. Adds nothing to any pixel.
struct PilotBatch {
    struct Place {
        int x, y; // a pixel
    };
    struct Path {
        float light = 0; // radiance, as contributions have it
        int rays = 0;    // of all kinds
    };
    // A path went on after a bounce. Light and rays: of the path up to there.
    struct Departure {
        int path, bounce;
        float throughput;
        Path until;
        // Radiance of the sky that its direction finds, and that the other of the pair does.
        float sky = 0, other_sky = 0;
    };
    std::span<const Place> places;
    std::vector<Path> paths; // one a place
    std::vector<Departure> departures;

    void begin();
    void count_rays(const PathQueue& queue);
    void count_rays(std::span<const int32_t> paths_of_rays);
    // The paths of the queue have left `bounce`. radiance: four values a path; other_sky: likewise, of pairs;
    // null = there are none.
    void depart(const PathQueue& next, bool keeps_ratios, const float* radiance, const float* other_sky,
                int bounce);
    // sky: what the rays that have left last found there, one value a path.
    void find_sky(const float* sky);
    void finish(const float* radiance);

  private:
    size_t m_last = 0; // the first of the departures that came last
};

} // namespace kanuka::transport
