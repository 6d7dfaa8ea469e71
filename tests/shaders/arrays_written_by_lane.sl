// Elements written where only some vertices run. Expect r = (9 where u > 0.5 else 0, 9 else, 1).
#include "probe.h"

PROBE(arrays_written_by_lane)
        float slots[3] = {0, 0, 1};
        if (u > 0.5) slots[0] = 9; else slots[1] = 9;
        r = color(slots[0], slots[1], slots[2]);
END
