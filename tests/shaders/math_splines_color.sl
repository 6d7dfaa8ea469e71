// Splines of colors, and in the bases of RISpec. Expect r grows along u in all three.
#include "probe.h"

PROBE(math_splines_color)
        color c = spline("bezier", u, color(0), color(0.1), color(0.9), color(1));
        color d = spline("bspline", u, color(0), color(0.25), color(0.75), color(1));
        float e = spline("catmull-rom", u, 0, 0.2, 0.8, 1);
        r = color(comp(c, 0), comp(d, 1), e);
END
