/* What a program sees of ri.h without a picture: tokens, errors, contexts, filters, spaces. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <ri.h>

static int failures = 0, errors = 0, last_code = 0;

#define CHECK(condition)                                                                                     \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                                  \
            failures++;                                                                                      \
        }                                                                                                    \
    } while (0)

static RtVoid count_errors(RtInt code, RtInt severity, char* message) {
    (void)message;
    if (severity >= RIE_ERROR) {
        errors++;
        last_code = code;
    }
}

int main(void) {
    RtContextHandle first, second;
    RtPoint point = {1, 1, 1};
    RtFloat one = 1;
    CHECK(strcmp(RI_RGB, "rgb") == 0 && strcmp(RI_P, "P") == 0);
    CHECK(RiBezierBasis[0][0] == -1 && RiPowerBasis[2][2] == 1);

    RiSphere(1, -1, 1, 360, RI_NULL); /* before RiBegin */
    CHECK(RiLastError == RIE_NOTSTARTED);
    CHECK(RiGetContext() == NULL);

    RiBegin(RI_NULL);
    first = RiGetContext();
    RiErrorHandler(count_errors);
    RiSphere(1, -1, 1, 360, RI_NULL); /* outside of a world */
    CHECK(errors == 1 && last_code == RIE_CONSISTENCY);
    RiSurface("matte", "nobodyknows", (RtPointer)&one, RI_NULL);
    CHECK(errors == 2 && last_code == RIE_BADTOKEN && RiLastError == RIE_BADTOKEN);
    RiIlluminate((RtLightHandle)&one, RI_TRUE);
    CHECK(errors >= 3);
    CHECK(strcmp(RiDeclare("known", "uniform float"), "known") == 0);
    errors = 0;
    RiSurface("matte", "known", (RtPointer)&one, RI_NULL);
    CHECK(errors == 0);

    RiBegin(RI_NULL);
    second = RiGetContext();
    CHECK(second != first && second != NULL);
    RiErrorHandler(RiErrorIgnore);
    RiEnd();
    CHECK(RiGetContext() == NULL);
    RiContext(first);
    CHECK(RiGetContext() == first);
    RiTranslate(0, 0, 5);
    RiWorldBegin();
    RiTranslate(1, 2, 3);
    CHECK(RiTransformPoints("object", RI_WORLD, 1, &point) == &point);
    CHECK(point[0] == 2 && point[1] == 3 && point[2] == 4);
    CHECK(RiTransformPoints("nowhere", RI_WORLD, 1, &point) == NULL);
    errors = 0;
    RiEnd(); /* the world is open: nothing to render, one error */
    CHECK(errors == 1 && last_code == RIE_NESTING);

    CHECK(RiBoxFilter(0.4f, 0, 1, 1) == 1 && RiBoxFilter(0.6f, 0, 1, 1) == 0);
    CHECK(fabs(RiTriangleFilter(0.5f, 0, 2, 2) - 0.5f) < 1e-6);
    CHECK(RiGaussianFilter(0, 0, 2, 2) == 1 && RiCatmullRomFilter(1, 0, 4, 4) == 0);
    CHECK(fabs(RiSincFilter(1, 0, 4, 4)) < 1e-6 && RiMitchellFilter(0, 0, 4, 4) > 0.7f);
    return failures != 0;
}
