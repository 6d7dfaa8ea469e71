// What an interior does to light, as lanes read it.
#pragma once

#include "base/lanes_math.h"
#include "base/sampling.h"
#include "transport/light_environment.h"

namespace kanuka::transport {

// What SceneView knows of each lane's medium; -1 = nothing is there.
template <int W>
struct MediumLanes {
    Spectrum<W> absorption, scattering; // 1/m
    Float<W> ior;
    Mask<W> scatters;
    Int<W> field; // see fields.h; -1 = the same everywhere. Then amounts are the most there are

    MediumLanes(const SceneView& scene, Int<W> medium, const Float<W> l[Wavelengths]) {
        using R = MediumRow;
        const auto row = load_rows<R::Fields>(scene.media.rows.data(), (medium + Int<W>(1)) << R::Shift);
        const auto amount = [&](size_t at) {
            return bsdf::sigmoid_spectrum(row[at], row[at + 1], row[at + 2], l) * row[at + 3];
        };
        absorption = amount(R::Absorption);
        scattering = amount(R::Scattering);
        const Float<W> power = row[R::Angstrom];
        if (any(power > Float<W>(0.0f)))
            for (int k = 0; k < Wavelengths; k++)
                scattering[k] =
                    scattering[k] *
                    exp2(power * log2(Float<W>(550.0f) / fma(l[k], Float<W>(470.0f), Float<W>(360.0f))));
        ior = row[R::Ior];
        scatters = row[R::Scatters] > Float<W>(0.0f);
        field = bitcast_int(row[R::Field]);
    }
    Float<W> extinction(int i) const { return absorption[i] + scattering[i]; }
    Float<W> thickest() const {
        return max(max(extinction(0), extinction(1)), max(extinction(2), extinction(3)));
    }
};

template <int W>
bsdf::Phase<W> phase_of(const SceneView& scene, int interior) {
    using F = Float<W>;
    const auto& of = scene.media.phases[size_t(interior)];
    return {of.kind, F(of.g[0]), F(of.other_g[0]), F(of.share[0]), F(of.alpha[0])};
}

// Density over the sphere, where each lane's interior scatters.
template <int W>
Float<W> phase_between(const SceneView& scene, Int<W> interior, Float<W> cosine, Mask<W> m) {
    Float<W> density(0.0f);
    while (any(m)) {
        const int one = interior[__builtin_ctz(m.bits())];
        const Mask<W> here = m & (interior == Int<W>(one));
        density = select(here, bsdf::eval_phase(phase_of<W>(scene, one), cosine), density);
        m &= !here;
    }
    return density;
}

} // namespace kanuka::transport
