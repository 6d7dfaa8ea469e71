// Curves, points and blobs as they are handed to the tracer, seen by a view of known measures: where vertices
// lie, how finely they stand, and what they carry, by formulas written apart.
#include "geom/test_traced.h"

namespace kanuka::geom {
namespace {

using namespace testing;

scene::Primitive quarter_circle(float radius) {
    scene::Curves c;
    c.basis = scene::basis_by_name("bezier");
    c.vertices_per_curve = std::vector<int32_t>{4};
    const float k = 0.5522847f * radius; // off by 0.03 % of the radius
    return primitive(c, {radius, 0, 0, radius, k, 0, k, radius, 0, 0, radius, 0});
}

} // namespace

// A curve is cut as often as it takes to stay within a tenth of a pixel of it and to turn by no more than 12
// degrees a cut, and no oftener; nor in more pieces
// than micropolygons or 256, nor in fewer than an eighth of the former.
TEST(CurveOracles, CutsAreTheFewestThatHold) {
    for (const float radius : {5.0f, 20.0f, 60.0f, 150.0f, 700.0f, 3000.0f}) {
        Eye eye;
        scene::Primitive p = quarter_circle(radius);
        p.primvars.set(value("constantwidth", Type::Float, Detail::Constant, {0.5f}));
        for (const float per_pixel : {0.02f, 1.0f, 2.0f}) {
            eye.per_pixel = per_pixel;
            const double cuts = double(curves(p, eye).vertices.vertices() - 1);
            const double quarter = std::acos(0.0), cells = double(radius * per_pixel) * quarter;
            const double chord = quarter / (2 * std::acos(1 - 0.1 / double(radius))), turn = 90 / 12.0;
            const double least = std::min(std::max(std::min(std::max(chord, turn), cells), cells / 8), 256.0);
            EXPECT_GE(cuts, 0.93 * least) << radius << " " << per_pixel;
            EXPECT_LE(cuts, 1.12 * least + 1) << radius << " " << per_pixel;
        }
    }
}

// Rings stand where the curve's polynomials are, evenly in every segment; tubes have the outline of the width
// (pi times it: Cauchy), the front half as many faces as micropolygons, the other a quarter, at least four.
TEST(CurveOracles, TubesAndRibbonsFollowTheCurve) {
    for (const bool ribbon : {false, true})
        for (const float rate : {30.0f, 90.0f, 260.0f}) {
            scene::Curves c;
            c.basis = scene::basis_by_name("b-spline");
            c.vertices_per_curve = std::vector<int32_t>{4, 6};
            const std::vector<float> p{0, 0,    0, 1,    0.2f, 0, 2,    -0.1f, 0, 3,    0.3f, 0, 0, 2,    0,
                                       1, 2.5f, 0, 1.6f, 3,    0, 2.5f, 2.7f,  0, 3.1f, 2,    0, 4, 2.2f, 0};
            const std::vector<float> width{0.2f, 0.25f, 0.21f, 0.23f, 0.24f, 0.22f};
            const std::vector<float> heat{1, 2, -1, 0.5f, 3, 2, 0, 1, -2, 4};
            scene::Primitive primitive = geom::testing::primitive(c, p);
            auto attributes = std::make_shared<scene::Attributes>();
            attributes->texture_coordinates = {0, 0, 2, 0, 0, 3, 2, 3};
            primitive.attributes = attributes;
            primitive.primvars.set(value("width", Type::Float, Detail::Varying, width));
            primitive.primvars.set(value("heat", Type::Float, Detail::Vertex, heat));
            primitive.primvars.set(value("id", Type::Float, Detail::Uniform, {5, 6}));
            if (ribbon)
                primitive.primvars.set(
                    value("N", Type::Normal, Detail::Varying,
                          std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}));
            Eye eye;
            eye.pixels = rate;
            const MeshParts out = curves(primitive, eye);
            const grid::Grid& g = out.vertices;
            ASSERT_EQ(out.mesh.vertices_per_face, 4);
            size_t vertex = 0, faces = 0;
            for (int curve = 0; curve < 2; curve++) {
                const int segments = curve == 0 ? 1 : 3;
                const size_t first = curve == 0 ? 0 : 4, first_varying = curve == 0 ? 0 : 2;
                const float widest = curve == 0 ? 0.25f : 0.24f;
                const int across = int(std::ceil(rate * widest - 1e-3f)), front = std::max(across, 6);
                const size_t ring = size_t(ribbon ? 1 + across : front + std::max(4, (front + 3) / 4));
                float last_v = -1;
                for (; vertex < size_t(g.vertices()) && g.v[vertex] > last_v; vertex += ring) {
                    const float v = last_v = g.v[vertex];
                    const int s = std::min(int(v * float(segments)), segments - 1);
                    const double t = double(v) * segments - s, r = 1 - t;
                    const double w[4] = {r * r * r / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                                         (3 * r * r * r - 6 * r * r + 4) / 6, t * t * t / 6};
                    const double slope[4] = {-r * r / 2, (9 * t * t - 12 * t) / 6, -(9 * r * r - 12 * r) / 6,
                                             t * t / 2};
                    double place[2] = {}, along[2] = {}, hot = 0;
                    for (size_t k = 0; k < 4; k++) {
                        const size_t from = first + size_t(s) + k;
                        for (size_t e = 0; e < 2; e++)
                            place[e] += w[k] * double(p[3 * from + e]),
                                along[e] += slope[k] * double(p[3 * from + e]);
                        hot += w[k] * double(heat[from]);
                    }
                    const double l = std::hypot(along[0], along[1]);
                    const Vec3f tangent(float(along[0] / l), float(along[1] / l), 0),
                        side(-tangent.y, tangent.x, 0); // the camera's direction x tangent
                    const float wide = std::lerp(width[first_varying + size_t(s)],
                                                 width[first_varying + size_t(s) + 1], float(t));
                    double outline = 0;
                    for (size_t k = 0; k < ring; k++) {
                        const size_t i = vertex + k, n = size_t(g.stride);
                        ASSERT_NEAR(g.v[i], v, 1e-6f);
                        const Vec3f q = at(g.P, i, n) - Vec3f(float(place[0]), float(place[1]), 0);
                        EXPECT_NEAR(dot(q, tangent), 0, 1e-5f); // in the ring's plane
                        EXPECT_NEAR(g.primvars[0].data[i], hot, 1e-5);
                        EXPECT_EQ(g.primvars[1].data[i], float(5 + curve));
                        EXPECT_NEAR(g.s[i], 2 * g.u[i], 1e-5f);
                        EXPECT_NEAR(g.t[i], 3 * g.v[i], 1e-5f);
                        for (size_t e = 0; e < 2; e++)
                            EXPECT_NEAR(at(g.dPdv, i, n)[int(e)], segments * along[e], 1e-4 * segments);
                        if (ribbon) {
                            EXPECT_NEAR(g.u[i], float(k) / float(ring - 1), 1e-6f);
                            EXPECT_LT(length(q - side * (wide * (g.u[i] - 0.5f))), 1e-5f);
                            EXPECT_LT(length(at(g.dPdu, i, n) - side * wide), 1e-5f);
                            EXPECT_LT(length(at(g.N, i, n) - Vec3f(0, 0, 1)), 1e-5f);
                            continue;
                        }
                        const Vec3f out_of = normalize(q), next = at(g.P, vertex + (k + 1) % ring, n);
                        EXPECT_LT(length(at(g.N, i, n) - out_of), 1e-4f);
                        EXPECT_NEAR(g.u[i], 0.5f + 0.5f * dot(out_of, side), 1e-4f);
                        EXPECT_EQ(out_of.z > -1e-4f, k <= size_t(front)); // from one side over the front
                        EXPECT_NEAR(dot(at(g.dPdu, i, n), out_of), 0, 1e-5f);
                        EXPECT_NEAR(length(at(g.dPdu, i, n)), wide, 1e-5f);
                        outline += double(length(next - at(g.P, i, n)));
                    }
                    EXPECT_NEAR(outline, ribbon ? 0 : std::acos(-1.0) * double(wide), 1e-5);
                    faces += last_v < 1 ? (ribbon ? ring - 1 : ring) : 0;
                }
                EXPECT_EQ(last_v, 1) << curve;
            }
            EXPECT_EQ(vertex, size_t(g.vertices()));
            EXPECT_EQ(out.mesh.indices.size(), 4 * faces);
            for (size_t f = 0; f < faces; f++) { // to the outside, between rings that follow each other
                const uint32_t* q = &out.mesh.indices[4 * f];
                const auto p = [&](int k) { return g.position(int(q[k])); };
                EXPECT_GT(dot(cross(p(2) - p(0), p(3) - p(1)), g.normal(int(q[0]))), 0);
            }
        }
}

// Thin ones: one vertex a ring, half the width around it; ends are drawn in by what the half ball there
// covers.
TEST(CurveOracles, Fibres) {
    scene::Curves c;
    c.cubic = false;
    c.vertices_per_curve = std::vector<int32_t>{3};
    scene::Primitive p = primitive(c, {0, 0, 0, 4, 0, 0, 4, 9, 0});
    p.primvars.set(value("width", Type::Float, Detail::Varying, {0.2f, 0.1f, 0.3f}));
    Eye eye;
    eye.pixels = 4;
    const MeshParts out = curves(p, eye);
    const grid::Grid& g = out.vertices;
    ASSERT_EQ(g.vertices(), 1 + 2 + 5); // 16 and 36 micropolygon edges, eight a cut
    const size_t n = size_t(g.stride);
    EXPECT_NEAR(at(g.P, 0, n).x, 0.1f * Pi / 4, 1e-6f);
    EXPECT_NEAR(at(g.P, 7, n).y, 9 - 0.15f * Pi / 4, 1e-6f);
    for (size_t i = 0; i < 8; i++) {
        EXPECT_NEAR(g.v[i], i <= 2 ? 0.25f * float(i) : 0.5f + 0.1f * float(i - 2), 1e-6f);
        EXPECT_NEAR(out.mesh.radius[i], i <= 2 ? 0.1f - 0.025f * float(i) : 0.05f + 0.02f * float(i - 2),
                    1e-6f);
        if (i == 7)
            break;
        EXPECT_EQ(out.mesh.indices[i], uint32_t(i));
        if (i > 0) {
            EXPECT_LT(length(at(g.P, i, n) -
                             (i <= 2 ? Vec3f(2 * float(i), 0, 0) : Vec3f(4, 1.8f * float(i - 2), 0))),
                      1e-5f);
        }
    }
    // Short of its own width, by a quarter of its length at most.
    p.primvars.set(value("P", Type::Point, Detail::Vertex, {0, 0, 0, 0.04f, 0, 0, 0.08f, 0, 0}));
    const MeshParts stub = curves(p, eye);
    EXPECT_NEAR(stub.vertices.P[0], 0.01f, 1e-6f);
}

// Thin ones that must be polygons: three sides, whose outline is that of the width, and which are as wide as
// that from the camera.
TEST(CurveOracles, ThinTubesHaveThreeSides) {
    scene::Curves c;
    c.cubic = false;
    c.vertices_per_curve = std::vector<int32_t>{2};
    scene::Primitive p = primitive(c, {0, 0, 0, 5, 0, 0});
    p.primvars.set(value("constantwidth", Type::Float, Detail::Constant, {0.2f}));
    const MeshParts out = curves(p, Eye(), true);
    const grid::Grid& g = out.vertices;
    ASSERT_EQ(g.vertices() % 3, 0);
    for (int ring = 0; ring < g.vertices(); ring += 3) {
        float outline = 0, low = 1, high = -1;
        Vec3f middle(0);
        for (int k = 0; k < 3; k++) {
            const Vec3f q = g.position(ring + k);
            outline += length(g.position(ring + (k + 1) % 3) - q);
            low = std::min(low, q.y), high = std::max(high, q.y);
            middle += q;
        }
        EXPECT_NEAR(outline, 0.2f * Pi, 1e-5f);
        EXPECT_NEAR(high - low, 0.2f, 1e-5f);
        EXPECT_LT(std::hypot(middle.y, middle.z), 1e-5f);
    }
}

// Of any size in the picture, balls have four times a circle's area (Cauchy: their mean silhouette is the
// circle) and disks the circle's; a point's vertices and triangles are its own.
TEST(PointOracles, AreasAreThoseOfCircles) {
    for (const char* type : {"sphere", "disk"})
        for (const float pixels : {1.0f, 4.0f, 12.0f, 40.0f, 200.0f}) {
            const float width[2] = {0.5f, 0.3f};
            scene::Primitive p = primitive(scene::Points{}, {0, 0, 0, 4, 1, -2});
            p.primvars.set(value("width", Type::Float, Detail::Varying, {width[0], width[1]}));
            scene::Value name;
            name.name = "type", name.type = Type::String, name.detail = Detail::Constant;
            name.strings = std::vector<std::string>{type};
            p.primvars.set(name);
            Eye eye;
            eye.pixels = 4 * pixels; // of the first one's radius
            MeshParts out;
            Journal journal;
            ASSERT_TRUE(mesh_from_points(p, {}, eye, true, journal, out));
            EXPECT_TRUE(journal.entries().empty());
            double area[2] = {};
            for (size_t k = 0; k < out.mesh.indices.size(); k += 3) {
                Vec3f q[3];
                for (size_t c = 0; c < 3; c++)
                    q[c] = out.vertices.position(int(out.mesh.indices[k + c]));
                area[q[0].x > 2] += 0.5 * double(length(cross(q[1] - q[0], q[2] - q[0])));
            }
            for (int i = 0; i < 2; i++) {
                const double circle = std::acos(-1.0) / 4 * double(width[i] * width[i]);
                EXPECT_NEAR(area[i] / circle, type[0] == 's' ? 4 : 1, 1e-4) << type << " " << pixels;
            }
        }
}

// A ribbon of more triangles than are paired at a time: quads, which hold every triangle once.
TEST(PolygonOracles, PairsOfManyTriangles) {
    constexpr int Quads = 70001;
    std::vector<float> p;
    std::vector<int32_t> index;
    for (int i = 0; i <= Quads; i++)
        p.insert(p.end(), {float(i), 0, 0, float(i), 1, 0});
    for (int i = 0; i < Quads; i++)
        index.insert(index.end(), {2 * i, 2 * i + 2, 2 * i + 3, 2 * i, 2 * i + 3, 2 * i + 1});
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>(2 * Quads, 3);
    m.vertices = index;
    MeshParts out;
    Journal journal;
    const scene::Primitive mesh = primitive(m, p);
    ASSERT_TRUE(mesh_from_polygons(mesh, m, {}, false, journal, out));
    ASSERT_EQ(out.mesh.vertices_per_face, 4);
    std::vector<int> lower(Quads), upper(Quads); // of quad i: with one and with two vertices at y = 1
    for (size_t f = 0; f < out.mesh.indices.size(); f += 4) {
        const uint32_t* q = &out.mesh.indices[f];
        for (const auto& [a, b, c] : {std::array{q[0], q[1], q[3]}, {q[2], q[3], q[1]}}) {
            if (a == b || b == c || c == a) // the second of a triangle that is alone
                continue;
            const uint32_t first = std::min({a, b, c}) / 2, top = a % 2 + b % 2 + c % 2;
            ASSERT_EQ(std::max({a, b, c}), 2 * first + 3);
            ASSERT_TRUE(top == 1 || top == 2);
            (top == 1 ? lower : upper)[first]++;
        }
    }
    EXPECT_EQ(std::count(lower.begin(), lower.end(), 1), Quads);
    EXPECT_EQ(std::count(upper.begin(), upper.end(), 1), Quads);
}

// Cells of a blob are micropolygons where its surface is nearest: quads are half as many again as its area
// has cells, since a lattice's edges in three directions meet it.
TEST(BlobbyOracles, CellsAreMicropolygonsWhereItIsNearest) {
    for (const float distance : {0.0f, 2.0f, 3.0f, 8.0f}) {
        scene::Blobby blobby;
        blobby.code = std::vector<int32_t>{1001, 0};
        blobby.floats = std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        blobby.leaves = 1;
        scene::Primitive p;
        p.geometry = blobby;
        Eye eye;
        eye.distance = distance;
        eye.pixels = distance == 0 ? 60 : 60 * distance;
        MeshParts out;
        Journal journal;
        ASSERT_TRUE(mesh_from_blobby(p, blobby, {}, eye, journal, out));
        // The surface is a ball of half the support's radius.
        const double per_unit = 60 * (distance == 0 ? 1 : double(distance) / (double(distance) - 0.5));
        const double quads = 1.5 * std::acos(-1.0) * per_unit * per_unit;
        const double made = double(out.mesh.indices.size()) / 4;
        EXPECT_GT(std::sqrt(made / quads), 0.97) << distance;
        EXPECT_LT(std::sqrt(made / quads), 1.15) << distance; // measured in a ball around the support
    }
}

// Where micropolygons are long, cells are as small as keeps a chord along a cell's diagonal within the
// tolerance of the tightest bend: b^2 / a at an ellipsoid's tip. A lattice's edges along an axis meet its
// outline from there twice.
TEST(BlobbyOracles, CellsAreSmallWhereItBends) {
    for (const float longer : {1.0f, 2.0f})
        for (const float chord : {0.1f, 0.25f, 0.5f}) {
            scene::Blobby blobby;
            blobby.code = std::vector<int32_t>{1001, 0};
            blobby.floats = std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, longer, 0, 0, 0, 0, 1};
            blobby.leaves = 1;
            scene::Primitive p;
            p.geometry = blobby;
            Eye eye;
            eye.pixels = 200, eye.edge = 20, eye.per_pixel = 1 / eye.edge, eye.chord = chord;
            MeshParts out;
            Journal journal;
            ASSERT_TRUE(mesh_from_blobby(p, blobby, {}, eye, journal, out));
            // Half axes of half the support: 1/2 and longer / 2. (cell sqrt(2))^2 / 8 r = chord.
            const double r = 0.5 / double(longer) * 200, cell = 2 * std::sqrt(r * double(chord)) / 200;
            const double outlines = std::acos(-1.0) * 0.25 * (1 + 2 * double(longer));
            const double made = double(out.mesh.indices.size()) / 4;
            EXPECT_NEAR(std::sqrt(made / (2 * outlines / (cell * cell))), 1, 0.03) << longer << " " << chord;
        }
}

// The widest place decides whether a curve is a tube, and how many faces it has around: at either end of it.
TEST(CurveOracles, ConesAreTubesWhicheverEndIsWide) {
    const auto cone = [](float first, float last) {
        scene::Curves c;
        c.cubic = false;
        c.vertices_per_curve = std::vector<int32_t>{2};
        scene::Primitive p = primitive(c, {0, 0, 0, 0, 5, 0});
        p.primvars.set(value("width", Type::Float, Detail::Varying, {first, last}));
        Eye eye;
        eye.pixels = 40;
        return curves(p, eye);
    };
    const MeshParts wide_first = cone(0.5f, 0), wide_last = cone(0, 0.5f);
    EXPECT_TRUE(wide_first.mesh.radius.empty());
    EXPECT_TRUE(wide_last.mesh.radius.empty());
    EXPECT_EQ(wide_first.vertices.vertices(), wide_last.vertices.vertices());
    EXPECT_FALSE(cone(0.01f, 0).mesh.radius.empty());
}

// A vertex without a normal has no side to stand off to; its neighbours have theirs.
TEST(StandingOff, VerticesWithoutANormalStay) {
    grid::Grid g;
    g.allocate(2, 1);
    grid::TracedMesh mesh;
    mesh.vertices_per_face = 4;
    mesh.indices = {0, 1, 4, 3, 1, 2, 5, 4};
    const size_t n = size_t(g.stride);
    for (int i = 0; i < 6; i++) { // a roof along y
        const Vec3f p{float(i % 3), float(i / 3), i % 3 == 1 ? 0.5f : 0};
        const Vec3f normal = i == 4 ? Vec3f(0) : Vec3f(float(i % 3 - 1), 0, 1);
        for (size_t c = 0; c < 3; c++)
            g.P[size_t(i) + c * n] = p[int(c)], g.Ng[size_t(i) + c * n] = normal[int(c)];
    }
    const std::vector<float> out = standing_off(g, mesh);
    EXPECT_EQ(at(out, 4, n), Vec3f(1, 1, 0.5f));
    EXPECT_NE(at(out, 1, n), Vec3f(1, 0, 0.5f));
    EXPECT_EQ(at(out, 1, n).x, 1);
    EXPECT_GT(at(out, 1, n).z, 0.5f);
}

} // namespace kanuka::geom
