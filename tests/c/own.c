/* What a program brings of its own: a function that hears what archives hold beside requests, a pixel filter,
   and textures without a world.

   kanuka_ri_own archive NAME.rib   prints the records of an archive, and what its callback draws is drawn
   kanuka_ri_own filter NAME.exr    renders with a filter of its own; NAME.rib writes that
   kanuka_ri_own texture IN OUT     makes a texture */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <ri.h>

static int inner = 0;

static RtVoid hear(RtToken type, char* format, ...) {
    va_list list;
    va_start(list, format);
    printf("%s|", type);
    vprintf(format, list);
    printf("|\n");
    va_end(list);
    if (strcmp(type, RI_VERBATIM) == 0 && !inner) { /* a call of its own, and an archive within */
        inner = 1;
        RiReadArchive("inner", hear, RI_NULL);
        RiReadArchive("inner", NULL, RI_NULL);
        inner = 0;
    }
}

/* One where the offset lies more than a pixel to the right, of twice the weight below the middle: the picture
   moves by a pixel and a half to the left. */
static RtFloat aside(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth) {
    (void)xwidth, (void)ywidth;
    return x < 1 ? 0.0f : y > 0 ? 2.0f : 1.0f;
}

static RtFloat nothing(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth) {
    (void)x, (void)y, (void)xwidth, (void)ywidth;
    return 0;
}

static void read_archive(const char* name) {
    RiBegin(RI_NULL);
    RiArchiveBegin("inner", RI_NULL);
    RiArchiveRecord(RI_COMMENT, " inside %d%%", 100);
    RiArchiveEnd();
    RiReadArchive((RtToken)name, hear, RI_NULL);
    RiReadArchive((RtToken)name, NULL, RI_NULL);
    RiEnd();
}

static void filtered(const char* name) {
    static RtPoint left[4] = {{-1, -1, 0}, {0, -1, 0}, {0, 1, 0}, {-1, 1, 0}};
    static RtPoint below[4] = {{-1, -1, -0.1f}, {1, -1, -0.1f}, {1, 0, -0.1f}, {-1, 0, -0.1f}};
    static RtColor red = {1, 0, 0}, green = {0, 1, 0};
    const int rib = strstr(name, ".rib") != NULL;
    RiBegin(rib ? (RtToken)name : RI_NULL);
    RiFormat(16, 16, 1);
    RiPixelSamples(32, 32);
    if (strstr(name, "none"))
        RiPixelFilter(nothing, 2, 2);
    else
        RiPixelFilter(aside, 4, 2);
    RiDisplay(rib ? "unused.exr" : (RtToken)name, RI_FILE, RI_RGB, RI_NULL);
    RiProjection(RI_ORTHOGRAPHIC, RI_NULL);
    RiTranslate(0, 0, 1);
    RiWorldBegin();
    RiSurface(RI_CONSTANT, RI_NULL);
    RiColor(red);
    RiPolygon(4, RI_P, (RtPointer)left, RI_NULL);
    RiColor(green);
    RiPolygon(4, RI_P, (RtPointer)below, RI_NULL);
    RiWorldEnd();
    RiEnd();
}

static void texture(const char* from, const char* to) {
    RiBegin(RI_NULL);
    RiFrameBegin(1); /* with the frame go its options */
    RiMakeTexture((RtString)from, (RtString)to, RI_PERIODIC, RI_CLAMP, RiGaussianFilter, 6, 2, RI_NULL);
    RiFrameEnd();
    RiMakeLatLongEnvironment((RtString)from, "made.env", RiBesselFilter, 4, 4, RI_NULL);
    RiEnd();
}

/* Colours of two samples, the first red and the second blue: two vertices of each. */
static void sampled(const char* name) {
    static RtPoint square[4] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    static RtFloat red_and_blue[6] = {1, 0, 0, 0, 0, 1}, back[6] = {1, 0, 0, 0, 0, 1};
    static RtFloat colors[8] = {1, 0, 0, 1, 0, 1, 1, 0};
    const int rib = strstr(name, ".rib") != NULL;
    RiBegin(rib ? (RtToken)name : RI_NULL);
    RiFormat(16, 16, 1);
    RiColorSamples(2, red_and_blue, back);
    RiDisplay(rib ? "unused.exr" : (RtToken)name, RI_FILE, RI_RGB, RI_NULL);
    RiProjection(RI_ORTHOGRAPHIC, RI_NULL);
    RiTranslate(0, 0, 1);
    RiWorldBegin();
    RiSurface(RI_CONSTANT, RI_NULL);
    RiPolygon(4, RI_P, (RtPointer)square, RI_CS, (RtPointer)colors, RI_NULL);
    RiWorldEnd();
    RiEnd();
}

int main(int argc, char** argv) {
    const char* what = argc > 2 ? argv[1] : "";
    if (strcmp(what, "archive") == 0)
        read_archive(argv[2]);
    else if (strcmp(what, "filter") == 0)
        filtered(argv[2]);
    else if (strcmp(what, "samples") == 0)
        sampled(argv[2]);
    else if (strcmp(what, "texture") == 0 && argc > 3)
        texture(argv[2], argv[3]);
    else
        return 2;
    return RiLastError == RIE_NOERROR ? 0 : 1;
}
