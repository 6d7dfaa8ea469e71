// Splines: Catmull-Rom, linear, bezier, from lists and arrays. Expect r: at u = 0 and 1 the inner control values.
#include "probe.h"

PROBE(math_splines)
        float knots[5] = {0, 0, 0.5, 1, 1};
        r = color(spline(u, 0, 0, 0.5, 1, 1), spline("linear", u, 0, 0, 0.5, 1, 1), spline(u, knots));
END
