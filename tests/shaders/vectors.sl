// Points, vectors, normals: + - . ^ * / and their parts. Expect r = (2, 1, u).
#include "probe.h"

PROBE(vectors)
        vector a = vector(1, 0, 0), b = vector(0, 1, 0);
        vector c = a ^ b;
        point q = P + 2 * a - vector(P);
        normal n = normal(c);
        r = color(xcomp(q), n . c, (P . a));
END
