// Solids in pages beside those of Embree.
#include "bvh/test_geometry.h"

#include <gtest/gtest.h>

namespace kanuka::bvh {
namespace {

using namespace testing;
using Kind = SolidNode::Kind;

// Bitten balls at turned, scaled and mirrored places, one of which moves; what bites goes through them; a
// ball beside it, and one in each place. Shapes are numbered: what bites, what is bitten.
struct Bitten {
    Shapes shapes;
    std::vector<GroupDesc> groups{3};
    std::vector<float> places;
    MotionPath bites, falls;

    explicit Bitten(float presence)
        : bites(std::vector<TransformKey>{{0.0, Transform::translate(-1, 0.2f, 0)},
                                          {1.0, Transform::translate(1, 0, 0.3f)}}),
          falls(std::vector<TransformKey>{{0.0, Transform::translate(0, 3, 0)},
                                          {1.0, Transform::translate(0, -3, 0)}}) {
        groups[0].shapes.push_back({shapes.add_sphere({0, 0, 0}, 0.6f, 32), 1, 2});
        groups[1].solids = {{Kind::Difference, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}};
        groups[1].shapes.push_back({shapes.add_sphere({0, 0, 0}, 1, 32, presence), 1, 1});
        groups[1].shapes.push_back({shapes.add_sphere({0, 1.2f, 0}, 0.15f, 16), 1});
        groups[1].instances.push_back({0, {}, {&bites, 1}, GroupDesc::Unnumbered, true});
        std::mt19937 g(5);
        std::uniform_real_distribution<float> u(-1, 1);
        for (int i = 0; i < 30; i++) {
            const float angle = 3 * u(g), size = 0.75f + 0.5f * u(g), mirror = i % 3 == 0 ? -1 : 1;
            const float c = size * std::cos(angle), s = size * std::sin(angle);
            places.insert(places.end(),
                          {mirror * c, -s, 0, 4 * u(g), mirror * s, c, 0, 4 * u(g), 0, 0, size, 4 * u(g)});
        }
        groups[2].instances.push_back({1, places});
        groups[2].instances.push_back({1, {}, {&falls, 1}});
        groups[2].shapes.push_back({shapes.add_sphere({0, 0, 0}, 0.5f, 32), 1});
    }
};

TEST(Solids, InPagesAreThoseOfEmbree) {
    std::vector<Ray> rays = random_rays(20000, 4, 13);
    for (size_t i = 0; i < rays.size(); i++)
        rays[i].time = float(i % 97) / 96;
    for (const float presence : {-1.0f, 0.7f}) {
        std::vector<Hit> found[2];
        for (const bool in_pages : {false, true}) {
            Bitten bitten(presence);
            const Scene scene(bitten.shapes.store, bitten.groups, {.pages_from = in_pages ? 0 : AllInEmbree});
            EXPECT_EQ(scene.page_bytes().built > 0, in_pages);
            if (in_pages) // all of it: what is not of shapes is of levels
                EXPECT_LT(scene.bytes() - scene.page_bytes().built, 10000u);
            found[in_pages] = intersect<8>(scene, rays, 3);
            if (!in_pages)
                continue;
            const auto hidden = occluded<8>(scene, rays, 3);
            const auto one = intersect<1>(scene, rays, 3), sixteen = intersect<16>(scene, rays, 3);
            for (size_t i = 0; i < rays.size(); i++) {
                ASSERT_EQ(found[1][i].hit, hidden[i]);
                for (const Hit& other : {one[i], sixteen[i]}) {
                    ASSERT_EQ(other.hit, found[1][i].hit);
                    ASSERT_EQ(other.t, found[1][i].t);
                    ASSERT_EQ(other.shape, found[1][i].shape);
                }
            }
        }
        int differ = 0, hits[2][3] = {};
        for (size_t i = 0; i < rays.size(); i++) {
            const Hit &a = found[0][i], &b = found[1][i];
            hits[0][std::min(a.shape, 2)] += a.hit, hits[1][std::min(b.shape, 2)] += b.hit;
            if (a.hit != b.hit ||
                (a.hit && (a.shape != b.shape || std::abs(a.t - b.t) > 1e-4f * (1 + a.t)))) {
                differ++;
                continue;
            }
            EXPECT_EQ(a.instanced, b.instanced);
            for (size_t k = 0; a.hit && k < 12; k++)
                EXPECT_NEAR(a.world_from_shape[k], b.world_from_shape[k], 1e-5f);
        }
        EXPECT_GT(hits[0][0], 300);
        EXPECT_GT(hits[0][1], 3000);
        // Presence is decided by a distance but for its last bits, which differ.
        EXPECT_LE(differ, presence < 0 ? 5 : 200);
        for (int shape = 0; shape < 3; shape++)
            EXPECT_NEAR(hits[0][shape], hits[1][shape], 30) << shape;
    }
}

// What bites swells while the shutter is open, at two and at three times.
TEST(Solids, ThatChangeInPagesAreThoseOfEmbree) {
    std::vector<Ray> rays = random_rays(10000, 1.5f, 19);
    for (size_t i = 0; i < rays.size(); i++)
        rays[i].time = float(i % 53) / 52;
    for (const int steps : {2, 3}) {
        std::vector<Hit> found[2];
        for (const bool in_pages : {false, true}) {
            Shapes shapes;
            GroupDesc world;
            world.solids = {{Kind::Difference, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}};
            world.shapes.push_back({shapes.add_sphere({0, 0, 0}, 1, 32), 1, 1});
            std::vector<std::vector<Vec3f>> at;
            for (int k = 0; k < steps; k++)
                at.push_back(sphere_points({0.7f, 0.1f * float(k), 0}, 0.3f + 0.2f * float(k), 24));
            world.shapes.push_back({shapes.add_moving_grid(48, 24, at), 1, 2});
            const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = in_pages ? 0 : AllInEmbree});
            EXPECT_EQ(scene.page_bytes().built > 0, in_pages);
            found[in_pages] = intersect<8>(scene, rays);
            const auto hidden = occluded<8>(scene, rays);
            for (size_t i = 0; i < rays.size(); i++)
                ASSERT_EQ(found[in_pages][i].hit, hidden[i]);
        }
        int differ = 0, bitten = 0;
        for (size_t i = 0; i < rays.size(); i++) {
            const Hit &a = found[0][i], &b = found[1][i];
            bitten += a.hit && a.shape == 1;
            differ +=
                a.hit != b.hit || (a.hit && (a.shape != b.shape || std::abs(a.t - b.t) > 1e-4f * (1 + a.t)));
        }
        EXPECT_GT(bitten, 300);
        EXPECT_LE(differ, 5) << steps;
    }
}

} // namespace
} // namespace kanuka::bvh
