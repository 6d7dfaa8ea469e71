// Du Dv Deriv area filterwidth, at the edges too. Expect r = (2, 3, 2 u) and nothing negative.
#include "probe.h"

PROBE(derivatives)
        float a = Du(2 * u), b = Dv(3 * v), c = Deriv(u * u, u);
        if (abs(area(P) - 1 / 4.0 / 3.0) > 1e-5 || abs(filterwidth(u) - 0.25) > 1e-5) c = -1;
        r = color(a, b, c);
END
