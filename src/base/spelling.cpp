#include "base/spelling.h"

#include <algorithm>
#include <cctype>
#include <vector>

namespace kanuka {

float edit_distance(std::string_view a, std::string_view b) {
    const size_t n = b.size() + 1;
    std::vector<float> before(n), previous(n), row(n);
    for (size_t j = 0; j < n; j++)
        previous[j] = float(j);
    for (size_t i = 1; i <= a.size(); i++) {
        row[0] = float(i);
        for (size_t j = 1; j < n; j++) {
            const char x = a[i - 1], y = b[j - 1];
            const bool same_letter =
                std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
            const float change = x == y ? 0.0f : same_letter ? 0.25f : 1.0f;
            row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + change});
            if (i > 1 && j > 1 && x == b[j - 2] && a[i - 2] == y)
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        std::swap(before, previous);
        std::swap(previous, row);
    }
    return previous[n - 1];
}

// A third of the letters may be wrong; more is another word.
Nearest::Nearest(std::string_view wanted)
    : m_wanted(wanted), m_distance(std::clamp(float(wanted.size()) / 3, 1.0f, 3.0f) + 0.1f) {}

void Nearest::offer(std::string_view known) {
    const size_t longer = std::max(known.size(), m_wanted.size()),
                 shorter = std::min(known.size(), m_wanted.size());
    if (float(longer - shorter) >= m_distance)
        return;
    const float d = edit_distance(m_wanted, known);
    if (d < m_distance) {
        m_distance = d;
        m_best = known;
    }
}

} // namespace kanuka
