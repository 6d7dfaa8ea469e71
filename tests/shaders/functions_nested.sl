// Functions within functions see the variables around them. Expect r = (u + 10, 11, 3).
#include "probe.h"

PROBE(functions_nested)
        float base = 10;
        float plus(float x) { return x + base; }
        float twice(float x) { float inner(float y) { return y + 1; } return inner(inner(x)); }
        r = color(plus(u), plus(1), twice(1));
END
