// What lights send to points, without what is in the way: for volume shaders, which look for light on their
// way, and for surfaces that do with light what no lobe does.
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
        scene::Light light; // of a shader: its name, and whether it casts shadows
        std::function<sl::Emission(grid::Grid&)> shader; // null = a standard one
    };
    // `make` is called when lights are asked for the first time.
    explicit PointLights(std::function<std::vector<One>()> make) : m_make(std::move(make)) {}

    int count() const { return int(all().size()); }
    const std::vector<One>& all() const;
    // Returns true for parallel light, whose L has no length.
    bool at(const sl::LightRequest& request, const Transform& current_from_world) const;

  private:
    std::function<std::vector<One>()> m_make;
    mutable std::once_flag m_made;
    mutable std::vector<One> m_all;
};

} // namespace kanuka::shade
