// Arrays of colors and points, passed to functions. Expect r = (u, v, 0) + (0.1, 0.2, 0.3).
#include "probe.h"

color last(color list[]) { return list[arraylength(list) - 1]; }

PROBE(arrays_of_colors)
        color ramp[3] = {color(1, 0, 0), color(0, 1, 0), color(0.1, 0.2, 0.3)};
        point places[2] = {point(0, 0, 0), P};
        r = last(ramp) + color(xcomp(places[1]), ycomp(places[1]), zcomp(places[1]));
END
