// Declared details: a uniform value is one for the grid, a varying one may differ. Expect r = (2, u, 2 + u).
#include "probe.h"

PROBE(uniform_and_varying)
        uniform float one = 2;
        varying float own = u;
        uniform color c = color(one);
        r = color(one, own, comp(c, 0) + own);
END
