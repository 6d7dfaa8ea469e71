// Which paths see something that others do not: levels of detail in transition.
#pragma once

#include <cstdint>

namespace kanuka {

// Of the numbers from 0 to 1 that paths have, one each: those between two steps of 2^-16, both included.
struct LevelRange {
    static constexpr uint32_t Steps = 1 << 16;
    uint16_t from = 0, last = Steps - 1;

    bool holds(float level) const {
        const uint32_t step = uint32_t(level * Steps);
        return step >= from && step <= last;
    }
    bool operator==(const LevelRange&) const = default;
};

} // namespace kanuka
