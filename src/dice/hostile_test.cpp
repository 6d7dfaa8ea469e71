// Primitives whose numbers make no sense: nothing falls, and nothing takes more than it may.
#include <gtest/gtest.h>

#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

// All faces name vertices that there are.
bool is_whole(const Diced& d) {
    const uint32_t n = uint32_t(d.mesh_vertices.vertices());
    return !d.is_mesh ||
           std::all_of(d.mesh.indices.begin(), d.mesh.indices.end(), [&](uint32_t i) { return i < n; });
}

double work(const Diced& d) {
    return d.is_mesh ? double(d.mesh_vertices.vertices())
                     : double(cell_count(d)) + 16.0 * double(d.grids.size());
}

std::vector<float> bent_lines(int curves) {
    std::vector<float> p;
    for (int i = 0; i < 4 * curves; i++)
        p.insert(p.end(), {float(i % 4) - 1.5f, float(i % 3) - 1, float(i % 5)});
    return p;
}

TEST(HostileCurves, NumbersBeyondSinglePrecision) {
    for (const bool cubic : {true, false})
        for (const char* basis : {"bezier", "b-spline", "catmull-rom"})
            for (const float bad : {1e15f, 1e19f, 1e30f, -3.4e38f, 3.4e38f, INFINITY, NAN})
                for (size_t at = 0; at < 24; at++) {
                    scene::Curves c;
                    c.cubic = cubic;
                    c.basis = scene::basis_by_name(basis);
                    c.vertices_per_curve = std::vector<int32_t>{4, 4};
                    std::vector<float> p = bent_lines(2);
                    p[at] = bad;
                    scene::Primitive prim = primitive(c, p);
                    prim.primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {0.1f}));
                    Journal journal;
                    const Diced d = dice::dice(prim, {}, looking(5), {}, journal);
                    ASSERT_TRUE(is_whole(d)) << bad << " at " << at;
                    ASSERT_LT(d.mesh_vertices.vertices(), 1 << 18);
                }
}

TEST(HostileCurves, WidthsBeyondSinglePrecision) {
    for (const float bad : {1e15f, 1e30f, 3.4e38f, INFINITY, NAN, -1e30f})
        for (const bool instanced : {true, false}) {
            scene::Curves c;
            c.basis = scene::basis_by_name("bezier");
            c.vertices_per_curve = std::vector<int32_t>{4, 4};
            scene::Primitive prim = primitive(c, bent_lines(2));
            prim.primvars.set(floats("width", Type::Float, Detail::Varying, {0.1f, bad, 0.2f, 0.1f}));
            DiceTarget target;
            target.pixels_per_unit = instanced ? 10 : 0;
            Journal journal;
            const Diced d = dice::dice(prim, target, looking(5), {}, journal);
            ASSERT_TRUE(is_whole(d)) << bad;
        }
}

TEST(HostileCurves, TablesThatDoNotFit) {
    for (const std::vector<int32_t>& counts : std::vector<std::vector<int32_t>>{
             {-4, 8}, {4, 400}, {2147483647, 4}, {0, 0, 8}, {3, 4}, {-2147483647, 4}})
        for (const bool periodic : {true, false}) {
            scene::Curves c;
            c.periodic = periodic;
            c.basis = scene::basis_by_name("b-spline");
            c.vertices_per_curve = counts;
            scene::Primitive prim = primitive(c, bent_lines(2));
            prim.primvars.set(floats("width", Type::Float, Detail::Varying, {0.1f}));
            prim.primvars.set(floats("k", Type::Float, Detail::Uniform, {1}));
            Journal journal;
            ASSERT_TRUE(is_whole(dice::dice(prim, {}, looking(5), {}, journal)));
            ASSERT_FALSE(journal.entries().empty());
        }
}

// What is diced within a budget is coarser, and says so.
void expect_within(const scene::Primitive& prim, const DiceOptions& options, const char* what) {
    Journal journal;
    const Diced d = dice::dice(prim, {}, options, {}, journal);
    EXPECT_TRUE(is_whole(d)) << what;
    EXPECT_GT(work(d), 0) << what;
    EXPECT_LE(work(d), 1.3 * options.max_micropolygons) << what;
    ASSERT_EQ(journal.entries().size(), 1u) << what;
    EXPECT_EQ(journal.entries()[0].where.str(), "test.rib:1:1") << what;
}

TEST(Budget, OfCurvesAndPoints) {
    DiceOptions options = looking(5);
    options.max_micropolygons = 20000;
    scene::Curves c;
    c.cubic = false;
    c.vertices_per_curve = std::vector<int32_t>{100};
    std::vector<float> p;
    for (int i = 0; i < 100; i++)
        p.insert(p.end(), {i % 2 ? 2.0f : -2.0f, 0.01f * float(i), 0});
    scene::Primitive wide = primitive(c, p);
    wide.primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {1}));
    expect_within(wide, options, "curves");
    scene::Primitive points = primitive(scene::Points{}, p);
    points.primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {4}));
    expect_within(points, options, "points");
}

// Flat things that go on for ever, and near ones as large: a picture of 16 by 12 pixels shows 192 of their
// micropolygons, and mirrors some more.
TEST(Budget, OfWhatIsBeyondThePicture) {
    DiceOptions options = looking(5, 16);
    options.camera.page_from_camera = {};
    options.max_micropolygons = DiceOptions::most_for(16, 12, 1);
    for (const float far : {1e6f, 1e10f, 1e15f, 1e19f, 1e30f}) {
        scene::PatchMesh bilinear;
        bilinear.cubic = false;
        bilinear.nu = bilinear.nv = 2;
        std::vector<scene::Primitive> all;
        for (size_t corner = 0; corner < 4; corner++)
            for (size_t axis = 0; axis < 3; axis++) {
                std::vector<float> p{-0.9f, -0.9f, 0, 0.9f, -0.9f, 0, -0.9f, 1, 0, 0.9f, 1, 0};
                p[3 * corner + axis] = far;
                all.push_back(primitive(bilinear, p));
                scene::PolygonMesh polygon;
                polygon.vertices_per_loop = std::vector<int32_t>{4};
                all.push_back(primitive(polygon, p));
            }
        all.push_back(
            primitive(scene::Quadric{scene::Quadric::Kind::Hyperboloid, {0, far, 0, 0, 0, 0, 360}}));
        all.push_back(primitive(scene::Quadric{scene::Quadric::Kind::Sphere, {far, -far, far, 360}}));
        all.push_back(primitive(scene::Quadric{scene::Quadric::Kind::Torus, {far, 1, 0, 360, 360}}));
        for (const scene::Primitive& prim : all) {
            Journal journal;
            const Diced d = dice::dice(prim, {}, options, {}, journal);
            ASSERT_LE(work(d), options.max_micropolygons * 1.3) << far;
        }
    }
}

} // namespace
