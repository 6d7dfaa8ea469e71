// && || ! and comparisons, of what varies and what does not. Expect r = (1 in the middle of u, 1 outside of it, 3).
#include "probe.h"

PROBE(logic)
        float inside = 0, outside = 0, count = 0;
        if (u > 0.2 && u < 0.8) inside = 1;
        if (u <= 0.2 || !(u < 0.8)) outside = 1;
        if (1 == 1) count += 1;
        if (1 != 2) count += 1;
        if ("a" == "a" && "a" != "b") count += 1;
        r = color(inside, outside, count);
END
