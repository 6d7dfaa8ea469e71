// for, with a count that varies. Expect r = (10, 0 + … + floor(10 u), 5).
#include "probe.h"

PROBE(for_loop)
        float i, sum = 0, part = 0, last = 0;
        for (i = 0; i < 5; i += 1) sum += i;
        for (i = 0; i <= floor(10 * u + 0.001); i += 1) part += i;
        for (last = 0; last < 5; last += 1) ;
        r = color(sum, part, last);
END
