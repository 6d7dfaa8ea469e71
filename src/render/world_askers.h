// Groups whose shaders ask where in the world they are, and which of their instances become things of their
// own for that, which de_instance.h makes of them.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "scene/scene.h"

namespace kanuka::render {

class WorldAskers {
  public:
    // `first`: number of the scene's first group. `most`: vertices that may become of instances.
    WorldAskers(const scene::Scene& scene, size_t first, uint64_t most)
        : m_scene(scene), m_first(first), m_most(most), m_groups(scene.groups.size()) {}

    // A primitive of a group as it is built: its vertices and their bytes.
    void note(size_t group, const Location& where, bool asks, uint64_t vertices, uint64_t bytes);
    // Once all are noted. Those that take the least come first; of groups where all of them together would be
    // more than there may be, none does. `seen_in_many`: does it stand at several places that do not move?
    void choose(const std::function<bool(size_t)>& seen_in_many, Journal& journal);
    bool takes_apart(const scene::Group::Instances& in) const { return m_apart.contains(&in); }
    uint64_t primitives() const { return m_primitives; } // that become of those

  private:
    using List = const scene::Group::Instances*;
    struct Noted {
        std::vector<Location> asks; // of primitives
        uint64_t vertices = 0, bytes = 0, primitives = 0;
    };
    struct Cost {
        uint64_t places = 0, vertices = 0, bytes = 0, primitives = 0;
    };
    std::set<List> on_the_way_to(size_t group) const;
    Cost cost_of(const std::set<List>& apart) const;
    void add_cost(const std::vector<scene::Group::Instances>& all, uint64_t times,
                  const std::set<List>& apart, Cost& cost) const;
    void tell_apart(size_t group, const Cost& cost, Journal& journal) const;
    void tell_alike(size_t group, const Cost& cost, Journal& journal) const;

    const scene::Scene& m_scene;
    const size_t m_first;
    const uint64_t m_most;
    std::vector<Noted> m_groups;
    std::set<List> m_apart;
    uint64_t m_primitives = 0;
};

} // namespace kanuka::render
