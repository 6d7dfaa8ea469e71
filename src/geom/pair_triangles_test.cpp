// Triangles that are halves of a flat quad become one face, and only those.
#include "geom/test_surfaces.h"

namespace kanuka::geom {

using testing::value;

namespace {

// A trapezoid cut along (0, 2), with a triangle of another plane between its halves.
struct Trapezoid {
    std::vector<float> P = {0, 0, 1, 4, 0, 1, 3, 2, 1, 1, 2, 1, 0, 0, 5};
    std::vector<int32_t> vertices = {0, 1, 2, 0, 3, 4, 0, 2, 3};
    std::vector<scene::Value> primvars;

    std::unique_ptr<Surface> make() const {
        scene::PolygonMesh mesh;
        mesh.vertices_per_loop = std::vector<int32_t>{3, 3, 3};
        mesh.vertices = vertices;
        scene::Primitive p;
        p.geometry = mesh;
        p.primvars.set(value("P", scene::Type::Point, scene::Detail::Vertex, P));
        for (const scene::Value& v : primvars)
            p.primvars.set(v);
        Journal journal;
        return make_surface(p, {}, journal);
    }
    int faces() const { return make()->faces(); }
};

constexpr int Joined = 1 + 3, Apart = 9;

} // namespace

TEST(PairTriangles, HalvesOfAFlatQuadAreOneFace) {
    const Trapezoid t;
    const auto surface = t.make();
    ASSERT_EQ(surface->faces(), Joined);
    // The quad has the four corners, and the orientation of its triangles.
    const float ends[2] = {0, 1};
    grid::Grid g;
    g.allocate(1, 1);
    surface->allocate_channels(g);
    surface->evaluate(0, {ends, 2}, {ends, 2}, {g, 0, 2});
    Vec3f sum(0);
    for (int i = 0; i < 4; i++)
        sum += g.position(i);
    EXPECT_EQ(sum.x, 8);
    EXPECT_EQ(sum.y, 4);
    const Vec3f n = cross(g.position(1) - g.position(0), g.position(2) - g.position(0));
    EXPECT_GT(n.z, 0);
}

TEST(PairTriangles, LinearDataDoNotStandInTheWay) {
    Trapezoid t;
    std::vector<float> tint, corners;
    for (size_t i = 0; i < 5; i++)
        tint.push_back(0.3f * t.P[3 * i] - 0.7f * t.P[3 * i + 1] + 0.1f);
    for (const int32_t v : t.vertices)
        corners.push_back(tint[size_t(v)]);
    t.primvars = {value("tint", scene::Type::Float, scene::Detail::Vertex, tint),
                  value("wear", scene::Type::Float, scene::Detail::FaceVarying, corners)};
    EXPECT_EQ(t.faces(), Joined);
}

TEST(PairTriangles, DataThatBendAreLeftAlone) {
    Trapezoid t;
    t.primvars = {value("tint", scene::Type::Float, scene::Detail::Vertex, {0, 1, 0, 0, 0})};
    EXPECT_EQ(t.faces(), Apart);
    // The same at every vertex of a face, but the faces differ: once by uniform data, once corner by corner.
    t.primvars = {value("tint", scene::Type::Float, scene::Detail::Uniform, {1, 2, 3})};
    EXPECT_EQ(t.faces(), Apart);
    t.primvars = {value("tint", scene::Type::Float, scene::Detail::FaceVarying, {1, 1, 1, 2, 2, 2, 3, 3, 3})};
    EXPECT_EQ(t.faces(), Apart);
    t.primvars = {value("tint", scene::Type::Float, scene::Detail::Vertex, {0, NAN, 0, 0, 0})};
    EXPECT_EQ(t.faces(), Apart);
}

TEST(PairTriangles, ShapesThatAreNoFlatConvexQuadAreLeftAlone) {
    Trapezoid bent;
    bent.P[3 * 3 + 2] = 1.001f;
    EXPECT_EQ(bent.faces(), Apart);
    Trapezoid dart; // concave at 2
    dart.P[3 * 2] = 1.2f, dart.P[3 * 2 + 1] = 0.6f;
    EXPECT_EQ(dart.faces(), Apart);
    Trapezoid turned; // the second half looks the other way
    turned.vertices = {0, 1, 2, 0, 3, 4, 0, 3, 2};
    EXPECT_EQ(turned.faces(), Apart);
}

// A quad's flattest corner, of all four, may have a sine of a tenth and no less: a kite whose tips are that
// sharp.
TEST(PairTriangles, CornersMayBeAsSharpAsATenth) {
    for (const double sine : {0.101, 0.15, 0.099, 0.05})
        for (int tip = 0; tip < 2; tip++) {
            const double half = std::asin(sine) / 2; // of the angle at both ends of a rhombus
            const float x = float(std::cos(half)), y = float(std::sin(half));
            Trapezoid t;
            t.P = {-x, 0, 1, 0, -y, 1, x, 0, 1, 0, y, 1, 0, 0, 5};
            if (tip == 1) // cut the other way
                t.vertices = {0, 1, 3, 0, 3, 4, 1, 2, 3};
            EXPECT_EQ(t.faces(), sine > 0.1 ? Joined : Apart) << sine << ' ' << tip;
        }
}

} // namespace kanuka::geom
