// reflect refract fresnel, of directions that the shader made. Expect r = (1, -1, 0.04).
#include "probe.h"

PROBE(geometry_rays)
        vector down = normalize(vector(1, 0, -1));
        vector up = reflect(down, vector(0, 0, 1));
        vector through = refract(vector(0, 0, -1), vector(0, 0, 1), 1 / 1.5);
        float kr, kt;
        fresnel(vector(0, 0, -1), vector(0, 0, 1), 1 / 1.5, kr, kt);
        r = color(zcomp(up) / xcomp(up), zcomp(through), kr);
        if (abs(kr + kt - 1) > 1e-6) r = color(-9);
END
