// a division by zero and an index outside are faults that are reported, with a value that is defined. Expect r is
// finite.
#include "probe.h"

PROBE(faults)
        float list[3] = {1, 2, 3};
        float zero = floor(u * 0.5);
        float a = list[3 + zero];
        r = color(a, 1, 1);
END
