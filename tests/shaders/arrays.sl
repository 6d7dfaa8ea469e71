// Arrays: lists, indices that vary, lengths, copies by element; an index outside is held within. Expect r = (1 2 3 4
// 5 by columns, 4, 15).
#include "probe.h"

PROBE(arrays)
        float list[5] = {1, 2, 3, 4, 5};
        float sum = 0, i;
        for (i = 0; i < arraylength(list); i += 1) sum += list[i];
        float own[4];
        for (i = 0; i < 4; i += 1) own[i] = i * i;
        own[2] = 4;
        r = color(list[floor(4 * u + 0.01)], own[2], sum);
END
