// Instances of groups: nested, many, mirrored, degenerate; against the same shapes transformed and put flat.
#include "bvh/test_geometry.h"

#include <gtest/gtest.h>

namespace kanuka::bvh {
namespace {

using namespace testing;

std::array<float, 12> rows(const Transform& t) {
    std::array<float, 12> m;
    for (size_t r = 0; r < 3; r++)
        for (size_t c = 0; c < 4; c++)
            m[r * 4 + c] = float(t.m[r][c]);
    return m;
}

Transform random_transform(std::mt19937& g, double spread, double size) {
    std::uniform_real_distribution<double> u(-1, 1);
    return Transform::translate(spread * u(g), spread * u(g), spread * u(g)) *
           Transform::rotate(180 * u(g), u(g), u(g), u(g)) *
           Transform::scale(size * (1 + 0.5 * u(g)), size * (1 + 0.5 * u(g)), (u(g) < 0 ? -1 : 1) * size);
}

std::vector<float> flatten(const std::vector<Transform>& all) {
    std::vector<float> f;
    for (const Transform& t : all)
        for (float x : rows(t))
            f.push_back(x);
    return f;
}

// A lumpy patch: no symmetry hides a wrong transform.
std::vector<Vec3f> patch() {
    std::vector<Vec3f> points;
    for (int j = 0; j <= 6; j++)
        for (int i = 0; i <= 6; i++)
            points.push_back({float(i) / 3 - 1, float(j) / 3 - 1, 0.3f * std::sin(float(3 * i + j))});
    return points;
}

std::vector<Vec3f> moved(const std::vector<Vec3f>& points, const Transform& t) {
    std::vector<Vec3f> out;
    for (const Vec3f& p : points)
        out.push_back(t.point(p));
    return out;
}

void compare(const std::vector<Hit>& instanced, const std::vector<Hit>& flat, int least,
             const std::vector<Transform>& all) {
    int found = 0, differ = 0;
    for (size_t i = 0; i < flat.size(); i++) {
        const Hit &a = instanced[i], &b = flat[i];
        if (a.hit != b.hit || (a.hit && std::abs(a.t - b.t) > 1e-3f * (1 + b.t))) {
            differ++;
            continue;
        }
        if (!a.hit)
            continue;
        found++;
        EXPECT_TRUE(a.instanced);
        EXPECT_NEAR(a.u, b.u, 2e-3f);
        EXPECT_NEAR(a.v, b.v, 2e-3f);
        const auto expected = rows(all[size_t(b.shape)]);
        for (size_t m = 0; m < 12; m++)
            EXPECT_NEAR(a.world_from_shape[m], expected[m], 1e-4f);
    }
    EXPECT_GT(found, least);
    EXPECT_LE(differ, int(flat.size() / 1000)); // rays that graze
}

} // namespace

TEST(Instances, AThousandAgainstFlatCopies) {
    std::mt19937 g(1);
    std::vector<Transform> all;
    for (int i = 0; i < 1000; i++)
        all.push_back(random_transform(g, 4, 0.3));
    const auto transforms = flatten(all);
    Shapes one, copies;
    one.add_grid(6, 6, patch());
    std::vector<GroupDesc> groups(2);
    groups[0].shapes.push_back({0, 1});
    groups[1].instances.push_back({0, transforms});
    const Scene scene(one.store, groups, {.pages_from = 0});
    std::vector<Vec3f> traced;
    for (size_t i = 0; i < patch().size(); i++)
        traced.push_back(one.traced_vertex(0, i));
    for (const Transform& t : all)
        copies.add_grid(6, 6, moved(traced, t));
    const auto flat = copies.flat_scene({.pages_from = AllInEmbree});
    const auto rays = random_rays(8000, 5, 2);
    const auto reference = intersect<8>(*flat, rays);
    compare(intersect<8>(scene, rays), reference, 4000, all);
    compare(intersect<1>(scene, rays), reference, 4000, all);
    compare(intersect<16>(scene, rays), reference, 4000, all);
    const auto shadow = occluded<8>(scene, rays);
    int differ = 0;
    for (size_t i = 0; i < rays.size(); i++)
        differ += shadow[i] != reference[i].hit;
    EXPECT_LE(differ, 8);
    EXPECT_EQ(shadow, occluded<1>(scene, rays));
}

// World > 5 of group 2 > 4 of group 1 > 3 of group 0, beside a shape of the world and one of group 1.
TEST(Instances, NestThreeLevels) {
    std::mt19937 g(3);
    std::vector<Transform> level[3];
    for (int l = 0; l < 3; l++)
        for (int i = 0; i < 3 + l; i++)
            level[l].push_back(random_transform(g, 1.5, 0.7));
    const std::vector<float> transforms[3] = {flatten(level[0]), flatten(level[1]), flatten(level[2])};
    Shapes nested, flat;
    nested.add_grid(6, 6, patch());                  // shape 0, group 0
    nested.add_mesh(3, patch(), {0, 1, 7, 8, 7, 1}); // shape 1, group 1
    nested.add_sphere({0, 0, 0}, 0.5f, 8);           // shape 2, world
    std::vector<GroupDesc> groups(4);
    groups[0].shapes.push_back({0, 1});
    groups[1].shapes.push_back({1, 1});
    groups[1].instances.push_back({0, transforms[0]});
    groups[2].instances.push_back({1, transforms[1]});
    groups[3].shapes.push_back({2, 1});
    groups[3].instances.push_back({2, transforms[2]});
    const Scene scene(nested.store, groups, {.pages_from = 0});
    std::vector<Vec3f> of_grid, of_mesh; // as they are traced
    for (size_t i = 0; i < patch().size(); i++)
        of_grid.push_back(nested.traced_vertex(0, i)), of_mesh.push_back(nested.traced_vertex(1, i));
    std::vector<Transform> all;
    std::vector<int> original;
    for (const Transform& a : level[2])
        for (const Transform& b : level[1]) {
            for (const Transform& c : level[0]) {
                flat.add_grid(6, 6, moved(of_grid, a * b * c));
                all.push_back(a * b * c);
                original.push_back(0);
            }
            flat.add_mesh(3, moved(of_mesh, a * b), {0, 1, 7, 8, 7, 1});
            all.push_back(a * b);
            original.push_back(1);
        }
    flat.add_sphere({0, 0, 0}, 0.5f, 8);
    all.push_back(Transform());
    original.push_back(2);
    const auto flat_scene = flat.flat_scene({.pages_from = AllInEmbree});
    const auto rays = random_rays(8000, 4, 4);
    const auto a = intersect<8>(scene, rays), b = intersect<8>(*flat_scene, rays);
    int differ = 0, of_shape[3] = {0, 0, 0};
    for (size_t i = 0; i < rays.size(); i++) {
        if (a[i].hit != b[i].hit || (a[i].hit && std::abs(a[i].t - b[i].t) > 1e-3f * (1 + b[i].t))) {
            differ++;
            continue;
        }
        if (!a[i].hit)
            continue;
        const int shape = original[size_t(b[i].shape)];
        ASSERT_EQ(a[i].shape, shape);
        of_shape[shape]++;
        EXPECT_EQ(a[i].instanced, shape != 2);
        for (size_t m = 0; a[i].instanced && m < 12; m++)
            EXPECT_NEAR(a[i].world_from_shape[m], rows(all[size_t(b[i].shape)])[m], 1e-4f);
    }
    EXPECT_LE(differ, 16);
    for (int n : of_shape)
        EXPECT_GT(n, 20);
}

// The closest of a flat shape, an instance before it and an instance behind it, in whichever order they are
// met.
TEST(Instances, TheClosestWins) {
    for (const auto& [instance_z, expect_instance] : {std::pair{1.0, true}, {-1.0, false}}) {
        Shapes shapes;
        const std::vector<Vec3f> square = {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}};
        shapes.add_grid(1, 1, square);
        shapes.add_grid(1, 1, square);
        const auto transforms = flatten({Transform::translate(0, 0, instance_z)});
        std::vector<GroupDesc> groups(2);
        groups[0].shapes.push_back({0, 1});
        groups[1].shapes.push_back({1, 1});
        groups[1].instances.push_back({0, transforms});
        const Scene scene(shapes.store, groups, {.pages_from = 0});
        const Hit h = intersect<8>(scene, {{{0.1f, 0.2f, 5}, {0, 0, -1}}})[0];
        ASSERT_TRUE(h.hit);
        EXPECT_EQ(h.instanced, expect_instance);
        EXPECT_EQ(h.shape, expect_instance ? 0 : 1);
        EXPECT_FLOAT_EQ(h.t, expect_instance ? 4.0f : 5.0f);
    }
}

TEST(Instances, CutOutsWorkInsideThem) {
    Shapes shapes;
    shapes.add_grid(1, 1, {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}}, 0.25f);
    const auto transforms = flatten({Transform::scale(2, 2, 2)});
    std::vector<GroupDesc> groups(2);
    groups[0].shapes.push_back({0, 1});
    groups[1].instances.push_back({0, transforms});
    const Scene scene(shapes.store, groups, {.pages_from = 0});
    constexpr int Count = 20000;
    const std::vector<Ray> rays(Count, {{0.1f, 0.2f, 2}, {0, 0, -1}});
    const auto hits = intersect<8>(scene, rays);
    const auto shadow = occluded<8>(scene, rays);
    double n = 0;
    for (size_t i = 0; i < Count; i++) {
        n += hits[i].hit;
        ASSERT_EQ(hits[i].hit, shadow[i]);
    }
    EXPECT_NEAR(n / Count, 0.25, 4.5 * std::sqrt(0.25 * 0.75 / Count));
}

TEST(Instances, DegenerateOnesAreNeverHit) {
    const float NaN = std::numeric_limits<float>::quiet_NaN();
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 8);
    auto transforms =
        flatten({Transform::scale(1, 0, 1), Transform::translate(0, 0, -3), Transform::scale(0, 0, 0)});
    transforms.insert(transforms.end(), 12, NaN);
    std::vector<GroupDesc> groups(3); // group 1 is empty, and instanced
    groups[0].shapes.push_back({0, 1});
    groups[2].instances.push_back({0, transforms});
    groups[2].instances.push_back({1, transforms});
    const Scene scene(shapes.store, groups, {.pages_from = 0});
    const auto hits = intersect<8>(scene, {{{0.1f, 0.2f, 5}, {0, 0, -1}}, {{0.1f, 5, 0.2f}, {0, -1, 0}}});
    ASSERT_TRUE(hits[0].hit);
    EXPECT_NEAR(hits[0].t, 5 + 3 - std::sqrt(1 - 0.05f), 0.03f);
    EXPECT_FALSE(hits[1].hit);
}

// With the 48 bytes that the scene has of each, less than 100.
TEST(Instances, TakeFewBytes) {
    std::mt19937 g(7);
    constexpr size_t Count = 100000;
    std::vector<Transform> all;
    for (size_t i = 0; i < Count; i++)
        all.push_back(random_transform(g, 60, 0.5));
    const auto transforms = flatten(all);
    Shapes shapes;
    std::vector<GroupDesc> groups(2);
    groups[0].shapes.push_back({shapes.add_grid(6, 6, patch()), 1});
    groups[1].instances.push_back({0, transforms});
    const uint64_t child = shapes.flat_scene({})->bytes();
    const auto bytes_each = [&](uint64_t pages_from) {
        const Scene scene(shapes.store, groups, {.pages_from = pages_from});
        return double(scene.bytes() - child) / Count;
    };
    EXPECT_LT(bytes_each(AllInEmbree), 52);
    EXPECT_LT(bytes_each(0), 32); // a leaf of 16, and nodes
}

// By default, whether they stand still or move, unless they go in circles.
TEST(Instances, ManyLieInPages) {
    std::mt19937 g(9);
    Shapes shapes;
    const int shape = shapes.add_grid(6, 6, patch());
    const auto is_in_pages = [&](size_t still, size_t moving, double around = 0) { // degrees
        std::vector<Transform> all;
        for (size_t i = 0; i < still; i++)
            all.push_back(random_transform(g, 60, 0.5));
        std::vector<MotionPath> paths;
        for (size_t i = 0; i < moving; i++) {
            const Transform at = random_transform(g, 60, 0.5);
            std::vector<TransformKey> keys;
            for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0})
                keys.push_back(
                    {t, Transform::rotate(around * t, 0, 1, 0) * Transform::translate(t, 0, 0) * at});
            paths.emplace_back(keys);
        }
        const auto transforms = flatten(all);
        std::vector<GroupDesc> groups(2);
        groups[0].shapes.push_back({shape, 1});
        if (still > 0)
            groups[1].instances.push_back({0, transforms});
        if (moving > 0)
            groups[1].instances.push_back({0, {}, paths});
        return Scene(shapes.store, groups, {}).page_bytes().built > 0;
    };
    EXPECT_FALSE(is_in_pages(511, 0));
    EXPECT_TRUE(is_in_pages(512, 0));
    EXPECT_FALSE(is_in_pages(0, 511));
    EXPECT_TRUE(is_in_pages(0, 512));
    EXPECT_TRUE(is_in_pages(4000, 96));
    EXPECT_TRUE(is_in_pages(0, 512, 5));
    EXPECT_FALSE(is_in_pages(0, 512, 180)); // boxes that go straight hold all of an arc
    EXPECT_TRUE(is_in_pages(50000, 4, 180));
}

// A group that is more than a page may hold takes several, on one lattice: the same hits to the bit, alone
// and in instances beside others.
TEST(Instances, AGroupInSeveralPages) {
    std::mt19937 g(11);
    std::vector<Transform> all;
    for (int i = 0; i < 40; i++)
        all.push_back(random_transform(g, 3, 0.4));
    const auto transforms = flatten(all);
    std::vector<std::vector<Hit>> found;
    const auto rays = random_rays(6000, 4, 12);
    for (const bool instanced : {false, true})
        for (const uint64_t page_bytes : {~uint64_t(0), uint64_t(4000), uint64_t(1)}) {
            Shapes shapes;
            for (int i = 0; i < 5; i++) {
                std::vector<Vec3f> points = patch();
                for (Vec3f& p : points)
                    p += Vec3f(0.3f * float(i), 0.1f * float(i * i), -0.2f * float(i));
                if (i == 2)
                    shapes.add_mesh(3, points, {0, 1, 7, 8, 7, 1});
                else
                    shapes.add_grid(6, 6, points);
            }
            std::vector<GroupDesc> groups(2);
            groups[instanced ? 0 : 1].shapes.push_back({0, 5});
            if (instanced)
                groups[1].instances.push_back({0, transforms});
            const Scene scene(shapes.store, groups, {.pages_from = 0, .page_bytes = page_bytes});
            found.push_back(intersect<8>(scene, rays));
        }
    int hits = 0;
    for (size_t i = 0; i < rays.size(); i++)
        for (const size_t first : {size_t(0), size_t(3)})
            for (const size_t other : {first + 1, first + 2}) {
                const Hit &a = found[first][i], &b = found[other][i];
                ASSERT_EQ(a.hit, b.hit) << i;
                if (!a.hit)
                    continue;
                hits++;
                ASSERT_EQ(a.t, b.t) << i;
                ASSERT_EQ(a.u, b.u) << i;
                ASSERT_EQ(a.v, b.v) << i;
                ASSERT_EQ(a.shape, b.shape) << i;
                ASSERT_EQ(a.prim, b.prim) << i;
                ASSERT_EQ(a.instanced, b.instanced) << i;
                for (size_t m = 0; a.instanced && m < 12; m++)
                    ASSERT_EQ(a.world_from_shape[m], b.world_from_shape[m]) << i;
            }
    EXPECT_GT(hits, 1000);
}

} // namespace kanuka::bvh
