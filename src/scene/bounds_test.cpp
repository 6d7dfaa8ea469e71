#include "scene/bounds.h"

#include <cmath>
#include <gtest/gtest.h>

namespace kanuka::scene {
namespace {

Value floats(std::string name, int components, std::vector<float> values) {
    Value v;
    v.name = std::move(name);
    v.type = components == 3 ? Type::Point : Type::Float;
    v.floats = std::move(values);
    return v;
}

// A square of half width 1 at z = 0, and a point far away that no face has.
Primitive square() {
    Primitive p;
    PolygonMesh mesh;
    mesh.vertices_per_loop = std::vector<int32_t>{4};
    mesh.vertices = std::vector<int32_t>{0, 1, 2, 3};
    p.geometry = mesh;
    p.primvars.values.push_back(floats("P", 3, {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0, 99, 99, 99}));
    return p;
}

void expect_box(const Bounds3f& b, Vec3f lo, Vec3f hi) {
    for (const auto& [got, wanted] : {std::pair(b.lo, lo), std::pair(b.hi, hi)}) {
        EXPECT_NEAR(got.x, wanted.x, 1e-5f);
        EXPECT_NEAR(got.y, wanted.y, 1e-5f);
        EXPECT_NEAR(got.z, wanted.z, 1e-5f);
    }
}

} // namespace

TEST(Bounds, PointsOfFacesAndWhereTheyArePlaced) {
    Scene s;
    EXPECT_TRUE(bounds(s).empty());
    s.primitives = {square()};
    expect_box(bounds(s), {-1, -1, 0}, {1, 1, 0});
    s.primitives[0].world_from_object = Transform::translate(5, 0, 0) * Transform::rotate(45, 0, 0, 1);
    const float half = std::sqrt(2.0f);
    expect_box(bounds(s), {5 - half, -half, 0}, {5 + half, half, 0});
}

TEST(Bounds, CurvesAndPointsAreAsWideAsTheirWidest) {
    Scene s;
    Primitive p;
    p.geometry = Points{};
    p.primvars.values = {floats("P", 3, {0, 0, 0, 4, 0, 0}), floats("width", 1, {1, 2})};
    s.primitives = {p};
    expect_box(bounds(s), {-1, -1, -1}, {5, 1, 1});
    s.primitives[0].primvars.values[1] = floats("constantwidth", 1, {0.5f});
    expect_box(bounds(s), {-0.25f, -0.25f, -0.25f}, {4.25f, 0.25f, 0.25f});
}

TEST(Bounds, MovingOnesAtAllTimes) {
    Scene s;
    Primitive p = square();
    auto motion = std::make_shared<Motion>();
    motion->shapes = {{0, p.geometry, p.primvars}, {1, p.geometry, p.primvars}};
    motion->shapes[1].primvars.values[0].floats =
        std::vector<float>{-1, -1, 2, 1, -1, 2, 1, 1, 2, -1, 3, 2, 99, 99, 99};
    p.motion = motion;
    s.primitives = {p};
    expect_box(bounds(s), {-1, -1, 0}, {1, 3, 2});
    s.groups.resize(1);
    s.groups[0].primitives = {square()};
    Group::Instances two;
    two.group = 0;
    two.times = {0, 1};
    two.transforms =
        std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0, 0, 10, 0, 2, 0, 0, 0, 0, 2, 0};
    s.instances = {two};
    expect_box(bounds(s), {-1, -2, 0}, {12, 3, 2});
}

TEST(Bounds, InstancesTurnTheBoxesOfTheirGroups) {
    Scene s;
    s.groups.resize(2);
    s.groups[0].primitives = {square()};
    Group::Instances inner, outer;
    inner.group = 0;
    const float c = std::sqrt(0.5f);
    inner.transforms = std::vector<float>{c, -c, 0, 0, c, c, 0, 0, 0, 0, 1, 0};
    s.groups[1].instances = {inner};
    outer.group = 1;
    outer.transforms = std::vector<float>{2, 0, 0, 100, 0, 2, 0, 0, 0, 0, 2, 7};
    s.instances = {outer};
    const float half = 2 * std::sqrt(2.0f);
    expect_box(bounds(s), {100 - half, -half, 7}, {100 + half, half, 7});
}

TEST(Bounds, WhatIsNotFiniteIsLeftOut) {
    Scene s;
    s.primitives = {square(), square()};
    s.primitives[1].primvars.values[0].floats =
        std::vector<float>{NAN, -1, 0, 1, -1, 0, 1, 1, 0, -1, INFINITY, 0, 99, 99, 99};
    s.groups.resize(1);
    s.groups[0].primitives = {square()};
    Group::Instances one;
    one.group = 0;
    one.transforms = std::vector<float>{NAN, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    s.instances = {one};
    expect_box(bounds(s), {-1, -1, 0}, {1, 1, 0});
    s.instances[0].group = 7; // no such group
    expect_box(bounds(s), {-1, -1, 0}, {1, 1, 0});
}

} // namespace kanuka::scene
