// What light there is and what sees it: lights, environment, air, camera and filter as transport has them.
#pragma once

#include <memory>
#include <vector>

#include "grid/air.h"
#include "render/world.h"
#include "transport/scene_data.h"

namespace kanuka::render {

class Lighting {
  public:
    Lighting(Job& job, World& world) : m_job(job), m_world(world) {}

    // Before build(). `log`: for all kernels; null = nobody asks.
    void log_footprints(transport::FootprintLog* log) { m_footprints = log; }
    void build();
    // The geometry has grown.
    void refresh();
    // Until refresh(). null = roulette as it is where nothing is known of the scene.
    void play_roulette(const transport::RouletteFactors* factors) { m_data.view.settings.roulette = factors; }

    const transport::SceneView& view() const { return m_data.view; }
    Digest key() const; // of all lights, with the pictures and tables that they have
    bool has_lights() const { return !m_inputs.lights.empty(); }

  private:
    void gather_lights();
    void place_filter();
    void place_lamps();

    Job& m_job;
    World& m_world;
    transport::SceneInputs m_inputs;
    transport::FootprintLog* m_footprints = nullptr;
    std::unique_ptr<film::Filter> m_filter;
    std::vector<float> m_shutter_quantiles; // empty = open all the time
    std::unique_ptr<grid::Air> m_air;       // null = there is none
    std::vector<scene::Light> m_linked_lamps;
    transport::SceneData m_data;
};

} // namespace kanuka::render
