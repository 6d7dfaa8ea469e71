// Instances that move: beside all their triangles where they are at the time of each ray, in doubles; beside
// instances that stand there, and beside one lane, to the bit.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "hierarchy/test_instances.h"

namespace kanuka::hierarchy::testing {
namespace {

const std::vector<float> Times = {0, 0.17f, 1.0f / 3, 0.5f, 0.83f, 1};

// The times of rays, in turn.
std::vector<float> times_of(size_t rays) {
    std::vector<float> times(rays);
    for (size_t i = 0; i < rays; i++)
        times[i] = Times[i % Times.size()];
    return times;
}

// Along a random way: `move(share)` is what has happened to it by then, at even keys.
template <class Move>
MotionPath path_of(const Transform& start, int keys, const Move& move) {
    std::vector<TransformKey> all;
    for (int k = 0; k < keys; k++)
        all.push_back({double(k) / (keys - 1), move(start, double(k) / (keys - 1))});
    return MotionPath(all);
}

Transform translating(const Transform& start, double f) {
    return Transform::translate(3 * f, -2 * f, f) * start;
}
Transform turning(const Transform& start, double f) { // by more than a whole turn
    return start * Transform::rotate(400 * f, 1, 2, 0.5);
}
Transform scaling(const Transform& start, double f) {
    return start * Transform::scale(1 + 2 * f, 1 - 0.7 * f, 1);
}
Transform all_of_it(const Transform& start, double f) {
    return Transform::translate(2 * f, f * f, 0) * Transform::rotate(250 * f, 0, 1, 1) * start *
           Transform::scale(1 + f, 1, 1 - 0.5 * f);
}
struct Kind {
    Transform (*move)(const Transform&, double);
    int keys;
    bool mirrored;
};
constexpr Kind Kinds[] = {{translating, 2, false}, {turning, 4, false}, {scaling, 2, false},
                          {translating, 3, true},  {turning, 5, true},  {all_of_it, 6, true}};

// A world of things that move and others that stand still, and what keeps the paths.
struct Moving {
    Scene scene;
    std::deque<MotionPath> paths;

    Placement along(Random& random, const Kind& kind, float side, double scale, uint32_t page) {
        paths.push_back(path_of(at_random(random, side, scale, kind.mirrored), kind.keys, kind.move));
        return {Transform(), page, &paths.back()};
    }
};

std::vector<Ray> rays_of_times(const Scene& scene, uint32_t root, size_t count, float away, unsigned seed) {
    std::vector<Ray> rays(count);
    for (size_t t = 0; t < Times.size(); t++) {
        const auto some = rays_at(scene.flat(root, Times[t]), count / Times.size() + 1, away, seed++);
        for (size_t i = t, k = 0; i < count; i += Times.size())
            rays[i] = some[k++];
    }
    return rays;
}

// Nested: things that move in a level that moves, among others in one that stands still, in one that moves.
uint32_t make_nested(Moving& moving, unsigned seed) {
    Random random(seed);
    const uint32_t ball = moving.scene.add(a_ball());
    uint32_t page = ball;
    for (const bool moves : {true, true, false, true}) {
        std::vector<Placement> level{{at_random(random, 2, 0.5, true), ball}};
        for (int i = 0; i < 3; i++)
            if (moves)
                level.push_back(moving.along(random, Kinds[size_t(i) + 3], 4, 0.7, page));
            else
                level.push_back({at_random(random, 4, 0.7), page});
        page = moving.scene.add(level);
    }
    return page;
}

} // namespace

TEST(MovingInstances, AreWhereTheirTrianglesAre) {
    for (const Kind& kind : Kinds) {
        Moving moving;
        const uint32_t ball = moving.scene.add(a_ball());
        Random random(21);
        std::vector<Placement> level;
        for (int i = 0; i < 40; i++)
            level.push_back(i % 4 == 3 ? Placement{at_random(random, 8, 1), ball}
                                       : moving.along(random, kind, 8, 1, ball));
        const uint32_t root = moving.scene.add(level);
        EXPECT_TRUE(moving.scene.world.moves());
        const auto rays = rays_of_times(moving.scene, root, 1500, 6, 22);
        const Compared c = expect_as_brute_force(moving.scene, root, rays, 12, 3e-6, times_of(rays.size()));
        EXPECT_GT(c.found, 1000u) << &kind - Kinds;
    }
}

TEST(MovingInstances, LieInInstancesThatMove) {
    Moving moving;
    const uint32_t root = make_nested(moving, 23);
    const auto rays = rays_of_times(moving.scene, root, 1800, 3, 24);
    const Compared c = expect_as_brute_force(moving.scene, root, rays, 8, 5e-6, times_of(rays.size()));
    EXPECT_GT(c.found, 1000u);
}

namespace {

Placement standing(const Placement& p, float time) {
    if (!p.path)
        return p;
    float rows[12];
    p.path->at(double(time), rows);
    Placement still{{}, p.page};
    for (size_t k = 0; k < 12; k++)
        still.world_from_page.m[k / 4][k % 4] = double(rows[k]);
    return still;
}

// One ray, one instance and one child at a time.
void trace_by_one_lane(const Scene& scene, uint32_t page, const Ray& ray, float time,
                       const InstancePath& path, InstanceHit& best) {
    if (scene.things[page]) {
        Ray r = ray;
        r.t_max = std::min(r.t_max, best.hit.t);
        const Hit hit = Oracle(scene.world.page(page)).closest(r);
        if (hit.found() && (hit.t < best.hit.t || path < best.path))
            best = {hit, path};
        return;
    }
    for (uint32_t i = 0; i < scene.placements[page].size(); i++) {
        const Placement p = standing(scene.placements[page][i], time);
        InstancePath inner = path;
        inner.instance[inner.depth++] = i;
        std::array<float, 12> rows;
        for (size_t k = 0; k < 12; k++)
            rows[k] = float(p.world_from_page.m[k / 4][k % 4]);
        if (const PageFromWorld inward(rows.data()); inward.is_held())
            trace_by_one_lane(scene, p.page, inward.inner(ray, ray.t_max), time, inner, best);
    }
}

} // namespace

TEST(MovingInstances, OneLaneFindsTheSameBits) {
    Moving moving;
    const uint32_t root = make_nested(moving, 25);
    const auto rays = rays_of_times(moving.scene, root, 3000, 3, 26);
    const auto times = times_of(rays.size());
    std::vector<InstanceHit> hits(rays.size());
    EverythingIsThere everything;
    find_closest<8>(moving.scene.world, root, rays, hits, everything, times);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        InstanceHit one;
        trace_by_one_lane(moving.scene, root, rays[i], times[i], {}, one);
        ASSERT_EQ(hits[i], one) << "ray " << i;
        found += one.hit.found();
    }
    EXPECT_GT(found, 1500u);
}

TEST(MovingInstances, StandWhereOthersStandToTheBit) {
    for (const float time : Times) {
        Moving moving;
        const uint32_t root = make_nested(moving, 27);
        Scene still;
        for (size_t page = 0; page <= root; page++) {
            if (moving.scene.things[page]) {
                still.add(*moving.scene.things[page]);
                continue;
            }
            std::vector<Placement> level = moving.scene.placements[page];
            for (Placement& p : level)
                p = standing(p, time);
            still.add(level);
        }
        EXPECT_FALSE(still.world.moves());
        const auto rays = rays_at(still.flat(root), 5000, 3, 28);
        std::vector<InstanceHit> a(rays.size()), b(rays.size());
        EverythingIsThere everything;
        find_closest<8>(moving.scene.world, root, rays, a, everything, std::vector<float>(rays.size(), time));
        find_closest<8>(still.world, root, rays, b, everything);
        EXPECT_EQ(a, b) << time;
    }
}

namespace {

// Every other instance of the innermost level is not there.
struct EveryOther {
    static constexpr bool Filters = true;
    bool accepts(const Candidate& c) const { return c.path.instance[c.path.depth - 1] % 2 == 0; }
};

} // namespace

TEST(MovingInstances, FiltersAreToldWhereTheyAre) {
    Moving moving;
    Scene half;
    const uint32_t ball = moving.scene.add(a_ball());
    half.add(a_ball());
    Random random(29);
    std::vector<Placement> inner, outer;
    for (int i = 0; i < 10; i++)
        inner.push_back(moving.along(random, Kinds[i % 6], 3, 0.8, ball));
    const uint32_t level = moving.scene.add(inner);
    for (size_t i = 1; i < inner.size(); i += 2)
        inner[i] = {Transform::scale(0, 0, 0), ball}; // left out
    half.add(inner);
    for (int i = 0; i < 5; i++)
        outer.push_back(moving.along(random, Kinds[i], 5, 1, level));
    const uint32_t root = moving.scene.add(outer);
    half.add(outer);
    const auto rays = rays_of_times(moving.scene, root, 3000, 4, 30);
    const auto times = times_of(rays.size());
    EveryOther other;
    EverythingIsThere everything;
    std::vector<InstanceHit> filtered(rays.size()), left(rays.size());
    std::vector<uint8_t> hidden(rays.size());
    find_closest<8>(moving.scene.world, root, rays, filtered, other, times);
    find_any<8>(moving.scene.world, root, rays, hidden, other, times);
    find_closest<8>(half.world, root, rays, left, everything, times);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        EXPECT_EQ(filtered[i], left[i]) << "ray " << i;
        EXPECT_EQ(hidden[i] != 0, left[i].hit.found()) << "ray " << i;
        found += left[i].hit.found();
    }
    EXPECT_GT(found, 1000u);
}

TEST(MovingInstances, ThatAreNowhereAtSomeTime) {
    Scene scene;
    const uint32_t ball = scene.add(a_ball());
    Transform nan;
    nan.m[0][3] = NAN;
    const std::vector<TransformKey> keys[] = {
        {{0, Transform::translate(0, 0, 1e20)}, {1, Transform()}},
        {{0, Transform()}, {1, nan}},
        {{0, Transform::scale(0, 0, 0)}, {1, Transform::translate(0, 0, 8)}},
        {{0.3, Transform::translate(0, 9, 0)}},
        {{-1, Transform::translate(9, 0, 0)}, {2, Transform::translate(12, 0, 0)}}};
    std::vector<MotionPath> paths;
    for (const auto& k : keys)
        paths.emplace_back(k);
    const Placements runs[] = {{.page = ball, .paths = paths}};
    const uint32_t root = scene.world.add(runs);
    EXPECT_EQ(scene.world.left_out(), 2u);
    const Vec3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    const std::vector<Ray> rays{{{0, 0.1f, -9}, 0, z}, {{0, 0.1f, -9}, 0, z}, {{0, 0.1f, -9}, 0, z},
                                {{0, 0, 0.1f}, 0, y},  {{0, 0, 0.1f}, 0, y},  {{0, 0, 0.1f}, 0, x},
                                {{0, 0, 0.1f}, 0, x},  {{0, 0, 0.1f}, 0, x}};
    const std::vector<float> times{0, 0.5f, 1, 0, 1, -5, 0, NAN};
    const uint32_t expected[] = {~0u, 2, 2, 3, 3, 4, 4, 4};
    std::vector<InstanceHit> hits(rays.size());
    EverythingIsThere everything;
    find_closest<8>(scene.world, root, rays, hits, everything, times);
    for (size_t i = 0; i < rays.size(); i++) {
        ASSERT_EQ(hits[i].hit.found(), expected[i] != ~0u) << i;
        if (hits[i].hit.found()) {
            EXPECT_EQ(hits[i].path.instance[0], expected[i]) << i;
        }
    }
    EXPECT_EQ(hits[5].hit.t, hits[6].hit.t);
    EXPECT_EQ(hits[5].hit.t, hits[7].hit.t);
}

TEST(MovingInstances, AreTheSameForAnyNumberOfThreads) {
    Random random(31);
    std::vector<MotionPath> paths;
    for (int i = 0; i < 5000; i++)
        paths.push_back(path_of(at_random(random, 60, 1), 2, i % 3 == 0 ? turning : translating));
    std::vector<float> matrices;
    for (int i = 0; i < 2000; i++) {
        const Transform t = at_random(random, 60, 1);
        for (size_t k = 0; k < 12; k++)
            matrices.push_back(float(t.m[k / 4][k % 4]));
    }
    std::vector<Ray> rays(20000);
    std::vector<float> times(rays.size());
    for (size_t i = 0; i < rays.size(); i++)
        rays[i].o = random.in_box(60), rays[i].d = random.direction(), times[i] = random.uniform();
    std::vector<InstanceHit> first;
    std::vector<std::byte> nodes;
    for (const size_t threads : {1, 2, 3}) {
        const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                                threads);
        World world;
        const uint32_t ball = world.add(a_ball().memory.page());
        const Placements runs[] = {{.page = ball, .world_from_page = matrices},
                                   {.page = ball, .paths = paths}};
        const uint32_t root = world.add(runs);
        std::vector<InstanceHit> hits(rays.size());
        EverythingIsThere everything;
        find_closest<8>(world, root, rays, hits, everything, times);
        const Header& h = world.page(root).header();
        const std::byte* bytes = reinterpret_cast<const std::byte*>(world.page(root).bytes());
        const std::vector<std::byte> own(bytes + h.nodes, bytes + h.nodes + h.node_bytes);
        if (first.empty())
            first = hits, nodes = own;
        EXPECT_EQ(hits, first);
        EXPECT_EQ(own, nodes);
    }
}

} // namespace kanuka::hierarchy::testing
