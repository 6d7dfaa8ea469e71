// Scenes of few triangles, which rays test all of: beside the same in a tree, to the bit.
#include "bvh/few_triangles.h"
#include "bvh/test_geometry.h"

#include <gtest/gtest.h>

namespace kanuka::bvh {
namespace {

using namespace testing;
using store::Links;

PagesFrom in_a_tree() {
    PagesFrom from(0);
    from.few_triangles = 0;
    return from;
}

// Grids of few cells, quads and triangles; some are there for some rays alone.
struct Mixed : Shapes {
    explicit Mixed(bool partly) {
        std::mt19937 g(3);
        std::uniform_real_distribution<float> u(-1, 1);
        const auto points = [&](size_t count) {
            std::vector<Vec3f> p;
            const Vec3f centre(u(g), u(g), u(g));
            for (size_t i = 0; i < count; i++)
                p.push_back(centre + Vec3f(u(g), u(g), u(g)) * 0.5f);
            return p;
        };
        for (int i = 0; i < 9; i++) {
            const float presence = partly && i % 2 == 0 ? 0.5f : -1.0f;
            links.seen = partly && i % 3 == 0 ? Links::OneSided : 0;
            links.lets_through = partly && i % 4 == 0 ? 1 : 0;
            flips = i % 2 == 1;
            add_grid(1, 1, points(4), presence);
            add_grid(2, 1, points(6), presence);
            add_mesh(4, points(4), {0, 1, 2, 3}, presence);
            add_mesh(3, points(5), {0, 1, 2, 2, 1, 3, 4, 2, 3}, presence);
        }
    }
};

template <int W>
void expect_same(const Scene& list, const Scene& tree, const std::vector<Ray>& rays) {
    const std::vector<Hit> by_list = intersect<W>(list, rays), by_tree = intersect<W>(tree, rays);
    int found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit &a = by_list[i], &b = by_tree[i];
        ASSERT_EQ(a.hit, b.hit) << "ray " << i;
        if (!a.hit)
            continue;
        found++;
        ASSERT_EQ(std::tie(a.t, a.u, a.v, a.shape, a.prim, a.instanced, a.variation, a.slot_shift),
                  std::tie(b.t, b.u, b.v, b.shape, b.prim, b.instanced, b.variation, b.slot_shift))
            << "ray " << i;
        ASSERT_EQ(a.Ng, b.Ng) << "ray " << i;
        ASSERT_EQ(a.magnitude, b.magnitude);
    }
    EXPECT_GT(found, 500);
    EXPECT_EQ(occluded<W>(list, rays), occluded<W>(tree, rays));
    EXPECT_EQ(occluded<W>(list, rays, 7, 0.4f), occluded<W>(tree, rays, 7, 0.4f));
}

} // namespace

TEST(FewTriangles, AreHitAsInATree) {
    for (const bool partly : {false, true}) {
        Mixed shapes(partly);
        const auto tree = shapes.flat_scene({.pages_from = in_a_tree()}); // which moves vertices
        const auto list = shapes.flat_scene({.pages_from = 0});
        const std::vector<Ray> rays = random_rays(4000, 1.5f, 5);
        expect_same<1>(*list, *tree, rays);
        expect_same<8>(*list, *tree, rays);
        expect_same<16>(*list, *tree, rays);
    }
}

// Lanes that are off stay as they are, and rays end where they are told to.
TEST(FewTriangles, LeaveOtherLanesAlone) {
    Shapes shapes;
    shapes.add_mesh(3, {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, {0, 1, 2});
    const auto scene = shapes.flat_scene();
    const std::vector<Ray> rays(8, Ray{{0, 0, 2}, {0, 0, -1}});
    RayPacket<8> some = packet<8>(rays.data(), 8);
    some.active = (Int<8>::lane_index() & Int<8>(1)) == Int<8>(0);
    some.t_max = Float<8>(Int<8>::lane_index()); // the surface is at 2
    HitPacket<8> hits;
    scene->intersect(some, hits);
    EXPECT_EQ(hits.hit.bits(), 0b01010100u);
    EXPECT_EQ(scene->occluded(some).bits(), 0b01010100u);
    for (int i = 0; i < 8; i++)
        EXPECT_EQ(hits.t[i], hits.hit[i] ? 2 : some.t_max[i]);
}

// Vertices stay where they are given, however far the corners of what they bound are.
TEST(FewTriangles, StayWhereTheyAre) {
    Shapes shapes;
    const float far = 1e5f, height = 0.53f;
    shapes.add_mesh(4, {{-far, -far, height}, {far, -far, height}, {far, far, height}, {-far, far, height}},
                    {0, 1, 2, 3});
    const auto scene = shapes.flat_scene({});
    EXPECT_EQ(intersect<8>(*scene, {{{0.2f, 0.3f, 1}, {0, 0, -1}}})[0].t, 1 - height);
    EXPECT_FLOAT_EQ(scene->bounds().lo.z, height);
}

TEST(FewTriangles, AreAllThatTheSceneIs) {
    const auto is_few = [](const Shapes& shapes, uint64_t most = 128) {
        GroupDesc world;
        world.shapes.push_back({0, int(shapes.store.shapes().size())});
        return FewTriangles::of(shapes.store, std::span(&world, 1), most) != nullptr;
    };
    const std::vector<Vec3f> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    Shapes shapes;
    EXPECT_FALSE(is_few(shapes));
    for (int quads = 1; quads <= 65; quads++) {
        shapes.add_mesh(4, square, {0, 1, 2, 3});
        EXPECT_EQ(is_few(shapes), quads <= 64);
        EXPECT_FALSE(is_few(shapes, 1));
        EXPECT_FALSE(is_few(shapes, 0));
    }
    Shapes moving; // what changes is no list
    moving.add_moving_mesh(4, {square, square}, {0, 1, 2, 3});
    EXPECT_FALSE(is_few(moving));
    const std::vector<float> place = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    GroupDesc groups[2]; // nor are instances
    groups[0].shapes.push_back({0, 1});
    groups[1].instances.push_back({0, place});
    EXPECT_EQ(FewTriangles::of(shapes.store, groups, 128), nullptr);
}

} // namespace kanuka::bvh
