// Float to color and point, color to its parts, in named spaces. Expect r = (u, 3, 1).
#include "probe.h"

PROBE(casts)
        color c = u;
        point q = 3;
        vector w = vector(color(0) == color(0) ? 1 : 0);
        r = color(comp(c, 2), ycomp(q), zcomp(w));
END
