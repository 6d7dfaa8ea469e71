#include "ingest/rib/lights.h"

namespace kanuka::ingest {

void Lights::declare(scene::ShaderRef shader, AttributeState& attributes) {
    const int index = int(m_lights.size());
    m_handles[shader.handle] = index;
    m_lights.push_back(std::move(shader));
    auto on = std::make_shared<LightSet>(*attributes.lights);
    on->insert(index);
    attributes.lights = std::move(on);
}

void Lights::illuminate(const std::string& handle, bool on, AttributeState& attributes, Reports& reports,
                        const Location& where) {
    const auto known = m_handles.find(handle);
    if (known == m_handles.end()) {
        reports.error("Illuminate of an unknown light", where,
                      "Illuminate \"" + handle +
                          "\": no light source has this handle; declare it by LightSource first");
        return;
    }
    if (known->second == AreaLight) {
        if (!on)
            reports.once(Severity::Warning, "Illuminate area light", where,
                         "Illuminate cannot turn area lights off yet: leave out the AreaLightSource instead");
        return;
    }
    if (attributes.lights->contains(known->second) == on)
        return;
    auto changed = std::make_shared<LightSet>(*attributes.lights);
    if (on)
        changed->insert(known->second);
    else
        changed->erase(known->second);
    attributes.lights = std::move(changed);
}

void Lights::shine(const AttributeState& attributes) {
    if (attributes.lights == m_last)
        return;
    m_last = attributes.lights;
    m_seen.insert(m_last);
}

void Lights::place(const Transform& world_from_camera) {
    for (scene::ShaderRef& light : m_lights)
        scene::transform_shader(world_from_camera, light);
}

void Lights::truncate(size_t size) {
    m_lights.resize(std::min(size, m_lights.size()));
    std::erase_if(m_handles, [&](const auto& entry) { return entry.second >= int(size); });
}

std::vector<scene::ShaderRef> Lights::finish(Reports& reports) const {
    std::vector<scene::ShaderRef> lit;
    for (size_t i = 0; i < m_lights.size(); i++) {
        size_t on = 0;
        for (const auto& seen : m_seen)
            on += seen->contains(int(i));
        const scene::ShaderRef& light = m_lights[i];
        const std::string what = "LightSource \"" + light.name + "\" \"" + light.handle + "\"";
        if (on == 0 && !m_seen.empty()) {
            reports.warning(
                "light that is never on", light.where,
                what + " is on for no primitive and was left out; a light declared between AttributeBegin "
                       "and AttributeEnd needs Illuminate after them");
            continue;
        }
        if (on < m_seen.size())
            reports.once(Severity::Info, "light linking", light.where,
                         what +
                             " is on for some primitives only, but shines on all: lights per object are not "
                             "supported yet");
        lit.push_back(light);
    }
    return lit;
}

} // namespace kanuka::ingest
