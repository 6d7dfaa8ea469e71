// Macros with arguments, # and ##, conditions, lines joined. Expect r = (5, 3, 1).
#include "probe.h"

#define SUM(a, b) ((a) + \
                   (b))
#define JOIN(a, b) a##b
#define NAME(x) #x
#define three 3
#if defined(KANUKA) && !defined(NOTHING) && 2 * 3 == 6
#define CHOSEN 1
#elif 1
#define CHOSEN 2
#else
#define CHOSEN 3
#endif
#ifndef SUM
#error "SUM is defined"
#endif

PROBE(preprocessor)
        r = color(SUM(2, 3), JOIN(th, ree), CHOSEN);
        if (NAME(abc) != "abc") r = color(-1);
END
