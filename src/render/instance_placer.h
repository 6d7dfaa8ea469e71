// Lays out the scene's instances for the BVH.
#pragma once

#include <vector>

#include "base/digest.h"
#include "render/geometry.h"
#include "render/group_views.h"
#include "render/instance_primvars.h"
#include "render/variations.h"
#include "render/world_askers.h"

namespace kanuka::render {

class InstancePlacer {
  public:
    struct Known { // of the scene
        const GroupViews& views;
        const InstancePrimvars& primvars;
        const WorldAskers& askers;
    };
    // `first_group`: number of the scene's first group. All must outlive this.
    InstancePlacer(const GeometryRequest& request, Geometry& out, const Known& known, size_t first_group,
                   Digester& key);
    struct Parent {
        Transform render_from_parent = {}; // of a group: as it is built, from the group; a translation
        int group = -1;                    // of the scene's, from the first on; -1 = the world
        float pixels_per_unit = 0;         // that the group is made at
        bool is_coarser = false;           // a level of it: its instances are counted already
    };
    // Into a group as it is built, or into the world without those that are taken apart. The groups that they
    // place must be built.
    void add(const std::vector<scene::Group::Instances>& all, const Parent& parent, bvh::GroupDesc& desc);
    // Is each of them made as a thing of its own, where it stands in the world?
    bool takes_apart(const scene::Group::Instances& in) const;
    std::vector<int32_t> rows_of(const scene::Variation& variation, size_t count) {
        return m_variations.rows_of(variation, count);
    }

  private:
    struct Run { // of instances, that lie in one group as it was built
        int group;
        std::vector<uint32_t> which;    // empty = all
        std::vector<LevelRange> levels; // that see each; empty = all do
    };
    std::vector<Run> runs_of(const scene::Group::Instances& in, const Parent& parent);
    void add_still(const scene::Group::Instances& in, Run run, const std::vector<int32_t>& rows,
                   const Transform& render_from_parent, bvh::GroupDesc& desc);
    void add_moving(const scene::Group::Instances& in, const Run& run, const std::vector<int32_t>& rows,
                    const Transform& render_from_parent, bvh::GroupDesc& desc);

    const GeometryRequest& m_request;
    Geometry& m_out;
    const GroupViews& m_views;
    const InstancePrimvars& m_primvars;
    const WorldAskers& m_askers;
    const size_t m_first_group;
    Digester& m_key;
    VariationTable m_variations;
};

// Instances of a group that has one place. Sums are made in double, and rounded where they are small.
// `variation`: what they differ by.
scene::Group::Instances placed(const scene::Group::Instances& in, const Transform& render_from_group,
                               const scene::Variation& variation);

} // namespace kanuka::render
