// Lights that a scene gets when it is there already. Files say by name which lights are on for a primitive
// (Attributes::lights_on); what comes later is in none of those sets.
#pragma once

#include <functional>

#include "scene/scene.h"

namespace kanuka::scene {

// Turns lights on for primitives of attributes that share their sets. Copies of these share as they did, and
// those that others hold stay as they are.
class LightSwitch {
  public:
    explicit LightSwitch(std::vector<std::string> lights) : m_lights(std::move(lights)) {}
    // The same where they are on already.
    std::shared_ptr<const Attributes> on(const std::shared_ptr<const Attributes>& attributes);
    bool turn_on(Primitive& primitive); // false: they were on
    // In the world and in groups; `changed` hears of each.
    void turn_on(Scene& scene, const std::function<void(NodeId)>& changed = {});

  private:
    using LightNames = std::shared_ptr<const std::set<std::string>>;
    std::vector<std::string> m_lights;
    // Those before are kept, so that no other takes their place in memory.
    std::map<std::shared_ptr<const Attributes>, std::shared_ptr<const Attributes>> m_attributes;
    std::map<LightNames, LightNames> m_sets;
};

} // namespace kanuka::scene
