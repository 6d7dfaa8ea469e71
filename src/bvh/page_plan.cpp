#include "bvh/page_plan.h"

#include <algorithm>
#include <array>

#include "bvh/page_views.h"

namespace kanuka::bvh {

static uint64_t bytes_of_places(const GroupDesc::Instances& in) {
    return in.size() * (in.paths.empty() ? BytesAnInstance : BytesAMovingOne);
}

// Which parts of which groups lie below the world.
class PagePlan::Reached {
  public:
    explicit Reached(std::span<const GroupDesc> groups) : m_groups(groups), m_parts(groups.size()) {
        of(groups.size() - 1, Part::Plain) = true;
        for (size_t g = groups.size(); g-- > 0;) {
            of(g, Part::Surfaces) = of(g, Part::Plain) && !groups[g].solids.empty();
            for (const auto& in : groups[g].instances)
                for (const Part part : {Part::Plain, Part::Surfaces, Part::Whole})
                    if (of(g, part) && (part != Part::Surfaces || in.bounds_solid))
                        of(size_t(in.group), in.bounds_solid ? Part::Whole : part) = true;
        }
    }
    bool operator()(size_t group, Part part) const { return m_parts[group][size_t(part)]; }

  private:
    bool& of(size_t group, Part part) { return m_parts[group][size_t(part)]; }
    std::span<const GroupDesc> m_groups;
    std::vector<std::array<bool, 3>> m_parts;
};

PagePlan::PagePlan(const store::Store& store, std::span<const GroupDesc> groups, const PagesFrom& asked)
    : least(asked), bytes(groups.size()) {
    const Reached reached(groups);
    uint64_t places = 0;
    for (size_t g = 0; g < groups.size(); g++) {
        uint64_t here = 0;
        for (const auto& in : groups[g].instances) {
            places += in.size();
            if (reached(g, Part::Plain) && !in.bounds_solid)
                here += bytes_of_places(in);
        }
        for (const auto& in : groups[g].instances)
            bytes[size_t(in.group)] = std::max(bytes[size_t(in.group)], here);
    }
    if (places >= least.places)
        least.cells = least.segments = 0;
    holds_solids = can_hold_solids(store, groups, reached);
    for (size_t g = 0; g < groups.size(); g++)
        for (const Part part : {Part::Whole, Part::Surfaces, Part::Plain})
            if (reached(g, part) && (holds_solids || part == Part::Plain))
                views.push_back({g, part});
}

bool PagePlan::fits(size_t group) const {
    return bytes[group] < MostBytes;
}

// What a ray hits of a solid depends on all that bounds it: it lies in pages as a whole.
bool PagePlan::can_hold_solids(const store::Store& store, std::span<const GroupDesc> groups,
                               const Reached& reached) const {
    if (least.cells > 0 || least.segments > 0)
        return false;
    const auto can_hold = [&](const GroupDesc::Range& range) {
        for (int s = range.first; s < range.first + range.count; s++) {
            const store::ShapeRecord& shape = store.shapes()[size_t(s)];
            if (page_bytes(shape) >= MostBytes || (shape.motion_segments > 0 && least.changing > 0))
                return false;
        }
        return true;
    };
    for (size_t g = 0; g < groups.size(); g++) {
        const GroupDesc& group = groups[g];
        if (!reached(g, Part::Surfaces) && !reached(g, Part::Whole))
            continue;
        uint64_t places = 0;
        for (const auto& in : group.instances)
            if (in.bounds_solid || reached(g, Part::Whole))
                places += bytes_of_places(in);
        if (!fits(g) || places >= MostBytes)
            return false;
        for (const auto& range : group.shapes)
            if ((range.solid >= 0 || reached(g, Part::Whole)) && !can_hold(range))
                return false;
    }
    return true;
}

} // namespace kanuka::bvh
