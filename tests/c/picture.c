/* A picture in the manner of the textbooks: options, camera, lights, quadrics, a mesh, an object, motion, and
   a procedural of the program's own that divides itself while it is large in the picture.

   kanuka_ri_picture NAME.exr renders; kanuka_ri_picture NAME.rib writes the same scene as RIB. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <ri.h>

typedef struct {
    RtFloat radius;
    int level;
} Sponge;

static int frees = 0, divisions = 0;

static RtVoid free_sponge(RtPointer data) {
    free(data);
    frees++;
}

/* Eight balls at the corners; each divides in turn while it covers more than some pixels. */
static RtVoid divide_sponge(RtPointer data, RtFloat detail) {
    const Sponge* s = (const Sponge*)data;
    int corner;
    divisions++;
    if (s->level == 0 || detail < 200) {
        RtColor color;
        color[0] = 0.8f, color[1] = 0.25f + 0.15f * (RtFloat)s->level, color[2] = 0.1f;
        RiColor(color);
        RiSphere(s->radius, -s->radius, s->radius, 360.0f, RI_NULL);
        return;
    }
    for (corner = 0; corner < 8; corner++) {
        const RtFloat half = s->radius / 2;
        RtBound bound;
        Sponge* child = (Sponge*)malloc(sizeof *child);
        child->radius = half;
        child->level = s->level - 1;
        bound[0] = bound[2] = bound[4] = -half;
        bound[1] = bound[3] = bound[5] = half;
        RiTransformBegin();
        RiTranslate(corner & 1 ? half : -half, corner & 2 ? half : -half, corner & 4 ? half : -half);
        RiProcedural(child, bound, divide_sponge, free_sponge);
        RiTransformEnd();
    }
}

static void floor_of_squares(void) {
    static RtInt nverts[2] = {4, 4};
    static RtInt verts[8] = {0, 1, 4, 3, 1, 2, 5, 4};
    static RtPoint points[6] = {{-4, -1, -2}, {0, -1, -2}, {4, -1, -2}, {-4, -1, 6}, {0, -1, 6}, {4, -1, 6}};
    static RtColor colors[2] = {{0.2f, 0.3f, 0.4f}, {0.5f, 0.5f, 0.45f}};
    RiDeclare("tint", "uniform color");
    RiPointsPolygons(2, nverts, verts, RI_P, (RtPointer)points, "uniform color Cs", (RtPointer)colors,
                     RI_NULL);
}

int main(int argc, char** argv) {
    const char* name = argc > 1 ? argv[1] : "ri_picture.exr";
    const int rib = strstr(name, ".rib") != NULL;
    RtFloat fov = 40, intensity = 12, roughness = 0.1f, high = 0.5f;
    RtPoint from = {-3, 5, -4};
    RtLightHandle lamp, sky;
    RtObjectHandle ring;
    RtBound bound = {-1, 1, -1, 1, -1, 1};
    Sponge* sponge = (Sponge*)malloc(sizeof *sponge);
    FILE* file;
    int i;

    remove(name);
    RiBegin(rib ? (RtToken)name : RI_NULL);
    RiFormat(160, 120, 1.0f);
    RiPixelSamples(4, 4);
    RiPixelFilter(RiGaussianFilter, 2, 2);
    RiDisplay(rib ? "ri_picture_by_rib.exr" : (RtToken)name, RI_FILE, RI_RGB, RI_NULL);
    RiShutter(0, 1);
    RiProjection(RI_PERSPECTIVE, RI_FOV, (RtPointer)&fov, RI_NULL);
    RiTranslate(0, 0, 5);
    RiRotate(-15, 1, 0, 0);
    RiWorldBegin();

    lamp =
        RiLightSource(RI_POINTLIGHT, RI_INTENSITY, (RtPointer)&intensity, RI_FROM, (RtPointer)from, RI_NULL);
    sky = RiLightSource(RI_AMBIENTLIGHT, RI_INTENSITY, (RtPointer)&roughness, RI_NULL);
    RiIlluminate(lamp, RI_TRUE);
    RiIlluminate(sky, RI_TRUE);

    RiSurface(RI_MATTE, RI_NULL);
    floor_of_squares();

    ring = RiObjectBegin();
    RiTorus(0.3f, 0.08f, 0, 360, 360, RI_NULL);
    RiObjectEnd();
    RiSurface(RI_PLASTIC, RI_ROUGHNESS, (RtPointer)&roughness, RI_KS, (RtPointer)&high, RI_NULL);
    for (i = 0; i < 3; i++) {
        RiAttributeBegin();
        RiTranslate(-2.0f + (RtFloat)i * 0.5f, -0.7f, -0.6f + (RtFloat)i);
        RiObjectInstance(ring);
        RiAttributeEnd();
    }

    RiAttributeBegin();
    RiMotionBegin(2, 0.0, 1.0);
    RiTranslate(1.9f, 0, 0);
    RiTranslate(2.1f, 0.3f, 0);
    RiMotionEnd();
    RiCone(1.2f, 0.4f, 360, RI_NULL);
    RiAttributeEnd();

    RiAttributeBegin();
    RiRotate(30, 0, 1, 0);
    sponge->radius = 1;
    sponge->level = 2;
    RiProcedural(sponge, bound, divide_sponge, free_sponge);
    RiAttributeEnd();

    RiWorldEnd();
    RiEnd();

    if (RiLastError != RIE_NOERROR) {
        fprintf(stderr, "RiLastError is %d\n", RiLastError);
        return 1;
    }
    if (divisions < 9 || frees != divisions) {
        fprintf(stderr, "%d divisions, %d frees\n", divisions, frees);
        return 1;
    }
    file = fopen(name, "rb");
    if (!file) {
        fprintf(stderr, "%s was not written\n", name);
        return 1;
    }
    fseek(file, 0, SEEK_END);
    i = ftell(file) > 1000;
    fclose(file);
    return i ? 0 : 1;
}
