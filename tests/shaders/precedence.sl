// Operators hold as RISpec's table says: . and ^ before * and /, those before + and -. Expect r = (14, 7, -4).
#include "probe.h"

PROBE(precedence)
        vector a = vector(1, 2, 3), b = vector(3, 2, 1);
        r = color(2 + 3 * 4, 1 + 2 * 3, -2 * 2);
        if (a . b * 2 != 20) r = color(-100);
        if (10 - 4 - 3 != 3) r = color(-200);
        if (16 / 4 / 2 != 2) r = color(-300);
END
