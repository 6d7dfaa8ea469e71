// Color arithmetic, component by component; mixtures with floats. Expect r = (0.75, 1.5 u, 2).
#include "probe.h"

PROBE(colors)
        color c = color(0.5, u, 1);
        r = c * color(1.5) + (1 - 1) * c;
        r = color(comp(r, 0), comp(r, 1), comp(c + 1, 2));
END
