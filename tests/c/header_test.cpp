// ri.h in C++: what other renderers' headers take, this takes.
extern "C" {
#include <ri.h>
}

#include <cmath>
#include <cstdio>
#include <cstring>

static int heard = 0, recorded = 0;

static void constant_handler(RtInt, RtInt, const char* message) {
    std::fprintf(stderr, "heard: %s\n", message);
    heard++;
}
static void plain_handler(RtInt, RtInt, char*) {
    heard += 10;
}
static void constant_callback(RtToken, const char*, ...) {
    recorded++;
}
static void plain_callback(RtToken, char*, ...) {
    recorded += 10;
}

#define CHECK(condition)                                                                                     \
    do {                                                                                                     \
        if (!(condition))                                                                                    \
            return std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition), 1;                   \
    } while (0)

int main() {
    RtObjectHandle object = RI_NULL;
    RtLightHandle light = RI_NULL;
    RtInterval interval = {0, 1};
    RtVolumeHandle volume = RI_NULL;
    char p[] = "P", bound_name[] = "weight";
    char* own_tokens[] = {p, bound_name};
    static const RtToken tokens[] = {"P", "uniform float weight"};
    RtPoint corners[4] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    RtFloat weight = 1;
    RtPointer values[] = {corners, &weight};
    RtPoint one = {1, 0, 0}, two = {1, 0, 1};
    RtBound bound = {0, 1, 0, 1, 0, 1};
    CHECK(!object && !light && !volume && interval[1] == 1 && RIE_DISKFULL == 6);

    RiBegin(RI_NULL);
    RiErrorHandler(NULL);
    RiErrorHandler(RiErrorIgnore);
    RiErrorHandler(plain_handler);
    RiErrorHandler(constant_handler);
    RiArchiveBegin("kept", RI_NULL);
    RiArchiveRecord(RI_COMMENT, "one");
    RiArchiveEnd();
    RiReadArchive("kept", plain_callback, RI_NULL);
    RiReadArchive("kept", constant_callback, RI_NULL);
    RiReadArchive("kept", NULL, RI_NULL);
    RiReadArchive("kept", RI_NULL, RI_NULL);
    CHECK(recorded == 11 && heard == 0);
    RiTransformEnd();
    CHECK(heard == 1);
    RiWorldBegin();
    RiPolygonV(4, 1, own_tokens, values);
    RiPolygonV(4, 2, tokens, values);
    RiHyperboloid(one, two, 360, RI_NULL);
    RiHyperboloidV(one, two, 360, 0, own_tokens, values);
    RiProcedural(RI_NULL, bound, RiProcDelayedReadArchive, RI_NULL ? RiProcFree : NULL);
    CHECK(heard == 2);
    RiEnd();
    RiContext(RI_NULL);
    CHECK(std::strcmp(RI_CURRENT, "current") == 0 && std::strcmp(RI_NDC, "NDC") == 0);
    CHECK(RiDiskFilter(0.4f, 0, 1, 1) == 1 && RiDiskFilter(0.4f, 0.4f, 1, 1) == 0);
    CHECK(RiSeparableCatmullRomFilter(0, 0, 4, 4) == 1 && RiLanczosFilter(3, 0, 6, 6) == 0);
    RiSynchronize(RI_NULL);
    return 0;
}
