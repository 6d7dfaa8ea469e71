// Few triangles, tested by rays in lanes: beside the tree of the page and beside one lane, to the bit.
#include <gtest/gtest.h>

#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"
#include "hierarchy/triangle_list.h"

namespace kanuka::hierarchy::testing {
namespace {

struct Soup {
    std::vector<float> positions;
    std::vector<uint32_t> corners;
    PageMemory memory;

    void add(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
        for (const Vec3f& p : {a, b, c}) {
            corners.push_back(uint32_t(positions.size() / 3));
            positions.insert(positions.end(), {p.x, p.y, p.z});
        }
    }
    // `finer`: steps of the lattice, by so many powers of two than leaves ask for.
    void build_page(int finer = 0) {
        const MeshView view{positions.data(), positions.size() / 3, corners.data(), corners.size() / 3};
        const Content content{{}, {&view, 1}};
        Lattice lattice = votes_of(content).lattice();
        lattice.exponent -= finer;
        memory = build(content, lattice);
    }
    Page page() const { return memory.page(); }
};

// Of all sizes and forms: some are slivers, some have no area.
Soup random_soup(int count, unsigned seed, int finer = 0) {
    Random random(seed);
    Soup soup;
    for (int i = 1; i <= count; i++) {
        const Vec3f at = random.in_box(1), b = random.in_box(0.7f), c = random.in_box(0.7f);
        const float flat = i % 5 == 0 ? 1e-4f : i % 11 == 0 ? 0.0f : 1.0f;
        soup.add(at, at + b, at + b * random.uniform() + c * flat);
    }
    soup.build_page(finer);
    return soup;
}

template <int W>
RayLanes<W> lanes_of(std::span<const Ray> rays) {
    RayLanes<W> lanes;
    for (int i = 0; i < W; i++) {
        const Ray& r = rays[std::min(size_t(i), rays.size() - 1)];
        for (int c = 0; c < 3; c++)
            lanes.o[c].v[i] = r.o[c], lanes.d[c].v[i] = r.d[c];
        lanes.t_min.v[i] = r.t_min, lanes.t_max.v[i] = size_t(i) < rays.size() ? r.t_max : -1;
    }
    return lanes;
}

template <int W, Query Asked, class Accepts>
std::vector<Hit> hits_of(const TriangleList& list, std::span<const Ray> rays, Accepts& accepts) {
    std::vector<Hit> hits;
    for (size_t first = 0; first < rays.size(); first += W) {
        const std::span<const Ray> some = rays.subspan(first, std::min(rays.size() - first, size_t(W)));
        const ListHits<W> found = ListTracer<W, Asked, Accepts>(list, lanes_of<W>(some), accepts).run();
        for (int i = 0; i < int(some.size()); i++) {
            const int n = found.triangle[i];
            hits.push_back({found.t[i], found.u[i], found.v[i],
                            n < 0 ? NoRef : list.triangles()[size_t(n)].leaf,
                            n < 0 ? 0 : list.triangles()[size_t(n)].primitive});
        }
    }
    return hits;
}
template <int W, Query Asked>
std::vector<Hit> hits_of(const TriangleList& list, std::span<const Ray> rays) {
    AcceptsAll all;
    return hits_of<W, Asked>(list, rays, all);
}

void expect_as_the_tree(const Page& page, const std::vector<Ray>& rays) {
    const std::optional<TriangleList> list = TriangleList::of(page);
    ASSERT_TRUE(list);
    const std::vector<Hit> one = hits_of<1, Query::Closest>(*list, rays),
                           eight = hits_of<8, Query::Closest>(*list, rays),
                           sixteen = hits_of<16, Query::Closest>(*list, rays),
                           any = hits_of<8, Query::Any>(*list, rays);
    std::vector<Hit> tree(rays.size());
    closest(page, rays, tree);
    Oracle oracle(page);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        ASSERT_EQ(one[i], oracle.closest(rays[i])) << "ray " << i;
        ASSERT_EQ(one[i], tree[i]) << "ray " << i;
        ASSERT_EQ(eight[i], one[i]) << "ray " << i;
        ASSERT_EQ(sixteen[i], one[i]) << "ray " << i;
        ASSERT_EQ(any[i].found(), one[i].found()) << "ray " << i;
        found += one[i].found();
    }
    EXPECT_GT(found, 0u);
}

std::vector<Ray> random_rays(size_t count, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& r : rays) {
        r.o = random.in_box(1.5f), r.d = (random.in_box(1) - r.o) * random.uniform(0.1f, 10);
        r.t_min = random.below(4) == 0 ? random.uniform(0, 0.3f) : 0;
        r.t_max = random.below(4) == 0 ? random.uniform(0, 0.5f) : INFINITY;
    }
    return rays;
}

} // namespace

TEST(TriangleList, FindsTheHitsOfTheTree) {
    for (const int count : {1, 7, 40, 128})
        expect_as_the_tree(random_soup(count, unsigned(count)).page(), random_rays(8000, 1));
}

// Rays along axes and through vertices and edges, where two triangles are hit at one distance.
TEST(TriangleList, FindsTheSameAtEdgesAndVertices) {
    Soup soup;
    for (int side = -1; side <= 1; side += 2)
        for (int axis = 0; axis < 3; axis++) {
            Vec3f corner[4];
            for (int i = 0; i < 4; i++) {
                corner[i][axis] = float(side);
                corner[i][(axis + 1) % 3] = i & 1 ? 1.0f : -1.0f,
                                       corner[i][(axis + 2) % 3] = i & 2 ? 1.0f : -1.0f;
            }
            soup.add(corner[0], corner[1], corner[2]), soup.add(corner[3], corner[2], corner[1]);
        }
    soup.build_page();
    EXPECT_EQ(TriangleList::of(soup.page())->vertices().size(), 8u); // each is looked at once
    std::vector<Ray> rays;
    for (int x = -2; x <= 2; x++)
        for (int y = -2; y <= 2; y++)
            for (int z = -2; z <= 2; z++) // of all of these, those at a border too
                if (x != 0 || y != 0 || z != 0)
                    rays.push_back({{0, 0, 0}, 0, Vec3f(float(x), float(y), float(z)) * 0.5f});
    expect_as_the_tree(soup.page(), rays);
    for (const Hit& h : hits_of<8, Query::Closest>(*TriangleList::of(soup.page()), rays))
        EXPECT_TRUE(h.found());
}

TEST(TriangleList, OfHitsAtOneDistanceTheFirstCounts) {
    Soup soup;
    for (int i = 0; i < 20; i++)
        soup.add({-1, -1, 1}, {1, -1, 1}, {0, 1, 1});
    soup.build_page();
    const std::vector<Ray> rays(9, {{0, 0, 0}, 0, {0, 0, 1}});
    expect_as_the_tree(soup.page(), rays);
}

// The finer the lattice, the more bits leaves need.
TEST(TriangleList, HasLeavesOfAllKinds) {
    size_t pages[3] = {};
    for (int finer = -8; finer <= 14; finer += 2) {
        const Soup soup = random_soup(60, 3, finer);
        for (int kind = 0; kind < 3; kind++)
            pages[kind] += soup.page().header().section[int(Kind::Triangle32) + kind].leaf_bytes != 0;
        expect_as_the_tree(soup.page(), random_rays(2000, 4));
    }
    for (int kind = 0; kind < 3; kind++)
        EXPECT_GT(pages[kind], 0u) << kind;
}

TEST(TriangleList, RaysThatAreNoneHitNothing) {
    const Soup soup = random_soup(60, 5);
    const TriangleList list = *TriangleList::of(soup.page());
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                least = std::numeric_limits<float>::denorm_min();
    const std::vector<Ray> rays = {
        {{0, 0, 0}, 0, {0, 0, 0}},      {{0, 0, 0}, 0, {least, 0, 0}},    {{nan, 0, 0}, 0, {0, 0, 1}},
        {{0, 0, 0}, 0, {0, nan, 1}},    {{0, 0, 0}, 0, {INFINITY, 0, 1}}, {{1e19f, 0, 0}, 0, {-1, 0, 0}},
        {{0, 0, 0}, 2, {0, 0, 1}, 1},   {{0, 0, 0}, -1, {0, 0, 1}},       {{0, 0, 0}, nan, {0, 0, 1}},
        {{0, 0, 0}, 0, {0, 0, 1}, nan}, {{0, 0, 0}, 0, {0, 0, 1}, -1}};
    for (const Hit& h : hits_of<8, Query::Closest>(list, rays))
        EXPECT_FALSE(h.found());
    for (const Hit& h : hits_of<1, Query::Any>(list, rays))
        EXPECT_FALSE(h.found());
}

// What is refused is not there: the next behind it is.
TEST(TriangleList, AsksWhoAccepts) {
    const Soup soup = random_soup(100, 6);
    const TriangleList list = *TriangleList::of(soup.page());
    const std::vector<Ray> rays = random_rays(4000, 7);
    const auto is_there = [](size_t triangle, float u) { return triangle % 3 != 0 && u < 0.7f; };
    const auto accepts = [&](uint32_t lanes, size_t triangle, const auto& depths) {
        uint32_t there = 0;
        for (; lanes != 0; lanes &= lanes - 1) {
            const int i = __builtin_ctz(lanes);
            there |= uint32_t(is_there(triangle, depths.u[i])) << i;
        }
        return there;
    };
    const auto closest = hits_of<8, Query::Closest>(list, rays, accepts),
               any = hits_of<8, Query::Any>(list, rays, accepts);
    Oracle oracle(soup.page());
    oracle.accepts = [&](const Hit& h) {
        const auto at = std::ranges::find_if(list.triangles(), [&](const TriangleList::Triangle& t) {
            return t.leaf == h.leaf && t.primitive == h.primitive;
        });
        return is_there(size_t(at - list.triangles().begin()), h.u);
    };
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit one = oracle.closest(rays[i]);
        ASSERT_EQ(closest[i], one) << "ray " << i;
        ASSERT_EQ(any[i].found(), one.found()) << "ray " << i;
        found += one.found();
    }
    EXPECT_GT(found, rays.size() / 20);
}

TEST(TriangleList, IsOfFewTrianglesAlone) {
    EXPECT_TRUE(TriangleList::of(random_soup(128, 8).page()));
    EXPECT_FALSE(TriangleList::of(random_soup(129, 8).page()));
    EXPECT_FALSE(TriangleList::of(random_soup(2000, 8).page()));
    Soup nothing;
    nothing.build_page();
    EXPECT_FALSE(TriangleList::of(nothing.page()));
    const std::vector<TestGrid> grids = ball(1, 4, 1, 0, 1);
    const std::vector<GridView> of_grids = views(grids);
    const Content content{of_grids, {}};
    EXPECT_FALSE(TriangleList::of(build(content, votes_of(content).lattice()).page()));
}

} // namespace kanuka::hierarchy::testing
