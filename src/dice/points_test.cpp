// Points by their types.
#include <gtest/gtest.h>

#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

scene::Primitive points(const char* type, std::vector<float> positions, float width) {
    scene::Primitive p = primitive(scene::Points{}, std::move(positions));
    p.primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {width}));
    if (type) {
        scene::Value v;
        v.name = "type";
        v.type = Type::String;
        v.detail = Detail::Constant;
        v.strings = std::vector<std::string>{type};
        p.primvars.set(v);
    }
    return p;
}

Diced run(const scene::Primitive& p) {
    Journal journal;
    Diced d = dice::dice(p, {}, looking(3), {}, journal);
    EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
    EXPECT_TRUE(d.is_mesh);
    return d;
}

// The sum of the triangles' areas as vectors, and of their lengths.
std::pair<Vec3f, float> area(const Diced& d) {
    Vec3f sum(0);
    float total = 0;
    for (size_t k = 0; k < d.mesh.indices.size(); k += 3) {
        const auto at = [&](size_t c) { return d.mesh_vertices.position(int(d.mesh.indices[k + c])); };
        const Vec3f a = cross(at(1) - at(0), at(2) - at(0)) * 0.5f;
        sum += a;
        total += length(a);
    }
    return {sum, total};
}

} // namespace

TEST(Points, DisksLieAcrossTheirNormals) {
    for (const char* type : {"disk", (const char*)nullptr}) {
        scene::Primitive p = points(type, {0, 0, 0, 1, 0.5f, 0}, 0.5f);
        const Vec3f n = normalize(Vec3f(1, 2, -1));
        p.primvars.set(floats("N", Type::Normal, Detail::Vertex, {2 * n.x, 2 * n.y, 2 * n.z, 0, 0, -1}));
        const Diced d = run(p);
        const auto [sum, total] = area(d);
        EXPECT_NEAR(total, 2 * Pi * 0.0625f, 1e-4f);
        const Vec3f expected = (n + Vec3f(0, 0, -1)) * (Pi * 0.0625f);
        EXPECT_LT(length(sum - expected), 1e-4f);
        for (int i = 0; i < d.mesh_vertices.vertices() / 2; i++) {
            EXPECT_NEAR(dot(d.mesh_vertices.position(i), n), 0, 1e-5f);
            EXPECT_NEAR(dot(normalize(d.mesh_vertices.normal(i)), n), 1, 1e-5f);
        }
    }
}

TEST(Points, WithoutNormalsDisksFaceTheCamera) {
    const auto [sum, total] = area(run(points("disk", {0, 0, 0}, 0.5f)));
    EXPECT_NEAR(sum.z, -Pi * 0.0625f, 1e-4f); // which stands at -z
    EXPECT_NEAR(total, Pi * 0.0625f, 1e-4f);
}

TEST(Points, PatchesTurnAndStretch) {
    scene::Primitive p = points("patch", {0, 0, 0}, 1);
    p.primvars.set(floats("patchangle", Type::Float, Detail::Constant, {90}));
    p.primvars.set(floats("patchaspectratio", Type::Float, Detail::Constant, {4}));
    const Diced d = run(p);
    ASSERT_EQ(d.mesh_vertices.vertices(), 4);
    Bounds3f b;
    float s = 0;
    for (int i = 0; i < 4; i++) {
        b.extend(d.mesh_vertices.position(i));
        s += d.mesh_vertices.s[size_t(i)];
    }
    EXPECT_NEAR(b.hi.x - b.lo.x, 0.25f, 1e-5f); // four times as long as high, then upright
    EXPECT_NEAR(b.hi.y - b.lo.y, 1, 1e-5f);
    EXPECT_NEAR(s, 2, 1e-6f);
}

TEST(Points, BlobsMelt) {
    const Diced apart = run(points("blobby", {-2, 0, 0, 2, 0, 0}, 1));
    for (int i = 0; i < apart.mesh_vertices.vertices(); i++) {
        const Vec3f p = apart.mesh_vertices.position(i);
        ASSERT_NEAR(length(p - Vec3f(p.x < 0 ? -2.0f : 2.0f, 0, 0)), 0.5f, 1e-3f);
    }
    const Diced near = run(points("blobby", {-0.4f, 0, 0, 0.4f, 0, 0}, 1));
    float neck = 1e30f;
    for (int i = 0; i < near.mesh_vertices.vertices(); i++)
        neck = std::min(neck, std::abs(near.mesh_vertices.position(i).x));
    EXPECT_LT(neck, 0.05f); // joined
}

// One vertex each, where they are small in the picture; spheres of triangles where they are not, and where
// there must be polygons.
TEST(Points, SmallSpheresAreBalls) {
    const std::vector<float> places{0, 0, 0, 0.5f, 0.5f, 0, -0.5f, 0.2f, 1};
    const float pixel = 6.0f / 256; // at the origin
    Journal journal;
    DiceTarget polygons;
    polygons.polygons = true;
    for (const char* type : {"sphere", "particle", (const char*)nullptr}) {
        scene::Primitive p = points(type, places, 1.5f * pixel);
        p.primvars.set(floats("Cs", Type::Color, Detail::Vertex, {1, 0, 0, 0, 1, 0, 0, 0, 1}));
        const Diced d = run(p);
        EXPECT_TRUE(d.mesh.balls && d.mesh.around);
        ASSERT_EQ(d.mesh.indices.size(), 3u);
        for (int i = 0; i < 3; i++) {
            EXPECT_EQ(d.mesh.radius[size_t(i)], 0.75f * pixel);
            EXPECT_EQ(d.mesh_vertices.position(i).x, places[size_t(3 * i)]);
            EXPECT_LT(d.mesh_vertices.normal(i).z, -0.9f); // to the camera
            ASSERT_EQ(d.mesh_vertices.primvars.size(), 1u);
            EXPECT_EQ(d.mesh_vertices.primvars[0].component(i)[i], 1);
        }
        EXPECT_FALSE(dice::dice(p, polygons, looking(3), {}, journal).mesh.balls);
        EXPECT_FALSE(run(points(type, places, 4 * pixel)).mesh.balls);
    }
    EXPECT_FALSE(run(points("disk", places, pixel)).mesh.balls);
    // A few large ones among them make no difference.
    scene::Primitive mixed = points("sphere", places, pixel);
    mixed.primvars.set(floats("width", Type::Float, Detail::Vertex, {pixel, 10 * pixel, pixel}));
    EXPECT_TRUE(run(mixed).mesh.balls);
}

TEST(Points, UnknownTypesAreReported) {
    Journal journal;
    const Diced d = dice::dice(points("cube", {0, 0, 0}, 1), {}, looking(3), {}, journal);
    EXPECT_FALSE(d.mesh.indices.empty());
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("rendered as spheres"), std::string::npos);
}
