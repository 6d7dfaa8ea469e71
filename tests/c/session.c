/* What programs do to contexts: end them in callbacks, call before they begin, record lines of RIB.

   kanuka_ri_session WHAT [NAME] */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <ri.h>

static int ends = 0;

/* A handler as many programs have it, but for the exit(). */
static RtVoid end_at_errors(RtInt code, RtInt severity, char* message) {
    printf("%d|%d|%s\n", (int)code, (int)severity, message);
    if (severity >= RIE_ERROR) {
        ends++;
        RiEnd();
    }
}

static RtVoid say(RtInt code, RtInt severity, char* message) {
    printf("%d|%d|%s\n", (int)code, (int)severity, message);
}

static RtVoid call_again(RtInt code, RtInt severity, char* message) {
    say(code, severity, message);
    RiObjectInstance((RtObjectHandle)&ends); /* wrong as well */
    RiTransformEnd();
}

static RtVoid end_at_records(RtToken type, char* format, ...) {
    (void)type, (void)format;
    ends++;
    RiEnd();
}

static RtVoid end_at_once(RtPointer data, RtFloat detail) {
    (void)detail;
    *(int*)data += 1;
    RiEnd();
    RiSphere(1, -1, 1, 360, RI_NULL);
}

static RtVoid read_again(RtPointer data, RtFloat detail) {
    RiProcDelayedReadArchive(data, detail);
}

static void ended(const char* how, RtToken name) {
    static RtBound bound = {-1, 1, -1, 1, -1, 1};
    RtString archive = "part.rib";
    RiBegin(name);
    RiFormat(8, 8, 1);
    RiWorldBegin();
    if (strcmp(how, "handler") == 0) {
        RiErrorHandler(end_at_errors);
        RiTransformEnd();
    } else if (strcmp(how, "callback") == 0) {
        RiReadArchive(archive, end_at_records, RI_NULL);
    } else if (strcmp(how, "procedural") == 0) {
        RiProcedural(&ends, bound, end_at_once, NULL);
    } else { /* the handler's own calls are wrong */
        RiErrorHandler(call_again);
        RiTransformEnd();
        RiErrorHandler(RiErrorIgnore);
    }
    RiSphere(1, -1, 1, 360, RI_NULL);
    RiWorldEnd();
    RiEnd();
    printf("ended %d\n", ends);
}

/* Neither lights nor shaders. */
static void plain(RtToken file, RtToken display, int frames) {
    RtString archive = "part.rib";
    RtBound bound = {-1, 1, -1, 1, -1, 1};
    RtColor colors[2] = {{1, 0, 0}, {0, 0, 1}};
    char name[200];
    int i;
    RiBegin(file);
    for (i = 1; i <= frames; i++) {
        if (frames > 1)
            sprintf(name, "%s.%04d", display, i);
        RiFrameBegin(i);
        RiFormat(16, 16, 1);
        RiPixelSamples(2, 2);
        RiDisplay(frames > 1 ? name : display, RI_FILE, RI_RGB, RI_NULL);
        RiTranslate(0, 0, 2);
        RiWorldBegin();
        RiColor(colors[i % 2]);
        RiProcedural(&archive, bound, read_again, NULL);
        RiWorldEnd();
        RiFrameEnd();
    }
    RiEnd();
}

static void before(RtToken name) {
    RtString packing = "gzip", format = "binary";
    RtFloat one = 1;
    RiErrorHandler(say);
    RiSphere(1, -1, 1, 360, RI_NULL);
    RiDeclare("weight", "uniform float");
    RiDeclare("wrong", "uniform number");
    RiOption("rib", "compression", &packing, "string format", &format, RI_NULL);
    RiOption("limits", "gridsize", &one, RI_NULL);
    RiBegin(name);
    RiSurface("matte", "weight", &one, RI_NULL);
    RiEnd();
}

static void record(RtToken name) {
    RiBegin(name);
    RiArchiveRecord(RI_COMMENT, "one\ntwo\n#three\n");
    RiArchiveRecord(RI_STRUCTURE, "Creator %s", "a program");
    RiArchiveRecord(RI_VERBATIM, "# four\nDisplay \"a.exr\" \"file\" \"rgb\"\nFormat ");
    RiArchiveRecord(RI_VERBATIM, "%d %d 1", 64, 48);
    RiPixelSamples(2, 2);
    RiArchiveBegin("kept", RI_NULL);
    RiArchiveRecord(RI_VERBATIM, "Attribute \"user\"\n\"uniform float x\" [1]\n");
    RiArchiveEnd();
    RiEnd();
}

/* Names that renderers declare, and values that are none. */
static void names(RtToken file) {
    RtFloat bias = 0.25f;
    RtInt on = 1;
    RtString space = "shader", shadows = "on";
    RiErrorHandler(say);
    RiBegin(file);
    RiOption("shadow", "bias0", &bias, RI_NULL);
    RiAttribute("dice", "binary", &on, "rasterorient", &on, RI_NULL);
    RiAttribute("displacementbound", "sphere", &bias, "space", &space, RI_NULL);
    RiHider("hidden", "jitter", &on, RI_NULL);
    RiAttribute("light", "string shadow", (RtPointer) "on", "string shadow", &shadows, RI_NULL);
    RiAttribute("other", "bias", &bias, RI_NULL);
    RiAttribute("other", "nobodyknows", &bias, RI_NULL);
    RiDeclare("bias", "uniform integer");
    RiAttribute("trace", "bias", &on, RI_NULL);
    RiPixelFilter(NULL, 2, 2);
    RiIlluminate((RtLightHandle)&on, RI_TRUE);
    RiEnd();
}

/* Six pictures whose names end in ".something", an environment and a texture called as formats are, in one
   program. */
static void faces(void) {
    static RtString names[6] = {"face.px", "face.nx", "face.py", "face.ny", "face.pz", "face.nz"};
    static RtPoint square[4] = {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}};
    static RtFloat one = 1, none = 0;
    RtString made = "tif";
    RtColor color = {0, 0, 0};
    int i;
    RiBegin(RI_NULL);
    RiFormat(8, 8, 1);
    RiProjection(RI_ORTHOGRAPHIC, RI_NULL);
    for (i = 0; i < 7; i++) {
        RiFrameBegin(i);
        RiDisplay(i < 6 ? names[i] : "last.tif", RI_FILE, RI_RGB, RI_NULL);
        RiTranslate(0, 0, 1);
        RiWorldBegin();
        color[i % 3] = i < 3 ? 1 : 0.5f;
        RiColor(color);
        color[i % 3] = 0;
        if (i < 6)
            RiSurface(RI_CONSTANT, RI_NULL);
        else {
            RiColor((RtFloat[]){1, 1, 1});
            RiLightSource(RI_AMBIENTLIGHT, RI_NULL);
            RiSurface(RI_PAINTEDPLASTIC, RI_KA, &one, RI_KD, &none, RI_KS, &none, RI_TEXTURENAME, &made,
                      RI_NULL);
        }
        RiPolygon(4, RI_P, (RtPointer)square, RI_NULL);
        RiWorldEnd();
        RiFrameEnd();
        if (i == 5) {
            RiMakeCubeFaceEnvironment(names[0], names[1], names[2], names[3], names[4], names[5], "env", 90,
                                      RiBoxFilter, 1, 1, RI_NULL);
            RiMakeTexture(names[4], "tif", RI_CLAMP, RI_CLAMP, RiBoxFilter, 1, 1, RI_NULL);
        }
    }
    RiEnd();
}

int main(int argc, char** argv) {
    const char* what = argc > 1 ? argv[1] : "";
    const RtToken name = argc > 2 ? argv[2] : RI_NULL;
    if (strncmp(what, "end-", 4) == 0)
        ended(what + 4, name);
    else if (strcmp(what, "plain") == 0)
        plain(name, "plain", 1);
    else if (strcmp(what, "frames") == 0)
        plain(RI_NULL, name, 2);
    else if (strcmp(what, "before") == 0)
        before(name);
    else if (strcmp(what, "record") == 0)
        record(name);
    else if (strcmp(what, "names") == 0)
        names(name);
    else if (strcmp(what, "faces") == 0)
        faces();
    else if (strcmp(what, "begun") == 0) {
        RiBegin(name);
        RiWorldBegin();
    } else
        return 2;
    return 0;
}
