/* What a program sees of ri.h without a picture: tokens, errors, contexts, filters, spaces. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <ri.h>

static int failures = 0, errors = 0, last_code = 0;
static char last_message[1000] = "";

#define CHECK(condition)                                                                                     \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                                  \
            failures++;                                                                                      \
        }                                                                                                    \
    } while (0)

static RtVoid count_errors(RtInt code, RtInt severity, char* message) {
    if (severity >= RIE_ERROR) {
        snprintf(last_message, sizeof last_message, "%s", message);
        errors++;
        last_code = code;
    }
}

static void set(RtPoint* p, float x, float y, float z) {
    (*p)[0] = x, (*p)[1] = y, (*p)[2] = z;
}

static int is(RtPoint p, float x, float y, float z) {
    return fabs(p[0] - x) < 1e-3 && fabs(p[1] - y) < 1e-3 && fabs(p[2] - z) < 1e-3;
}

int main(void) {
    RtContextHandle first, second;
    RtPoint point = {1, 1, 1};
    RtFloat one = 1, ninety = 90;
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
    CHECK(errors == 3 && last_code == RIE_BADHANDLE); /* once */
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
    RiFormat(200, 100, 1); /* the screen runs from -2 to 2, and from -1 to 1 */
    RiProjection(RI_PERSPECTIVE, RI_FOV, (RtPointer)&ninety, RI_NULL);
    RiTranslate(0, 0, 5);
    set(&point, 5, 5, 0);
    CHECK(RiTransformPoints(RI_CURRENT, RI_CAMERA, 1, &point) == &point && is(point, 5, 5, 5));
    CHECK(RiTransformPoints(RI_CAMERA, RI_RASTER, 1, &point) == &point);
    CHECK(is(point, 150, 0, point[2]));
    CHECK(RiTransformPoints(RI_RASTER, RI_NDC, 1, &point) == &point && is(point, 0.75f, 0, point[2]));
    CHECK(RiTransformPoints(RI_NDC, RI_SCREEN, 1, &point) == &point && is(point, 1, 1, point[2]));
    RiWorldBegin();
    set(&point, -10, 0, 0);
    CHECK(RiTransformPoints(RI_WORLD, RI_RASTER, 1, &point) == &point && is(point, 0, 50, point[2]));
    RiTranslate(1, 2, 3);
    set(&point, 1, 1, 1);
    CHECK(RiTransformPoints("object", RI_WORLD, 1, &point) == &point);
    CHECK(point[0] == 2 && point[1] == 3 && point[2] == 4);
    set(&point, 1, 1, 1);
    CHECK(RiTransformPoints(RI_OBJECT, RI_CAMERA, 1, &point) == &point && is(point, 2, 3, 9));
    CHECK(RiTransformPoints(RI_CAMERA, RI_OBJECT, 1, &point) == &point && is(point, 1, 1, 1));
    CHECK(RiTransformPoints("nowhere", RI_WORLD, 1, &point) == NULL && strstr(last_message, "\"nowhere\""));
    errors = 0;
    RiEnd(); /* the world is open: nothing to render, one error */
    CHECK(errors == 1 && last_code == RIE_NESTING);
    CHECK(RiTransformPoints(RI_OBJECT, RI_WORLD, 1, &point) == NULL && RiLastError == RIE_NOTSTARTED);
    RiLastError = RIE_NOERROR;
    RiContext(NULL); /* none, as RiGetContext() says */
    CHECK(RiLastError == RIE_NOERROR && RiGetContext() == NULL);

    CHECK(RiBoxFilter(0.4f, 0, 1, 1) == 1 && RiBoxFilter(0.6f, 0, 1, 1) == 0);
    CHECK(fabs(RiTriangleFilter(0.5f, 0, 2, 2) - 0.5f) < 1e-6);
    CHECK(RiGaussianFilter(0, 0, 2, 2) == 1 && RiCatmullRomFilter(1, 0, 4, 4) == 0);
    CHECK(fabs(RiSincFilter(1, 0, 4, 4)) < 1e-6 && RiMitchellFilter(0, 0, 4, 4) > 0.7f);
    return failures != 0;
}
