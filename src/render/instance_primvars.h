// Variables that instances bring to surface shaders. Their exemplar is shaded once for each of some values,
// its variants, and each instance shows one of these, or what lies between two.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "scene/scene.h"
#include "shade/shade.h"

namespace kanuka::render {

struct Approximation;
struct InstanceVariable;
class InstanceValues;

class InstancePrimvars {
  public:
    // `first`: number of the scene's first group. `most`: variants of a shape.
    InstancePrimvars(const scene::Scene& scene, size_t first, shade::ShadingSystem& shading, size_t most,
                     Journal& journal);
    // What the surfaces of a group are shaded with; none: what their attributes say.
    std::span<const scene::ValueList> variants_of(size_t group) const;
    // What a list's instances differ by, with the variants that they show.
    const scene::Variation& shown(const scene::Group::Instances& in) const;

  private:
    using List = const scene::Group::Instances*;
    // What surfaces of a group read of all that instances say.
    struct Reader {
        std::vector<std::string> names;
        bool has_variants = false; // of its own, which "variant" chooses from
        int family = -1;
    };
    // Groups that share lists, so that a row of theirs means the same in all: their variants are the same.
    struct Family {
        std::vector<size_t> groups;
        std::vector<List> lists; // that say something
        bool plain = false;      // some instances say nothing
        std::vector<scene::ValueList> variants;
    };
    void find_readers();
    void tell_unread(const std::vector<std::string>& names) const;
    std::vector<size_t> readers_of(const scene::Group::Instances& in, bool in_world) const;
    void visit(const scene::Group::Instances& in, bool in_world, std::vector<bool>& seen,
               std::vector<size_t>& found) const;
    void join(const std::vector<size_t>& readers);
    void join_all();
    std::vector<InstanceVariable> variables_of(const Family& family) const;
    void choose(Family& family);
    void tell_approximated(const Family& family, const InstanceValues& values, size_t distinct,
                           const Approximation& made) const;

    const scene::Scene& m_scene;
    const size_t m_first, m_most;
    shade::ShadingSystem& m_shading;
    Journal& m_journal;
    std::map<size_t, Reader> m_readers; // by group
    std::vector<Family> m_families;
    std::map<List, scene::Variation> m_shown;
};

} // namespace kanuka::render
