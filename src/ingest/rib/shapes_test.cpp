// Trim curves, blobbies, the teapot, solids, clipping planes.

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

using namespace scene;

static const std::string Nurbs =
    "NuPatch 2 2 [0 0 1 1] 0 1 2 2 [0 0 1 1] 0 1 \"P\" [0 0 0 1 0 0 0 1 0 1 1 0]\n";
static const std::string Loop =
    "TrimCurve [1] [2] [0 0 1 2 3 4 4] [0] [4] [5] [0.2 0.8 0.8 0.2 0.2] [0.2 0.2 0.8 0.8 0.2] [1 1 1 1 1]\n";

TEST(RibShapes, TrimCurvesHoldForTheirBlock) {
    const Parsed r(world("AttributeBegin\n" + Loop + Nurbs +
                         "Attribute \"trimcurve\" \"string sense\" \"outside\"\n" + Nurbs +
                         "TrimCurve [] [] [] [] [] [] [] [] []\n" + Nurbs + "AttributeEnd\n" + Nurbs));
    EXPECT_SILENT(r);
    const auto trim = [&](size_t i) { return std::get<NuPatch>(r.primitive(i).geometry).trim; };
    ASSERT_TRUE(trim(0));
    EXPECT_EQ(trim(0)->u.size(), 5u);
    EXPECT_FALSE(trim(0)->outside);
    ASSERT_TRUE(trim(1));
    EXPECT_TRUE(trim(1)->outside);
    EXPECT_FALSE(trim(2));
    EXPECT_FALSE(trim(3));
}

TEST(RibShapes, TrimCurvesOfWrongLengthsAreLeftOut) {
    const Parsed r(world("TrimCurve [1] [2] [0 0 1 1] [0] [4] [5] [0.2 0.8] [0.2] [1]\n" + Nurbs));
    EXPECT_TRUE(r.says("TrimCurve was left out: knot: expected 7 values, found 4")) << r.all_messages();
    EXPECT_FALSE(std::get<NuPatch>(r.primitive(0).geometry).trim);
}

TEST(RibShapes, Blobby) {
    const Parsed r(world("Blobby 2 [1001 0 1001 16 0 2 0 1] [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1  1 0 0 0 0 1 0 "
                         "0 0 0 1 0 1 0 0 1] "
                         "[\"\"] \"vertex color Cs\" [1 0 0 0 1 0]\nBlobby 0 [] [] []"));
    ASSERT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_EQ(std::get<Blobby>(r.primitive(0).geometry).code.size(), 8u);
    EXPECT_EQ(r.primitive(0).primvars.find("Cs")->items(), 2u);
    EXPECT_TRUE(r.says("Blobby was left out")) << r.all_messages();
}

TEST(RibShapes, TheTeapotHas32Patches) {
    const Parsed r(world("Geometry \"teapot\" \"constant color Cs\" [1 0 0]\nGeometry \"kettle\""));
    ASSERT_EQ(r.scene.primitives.size(), 4u);
    int patches = 0;
    Bounds3f bounds;
    for (const Primitive& p : r.scene.primitives) {
        const auto& mesh = std::get<PatchMesh>(p.geometry);
        patches += (mesh.nu - 1) / 3 * ((mesh.nv - 1) / 3);
        EXPECT_TRUE(p.primvars.find("Cs"));
        const auto& P = p.primvars.find("P")->floats;
        for (size_t i = 0; i < P.size(); i += 3)
            bounds.extend({P[i], P[i + 1], P[i + 2]});
    }
    EXPECT_EQ(patches, 32);
    expect_point(bounds.lo, -3, -2, 0);
    expect_point(bounds.hi, 3.525f, 2, 3.15f);
    EXPECT_TRUE(r.says("there are \"teapot\" and \"cube\"")) << r.all_messages();
}

TEST(RibShapes, TheCubeLooksOutwards) {
    const Parsed r(world("Geometry \"cube\" \"constant color Cs\" [1 0 0]"));
    EXPECT_SILENT(r);
    const auto& mesh = std::get<PolygonMesh>(r.primitive(0).geometry);
    const auto& P = r.primitive(0).primvars.find("P")->floats;
    ASSERT_EQ(mesh.vertices.size(), 24u);
    const auto at = [&](size_t k) {
        const auto i = size_t(mesh.vertices[k]);
        return Vec3f(P[3 * i], P[3 * i + 1], P[3 * i + 2]);
    };
    for (size_t f = 0; f < 24; f += 4) {
        const Vec3f middle = (at(f) + at(f + 1) + at(f + 2) + at(f + 3)) * 0.25f;
        EXPECT_NEAR(length(middle), 0.5f, 1e-6f);
        EXPECT_NEAR(dot(cross(at(f + 1) - at(f), at(f + 2) - at(f + 1)), middle), 0.5f, 1e-6f);
    }
}

TEST(RibShapes, Volumes) {
    const Parsed r(world("Volume \"ellipsoid\" [-1 1 -2 2 0 3] [2 1 2] \"varying float density\" [1 2 3 4] "
                         "\"constant color tint\" [1 0 0]\n"
                         "Volume \"box\" [0 1 0 1 0 1] [0 0 0]\n"));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 2u);
    const auto& v = std::get<Volume>(r.primitive(0).geometry);
    EXPECT_EQ(v.shape, Volume::Shape::Ellipsoid);
    EXPECT_EQ(v.size, (std::array<int, 3>{2, 1, 2}));
    EXPECT_EQ(v.bound, (std::array<float, 6>{-1, 1, -2, 2, 0, 3}));
    EXPECT_EQ(r.primitive(0).primvars.find("density")->floats.size(), 4u);
    EXPECT_EQ(std::get<Volume>(r.primitive(1).geometry).size, (std::array<int, 3>{1, 1, 1}));
    const std::pair<const char*, const char*> bad[] = {
        {"Volume \"blob\" [0 1 0 1 0 1] [1 1 1]", "there are box, ellipsoid, cylinder and cone"},
        {"Volume \"blobbydso:x\" [0 1 0 1 0 1] [1 1 1]", "plug-ins of volumes are not supported"},
        {"Volume \"box\" [0 1 0 1 1 1] [1 1 1]", "each maximum above its minimum"},
        {"Volume \"box\" [0 1 0 1] [1 1 1]", "each maximum above its minimum"},
        {"Volume \"box\" [0 1 0 1 0 1] [1 1]", "nvertices must be three counts"},
        {"Volume \"box\" [0 1 0 1 0 1] [2147483647 2147483647 2147483647]", "nvertices must be three counts"},
        {"Volume \"box\" [0 1 0 1 0 1] [-1 1 1]", "nvertices must be three counts"},
    };
    for (const auto& [text, message] : bad) {
        const Parsed b(world(text));
        EXPECT_TRUE(b.scene.primitives.empty()) << text;
        EXPECT_TRUE(b.says(message)) << text << "\n" << b.all_messages();
    }
}

TEST(RibShapes, InstancesInSolidsBecomePartOfThem) {
    const std::string ball = "Sphere 1 -1 1 360\n";
    const Parsed r(world(
        "ObjectBegin \"lens\" SolidBegin \"intersection\" Translate 0.5 0 0 " + ball +
        "Color 0 1 0 Surface \"plastic\" Translate -1 0 0 " + ball + "SolidEnd ObjectEnd\n" +
        "ObjectBegin \"can\" Cylinder 1 -1 1 360 Disk 1 1 360 TransformBegin Translate 0 0 3 ObjectInstance "
        "\"lens\" TransformEnd ObjectEnd\n"
        "Color 1 0 0 Surface \"matte\" SolidBegin \"difference\" " +
        ball +
        "Translate 5 0 0 ObjectInstance \"can\" MotionBegin [0 1] Translate 0 0 0 Translate 0 1 0 MotionEnd "
        "ObjectInstance \"lens\" SolidEnd\n"
        "ObjectInstance \"lens\""));
    EXPECT_SILENT(r);
    using Kind = Solid::Kind;
    const std::pair<Kind, int> tree[] = {
        {Kind::Difference, -1},  {Kind::Primitive, 0}, {Kind::Primitive, 0},  // the ball; the can's surfaces
        {Kind::Intersection, 0}, {Kind::Primitive, 3}, {Kind::Primitive, 3},  // the lens in the can
        {Kind::Intersection, 0}, {Kind::Primitive, 6}, {Kind::Primitive, 6}}; // the moving one
    ASSERT_EQ(r.scene.solids.size(), std::size(tree));
    for (size_t i = 0; i < std::size(tree); i++) {
        EXPECT_EQ(r.scene.solids[i].kind, tree[i].first) << i;
        EXPECT_EQ(r.scene.solids[i].parent, tree[i].second) << i;
    }
    ASSERT_EQ(r.scene.primitives.size(), 7u);
    const int in[] = {1, 2, 2, 4, 5, 7, 8};
    for (size_t i = 0; i < 7; i++)
        EXPECT_EQ(r.primitive(i).solid, in[i]) << i;
    // Places and looks: what the object does not set comes from the instance, its shaders move along.
    expect_point(r.primitive(3).world_from_object->point({0, 0, 0}), 5.5f, 0, 3);
    EXPECT_EQ(r.primitive(3).attributes->color, Rgb(1, 0, 0));
    EXPECT_EQ(r.primitive(4).attributes->color, Rgb(0, 1, 0));
    EXPECT_EQ(r.primitive(4).attributes->surface->name, "plastic");
    expect_point(r.primitive(4).attributes->surface->world_from_shader.point({0, 0, 0}), 5.5f, 0, 3);
    EXPECT_EQ(r.primitive(3).attributes->surface->name, "matte");
    ASSERT_TRUE(r.primitive(5).motion);
    ASSERT_EQ(r.primitive(5).motion->places.size(), 2u);
    expect_point(r.primitive(5).motion->places[1].transform.point({0, 0, 0}), 5.5f, 1, 0);
    // Outside of a solid an instance is one as ever.
    EXPECT_EQ(r.scene.groups.size(), 1u);
    EXPECT_EQ(r.scene.instances.size(), 1u);
    // Doubling objects stay bounded.
    std::string deep = "ObjectBegin 0 " + ball + "ObjectEnd\n";
    for (int i = 1; i < 40; i++)
        deep += "ObjectBegin " + std::to_string(i) + " ObjectInstance " + std::to_string(i - 1) +
                " ObjectInstance " + std::to_string(i - 1) + " ObjectEnd\n";
    EXPECT_TRUE(
        Parsed(world(deep + "SolidBegin \"union\" ObjectInstance 39 SolidEnd")).says("more than 1000000"));
}

TEST(RibShapes, SolidsMakeATree) {
    const std::string ball = "Sphere 1 -1 1 360\n";
    const Parsed r(world("SolidBegin \"difference\"\nSolidBegin \"primitive\"\n" + ball + ball +
                         "SolidEnd\n" + ball + "SolidEnd\n" + ball + "ObjectBegin 1\nSolidBegin \"union\"\n" +
                         ball +
                         "SolidEnd\nObjectEnd\n"
                         "ObjectInstance 1"));
    ASSERT_EQ(r.scene.primitives.size(), 4u);
    EXPECT_EQ(r.primitive(0).solid, 1);
    EXPECT_EQ(r.primitive(1).solid, 1);
    EXPECT_EQ(r.primitive(2).solid, 2);
    EXPECT_EQ(r.primitive(3).solid, -1);
    ASSERT_EQ(r.scene.solids.size(), 3u);
    EXPECT_EQ(r.scene.solids[0].kind, Solid::Kind::Difference);
    EXPECT_EQ(r.scene.solids[1].parent, 0);
    EXPECT_EQ(r.scene.solids[2].parent, 0);
    ASSERT_EQ(r.scene.groups.size(), 1u);
    EXPECT_EQ(r.scene.groups[0].solids.size(), 2u);
    EXPECT_EQ(r.scene.groups[0].primitives[0].solid, 1);
}

TEST(RibShapes, ClippingPlanesAreKeptInCameraSpace) {
    const Parsed r("Translate 0 0 5\nRotate 180 0 1 0\nClippingPlane 0 0 1 0 0 2\n" +
                   world("Sphere 1 -1 1 360"));
    ASSERT_EQ(r.scene.camera.clipping_planes.size(), 1u);
    const auto& p = r.scene.camera.clipping_planes[0];
    expect_point({p[0], p[1], p[2]}, 0, 0, 4);
    expect_point(normalize(Vec3f(p[3], p[4], p[5])), 0, 0, -1);
}

} // namespace kanuka::ingest::test
