// break leaves one loop, break 2 leaves two. Expect r = (3, 1 3 5 7 9 by columns, 12).
#include "probe.h"

PROBE(break_levels)
        float i, j, one = 0, own = 0, two = 0;
        for (i = 0; i < 10; i += 1) { if (i == 3) break; one += 1; }
        for (i = 0; i < 100; i += 1) { own += 1; if (i >= 8 * u) break; }
        for (i = 0; i < 5; i += 1)
            for (j = 0; j < 5; j += 1) { if (i == 2 && j == 2) break 2; two += 1; }
        r = color(one, own, two);
END
