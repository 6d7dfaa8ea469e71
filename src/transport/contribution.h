// How light leaves transport: all of it, whoever found it, by contribute().
#pragma once

#include "transport/path_state.h"
#include "transport/roulette.h"
#include "transport/scene_view.h"

namespace kanuka::transport {

// Light that paths found, a lane each.
template <int W>
struct Contribution {
    Int<W> path;
    Spectrum<W> radiance;           // weighted: see docs/transport.md
    Int<W> light{LightId::Surface}; // of LightsView::analytic, or a LightId; of_emitter()
    bool shown_diffusely = false;   // a surface shows it as if it reflected it diffusely, and nothing else
    int ray = -1;                   // the shadow ray of the first lane; -1 = none brought it
};

// For expressions, of which there are some.
template <int W>
[[gnu::noinline]] void share_out(PathShares& shares, const Contribution<W>& c, Float<W> scale, Mask<W> m) {
    for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        float radiance[Wavelengths];
        for (int k = 0; k < Wavelengths; k++)
            radiance[k] = c.radiance[k][i] * scale[i];
        if (c.ray >= 0)
            shares.add_ray(c.ray + i, c.path[i], radiance);
        else
            shares.add(c.path[i], radiance, c.light[i], c.shown_diffusely);
    }
}

// Light that paths came to by themselves, as the lobes that they left last show it. Of sampled light the
// shadow ray has it already.
template <int W>
[[gnu::noinline]] void multiply_by_lobes(const LobeShares& lobes, Contribution<W>& c, Mask<W> m) {
    change_lanes(c.radiance, m.bits(), [&](int i, LobeShares::Spectrum4& radiance) {
        lobes.multiply(radiance, c.path[i], c.light[i]);
    });
}

// Adds to the radiance of paths, each lane one of its own. The radiance of a contribution is the sum of its
// four parts, which are weighted among each other already.
template <int W>
void contribute(BatchState& batch, const Contribution<W>& found, Mask<W> m) {
    Contribution<W> c = found;
    if (batch.lobes && c.ray < 0) [[unlikely]] {
        Contribution<W> shown = found; // so that `c` itself may stay in registers
        multiply_by_lobes(*batch.lobes, shown, m);
        c = shown;
    }
    const Int<W> at = c.path << 2;
    Row<W, 4> sum = load_rows<4>(batch.radiance, at);
    Float<W> scale(1.0f);
    if (batch.limit < Unclamped) {
        const Float<W> whole = (c.radiance[0] + c.radiance[1]) + (c.radiance[2] + c.radiance[3]);
        const Float<W> limit(batch.limit);
        scale = select(whole > limit, limit / max(whole, Float<W>(1e-30f)), scale);
    }
    for (int k = 0; k < Wavelengths; k++)
        sum[size_t(k)] = fma(c.radiance[k], scale, sum[size_t(k)]);
    store_rows(batch.radiance[0], at, sum, m);
    if (batch.shares) [[unlikely]] {
        const Contribution<W> copy = c; // so that `c` itself may stay in registers
        share_out(*batch.shares, copy, scale, m);
    }
}

// Lanes may be of one path: one after the other, in their order, which is the same for any number of lanes.
template <int W>
void contribute_in_turn(BatchState& batch, const Contribution<W>& c, Mask<W> m) {
    for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        Contribution<1> one{
            Int<1>(c.path[i]), {}, Int<1>(c.light[i]), c.shown_diffusely, c.ray < 0 ? -1 : c.ray + i};
        for (int k = 0; k < Wavelengths; k++)
            one.radiance[k] = Float<1>(c.radiance[k][i]);
        contribute(batch, one, Mask<1>(true));
    }
}

// Of the shadow rays from `first_ray` on. Of a vertex there is one, unless lights far and near are sampled
// apart, light is sampled several times, lamps from within fog, or the sky or what a surface is lit by beside
// lights.
template <int W>
void contribute_shadow_rays(const SceneView& scene, BatchState& batch, Int<W> path, int first_ray,
                            const Spectrum<W>& radiance, Mask<W> m) {
    const Contribution<W> c{path, radiance, Int<W>(LightId::Surface), false, first_ray};
    const SettingsView& settings = scene.settings;
    const int lights = scene.lights.choices > 0 ? scene.lights.samples * settings.light_samples : 0,
              own = scene.lights.point_lights.empty() ? 0 : 1;
    const bool pairs = settings.first_pairs || (settings.roulette && settings.roulette->sky_pairs != 0);
    if (lights + own + int(pairs) > 1 || !scene.lights.fog_lamps.empty())
        contribute_in_turn(batch, c, m);
    else
        contribute(batch, c, m);
}

} // namespace kanuka::transport
