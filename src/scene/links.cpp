#include "scene/links.h"

#include <algorithm>

namespace kanuka::scene {

std::shared_ptr<const Attributes> LightSwitch::on(const std::shared_ptr<const Attributes>& attributes) {
    if (!attributes || !attributes->lights_on)
        return attributes;
    auto& after = m_attributes[attributes];
    if (after)
        return after;
    const LightNames& names = attributes->lights_on;
    auto& all = m_sets[names];
    if (!all) {
        const bool are_on =
            std::ranges::all_of(m_lights, [&](const std::string& light) { return names->contains(light); });
        auto more = are_on ? nullptr : std::make_shared<std::set<std::string>>(*names);
        if (more)
            more->insert(m_lights.begin(), m_lights.end());
        all = more ? std::move(more) : names;
    }
    if (all == names)
        return after = attributes;
    auto changed = std::make_shared<Attributes>(*attributes);
    changed->lights_on = all;
    return after = std::move(changed);
}

bool LightSwitch::turn_on(Primitive& primitive) {
    std::shared_ptr<const Attributes> lit = on(primitive.attributes);
    if (lit == primitive.attributes)
        return false;
    primitive.attributes = std::move(lit);
    return true;
}

void LightSwitch::turn_on(Scene& scene, const std::function<void(NodeId)>& changed) {
    const auto all_of = [&](std::vector<Primitive>& primitives) {
        for (Primitive& p : primitives)
            if (turn_on(p) && changed)
                changed(p.node);
    };
    all_of(scene.primitives);
    for (Group& g : scene.groups)
        all_of(g.primitives);
}

} // namespace kanuka::scene
