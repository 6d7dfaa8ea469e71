// printf says what it is given, once. Expect r = 1, and the message.
#include "probe.h"

PROBE(printing)
        printf("two is %f, a color is %c, %s", 2, color(1, 0, 0.5), "done");
        r = 1;
END
