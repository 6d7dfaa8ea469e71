#include <limits>

#include "bvh/bvh.h"

namespace kanuka::bvh {

uint64_t number_emitters(const store::Store& store, std::span<GroupDesc> groups, int most) {
    const auto& shapes = store.shapes();
    std::vector<uint64_t> all(groups.size()); // numbered or not
    for (size_t g = 0; g < groups.size(); g++) {
        GroupDesc& group = groups[g];
        // Shapes of a group are made resident one after the other, and so are their emitters.
        int first = std::numeric_limits<int>::max(), end = 0;
        for (const auto& range : group.shapes)
            for (int s = range.first; s < range.first + range.count; s++)
                if (shapes[size_t(s)].emitter >= 0) {
                    first = std::min(first, shapes[size_t(s)].emitter);
                    end = std::max(end, shapes[size_t(s)].emitter + store::emitter_count(shapes[size_t(s)]));
                }
        group.first_emitter = end > 0 ? first : 0;
        group.emitters = end > 0 ? end - first : 0;
        uint64_t slots = uint64_t(group.emitters);
        all[g] = slots;
        if (slots > uint64_t(most))
            group.emitters = 0, slots = 0;
        for (auto& in : group.instances) {
            in.first_slot = GroupDesc::Unnumbered;
            if (!in.paths.empty()) // nobody knows where they are
                continue;
            const uint64_t places = in.places.size();
            const uint64_t each = uint64_t(groups[size_t(in.group)].slots);
            all[g] = std::min(all[g] + places * all[size_t(in.group)], uint64_t(1) << 60);
            if (each == 0 || slots + places * each > uint64_t(most))
                continue;
            in.first_slot = int(slots);
            slots += places * each;
        }
        group.slots = int(slots);
    }
    return groups.empty() ? 0 : all.back() - uint64_t(groups.back().slots);
}

} // namespace kanuka::bvh
