// cellnoise is one value a unit cell; pnoise repeats. Expect r = (one value a quarter, another, 0).
#include "probe.h"

PROBE(noise_cells)
        float a = pnoise(P * 4, point(2, 2, 2)), b = pnoise(P * 4 + vector(2, 0, 0), point(2, 2, 2));
        r = color(cellnoise(floor(u * 1.99), floor(v * 1.99)), cellnoise(P * 1.99), abs(a - b) < 1e-5 ? 0 : 1);
END
