// Derivatives where only some vertices run are those of the whole grid. Expect r = (2 where v > 0.5 else 0, 0, 0).
#include "probe.h"

PROBE(derivatives_in_branches)
        float slope = 0;
        if (v > 0.5) slope = Du(u * 2);
        r = color(slope, 0, 0);
END
