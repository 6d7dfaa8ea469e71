// Set operations on solids against points told inside or outside by their formulas.
#include "bvh/test_geometry.h"

#include <gtest/gtest.h>

namespace kanuka::bvh {
namespace {

using namespace testing;
using Kind = SolidNode::Kind;

struct Ball {
    Vec3f center;
    float radius;
    bool holds(const Point& p) const {
        const Point d = p - Point(center);
        return dot(d, d) < double(radius) * radius;
    }
};

// A tree over balls, and the same as a formula.
struct Case {
    std::vector<SolidNode> nodes;
    std::vector<std::pair<int, Ball>> balls; // by the primitive node that they bound
    bool (*inside)(const bool* ball);
};

const Case Cases[] = {
    {{{Kind::Difference, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}},
     {{1, {{0, 0, 0}, 1}}, {2, {{0.6f, 0.1f, 0}, 0.8f}}},
     [](const bool* b) { return b[0] && !b[1]; }},
    {{{Kind::Intersection, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}},
     {{1, {{-0.5f, 0, 0}, 1}}, {2, {{0.5f, 0.1f, 0}, 1}}},
     [](const bool* b) { return b[0] && b[1]; }},
    {{{Kind::Union, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}},
     {{1, {{-0.5f, 0, 0}, 1}}, {2, {{0.5f, 0.1f, 0}, 1}}},
     [](const bool* b) { return b[0] || b[1]; }},
    // (A or B) - (C and (D - E)), and a hollow F of its own: a ball within it in one primitive.
    {{{Kind::Difference, -1},
      {Kind::Union, 0},
      {Kind::Primitive, 1},
      {Kind::Primitive, 1},
      {Kind::Intersection, 0},
      {Kind::Primitive, 4},
      {Kind::Difference, 4},
      {Kind::Primitive, 6},
      {Kind::Primitive, 6},
      {Kind::Primitive, -1}},
     {{2, {{-0.5f, 0, 0}, 0.9f}},
      {3, {{0.5f, 0, 0}, 0.8f}},
      {5, {{0, 0.4f, 0}, 0.9f}},
      {7, {{0.1f, 0.6f, 0}, 0.8f}},
      {8, {{0, 0.7f, 0.5f}, 0.5f}},
      {9, {{0, -1.4f, 0}, 0.5f}},
      {9, {{0, -1.4f, 0.1f}, 0.3f}}},
     [](const bool* b) { return ((b[0] || b[1]) && !(b[2] && (b[3] && !b[4]))) || (b[5] != b[6]); }},
};

bool inside(const Case& c, const Point& p) {
    bool in[16];
    for (size_t i = 0; i < c.balls.size(); i++)
        in[i] = c.balls[i].second.holds(p);
    return c.inside(in);
}

// Where the formula changes along the ray; infinity = nowhere.
double first_change(const Case& c, const Ray& ray, double* next) {
    const Point o(ray.o), d(ray.d);
    std::vector<double> at;
    for (const auto& [node, ball] : c.balls) {
        const Point s = o - Point(ball.center);
        const double a = dot(d, d), b = dot(s, d), k = dot(s, s) - double(ball.radius) * ball.radius;
        const double root = b * b - a * k;
        if (root <= 0)
            continue;
        for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a})
            if (t > 0)
                at.push_back(t);
    }
    std::sort(at.begin(), at.end());
    bool before = inside(c, o);
    *next = INFINITY;
    double found = INFINITY;
    for (size_t i = 0; i < at.size(); i++) {
        const double middle = i + 1 < at.size() ? (at[i] + at[i + 1]) / 2 : at[i] + 1;
        const bool after = inside(c, o + d * middle);
        if (after != before) {
            if (std::isfinite(found)) {
                *next = at[i];
                return found;
            }
            found = at[i];
        }
        before = after;
    }
    return found;
}

struct Built {
    Shapes shapes;
    std::vector<GroupDesc> groups;
};

void build(const Case& c, GroupDesc& group, Shapes& shapes) {
    for (const auto& [node, ball] : c.balls)
        group.shapes.push_back({shapes.add_sphere(ball.center, ball.radius, 96), 1, node});
    group.solids = c.nodes;
}

template <int W>
void expect_formula(const Scene& scene, const Case& c, const std::vector<Ray>& rays) {
    const auto hits = intersect<W>(scene, rays);
    const auto shadow = occluded<W>(scene, rays);
    int found = 0, differ = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        double next;
        const double t = first_change(c, rays[i], &next);
        EXPECT_EQ(hits[i].hit, shadow[i]) << i;
        const bool same = hits[i].hit == std::isfinite(t) && (!hits[i].hit || std::abs(hits[i].t - t) < 4e-3);
        found += same && hits[i].hit;
        differ += !same;
    }
    EXPECT_GT(found, int(rays.size()) / 20);
    EXPECT_LT(differ, int(rays.size()) / 60); // facets are not balls where a ray grazes or two surfaces meet
}

// By Embree, and in pages.
class TracedSolids : public ::testing::TestWithParam<bool> {
  protected:
    static PagesFrom pages() { return GetParam() ? 0 : ~uint64_t(0); }
};
INSTANTIATE_TEST_SUITE_P(Traced, TracedSolids, ::testing::Bool(),
                         [](const auto& of) { return of.param ? "InPages" : "ByEmbree"; });

TEST_P(TracedSolids, TreesAgainstFormulasFromInsideAndOutside) {
    for (const Case& c : Cases) {
        Shapes shapes;
        GroupDesc world;
        build(c, world, shapes);
        const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = pages()});
        EXPECT_EQ(scene.page_bytes().built > 0, GetParam());
        const auto rays = random_rays(4000, 1.5f, 7);
        expect_formula<8>(scene, c, rays);
        const auto one = intersect<1>(scene, rays), eight = intersect<8>(scene, rays),
                   sixteen = intersect<16>(scene, rays);
        for (size_t i = 0; i < rays.size(); i++) {
            ASSERT_EQ(one[i].hit, eight[i].hit);
            ASSERT_EQ(one[i].hit, sixteen[i].hit);
            if (!one[i].hit)
                continue;
            ASSERT_EQ(one[i].t, eight[i].t);
            ASSERT_EQ(one[i].t, sixteen[i].t);
            ASSERT_EQ(one[i].shape, eight[i].shape);
            ASSERT_EQ(one[i].u, sixteen[i].u);
        }
    }
}

// In an instance, beside what is no solid; and with one of its balls moving.
// Operations on one solid are that solid, and cost a ray nothing, however deep they lie in each other.
TEST_P(TracedSolids, OperationsOnOneSolidChangeNothing) {
    constexpr Kind Operations[] = {Kind::Union, Kind::Intersection, Kind::Difference};
    for (const auto& [depth, count] : {std::pair{1, 2000}, {3, 2000}, {20000, 400}})
        for (const Case& c : Cases) {
            Case deep = c;
            deep.nodes.clear();
            std::vector<int> now; // where a node of the case is
            for (const SolidNode& node : c.nodes) {
                int parent = node.parent < 0 ? -1 : now[size_t(node.parent)];
                for (int k = 0; k < depth; k++) {
                    deep.nodes.push_back({Operations[k % 3], parent});
                    parent = int(deep.nodes.size()) - 1;
                }
                deep.nodes.push_back({node.kind, parent});
                now.push_back(int(deep.nodes.size()) - 1);
            }
            for (auto& [node, ball] : deep.balls)
                node = now[size_t(node)];
            Shapes shapes;
            GroupDesc world;
            build(deep, world, shapes);
            const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = pages()});
            expect_formula<8>(scene, c, random_rays(count, 1.5f, 7));
        }
}

// Fifty balls in a row joined two by two, each level in the next: as many crossings as states, in order.
TEST_P(TracedSolids, ManyLevelsWithASolidEach) {
    constexpr int Levels = 50;
    Case c;
    for (int l = 0; l < Levels; l++) {
        c.nodes.push_back({Kind::Union, l > 0 ? 2 * (l - 1) : -1});
        c.nodes.push_back({Kind::Primitive, 2 * l});
        c.balls.push_back({2 * l + 1, {{0.1f * float(l) - 2.5f, 0, 0}, 0.3f}});
    }
    Shapes shapes;
    GroupDesc world;
    build(c, world, shapes);
    const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = pages()});
    const auto hit = intersect<8>(scene, {{{-5, 0.01f, 0.02f}, {1, 0, 0}}, {{0, 0.01f, 0.02f}, {1, 0, 0}}});
    ASSERT_TRUE(hit[0].hit && hit[1].hit);
    EXPECT_NEAR(hit[0].t, 2.2f, 0.01f);
    EXPECT_NEAR(hit[1].t, 2.7f, 0.01f); // from within: all of it is one body
}

TEST_P(TracedSolids, InstancedAndMovingOnesAreResolved) {
    const Case& c = Cases[0];
    Shapes shapes;
    std::vector<GroupDesc> groups(2);
    build(c, groups[0], shapes);
    const std::vector<float> place = {1, 0, 0, 0.5f, 0, 1, 0, 0, 0, 0, 1, 0};
    groups[1].instances.push_back({0, place});
    groups[1].shapes.push_back({shapes.add_sphere({0.5f, 0, 0}, 0.2f, 64), 1});
    const Scene scene(shapes.store, groups, {.pages_from = pages()});
    const auto rays = random_rays(3000, 1.5f, 9);
    const auto hits = intersect<8>(scene, rays);
    const auto single = intersect<1>(scene, rays);
    const auto shadow = occluded<8>(scene, rays);
    int differ = 0, instanced = 0, beside = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        Ray moved = rays[i];
        moved.o.x -= 0.5f;
        double next, t = first_change(c, moved, &next);
        const Case ball{{}, {{0, {{0, 0, 0}, 0.2f}}}, [](const bool* b) { return b[0]; }};
        t = std::min(t, first_change(ball, moved, &next));
        EXPECT_EQ(hits[i].hit, shadow[i]);
        EXPECT_EQ(hits[i].hit, single[i].hit);
        differ += hits[i].hit != std::isfinite(t) || (hits[i].hit && std::abs(hits[i].t - t) > 4e-3);
        instanced += hits[i].hit && hits[i].instanced;
        beside += hits[i].hit && !hits[i].instanced;
        if (hits[i].hit && hits[i].instanced) {
            EXPECT_EQ(hits[i].world_from_shape[3], 0.5f);
        }
    }
    EXPECT_LT(differ, 50);
    EXPECT_GT(instanced, 500);
    EXPECT_GT(beside, 2);
}

TEST_P(TracedSolids, APartThatMovesCutsWhereItIs) {
    Shapes shapes;
    std::vector<GroupDesc> groups(2);
    const int cutter = shapes.add_sphere({0, 0, 0}, 0.5f, 64);
    groups[0].shapes.push_back({cutter, 1, 2});
    groups[1].solids = {{Kind::Difference, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}};
    groups[1].shapes.push_back({shapes.add_sphere({0, 0, 0}, 1, 64), 1, 1});
    const TransformKey keys[] = {{0.0, Transform::translate(-1, 0, 0)}, {1.0, Transform::translate(1, 0, 0)}};
    const MotionPath paths[] = {MotionPath(keys)};
    groups[1].instances.push_back({0, {}, paths, GroupDesc::Unnumbered, true});
    const Scene scene(shapes.store, groups, {.pages_from = pages()});
    for (const float time : {0.0f, 0.3f, 0.5f, 1.0f}) {
        const float x = 2 * time - 1;
        // Along x through the middle, from the side of the cutter or the other; up through its middle.
        const std::vector<Ray> rays{{{-3, 0.01f, 0.02f}, {1, 0, 0}, time},
                                    {{x * 0.5f, -3, 0.02f}, {0, 1, 0}, time}};
        const auto hits = intersect<8>(scene, rays);
        ASSERT_TRUE(hits[0].hit && hits[1].hit);
        const bool opened = x - 0.5f < -1;
        EXPECT_NEAR(hits[0].t, opened ? 3 + x + 0.5f : 2, 5e-3) << time;
        EXPECT_EQ(hits[0].instanced, opened);
        EXPECT_EQ(intersect<1>(scene, rays)[0].t, hits[0].t);
        EXPECT_EQ(hits[0].shape, opened ? cutter : cutter + 1);
    }
}

// A cube whose face another cube shares: what is cut away leaves no skin, whichever lies first.
TEST_P(TracedSolids, CommonFacesLeaveNothing) {
    Shapes shapes;
    const auto cube = [&](const Vec3f& lo, const Vec3f& hi) {
        std::vector<Vec3f> p;
        for (int k = 0; k < 8; k++)
            p.push_back({k & 1 ? hi.x : lo.x, k & 2 ? hi.y : lo.y, k & 4 ? hi.z : lo.z});
        return shapes.add_mesh(4, p,
                               {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5});
    };
    GroupDesc world;
    world.shapes.push_back({cube({-1, -1, -1}, {1, 1, 1}), 1, 1});
    world.shapes.push_back({cube({-0.5f, -0.5f, -1}, {0.5f, 0.5f, 1}), 1, 2}); // a hole all the way through
    world.solids = {{Kind::Difference, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}};
    const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = pages()});
    std::vector<Ray> through, wall;
    std::mt19937 g(3);
    std::uniform_real_distribution<float> u(-0.49f, 0.49f), v(0.51f, 0.99f);
    for (int i = 0; i < 2000; i++) {
        through.push_back({{u(g), u(g), -3}, {0, 0, 1}});
        wall.push_back({{v(g), u(g), -3}, {0, 0, 1}});
    }
    for (const bool hit : occluded<8>(scene, through))
        EXPECT_FALSE(hit);
    for (const Hit& h : intersect<8>(scene, wall)) {
        EXPECT_TRUE(h.hit);
        EXPECT_NEAR(h.t, 2, 1e-5);
    }
    // A shadow ray that ends within the hole meets nothing, one from within the wall its side.
    EXPECT_FALSE(occluded<8>(scene, {{{0, 0, -3}, {0, 0, 1}}}, 0, 3)[0]);
    const auto side = intersect<8>(scene, {{{0.75f, 0, 0}, {-1, 0, 0}}});
    EXPECT_TRUE(side[0].hit);
    EXPECT_NEAR(side[0].t, 0.25f, 1e-6);
    EXPECT_EQ(side[0].shape, 1);
}

// A box with slits about its lid, within a ball: rays that go through one and out at the other side are not
// in the box all the way from their start.
TEST_P(TracedSolids, CracksLeaveNothingInTheAir) {
    Shapes shapes;
    std::vector<Vec3f> p;
    for (int k = 0; k < 8; k++) {
        const float s = k & 4 ? 0.9f : 1; // the lid's corners
        p.push_back({(k & 1 ? 0.5f : -0.5f) * s, (k & 2 ? 0.5f : -0.5f) * s, k & 4 ? 0.5f : -0.5f});
    }
    for (int k = 0; k < 4; k++)
        p.push_back({k & 1 ? 0.5f : -0.5f, k & 2 ? 0.5f : -0.5f, 0.5f});
    const int box =
        shapes.add_mesh(4, p, {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 9, 8, 2, 10, 11, 3, 0, 8, 10, 2, 1, 3, 11, 9});
    GroupDesc world;
    world.shapes.push_back({box, 1, 1});
    world.shapes.push_back({shapes.add_sphere({0, 0, 0}, 2, 48), 1, 2});
    world.solids = {{Kind::Intersection, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}};
    const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = pages()});
    std::vector<Ray> rays = random_rays(20000, 4, 11);
    std::erase_if(rays, [](const Ray& r) { return length(r.o) < 1; }); // all start outside of the box
    const auto hits = intersect<8>(scene, rays);
    const auto shadows = occluded<8>(scene, rays);
    int found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        ASSERT_EQ(hits[i].hit, shadows[i]);
        if (!hits[i].hit)
            continue;
        found++;
        const Vec3f at = rays[i].o + rays[i].d * hits[i].t;
        EXPECT_LT(std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}), 0.5001f) << i;
    }
    EXPECT_GT(found, 300);
    // From inside of it out through a slit: in the ball's air it is out.
    EXPECT_FALSE(intersect<8>(scene, {{{0, 0, 0}, normalize(Vec3f(0.475f, 0, 0.5f))}})[0].hit);
}

// Area of what is seen along z: of a lens, of a ball with a bite, of both together.
TEST_P(TracedSolids, SilhouettesHaveTheAreasOfTheirFormulas) {
    const double r = 1, apart = 1; // two balls, a distance of their radius from each other across the view
    const double lens =
        2 * r * r * std::acos(apart / (2 * r)) - apart / 2 * std::sqrt(4 * r * r - apart * apart);
    const std::pair<Kind, double> cases[] = {
        {Kind::Intersection, lens},
        {Kind::Union, 2 * double(Pi) - lens},
        {Kind::Difference,
         double(Pi) - lens / 2}}; // half of it is deeper in the ball than what is taken away
    for (const auto& [kind, expected] : cases) {
        Shapes shapes;
        GroupDesc world;
        world.shapes.push_back({shapes.add_sphere({-0.5f, 0, 0}, 1, 128), 1, 1});
        world.shapes.push_back({shapes.add_sphere({0.5f, 0, 0}, 1, 128), 1, 2});
        world.solids = {{kind, -1}, {Kind::Primitive, 0}, {Kind::Primitive, 0}};
        const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = pages()});
        std::vector<Ray> rays;
        constexpr int N = 400;
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++)
                rays.push_back(
                    {{4 * (float(i) + 0.5f) / N - 2, 4 * (float(j) + 0.5f) / N - 2, -5}, {0, 0, 1}});
        int hits = 0;
        for (const bool hit : occluded<16>(scene, rays))
            hits += hit;
        EXPECT_NEAR(16.0 * hits / (N * N), expected, 0.02) << int(kind);
    }
}

TEST(Solids, WhatIsTakenAwayTurnsItsInsideOut) {
    const std::vector<SolidNode> nodes{{Kind::Difference, -1}, {Kind::Primitive, 0}, {Kind::Difference, 0},
                                       {Kind::Primitive, 2},   {Kind::Primitive, 2}, {Kind::Primitive, 99}};
    EXPECT_FALSE(subtracted(nodes, 1));
    EXPECT_TRUE(subtracted(nodes, 3));
    EXPECT_FALSE(subtracted(nodes, 4));
    EXPECT_FALSE(subtracted(nodes, 5)); // no such parent
    EXPECT_FALSE(subtracted(nodes, -1));
    EXPECT_FALSE(subtracted(nodes, 1000));
}

} // namespace
} // namespace kanuka::bvh
