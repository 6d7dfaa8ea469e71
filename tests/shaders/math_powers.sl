// exp log pow sqrt inversesqrt. Expect r = (2^(4 u), 3, 0.5).
#include "probe.h"

PROBE(math_powers)
        float a = pow(2, 4 * u);
        float b = log(8, 2);
        float c = inversesqrt(4);
        if (abs(exp(log(1 + v)) - (1 + v)) > 1e-5 || sqrt(16) != 4 || sqrt(-1) != 0) c = -1;
        r = color(a, b, c);
END
