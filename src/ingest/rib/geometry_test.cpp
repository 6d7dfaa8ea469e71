// Geometry requests and their primvars.

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

using namespace scene;

template <class T>
static std::vector<T> list(const Buffer<T>& b) {
    return {b.begin(), b.end()};
}

static const std::string Square = "\"P\" [0 0 0 1 0 0 1 1 0 0 1 0]";

TEST(RibGeometry, Polygons) {
    const Parsed r(world("Polygon " + Square +
                         " \"Cs\" [1 0 0 0 1 0 0 0 1 1 1 1]\n"
                         "GeneralPolygon [4 3] \"P\" [0 0 0 4 0 0 4 4 0 0 4 0  1 1 0 2 1 0 1 2 0]\n"
                         "PointsPolygons [3 3.0] [0 1 2 0 2 3] " +
                         Square +
                         " \"uniform float k\" [1 2] \"facevarying float[2] st\" "
                         "[0 0 1 0 1 1 0 0 1 1 0 1]\nPointsGeneralPolygons [1 1] [3 3] [0 1 2 0 2 3] " +
                         Square));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 4u);
    const auto& polygon = std::get<PolygonMesh>(r.primitive(0).geometry);
    EXPECT_EQ(list(polygon.vertices_per_loop), (std::vector<int32_t>{4}));
    EXPECT_TRUE(polygon.vertices.empty());
    EXPECT_EQ(r.primitive(0).primvars.find("Cs")->items(), 4u);
    EXPECT_EQ(r.primitive(0).primvars.find("P")->detail, Detail::Vertex);
    const auto& general = std::get<PolygonMesh>(r.primitive(1).geometry);
    EXPECT_EQ(list(general.loops_per_face), (std::vector<int32_t>{2}));
    EXPECT_EQ(list(general.vertices_per_loop), (std::vector<int32_t>{4, 3}));
    const auto& mesh = std::get<PolygonMesh>(r.primitive(2).geometry);
    EXPECT_EQ(list(mesh.vertices), (std::vector<int32_t>{0, 1, 2, 0, 2, 3}));
    EXPECT_EQ(r.primitive(2).primvars.find("st")->array_size, 2);
    EXPECT_EQ(r.primitive(2).primvars.find("st")->items(), 6u);
    EXPECT_EQ(r.primitive(2).where.str(), "test.rib:5:1");
    EXPECT_EQ(std::get<PolygonMesh>(r.primitive(3).geometry).loops_per_face.size(), 2u);
}

TEST(RibGeometry, Quadrics) {
    const Parsed r(
        world("Sphere 1 -0.5 0.5 180\nSphere [1 -1 1 360]\nCone 2 1 360\nCylinder 1 0 2 90\n"
              "Hyperboloid 0 0.3 0 0.5 0 0 360\nParaboloid 1 0 2 360\nDisk 0 1 360\nTorus 2 1 0 360 360"));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 8u);
    EXPECT_EQ(std::get<Quadric>(r.primitive(0).geometry).arguments,
              (std::vector<float>{1, -0.5f, 0.5f, 180}));
    EXPECT_EQ(std::get<Quadric>(r.primitive(1).geometry).arguments[3], 360);
    EXPECT_EQ(std::get<Quadric>(r.primitive(4).geometry).kind, Quadric::Kind::Hyperboloid);
    EXPECT_EQ(std::get<Quadric>(r.primitive(4).geometry).arguments.size(), 7u);
    EXPECT_EQ(std::get<Quadric>(r.primitive(7).geometry).kind, Quadric::Kind::Torus);
}

static std::string lattice(int nu, int nv) {
    std::string s;
    for (int j = 0; j < nv; j++)
        for (int i = 0; i < nu; i++)
            s += std::to_string(i) + " " + std::to_string(j) + " 0 ";
    return s;
}

TEST(RibGeometry, NowrapIsNonperiodic) {
    const Parsed r(world("PatchMesh \"bilinear\" 3 \"nowrap\" 2 \"periodic\" \"P\" [" + lattice(3, 2) +
                         "]\nCurves \"linear\" [3] \"nowrap\" \"P\" [" + lattice(3, 1) + "]"));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 2u);
    const auto& mesh = std::get<PatchMesh>(r.primitive(0).geometry);
    EXPECT_FALSE(mesh.u_periodic);
    EXPECT_TRUE(mesh.v_periodic);
    EXPECT_FALSE(std::get<Curves>(r.primitive(1).geometry).periodic);
}

TEST(RibGeometry, PatchesAndBases) {
    const Parsed r(world("Patch \"bilinear\" \"P\" [" + lattice(2, 2) +
                         "]\nBasis \"b-spline\" 1 \"catmull-rom\" 1\n"
                         "Patch \"bicubic\" \"P\" [" +
                         lattice(4, 4) +
                         "]\nPatchMesh \"bicubic\" 5 \"nonperiodic\" 6 \"periodic\" "
                         "\"P\" [" +
                         lattice(5, 6) + "] \"uniform float id\" [1 2 3 4 5 6 7 8 9 10 11 12] \"s\" [" +
                         lattice(6, 1) +
                         "]\nBasis [1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16] 2 \"power\" 4\n"
                         "PatchMesh \"bilinear\" 3 \"nonperiodic\" 2 \"nonperiodic\" \"Pz\" [0 0 0 1 2 3]"));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 4u);
    EXPECT_FALSE(std::get<PatchMesh>(r.primitive(0).geometry).cubic);
    EXPECT_EQ(std::get<PatchMesh>(r.primitive(1).geometry).u_basis, basis_by_name("b-spline"));
    const auto& mesh = std::get<PatchMesh>(r.primitive(2).geometry);
    EXPECT_TRUE(mesh.v_periodic);
    EXPECT_EQ(mesh.v_basis->step, 1);
    EXPECT_EQ(r.primitive(2).primvars.find("s")->items(), 18u); // 3 by 6 corners
    const Value* p = r.primitive(3).primvars.find("P");
    ASSERT_TRUE(p);
    EXPECT_EQ(list(p->floats),
              (std::vector<float>{0, 0, 0, 0.5f, 0, 0, 1, 0, 0, 0, 1, 1, 0.5f, 1, 2, 1, 1, 3}));
    EXPECT_FALSE(r.primitive(3).primvars.find("Pz"));
    EXPECT_EQ(std::get<PatchMesh>(r.primitive(3).geometry).u_basis->m[1][0], 5);
    EXPECT_EQ(std::get<PatchMesh>(r.primitive(3).geometry).u_basis->step, 2);
}

TEST(RibGeometry, NuPatch) {
    const Parsed r(world("NuPatch 3 3 [0 0 0 1 1 1] 0 1 2 2 [0 0 1 1] 0 1 \"Pw\" [0 0 0 1 1 0 0 1 2 0 0 1 0 "
                         "1 0 1 1 1 0 1 2 1 0 1]"));
    EXPECT_SILENT(r);
    const auto& n = std::get<NuPatch>(r.primitive(0).geometry);
    EXPECT_EQ(n.nu, 3);
    EXPECT_EQ(n.u_order, 3);
    EXPECT_EQ(n.v_knots.size(), 4u);
    EXPECT_EQ(n.u_max, 1);
    EXPECT_EQ(r.primitive(0).primvars.find("Pw")->type, Type::HPoint);
    EXPECT_TRUE(Parsed(world("NuPatch 3 3 [0 0 1 1 1] 0 1 2 2 [0 0 1 1] 0 1 \"P\" [" + lattice(3, 2) + "]"))
                    .says("uknot: expected 6"));
    EXPECT_TRUE(Parsed(world("NuPatch 3 3 [0 0 2 1 1 1] 0 1 2 2 [0 0 1 1] 0 1 \"P\" [" + lattice(3, 2) + "]"))
                    .says("knots must rise"));
    EXPECT_TRUE(
        Parsed(world("NuPatch 2000000 2 [0 0 1 1] 0 1 2 2 [0 0 1 1] 0 1 \"P\" [" + lattice(2, 2) + "]"))
            .says("uknot: expected"));
}

TEST(RibGeometry, SubdivisionTags) {
    const Parsed r(
        world("SubdivisionMesh \"catmull-clark\" [4] [0 1 2 3] [\"crease\" \"corner\" \"hole\" "
              "\"interpolateboundary\" "
              "\"facevaryinginterpolateboundary\"] [3 1 2 2 1 0 0 0 1 0] [0 1 2 1 3 0 2] [2.5 1 4] " +
              Square +
              "\n"
              "SubdivisionMesh \"loop\" [3] [0 1 2] \"P\" [0 0 0 1 0 0 0 1 0]\n"
              "HierarchicalSubdivisionMesh \"catmull-clark\" [4] [0 1 2 3] [\"crease\" \"note\"] [2 1 0 0 0 "
              "1] [0 1] [9] "
              "[\"text\"] " +
              Square));
    EXPECT_SILENT(r);
    const auto& mesh = std::get<SubdivisionMesh>(r.primitive(0).geometry);
    ASSERT_EQ(mesh.tags.size(), 5u);
    EXPECT_EQ(mesh.tags[0].ints, (std::vector<int32_t>{0, 1, 2}));
    EXPECT_EQ(mesh.tags[0].floats, (std::vector<float>{2.5f}));
    EXPECT_EQ(mesh.tags[1].ints, (std::vector<int32_t>{1, 3}));
    EXPECT_EQ(mesh.tags[1].floats, (std::vector<float>{1, 4}));
    EXPECT_EQ(mesh.tags[2].ints, (std::vector<int32_t>{0}));
    EXPECT_TRUE(mesh.tags[3].ints.empty());
    EXPECT_EQ(mesh.tags[4].ints, (std::vector<int32_t>{2}));
    EXPECT_EQ(std::get<SubdivisionMesh>(r.primitive(1).geometry).scheme, "loop");
    const auto& long_form = std::get<SubdivisionMesh>(r.primitive(2).geometry);
    ASSERT_EQ(long_form.tags.size(), 2u);
    EXPECT_EQ(long_form.tags[1].strings, (std::vector<std::string>{"text"}));
}

TEST(RibGeometry, HierarchicalEditsFollowTheirFaces) {
    // The first face has two vertices and goes: paths to the others move up.
    const Parsed r(
        world("HierarchicalSubdivisionMesh \"catmull-clark\" [2 3 3] [0 1  0 1 2  0 2 3] [\"faceedit\" "
              "\"vertexedit\"] [4 0 1  8 6 3] [1 2 1 0  3 1 0 2  3 0 0 1] [0 0 1 0 0 2] [\"hole\" \"add\" "
              "\"P\" \"value\"] " +
              Square));
    const auto& mesh = std::get<SubdivisionMesh>(r.primitive(0).geometry);
    ASSERT_EQ(mesh.tags.size(), 2u);
    EXPECT_EQ(mesh.tags[0].ints, (std::vector<int32_t>{1, 1, 1, -1}));
    EXPECT_EQ(mesh.tags[1].ints, (std::vector<int32_t>{3, 0, 0, 2, 3, -1, 0, 1}));
    EXPECT_EQ(mesh.tags[1].strings, (std::vector<std::string>{"add", "P", "value"}));
    EXPECT_EQ(mesh.tags[1].floats.size(), 6u);
}

TEST(RibGeometry, SubdivisionMistakes) {
    const auto with_tags = [](const std::string& tags) {
        return Parsed(world("SubdivisionMesh \"catmull-clark\" [4] [0 1 2 3] " + tags + " " + Square));
    };
    const Parsed range = with_tags("[\"crease\" \"corner\"] [2 1 1 1] [0 9 1] [1 1]");
    EXPECT_TRUE(range.says("vertex 9 is out of range"));
    EXPECT_EQ(std::get<SubdivisionMesh>(range.primitive(0).geometry).tags.size(), 1u);
    EXPECT_TRUE(with_tags("[\"crease\"] [2 1 0 0] [0 1] [1]").says("nargs: expected 2"));
    EXPECT_TRUE(with_tags("[\"crease\"] [7 1] [0 1] [1]").says("takes 7 of intargs, of which 2 are left"));
    EXPECT_TRUE(with_tags("[\"crease\"] [-1 1] [0 1] [1]").says("takes -1 of intargs"));
    EXPECT_TRUE(Parsed(world("SubdivisionMesh \"butterfly\" [4] [0 1 2 3] " + Square))
                    .says("there is no scheme \"butterfly\""));
    EXPECT_TRUE(
        Parsed(world("SubdivisionMesh \"loop\" [4] [0 1 2 3] " + Square)).says("takes triangles alone"));
}

TEST(RibGeometry, CurvesAndPoints) {
    const Parsed r(world(
        "Basis \"bezier\" 3 \"b-spline\" 1\nCurves \"cubic\" [4 5] \"nonperiodic\" \"P\" [" + lattice(9, 1) +
        "] \"varying float width\" [1 2 3 4 5]\nCurves \"linear\" [2 3] \"periodic\" \"P\" [" +
        lattice(5, 1) + "] \"constantwidth\" 0.5\nPoints \"P\" [" + lattice(3, 1) +
        "] \"width\" [1 2 3] \"constant string label\" \"dust\""));
    EXPECT_SILENT(r);
    const auto& c = std::get<Curves>(r.primitive(0).geometry);
    EXPECT_EQ(c.basis, basis_by_name("b-spline"));
    EXPECT_EQ(list(c.vertices_per_curve), (std::vector<int32_t>{4, 5}));
    EXPECT_TRUE(std::get<Curves>(r.primitive(1).geometry).periodic);
    EXPECT_EQ(r.primitive(1).primvars.get_float("constantwidth", 0), 0.5f);
    EXPECT_TRUE(std::holds_alternative<Points>(r.primitive(2).geometry));
    EXPECT_EQ(r.primitive(2).primvars.get_string("label", ""), "dust");
    EXPECT_TRUE(Parsed(world("Curves \"wavy\" [4] \"nonperiodic\" \"P\" [" + lattice(4, 1) + "]"))
                    .says("linear or cubic"));
}

// ---- what does not fit ------------------------------------------------------------------------------

TEST(RibPrimvars, TooFewAndTooMany) {
    const Parsed r(world("PointsPolygons [3 3] [0 1 2 0 2 3] " + Square +
                         "\n\"Cs\" [1 0 0]\n\"uniform float k\" [1 2 3]\n\"uniform float f\" [1 2 3 4]"));
    ASSERT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_TRUE(r.says(
        "error 4:1 PointsPolygons: \"Cs\": expected 12 numbers (4 varying values), found 3; 1 would fit "
        "\"constant\". The variable was left out"));
    EXPECT_TRUE(r.says("warning 5:1 PointsPolygons: \"k\": expected 2 values, found 3"));
    EXPECT_TRUE(
        r.says("\"f\": expected 2 values, found 4; the last ones were not used; 4 would fit \"vertex\""));
    EXPECT_FALSE(r.primitive(0).primvars.find("Cs"));
    EXPECT_EQ(r.primitive(0).primvars.find("k")->items(), 2u);
}

TEST(RibPrimvars, UnusedVerticesAreCutInSilence) {
    const Parsed r(world("PointsPolygons [3] [0 1 2] " + Square + " \"Cs\" [1 1 1 2 2 2 3 3 3 4 4 4]"));
    EXPECT_SILENT(r);
    EXPECT_EQ(r.primitive(0).primvars.find("P")->items(), 3u);
    EXPECT_EQ(r.primitive(0).primvars.find("Cs")->items(), 3u);
}

TEST(RibPrimvars, BrokenShapesAreLeftOutAndTheRestGoesOn) {
    const Parsed r(world("PointsPolygons [3] [0 1 9] " + Square + "\nPointsPolygons [3] [0 1 -1] " + Square +
                         "\nPointsPolygons [3 3] [0 1 2] " + Square + "\nPointsPolygons [3 -3] [0 1 2] " +
                         Square +
                         "\nPolygon \"P\" [0 0 0 1 1 1]\nPolygon \"Cs\" [1 1 1]\nPatch \"bicubic\" " +
                         Square + "\nPatchMesh \"bicubic\" 5 \"nonperiodic\" 4 \"nonperiodic\" \"P\" [" +
                         lattice(5, 4) + "]\nCurves \"cubic\" [6] \"nonperiodic\" \"P\" [" + lattice(6, 1) +
                         "]\nPolygon \"float P\" [1 2 3]\nPointsGeneralPolygons [2] [3] [0 1 2] " + Square +
                         "\nSphere 1 -1 1 360"));
    EXPECT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_EQ(r.messages(Severity::Error).size(), 11u) << r.all_messages();
    EXPECT_TRUE(r.says(
        "error 3:1 PointsPolygons was left out: vertex index 9 (at [2]) is out of range: P has 4 values"));
    EXPECT_TRUE(r.says("verts: expected 6 values (the sum of nverts), found 3"));
    EXPECT_TRUE(r.says("nverts[1] is -3"));
    EXPECT_TRUE(r.says("Polygon has no positions"));
    EXPECT_TRUE(r.says("nu = 5 with a basis step of 3"));
}

TEST(RibPrimvars, SingleBadFacesAndCurvesGoAlone) {
    const Parsed r(
        world("PointsPolygons [3 2 3 3] [0 1 2  0 1  0 2 3  0 1 9] " + Square +
              " \"uniform float k\" [1 2 3 4] \"facevarying float c\" [1 2 3 4 5 6 7 8 9 10 11]\n"
              "SubdivisionMesh \"catmull-clark\" [2 3 3] [0 1  0 1 2  0 2 3] [\"hole\"] [2 0] [0 2] [] " +
              Square +
              "\n"
              "PointsGeneralPolygons [1 2 1] [3 3 3 3] [0 1 2 0 1 2 0 1 -5 1 2 3] " +
              Square +
              "\n"
              "Basis \"b-spline\" 1 \"b-spline\" 1 Curves \"cubic\" [4 3 5] \"nonperiodic\" \"P\" [" +
              lattice(12, 1) + "] \"width\" [1 2 3 4 5] \"uniform float id\" [7 8 9]"));
    ASSERT_EQ(r.scene.primitives.size(), 4u) << r.all_messages();
    EXPECT_EQ(r.messages().size(), 4u) << r.all_messages();
    EXPECT_TRUE(r.says("error 3:1 PointsPolygons: 2 of 4 faces were left out: face 1 has 2 vertices"));
    const auto& mesh = std::get<PolygonMesh>(r.primitive(0).geometry);
    EXPECT_EQ(list(mesh.vertices), (std::vector<int32_t>{0, 1, 2, 0, 2, 3}));
    EXPECT_EQ(list(r.primitive(0).primvars.find("k")->floats), (std::vector<float>{1, 3}));
    EXPECT_EQ(list(r.primitive(0).primvars.find("c")->floats), (std::vector<float>{1, 2, 3, 6, 7, 8}));
    const auto& subdivision = std::get<SubdivisionMesh>(r.primitive(1).geometry);
    EXPECT_EQ(subdivision.tags.at(0).ints, (std::vector<int32_t>{1}));
    const auto& general = std::get<PolygonMesh>(r.primitive(2).geometry);
    EXPECT_EQ(list(general.loops_per_face), (std::vector<int32_t>{1, 1}));
    EXPECT_EQ(list(general.vertices), (std::vector<int32_t>{0, 1, 2, 1, 2, 3}));
    const auto& curves = std::get<Curves>(r.primitive(3).geometry);
    EXPECT_EQ(list(curves.vertices_per_curve), (std::vector<int32_t>{4, 5}));
    EXPECT_EQ(r.primitive(3).primvars.find("P")->floats[12],
              7); // the fifth point is the second curve's eighth
    EXPECT_EQ(r.primitive(3).primvars.find("width")->items(), 5u);
    EXPECT_EQ(list(r.primitive(3).primvars.find("id")->floats), (std::vector<float>{7, 9}));
}

TEST(RibPrimvars, TypesAndDeclarations) {
    const Parsed r("Declare \"heat\" \"varying float\"\nDeclare \"bad\" \"wobbly float\"\n" +
                   world("Polygon " + Square +
                         " \"heat\" [1 2 3 4] \"vertex colour Cx\" [1] \"unknown\" [1 2 3 4] \"level\" 5 "
                         "\"Cs\" [\"red\"] \"uniform string tag\" [5] \"constant hpoint h\" [1 2 3 4]"));
    ASSERT_EQ(r.scene.primitives.size(), 1u) << r.all_messages();
    EXPECT_EQ(r.primitive(0).primvars.find("heat")->items(), 4u);
    EXPECT_TRUE(r.says("Declare \"bad\" was left out: \"wobbly\" is no type"));
    EXPECT_TRUE(r.says("\"colour\" is no type"));
    EXPECT_TRUE(r.says("\"unknown\" is not declared and was left out"));
    EXPECT_TRUE(r.says("\"level\" is not declared and was taken for a float"));
    EXPECT_TRUE(r.says("\"Cs\" is declared as color, found strings"));
    EXPECT_TRUE(r.says("\"tag\" is declared as string, found numbers"));
    EXPECT_EQ(r.primitive(0).primvars.find("level")->detail, Detail::Constant);
    EXPECT_EQ(r.primitive(0).primvars.find("h")->type, Type::HPoint);
    EXPECT_EQ(r.primitive(0).primvars.values.size(), 4u);
}

TEST(RibPrimvars, NumbersThatAreNotFinite) {
    const Parsed r(world("Polygon \"P\" [nan 0 0 1 inf 0 1 1 -1.#IND]\nSphere 1 -1 1 360"));
    EXPECT_EQ(r.scene.primitives.size(), 2u);
    EXPECT_TRUE(r.says("3 of the numbers for \"P\" are not finite"));
}

} // namespace kanuka::ingest::test
