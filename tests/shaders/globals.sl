// The variables that every shader sees. Expect r = (u + s, v + t, 1).
#include "probe.h"

PROBE(globals)
        r = color(u + s, v + t, zcomp(normalize(N)));
        if (length(dPdu) != 1 || length(dPdv) != 1 || time != 0) r = color(-1);
END
