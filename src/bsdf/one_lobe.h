// A lobe by itself, for scripts and pictures of lobes: evaluated and sampled at directions that are given.
// Colours are taken as they are, each of the three as one wavelength.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"
#include "grid/lobe_table.h"

namespace kanuka::bsdf {

class OneLobe {
  public:
    // Of the three colours, in nm, where a lobe disperses light or has a film.
    static constexpr float WavelengthsNm[3] = {610, 550, 465};

    // One value for each input as declared; none = its default. Lobes that scatter at surfaces alone.
    OneLobe(grid::LobeId id, std::vector<std::optional<Vec3f>> inputs)
        : m_id(id), m_inputs(std::move(inputs)) {}
    grid::LobeId id() const { return m_id; }
    static bool is_of_surfaces(const grid::LobeDecl& decl);

    // Directions are unit vectors that point away from the surface, whose outside is +z; a wo below it sees
    // the inside. All spans are as long as wo.
    struct Values {
        std::span<Vec3f> value; // f |cos wi|
        std::span<float> pdf;   // over solid angle, the mean over the three wavelengths
    };
    void evaluate(std::span<const Vec3f> wo, std::span<const Vec3f> wi, const Values& to) const;
    // u: three numbers from 0 to 1 each, of which the first chooses, the wavelength that decides the way
    // among others. Of a single direction (`delta`) value / pdf alone has a meaning. What is not `valid` was
    // absorbed.
    struct Samples {
        Values values;
        std::span<Vec3f> wi;
        std::span<uint8_t> valid, delta;
    };
    void sample(std::span<const Vec3f> wo, std::span<const Vec3f> u, const Samples& to) const;
    // The fraction of light from wo that is scattered, as sampling and layers estimate it.
    void albedo(std::span<const Vec3f> wo, std::span<Vec3f> to) const;

  private:
    grid::LobeId m_id;
    std::vector<std::optional<Vec3f>> m_inputs;
};

} // namespace kanuka::bsdf
