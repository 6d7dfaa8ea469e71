#include "render/linking.h"

#include <algorithm>

namespace kanuka::render {

namespace {

constexpr int MostSets = 31, MostPasses = 30;
constexpr int32_t PassesAll = 1 << 30; // of all lights: through what casts no shadows

std::set<std::string> words(const std::string& text) {
    std::set<std::string> all;
    size_t at = 0;
    while ((at = text.find_first_not_of(" \t\n,", at)) != std::string::npos) {
        const size_t end = std::min(text.find_first_of(" \t\n,", at), text.size());
        all.insert(text.substr(at, end - at));
        at = end;
    }
    return all;
}

std::set<std::string> set_of(const std::vector<std::string>& names) {
    return {names.begin(), names.end()};
}

bool named(const std::set<std::string>& by, const std::string& name, const std::string& group) {
    if (!name.empty() && by.contains(name))
        return true;
    if (group.empty())
        return false;
    const auto groups = words(group);
    return std::any_of(groups.begin(), groups.end(), [&](const std::string& g) { return by.contains(g); });
}

// Lights without a name are told apart by their group.
std::string key_of(const std::string& name, const std::string& group) {
    return name.empty() ? "\n" + group : name;
}

std::string area_light_name(const scene::Attributes& a) {
    if (!a.area_light)
        return {};
    return a.area_light->handle.empty() ? a.name : a.area_light->handle;
}

std::string area_light_group(const scene::Attributes& a) {
    return a.area_light->parameters.get_string("group", a.area_light->parameters.get_string("__group", ""));
}

} // namespace

Linking::Linking(const scene::Scene& scene, Journal& journal) {
    // Nearly always there is nothing to link; then this costs a look at each primitive's attributes.
    for (const scene::ShaderRef& s : scene.light_shaders)
        add_names(s.handle, s.parameters.get_string("group", s.parameters.get_string("__group", "")), false);
    for (const scene::Light& l : scene.lights)
        add_names(l.name, l.group, false);
    const auto area_lights = [&](const std::vector<scene::Primitive>& primitives) {
        const scene::Attributes* last = nullptr;
        for (const scene::Primitive& p : primitives)
            if (p.attributes && p.attributes.get() != last) {
                last = p.attributes.get();
                if (last->area_light)
                    add_names(area_light_name(*last), area_light_group(*last), true);
            }
    };
    area_lights(scene.primitives);
    for (const scene::Group& g : scene.groups)
        area_lights(g.primitives);
    m_sets[{}] = 1;
    add_primitives(scene.primitives, journal);
    for (const scene::Group& g : scene.groups)
        add_primitives(g.primitives, journal);
    for (auto& [attributes, links] : m_links) // sets are complete now
        if (attributes->area_light) {
            const std::string key = key_of(area_light_name(*attributes), area_light_group(*attributes));
            links.shone_sets = m_names[size_t(m_index.at(key))].lit_sets;
        }
}

void Linking::add_names(const std::string& name, const std::string& group, bool mesh) {
    const auto [at, added] = m_index.try_emplace(key_of(name, group), int(m_names.size()));
    if (added)
        m_names.push_back({name, group, mesh});
    else if (!name.empty() && !group.empty())
        m_names[size_t(at->second)].group += " " + group;
}

void Linking::add_primitives(const std::vector<scene::Primitive>& primitives, Journal& journal) {
    for (const scene::Primitive& p : primitives) {
        const scene::Attributes* a = p.attributes.get();
        if (!a || m_links.contains(a))
            continue;
        store::Links links;
        const std::vector<int> dark = off(*a);
        const auto known = m_sets.find(dark);
        if (known != m_sets.end()) {
            links.lit_sets = known->second;
        } else if (m_sets.size() > MostSets) {
            journal.warning(p.where,
                            "more than 31 combinations of lights are off for some primitives: from here "
                            "on, all lights shine on those of others");
        } else {
            const int32_t bit = int32_t(1u << m_sets.size());
            m_sets[dark] = links.lit_sets = bit;
            for (int k : dark)
                m_names[size_t(k)].lit_sets &= ~bit;
        }
        links.lets_through = passes(*a, p.where, journal);
        see(*a, links);
        if (a->area_light)
            links.area_light = number_area_light(*a);
        m_links[a] = links;
    }
}

int32_t Linking::number_area_light(const scene::Attributes& a) {
    const scene::ValueList& given = a.area_light->parameters;
    transport::AreaLight light{
        {area_light_name(a), area_light_group(a)},
        {std::max(0.0f, given.get_float("diffuse", 1)), std::max(0.0f, given.get_float("specular", 1))}};
    const auto [at, added] = m_area_light_numbers.try_emplace(light, int32_t(m_area_lights.size()) + 1);
    if (added)
        m_area_lights.push_back(std::move(light));
    return at->second;
}

void Linking::see(const scene::Attributes& a, store::Links& links) {
    if (a.sides == 1)
        links.seen |= store::Links::OneSided;
    if (a.matte)
        links.seen |= store::Links::HeldOut;
    if (!a.visible_camera)
        links.seen |= store::Links::Unseen;
    links.level_from = a.level_from, links.level_to = a.level_to;
}

std::vector<int> Linking::off(const scene::Attributes& a) {
    const std::set<std::string> only = set_of(a.lights_only), not_by = set_of(a.lights_off);
    std::vector<int> dark;
    if (!a.lights_on && only.empty() && not_by.empty())
        return dark;
    const bool plain = only.empty() && not_by.empty();
    if (plain && a.lights_on == m_last_on)
        return m_last_dark;
    for (size_t k = 0; k < m_names.size(); k++) {
        const Name& n = m_names[k];
        // Illuminate turns sources off; area lights it leaves alone.
        const bool turned_off = a.lights_on && !n.mesh && !a.lights_on->contains(n.name);
        if (turned_off || (!only.empty() && !named(only, n.name, n.group)) || named(not_by, n.name, n.group))
            dark.push_back(int(k));
    }
    if (plain)
        m_last_on = a.lights_on, m_last_dark = dark;
    return dark;
}

int32_t Linking::passes(const scene::Attributes& a, const Location& where, Journal& journal) {
    const std::set<std::string> through = set_of(a.shadows_off);
    int32_t bits = a.casts_shadows ? 0 : PassesAll;
    m_shadowless |= bits != 0;
    if (through.empty())
        return bits;
    for (Name& n : m_names) {
        if (!named(through, n.name, n.group))
            continue;
        if (n.mesh) {
            journal.warning(where,
                            "\"shadow:excludesubset\" names the area light \"" + n.name +
                                "\": shadows of lights that are geometry cannot be turned off; use a quad, "
                                "disk, sphere or cylinder light");
            continue;
        }
        if (n.passes == 0) {
            if (m_passes >= MostPasses) {
                journal.warning(where, "more than 30 lights shine through some primitives; light \"" +
                                           n.name + "\" casts all shadows");
                continue;
            }
            n.passes = int32_t(1u << m_passes++);
        }
        bits |= n.passes;
    }
    return bits;
}

void Linking::add(const scene::Scene& part, Journal& journal) {
    add_primitives(part.primitives, journal);
    for (const scene::Group& g : part.groups)
        add_primitives(g.primitives, journal);
}

store::Links Linking::of(const scene::Attributes* attributes) const {
    const auto found = m_links.find(attributes);
    return found == m_links.end() ? store::Links{} : found->second;
}

void Linking::apply(std::vector<scene::Light>& lights) const {
    for (scene::Light& light : lights)
        if (const auto at = m_index.find(key_of(light.name, light.group)); at != m_index.end()) {
            light.lit_sets = m_names[size_t(at->second)].lit_sets;
            light.passes = m_names[size_t(at->second)].passes;
        }
    if (m_shadowless)
        for (scene::Light& light : lights)
            light.passes |= PassesAll;
}

} // namespace kanuka::render
