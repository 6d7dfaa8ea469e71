// Lights that diffuse lobes show more of, or less, than others do: RenderMan's and UsdLux's multipliers
// `diffuse` and `specular`. Like a light path expression, a multiplier needs to know which lobes turned a
// path towards the light; the split of f(wo, wi) is exact (docs/transport.md, "Light path expressions").
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "scene/lobe_multipliers.h"
#include "transport/path_shares.h"

namespace kanuka::transport {

using scene::LobeMultipliers;

// What an emitting primitive says of itself that its light does not.
struct AreaLight {
    LightLabel label;
    LobeMultipliers lobes;
    auto operator<=>(const AreaLight&) const = default;
};

// Of all lights of a scene.
struct LightMultipliers {
    std::vector<LobeMultipliers> of_light;      // by light - LightId::Least
    std::vector<LobeMultipliers> of_area_light; // by store::Links::area_light; the first: of what is none
    std::vector<int32_t> area_light;            // of each emitter of the store

    const LobeMultipliers& of(int light) const {
        return light < LightId::Least ? of_area_light[size_t(area_light[size_t(LightId::Least - 1 - light)])]
                                      : of_light[size_t(light - LightId::Least)];
    }
};

// What it takes to apply them to the paths of a batch: how each left its last vertex.
class LobeShares {
  public:
    using Spectrum4 = PathShares::Spectrum4;

    LobeShares(const LightMultipliers& lights, int paths)
        : m_lights(lights), m_diffuse(size_t(paths) * Wavelengths, Nothing) {}

    void begin() { std::ranges::fill(m_diffuse, Nothing); } // at the camera
    void scatter(int path, const PathShares::Event& event) {
        for (int k = 0; k < Wavelengths; k++)
            m_diffuse[size_t(path) * Wavelengths + size_t(k)] = diffuse_of(event, k);
    }
    // Of a light that a path came to by itself.
    void multiply(Spectrum4& radiance, int path, int light) const {
        for (int k = 0; k < Wavelengths; k++)
            radiance[k] *= shown(light, m_diffuse[size_t(path) * Wavelengths + size_t(k)]);
    }
    // And of one that was sampled. event: at the vertex that the shadow ray leaves.
    void multiply(Spectrum4& radiance, const PathShares::Event& event, int light) const {
        for (int k = 0; k < Wavelengths; k++)
            radiance[k] *= shown(light, diffuse_of(event, k));
    }

  private:
    static constexpr float Nothing = -1; // the camera, and volumes: neither lobe

    static float diffuse_of(const PathShares::Event& event, int k) {
        return event.in_volume ? Nothing : event.singular ? 0.0f : event.diffuse[k];
    }
    float shown(int light, float diffuse) const {
        const LobeMultipliers& by = m_lights.of(light);
        return diffuse < 0 ? 1.0f : by.specular + diffuse * (by.diffuse - by.specular);
    }

    const LightMultipliers& m_lights;
    std::vector<float> m_diffuse; // of what the last vertex sent this way, four a path
};

// Spectra of some lanes, one by one: change(lane, four values).
template <int W, class Change>
void change_lanes(Spectrum<W>& s, uint32_t bits, const Change& change) {
    alignas(64) float rows[Wavelengths][W];
    for (int k = 0; k < Wavelengths; k++)
        s[k].store(rows[k]);
    for (; bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        LobeShares::Spectrum4 one;
        for (int k = 0; k < Wavelengths; k++)
            one[k] = rows[k][i];
        change(i, one);
        for (int k = 0; k < Wavelengths; k++)
            rows[k][i] = one[k];
    }
    for (int k = 0; k < Wavelengths; k++)
        s[k] = Float<W>::load(rows[k]);
}

} // namespace kanuka::transport
