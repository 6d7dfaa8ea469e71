// Levels whose trees are used again: rays find in them, to the bit, what they find in levels that are made
// anew; and, beside brute force, what is there.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "hierarchy/test_instances.h"

namespace kanuka::hierarchy::testing {
namespace {

std::array<float, 12> rows_of(const Transform& t) {
    std::array<float, 12> m;
    for (size_t k = 0; k < 12; k++)
        m[k] = float(t.m[k / 4][k % 4]);
    return m;
}

// Balls that stand still, in two runs of which some rays do not see all; such that move; and a crowd of them
// in a crowd.
struct Crowd {
    std::vector<Transform> still, seen_by_some, inner;
    std::vector<LevelRange> seen;
    std::deque<MotionPath> paths;
    uint32_t page_of_still = 0;
    bool is_flat = false; // the first that stands still
    Random random{31};

    Crowd() {
        for (int i = 0; i < 60; i++)
            still.push_back(anywhere());
        for (int i = 0; i < 12; i++) {
            seen_by_some.push_back(anywhere());
            seen.push_back(range());
        }
        for (int i = 0; i < 8; i++)
            paths.push_back(way());
        for (int i = 0; i < 9; i++)
            inner.push_back(at_random(random, 2, 0.3, i % 2 == 0));
    }
    Transform anywhere() { return at_random(random, 10, 0.8, random.below(3) == 0); }
    LevelRange range() {
        const uint16_t from = uint16_t(random.below(40000));
        return {from, uint16_t(from + random.below(25000))};
    }
    MotionPath way() {
        const Transform start = anywhere();
        const Vec3f by = random.in_box(2);
        const TransformKey keys[] = {
            {0, start},
            {1, Transform::translate(double(by.x), double(by.y), double(by.z)) * start *
                    Transform::rotate(double(random.uniform(0, 90)), 1, 2, 3)}};
        return MotionPath(keys);
    }
    Transform nudge(float by) {
        const Vec3f p = random.in_box(by);
        return Transform::translate(double(p.x), double(p.y), double(p.z));
    }
    Transform& one() { return still[1 + random.below(uint32_t(still.size()) - 1)]; }

    static constexpr int Edits = 11;
    void edit(int which) {
        switch (which) {
        case 0:
            return void(one() = nudge(0.3f) * one());
        case 1:
            for (Transform& t : still)
                t = nudge(0.1f) * t;
            return;
        case 2:
            return std::swap(one(), one());
        case 3:
            return void(one() = Transform::translate(300, 0, 0) * one());
        case 4:
            return still.push_back(anywhere());
        case 5:
            return void(still.erase(still.begin() + 1 + random.below(uint32_t(still.size()) - 1)));
        case 6:
            return void(paths[random.below(uint32_t(paths.size()))] = way());
        case 7: // it stands still meanwhile, or moves again
            if (MotionPath& path = paths[random.below(uint32_t(paths.size()))]; path.moves())
                path = MotionPath(std::vector<TransformKey>{{0, anywhere()}});
            else
                path = way();
            return;
        case 8:
            page_of_still = 1 - page_of_still;
            return;
        case 9:
            return void(seen[random.below(uint32_t(seen.size()))] = range());
        case 10: // no ray can be taken there, or one can again
            still[0] = std::exchange(is_flat, !is_flat) ? anywhere() : Transform::scale(1, 0, 1);
            return;
        }
    }
};

const Thing& a_small_ball() {
    static const Thing thing(ball(1, 4, 0.6f, 0.1f, 5));
    return thing;
}

// A crowd as a world has it, from what another one has left or, if nothing has, anew.
struct Standing {
    World world;
    std::vector<float> still, seen_by_some, inner, groups;
    std::vector<LevelRange> seen;
    std::deque<MotionPath> paths; // deque: what it holds has one address
    std::vector<MotionPath> ways;
    uint32_t root = 0;

    static std::vector<float> flat(std::span<const Transform> all) {
        std::vector<float> rows;
        for (const Transform& t : all)
            for (const float v : rows_of(t))
                rows.push_back(v);
        return rows;
    }
    explicit Standing(const Crowd& crowd, std::vector<Level> before = {})
        : still(flat(crowd.still)), seen_by_some(flat(crowd.seen_by_some)), inner(flat(crowd.inner)),
          seen(crowd.seen), ways(crowd.paths.begin(), crowd.paths.end()) {
        before.resize(2);
        const uint32_t balls[] = {world.add(a_ball().memory.page()), world.add(a_small_ball().memory.page())};
        const std::vector<Placements> of_inner{{balls[1], Places(inner)}};
        const uint32_t group = world.add(of_inner, &before[0]);
        groups = flat(std::vector<Transform>{Transform::translate(0, 12, 0), Transform::translate(4, -9, 1)});
        const std::vector<Placements> runs{{balls[crowd.page_of_still], Places(still)},
                                           {balls[1], Places(seen_by_some), {}, seen},
                                           {balls[0], {}, ways},
                                           {group, Places(groups)}};
        root = world.add(runs, &before[1]);
    }
};

struct Asked {
    std::vector<Ray> rays;
    std::vector<float> times, levels;

    Asked(size_t count, Random& random) {
        for (size_t i = 0; i < count; i++) {
            const Vec3f at = random.in_box(10);
            Ray r;
            r.o = at + random.direction() * random.uniform(1, 30), r.d = at - r.o;
            rays.push_back(r);
            times.push_back(random.uniform()), levels.push_back(random.uniform());
        }
    }
};

struct Answers {
    std::vector<InstanceHit> closest;
    std::vector<uint8_t> any;
    bool operator==(const Answers&) const = default;

    Answers(const Standing& in, const Asked& asked) : closest(asked.rays.size()), any(asked.rays.size()) {
        EverythingIsThere all;
        RayQueue<8, Query::Closest, EverythingIsThere, MostNesting + 1>(in.world, in.root, asked.rays, all,
                                                                        asked.times, asked.levels)
            .run([&](size_t i, const Hit& h, const InstancePath& path) { closest[i] = {h, path}; });
        RayQueue<8, Query::Any, EverythingIsThere, MostNesting + 1>(in.world, in.root, asked.rays, all,
                                                                    asked.times, asked.levels)
            .run([&](size_t i, const Hit& h, const InstancePath&) { any[i] = h.found(); });
    }
};

} // namespace

TEST(RefittedLevels, FindWhatNewOnesFindAfterEdits) {
    Crowd crowd;
    auto standing = std::make_unique<Standing>(crowd);
    size_t refitted[Crowd::Edits] = {}, found = 0;
    for (int step = 0; step < 200; step++) {
        const int edit = step < 2 * Crowd::Edits ? step / 2 : int(crowd.random.below(Crowd::Edits));
        crowd.edit(edit);
        const Standing anew(crowd);
        standing = std::make_unique<Standing>(crowd, standing->world.take_levels());
        EXPECT_EQ(anew.world.refitted(), 0u);
        EXPECT_EQ(standing->world.left_out(), anew.world.left_out());
        refitted[edit] += standing->world.refitted() == 2;
        const Asked asked(500, crowd.random);
        const Answers answers(*standing, asked);
        ASSERT_EQ(answers, Answers(anew, asked)) << "step " << step << ", edit " << edit;
        for (size_t i = 0; i < asked.rays.size(); i++) {
            found += answers.closest[i].hit.found();
            EXPECT_EQ(answers.any[i] != 0, answers.closest[i].hit.found());
        }
    }
    EXPECT_GT(found, 10000u);
    for (const int edit : {0, 1, 9})
        EXPECT_GT(refitted[edit], 3u) << edit;
    for (const int edit : {4, 5, 10}) // others are there
        EXPECT_EQ(refitted[edit], 0u) << edit;
}

// Again and again, in small steps: boxes do not grow, and the tree is as good as a new one where all is where
// it was.
TEST(RefittedLevels, AreWhereTheirTrianglesAre) {
    Random random(41);
    std::vector<Transform> places;
    for (int i = 0; i < 60; i++)
        places.push_back(at_random(random, 8, 1, i % 3 == 0));
    std::vector<Level> left(1);
    for (int step = 0; step < 30; step++) {
        for (Transform& t : places) {
            const Vec3f by = random.in_box(0.05f);
            t = Transform::translate(double(by.x), double(by.y), double(by.z)) * t;
        }
        Scene scene;
        const uint32_t ball = scene.add(a_ball());
        const std::vector<float> rows = Standing::flat(places);
        const std::vector<Placements> runs{{ball, Places(rows)}};
        const uint32_t root = scene.world.add(runs, &left[0]);
        std::vector<Placement> as_floats;
        for (size_t i = 0; i < places.size(); i++) {
            Transform t;
            for (size_t k = 0; k < 12; k++)
                t.m[k / 4][k % 4] = double(rows[12 * i + k]);
            as_floats.push_back({t, ball});
        }
        scene.things.push_back(nullptr), scene.placements.push_back(as_floats);
        EXPECT_EQ(scene.world.refitted(), step == 0 ? 0u : 1u) << step;
        if (step % 6 == 5) {
            const auto rays = rays_at(scene.flat(root), 600, 6, unsigned(step));
            EXPECT_GT(expect_as_brute_force(scene, root, rays, 8, 2e-6).found, 300u);
        }
        left = scene.world.take_levels();
    }
}

// What has moved far makes rays meet more boxes: then there is another tree.
TEST(RefittedLevels, AreMadeAnewWhereBoxesGrow) {
    const auto scattered = [](unsigned seed) {
        Random random(seed);
        std::vector<Transform> all;
        for (int i = 0; i < 3000; i++)
            all.push_back(at_random(random, 60, 1));
        return all;
    };
    const std::vector<float> first = Standing::flat(scattered(1)), second = Standing::flat(scattered(2));
    const auto level = [](const std::vector<float>& rows, Level* before) {
        World world;
        const std::vector<Placements> runs{{world.add(a_ball().memory.page()), Places(rows)}};
        world.add(runs, before);
        const bool refitted = world.refitted() > 0;
        return std::pair(std::move(world.take_levels()[0]), refitted);
    };
    auto [before, none] = level(first, nullptr);
    EXPECT_FALSE(none);
    auto [same, kept] = level(first, &before);
    EXPECT_TRUE(kept);
    auto [other, also_kept] = level(second, &same);
    EXPECT_FALSE(also_kept);
    const auto anew = level(second, nullptr).first;
    EXPECT_TRUE(std::ranges::equal(other.memory.bytes(), anew.memory.bytes()));
}

TEST(RefittedLevels, HaveTheSameBytesForAnyNumberOfThreads) {
    Random random(43);
    std::vector<Transform> places;
    for (int i = 0; i < 50000; i++)
        places.push_back(at_random(random, 400, 1));
    const std::vector<float> before = Standing::flat(places);
    for (Transform& t : places)
        t = Transform::translate(0.1, 0, double(random.uniform(-0.1f, 0.1f))) * t;
    const std::vector<float> now = Standing::flat(places);
    std::vector<std::byte> first;
    for (const size_t threads : {1, 2, 3}) {
        const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                                threads);
        std::vector<Level> left(1);
        for (const std::vector<float>* rows : {&before, &now}) {
            World world;
            const std::vector<Placements> runs{{world.add(a_ball().memory.page()), Places(*rows)}};
            world.add(runs, &left[0]);
            EXPECT_EQ(world.refitted(), rows == &now ? 1u : 0u);
            left = world.take_levels();
        }
        const auto bytes = left[0].memory.bytes();
        if (first.empty())
            first.assign(bytes.begin(), bytes.end());
        EXPECT_TRUE(std::ranges::equal(bytes, first));
    }
}

} // namespace kanuka::hierarchy::testing
