// while, by values that vary and that do not. Expect r = (64, the first power of two above 10 u, 0).
#include "probe.h"

PROBE(while_loop)
        float power = 1, own = 1, never = 0;
        while (power < 50) power *= 2;
        while (own <= 10 * u) own *= 2;
        while (never > 0) never += 1;
        r = color(power, own, never);
END
