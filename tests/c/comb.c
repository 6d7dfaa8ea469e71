/* A procedural in a library of its own: a row of spheres, and another procedural of itself at their end. */
#include <ri.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    int count;
    float radius;
} Comb;

RtPointer ConvertParameters(RtString text) {
    Comb* comb = malloc(sizeof(Comb));
    if (sscanf(text, "%d %f", &comb->count, &comb->radius) != 2)
        comb->count = 0;
    return comb;
}

RtVoid Subdivide(RtPointer data, RtFloat detail) {
    const Comb* comb = data;
    RtFloat wear[1];
    RtToken token = "wear"; /* the scene declares it */
    RtPointer value = wear;
    int i;
    for (i = 0; i < comb->count; i++) {
        RtColor color;
        color[0] = (RtFloat)i / (RtFloat)comb->count;
        color[1] = detail > 0 ? 0.5f : 0;
        color[2] = 1;
        wear[0] = 0.25f;
        RiAttributeBegin();
        RiTranslate((RtFloat)i, 0, 0);
        RiColor(color);
        RiSphereV(comb->radius, -comb->radius, comb->radius, 360, 1, &token, &value);
        RiAttributeEnd();
    }
    if (comb->count > 1) {
        RtBound bound = {0, 1, -1, 1, -1, 1};
        RtString arguments[2] = {"comb.so", "1 0.5"};
        RiTranslate(0, 2, 0);
        RiProcedural(arguments, bound, RiProcDynamicLoad, RI_NULL);
    }
}

RtVoid Free(RtPointer data) {
    free(data);
}
