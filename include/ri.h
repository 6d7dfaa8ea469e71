/* The C binding of the RenderMan Interface, RISpec 3.2 and what renderers share beyond it. Link with -lkanuka.
   Made from the table of requests by kanuka_make_ri; docs/c-binding.md. */
#ifndef KANUKA_RI_H
#define KANUKA_RI_H

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define KANUKA_RI __attribute__((visibility("default")))
#else
#define KANUKA_RI
#endif

/* ---- types ---- */
typedef short RtBoolean;
typedef int RtInt;
typedef float RtFloat;
#ifdef __cplusplus
typedef const char* RtToken; /* string literals are constant there */
typedef const char* RtString;
#else
typedef char* RtToken;
typedef char* RtString;
#endif
typedef RtFloat RtColor[3];
typedef RtFloat RtPoint[3];
typedef RtFloat RtVector[3];
typedef RtFloat RtNormal[3];
typedef RtFloat RtHpoint[4];
typedef RtFloat RtMatrix[4][4];
typedef RtFloat RtBasis[4][4];
typedef RtFloat RtBound[6];
typedef RtFloat RtInterval[2];
typedef void* RtPointer;
typedef void RtVoid;
typedef RtFloat (*RtFilterFunc)(RtFloat, RtFloat, RtFloat, RtFloat);
typedef RtVoid (*RtErrorFunc)(RtInt code, RtInt severity, char* message);
typedef RtVoid (*RtErrorHandler)(RtInt code, RtInt severity, char* message);
typedef RtVoid (*RtFunc)(void);
typedef RtVoid (*RtProcSubdivFunc)(RtPointer data, RtFloat detail);
typedef RtVoid (*RtProcFreeFunc)(RtPointer data);
typedef RtVoid (*RtArchiveCallback)(RtToken type, char* format, ...);
typedef RtPointer RtObjectHandle;
typedef RtPointer RtLightHandle;
typedef RtPointer RtContextHandle;
typedef RtPointer RtArchiveHandle;
typedef RtPointer RtVolumeHandle;

/* ---- constants ---- */
#define RI_FALSE 0
#define RI_TRUE 1
#define RI_INFINITY ((RtFloat)1.0e38)
#define RI_EPSILON ((RtFloat)1.0e-10)
#define RI_NULL ((char*)0) /* goes where a pointer of any kind of data goes, in C++ as well */

KANUKA_RI extern RtToken RI_FRAMEBUFFER, RI_FILE, RI_RGB, RI_RGBA, RI_RGBZ, RI_RGBAZ, RI_A, RI_Z,
    RI_AZ, RI_MERGE, RI_ORIGIN, RI_PERSPECTIVE, RI_ORTHOGRAPHIC, RI_HIDDEN, RI_PAINT, RI_CONSTANT,
    RI_SMOOTH, RI_FLATNESS, RI_FOV, RI_AMBIENTLIGHT, RI_POINTLIGHT, RI_DISTANTLIGHT, RI_SPOTLIGHT,
    RI_INTENSITY, RI_LIGHTCOLOR, RI_FROM, RI_TO, RI_CONEANGLE, RI_CONEDELTAANGLE, RI_BEAMDISTRIBUTION,
    RI_MATTE, RI_METAL, RI_SHINYMETAL, RI_PLASTIC, RI_PAINTEDPLASTIC, RI_KA, RI_KD, RI_KS, RI_KR,
    RI_ROUGHNESS, RI_TEXTURENAME, RI_SPECULARCOLOR, RI_DEPTHCUE, RI_FOG, RI_BUMPY, RI_MINDISTANCE,
    RI_MAXDISTANCE, RI_BACKGROUND, RI_DISTANCE, RI_AMPLITUDE, RI_RASTER, RI_SCREEN, RI_CAMERA,
    RI_WORLD, RI_OBJECT, RI_INSIDE, RI_OUTSIDE, RI_LH, RI_RH, RI_P, RI_PZ, RI_PW, RI_N, RI_NP, RI_CS,
    RI_OS, RI_S, RI_T, RI_ST, RI_WIDTH, RI_CONSTANTWIDTH, RI_BILINEAR, RI_BICUBIC, RI_LINEAR,
    RI_CUBIC, RI_CATMULLCLARK, RI_HOLE, RI_CREASE, RI_CORNER, RI_INTERPOLATEBOUNDARY, RI_PRIMITIVE,
    RI_INTERSECTION, RI_UNION, RI_DIFFERENCE, RI_PERIODIC, RI_NONPERIODIC, RI_CLAMP, RI_BLACK,
    RI_IGNORE, RI_PRINT, RI_ABORT, RI_HANDLER, RI_COMMENT, RI_STRUCTURE, RI_VERBATIM, RI_IDENTIFIER,
    RI_NAME, RI_SHADINGGROUP, RI_CURRENT, RI_SHADER, RI_NDC, RI_EYE, RI_RAYTRACE, RI_ZFILE,
    RI_QUANTIZE, RI_DITHER, RI_EXPOSURE, RI_FILTER, RI_FILTERWIDTH, RI_SEARCHPATH, RI_TEXTURE,
    RI_DISPLAY, RI_LIMITS, RI_SHADOW, RI_BIAS0, RI_BIAS1, RI_SAMPLE, RI_BOUNDS, RI_RENDER,
    RI_ATTRIBUTE, RI_TRACE, RI_USER;

KANUKA_RI extern RtBasis RiBezierBasis, RiBSplineBasis, RiCatmullRomBasis, RiHermiteBasis, RiPowerBasis;
#define RI_BEZIERSTEP ((RtInt)3)
#define RI_BSPLINESTEP ((RtInt)1)
#define RI_CATMULLROMSTEP ((RtInt)1)
#define RI_HERMITESTEP ((RtInt)2)
#define RI_POWERSTEP ((RtInt)4)

/* ---- errors ---- */
KANUKA_RI extern RtInt RiLastError;

#define RIE_NOERROR ((RtInt)0)
#define RIE_NOMEM ((RtInt)1)
#define RIE_SYSTEM ((RtInt)2)
#define RIE_NOFILE ((RtInt)3)
#define RIE_BADFILE ((RtInt)4)
#define RIE_VERSION ((RtInt)5)
#define RIE_DISKFULL ((RtInt)6)
#define RIE_INCAPABLE ((RtInt)11)
#define RIE_OPTIONAL ((RtInt)12)
#define RIE_UNIMPLEMENT ((RtInt)12)
#define RIE_LIMIT ((RtInt)13)
#define RIE_BUG ((RtInt)14)
#define RIE_NOTSTARTED ((RtInt)23)
#define RIE_NESTING ((RtInt)24)
#define RIE_NOTOPTIONS ((RtInt)25)
#define RIE_NOTATTRIBS ((RtInt)26)
#define RIE_NOTPRIMS ((RtInt)27)
#define RIE_ILLSTATE ((RtInt)28)
#define RIE_BADMOTION ((RtInt)29)
#define RIE_BADSOLID ((RtInt)30)
#define RIE_BADTOKEN ((RtInt)41)
#define RIE_RANGE ((RtInt)42)
#define RIE_CONSISTENCY ((RtInt)43)
#define RIE_BADHANDLE ((RtInt)44)
#define RIE_NOSHADER ((RtInt)45)
#define RIE_MISSINGDATA ((RtInt)46)
#define RIE_SYNTAX ((RtInt)47)
#define RIE_MATH ((RtInt)61)

#define RIE_INFO ((RtInt)0)
#define RIE_WARNING ((RtInt)1)
#define RIE_ERROR ((RtInt)2)
#define RIE_SEVERE ((RtInt)3)

KANUKA_RI RtVoid RiErrorHandler(RtErrorFunc handler);
KANUKA_RI RtVoid RiErrorIgnore(RtInt code, RtInt severity, char* message);
KANUKA_RI RtVoid RiErrorPrint(RtInt code, RtInt severity, char* message);
KANUKA_RI RtVoid RiErrorAbort(RtInt code, RtInt severity, char* message);

/* ---- contexts ---- */
KANUKA_RI RtVoid RiBegin(RtToken name); /* RI_NULL renders; a name that ends in .rib, .rib.gz or .rib.zst writes */
KANUKA_RI RtVoid RiEnd(void);
KANUKA_RI RtContextHandle RiGetContext(void);
KANUKA_RI RtVoid RiContext(RtContextHandle handle);
KANUKA_RI RtVoid RiSynchronize(RtToken name); /* nothing waits for anything: a world is rendered when RiWorldEnd returns */

/* ---- what the table alone does not make ---- */
KANUKA_RI RtToken RiDeclare(RtString name, RtString declaration);
KANUKA_RI RtVoid RiMotionBegin(RtInt n, ...);
KANUKA_RI RtVoid RiMotionBeginV(RtInt n, RtFloat times[]);
KANUKA_RI RtVoid RiReadArchive(RtToken name, RtArchiveCallback callback, ...);
KANUKA_RI RtVoid RiReadArchiveV(RtToken name, RtArchiveCallback callback, RtInt n, const RtToken tokens[],
                                RtPointer parms[]);
KANUKA_RI RtArchiveHandle RiArchiveBegin(RtToken name, ...);
KANUKA_RI RtArchiveHandle RiArchiveBeginV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtObjectHandle RiObjectBeginV(RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiOption(RtToken name, ...);
KANUKA_RI RtVoid RiOptionV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiArchiveRecord(RtToken type, RtString format, ...);
KANUKA_RI RtPoint* RiTransformPoints(RtToken from, RtToken to, RtInt n, RtPoint points[]);
KANUKA_RI RtVoid RiProcedural(RtPointer data, RtBound bound, RtProcSubdivFunc subdivide, RtProcFreeFunc free);
KANUKA_RI RtVoid RiProcDelayedReadArchive(RtPointer data, RtFloat detail);
KANUKA_RI RtVoid RiProcRunProgram(RtPointer data, RtFloat detail);
KANUKA_RI RtVoid RiProcDynamicLoad(RtPointer data, RtFloat detail);
KANUKA_RI RtVoid RiProcFree(RtPointer data);

KANUKA_RI RtFloat RiBoxFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiTriangleFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiDiskFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiLanczosFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiSeparableCatmullRomFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiCatmullRomFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiSincFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiBesselFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiGaussianFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiMitchellFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtFloat RiBlackmanHarrisFilter(RtFloat x, RtFloat y, RtFloat xwidth, RtFloat ywidth);

/* ---- requests ---- */
KANUKA_RI RtVoid RiFrameBegin(RtInt number);
KANUKA_RI RtVoid RiFrameEnd(void);
KANUKA_RI RtVoid RiWorldBegin(void);
KANUKA_RI RtVoid RiWorldEnd(void);
KANUKA_RI RtVoid RiAttributeBegin(void);
KANUKA_RI RtVoid RiAttributeEnd(void);
KANUKA_RI RtVoid RiTransformBegin(void);
KANUKA_RI RtVoid RiTransformEnd(void);
KANUKA_RI RtVoid RiSolidBegin(RtToken operation);
KANUKA_RI RtVoid RiSolidEnd(void);
KANUKA_RI RtObjectHandle RiObjectBegin(void);
KANUKA_RI RtVoid RiObjectEnd(void);
KANUKA_RI RtVoid RiObjectInstance(RtObjectHandle handle);
KANUKA_RI RtVoid RiMotionEnd(void);
KANUKA_RI RtVoid RiArchiveEnd(void);
KANUKA_RI RtVoid RiIfBegin(RtToken condition, ...);
KANUKA_RI RtVoid RiIfBeginV(RtToken condition, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiElseIf(RtToken condition, ...);
KANUKA_RI RtVoid RiElseIfV(RtToken condition, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiElse(void);
KANUKA_RI RtVoid RiIfEnd(void);
KANUKA_RI RtVoid RiFormat(RtInt xresolution, RtInt yresolution, RtFloat pixelaspect);
KANUKA_RI RtVoid RiFrameAspectRatio(RtFloat ratio);
KANUKA_RI RtVoid RiScreenWindow(RtFloat left, RtFloat right, RtFloat bottom, RtFloat top);
KANUKA_RI RtVoid RiCropWindow(RtFloat xmin, RtFloat xmax, RtFloat ymin, RtFloat ymax);
KANUKA_RI RtVoid RiProjection(RtToken name, ...);
KANUKA_RI RtVoid RiProjectionV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiClipping(RtFloat near, RtFloat far);
KANUKA_RI RtVoid RiClippingPlane(RtFloat x, RtFloat y, RtFloat z, RtFloat nx, RtFloat ny, RtFloat nz);
KANUKA_RI RtVoid RiDepthOfField(RtFloat fstop, RtFloat focallength, RtFloat focaldistance);
KANUKA_RI RtVoid RiShutter(RtFloat min, RtFloat max);
KANUKA_RI RtVoid RiPixelVariance(RtFloat variance);
KANUKA_RI RtVoid RiPixelSamples(RtFloat xsamples, RtFloat ysamples);
KANUKA_RI RtVoid RiPixelFilter(RtFilterFunc filter, RtFloat xwidth, RtFloat ywidth);
KANUKA_RI RtVoid RiExposure(RtFloat gain, RtFloat gamma);
KANUKA_RI RtVoid RiImager(RtToken name, ...);
KANUKA_RI RtVoid RiImagerV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiQuantize(RtToken type, RtInt one, RtInt min, RtInt max, RtFloat dither);
KANUKA_RI RtVoid RiDisplay(RtToken name, RtToken type, RtToken mode, ...);
KANUKA_RI RtVoid RiDisplayV(RtToken name, RtToken type, RtToken mode, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiHider(RtToken type, ...);
KANUKA_RI RtVoid RiHiderV(RtToken type, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiColorSamples(RtInt n, RtFloat nRGB[], RtFloat RGBn[]);
KANUKA_RI RtVoid RiRelativeDetail(RtFloat scale);
KANUKA_RI RtVoid RiColor(RtColor color);
KANUKA_RI RtVoid RiOpacity(RtColor color);
KANUKA_RI RtVoid RiTextureCoordinates(RtFloat s1, RtFloat t1, RtFloat s2, RtFloat t2, RtFloat s3, RtFloat t3, RtFloat s4, RtFloat t4);
KANUKA_RI RtLightHandle RiLightSource(RtToken name, ...);
KANUKA_RI RtLightHandle RiLightSourceV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtLightHandle RiAreaLightSource(RtToken name, ...);
KANUKA_RI RtLightHandle RiAreaLightSourceV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiIlluminate(RtLightHandle light, RtBoolean on);
KANUKA_RI RtVoid RiSurface(RtToken name, ...);
KANUKA_RI RtVoid RiSurfaceV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiDisplacement(RtToken name, ...);
KANUKA_RI RtVoid RiDisplacementV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiAtmosphere(RtToken name, ...);
KANUKA_RI RtVoid RiAtmosphereV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiInterior(RtToken name, ...);
KANUKA_RI RtVoid RiInteriorV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiExterior(RtToken name, ...);
KANUKA_RI RtVoid RiExteriorV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiShadingRate(RtFloat size);
KANUKA_RI RtVoid RiShadingInterpolation(RtToken type);
KANUKA_RI RtVoid RiMatte(RtBoolean on);
KANUKA_RI RtVoid RiBound(RtBound bound);
KANUKA_RI RtVoid RiDetail(RtBound bound);
KANUKA_RI RtVoid RiDetailRange(RtFloat minvisible, RtFloat lowertransition, RtFloat uppertransition, RtFloat maxvisible);
KANUKA_RI RtVoid RiGeometricApproximation(RtToken type, RtFloat value);
KANUKA_RI RtVoid RiGeometricRepresentation(RtToken type);
KANUKA_RI RtVoid RiOrientation(RtToken orientation);
KANUKA_RI RtVoid RiReverseOrientation(void);
KANUKA_RI RtVoid RiSides(RtInt sides);
KANUKA_RI RtVoid RiBasis(RtBasis ubasis, RtInt ustep, RtBasis vbasis, RtInt vstep);
KANUKA_RI RtVoid RiTrimCurve(RtInt nloops, RtInt ncurves[], RtInt order[], RtFloat knot[], RtFloat min[], RtFloat max[], RtInt n[], RtFloat u[], RtFloat v[], RtFloat w[]);
KANUKA_RI RtVoid RiAttribute(RtToken name, ...);
KANUKA_RI RtVoid RiAttributeV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiIdentity(void);
KANUKA_RI RtVoid RiTransform(RtMatrix matrix);
KANUKA_RI RtVoid RiConcatTransform(RtMatrix matrix);
KANUKA_RI RtVoid RiPerspective(RtFloat fov);
KANUKA_RI RtVoid RiTranslate(RtFloat dx, RtFloat dy, RtFloat dz);
KANUKA_RI RtVoid RiRotate(RtFloat angle, RtFloat dx, RtFloat dy, RtFloat dz);
KANUKA_RI RtVoid RiScale(RtFloat sx, RtFloat sy, RtFloat sz);
KANUKA_RI RtVoid RiSkew(RtFloat angle, RtFloat dx1, RtFloat dy1, RtFloat dz1, RtFloat dx2, RtFloat dy2, RtFloat dz2);
KANUKA_RI RtVoid RiDeformation(RtToken name, ...);
KANUKA_RI RtVoid RiDeformationV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiCoordinateSystem(RtToken space);
KANUKA_RI RtVoid RiScopedCoordinateSystem(RtToken space);
KANUKA_RI RtVoid RiCoordSysTransform(RtToken space);
KANUKA_RI RtVoid RiPolygon(RtInt nvertices, ...);
KANUKA_RI RtVoid RiPolygonV(RtInt nvertices, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiGeneralPolygon(RtInt nloops, RtInt nverts[], ...);
KANUKA_RI RtVoid RiGeneralPolygonV(RtInt nloops, RtInt nverts[], RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiPointsPolygons(RtInt npolys, RtInt nverts[], RtInt verts[], ...);
KANUKA_RI RtVoid RiPointsPolygonsV(RtInt npolys, RtInt nverts[], RtInt verts[], RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiPointsGeneralPolygons(RtInt npolys, RtInt nloops[], RtInt nverts[], RtInt verts[], ...);
KANUKA_RI RtVoid RiPointsGeneralPolygonsV(RtInt npolys, RtInt nloops[], RtInt nverts[], RtInt verts[], RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiPatch(RtToken type, ...);
KANUKA_RI RtVoid RiPatchV(RtToken type, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiPatchMesh(RtToken type, RtInt nu, RtToken uwrap, RtInt nv, RtToken vwrap, ...);
KANUKA_RI RtVoid RiPatchMeshV(RtToken type, RtInt nu, RtToken uwrap, RtInt nv, RtToken vwrap, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiNuPatch(RtInt nu, RtInt uorder, RtFloat uknot[], RtFloat umin, RtFloat umax, RtInt nv, RtInt vorder, RtFloat vknot[], RtFloat vmin, RtFloat vmax, ...);
KANUKA_RI RtVoid RiNuPatchV(RtInt nu, RtInt uorder, RtFloat uknot[], RtFloat umin, RtFloat umax, RtInt nv, RtInt vorder, RtFloat vknot[], RtFloat vmin, RtFloat vmax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiSubdivisionMesh(RtToken scheme, RtInt nfaces, RtInt nverts[], RtInt verts[], RtInt ntags, const RtToken tags[], RtInt nargs[], RtInt intargs[], RtFloat floatargs[], ...);
KANUKA_RI RtVoid RiSubdivisionMeshV(RtToken scheme, RtInt nfaces, RtInt nverts[], RtInt verts[], RtInt ntags, const RtToken tags[], RtInt nargs[], RtInt intargs[], RtFloat floatargs[], RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiHierarchicalSubdivisionMesh(RtToken scheme, RtInt nfaces, RtInt nverts[], RtInt verts[], RtInt ntags, const RtToken tags[], RtInt nargs[], RtInt intargs[], RtFloat floatargs[], const RtToken stringargs[], ...);
KANUKA_RI RtVoid RiHierarchicalSubdivisionMeshV(RtToken scheme, RtInt nfaces, RtInt nverts[], RtInt verts[], RtInt ntags, const RtToken tags[], RtInt nargs[], RtInt intargs[], RtFloat floatargs[], const RtToken stringargs[], RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiSphere(RtFloat radius, RtFloat zmin, RtFloat zmax, RtFloat thetamax, ...);
KANUKA_RI RtVoid RiSphereV(RtFloat radius, RtFloat zmin, RtFloat zmax, RtFloat thetamax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiCone(RtFloat height, RtFloat radius, RtFloat thetamax, ...);
KANUKA_RI RtVoid RiConeV(RtFloat height, RtFloat radius, RtFloat thetamax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiCylinder(RtFloat radius, RtFloat zmin, RtFloat zmax, RtFloat thetamax, ...);
KANUKA_RI RtVoid RiCylinderV(RtFloat radius, RtFloat zmin, RtFloat zmax, RtFloat thetamax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiHyperboloid(RtPoint point1, RtPoint point2, RtFloat thetamax, ...);
KANUKA_RI RtVoid RiHyperboloidV(RtPoint point1, RtPoint point2, RtFloat thetamax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiParaboloid(RtFloat rmax, RtFloat zmin, RtFloat zmax, RtFloat thetamax, ...);
KANUKA_RI RtVoid RiParaboloidV(RtFloat rmax, RtFloat zmin, RtFloat zmax, RtFloat thetamax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiDisk(RtFloat height, RtFloat radius, RtFloat thetamax, ...);
KANUKA_RI RtVoid RiDiskV(RtFloat height, RtFloat radius, RtFloat thetamax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiTorus(RtFloat majorradius, RtFloat minorradius, RtFloat phimin, RtFloat phimax, RtFloat thetamax, ...);
KANUKA_RI RtVoid RiTorusV(RtFloat majorradius, RtFloat minorradius, RtFloat phimin, RtFloat phimax, RtFloat thetamax, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiCurves(RtToken type, RtInt ncurves, RtInt nvertices[], RtToken wrap, ...);
KANUKA_RI RtVoid RiCurvesV(RtToken type, RtInt ncurves, RtInt nvertices[], RtToken wrap, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiPoints(RtInt npoints, ...);
KANUKA_RI RtVoid RiPointsV(RtInt npoints, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiBlobby(RtInt nleaf, RtInt ncode, RtInt code[], RtInt nfloats, RtFloat floats[], RtInt nstrings, const RtString strings[], ...);
KANUKA_RI RtVoid RiBlobbyV(RtInt nleaf, RtInt ncode, RtInt code[], RtInt nfloats, RtFloat floats[], RtInt nstrings, const RtString strings[], RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiGeometry(RtToken type, ...);
KANUKA_RI RtVoid RiGeometryV(RtToken type, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiMakeTexture(RtString picture, RtString texture, RtToken swrap, RtToken twrap, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, ...);
KANUKA_RI RtVoid RiMakeTextureV(RtString picture, RtString texture, RtToken swrap, RtToken twrap, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiMakeBump(RtString picture, RtString texture, RtToken swrap, RtToken twrap, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, ...);
KANUKA_RI RtVoid RiMakeBumpV(RtString picture, RtString texture, RtToken swrap, RtToken twrap, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiMakeLatLongEnvironment(RtString picture, RtString texture, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, ...);
KANUKA_RI RtVoid RiMakeLatLongEnvironmentV(RtString picture, RtString texture, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiMakeCubeFaceEnvironment(RtString px, RtString nx, RtString py, RtString ny, RtString pz, RtString nz, RtString texture, RtFloat fov, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, ...);
KANUKA_RI RtVoid RiMakeCubeFaceEnvironmentV(RtString px, RtString nx, RtString py, RtString ny, RtString pz, RtString nz, RtString texture, RtFloat fov, RtFilterFunc filter, RtFloat swidth, RtFloat twidth, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiMakeShadow(RtToken picture, RtToken texture, ...);
KANUKA_RI RtVoid RiMakeShadowV(RtToken picture, RtToken texture, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiMakeOcclusion(RtInt npictures, const RtString pictures[], RtString texture, ...);
KANUKA_RI RtVoid RiMakeOcclusionV(RtInt npictures, const RtString pictures[], RtString texture, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiMakeBrickMap(RtInt nclouds, const RtString pointclouds[], RtString brickmap, ...);
KANUKA_RI RtVoid RiMakeBrickMapV(RtInt nclouds, const RtString pointclouds[], RtString brickmap, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiShaderLayer(RtToken type, RtToken name, RtToken layer, ...);
KANUKA_RI RtVoid RiShaderLayerV(RtToken type, RtToken name, RtToken layer, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiConnectShaderLayers(RtToken type, RtToken layer1, RtToken variable1, RtToken layer2, RtToken variable2);
KANUKA_RI RtVoid RiShader(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiShaderV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiSystem(RtToken command);
KANUKA_RI RtVoid RiResourceBegin(void);
KANUKA_RI RtVoid RiResourceEnd(void);
KANUKA_RI RtVoid RiResource(RtToken handle, RtToken type, ...);
KANUKA_RI RtVoid RiResourceV(RtToken handle, RtToken type, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiEditBegin(RtToken name, ...);
KANUKA_RI RtVoid RiEditBeginV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiEditEnd(void);
KANUKA_RI RtVoid RiPixelSampleImager(RtToken name, ...);
KANUKA_RI RtVoid RiPixelSampleImagerV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiVPAtmosphere(RtToken name, ...);
KANUKA_RI RtVoid RiVPAtmosphereV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiVPInterior(RtToken name, ...);
KANUKA_RI RtVoid RiVPInteriorV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiVPSurface(RtToken name, ...);
KANUKA_RI RtVoid RiVPSurfaceV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiCamera(RtToken name, ...);
KANUKA_RI RtVoid RiCameraV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiIntegrator(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiIntegratorV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiBxdf(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiBxdfV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiDisplace(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiDisplaceV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiPattern(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiPatternV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiLight(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiLightV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiLightFilter(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiLightFilterV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiEnableLightFilter(RtLightHandle light, RtLightHandle filter, RtBoolean on);
KANUKA_RI RtVoid RiDisplayFilter(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiDisplayFilterV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiSampleFilter(RtToken name, RtToken handle, ...);
KANUKA_RI RtVoid RiSampleFilterV(RtToken name, RtToken handle, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiDisplayChannel(RtToken channel, ...);
KANUKA_RI RtVoid RiDisplayChannelV(RtToken channel, RtInt n, const RtToken tokens[], RtPointer parms[]);
KANUKA_RI RtVoid RiVolume(RtToken type, RtBound bound, RtInt nvertices[], ...);
KANUKA_RI RtVoid RiVolumeV(RtToken type, RtBound bound, RtInt nvertices[], RtInt n, const RtToken tokens[], RtPointer parms[]);
#ifdef __cplusplus
}

#if __cplusplus >= 201103L
extern "C++" { /* where a program includes this within extern "C" */
/* Handlers and callbacks that promise to leave their text alone. */
template <class Char>
inline RtVoid RiErrorHandler(RtVoid (*handler)(RtInt, RtInt, const Char*)) {
    RiErrorHandler(reinterpret_cast<RtErrorFunc>(handler));
}
template <class Char, class... More>
inline RtVoid RiReadArchive(RtToken name, RtVoid (*callback)(RtToken, const Char*, ...), More... more) {
    RiReadArchive(name, reinterpret_cast<RtArchiveCallback>(callback), more...);
}
template <class... More>
inline RtVoid RiReadArchive(RtToken name, char*, More... more) { /* RI_NULL */
    RiReadArchive(name, static_cast<RtArchiveCallback>(0), more...);
}
}
#endif
#endif
#endif
