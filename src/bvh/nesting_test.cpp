// Groups in groups in one place: what rays enter is bounded. The oracle walks all boxes that a ray meets, in
// doubles, without any tree.
#include "bvh/nesting.h"

#include <gtest/gtest.h>

#include "bvh/test_geometry.h"

namespace kanuka::bvh {
namespace {

using namespace testing;

std::vector<float> rows(const Transform& t) {
    std::vector<float> m;
    for (size_t r = 0; r < 3; r++)
        for (size_t c = 0; c < 4; c++)
            m.push_back(float(t.m[r][c]));
    return m;
}

void place(GroupDesc& group, int child, const std::vector<Transform>& all,
           std::vector<std::vector<float>>& room) {
    std::vector<float> t;
    for (const Transform& one : all)
        for (const float x : rows(one))
            t.push_back(x);
    room.push_back(std::move(t));
    group.instances.push_back({child, room.back()});
}

struct Box {
    double lo[3] = {1e30, 1e30, 1e30}, hi[3] = {-1e30, -1e30, -1e30};
    void add(double x, double y, double z) {
        const double p[3] = {x, y, z};
        for (int c = 0; c < 3; c++)
            lo[c] = std::min(lo[c], p[c]), hi[c] = std::max(hi[c], p[c]);
    }
};

// Counts the instances whose boxes a ray meets, level by level.
class Walk {
  public:
    Walk(const std::vector<GroupDesc>& groups, const Box& leaf, uint64_t most)
        : m_groups(groups), m_boxes(groups.size()), m_most(most) {
        for (size_t g = 0; g < groups.size(); g++) {
            if (!groups[g].shapes.empty())
                m_boxes[g] = leaf;
            for (const auto& in : groups[g].instances)
                for (size_t i = 0; i < in.places.size(); i++) {
                    const auto rows = in.places[i];
                    const Box& b = m_boxes[size_t(in.group)];
                    for (int k = 0; k < 8; k++) {
                        const double p[3] = {k & 1 ? b.hi[0] : b.lo[0], k & 2 ? b.hi[1] : b.lo[1],
                                             k & 4 ? b.hi[2] : b.lo[2]};
                        double q[3];
                        for (size_t r = 0; r < 3; r++) {
                            const float* m = rows.data() + 4 * r;
                            q[r] = double(m[0]) * p[0] + double(m[1]) * p[1] + double(m[2]) * p[2] +
                                   double(m[3]);
                        }
                        m_boxes[g].add(q[0], q[1], q[2]);
                    }
                }
        }
    }
    uint64_t entered(const Point& o, const Point& d) {
        m_count = 0;
        walk(m_groups.size() - 1, o, d);
        return m_count;
    }

  private:
    static bool meets(const Box& b, const Point& o, const Point& d) {
        double from = 0, to = 1e30;
        const double os[3] = {o.x, o.y, o.z}, ds[3] = {d.x, d.y, d.z};
        for (int c = 0; c < 3; c++) {
            const double a = (b.lo[c] - os[c]) / ds[c], e = (b.hi[c] - os[c]) / ds[c];
            from = std::max(from, std::min(a, e)), to = std::min(to, std::max(a, e));
        }
        return from <= to;
    }
    void walk(size_t g, const Point& o, const Point& d) {
        for (const auto& in : m_groups[g].instances)
            for (size_t i = 0; i < in.places.size() && m_count < m_most; i++) {
                const auto rows = in.places[i];
                Transform t;
                for (size_t k = 0; k < 12; k++)
                    t.m[k / 4][k % 4] = double(rows[k]);
                const Transform back = t.inverse();
                const auto apply = [&](const Point& p, double w) {
                    double q[3];
                    for (size_t r = 0; r < 3; r++)
                        q[r] =
                            back.m[r][0] * p.x + back.m[r][1] * p.y + back.m[r][2] * p.z + back.m[r][3] * w;
                    return Point(q[0], q[1], q[2]);
                };
                const Point inner_o = apply(o, 1), inner_d = apply(d, 0);
                if (!meets(m_boxes[size_t(in.group)], inner_o, inner_d))
                    continue;
                m_count++;
                walk(size_t(in.group), inner_o, inner_d);
            }
    }
    const std::vector<GroupDesc>& m_groups;
    std::vector<Box> m_boxes;
    const uint64_t m_most;
    uint64_t m_count = 0;
};

const Box Unit = [] {
    Box b;
    b.add(-1, -1, -1), b.add(1, 1, 1);
    return b;
}();

// `levels` groups over one ball, each holding `copies` of the one below; the world holds the last.
struct Nest {
    Shapes shapes;
    std::vector<std::vector<float>> room;
    std::vector<GroupDesc> groups;
    template <class Place>
    Nest(int levels, int copies, Place at) {
        shapes.add_sphere({0, 0, 0}, 1, 8);
        groups.resize(size_t(levels) + 2);
        groups[0].shapes.push_back({0, 1});
        for (int l = 1; l <= levels; l++) {
            std::vector<Transform> all;
            for (int c = 0; c < copies; c++)
                all.push_back(at(l, c));
            place(groups[size_t(l)], l - 1, all, room);
        }
        place(groups.back(), levels, {Transform()}, room);
    }
    uint64_t most_entered(uint64_t limit) {
        Walk walk(groups, Unit, limit);
        uint64_t most = 0;
        for (const Ray& ray : random_rays(64, 0.5f, 7))
            most = std::max(most, walk.entered(Point(ray.o), Point(ray.d)));
        return most;
    }
};

} // namespace

TEST(Nesting, CopiesInOnePlaceAreOne) {
    for (const int levels : {3, 14, 60}) {
        Nest nest(levels, 2, [](int, int) { return Transform(); });
        const Nesting n = bound_nesting(nest.shapes.store, nest.groups, nest.room);
        EXPECT_EQ(n.merged, uint64_t(levels));
        EXPECT_EQ(n.left_out + n.too_deep, 0u);
        EXPECT_LE(nest.most_entered(1000), 1u);
        const Scene scene(nest.shapes.store, nest.groups, {.pages_from = 0});
        const auto hit = intersect<8>(scene, {{{0.1f, 0.2f, 5}, {0, 0, -1}}})[0];
        ASSERT_TRUE(hit.hit);
        EXPECT_NEAR(hit.t, 5 - std::sqrt(0.95f), 0.03f);
    }
}

TEST(Nesting, ChainsAreOneLevel) {
    const auto turn = [](int l, int) {
        return Transform::translate(0.01 * l, 0, -0.02) * Transform::rotate(13 * l, 1, l, 2);
    };
    Nest nest(40, 1, turn);
    const Nesting n = bound_nesting(nest.shapes.store, nest.groups, nest.room);
    EXPECT_EQ(n.merged + n.left_out + n.too_deep, 0u);
    ASSERT_EQ(nest.groups.back().instances.size(), 1u);
    EXPECT_EQ(nest.groups.back().instances[0].group, 0);
    Transform whole;
    for (int l = 40; l >= 1; l--)
        whole = whole * turn(l, 0);
    for (size_t k = 0; k < 12; k++)
        EXPECT_NEAR(nest.groups.back().instances[0].places[0][k], whole.m[k / 4][k % 4], 2e-5);
    EXPECT_EQ(bound_nesting(nest.shapes.store, nest.groups, nest.room).merged, 0u);
}

TEST(Nesting, WhatOverlapsAtEveryLevelIsBounded) {
    const auto near = [](int l, int c) { return Transform::rotate(7 * c + 3 * l, 1, c, 1); };
    for (const auto& [levels, copies] : {std::pair{15, 2}, {12, 3}, {15, 5}}) {
        Nest nest(levels, copies, near);
        constexpr uint64_t Plenty = 20000;
        EXPECT_GE(nest.most_entered(Plenty), Plenty);
        const Nesting n = bound_nesting(nest.shapes.store, nest.groups, nest.room);
        EXPECT_GT(n.left_out, 0u);
        EXPECT_LE(n.entered, 2 * MostEntered);
        EXPECT_LE(nest.most_entered(Plenty), uint64_t(2 * MostEntered));
        EXPECT_GE(nest.most_entered(Plenty), uint64_t(MostEntered / 8)); // no more than needed
        EXPECT_EQ(bound_nesting(nest.shapes.store, nest.groups, nest.room).left_out, 0u);
        const Scene scene(nest.shapes.store, nest.groups, {.pages_from = 0});
        EXPECT_TRUE(intersect<8>(scene, {{{0.1f, 0.2f, 5}, {0, 0, -1}}})[0].hit);
    }
}

// Deeper than rays follow, with something at every level: what is lost is counted.
TEST(Nesting, TooDeepIsCounted) {
    Nest nest(30, 2, [](int l, int c) { return Transform::translate(3.0 * c * l, 0, 0); });
    const Nesting n = bound_nesting(nest.shapes.store, nest.groups, nest.room);
    EXPECT_GT(n.too_deep, 0u);
}

// A wood of a million leaves: they lie side by side, and none is left out.
TEST(Nesting, CrowdsAreKept) {
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 4);
    std::vector<std::vector<float>> room;
    std::vector<GroupDesc> groups(3);
    groups[0].shapes.push_back({0, 1});
    std::mt19937 g(5);
    std::uniform_real_distribution<double> u(-30, 30);
    std::vector<Transform> leaves, trees;
    for (int i = 0; i < 1000; i++)
        leaves.push_back(Transform::translate(u(g), u(g), u(g)));
    for (int i = 0; i < 1000; i++)
        trees.push_back(Transform::translate(40 * (i % 32), 40 * (i / 32), 0));
    place(groups[1], 0, leaves, room);
    place(groups[2], 1, trees, room);
    const Nesting n = bound_nesting(shapes.store, groups, room);
    EXPECT_EQ(n.merged + n.left_out + n.too_deep, 0u);
    EXPECT_EQ(groups[2].instances[0].places.size(), 1000u);
    EXPECT_GT(n.entered, 1);
    EXPECT_LT(n.entered, 200);
}

} // namespace kanuka::bvh
