// Interiors and air, as kernels read them.
#pragma once

#include <cstdint>
#include <span>

#include "bsdf/phase.h"
#include "grid/air.h"

namespace kanuka::transport {

// An interior, as lanes read it.
struct MediumRow {
    enum Field {
        Absorption = 0, // c0 c1 c2 scale, as store::Interior
        Scattering = 4,
        Ior = 8,
        Priority = 9,
        Scatters = 10, // 1 or 0
        Angstrom = 11, // scattering goes with (550 nm / wavelength) to this power
        Field = 12,    // bits of the place in MediaView::fields; -1 = the same everywhere
        Fields = 16
    };
    static constexpr int Shift = 4; // rows are 16 floats apart
};

struct MediaView {
    std::span<const bsdf::Phase<1>> phases; // of interiors
    std::span<const float> rows;            // MediumRow, of nothing, then of each interior
    std::span<const float> fields;          // see fields.h; empty = all interiors are the same everywhere
    // Paths keep track of the media around them: there are several interiors, or one that absorbs or
    // scatters, or one whose boundary lets light pass as it comes (`clear`: by program, no lobes).
    bool tracked = false, scatters = false, clear_boundaries = false;
    bool has_fog = false; // something scatters that is the same everywhere
    std::span<const int32_t> clear;
    // Some materials let light go on as it came (`straight`: by program): shadow rays scale by how much.
    bool thin_walls = false;
    std::span<const int32_t> straight;
    int32_t around_camera[4] = {-1, -1, -1, -1}; // as MediaStack has it

    const grid::Air* air = nullptr; // null = there is none; set once the view is there, which it reads
    std::span<const int> airs;      // that materials lie behind
};

} // namespace kanuka::transport
