// Multiple importance sampling (Veach 1997) at vertices on lights: docs/transport.md, "Wavelengths and
// weights".
#pragma once

#include "base/lanes.h"

namespace kanuka::transport {

// A vertex on a light that a direction found: the densities with which light sampling at the vertex before it
// would have made it.
template <int W>
struct PathVertex {
    using F = Float<W>;
    F pdf_light_choice{0.0f}; // of the light among all
    F pdf_area{0.0f};         // of the place on it, where that is how it is sampled
    F pdf_solid_angle{0.0f};  // of the direction to it, the choice included

    static PathVertex on_area(F pdf_light_choice, F pdf_area, F distance, F cosine) {
        return {pdf_light_choice, pdf_area,
                pdf_light_choice * pdf_area * distance * distance / max(cosine, F(1e-6f))};
    }
    static PathVertex in_direction(F pdf_light_choice, F pdf) {
        return {pdf_light_choice, F(0.0f), pdf_light_choice * pdf};
    }
    // What the light's contribution is multiplied by: the balance heuristic over both techniques and all
    // wavelengths. mis: PathQueue::Mis; ratios: their sum.
    F weight(F mis, F ratios) const { return F(1.0f) / fma(mis, pdf_solid_angle, ratios); }
};

} // namespace kanuka::transport
