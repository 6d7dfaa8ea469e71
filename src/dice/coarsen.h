// What would be too much is made coarser.
#pragma once

#include <functional>

#include "dice/density.h"

namespace kanuka::dice {

// Makes something, and coarser until it keeps within bounds; reports if it had to. make(): false = it would
// take too much. False = it never keeps within them.
bool make_within(const scene::Primitive& primitive, RateRule& rule, Journal& journal,
                 const std::function<bool()>& make);

} // namespace kanuka::dice
