// What materials reflect at the vertices of the store, as RGB: for programs that have no spectra.
#pragma once

#include <array>
#include <vector>

#include "bsdf/material_code.h"
#include "color/palette.h"
#include "store/store.h"
#include "transport/scene_view.h"

namespace kanuka::render {

// The directional albedo of a material that is seen along its normal: all of what is scattered of white light
// from there, reflected or let through, in linear Rec.709. (The layer `albedo` has the same along the
// camera's rays.) Thread safety: const members may run at the same time.
class Albedos {
  public:
    // Both must outlive it.
    Albedos(const store::Store& store, const color::Palette& palette);

    Rgb at(int shape, int vertex) const; // of the record
    // Does a shape have more than one colour?
    bool varies(int shape) const;
    // In the space of the shape; zero where it has none.
    Vec3f normal(int shape, int vertex) const;

  private:
    static constexpr size_t Bands = 32; // groups of four are looked at together
    const store::Store& m_store;
    std::vector<bsdf::MaterialCode> m_codes; // by program
    std::vector<float> m_tables;             // of the palette
    transport::SceneView m_view;
    std::array<float, Bands> m_wavelengths{};          // normalised
    std::array<std::array<float, 3>, Bands> m_share{}; // what a reflectance of 1 there adds to the RGB
};

} // namespace kanuka::render
