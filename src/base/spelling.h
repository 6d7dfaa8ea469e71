// "Did you mean": the nearest of the known names by edit distance.
#pragma once

#include <string>
#include <string_view>

namespace kanuka {

// Insertions, deletions, substitutions and swaps of neighbours, letter case counting half as much (so that
// "worldbegin" is nearest to "WorldBegin"). Optimal string alignment, Damerau 1964.
float edit_distance(std::string_view a, std::string_view b);

class Nearest {
  public:
    explicit Nearest(std::string_view wanted);
    void offer(std::string_view known);
    std::string_view best() const { return m_best; } // empty = nothing near enough to be meant
    // "; did you mean NAME?", or nothing.
    std::string question() const {
        return m_best.empty() ? "" : "; did you mean " + std::string(m_best) + "?";
    }

  private:
    std::string_view m_wanted, m_best;
    float m_distance;
};

} // namespace kanuka
