// Russian roulette at the vertices of paths.
#pragma once

#include "base/sampling.h"
#include "transport/roulette.h"
#include "transport/surface_hit.h"

namespace kanuka::transport {

// Null: the first progression comes before anything is learned.
inline const RouletteFactors* learned_at(const SettingsView& settings, uint32_t reversed_progression) {
    return reversed_progression == 0 ? nullptr : settings.roulette;
}

template <int W>
class Roulette {
    using F = Float<W>;
    using M = Mask<W>;
    using S = Spectrum<W>;

  public:
    // in_medium: the vertices are no surface's.
    Roulette(const SettingsView& settings, const Sampler<W>& sampler, int bounce, bool in_medium)
        : m_sampler(sampler), m_bounce(bounce), m_in_medium(in_medium),
          m_factors(learned_at(settings, sampler.reversed_index)),
          m_plays(m_factors || bounce >= settings.roulette_depth) {}

    // Some of the paths of m end here; the others carry the light of those along. ratios: summed, as they are
    // when the paths go on.
    void play(S& throughput, F ratios, M& m) const {
        if (!m_plays)
            return;
        const F keep = survival(bsdf::max_component(throughput) * F(float(Wavelengths)) / ratios);
        if (!any(m & !(keep >= F(1.0f)))) // often, and a random number costs more
            return;
        m &= m_sampler.sample_1d(bounce_net(m_bounce, Net::Roulette)) < keep;
        throughput = throughput * (F(1.0f) / max(keep, F(1e-6f)));
    }

  private:
    // relative: the throughput of a path, relative to its start.
    F survival(F relative) const {
        if (m_factors)
            return min(F(m_factors->after(m_bounce, m_in_medium)) * relative, F(1.0f));
        if (m_in_medium) // no upper bound as at surfaces: clouds take long
            return min(relative, F(1.0f));
        // The square root keeps more of the dim ones: what it adds to the time is less than what it takes
        // from the noise (docs/transport.md, "Russian roulette").
        return min(sqrt(relative), F(0.95f));
    }

    const Sampler<W>& m_sampler;
    int m_bounce;
    bool m_in_medium;
    const RouletteFactors* m_factors; // null = none have been learned
    bool m_plays;
};

} // namespace kanuka::transport
