// Clusters of instances: each instance once, boxes that hold what they say, no ray that misses a box it goes
// through.
#include "bvh/clusters.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <set>

#include "base/tasks.h"

namespace kanuka::bvh {
namespace {

const Bounds3f Child{{-1, -2, -0.5f}, {1.5f, 1, 3}};

// Turned about y, of many sizes, over a plane.
std::vector<float> forest(size_t count, float spread) {
    std::mt19937 g(3);
    std::uniform_real_distribution<float> u(0, 1);
    std::vector<float> all;
    for (size_t i = 0; i < count; i++) {
        const float size = 0.1f * std::exp(3 * u(g)), c = std::cos(6.28f * u(g)) * size,
                    s = std::sqrt(std::max(0.0f, size * size - c * c));
        const float m[12] = {c, 0, s, spread * u(g), 0, size, 0, u(g), -s, 0, c, spread * u(g)};
        all.insert(all.end(), m, m + 12);
    }
    return all;
}

struct Box {
    double lo[3], hi[3];
};
Box box_of(const float* m) {
    Box b{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
    for (int k = 0; k < 8; k++)
        for (int r = 0; r < 3; r++) {
            const double p[3] = {k & 1 ? Child.hi.x : Child.lo.x, k & 2 ? Child.hi.y : Child.lo.y,
                                 k & 4 ? Child.hi.z : Child.lo.z};
            const float* row = m + 4 * r;
            const double x = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + double(row[3]);
            b.lo[r] = std::min(b.lo[r], x), b.hi[r] = std::max(b.hi[r], x);
        }
    return b;
}

// The others are elsewhere.
uint32_t meet_as_one_of_eight(const Cluster& c, const RTCRay& ray, int at) {
    RTCRay8 eight{};
    std::fill_n(eight.tfar, 8, -1.0f);
    eight.org_x[at] = ray.org_x, eight.org_y[at] = ray.org_y, eight.org_z[at] = ray.org_z;
    eight.dir_x[at] = ray.dir_x, eight.dir_y[at] = ray.dir_y, eight.dir_z[at] = ray.dir_z;
    eight.tnear[at] = ray.tnear, eight.tfar[at] = ray.tfar;
    float entry[Cluster::Size][8];
    const uint32_t met = ClusterBoxes(c).meet_eight(reinterpret_cast<RTCRayN*>(&eight), entry);
    uint32_t boxes = 0;
    for (int k = 0; k < Cluster::Size; k++)
        boxes |= (met >> (8 * k + at) & 1) << k;
    return boxes;
}

} // namespace

TEST(Clusters, EveryInstanceIsInOneAndInItsBox) {
    for (const size_t count : {size_t(1), size_t(2), size_t(5), size_t(4096), size_t(20001)})
        for (const float spread : {0.0f, 30.0f, 1e5f}) {
            const std::vector<float> m = forest(count, spread);
            std::vector<int> seen(count, 0);
            const auto all = cluster_instances(m, Child);
            for (const Cluster& c : all)
                for (int k = 0; k < Cluster::Size; k++) {
                    if (c.instance[k] == Cluster::None)
                        continue;
                    seen[c.instance[k]]++;
                    const Box b = box_of(m.data() + 12 * size_t(c.instance[k]));
                    const Bounds3f box = c.box(k), bounds = c.bounds();
                    for (int a = 0; a < 3; a++) {
                        const double most = 2e-6 * std::max(std::abs(b.lo[a]), std::abs(b.hi[a])) +
                                            double(bounds.hi[a] - bounds.lo[a]) / 254;
                        ASSERT_LE(double(box.lo[a]), b.lo[a]);
                        ASSERT_GE(double(box.hi[a]), b.hi[a]);
                        ASSERT_GE(double(box.lo[a]), b.lo[a] - most);
                        ASSERT_LE(double(box.hi[a]), b.hi[a] + most);
                        ASSERT_LE(bounds.lo[a], box.lo[a]);
                        ASSERT_GE(bounds.hi[a], box.hi[a]);
                    }
                }
            EXPECT_EQ(std::set<int>(seen.begin(), seen.end()), std::set<int>{1});
            if (count > 1000) {
                EXPECT_LT(all.size(), count / 2) << spread;
            }
        }
}

// Two towns far apart: no cluster joins them.
TEST(Clusters, NoneReachesFromOneTownToTheOther) {
    std::vector<float> m = forest(1001, 10);
    for (size_t i = 0; i < m.size(); i += 24)
        m[i + 3] += 1e4f;
    for (const Cluster& c : cluster_instances(m, Child))
        EXPECT_LT(c.bounds().hi.x - c.bounds().lo.x, 100);
}

TEST(Clusters, WhatCannotBeHitIsLeftOut) {
    const float bad[][12] = {{1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0},        // flat
                             {0, 0, 0, 5, 0, 0, 0, 5, 0, 0, 0, 5},        // a point
                             {1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0},      // nowhere
                             {1, 0, 0, INFINITY, 0, 1, 0, 0, 0, 0, 1, 0}, // endless
                             {1, 0, 0, 1e19f, 0, 1, 0, 0, 0, 0, 1, 0}};   // further than rays go
    std::vector<float> m = forest(7, 5);
    for (const auto& b : bad)
        m.insert(m.end(), b, b + 12);
    const std::vector<float> more = forest(2, 5);
    m.insert(m.end(), more.begin(), more.end());
    std::set<uint32_t> seen;
    for (const Cluster& c : cluster_instances(m, Child))
        for (const uint32_t i : c.instance)
            if (i != Cluster::None)
                seen.insert(i);
    EXPECT_EQ(seen, (std::set<uint32_t>{0, 1, 2, 3, 4, 5, 6, 12, 13}));
    EXPECT_TRUE(cluster_instances(m, Bounds3f()).empty());
    EXPECT_TRUE(cluster_instances({}, Child).empty());
}

TEST(Clusters, AreTheSameForAnyThreads) {
    const std::vector<float> m = forest(30000, 100);
    LargeVector<Cluster> of[2];
    for (int threads : {1, 3})
        tasks::with_threads(threads, [&] { of[threads == 3] = cluster_instances(m, Child); });
    ASSERT_EQ(of[0].size(), of[1].size());
    EXPECT_EQ(std::memcmp(of[0].data(), of[1].data(), of[0].size() * sizeof(Cluster)), 0);
}

// Slabs in doubles: what they say is hit is met, and little else.
TEST(Clusters, RaysMeetTheBoxesThatTheyGoThrough) {
    std::mt19937 g(5);
    std::uniform_real_distribution<float> u(-1, 1);
    int through = 0, more = 0, tests = 0;
    for (const float size : {1e-4f, 1.0f, 1e4f}) {
        std::vector<float> m = forest(4000, 20);
        for (float& x : m)
            x *= size;
        for (const Cluster& c : cluster_instances(m, Child))
            for (int n = 0; n < 20; n++) {
                RTCRay ray{};
                const Vec3f lo = c.bounds().lo, extent = c.bounds().hi - lo;
                float o[3], d[3];
                for (int a = 0; a < 3; a++) {
                    o[a] = lo[a] + extent[a] * (0.5f + u(g));
                    d[a] = a > 0 && u(g) < -0.7f ? 0.0f : u(g); // along the x axis, too
                }
                ray.org_x = o[0], ray.org_y = o[1], ray.org_z = o[2];
                ray.dir_x = d[0], ray.dir_y = d[1], ray.dir_z = d[2];
                ray.tnear = 0, ray.tfar = n % 3 ? INFINITY : extent.x * 0.5f;
                float entry[Cluster::Size];
                const uint32_t met = ClusterBoxes(c).meet(ray, entry);
                ASSERT_EQ(meet_as_one_of_eight(c, ray, n % 8), met);
                for (int k = 0; k < Cluster::Size; k++) {
                    if (c.instance[k] == Cluster::None) {
                        ASSERT_FALSE(met >> k & 1);
                        continue;
                    }
                    const Bounds3f box = c.box(k);
                    double enter = ray.tnear, leave = double(ray.tfar);
                    for (int a = 0; a < 3; a++) {
                        if (d[a] == 0 && o[a] >= box.lo[a] && o[a] <= box.hi[a])
                            continue;
                        const double p = (double(box.lo[a]) - o[a]) / d[a],
                                     q = (double(box.hi[a]) - o[a]) / d[a];
                        enter = std::max(enter, std::min(p, q)), leave = std::min(leave, std::max(p, q));
                    }
                    const bool inside = enter <= leave && std::isfinite(enter);
                    tests++, through += inside, more += !inside && (met >> k & 1);
                    if (inside) {
                        ASSERT_TRUE(met >> k & 1);
                        ASSERT_NEAR(double(entry[k]), enter, 1e-6 * enter);
                    }
                }
            }
    }
    EXPECT_GT(through, tests / 20);
    EXPECT_LE(more, through / 10000);
}

} // namespace kanuka::bvh
