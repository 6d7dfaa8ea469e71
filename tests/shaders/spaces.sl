// transform vtransform ntransform between named spaces, which here are all one. Expect r = (u, v, 1).
#include "probe.h"

PROBE(spaces)
        point q = transform("world", P);
        vector w = vtransform("object", "current", vector(0, v, 0));
        normal n = ntransform("shader", N);
        r = color(xcomp(q), ycomp(w), zcomp(n));
END
