// Noise of one to four dimensions, in [0, 1]. Expect values of one hash: they must never change.
#include "probe.h"

PROBE(noise_float)
        r = color(noise(u * 10), noise(u * 10, v * 10), noise(P * 10));
        if (float noise(P * 10, 0.5) < 0 || float noise(P * 10, 0.5) > 1) r = color(-1);
END
