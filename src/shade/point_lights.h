// What lights send to points, asked while shading: for volume shaders, which look for light on their way.
// Without shadows: nothing is there yet that could cast them.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "scene/scene.h"
#include "sl/sl.h"

namespace kanuka::shade {

class PointLights {
  public:
    // One of RISpec's standard lights, or the scene's own shader, which is run at the points; all in world
    // space.
    struct One {
        scene::Light light;
        std::function<sl::Emission(grid::Grid&)> shader; // null = a standard one
    };
    // `make` is called when lights are asked for the first time.
    explicit PointLights(std::function<std::vector<One>()> make) : m_make(std::move(make)) {}

    int count() const { return int(all().size()); }
    void at(const sl::LightRequest& request, const Transform& current_from_world) const;

  private:
    const std::vector<One>& all() const;

    std::function<std::vector<One>()> m_make;
    mutable std::once_flag m_made;
    mutable std::vector<One> m_all;
};

} // namespace kanuka::shade
