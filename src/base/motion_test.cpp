#include <gtest/gtest.h>
#include <random>

#include "base/motion.h"

namespace kanuka {
namespace {

constexpr double Degree = 3.14159265358979323846 / 180;

void expect_near(const Transform& a, const Transform& b, double tolerance) {
    for (size_t i = 0; i < 4; i++)
        for (size_t j = 0; j < 4; j++)
            EXPECT_NEAR(a.m[i][j], b.m[i][j], tolerance) << i << "," << j;
}

} // namespace

TEST(MotionPath, PassesThroughItsKeys) {
    const TransformKey keys[] = {
        {0, Transform::translate(1, 2, 3) * Transform::rotate(30, 1, 2, 3) * Transform::scale(1, 2, -3)},
        {0.25, Transform::rotate(170, 0, 1, 0) * Transform::scale(-1, 2, 3)},
        {2, Transform::translate(0, 0, 1e5) * Transform::rotate(-100, 1, 0, 1)},
    };
    const MotionPath path(keys);
    for (const TransformKey& k : keys)
        expect_near(path.at(k.time), k.transform, 1e-9);
    expect_near(path.at(-5), keys[0].transform, 1e-9); // it stands still before and after
    expect_near(path.at(5), keys[2].transform, 1e-9);
}

TEST(MotionPath, TurnsEvenly) {
    const TransformKey keys[] = {{0, Transform::translate(1, 0, 0)},
                                 {2, Transform::translate(3, 0, 0) * Transform::rotate(120, 1, 1, 1)}};
    const MotionPath path(keys);
    for (const double t : {0.3, 1.0, 1.9})
        expect_near(path.at(t), Transform::translate(1 + t, 0, 0) * Transform::rotate(60 * t, 1, 1, 1),
                    1e-12);
    EXPECT_NEAR(path.turning(), 120 * Degree, 1e-12);
}

// All the way to half a turn, to the last digits: cosines and sines of libraries are the oracle.
TEST(MotionPath, TurnsAsFarAsLibrariesSay) {
    for (const double degrees : {0.01, 1.0, 45.0, 90.0, 179.0, 179.99}) {
        const TransformKey keys[] = {{0, {}}, {1, Transform::rotate(degrees, 0, 0, 1)}};
        const MotionPath path(keys);
        for (int k = 0; k <= 1000; k++) {
            const Transform t = path.at(k * 1e-3);
            const double angle = degrees * Degree * (k * 1e-3);
            ASSERT_NEAR(t.m[0][0], std::cos(angle), 2e-15 * degrees + 4e-16) << degrees << " " << k;
            ASSERT_NEAR(t.m[1][0], std::sin(angle), 2e-15 * degrees + 4e-16) << degrees << " " << k;
        }
    }
}

TEST(MotionPath, StretchesLinearlyAndTakesTheShortWay) {
    const TransformKey grow[] = {{0, Transform::scale(1, 1, 1)}, {1, Transform::scale(3, 1, -1)}};
    expect_near(MotionPath(std::span(grow, 1)).at(0.5), Transform{}, 0);
    const TransformKey keys[] = {{0, Transform::rotate(170, 0, 0, 1)}, {1, Transform::rotate(-170, 0, 0, 1)}};
    expect_near(MotionPath(keys).at(0.5), Transform::rotate(180, 0, 0, 1), 1e-12);
    const TransformKey stretch[] = {{0, Transform::scale(1, 2, 3)}, {1, Transform::scale(3, 4, 5)}};
    expect_near(MotionPath(stretch).at(0.25), Transform::scale(1.5, 2.5, 3.5), 1e-12);
}

TEST(MotionPath, BeforeAndAfterStandStill) {
    const TransformKey keys[] = {{0, Transform::rotate(10, 0, 0, 1)}, {1, Transform::rotate(50, 0, 0, 1)}};
    const Transform before = Transform::translate(5, 0, 0), after = Transform::rotate(-10, 0, 0, 1);
    expect_near(MotionPath(keys, before, after).at(0.5), before * Transform::rotate(20, 0, 0, 1), 1e-12);
}

TEST(MotionPath, FlattenedKeysDoNotBreakIt) {
    const TransformKey keys[] = {{0, Transform::scale(0, 0, 0)}, {1, Transform::scale(2, 2, 2)}};
    expect_near(MotionPath(keys).at(0.5), Transform::scale(1, 1, 1), 1e-12);
}

// No corner of the box strays further from the straight and even way than is said, and the bound is no idle
// one.
TEST(MotionPath, BoundsItsArcs) {
    const TransformKey keys[] = {{0, Transform::translate(1, 0, 0) * Transform::scale(1, 2, 1)},
                                 {1, Transform::rotate(50, 1, 3, 2) * Transform::scale(2, 1, 1.5)}};
    const MotionPath path(keys, {}, Transform::translate(0.5, 0, 0));
    const Bounds3f box{{-1, -2, -1}, {1, 1, 3}};
    for (const auto& [t0, t1] : {std::pair{0.0, 1.0}, {0.25, 0.5}, {0.9, 1.0}}) {
        const double bound = path.deviation(t0, t1, box);
        double worst = 0;
        for (int k = 0; k < 8; k++) {
            const Vec3f c{k & 1 ? box.hi.x : box.lo.x, k & 2 ? box.hi.y : box.lo.y,
                          k & 4 ? box.hi.z : box.lo.z};
            const Vec3f a = path.at(t0).point(c), b = path.at(t1).point(c);
            for (double f = 0.05; f < 1; f += 0.05)
                worst = std::max(worst,
                                 double(length(path.at(t0 + (t1 - t0) * f).point(c) - lerp(float(f), a, b))));
        }
        EXPECT_LE(worst, bound);
        EXPECT_GE(worst, 0.3 * bound);
    }
}

TEST(Compose, AtAllTimesOfBoth) {
    const TransformKey outer[] = {{0, Transform::translate(0, 0, 0)}, {1, Transform::translate(2, 0, 0)}};
    const TransformKey inner[] = {{0.5, Transform::rotate(0, 0, 0, 1)}, {1, Transform::rotate(90, 0, 0, 1)}};
    const auto both = compose(outer, {}, inner, {});
    ASSERT_EQ(both.size(), 3u);
    EXPECT_EQ(both[1].time, 0.5);
    expect_near(both[0].transform, Transform{}, 1e-12);
    expect_near(both[1].transform, Transform::translate(1, 0, 0), 1e-12);
    expect_near(both[2].transform, Transform::translate(2, 0, 0) * Transform::rotate(90, 0, 0, 1), 0);
    EXPECT_EQ(compose(outer, {}, {}, Transform::scale(2, 2, 2))[1].transform,
              Transform::translate(2, 0, 0) * Transform::scale(2, 2, 2));
    EXPECT_TRUE(compose({}, {}, {}, {}).empty());
}

// What moves lies within the boxes wherever they are interpolated, and these are not much larger.
TEST(MotionPath, BoundsHoldWhatMoves) {
    std::mt19937 g(5);
    std::uniform_real_distribution<double> u(-1, 1);
    const Bounds3f box{{-1, 0.5f, -0.2f}, {2, 0.75f, 0.4f}};
    double worst = 0;
    for (int round = 0; round < 60; round++) {
        std::vector<TransformKey> keys;
        const int last = 1 + round % 4;
        for (int k = 0; k <= last; k++)
            keys.push_back({-0.1 + 1.3 * k / last, Transform::translate(9 * u(g), 9 * u(g), 9 * u(g)) *
                                                       Transform::rotate(170 * u(g), u(g), u(g), u(g)) *
                                                       Transform::scale(1 + u(g), 1, round % 2 ? -1 : 1)});
        const MotionPath path(keys, {}, Transform::translate(round % 3, 0, 0));
        std::vector<Bounds3f> boxes(size_t(path.times_to_bound(0.2)));
        path.bound(box, boxes);
        for (int i = 0; i <= 500; i++) {
            const double t = i / 500.0, x = t * double(boxes.size() - 1);
            const size_t k = std::min(size_t(x), boxes.size() - 2);
            const float f = float(x - double(k));
            Bounds3f now;
            for (int c = 0; c < 8; c++)
                now.extend(path.at(t).point(
                    {c & 1 ? box.hi.x : box.lo.x, c & 2 ? box.hi.y : box.lo.y, c & 4 ? box.hi.z : box.lo.z}));
            for (int a = 0; a < 3; a++) {
                const float lo = boxes[k].lo[a] + (boxes[k + 1].lo[a] - boxes[k].lo[a]) * f,
                            hi = boxes[k].hi[a] + (boxes[k + 1].hi[a] - boxes[k].hi[a]) * f;
                ASSERT_LE(lo, now.lo[a]) << round << " at " << t;
                ASSERT_GE(hi, now.hi[a]) << round << " at " << t;
                if (keys.size() == 2) // else bends lie between times
                    worst = std::max(worst, double(std::max(now.lo[a] - lo, hi - now.hi[a])));
            }
        }
    }
    EXPECT_LT(worst, 0.6); // of boxes of 3
}

} // namespace kanuka
