// The dicing oracle: how finely each part of each primitive is looked at, by the camera, in mirrors and
// through glass, by bounces and in shadows. A quick render records it (integrator `footprints`); later ones
// dice by it: less where no ray looks closely, finer where something magnifies (docs/dice.md, "The oracle").
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/digest.h"
#include "dice/density.h"
#include "dice/density_field.h"
#include "render/group_views.h"
#include "scene/scene.h"
#include "transport/footprint_log.h"

namespace kanuka::render {

// By name and number: of a scene that was edited, what is still called the same keeps what was found.
Digest oracle_key(const scene::Primitive& primitive);

// What was found. Thread safety: const members may run at the same time.
class DicingOracle {
  public:
    static constexpr int Cells = dice::DensityField::Cells;
    using Lattice = std::array<uint8_t, size_t(Cells) * Cells * Cells>; // codes of factors; x runs fastest
    // Factors in steps of half an octave; 0 = no ray came here.
    static constexpr int StepsAnOctave = 2, One = 128;
    static constexpr float Least = 1.0f / 8, Most = 4;
    static constexpr int Codes = 5 * StepsAnOctave + 1, LeastCode = One - 3 * StepsAnOctave;
    static uint8_t code_of(float factor); // rounded up
    static float factor_of(uint8_t code);

    void add(const Digest& key, const Lattice* lattice); // null = nobody has seen it
    // Factors for a primitive; null = it is unknown, or all are 1.
    std::unique_ptr<const dice::DensityField> field(const scene::Primitive& primitive) const;
    size_t primitives() const { return m_known.size(); }
    size_t seen() const { return m_lattices.size(); }

    // The file appears under its name whole or not at all. Throw Error.
    void save(const std::string& path) const;
    static DicingOracle load(const std::string& path);

  private:
    std::map<Digest, int64_t> m_known; // place among the lattices; -1 = not seen
    std::vector<Lattice> m_lattices;
};

// Hits of a quick render, primitive by primitive: of each cell of its box how finely rays want it, over what
// the camera asks for there. A tenth of the rays may want it finer than it becomes: those that are about to
// come to a focus, and others of no weight. Counts do not depend on the order of hits.
class OracleRecorder final : public transport::FootprintLog {
  public:
    // `camera`: that primitives of the world are diced for, in render space. What moves is not recorded.
    OracleRecorder(const scene::Scene& scene, const Transform& render_from_world,
                   const dice::DiceOptions& options);
    ~OracleRecorder() override;

    void note(const transport::Footprint& footprint) override;
    float pixel_spread() const override { return m_pixel_spread; }
    DicingOracle result() const;

  private:
    struct Seen;
    struct Entry {
        Digest key;
        int space = 0;               // of m_spaces
        Transform object_from_shape; // the space of hits
        Vec3f lower{0, 0, 0}, per_unit{0, 0, 0};
        std::atomic<Seen*> seen{nullptr};
    };
    void add(const scene::Primitive& primitive, const Transform& space_from_parent, int space);

    float m_pixel_spread = 0;
    std::vector<std::unique_ptr<dice::Density>> m_spaces; // the world, then groups
    std::vector<std::unique_ptr<Entry>> m_entries;        // by id
    std::mutex m_mutex;
    std::vector<std::unique_ptr<Seen>> m_all;
};

} // namespace kanuka::render
