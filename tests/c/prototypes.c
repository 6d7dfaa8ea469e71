/* The calls of RISpec 3.2 by the types that its chapters give them, held against ri.h: the table of requests
   that ri.h is made from does not know how C groups numbers. Compiling is the test. */
#include <ri.h>

#define CALL(name, ...) static RtVoid (*const plain_##name)(__VA_ARGS__) = Ri##name;
#define LISTED(name, ...)                                                                                    \
    static RtVoid (*const listed_##name)(__VA_ARGS__, ...) = Ri##name;                                       \
    static RtVoid (*const arrays_##name)(__VA_ARGS__, RtInt, const RtToken[], RtPointer[]) = Ri##name##V;

CALL(FrameBegin, RtInt)
CALL(WorldBegin, void)
CALL(Format, RtInt, RtInt, RtFloat)
CALL(FrameAspectRatio, RtFloat)
CALL(ScreenWindow, RtFloat, RtFloat, RtFloat, RtFloat)
CALL(CropWindow, RtFloat, RtFloat, RtFloat, RtFloat)
LISTED(Projection, RtToken)
CALL(Clipping, RtFloat, RtFloat)
CALL(ClippingPlane, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat)
CALL(DepthOfField, RtFloat, RtFloat, RtFloat)
CALL(Shutter, RtFloat, RtFloat)
CALL(PixelVariance, RtFloat)
CALL(PixelSamples, RtFloat, RtFloat)
CALL(PixelFilter, RtFilterFunc, RtFloat, RtFloat)
CALL(Exposure, RtFloat, RtFloat)
LISTED(Imager, RtToken)
CALL(Quantize, RtToken, RtInt, RtInt, RtInt, RtFloat)
LISTED(Display, RtToken, RtToken, RtToken)
LISTED(Hider, RtToken)
CALL(ColorSamples, RtInt, RtFloat[], RtFloat[])
CALL(RelativeDetail, RtFloat)
LISTED(Option, RtToken)
CALL(Color, RtColor)
CALL(Opacity, RtColor)
CALL(TextureCoordinates, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat)
CALL(Illuminate, RtLightHandle, RtBoolean)
LISTED(Surface, RtToken)
LISTED(Displacement, RtToken)
LISTED(Atmosphere, RtToken)
LISTED(Interior, RtToken)
LISTED(Exterior, RtToken)
CALL(ShadingRate, RtFloat)
CALL(ShadingInterpolation, RtToken)
CALL(Matte, RtBoolean)
CALL(Bound, RtBound)
CALL(Detail, RtBound)
CALL(DetailRange, RtFloat, RtFloat, RtFloat, RtFloat)
CALL(GeometricApproximation, RtToken, RtFloat)
CALL(Orientation, RtToken)
CALL(Sides, RtInt)
CALL(Identity, void)
CALL(Transform, RtMatrix)
CALL(ConcatTransform, RtMatrix)
CALL(Perspective, RtFloat)
CALL(Translate, RtFloat, RtFloat, RtFloat)
CALL(Rotate, RtFloat, RtFloat, RtFloat, RtFloat)
CALL(Scale, RtFloat, RtFloat, RtFloat)
CALL(Skew, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat)
CALL(CoordinateSystem, RtToken)
CALL(CoordSysTransform, RtToken)
LISTED(Attribute, RtToken)
LISTED(Polygon, RtInt)
LISTED(GeneralPolygon, RtInt, RtInt[])
LISTED(PointsPolygons, RtInt, RtInt[], RtInt[])
LISTED(PointsGeneralPolygons, RtInt, RtInt[], RtInt[], RtInt[])
CALL(Basis, RtBasis, RtInt, RtBasis, RtInt)
LISTED(Patch, RtToken)
LISTED(PatchMesh, RtToken, RtInt, RtToken, RtInt, RtToken)
LISTED(NuPatch, RtInt, RtInt, RtFloat[], RtFloat, RtFloat, RtInt, RtInt, RtFloat[], RtFloat, RtFloat)
CALL(TrimCurve, RtInt, RtInt[], RtInt[], RtFloat[], RtFloat[], RtFloat[], RtInt[], RtFloat[], RtFloat[],
     RtFloat[])
LISTED(SubdivisionMesh, RtToken, RtInt, RtInt[], RtInt[], RtInt, const RtToken[], RtInt[], RtInt[], RtFloat[])
LISTED(Sphere, RtFloat, RtFloat, RtFloat, RtFloat)
LISTED(Cone, RtFloat, RtFloat, RtFloat)
LISTED(Cylinder, RtFloat, RtFloat, RtFloat, RtFloat)
LISTED(Hyperboloid, RtPoint, RtPoint, RtFloat)
LISTED(Paraboloid, RtFloat, RtFloat, RtFloat, RtFloat)
LISTED(Disk, RtFloat, RtFloat, RtFloat)
LISTED(Torus, RtFloat, RtFloat, RtFloat, RtFloat, RtFloat)
LISTED(Points, RtInt)
LISTED(Curves, RtToken, RtInt, RtInt[], RtToken)
LISTED(Blobby, RtInt, RtInt, RtInt[], RtInt, RtFloat[], RtInt, const RtString[])
LISTED(Geometry, RtToken)
CALL(SolidBegin, RtToken)
CALL(ObjectInstance, RtObjectHandle)
LISTED(MakeTexture, RtString, RtString, RtToken, RtToken, RtFilterFunc, RtFloat, RtFloat)
LISTED(MakeLatLongEnvironment, RtString, RtString, RtFilterFunc, RtFloat, RtFloat)
LISTED(MakeCubeFaceEnvironment, RtString, RtString, RtString, RtString, RtString, RtString, RtString, RtFloat,
       RtFilterFunc, RtFloat, RtFloat)
LISTED(MakeShadow, RtString, RtString)
LISTED(ReadArchive, RtToken, RtArchiveCallback)

static RtLightHandle (*const light)(RtToken, ...) = RiLightSource;
static RtLightHandle (*const area_light)(RtToken, ...) = RiAreaLightSource;
static RtObjectHandle (*const object)(void) = RiObjectBegin;
static RtToken (*const declare)(RtString, RtString) = RiDeclare;
static RtPoint* (*const points)(RtToken, RtToken, RtInt, RtPoint[]) = RiTransformPoints;

int main(void) {
    return !(
        plain_FrameBegin && plain_WorldBegin && plain_Format && plain_FrameAspectRatio &&
        plain_ScreenWindow && plain_CropWindow && listed_Projection && arrays_Projection && plain_Clipping &&
        plain_ClippingPlane && plain_DepthOfField && plain_Shutter && plain_PixelVariance &&
        plain_PixelSamples && plain_PixelFilter && plain_Exposure && listed_Imager && arrays_Imager &&
        plain_Quantize && listed_Display && arrays_Display && listed_Hider && arrays_Hider &&
        plain_ColorSamples && plain_RelativeDetail && listed_Option && arrays_Option && plain_Color &&
        plain_Opacity && plain_TextureCoordinates && plain_Illuminate && listed_Surface && arrays_Surface &&
        listed_Displacement && arrays_Displacement && listed_Atmosphere && arrays_Atmosphere &&
        listed_Interior && arrays_Interior && listed_Exterior && arrays_Exterior && plain_ShadingRate &&
        plain_ShadingInterpolation && plain_Matte && plain_Bound && plain_Detail && plain_DetailRange &&
        plain_GeometricApproximation && plain_Orientation && plain_Sides && plain_Identity &&
        plain_Transform && plain_ConcatTransform && plain_Perspective && plain_Translate && plain_Rotate &&
        plain_Scale && plain_Skew && plain_CoordinateSystem && plain_CoordSysTransform && listed_Attribute &&
        arrays_Attribute && listed_Polygon && arrays_Polygon && listed_GeneralPolygon &&
        arrays_GeneralPolygon && listed_PointsPolygons && arrays_PointsPolygons &&
        listed_PointsGeneralPolygons && arrays_PointsGeneralPolygons && plain_Basis && listed_Patch &&
        arrays_Patch && listed_PatchMesh && arrays_PatchMesh && listed_NuPatch && arrays_NuPatch &&
        plain_TrimCurve && listed_SubdivisionMesh && arrays_SubdivisionMesh && listed_Sphere &&
        arrays_Sphere && listed_Cone && arrays_Cone && listed_Cylinder && arrays_Cylinder &&
        listed_Hyperboloid && arrays_Hyperboloid && listed_Paraboloid && arrays_Paraboloid && listed_Disk &&
        arrays_Disk && listed_Torus && arrays_Torus && listed_Points && arrays_Points && listed_Curves &&
        arrays_Curves && listed_Blobby && arrays_Blobby && listed_Geometry && arrays_Geometry &&
        plain_SolidBegin && plain_ObjectInstance && listed_MakeTexture && arrays_MakeTexture &&
        listed_MakeLatLongEnvironment && arrays_MakeLatLongEnvironment && listed_MakeCubeFaceEnvironment &&
        arrays_MakeCubeFaceEnvironment && listed_MakeShadow && arrays_MakeShadow && listed_ReadArchive &&
        arrays_ReadArchive && light && area_light && object && declare && points);
}
