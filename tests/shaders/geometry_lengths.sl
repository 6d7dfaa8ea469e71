// length distance normalize ptlined. Expect r = (sqrt(2), u, v).
#include "probe.h"

PROBE(geometry_lengths)
        float a = length(vector(1, 1, 0));
        float b = distance(P, point(0, ycomp(P), 0));
        float c = ptlined(P, point(0, 0, 0), point(1, 0, 0));
        if (abs(length(normalize(vector(3, 4, 5))) - 1) > 1e-6 || length(normalize(vector(0))) != 0) c = -1;
        r = color(a, b, c);
END
