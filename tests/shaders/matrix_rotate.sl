// Rotations: of matrices and of points about a line. Expect r = (0, 1, 1) within rounding.
#include "probe.h"

PROBE(matrix_rotate)
        matrix m = rotate(1, PI / 2, vector(0, 0, 1));
        point a = transform(m, point(1, 0, 0));
        point b = rotate(point(1, 0, 0), PI / 2, point(0, 0, 0), point(0, 0, 1));
        r = color(round(1000 * xcomp(a)) / 1000, round(1000 * ycomp(a)) / 1000, distance(a, b) < 1e-5 ? 1 : 0);
END
