// Rays at times against shapes that change and instances that move, held against triangles moved by hand.
#include <gtest/gtest.h>

#include "bvh/test_geometry.h"

namespace kanuka::bvh::testing {
namespace {

std::vector<Ray> timed_rays(int count, float size, uint32_t seed) {
    std::vector<Ray> rays = random_rays(count, size, seed);
    std::mt19937 g(seed + 1);
    std::uniform_real_distribution<float> u(0, 1);
    for (Ray& r : rays)
        r.time = u(g);
    return rays;
}

std::vector<Vec3f> lattice(int n, const std::function<Vec3f(float, float)>& p) {
    std::vector<Vec3f> points;
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++)
            points.push_back(p(float(i) / float(n) * 2 - 1, float(j) / float(n) * 2 - 1));
    return points;
}

std::vector<Vec3f> mix(const std::vector<std::vector<Vec3f>>& steps, float time) {
    const float x = time * float(steps.size() - 1);
    const size_t k = std::min(size_t(x), steps.size() - 2);
    std::vector<Vec3f> out;
    for (size_t i = 0; i < steps[0].size(); i++)
        out.push_back(lerp(x - float(k), steps[k][i], steps[k + 1][i]));
    return out;
}

// Hits and shadows of every ray against the triangles of its own time.
template <int W>
void compare(const Scene& scene, const std::vector<Ray>& rays,
             const std::function<std::vector<Triangle>(float)>& triangles_at) {
    const auto hits = intersect<W>(scene, rays);
    const auto shadows = occluded<W>(scene, rays);
    int far = 0, found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const std::vector<Triangle> triangles = triangles_at(rays[i].time);
        const Reference want = trace(triangles, rays[i]);
        if (want.margin < 1e-4)
            continue;
        found += want.triangle != nullptr;
        EXPECT_EQ(hits[i].hit, want.triangle != nullptr) << i << " at " << rays[i].time;
        EXPECT_EQ(shadows[i], want.triangle != nullptr) << i;
        if (want.triangle && hits[i].hit)
            far += std::abs(double(hits[i].t) - want.t) > 1e-4 * (1 + want.t);
    }
    EXPECT_EQ(far, 0);
    EXPECT_GT(found, 50);
}

template <int W>
void grids_and_meshes(uint64_t pages_from) {
    constexpr int N = 6;
    std::vector<std::vector<Vec3f>> grid = {
        lattice(N, [](float x, float y) { return Vec3f(x, y, 0.2f * x * y); }),
        lattice(N, [](float x, float y) { return Vec3f(x + 1, y, 0.4f * std::sin(3 * x)); }),
        lattice(N, [](float x, float y) { return Vec3f(y, -x, 1 + 0.3f * x); }),
    };
    std::vector<std::vector<Vec3f>> mesh = {
        {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}},
        {{-1, -1, -1.5f}, {1, -1, -1}, {0, 1, 2}, {-1, 1, -1}},
    };
    Shapes shapes;
    const int first = shapes.add_moving_grid(N, N, grid);
    shapes.add_sphere({2, 0, 0}, 0.5f, 4); // stands still among them
    const int second = shapes.add_moving_mesh(4, mesh, {0, 1, 2, 3});
    shapes.add_moving_mesh(3, mesh, {0, 1, 2});
    const auto scene = shapes.flat_scene({.pages_from = pages_from});
    grid = shapes.traced_steps(first), mesh = shapes.traced_steps(second); // as the lattice has them
    const std::vector<Triangle> still = shapes.triangles;
    compare<W>(*scene, timed_rays(1500, 3, 5), [&](float time) {
        std::vector<Triangle> out = still;
        const auto p = mix(grid, time), q = mix(mesh, time);
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++) {
                const auto at = [&](int a, int b) { return Point(p[size_t((j + b) * (N + 1) + i + a)]); };
                out.push_back({at(0, 0), at(1, 0), at(0, 1), 0});
                out.push_back({at(1, 1), at(0, 1), at(1, 0), 0});
            }
        out.push_back({Point(q[0]), Point(q[1]), Point(q[3]), 2});
        out.push_back({Point(q[2]), Point(q[3]), Point(q[1]), 2});
        out.push_back({Point(q[0]), Point(q[1]), Point(q[2]), 3});
        return out;
    });
}

Triangle placed(const Transform& t, const Triangle& k) {
    const auto at = [&](const Point& p) { return Point(t.point({float(p.x), float(p.y), float(p.z)})); };
    return {at(k.a), at(k.b), at(k.c), k.shape};
}

// A turning arm that holds a turning block, beside a still copy.
template <int W>
void moving_instances() {
    Shapes shapes;
    const int block = shapes.add_grid(
        3, 3, lattice(3, [](float x, float y) { return Vec3f(0.8f * x, 0.3f * y, 0.1f * x); }));
    const TransformKey spin_keys[] = {{0, Transform::translate(1, 0, 0)},
                                      {0.3, Transform::translate(1, 0, 0) * Transform::rotate(100, 0, 1, 0)},
                                      {1, Transform::translate(1.5, 0, 0) * Transform::rotate(170, 0, 1, 1)}};
    const TransformKey arm_keys[] = {{-0.5, Transform::scale(1, 1, 1)},
                                     {1.5, Transform::rotate(150, 1, 0, 1) * Transform::scale(1.5, 1, -1)}};
    const MotionPath spin[] = {MotionPath(spin_keys)};
    const MotionPath arms[] = {MotionPath(arm_keys), MotionPath(arm_keys, Transform::translate(0, -2, 0))};
    const std::vector<float> still = {1, 0, 0, 0, 0, 1, 0, 2, 0, 0, 1, 0};
    std::vector<GroupDesc> groups(3);
    groups[0].shapes.push_back({block, 1});
    groups[1].instances.push_back({0, {}, spin});
    groups[2].instances.push_back({1, {}, arms});
    groups[2].instances.push_back({0, still});
    const Scene scene(shapes.store, groups, {.pages_from = 0});
    shapes.read_back();
    const auto moved = [&](float time) {
        std::vector<Triangle> out;
        for (const Triangle& t : shapes.triangles) {
            for (const MotionPath& arm : arms)
                out.push_back(placed(arm.at(double(time)) * spin[0].at(double(time)), t));
            out.push_back(placed(Transform::translate(0, 2, 0), t));
        }
        return out;
    };
    compare<W>(scene, timed_rays(3000, 3, 9), moved);
    // Bounds: rays at points of the moving block from all around find it, whatever the time.
    std::vector<Ray> aimed = timed_rays(3000, 3, 11);
    std::mt19937 g(3);
    for (Ray& r : aimed) {
        const auto all = moved(r.time);
        const Triangle& t = all[g() % all.size()];
        const Point c = (t.a + t.b + t.c) * (1.0 / 3);
        r.d = Vec3f(float(c.x), float(c.y), float(c.z)) - r.o;
    }
    const auto hits = intersect<W>(scene, aimed);
    int missed = 0;
    for (size_t i = 0; i < aimed.size(); i++)
        missed += !hits[i].hit || hits[i].t > 1.0001f;
    EXPECT_EQ(missed, 0);
}

} // namespace

TEST(BvhMotion, ShapesThatChange) {
    for (const uint64_t pages_from : {uint64_t(0), AllInEmbree}) {
        grids_and_meshes<1>(pages_from);
        grids_and_meshes<8>(pages_from);
        grids_and_meshes<16>(pages_from);
    }
}

TEST(BvhMotion, InstancesThatMove) {
    moving_instances<1>();
    moving_instances<8>();
    moving_instances<16>();
}

// What a hit says of its place is where the instance is at its ray's time.
TEST(BvhMotion, HitsKnowTheirTransform) {
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 8);
    const TransformKey keys[] = {{0, Transform::translate(0, 0, 5)}, {1, Transform::translate(0, 4, 5)}};
    const MotionPath paths[] = {MotionPath(keys)};
    std::vector<GroupDesc> groups(2);
    groups[0].shapes.push_back({0, 1});
    groups[1].instances.push_back({0, {}, paths});
    const Scene scene(shapes.store, groups, {.compact = true, .pages_from = 0});
    std::vector<Ray> rays;
    for (int i = 0; i < 16; i++)
        rays.push_back({{0.05f, 4 * float(i) / 15 + 0.03f, 0}, {0, 0, 1}, float(i) / 15});
    for (const Hit& h : intersect<16>(scene, rays))
        EXPECT_TRUE(h.hit && h.instanced);
    const auto hits = intersect<8>(scene, rays);
    for (size_t i = 0; i < 16; i++)
        EXPECT_NEAR(hits[i].world_from_shape[7], 4 * float(i) / 15, 1e-5f);
}

TEST(BvhMotion, FlattenedForAMoment) {
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 4);
    const TransformKey keys[] = {{0, Transform::scale(0, 0, 0)}, {1, Transform::scale(1, 1, 1)}};
    const MotionPath paths[] = {MotionPath(keys)};
    std::vector<GroupDesc> groups(2);
    groups[0].shapes.push_back({0, 1});
    groups[1].instances.push_back({0, {}, paths});
    const Scene scene(shapes.store, groups, {.pages_from = 0});
    const std::vector<Ray> rays = {{{0, 0.1f, -3}, {0, 0, 1}, 0}, {{0, 0.1f, -3}, {0, 0, 1}, 0.5f}};
    const auto hits = intersect<1>(scene, rays);
    EXPECT_FALSE(hits[0].hit);
    EXPECT_TRUE(hits[1].hit);
}

} // namespace kanuka::bvh::testing
