#include "bvh/watch.h"

#include <gtest/gtest.h>

#include "base/sampling.h"
#include "base/tasks.h"

namespace kanuka::bvh {

namespace {

Bounds3f box(float x, float y, float z, float half = 0.5f) {
    Bounds3f b;
    b.extend(Vec3f(x - half, y - half, z - half));
    b.extend(Vec3f(x + half, y + half, z + half));
    return b;
}

using Noted = std::vector<uint32_t>;

} // namespace

TEST(Watch, TheFirstBoxesOnTheWayAreNoted) {
    const std::vector<Bounds3f> row{box(9, 0, 0), box(3, 0, 0), box(6, 0, 0), box(3, 5, 0)};
    Watch watch(row);
    const uint64_t before = watch.noted_here();
    watch.look({0, 0, 0}, {1, 0, 0}, 0, 100);
    EXPECT_EQ(watch.noted_here(), before + 1);
    EXPECT_EQ(watch.take(), Noted({1}));
    EXPECT_EQ(watch.take(), Noted());
    watch.set_reach(2);
    watch.look({0, 0, 0}, {1, 0, 0}, 0, 100);
    EXPECT_EQ(watch.take(), Noted({1, 2}));
    watch.leave_out(1);
    watch.look({0, 0, 0}, {1, 0, 0}, 0, 100);
    EXPECT_EQ(watch.take(), Noted({0, 2}));
}

TEST(Watch, RaysEndAtTheirHits) {
    const std::vector<Bounds3f> row{box(3, 0, 0), box(6, 0, 0)};
    Watch watch(row);
    watch.set_reach(8);
    watch.look({0, 0, 0}, {1, 0, 0}, 0, 2.4f);
    EXPECT_EQ(watch.take(), Noted());
    watch.look({0, 0, 0}, {1, 0, 0}, 0, 2.6f);
    EXPECT_EQ(watch.take(), Noted({0}));
    watch.look({0, 0, 0}, {1, 0, 0}, 4, 10);
    EXPECT_EQ(watch.take(), Noted({1}));
    watch.look({0, 0, 0}, {-1, 0, 0}, 0, 100);
    EXPECT_EQ(watch.take(), Noted());
}

TEST(Watch, BoxesThatARayStartsInAreAllNoted) {
    const std::vector<Bounds3f> nested{box(0, 0, 0, 1), box(0, 0, 0, 2), box(0, 0, 0, 3), box(9, 0, 0)};
    Watch watch(nested);
    watch.look({0, 0, 0}, {0, 1, 0}, 0, 100);
    EXPECT_EQ(watch.take(), Noted({0, 1, 2}));
}

TEST(Watch, BoundsWithoutEndAreMetByAnyRay) {
    Bounds3f endless;
    endless.extend(Vec3f(-1e30f, -1e30f, -1e30f));
    endless.extend(Vec3f(1e30f, 1e30f, 1e30f));
    const std::vector<Bounds3f> boxes{endless, Bounds3f()};
    Watch watch(boxes);
    watch.look({5, 6, 7}, {0, 0, 1}, 0, 1);
    EXPECT_EQ(watch.take(), Noted({0, 1}));
}

// Against every box by itself; from many threads at once.
TEST(Watch, NothingIsMissed) {
    std::vector<Bounds3f> boxes;
    uint32_t state = 1;
    const auto next = [&] {
        state = state * 1664525u + 1013904223u;
        return float(state >> 8) / float(1 << 24);
    };
    for (int i = 0; i < 500; i++)
        boxes.push_back(box(20 * next(), 20 * next(), 20 * next(), 0.2f + next()));
    Watch watch(boxes);
    watch.set_reach(1000);
    std::vector<Vec3f> o, d;
    for (int i = 0; i < 64; i++) {
        o.push_back({-1, 20 * next(), 20 * next()});
        d.push_back({1, next() - 0.5f, next() - 0.5f});
    }
    tasks::parallel_for(o.size(), [&](size_t i) { watch.look(o[i], d[i], 0, 1e6f); });
    Noted expected;
    for (uint32_t b = 0; b < boxes.size(); b++)
        for (size_t i = 0; i < o.size(); i++) {
            float from = 0, to = 1e6f;
            for (int c = 0; c < 3; c++) {
                float a = (boxes[b].lo[c] - o[i][c]) / d[i][c], z = (boxes[b].hi[c] - o[i][c]) / d[i][c];
                from = std::max(from, std::min(a, z)), to = std::min(to, std::max(a, z));
            }
            if (from <= to) {
                expected.push_back(b);
                break;
            }
        }
    EXPECT_EQ(watch.take(), expected);
    EXPECT_GT(expected.size(), 50u);
}

} // namespace kanuka::bvh
