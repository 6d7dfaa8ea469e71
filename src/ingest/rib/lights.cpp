#include "ingest/rib/lights.h"

#include "ingest/rib/dialects/lights.h"

namespace kanuka::ingest {

void scale_color(scene::ValueList& parameters, std::string_view name, const Rgb& factor) {
    const Rgb color = parameters.get_color(name, Rgb(1)) * factor;
    scene::Value v;
    v.name = name;
    v.type = scene::Type::Color;
    v.floats = std::vector<float>{color.x, color.y, color.z};
    parameters.set(std::move(v));
}

void Lights::mean(const std::string& handle, int light) {
    std::vector<int>& meant = m_handles[handle];
    // Of area lights one will do, and they are no lights to go with a frame.
    if (meant.empty() || meant.back() != light)
        meant.push_back(light);
}

int Lights::meant(const std::string& handle) const {
    const auto known = m_handles.find(handle);
    return known == m_handles.end() ? Unknown : known->second.back();
}

int Lights::add(scene::ShaderRef shader) {
    const int index = int(m_lights.size());
    // Objects name their lights: a handle that is used again must not stand for two.
    mean(shader.handle, index);
    if (const int uses = ++m_uses[shader.handle]; uses > 1)
        shader.handle += "#" + std::to_string(uses);
    m_lights.push_back(std::move(shader));
    return index;
}

static void turn_on(int light, AttributeState& attributes) {
    auto on = std::make_shared<LightSet>(*attributes.lights);
    on->insert(light);
    attributes.lights = std::move(on);
}

void Lights::declare(scene::ShaderRef shader, AttributeState& attributes) {
    turn_on(add(std::move(shader)), attributes);
}

void Lights::declare_everywhere(scene::ShaderRef shader, const std::vector<AttributeState*>& states) {
    const int index = add(std::move(shader));
    for (const auto& [lights, names] : m_seen)
        names->insert(m_lights[size_t(index)].handle);
    for (AttributeState* state : states)
        turn_on(index, *state);
}

void Lights::illuminate(const std::string& handle, bool on, AttributeState& attributes, Reports& reports,
                        const Location& where) {
    const int light = meant(handle);
    if (light == Unknown) {
        reports.error("Illuminate of an unknown light", where,
                      "Illuminate \"" + handle +
                          "\": no light source has this handle; declare it by LightSource first");
        return;
    }
    if (light == AreaLight) {
        if (!on)
            reports.once(Severity::Warning, "Illuminate area light", where,
                         "Illuminate turns no area lights off; write Attribute \"lighting\" \"string "
                         "excludesubset\" with "
                         "the light's handle instead");
        return;
    }
    if (!on)
        m_switched_off.insert(light);
    if (attributes.lights->contains(light) == on)
        return;
    auto changed = std::make_shared<LightSet>(*attributes.lights);
    if (on)
        changed->insert(light);
    else
        changed->erase(light);
    attributes.lights = std::move(changed);
}

void Lights::set_parameters(const Location& where, const scene::ValueList& parameters) {
    for (scene::ShaderRef& light : m_lights)
        if (light.where.line == where.line && light.where.column == where.column &&
            light.where.file == where.file)
            light.parameters = parameters;
}

bool Lights::filter(const std::string& light, const std::string& filter, const Rgb& factor, bool on) {
    const int filtered = meant(light);
    if (filtered == Unknown || filtered == AreaLight)
        return false;
    if (on)
        m_filters[filtered][filter] = factor;
    else
        m_filters[filtered].erase(filter);
    return true;
}

void Lights::shine(AttributeState& attributes) {
    if (attributes.lights != m_last) {
        m_last = attributes.lights;
        auto& names = m_seen[m_last];
        if (!names) {
            auto on = std::make_shared<std::set<std::string>>();
            for (int light : *m_last)
                on->insert(m_lights[size_t(light)].handle);
            names = std::move(on);
        }
        m_names = names;
    }
    if (attributes.shared->lights_on != m_names)
        attributes.edit(0).lights_on = m_names;
}

void Lights::shine_on(const AttributeState& attributes) {
    if (attributes.lights == m_last)
        return;
    AttributeState copy;
    copy.lights = attributes.lights;
    shine(copy);
}

void Lights::place(const Transform& world_from_camera) {
    for (scene::ShaderRef& light : m_lights)
        scene::transform_shader(world_from_camera, light);
}

void Lights::truncate(size_t size) {
    m_lights.resize(std::min(size, m_lights.size()));
    // A handle means again what it meant before them.
    for (auto& [handle, lights] : m_handles)
        m_uses[handle] -= int(std::erase_if(lights, [&](int light) { return light >= int(size); }));
    std::erase_if(m_handles, [](const auto& entry) { return entry.second.empty(); });
    std::erase_if(m_uses, [&](const auto& entry) { return !m_handles.contains(entry.first); });
    std::erase_if(m_filters, [&](const auto& entry) { return entry.first >= int(size); });
    std::erase_if(m_switched_off, [&](int light) { return light >= int(size); });
}

std::vector<scene::ShaderRef> Lights::finish(Reports& reports) const {
    std::vector<scene::ShaderRef> lit;
    for (size_t i = 0; i < m_lights.size(); i++) {
        size_t on = 0;
        for (const auto& seen : m_seen)
            on += seen.first->contains(int(i)) || seen.second->contains(m_lights[i].handle);
        const scene::ShaderRef& light = m_lights[i];
        const std::string what = "LightSource \"" + light.name + "\" \"" + light.handle + "\"";
        if (on == 0 && !m_seen.empty()) {
            if (!m_switched_off.contains(int(i)))
                reports.warning("light that is never on", light.where,
                                what + " is on for no primitive and was left out; a light declared between "
                                       "AttributeBegin and AttributeEnd needs Illuminate after them");
            continue;
        }
        lit.push_back(light);
        if (const auto filters = m_filters.find(int(i)); filters != m_filters.end())
            for (const auto& [handle, factor] : filters->second)
                scale_color(lit.back().parameters, "lightcolor", factor);
        lit.back().stand_in = dialects::stand_in_for_light(lit.back());
    }
    return lit;
}

} // namespace kanuka::ingest
