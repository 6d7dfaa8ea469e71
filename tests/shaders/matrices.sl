// Matrices: constants, products, inverse by 1 / m, determinant, turned points. Expect r = (24, 1 + u, 0).
#include "probe.h"

PROBE(matrices)
        matrix s = matrix(2,0,0,0, 0,3,0,0, 0,0,4,0, 0,0,0,1);
        matrix m = translate(1, vector(1, 0, 0));
        point q = transform(m, P);
        point back = transform(1 / s, transform(s, P));
        r = color(determinant(s), xcomp(q), distance(back, P) < 1e-6 ? 0 : 1);
END
