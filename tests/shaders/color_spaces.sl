// Colors given in hsv, hsl, xyz, yiq and changed between them. Expect r = (1, 1, 1): all round trips close, red is
// red.
#include "probe.h"

float apart(color a, b)
{
    color d = abs(a - b);
    return max(comp(d, 0), comp(d, 1), comp(d, 2));
}

PROBE(color_spaces)
        color red = color "hsv" (0, 1, 1);
        float a = distance(point(comp(red, 0), comp(red, 1), comp(red, 2)), point(1, 0, 0)) < 1e-5 ? 1 : 0;
        color c = color(0.2 + 0.6 * u, 0.3, 0.7 * v + 0.1);
        float worst = 0;
        worst = max(worst, apart(c, ctransform("hsv", "rgb", ctransform("rgb", "hsv", c))));
        worst = max(worst, apart(c, ctransform("hsl", "rgb", ctransform("rgb", "hsl", c))));
        worst = max(worst, apart(c, ctransform("xyz", "rgb", ctransform("rgb", "xyz", c))));
        worst = max(worst, apart(c, ctransform("xyY", "rgb", ctransform("rgb", "xyY", c))));
        float b = worst < 1e-4 ? 1 : 0;
        float d = apart(c, ctransform("yiq", "rgb", ctransform("rgb", "yiq", c))) < 1e-2 ? 1 : 0;
        r = color(a, b, d);
END
