// Inner names hide outer ones until their block ends. Expect r = (1, 2, 1).
#include "probe.h"

PROBE(scopes)
        float x = 1;
        float inside = 0;
        { float x = 2; inside = x; }
        r = color(1, inside, x);
END
