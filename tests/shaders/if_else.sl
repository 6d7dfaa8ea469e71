// if, else if, else, by values that vary and that do not. Expect r = (0, 1 or 2 by thirds of u; 1; 4 above v = 0.5).
#include "probe.h"

PROBE(if_else)
        if (u < 0.3) r = color(0, 0, 0);
        else if (u < 0.7) r = color(1, 0, 0);
        else r = color(2, 0, 0);
        float fixed = 3;
        if (fixed > 2) r += color(0, 1, 0); else r += color(0, 100, 0);
        if (v > 0.5) { r += color(0, 0, 4); }
END
