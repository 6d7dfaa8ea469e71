// Instances, and instances in instances: beside all their triangles where they stand, in doubles.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "base/error.h"
#include "hierarchy/test_instances.h"

namespace kanuka::hierarchy::testing {

TEST(Instances, AreWhereTheirTrianglesAre) {
    for (const double scale : {1e-4, 1.0, 1e4}) {
        Scene scene;
        const uint32_t ball = scene.add(a_ball());
        Random random(3);
        std::vector<Placement> level;
        for (int i = 0; i < 60; i++)
            level.push_back({at_random(random, float(8 * scale), scale, i % 3 == 0), ball});
        const uint32_t root = scene.add(level);
        EXPECT_EQ(scene.world.nesting(root), 1);
        const auto rays = rays_at(scene.flat(root), 1500, float(6 * scale), 4);
        const Compared c = expect_as_brute_force(scene, root, rays, 8 * scale, 2e-6);
        EXPECT_GT(c.found, 1000u) << scale;
    }
}

// A leaf of a wavy surface is hit twice and more by one ray: the nearest counts, by whatever lanes, in a
// world or alone.
TEST(Instances, WavesHideThemselves) {
    const std::vector<TestGrid> grids = ball(2, 16, 1, 0.25f, 4);
    const Thing wavy{grids};
    const Page page = wavy.memory.page();
    World world;
    const uint32_t alone = world.add(page), level = world.add(std::vector<Placement>{{Transform(), alone}});
    Random random(14);
    std::vector<Ray> rays(20000);
    for (Ray& r : rays)
        r.o = random.direction() * 20.0f, r.d = normalize(random.in_box(1) - r.o);
    EverythingIsThere everything;
    std::vector<InstanceHit> by_page(rays.size()), by_level(rays.size()), by_sixteen(rays.size());
    std::vector<Hit> eight(rays.size()), sixteen(rays.size());
    find_closest<8>(world, alone, rays, by_page, everything);
    find_closest<8>(world, level, rays, by_level, everything);
    find_closest<16>(world, level, rays, by_sixteen, everything);
    find_closest<8>(page, rays, eight, everything);
    find_closest<16>(page, rays, sixteen, everything);
    Oracle oracle(page);
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit one = oracle.closest(rays[i]);
        ASSERT_EQ(eight[i], one) << "ray " << i;
        ASSERT_EQ(sixteen[i], one) << "ray " << i;
        ASSERT_EQ(by_page[i].hit, one) << "ray " << i;
        ASSERT_EQ(by_level[i].hit, one) << "ray " << i;
        ASSERT_EQ(by_sixteen[i].hit, one) << "ray " << i;
    }
}

// Matrices are read as they lie in the scene: rays are made for the place that whoever shades the hit has.
TEST(Instances, RaysAreMadeForThePlacesThatTheSceneHas) {
    Random random(31);
    std::vector<float> matrices;
    for (int i = 0; i < 200; i++) {
        const Transform t = at_random(random, 1e5f, 0.3, i % 2 == 1);
        for (size_t k = 0; k < 12; k++)
            matrices.push_back(float(t.m[k / 4][k % 4]));
    }
    const Places places(matrices, {-1e5, 3, 0.25}, Vec3f(2, -7, 1e3f));
    for (size_t i = 0; i < places.size(); i++) {
        const std::array<float, 12> rows = places[i];
        const Ray ray{random.in_box(1e5f), 0.5f, random.direction(), 7};
        const Ray by_place = PageFromWorld(places, i).inner(ray, 5),
                  by_rows = PageFromWorld(rows.data()).inner(ray, 5);
        EXPECT_EQ(0, std::memcmp(&by_place, &by_rows, sizeof by_rows)) << i; // to the bit
        EXPECT_EQ(by_place.t_min, 0.5f);
        EXPECT_EQ(by_place.t_max, 5);
        // Back in the world it is what it was, but for the rounding of the ray.
        for (size_t r = 0; r < 3; r++) {
            const float* const row = rows.data() + 4 * r;
            double o = double(row[3]), d = 0, size = std::abs(o);
            for (int k = 0; k < 3; k++) {
                o += double(row[k]) * double(by_place.o[k]), d += double(row[k]) * double(by_place.d[k]);
                size += std::abs(double(row[k]) * double(by_place.o[k]));
            }
            EXPECT_NEAR(o, double(ray.o[int(r)]), 0x1p-24 * size) << i;
            EXPECT_NEAR(d, double(ray.d[int(r)]), 4 * 0x1p-24) << i;
        }
    }
}

TEST(Instances, LieInInstances) {
    Scene scene;
    const uint32_t ball = scene.add(a_ball());
    Random random(5);
    uint32_t page = ball;
    for (int depth = 1; depth <= 3; depth++) {
        std::vector<Placement> level{{at_random(random, 2, 0.5, true), ball}};
        for (int i = 0; i < 4; i++)
            level.push_back({at_random(random, 4, 0.7, i % 2 == 1), page});
        page = scene.add(level);
    }
    EXPECT_EQ(scene.world.nesting(page), 3);
    const auto rays = rays_at(scene.flat(page), 1500, 3, 6);
    const Compared c = expect_as_brute_force(scene, page, rays, 4, 3e-6);
    EXPECT_GT(c.found, 900u);
    // A page without instances is traced as it is.
    EverythingIsThere everything;
    std::vector<InstanceHit> in_world(rays.size());
    std::vector<Hit> alone(rays.size());
    find_closest<8>(scene.world, ball, rays, in_world, everything);
    find_closest<8>(a_ball().memory.page(), rays, alone, everything);
    for (size_t i = 0; i < rays.size(); i++)
        EXPECT_EQ(in_world[i], (InstanceHit{alone[i], {}}));
}

TEST(Instances, LieAsDeepAsTheyMayAndNoDeeper) {
    Scene scene;
    Random random(7);
    uint32_t page = scene.add(a_ball());
    for (int depth = 0; depth < MostNesting; depth++) {
        std::vector<Placement> level{
            {depth < 8 ? at_random(random, 0.3f, 1) : Transform::rotate(20, 1, 2, 3), page}};
        if (depth < 8) // further in all would be too many for brute force
            level.push_back({Transform::translate(3 + depth, 0, 0), page});
        page = scene.add(level);
    }
    EXPECT_EQ(scene.world.nesting(page), MostNesting);
    const auto rays = rays_at(scene.flat(page), 400, 2, 8);
    EXPECT_GT(expect_as_brute_force(scene, page, rays, 40, 1e-6).found, 100u);
    EXPECT_THROW(scene.world.add(std::vector<Placement>{{Transform(), page}}), Error);
    EXPECT_THROW(scene.world.add(std::vector<Placement>{{Transform(), 1000}}), Error);
}

TEST(Instances, FarFromTheOriginKeepTheirDigits) {
    Scene scene;
    const uint32_t ball = scene.add(a_ball());
    const uint32_t root = scene.add({{Transform::translate(1048576, -1048576, 524288), ball},
                                     {Transform::translate(1048578, -1048576, 524288), ball}});
    // Origins stand on eighths, as floats do there; rays are what they are.
    const auto rays = rays_at(scene.flat(root), 1500, 4, 9);
    EXPECT_GT(expect_as_brute_force(scene, root, rays, 4, 2e-6).found, 800u);
}

TEST(Instances, ThatNoRayCanBeTakenToAreLeftOut) {
    Scene scene;
    const uint32_t ball = scene.add(a_ball());
    Transform nan, tiny = Transform::scale(1e-30, 1e-30, 1e-30), projective,
                   far = Transform::translate(1e30, 0, 0);
    nan.m[1][2] = NAN, projective.m[3][2] = 1;
    const PageMemory nothing = build({}, Lattice{});
    const uint32_t empty = scene.world.add(nothing.page());
    const std::vector<Placement> level{{Transform::scale(1, 0, 1), ball},
                                       {nan, ball},
                                       {tiny, ball},
                                       {projective, ball},
                                       {far, ball},
                                       {Transform::translate(0, 0, 4), ball},
                                       {Transform(), empty}};
    const uint32_t root = scene.world.add(level);
    EXPECT_EQ(scene.world.left_out(), 5u);
    EverythingIsThere everything;
    const std::vector<Ray> rays{
        {{0, 0, 0}, 0, {0, 0, 1}}, {{0, 0, 0}, 0, {0, 0, -1}}, {{0, 0, 0}, 0, {NAN, 0, 1}}};
    std::vector<InstanceHit> hits(rays.size());
    find_closest<8>(scene.world, root, rays, hits, everything);
    EXPECT_TRUE(hits[0].hit.found());
    EXPECT_EQ(hits[0].path.depth, 1u);
    EXPECT_EQ(hits[0].path.instance[0], 5u);
    EXPECT_FALSE(hits[1].hit.found());
    EXPECT_FALSE(hits[2].hit.found());
    // Levels of nothing.
    for (const uint32_t none : {scene.world.add(std::vector<Placement>{}), empty}) {
        find_closest<8>(scene.world, none, rays, hits, everything);
        EXPECT_FALSE(hits[0].hit.found());
    }
}

namespace {

// Every other instance of the inner level is not there.
struct EveryOther {
    static constexpr bool Filters = true;
    bool accepts(const Candidate& candidate) const {
        const InstancePath& path = candidate.path;
        return path.depth == 2 && path.instance[1] % 2 == 0;
    }
};

} // namespace

TEST(Instances, FiltersAreToldWhereTheyAre) {
    Scene scene, half;
    for (Scene* s : {&scene, &half}) {
        const uint32_t ball = s->add(a_ball());
        Random random(11);
        std::vector<Placement> inner, outer;
        for (int i = 0; i < 10; i++)
            inner.push_back({at_random(random, 3, 0.8), ball});
        if (s == &half)
            for (size_t i = 1; i < inner.size(); i += 2)
                inner[i].world_from_page = Transform::scale(0, 0, 0); // left out
        const uint32_t level = s->add(inner);
        for (int i = 0; i < 5; i++)
            outer.push_back({at_random(random, 5, 1), level});
        s->add(outer);
    }
    const uint32_t root = 2;
    const auto rays = rays_at(scene.flat(root), 3000, 4, 12);
    EveryOther other;
    EverythingIsThere everything;
    std::vector<InstanceHit> filtered(rays.size()), left(rays.size());
    std::vector<uint8_t> hidden(rays.size());
    find_closest<8>(scene.world, root, rays, filtered, other);
    find_any<8>(scene.world, root, rays, hidden, other);
    find_closest<8>(half.world, root, rays, left, everything);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        EXPECT_EQ(filtered[i], left[i]) << "ray " << i;
        EXPECT_EQ(hidden[i] != 0, left[i].hit.found()) << "ray " << i;
        found += left[i].hit.found();
    }
    EXPECT_GT(found, 1000u);
}

TEST(Instances, LevelsHaveTheSameBytesForAnyNumberOfThreads) {
    std::vector<std::byte> first;
    Random random(13);
    std::vector<Placement> level;
    for (int i = 0; i < 100000; i++)
        level.push_back({at_random(random, 500, 1), 0});
    for (const size_t threads : {1, 2, 3}) {
        const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                                threads);
        Scene scene;
        scene.add(a_ball());
        const uint32_t root = scene.world.add(level);
        const std::byte* bytes = reinterpret_cast<const std::byte*>(scene.world.page(root).bytes());
        const std::vector<std::byte> own(bytes, bytes + scene.world.page(root).header().bytes);
        if (first.empty())
            first = own;
        EXPECT_EQ(own, first);
        EXPECT_LE(double(own.size()) / double(level.size()) - 48, 64) << "beside its transform";
    }
}

} // namespace kanuka::hierarchy::testing
