// Parameters of all types and their defaults. Expect r = (1.5, 0.2 + 3, 4 + 1 + 1).
#include "probe.h"

#define PARAMETERS \
    float a = 1.5; \
    color c = color(0.2, 0, 0); \
    point q = point(0, 3, 0); \
    float list[3] = {4, 4, 4}; \
    string word = "x"; \
    matrix m = 1; \
    float computed = sqrt(1);

PROBE_OF(parameters_defaults, PARAMETERS)
        r = color(a, comp(c, 0) + ycomp(q), list[2] + comp(m, 3, 3) + computed);
        if (word != "x") r = color(-1);
END
