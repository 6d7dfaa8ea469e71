#include "render/motion.h"

#include <gtest/gtest.h>
#include <set>

namespace kanuka::render {
namespace {

scene::Value points(std::vector<float> p) {
    scene::Value v;
    v.name = "P";
    v.type = scene::Type::Point;
    v.detail = scene::Detail::Vertex;
    v.floats = std::move(p);
    return v;
}

scene::Motion::Shape sphere(double time, float radius, std::vector<float> p = {}) {
    scene::Motion::Shape s{
        time, scene::Quadric{scene::Quadric::Kind::Sphere, {radius, -radius, radius, 360}}, {}};
    if (!p.empty())
        s.primvars.set(points(std::move(p)));
    return s;
}

scene::Primitive with(scene::Motion motion) {
    scene::Primitive p;
    if (!motion.shapes.empty()) {
        p.geometry = motion.shapes[0].geometry;
        p.primvars = motion.shapes[0].primvars;
    }
    if (!motion.places.empty())
        p.world_from_object = motion.places[0].transform;
    p.motion = std::make_shared<scene::Motion>(std::move(motion));
    return p;
}

float radius(const scene::Primitive& p) {
    return std::get<scene::Quadric>(p.geometry).arguments[0];
}

} // namespace

TEST(EvenPieces, FewestThatFit) {
    const auto pieces = [](std::vector<double> times) { return even_pieces(times, 16); };
    EXPECT_EQ(pieces({0, 1}), 1);
    EXPECT_EQ(pieces({-1, 3}), 1);
    EXPECT_EQ(pieces({0, 0.5, 1}), 2);
    EXPECT_EQ(pieces({0, 0.25, 1}), 4);
    EXPECT_EQ(pieces({1 / 3.0, 0.5}), 6);
    EXPECT_EQ(pieces({0.1234}), 16);
}

TEST(InShutter, ShapesAreMixed) {
    const scene::Primitive p = with({{},
                                     {sphere(0, 1, {0, 0, 0, 1, 0, 0}), sphere(2, 3, {2, 0, 0, 1, 2, 0}),
                                      sphere(4, 3, {2, 0, 0, 1, 2, 0})}});
    const MovingPrimitive m = in_shutter(p, {1, 3}); // the middle sample is in the middle
    EXPECT_FLOAT_EQ(radius(m.rest), 2);
    ASSERT_EQ(m.later.size(), 2u);
    EXPECT_FLOAT_EQ(radius(m.later[0]), 3);
    EXPECT_FLOAT_EQ(radius(m.later[1]), 3);
    EXPECT_FLOAT_EQ(m.rest.primvars.find("P")->floats[0], 1);
    EXPECT_FLOAT_EQ(m.rest.primvars.find("P")->floats[4], 1);
    EXPECT_FALSE(m.rest.motion);
    // A shutter that does not stay open: sharp, as it is then.
    const MovingPrimitive sharp = in_shutter(p, {1.5, 1.5});
    EXPECT_FLOAT_EQ(radius(sharp.rest), 2.5f);
    EXPECT_TRUE(sharp.later.empty());
    // All samples are over.
    EXPECT_TRUE(in_shutter(p, {7, 9}).later.empty());
    EXPECT_FLOAT_EQ(radius(in_shutter(p, {7, 9}).rest), 3);
}

TEST(InShutter, PlacesKeepTheirKeys) {
    const scene::Primitive p =
        with({{{0, Transform::translate(1, 0, 0)}, {10, Transform::translate(11, 0, 0)}}, {}});
    const MovingPrimitive m = in_shutter(p, {2, 4});
    EXPECT_DOUBLE_EQ(m.rest.world_from_object->m[0][3], 3);
    ASSERT_EQ(m.places.size(), 2u);
    EXPECT_DOUBLE_EQ(MotionPath(m.places).at(1).m[0][3], 5);
    EXPECT_TRUE(in_shutter(p, {2, 2}).places.empty());
    EXPECT_TRUE(in_shutter(p, {20, 30}).places.empty()); // it has arrived
    EXPECT_DOUBLE_EQ(in_shutter(p, {20, 30}).rest.world_from_object->m[0][3], 11);
}

// Whatever the camera looks like and however it moves, dicing and transport see the same.
TEST(PlaceCamera, MovesFromTheEyeWhereItOpens) {
    scene::Camera c;
    c.motion = {{0, Transform::translate(0, 0, -1)}, {1, Transform::translate(-2, 0, -1)}};
    c.camera_from_world = c.motion[0].transform;
    scene::Options o;
    const std::array<double, 3> eye = eye_of(c, {0.5, 1});
    EXPECT_DOUBLE_EQ(eye[0], 1);
    EXPECT_DOUBLE_EQ(eye[2], 1);
    const PlacedCamera moving = place_camera(c, o, {0.5, 1}, eye);
    ASSERT_EQ(moving.motion.size(), 257u * 12);
    EXPECT_FLOAT_EQ(moving.motion[3], 0);
    EXPECT_FLOAT_EQ(moving.motion[128 * 12 + 3], 0.5f);
    EXPECT_FLOAT_EQ(moving.motion[256 * 12 + 3], 1);
    EXPECT_EQ(moving.dicing.also_from.size(), 4u);
    EXPECT_TRUE(place_camera(c, o, {0.5, 0.5}, eye).motion.empty());
}

TEST(PlaceCamera, RendersAsFromItsOwnEyeFromAnyOrigin) {
    scene::Camera c;
    c.camera_from_world = Transform::rotate(30, 0, 1, 0) * Transform::translate(-3, -4, -5);
    const PlacedCamera own = place_camera(c, {}, {}, eye_of(c, {})),
                       other = place_camera(c, {}, {}, {1, 1, 1});
    EXPECT_NEAR(length(own.eye), 0, 1e-6f);
    EXPECT_NEAR(length(other.eye - Vec3f(2, 3, 4)), 0, 1e-6f);
    EXPECT_NEAR(length(other.forward - own.forward), 0, 1e-6f);
    const Vec3f seen = own.camera_from_render.point(own.render_from_world.point({7, 8, 9}));
    EXPECT_NEAR(length(other.camera_from_render.point(other.render_from_world.point({7, 8, 9})) - seen), 0,
                1e-5f);
}

TEST(OriginOfShot, OneForFramesThatAreNear) {
    using Eye = std::array<double, 3>;
    EXPECT_EQ(origin_of_shot({}, {1, 2, 3}), (Eye{1, 2, 3}));
    std::vector<Eye> walk;
    for (int i = 0; i < 48; i++)
        walk.push_back({double(i), 0, 0});
    for (const Eye& eye : walk)
        EXPECT_EQ(origin_of_shot(walk, eye), (Eye{24, 0, 0}));
    for (int i = 48; i < 1000; i++)
        walk.push_back({double(i), 0, 0});
    std::set<Eye> origins;
    for (size_t i = 0; i < walk.size(); i += 9) {
        const Eye origin = origin_of_shot(walk, walk[i]);
        origins.insert(origin);
        EXPECT_LE(std::abs(origin[0] - walk[i][0]), 64);
    }
    EXPECT_EQ(origins.size(), 8u); // 1000 frames, 129 each
    // A cut to far away, and a camera that is not in the shot.
    walk.resize(24);
    walk.push_back({1e7, 0, 0});
    EXPECT_EQ(origin_of_shot(walk, walk.back()), walk.back());
    EXPECT_EQ(origin_of_shot(walk, walk.front()), (Eye{12, 0, 0}));
    EXPECT_EQ(origin_of_shot(walk, {0, 500, 0}), (Eye{0, 500, 0}));
    // One that stands still, and one that turns about.
    EXPECT_EQ(origin_of_shot(std::vector<Eye>(5, {1, 2, 3}), {1, 2, 3}), (Eye{1, 2, 3}));
}

// A tangent of the picture is as many pixels across and up as it is in the picture itself, whether
// PixelAspectRatio, the format's shape or a stretched screen window makes them so.
TEST(PlaceCamera, PixelsThatAreNotSquare) {
    scene::Camera c;
    c.fov = 90;
    scene::Options o;
    o.width = 400, o.height = 100;
    o.pixel_aspect = 0.5f; // the picture is twice as wide as it is high: 4 tangents by 2
    const dice::DicingCamera narrow = place_camera(c, o, {}, {}).dicing;
    EXPECT_NEAR(narrow.pixels_per_tangent, 100, 1e-3f);
    EXPECT_NEAR(narrow.pixels_per_tangent * narrow.pixel_stretch, 50, 1e-3f);
    o.pixel_aspect = 1;
    c.screen_window = std::array<float, 4>{-2, 2, -2, 2};
    const dice::DicingCamera stretched = place_camera(c, o, {}, {}).dicing;
    EXPECT_NEAR(stretched.pixels_per_tangent, 100, 1e-3f);
    EXPECT_NEAR(stretched.pixels_per_tangent * stretched.pixel_stretch, 25, 1e-3f);
}

TEST(PlaceCamera, PixelsPerRadian) {
    scene::Camera c;
    scene::Options o;
    o.width = 360, o.height = 180;
    c.projection = Projection::Spherical;
    EXPECT_NEAR(place_camera(c, o, {}, {}).dicing.pixels_per_tangent, 180 / Pi, 1e-3f);
    c.projection = Projection::Fisheye;
    c.fov = 180;
    EXPECT_NEAR(place_camera(c, o, {}, {}).dicing.pixels_per_tangent, 180 / Pi, 1e-3f);
}

} // namespace kanuka::render
