// continue goes on with its loop, continue 2 with the one around it. Expect r = (25, 4 or 5, 10).
#include "probe.h"

PROBE(continue_levels)
        float i, j, odd = 0, own = 0, two = 0;
        for (i = 0; i < 10; i += 1) { if (mod(i, 2) == 0) continue; odd += i; }
        for (i = 0; i < 5; i += 1) { if (abs(i - 4 * u) < 0.01 && v > 0.5) continue; own += 1; }
        for (i = 0; i < 4; i += 1)
            for (j = 0; j < 5; j += 1) { if (j > i) continue 2; two += 1; }
        r = color(odd, own, two);
END
