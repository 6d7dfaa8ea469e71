// Light sources and what they shine on.
#pragma once

#include <map>

#include "ingest/rib/reports.h"
#include "ingest/rib/state.h"

namespace kanuka::ingest {

// A colour parameter times a factor; white where it is not given.
void scale_color(scene::ValueList& parameters, std::string_view name, const Rgb& factor);

class Lights {
  public:
    // Adds a light and turns it on in `attributes`. A handle used again means the newer light from here on.
    void declare(scene::ShaderRef shader, AttributeState& attributes);
    // The same of a light that shines on everything, wherever it is declared: on for the primitives so far,
    // and turned on in the states of all open blocks, which Illuminate may change.
    void declare_everywhere(scene::ShaderRef shader, const std::vector<AttributeState*>& states);
    // New parameters for the lights that were declared at a place.
    void set_parameters(const Location& where, const scene::ValueList& parameters);
    // EnableLightFilter: a light's colour is multiplied by the factors that are on. False: there is no such
    // light.
    bool filter(const std::string& light, const std::string& filter, const Rgb& factor, bool on);
    // AreaLightSource: known by its handle, but lit by its primitives.
    void declare_area(const std::string& handle) {
        mean(handle, AreaLight);
        m_uses.try_emplace(handle, 1);
    }
    void illuminate(const std::string& handle, bool on, AttributeState& attributes, Reports& reports,
                    const Location& where);
    // A primitive is declared under this attribute state.
    void shine(AttributeState& attributes);
    // Primitives may come under it later.
    void shine_on(const AttributeState& attributes);
    // WorldBegin: what was declared in camera space gets its place in the world.
    void place(const Transform& world_from_camera);
    // The lights that are on for at least one primitive, in order of declaration.
    std::vector<scene::ShaderRef> finish(Reports& reports) const;
    // Another world begins: what was lit before does not count.
    void forget_primitives() {
        m_seen.clear();
        m_last.reset();
    }
    size_t size() const { return m_lights.size(); }
    void truncate(size_t size); // forgets the lights of a frame that ends

  private:
    int add(scene::ShaderRef shader);
    void mean(const std::string& handle, int light); // from here on
    int meant(const std::string& handle) const;      // Unknown, AreaLight or an index
    static constexpr int AreaLight = -1, Unknown = -2;
    std::vector<scene::ShaderRef> m_lights;
    std::map<std::string, std::vector<int>> m_handles;   // the newest of each is meant
    std::map<std::string, int> m_uses;                   // how often a handle was given
    std::map<int, std::map<std::string, Rgb>> m_filters; // that are on, by light and handle
    // Every set that a primitive was declared under, and the names of its lights.
    std::map<std::shared_ptr<const LightSet>, std::shared_ptr<std::set<std::string>>> m_seen;
    std::set<int> m_switched_off;                         // by Illuminate, somewhere: who does that means it
    std::shared_ptr<const std::set<std::string>> m_names; // of the last
    std::shared_ptr<const LightSet> m_last;
};

} // namespace kanuka::ingest
