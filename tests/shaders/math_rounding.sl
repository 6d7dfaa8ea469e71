// abs sign floor ceil round mod. Expect r = (floor(10 u), 1 0 or -1 by columns, 0.5).
#include "probe.h"

PROBE(math_rounding)
        float c = mod(-1.5, 2);
        if (abs(-2) != 2 || ceil(1.2) != 2 || round(1.5) != 2 || floor(-0.5) != -1 || mod(5.5, 2) != 1.5) c = -1;
        r = color(floor(10 * u), sign(0.5 - u), c);
END
