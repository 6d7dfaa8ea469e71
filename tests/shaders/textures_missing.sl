// A texture that is not there is mid-grey, and is reported once. Expect r = (0.5, 0.5, 0.5).
#include "probe.h"

PROBE(textures_missing)
        r = color texture("nowhere.tx", s, t);
END
