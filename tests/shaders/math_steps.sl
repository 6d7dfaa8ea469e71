// step smoothstep linearstep mix. Expect r = (1 from u = 0.5 on, a smooth rise, v).
#include "probe.h"

PROBE(math_steps)
        r = color(step(0.5, u), smoothstep(0.2, 0.8, u), mix(0, 2, linearstep(0, 2, v)));
        if (mix(color(0), color(1), 0.25) != color(0.25)) r = color(-1);
END
