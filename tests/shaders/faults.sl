// An index outside of an array is held within, and reported once. Expect r = (3, 1, 1) and the message.
#include "probe.h"

PROBE(faults)
        float list[3] = {1, 2, 3};
        float zero = floor(u * 0.5);
        float a = list[3 + zero];
        r = color(a, 1, 1);
END
