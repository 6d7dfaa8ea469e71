// Numbers in all forms. Expect r = (0.5, 1200, 0.025).
#include "probe.h"

PROBE(numbers)
        r = color(.5, 1.2e3, 25e-3);
        r += color(0, 0, 1.e0 - 1);
END
