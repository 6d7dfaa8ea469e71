// The pilot that finds out how roulette fits a scene.
#pragma once

#include <optional>

#include "transport/roulette.h"

namespace kanuka::transport {

class Kernel;
struct SettingsView;

// Sends some paths over the whole picture. Any of its batches may be traced by any thread; what is learned
// depends on the scene alone.
class RoulettePilot {
  public:
    RoulettePilot(int width, int height); // of the whole picture, whatever is cropped
    static bool is_wanted(const SettingsView& settings);

    size_t batches() const { return m_batches.size() / Samples; }
    // For a kernel whose settings have Weak. Returns the number of rays.
    uint64_t trace(size_t batch, Kernel& kernel);
    // None: too few paths go on, or they find no light.
    std::optional<RouletteFactors> learn() const;

    // None in the first bounces: of what roulette does to E[L²] later, what is learned would have less. Then
    // enough that paths in media end. All bounces have pairs.
    static constexpr RouletteFactors Weak{{1e6f, 1e6f, 1e6f, 1e6f, 1e6f, 1e6f, 1e6f, 4}, 0xff};
    static constexpr int Samples = 4; // a place: by what they differ, paths have variance

  private:
    int m_across, m_down; // places
    std::vector<PilotBatch::Place> m_places;
    std::vector<PilotBatch> m_batches; // of some places, each of their samples in turn
};

// From what the paths of batches did. Places lie row by row, `across` of them a row; batches as in
// RoulettePilot.
std::optional<RouletteFactors> learn_roulette(std::span<const PilotBatch> batches, int samples, int across);

} // namespace kanuka::transport
