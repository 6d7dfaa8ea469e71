// return from the middle of loops and branches, lane by lane. Expect r = (first square above 10 u, -1 below v = 0.5
// else u, 7).
#include "probe.h"

float first_square(float x)
{
    float i;
    for (i = 0; i < 10; i += 1)
        if (i * i > x)
            return i * i;
    return -1;
}
float sided(float x, y)
{
    if (y < 0.5)
        return -1;
    return x;
}
float seven() { return 7; }

PROBE(return_early)
        r = color(first_square(10 * u), sided(u, v), seven());
END
