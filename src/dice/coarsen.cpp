#include "dice/coarsen.h"

namespace kanuka::dice {

bool make_within(const scene::Primitive& primitive, RateRule& rule, Journal& journal,
                 const std::function<bool()>& make) {
    constexpr int MostHalvings = 14; // of micropolygon lengths
    int halvings = 0;
    while (!make()) {
        const int step = halvings < 2 ? 1 : 2;
        if (halvings + step > MostHalvings) {
            journal.error(primitive.where,
                          "a primitive cannot be diced to any sensible number of micropolygons and was left "
                          "out; check its size and transform");
            return false;
        }
        halvings += step;
        rule.coarsen(step, MostHalvings);
    }
    if (halvings > 0)
        journal.warning(primitive.where, "a primitive would be diced to more than " +
                                             std::to_string(int64_t(rule.density.most_vertices())) +
                                             " micropolygons; they were made " +
                                             std::to_string(1 << halvings) +
                                             " times longer. Check its size and transform; else a larger "
                                             "shading rate, or splitting it up, would do");
    return true;
}

} // namespace kanuka::dice
