// The lobe inputs of one grid as its page may keep them: finite, in the ranges of their slots.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>

#include "store/encode_grid.h"
#include "store/quantize.h"

namespace kanuka::store {

class GridInputs {
  public:
    // What had to be changed is counted in `counts`, every time that it is read.
    GridInputs(const ShadedGrid& shaded, const grid::LayeringProgram& program, Encoded& counts)
        : GridInputs(shaded, shaded.inputs->slots, program, counts) {}
    // Of a variant.
    GridInputs(const ShadedGrid& shaded, const std::vector<grid::SlotValues>& slots,
               const grid::LayeringProgram& program, Encoded& counts)
        : m_slots(slots), m_stride(shaded.inputs->stride), m_program(program), m_counts(counts),
          m_grid(*shaded.grid), m_count(shaded.grid->vertices()) {}

    const grid::LayeringProgram& program() const { return m_program; }
    int vertices() const { return m_count; }

    // `most`: emitters keep whole floats.
    float value(int slot, int component, int vertex, float most = LargestHalf) {
        const grid::SlotValues& values = m_slots[size_t(slot)];
        const float x = values.uniform ? values.value[component]
                                       : values.data[size_t(component) * size_t(m_stride) + size_t(vertex)];
        return clean(x, m_program.slots[slot], most);
    }

    // A unit vector; zero, or none, is the surface's normal.
    Vec3f unit(int slot, int i) {
        const Vec3f v(value(slot, 0, i), value(slot, 1, i), value(slot, 2, i));
        for (const Vec3f& n : {unit_or_zero(v), unit_or_zero(m_grid.normal(i))})
            if (!(n == Vec3f(0.0f)))
                return n;
        return {0, 0, 1};
    }

    Rgb color(int slot, int i) { return {value(slot, 0, i), value(slot, 1, i), value(slot, 2, i)}; }

    bool constant(int slot) const {
        const grid::SlotValues& values = m_slots[size_t(slot)];
        if (values.uniform)
            return true;
        const int components = grid::components_of(m_program.slots[slot].type);
        for (int c = 0; c < components; c++) {
            const float* a = values.data.data() + size_t(c) * size_t(m_stride);
            for (int i = 1; i < m_count; i++)
                if (std::bit_cast<uint32_t>(a[i]) != std::bit_cast<uint32_t>(a[0]))
                    return false;
        }
        return true;
    }

    // Does it stop some colours more than others?
    bool is_tinted() {
        const auto& c = m_program.opacity;
        for (int i = 0; i < m_count; i++) {
            const float r = value(c[0], 0, i), g = value(c[1], 0, i), b = value(c[2], 0, i);
            if (std::max({r, g, b}) - std::min({r, g, b}) > 1e-3f)
                return true;
        }
        return false;
    }

  private:
    // Into the slot's range and to what half precision holds. Infinity lies in the range of an unbounded
    // slot, but one infinite radiance would be the whole picture's.
    float clean(float x, const grid::Slot& slot, float most) {
        if (slot.storage == grid::Storage::Full || slot.storage == grid::Storage::Unit) {
            m_counts.bad += !std::isfinite(x);
            return std::isfinite(x) ? x : 0.0f;
        }
        if (slot.between == grid::Between::Turns)
            x -= std::floor(x);
        const float low = std::max(slot.low, -most), high = std::min(slot.high, most);
        if (x >= low && x <= high)
            return x;
        m_counts.bad += !std::isfinite(x);
        m_counts.lost += std::isfinite(x) && std::abs(x) > most && slot.high > most;
        return std::isnan(x) ? std::clamp(0.0f, low, high)
                             : std::clamp(x, low, std::isfinite(x) ? high : std::min(high, LargestHalf));
    }

    const std::vector<grid::SlotValues>& m_slots;
    const int m_stride;
    const grid::LayeringProgram& m_program;
    Encoded& m_counts;
    const grid::Grid& m_grid;
    int m_count;
};

} // namespace kanuka::store
