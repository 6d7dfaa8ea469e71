// ?: of floats and colors, nested. Expect r = (u or v, the larger; 2; 0.5).
#include "probe.h"

PROBE(ternary)
        float larger = u > v ? u : v;
        color c = u > 2 ? color(1) : v > 2 ? color(3) : color(0.5);
        r = color(larger, 1 > 0 ? 2 : 3, comp(c, 2));
END
