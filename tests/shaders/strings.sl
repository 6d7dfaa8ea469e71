// Strings: comparison, concat, format, match, as arguments. Expect r = (1, 1, 1).
#include "probe.h"

PROBE(strings)
        string a = concat("ab", "cd");
        string b = format("%f and %s", 2, "x");
        r = color(a == "abcd" ? 1 : 0, b == "2 and x" ? 1 : 0, match("b.*d", a));
END
