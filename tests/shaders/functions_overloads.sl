// Overloads by the types of arguments. Expect r = (1, 2, 3).
#include "probe.h"

float kind(float x) { return 1; }
float kind(color x) { return 2; }
float kind(point x) { return 3; }

PROBE(functions_overloads)
        r = color(kind(1.0), kind(color(1)), kind(P));
END
