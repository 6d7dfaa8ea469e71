#include "hierarchy/lattice.h"

#include "hierarchy/fields.h"

namespace kanuka::hierarchy {

void StepVotes::add(const Vec3f& extent) {
    const float largest = max(max(extent.x, extent.y), extent.z);
    if (!(largest > 0) || !(largest < LargestCoordinate))
        return; // a point, or nowhere
    // No axis has more than 16 bits; from there on coarser and coarser, until the sum is within 32.
    int e = std::clamp(exponent_of(largest) - (FieldTable::Most - 1), Lattice::LeastExponent,
                       Lattice::MostExponent);
    for (; e < Lattice::MostExponent; e++) {
        int steps[3];
        for (int a = 0; a < 3; a++) // two more: both ends are rounded
            steps[a] = int(std::min(double(extent[a]) / double(power_of_two(e)), 1e6)) + 2;
        if (field_table.holding(steps) >= 0)
            break;
    }
    m_count[size_t(e - Lattice::LeastExponent)]++;
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
