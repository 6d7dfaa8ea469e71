// Instances that move in pages of our own: beside the same ones in Embree, and beside their triangles in
// doubles.
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "bvh/page_scene.h"
#include "bvh/test_geometry.h"

namespace kanuka::bvh::testing {
namespace {

std::vector<Ray> timed_rays(int count, float size, uint32_t seed) {
    std::vector<Ray> rays = random_rays(count, size, seed);
    std::mt19937 g(seed + 1);
    std::uniform_real_distribution<float> u(0, 1);
    for (size_t i = 0; i < rays.size(); i++)
        rays[i].time = i % 8 == 0 ? 0 : i % 8 == 1 ? 1 : u(g);
    return rays;
}

std::vector<Vec3f> patch(float height) {
    std::vector<Vec3f> points;
    for (int j = 0; j <= 6; j++)
        for (int i = 0; i <= 6; i++)
            points.push_back({float(i) / 3 - 1, float(j) / 3 - 1, height * std::sin(float(3 * i + j))});
    return points;
}

Transform random_transform(std::mt19937& g, double spread, double size) {
    std::uniform_real_distribution<double> u(-1, 1);
    return Transform::translate(spread * u(g), spread * u(g), spread * u(g)) *
           Transform::rotate(180 * u(g), u(g), u(g), u(g)) *
           Transform::scale(size * (1 + 0.5 * u(g)), -size * (1 + 0.5 * u(g)), size);
}
// Three keys: bends, turns, changes of size; all mirrored.
MotionPath random_path(std::mt19937& g, double spread, double size) {
    std::uniform_real_distribution<double> u(-1, 1);
    std::vector<TransformKey> keys{{0, random_transform(g, spread, size)}};
    for (const double time : {0.4, 1.0})
        keys.push_back({time, Transform::translate(u(g), u(g), u(g)) * keys.back().transform *
                                  Transform::rotate(150 * u(g), u(g), u(g), u(g)) *
                                  Transform::scale(1 + 0.4 * u(g), 1, 1)});
    return MotionPath(keys);
}

constexpr int Mesh = 2; // shape

// World: two that stand still of group 2, eight that move of group 0, a shape of its own. Group 2: three of
// group 1 that move, one of group 0 that stands still. Group 1: shapes, three of group 0 that move.
struct Nested {
    Shapes shapes;
    std::vector<MotionPath> inner, outer, beside;
    std::vector<Transform> of_two, of_zero;
    std::vector<float> matrices_of_two, matrices_of_zero;
    std::vector<GroupDesc> groups{4};

    explicit Nested(double far = 0, float presence = -1) {
        std::mt19937 g(17);
        shapes.add_grid(6, 6, patch(0.3f), presence);
        shapes.add_grid(6, 6, patch(0.1f));
        shapes.add_mesh(3, patch(0.2f), {0, 1, 7, 8, 7, 1, 16, 17, 23});
        shapes.add_sphere({0, 0, 0}, 0.7f, 8);
        for (int i = 0; i < 3; i++)
            inner.push_back(random_path(g, 1.5, 0.5)), outer.push_back(random_path(g, 2, 0.8));
        for (int i = 0; i < 8; i++)
            beside.push_back(random_path(g, 4, 0.7));
        for (int i = 0; i < 2; i++)
            of_two.push_back(Transform::translate(far, 0, 0) * random_transform(g, 1.5, 1));
        of_zero.push_back(Transform::translate(0, 1, 0));
        matrices_of_two = rows(of_two), matrices_of_zero = rows(of_zero);
        groups[0].shapes.push_back({0, 1});
        groups[1].shapes.push_back({1, 2});
        groups[1].instances.push_back({0, {}, inner});
        groups[2].instances.push_back({1, {}, outer});
        groups[2].instances.push_back({0, matrices_of_zero});
        groups[3].shapes.push_back({3, 1});
        groups[3].instances.push_back({2, matrices_of_two});
        groups[3].instances.push_back({0, {}, beside});
        groups[1].instances[0].variations = {0, 11, 12};
        groups[3].instances[0].variations = {31, 32};
        groups[3].instances[1].variations = {0, 41, 42, 43, 44, 45, 46, 47};
    }
    static std::vector<float> rows(const std::vector<Transform>& all) {
        std::vector<float> f;
        for (const Transform& t : all)
            for (size_t k = 0; k < 12; k++)
                f.push_back(float(t.m[k / 4][k % 4]));
        return f;
    }
    // By where they are at a time.
    std::vector<Triangle> triangles(float time) const {
        std::vector<Triangle> out;
        const auto put = [&](int first, int count, const Transform& t) {
            for (const Triangle& k : shapes.triangles)
                if (k.shape >= first && k.shape < first + count)
                    out.push_back({point(t, k.a), point(t, k.b), point(t, k.c), k.shape});
        };
        const double at = double(time);
        put(3, 1, {});
        for (const MotionPath& p : beside)
            put(0, 1, p.at(at));
        for (const Transform& two : of_two) {
            put(0, 1, two * of_zero[0]);
            for (const MotionPath& one : outer) {
                put(1, 2, two * one.at(at));
                for (const MotionPath& zero : inner)
                    put(0, 1, two * one.at(at) * zero.at(at));
            }
        }
        return out;
    }
    static Point point(const Transform& t, const Point& p) {
        const auto row = [&](size_t r) {
            return t.m[r][0] * p.x + t.m[r][1] * p.y + t.m[r][2] * p.z + t.m[r][3];
        };
        return {row(0), row(1), row(2)};
    }
};

bool is_near(float a, float b, float tolerance) {
    return std::abs(a - b) <= tolerance * (1 + std::abs(b));
}

// How many hits of `a` are none of `b`; those of both are the same ones, at the same place.
int differ(const std::vector<Hit>& a, const std::vector<Hit>& b, int& found) {
    int differ = 0;
    for (size_t i = 0; i < a.size(); i++) {
        if (a[i].hit != b[i].hit || a[i].shape != b[i].shape || !is_near(a[i].t, b[i].t, 1e-4f)) {
            differ++;
            continue;
        }
        if (!a[i].hit)
            continue;
        found++;
        if (a[i].shape == Mesh) {
            EXPECT_EQ(a[i].prim, b[i].prim) << i;
        }
        EXPECT_NEAR(a[i].u, b[i].u, 1e-3f) << i;
        EXPECT_NEAR(a[i].v, b[i].v, 1e-3f) << i;
        EXPECT_EQ(a[i].instanced, b[i].instanced) << i;
        if (!a[i].instanced)
            continue;
        EXPECT_EQ(a[i].world_from_shape, b[i].world_from_shape) << i; // to the bit
        EXPECT_TRUE(is_near(a[i].magnitude, b[i].magnitude, 1e-3f)) << i;
        EXPECT_EQ(a[i].slot_shift, b[i].slot_shift) << i;
        EXPECT_EQ(a[i].variation, b[i].variation) << i;
    }
    return differ;
}

void expect_same(const std::vector<Hit>& a, const std::vector<Hit>& b) {
    for (size_t i = 0; i < a.size(); i++) {
        ASSERT_EQ(a[i].hit, b[i].hit) << i;
        ASSERT_EQ(a[i].t, b[i].t) << i;
        ASSERT_EQ(a[i].shape, b[i].shape) << i;
        if (a[i].instanced) {
            ASSERT_EQ(a[i].world_from_shape, b[i].world_from_shape) << i;
        }
        ASSERT_EQ(a[i].magnitude, b[i].magnitude) << i;
    }
}

} // namespace

TEST(MovingPages, FindWhatEmbreeFinds) {
    for (const uint64_t page_bytes : {~uint64_t(0), uint64_t(1)}) {
        Nested nested;
        const Scene pages(nested.shapes.store, nested.groups, {.pages_from = 0, .page_bytes = page_bytes});
        const Scene embree(nested.shapes.store, nested.groups, {.pages_from = AllInEmbree});
        const auto rays = timed_rays(8000, 5, 18);
        const auto eight = intersect<8>(pages, rays);
        int found = 0;
        EXPECT_LE(differ(eight, intersect<8>(embree, rays), found), 8); // rays that graze
        EXPECT_GT(found, 2500);
        int shadows = 0;
        const auto a = occluded<8>(pages, rays), b = occluded<8>(embree, rays);
        for (size_t i = 0; i < rays.size(); i++) {
            EXPECT_EQ(a[i], eight[i].hit);
            shadows += a[i] != b[i];
        }
        EXPECT_LE(shadows, 8);
        expect_same(eight, intersect<1>(pages, rays));
        expect_same(eight, intersect<16>(pages, rays));
    }
}

// Of the innermost instance that has one, here and in Embree.
TEST(MovingPages, VariationsAreThoseOfTheInnermost) {
    Nested nested;
    const Scene pages(nested.shapes.store, nested.groups, {.pages_from = 0});
    const Scene embree(nested.shapes.store, nested.groups, {.pages_from = AllInEmbree});
    const auto rays = timed_rays(8000, 5, 22);
    for (const Scene* scene : {&pages, &embree}) {
        std::map<int, std::set<int>> by_shape;
        for (const Hit& h : intersect<8>(*scene, rays))
            if (h.hit)
                by_shape[h.shape].insert(h.variation);
        EXPECT_EQ(by_shape[3], std::set<int>({0})); // the world's own
        // Group 1 says nothing of its own shapes: what is around it does.
        EXPECT_EQ(by_shape[1], std::set<int>({31, 32}));
        // Shape 0 in group 1: its own, or 0, which is what is around; in group 2 what is around; beside.
        EXPECT_EQ(by_shape[0], std::set<int>({0, 11, 12, 31, 32, 41, 42, 43, 44, 45, 46, 47}));
    }
}

TEST(MovingPages, NothingOfThemIsLeftToEmbree) {
    Nested nested;
    const Scene pages(nested.shapes.store, nested.groups, {.pages_from = 0});
    GroupDesc nothing;
    nothing.shapes.push_back({0, 0});
    const Scene none(nested.shapes.store, {&nothing, 1}, {.pages_from = 0});
    const PageScene ours(nested.shapes.store, nested.groups, 0);
    EXPECT_EQ(pages.bytes() - none.bytes(), ours.bytes());
}

// Cut-outs are there for the same rays.
TEST(MovingPages, CutOutsInThem) {
    Nested nested(0, 0.4f);
    const Scene pages(nested.shapes.store, nested.groups, {.pages_from = 0});
    const Scene embree(nested.shapes.store, nested.groups, {.pages_from = AllInEmbree});
    const auto rays = timed_rays(4000, 5, 19);
    int found = 0;
    EXPECT_LE(differ(intersect<8>(pages, rays), intersect<8>(embree, rays), found), 8);
    EXPECT_GT(found, 900);
}

// Groups that move and have shapes that change, by two and by three times: all of it in pages, or changing
// ones alone in Embree, or all.
TEST(MovingPages, WithShapesThatChange) {
    for (const float presence : {-1.0f, 0.4f}) {
        Nested nested;
        std::vector<std::vector<Vec3f>> steps{patch(-0.2f), patch(0.2f), patch(0.1f)};
        for (Vec3f& p : steps[1])
            p.z += 1;
        for (Vec3f& p : steps[2])
            p.z += 1.4f, p.x += 0.5f;
        const int shape = nested.shapes.add_moving_grid(6, 6, steps, presence);
        steps.pop_back();
        nested.shapes.add_moving_mesh(4, steps, {0, 1, 8, 7, 16, 17, 24, 23});
        nested.groups[1].shapes.push_back({shape, 2});
        nested.groups[0].shapes.push_back({shape, 1});
        const Scene pages(nested.shapes.store, nested.groups, {.pages_from = 0});
        const Scene embree(nested.shapes.store, nested.groups, {.pages_from = AllInEmbree});
        const auto rays = timed_rays(8000, 5, 20);
        const auto hits = intersect<8>(pages, rays);
        int found = 0, changing = 0;
        EXPECT_LE(differ(hits, intersect<8>(embree, rays), found), 8);
        EXPECT_EQ(differ(hits, intersect<16>(pages, rays), found), 0);
        for (const Hit& h : hits)
            changing += h.hit && h.shape >= shape;
        EXPECT_GT(found, 2500);
        EXPECT_GT(changing, 400);
        const auto hidden = occluded<8>(pages, rays);
        for (size_t i = 0; i < rays.size(); i++)
            EXPECT_EQ(hidden[i], hits[i].hit) << i;
    }
}

// Where a ray ends is off the triangle that it has hit by less than shading keeps clear of it, however far
// the numbers are from each other on the way.
TEST(MovingPages, MagnitudesBoundWhatRoundingDoes) {
    for (const double far : {0.0, 3000.0}) {
        Nested nested(far);
        const Scene pages(nested.shapes.store, nested.groups, {.pages_from = 0});
        nested.shapes.read_back();
        auto rays = timed_rays(2000, 5, 21);
        for (Ray& r : rays)
            r.o.x += float(far);
        const auto hits = intersect<8>(pages, rays);
        int found = 0;
        double worst = 0;
        for (size_t i = 0; i < rays.size(); i++) {
            const auto triangles = nested.triangles(rays[i].time);
            const Reference want = trace(triangles, rays[i]);
            if (want.margin < (far == 0 ? 1e-4 : 1e-2))
                continue;
            ASSERT_EQ(hits[i].hit, want.triangle != nullptr) << i << " at " << rays[i].time;
            if (!want.triangle)
                continue;
            ASSERT_EQ(hits[i].shape, want.triangle->shape) << i;
            const Triangle& k = *want.triangle;
            const Point N = cross(k.b - k.a, k.c - k.a), d = Point(rays[i].d) * double(hits[i].t),
                        p = Point(rays[i].o) + d;
            const double off = std::abs(dot(p - k.a, N)) / std::sqrt(dot(N, N)),
                         largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}),
                         clear = 1.5e-6 * (largest + double(hits[i].magnitude)) +
                                 6e-8 * std::sqrt(dot(d, d)); // its distance is a float
            worst = std::max(worst, off / clear);
            found++;
        }
        EXPECT_LT(worst, 1) << far;
        EXPECT_GT(worst, far == 0 ? 0.02 : 0.002) << far; // it is one
        EXPECT_GT(found, 350);
    }
}

} // namespace kanuka::bvh::testing
