// Which lights shine on what, and through what: names and groups of lights to the bits that the store and the
// lights carry. And which rays see what.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "scene/scene.h"
#include "store/store.h"
#include "transport/light_multipliers.h"

namespace kanuka::render {

class Linking {
  public:
    // Looks at all primitives. Every combination of lights that are off is a set of receivers: 31 and that of
    // all lights; what comes after is lit by all, and reported.
    Linking(const scene::Scene& scene, Journal& journal);
    store::Links of(const scene::Attributes* attributes) const;
    void apply(std::vector<scene::Light>& lights) const;
    // By store::Links::area_light - 1. Those of parts as well.
    const std::vector<transport::AreaLight>& area_lights() const { return m_area_lights; }
    // A part that is read later: its receivers and area lights. No links name lights in it.
    void add(const scene::Scene& part, Journal& journal);

  private:
    struct Name {
        std::string name, group;
        bool mesh = false; // an area light
        int32_t lit_sets = -1, passes = 0;
    };
    void add_names(const std::string& name, const std::string& group, bool mesh);
    void add_primitives(const std::vector<scene::Primitive>& primitives, Journal& journal);
    // Indices of m_names.
    std::vector<int> off(const scene::Attributes& attributes);
    static void see(const scene::Attributes& attributes, store::Links& links);
    int32_t number_area_light(const scene::Attributes& attributes);
    int32_t passes(const scene::Attributes& attributes, const Location& where, Journal& journal);

    std::vector<Name> m_names;
    std::map<std::string, int> m_index;
    std::map<std::vector<int>, int32_t> m_sets; // to the bit of the set
    std::map<const scene::Attributes*, store::Links> m_links;
    std::vector<transport::AreaLight> m_area_lights;
    std::map<transport::AreaLight, int32_t> m_area_light_numbers;
    int m_passes = 0;
    bool m_shadowless = false; // something casts no shadows at all
    // Of the last set of lights that were on: most primitives share one.
    std::shared_ptr<const std::set<std::string>> m_last_on;
    std::vector<int> m_last_dark;
};

} // namespace kanuka::render
