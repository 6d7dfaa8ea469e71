// output parameters come back, others do not; functions see globals. Expect r = (3, 1, 2 u).
#include "probe.h"

void change(output float x; float y)
{
    float z = y;
    z += 1;
    x += z;
}
float doubled() { return 2 * u; }

PROBE(functions_output)
        float a = 1, b = 1;
        change(a, b);
        r = color(a, b, doubled());
END
