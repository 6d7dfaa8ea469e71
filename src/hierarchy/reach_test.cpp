// Boxes around pages that stand turned, beside the vertices themselves in doubles: all are in them, and
// little else.
#include "hierarchy/reach.h"

#include <gtest/gtest.h>

#include "hierarchy/test_instances.h"

namespace kanuka::hierarchy::testing {
namespace {

struct Box {
    std::array<double, 3> lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};

    void extend(const Point& p) {
        const double at[] = {p.x, p.y, p.z};
        for (size_t a = 0; a < 3; a++)
            lo[a] = std::min(lo[a], at[a]), hi[a] = std::max(hi[a], at[a]);
    }
    double volume() const { return (hi[0] - lo[0]) * (hi[1] - lo[1]) * (hi[2] - lo[2]); }
};
Box around(const std::vector<Flat>& all) {
    Box box;
    for (const Flat& f : all)
        for (const Point& p : {f.a, f.b, f.c})
            box.extend(p);
    return box;
}
Box around(const Bounds3f& b) {
    Box box;
    for (int corner = 0; corner < 8; corner++)
        box.extend({double(corner & 1 ? b.hi.x : b.lo.x), double(corner & 2 ? b.hi.y : b.lo.y),
                    double(corner & 4 ? b.hi.z : b.lo.z)});
    return box;
}
Box around(const Bounds3f& b, const Transform& t) {
    Box box;
    for (int corner = 0; corner < 8; corner++)
        box.extend(moved(
            t, {corner & 1 ? b.hi.x : b.lo.x, corner & 2 ? b.hi.y : b.lo.y, corner & 4 ? b.hi.z : b.lo.z}));
    return box;
}
bool holds(const Box& box, const Box& inner) {
    bool all = true;
    for (size_t a = 0; a < 3; a++)
        all &= box.lo[a] <= inner.lo[a] && box.hi[a] >= inner.hi[a];
    return all;
}

// Turned, stretched and mirrored; of all sizes, and far away; along the axes, and flat along one of them.
Transform anywhere(Random& random, int round) {
    const double scale = std::exp2(double(random.uniform(-12, 12)));
    const float side = round % 5 == 0 ? 1e6f : 10.0f;
    const Transform t = at_random(random, side, scale, round % 2 == 0);
    if (round % 7 == 0)
        return product({Transform::translate(1, 2, 3), Transform::rotate(90.0 * (round % 4), 0, 1, 0),
                        Transform::scale(scale, scale, scale)});
    return round % 11 == 0 ? product({t, Transform::scale(1, 1e-6, 1)}) : t;
}

void expect_boxes_hold_all(const Scene& scene, uint32_t page) {
    const Reach reach(scene.world.page(page));
    Random random(5);
    for (int round = 0; round < 500; round++) {
        const Transform t = anywhere(random, round);
        std::vector<Flat> all;
        scene.list(page, t, 0, {}, all);
        ASSERT_TRUE(holds(around(reach.box(t)), around(all))) << "round " << round;
    }
}

} // namespace

TEST(Reach, HoldsAllOfAPage) {
    for (const Vec3f centre : {Vec3f(0.0f), Vec3f(3, -2, 5), Vec3f(2000, 0, -1000)})
        for (const int cells : {1, 4, 16}) {
            Scene scene;
            const Thing thing(ball(2, cells, 1, 0.25f, 4, centre));
            expect_boxes_hold_all(scene, scene.add(thing));
        }
}

TEST(Reach, HoldsAllOfALevel) {
    Scene scene;
    Random random(6);
    const Thing thing(ball(1, 4, 1, 0.25f, 4));
    std::vector<Placement> places;
    const uint32_t page = scene.add(thing);
    for (int i = 0; i < 40; i++)
        places.push_back({at_random(random, 4, 0.5, i % 3 == 0), page});
    expect_boxes_hold_all(scene, scene.add(places));
}

// Of what a turned box has beside a ball, more than half is not there.
TEST(Reach, HoldsLittleElse) {
    Scene scene;
    const Thing thing(ball(2, 16, 1, 0, 4));
    const uint32_t page = scene.add(thing);
    const Reach reach(scene.world.page(page));
    Random random(7);
    double beside = 0, beside_turned = 0;
    for (int round = 0; round < 100; round++) {
        const Transform t = at_random(random, 10, 1);
        std::vector<Flat> all;
        scene.list(page, t, 0, {}, all);
        const double exact = around(all).volume();
        beside += around(reach.box(t)).volume() / exact - 1;
        beside_turned += around(scene.world.page(page).bounds(), t).volume() / exact - 1;
    }
    EXPECT_LT(beside, beside_turned / 2);
}

// What stands nowhere has a box that nothing reads; it is left out by its matrix.
TEST(Reach, TakesWhatIsNoMatrix) {
    Scene scene;
    const Thing thing(ball(1, 4, 1, 0, 4));
    const Reach reach(scene.world.page(scene.add(thing)));
    for (const double bad : {std::nan(""), double(INFINITY), -double(INFINITY), 0.0, 1e300}) {
        Transform t;
        for (auto& row : t.m)
            row.fill(bad);
        reach.box(t);
    }
}

// Of so many places that boxes are smaller: rays find what they find among a few.
TEST(Reach, ChangesNoHit) {
    Random random(8);
    const Thing thing(ball(1, 4, 1, 0.25f, 4));
    Scene many, few;
    const uint32_t page = many.add(thing);
    few.add(thing);
    std::vector<Placement> places;
    for (size_t i = 0; i < 2 * Reach::FewestPlaces; i++)
        places.push_back({at_random(random, 10, 0.8, i % 3 == 0), page});
    const uint32_t root = many.add(places);
    std::vector<Placement> parts;
    for (size_t i = 0; i < places.size(); i += Reach::FewestPlaces / 2) {
        const auto from = places.begin() + std::ptrdiff_t(i);
        parts.push_back({Transform(), few.add({from, from + Reach::FewestPlaces / 2})});
    }
    const uint32_t root_of_few = few.add(parts);
    std::vector<Ray> rays;
    for (int i = 0; i < 20000; i++)
        rays.push_back({random.in_box(12), 0, random.direction()});
    std::vector<InstanceHit> a(rays.size()), b(rays.size());
    EverythingIsThere everything;
    find_closest<8>(many.world, root, rays, a, everything);
    find_closest<8>(few.world, root_of_few, rays, b, everything);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        found += a[i].hit.found();
        ASSERT_EQ(a[i].hit.found(), b[i].hit.found()) << i;
        if (a[i].hit.found()) {
            ASSERT_NEAR(a[i].hit.t, b[i].hit.t, 1e-4f * a[i].hit.t) << i; // matrices are two, one is unit
        }
    }
    EXPECT_GT(found, rays.size() / 4);
}

} // namespace kanuka::hierarchy::testing
