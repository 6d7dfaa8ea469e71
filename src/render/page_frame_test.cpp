#include "render/page_frame.h"

#include <random>

#include <gtest/gtest.h>

#include "scene/digest.h"

using namespace kanuka;
using namespace kanuka::render;

namespace {

using Border = dice::DicingCamera::Border;

Transform looking_from(const Vec3f& eye, double turn = 0) {
    return Transform::translate(double(eye.x), double(eye.y), double(eye.z)) *
           Transform::rotate(turn, 0, 1, 0);
}

// A cube of half a side `size` about `middle`, in object space.
scene::Primitive cube(float size, const Vec3f& middle = {0, 0, 0}, const Transform& world_from_object = {}) {
    scene::Primitive p;
    scene::PolygonMesh mesh;
    mesh.vertices_per_loop = std::vector<int32_t>(6, 4);
    mesh.vertices =
        std::vector<int32_t>{0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6};
    scene::Value P;
    P.name = "P";
    P.type = scene::Type::Point;
    std::vector<float> points;
    for (int i = 0; i < 8; i++)
        for (int c = 0; c < 3; c++)
            points.push_back(middle[c] + (i >> c & 1 ? size : -size));
    P.floats = std::move(points);
    p.primvars.set(std::move(P));
    p.geometry = std::move(mesh);
    p.world_from_object = world_from_object;
    return p;
}

struct View {
    Transform render_from_world;
    dice::DicingCamera camera;
};
View view_of(const Transform& world_from_camera) {
    View v;
    const auto& m = world_from_camera.m;
    v.render_from_world = Transform::translate(-m[0][3], -m[1][3], -m[2][3]);
    v.camera.page_from_camera = v.render_from_world * world_from_camera;
    v.camera.pixels_per_tangent = 1000;
    v.camera.width = 800, v.camera.height = 600;
    return v;
}

PageFrame frame_of(const scene::Primitive& p, const Transform& world_from_camera) {
    const View v = view_of(world_from_camera);
    return page_frame(p, v.render_from_world, nullptr, v.camera, {});
}

Digest digest_of_frame(const PageFrame& f) {
    return digest_of(f.page_from_object, f.cameras, f.border, f.pixels_per_unit);
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

} // namespace

TEST(PageFrame, AMoveOfTheWholeSceneChangesNothing) {
    std::mt19937 g(3);
    std::uniform_real_distribution<float> u(-1, 1);
    const Transform far = Transform::translate(1e5, -1e5, 3e4);
    for (int i = 0; i < 300; i++) {
        const Transform place =
            Transform::translate(double(5 * u(g)), double(5 * u(g)), 10 + double(8 * u(g))) *
            Transform::rotate(double(180 * u(g)), 1, 2, 3);
        const Transform camera = looking_from({u(g), u(g), u(g)}, double(10 * u(g)));
        const float size = std::exp(2 * u(g));
        const PageFrame here = frame_of(cube(size, {}, place), camera);
        const PageFrame there = frame_of(cube(size, {}, far * place), far * camera);
        ASSERT_EQ(digest_of_frame(here), digest_of_frame(there)) << i;
        EXPECT_LT(distance(here.offset, there.offset), 1e-9) << i;
    }
}

// 10 cm, at distances of 2 to 40 m: nearly all pages far enough stay as they are.
TEST(PageFrame, ASmallMoveOfTheCameraChangesFewPages) {
    std::mt19937 g(4);
    std::uniform_real_distribution<float> u(-1, 1);
    int same = 0, of = 0;
    for (int i = 0; i < 400; i++) {
        const float z = 2 + 38 * std::abs(u(g));
        const scene::Primitive p =
            cube(0.1f, {}, Transform::translate(double(0.2f * z * u(g)), 0, double(z)));
        const Vec3f eye{u(g), u(g), 0.3f * u(g)};
        const PageFrame a = frame_of(p, looking_from(eye)),
                        b = frame_of(p, looking_from(eye + Vec3f(0.06f, -0.06f, 0.053f), 0.2));
        if (a.border == Border::Across || b.border == Border::Across)
            continue;
        of++;
        same += digest_of_frame(a) == digest_of_frame(b);
    }
    EXPECT_GT(of, 300);
    EXPECT_GT(same, of * 3 / 4) << same << " of " << of;
}

// The camera that rates are chosen by is nearly where it is, as seen from the primitive, and exactly so where
// what is made depends on it.
TEST(PageFrame, StepsAreSmall) {
    std::mt19937 g(5);
    std::uniform_real_distribution<float> u(-1, 1);
    for (int i = 0; i < 1000; i++) {
        const float size = std::exp(4 * u(g));
        const Vec3f middle = Vec3f(u(g), u(g), u(g)) * std::exp(3 * u(g));
        const Transform place = Transform::translate(double(30 * u(g)), double(30 * u(g)), double(30 * u(g)));
        const Transform camera = looking_from(Vec3f(u(g), u(g), u(g)) * 10, double(180 * u(g)));
        const PageFrame f = frame_of(cube(size, middle, place), camera);
        ASSERT_EQ(f.cameras.size(), 1u);
        std::array<double, 3> eye{}, nearest{};
        for (size_t c = 0; c < 3; c++) {
            eye[c] = f.cameras[0].m[c][3] + f.offset[c]; // in render space, where it is the origin
            const double lo = place.m[c][3] + double(middle[int(c)] - size) - camera.m[c][3],
                         hi = place.m[c][3] + double(middle[int(c)] + size) - camera.m[c][3];
            nearest[c] = std::clamp(0.0, lo, hi);
        }
        const double to_it = distance(nearest, {});
        const double off = distance(eye, {});
        if (f.border == Border::Across)
            EXPECT_LT(off, 2e-6 * 300) << i;
        else
            EXPECT_LE(off, 0.11 * to_it + 1e-9) << i;
        for (size_t r = 0; r < 3; r++)
            for (size_t c = 0; c < 3; c++)
                EXPECT_NEAR(f.cameras[0].m[r][c], camera.m[r][c],
                            f.border == Border::Across ? 1e-6 : 1.0 / 128);
    }
}

TEST(PageFrame, TheBorderIsWhereThePictureEnds) {
    std::mt19937 g(6);
    std::uniform_real_distribution<float> u(-1, 1);
    int within = 0, outside = 0;
    for (int i = 0; i < 2000; i++) {
        const float size = 0.05f + 0.4f * std::abs(u(g));
        const Vec3f middle{6 * u(g), 6 * u(g), 8 * u(g)};
        const Transform camera = looking_from({0, 0, 0}, double(30 * u(g)));
        const PageFrame f = frame_of(cube(size, middle), camera);
        const Transform camera_from_world = camera.inverse();
        int inside = 0, corners = 0;
        for (int k = 0; k < 8; k++) {
            const Vec3f p = camera_from_world.point(
                middle + Vec3f(k & 1 ? size : -size, k & 2 ? size : -size, k & 4 ? size : -size));
            corners++;
            inside += p.z > 0 && std::abs(p.x) < 0.4f * p.z && std::abs(p.y) < 0.3f * p.z;
        }
        if (f.border == Border::Within) {
            EXPECT_EQ(inside, corners) << i;
        } else if (f.border == Border::Outside) {
            EXPECT_EQ(inside, 0) << i;
        }
        within += f.border == Border::Within;
        outside += f.border == Border::Outside;
    }
    EXPECT_GT(within, 50);
    EXPECT_GT(outside, 800);
}

// Neighbours that share an edge, in one object space, have one origin, so that their edges are the same
// points.
TEST(PageFrame, NeighboursShareTheirOrigin) {
    const Transform place = Transform::translate(3, 4, 50);
    std::array<double, 3> first{};
    for (int i = 0; i < 20; i++) {
        const PageFrame f = frame_of(cube(0.5f, {float(i) - 10, 0, 0}, place), looking_from({0, 0, 0}));
        if (i == 0)
            first = f.offset;
        EXPECT_EQ(f.offset, first) << i;
    }
}

// What is modelled far from its origin and seen from near by keeps its digits.
TEST(PageFrame, FarFromTheOriginOfItsSpace) {
    const Vec3f middle{1e6f, -2e6f, 5e5f};
    const PageFrame f = frame_of(cube(1, middle), looking_from(middle + Vec3f(0, 0, -4)));
    const Vec3f at = f.page_from_object.point(middle);
    EXPECT_LT(length(at), 8);
    const Vec3f eye = middle + Vec3f(0, 0, -4);
    for (int c = 0; c < 3; c++) // nothing is lost on the way
        EXPECT_NEAR(double(at[c]) + f.offset[size_t(c)], double(middle[c]) - double(eye[c]), 1e-6);
}

// From within its box a mesh is as near as its nearest face: with the walls of a room as near as the camera
// is to them, digits are lost nowhere, and the origin stays that of its neighbours. A finger's breadth in
// front of a wall of a hall it goes to the camera.
TEST(PageFrame, InsideOfAMesh) {
    const PageFrame room = frame_of(cube(10), looking_from({1, 2, 3}));
    EXPECT_EQ(room.border, Border::Across);
    EXPECT_EQ(room.page_from_object, Transform());
    const PageFrame hall = frame_of(cube(100), looking_from({0, 0, 99.99f}));
    EXPECT_LT(length(hall.page_from_object.point({0, 0, 100})), 0.1f);
    EXPECT_NE(hall.offset[2], -99.99);
}

TEST(PageFrame, InstancesAreAskedForInStepsOfAFourthRootOfTwo) {
    GroupView view;
    for (const float rate : {100.0f, 104.0f, 96.0f, 117.0f}) {
        view.pixels_per_unit = rate;
        const View v = view_of({});
        const PageFrame f = page_frame(cube(1), {}, &view, v.camera, {});
        EXPECT_TRUE(f.cameras.empty());
        EXPECT_NEAR(std::log2(f.pixels_per_unit / rate), 0, 0.1251);
        EXPECT_NEAR(std::remainder(std::log2(f.pixels_per_unit), 0.25), 0, 1e-6);
    }
}
