// Values of slots within their ranges: NaN becomes the lowest. What lay outside by more than rounding is
// told.
#include <algorithm>
#include <cmath>
#include <limits>

#include "sl/shader.h"

namespace kanuka::sl {

namespace {

constexpr float Rounding = 1e-4f; // of the larger of 1 and the bound

struct Seen {
    float least = std::numeric_limits<float>::infinity(), most = -std::numeric_limits<float>::infinity();
    std::vector<bool> outside; // by vertex
};

// Nearly always all is well, which one pass that only reads finds out.
bool all_within(const float* x, size_t n, float low, float high) {
    int outside = 0;
    for (size_t i = 0; i < n; i++)
        outside |= !(x[i] >= low) | !(x[i] <= high);
    return outside == 0;
}

void keep(float* x, size_t n, size_t own, const grid::Slot& slot, Seen& seen) {
    const float low = slot.low - Rounding * std::max(1.0f, std::abs(slot.low)),
                high = slot.high + Rounding * std::max(1.0f, std::abs(slot.high));
    seen.outside.resize(own);
    for (size_t i = 0; i < n; i++) {
        if (i < own && !std::isnan(x[i]))
            seen.least = std::min(seen.least, x[i]), seen.most = std::max(seen.most, x[i]);
        if (i < own && (!(x[i] >= low) || !(x[i] <= high)))
            seen.outside[i] = true;
        x[i] = x[i] > slot.low ? std::min(x[i], slot.high) : slot.low;
    }
}

} // namespace

void InstanceImpl::keep_in_range(grid::VertexInputs& out, size_t vertices, size_t own,
                                 Services& services) const {
    for (size_t s = 0; s < m_sources.size(); s++) {
        const grid::Slot& slot = m_layering.slots[s];
        grid::SlotValues& values = out.slots[s];
        const int components = grid::components_of(slot.type);
        float* const data = values.uniform ? &values.value.x : values.data.data();
        const size_t stride = values.uniform ? 1 : size_t(out.stride), n = values.uniform ? 1 : vertices;
        Seen seen;
        if (slot.between == grid::Between::Turns) // whole ones are none
            for (size_t i = 0; i < n; i++)
                data[i] -= std::floor(data[i]);
        for (int c = 0; c < components; c++)
            if (float* x = data + size_t(c) * stride; !all_within(x, n, slot.low, slot.high))
                keep(x, n, values.uniform ? 1 : own, slot, seen);
        if (const auto count = std::count(seen.outside.begin(), seen.outside.end(), true); count > 0)
            services.out_of_range({m_shader->name(), slot, seen.least, seen.most, uint64_t(count)});
    }
}

} // namespace kanuka::sl
