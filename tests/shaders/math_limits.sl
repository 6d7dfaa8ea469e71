// min max clamp, of several and of colors. Expect r = (min(u, v, 0.5), max(u, v), 0.3).
#include "probe.h"

PROBE(math_limits)
        color c = clamp(color(u, 2, -1), color(0.3), color(0.6));
        r = color(min(u, v, 0.5), max(u, v), comp(c, 2));
        if (comp(c, 1) != 0.6) r = color(-1);
END
