// = += -= *= /= on floats, colors and points. Expect r = (5, 1 + u, 0.5).
#include "probe.h"

PROBE(assignments)
        float a = 1;
        a += 9; a -= 5; a *= 4; a /= 4;
        color c = color(u);
        c += 1; c *= color(1, 1, 0.5);
        point q = P;
        q -= P; q += point(0, 0, 0.5);
        r = color(a, comp(c, 1), zcomp(q));
END
