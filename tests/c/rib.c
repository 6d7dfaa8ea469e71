/* Writing RIB: every kind of argument, in both forms of a call. */
#include <stdio.h>
#include <string.h>

#include <ri.h>

static const char expected[] =
    "##RenderMan RIB-Structure 1.1\n"
    "#made by 1 program\n"
    "Declare \"weights\" \"varying float\"\n"
    "Option \"searchpath\" \"uniform string shader\" [\"a:b\"]\n"
    "PixelFilter \"catmull-rom\" 2 2\n"
    "WorldBegin\n"
    "Basis [-1 3 -3 1 3 -6 3 0 -3 3 0 0 1 0 0 0] 3 [0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1] 1\n"
    "LightSource \"pointlight\" \"1\" \"from\" [1 2 3]\n"
    "Illuminate \"1\" 0\n"
    "PatchMesh \"bicubic\" 7 \"nonperiodic\" 4 \"nonperiodic\" \"P\" [0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 "
    "16";

int main(int argc, char** argv) {
    const char* name = argc > 1 ? argv[1] : "ri_written.rib";
    RtString path = "a:b";
    RtPoint from = {1, 2, 3};
    RtBasis other;
    RtFloat points[84], weights[6] = {0, 1, 2, 3, 4, 5};
    RtFloat times[2] = {0, 0.5f};
    RtString archive = "part.rib";
    RtBound bound = {-1, 1, -1, 1, -1, 1};
    RtToken tokens[2];
    RtPointer parms[2];
    char text[8192];
    size_t length;
    FILE* file;
    int i;
    for (i = 0; i < 84; i++)
        points[i] = (RtFloat)i;
    memset(other, 0, sizeof other);
    other[3][3] = 1;

    RiBegin((RtToken)name);
    RiArchiveRecord(RI_COMMENT, "made by %d program", 1);
    RiDeclare("weights", "varying float");
    RiOption("searchpath", "uniform string shader", (RtPointer)&path, RI_NULL);
    RiPixelFilter(RiCatmullRomFilter, 2, 2);
    RiWorldBegin();
    RiBasis(RiBezierBasis, RI_BEZIERSTEP, other, 1);
    RiIlluminate(RiLightSource(RI_POINTLIGHT, RI_FROM, (RtPointer)from, RI_NULL), RI_FALSE);
    tokens[0] = RI_P, parms[0] = points;
    tokens[1] = "weights", parms[1] = weights; /* two patches by one: three by two corners */
    RiPatchMeshV(RI_BICUBIC, 7, RI_NONPERIODIC, 4, RI_NONPERIODIC, 2, tokens, parms);
    RiMotionBeginV(2, times);
    RiMotionEnd();
    RiProcedural(&archive, bound, RiProcDelayedReadArchive, NULL);
    RiWorldEnd();
    RiEnd();

    file = fopen(name, "rb");
    if (!file)
        return 1;
    length = fread(text, 1, sizeof text - 1, file);
    text[length] = 0;
    fclose(file);
    if (strncmp(text, expected, strlen(expected)) != 0 ||
        !strstr(text, "83]\n\"weights\" [0 1 2 3 4 5]\nMotionBegin [0 0.5]\nMotionEnd\n"
                      "Procedural \"DelayedReadArchive\" [\"part.rib\"] [-1 1 -1 1 -1 1]\nWorldEnd\n")) {
        fprintf(stderr, "written was:\n%s", text);
        return 1;
    }
    return 0;
}
