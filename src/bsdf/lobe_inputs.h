// What every lobe takes and gives. Local frame: +z is the shading normal on the side of wo, so wo.z > 0; wi.z
// < 0 is transmission; +x is the direction of dPdu where a lobe asks for it. Values are f(wo, wi) |cos wi|;
// densities are over solid angle of wi, one a wavelength, since dispersion bends each its own way.
#pragma once

#include "bsdf/lobe_tables.h"
#include "bsdf/microfacet.h"
#include "bsdf/spectral.h"
#include "grid/lobe_table.h"

namespace kanuka::bsdf {

using grid::color_of, grid::input_of, grid::number_of;
using grid::LobeId;

template <int W>
struct LobeInputs {
    // As declared: the lobe's colours and its floats, by color_of() and number_of().
    Spectrum<W> color[grid::MostColors];
    Float<W> number[grid::MostNumbers];
    uint32_t given = 0; // bits by input_of(): others have their defaults all over the material

    // Derived by prepare_lobe, once a hit; what they mean is the lobe's.
    Spectrum<W> eta;  // index behind / index on the side of wo, or a metal's index
    Spectrum<W> dip;  // below Schlick's curve, at its largest
    Spectrum<W> k;    // a metal's extinction
    Spectrum<W> gain; // c of lobe_tables.h
    Float<W> alpha, along, tail, axis_x, axis_y;
    Float<W> balance, balance_alpha, balance_eta; // s of wo; width and index that losses of interfaces go by
    Float<W> many_back, many_across;              // of interfaces: what several facets send to either side
    Float<W> film, film_index;                    // thickness in nm
    Mask<W> rough;                                // enough for light to meet several facets
    Mask<W> disperses{false};                     // wavelengths go ways of their own
    Mask<W> walks{false};                         // light between facets by walks: microsurface.h
    Float<W> spread, below; // part of samples that a cosine lobe draws, and of those below
    StretchedCell<W> cell;
    const Float<W>* l = nullptr;     // normalised wavelengths
    const Float<W>* outer = nullptr; // index of refraction of what is outside; null = 1, nothing
    bool dispersive = false, stretched = false, has_film = false, compensated = false, has_walks = false;
    bool has_spread = false;

    bool has(int input) const { return given >> input & 1; }
    Float<W> wavelength(int i) const { return fma(l[i], Float<W>(470.0f), Float<W>(360.0f)); } // nm
};

template <int W>
struct LobeValue {
    Spectrum<W> f; // f |cos wi|
    Spectrum<W> pdf;
};

template <int W>
struct LobeSample {
    Vec3<Float<W>> wi;
    Mask<W> valid;
    Mask<W> delta;      // f and pdf are those of a single direction: only their ratio has meaning
    LobeValue<W> value; // for delta lanes; others are evaluated with all lobes of the material
    Int<W> leaf{0};     // number of the lobe among the material's
};

template <int W>
LobeValue<W> no_value() {
    return {Spectrum<W>(Float<W>(0.0f)), Spectrum<W>(Float<W>(0.0f))};
}

template <int W>
LobeSample<W> sample_of(const Vec3<Float<W>>& wi) {
    LobeSample<W> s;
    s.wi = wi;
    s.valid = Mask<W>(true);
    s.delta = Mask<W>(false);
    return s;
}

template <int W>
Vec3<Float<W>> sample_cosine(Float<W> u0, Float<W> u1) {
    Float<W> s, c;
    sincos_2pi(u0, s, c);
    const Float<W> r = sqrt(u1);
    return {r * c, r * s, sqrt(max(Float<W>(1.0f) - u1, Float<W>(1e-8f)))};
}

} // namespace kanuka::bsdf
