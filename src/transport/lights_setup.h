// Prepares what kernels read of lights.
#pragma once

#include "transport/scene_data.h"

namespace kanuka::transport {

// All of LightsView. Geometry, settings and media must be there.
void fill_lights(SceneData& data, const SceneInputs& in, color::Palette& palette, Journal& journal);

// ---- its parts

// Any non-negative RGB as scale * S(lambda): twice the maximum, to stay where spectra are smooth.
void uplift_amount(const Rgb& rgb, const color::Palette& palette, float out[4]);
bool usable(const Rgb& amount);

void fill_map(SceneData& data, const LatLong& picture, const scene::Light& light,
              const Transform& render_from_world);
// Analytic lights, those that are choices of their own first; and portals.
class AnalyticFiller {
  public:
    AnalyticFiller(SceneData& data, const SceneInputs& in, color::Palette& palette, Journal& journal)
        : m_data(data), m_in(in), m_palette(palette), m_journal(journal) {}
    void add(const scene::Light& light);
    void finish();

  private:
    SceneData& m_data;
    const SceneInputs& m_in;
    color::Palette& m_palette;
    Journal& m_journal;
    LargeVector<AnalyticLight> m_far, m_near;
    std::vector<LightBound> m_far_bounds, m_near_bounds;
};
// The hierarchy over emitting triangles and analytic lights, or the alias table where one patch is all there
// is.
void fill_emitters(SceneData& data, const SceneInputs& in);

} // namespace kanuka::transport
