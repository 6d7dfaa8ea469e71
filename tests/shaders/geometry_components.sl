// xcomp … setzcomp, comp, setcomp, luminance. Expect r = (5, u, 1).
#include "probe.h"

PROBE(geometry_components)
        point q = P;
        setxcomp(q, 5); setzcomp(q, u);
        color c = color(1);
        setcomp(c, 1, v);
        matrix m = 1;
        setcomp(m, 0, 3, 2);
        r = color(xcomp(q), zcomp(q), luminance(color(1)));
        if (comp(m, 0, 3) != 2 || abs(comp(c, 1) - v) > 1e-6) r = color(-1);
END
