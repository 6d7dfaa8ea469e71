// sin cos tan asin acos atan radians degrees. Expect r = (sin 2 pi u, v, 45).
#include "probe.h"

PROBE(math_angles)
        float a = sin(2 * PI * u);
        float b = asin(sin(v)) ;
        float c = degrees(atan(1, 1));
        if (abs(cos(acos(u)) - u) > 1e-5 || abs(tan(atan(v)) - v) > 1e-5 || abs(radians(180) - PI) > 1e-6) c = -1;
        r = color(a, b, c);
END
