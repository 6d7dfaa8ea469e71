// Noise as color, point and vector, signed too. Expect values of one hash.
#include "probe.h"

PROBE(noise_types)
        point q = point noise(P * 7);
        vector w = vector snoise(P * 7);
        r = color noise(P * 7) + color(xcomp(q), ycomp(q), zcomp(q)) + color(xcomp(w), ycomp(w), zcomp(w));
END
