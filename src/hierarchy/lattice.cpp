#include "hierarchy/lattice.h"

#include <algorithm>

#include "hierarchy/fields.h"

namespace kanuka::hierarchy {

namespace {

// The finest step from which on `holds` is true of an extent in steps; both ends are rounded. Not below that
// at which no axis has more than 16 bits. Of a step twice as long there are half as many, rounded down, so
// they are divided once.
template <class Holds>
int finest(const Vec3f& extent, float largest, const Holds& holds) {
    const int first = std::clamp(exponent_of(largest) - (FieldTable::Most - 1), Lattice::LeastExponent,
                                 Lattice::MostExponent);
    int counted[3];
    for (int a = 0; a < 3; a++)
        counted[a] = int(std::min(double(extent[a]) / double(power_of_two(first)), 1e9));
    int e = first;
    for (; e < Lattice::MostExponent; e++) {
        const int more = std::min(e - first, 31);
        const int steps[3] = {(counted[0] >> more) + 2, (counted[1] >> more) + 2, (counted[2] >> more) + 2};
        if (holds(steps))
            break;
    }
    return e;
}

// Zero: a point, or nowhere.
float size_of(const Vec3f& extent) {
    const float largest = max(max(extent.x, extent.y), extent.z);
    return largest > 0 && largest < LargestCoordinate ? largest : 0;
}

} // namespace

void StepVotes::add(const Vec3f& extent, float largest_step) {
    const float size = size_of(extent);
    if (!(size > 0))
        return;
    const int held = finest(extent, size, [](const int(&steps)[3]) { return FieldTable::holds(steps); });
    const int e = std::max(std::min(held, exponent_of(largest_step)), int(Lattice::LeastExponent));
    m_count[size_t(e - Lattice::LeastExponent)]++;
}

void StepVotes::add_fine(const Vec3f& extent) {
    if (const float largest = size_of(extent); largest > 0)
        m_count[size_t(finest(extent, largest,
                              [](const int(&steps)[3]) {
                                  return std::max({steps[0], steps[1], steps[2]}) < 1 << FieldTable::Most;
                              }) -
                       Lattice::LeastExponent)]++;
}

void StepVotes::add(const StepVotes& other) {
    for (size_t i = 0; i < m_count.size(); i++)
        m_count[i] += other.m_count[i];
}

Lattice StepVotes::lattice() const {
    uint64_t all = 0;
    for (uint64_t n : m_count)
        all += n;
    if (all == 0)
        return {};
    int first = 0, last = Range - 1;
    while (m_count[size_t(first)] == 0)
        first++;
    uint64_t above = m_count[size_t(last)];
    while (last > 0 && double(above) <= Larger * double(all))
        above += m_count[size_t(--last)];
    return {std::min(last, first + Slack) + Lattice::LeastExponent};
}

} // namespace kanuka::hierarchy
