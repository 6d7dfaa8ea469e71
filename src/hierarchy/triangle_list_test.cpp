// Few triangles, tested by rays in lanes: beside the tree of the page and beside one lane, to the bit.
#include <gtest/gtest.h>

#include "hierarchy/decode.h"
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

// What a page has, by leaf and primitive.
struct Listed {
    TriangleList list;
    std::vector<std::pair<Ref, uint32_t>> places; // of its triangles

    explicit Listed(const Page& page) {
        std::vector<Ref> leaves;
        collect(page, page.header().root, leaves);
        std::ranges::sort(leaves);
        for (const Ref leaf : leaves) {
            const uint32_t count = kind_of(leaf) == Kind::Triangle32 ? page.at<Triangle32>(leaf).frame[2] & 15
                                   : kind_of(leaf) == Kind::Triangle48
                                       ? page.at<Triangle48>(leaf).frame[2] & 15
                                       : page.at<TriangleFloat>(leaf).count;
            for (uint32_t i = 0; i < count; i++) {
                list.add(corners_of(page, leaf, i).at);
                places.push_back({leaf, i});
            }
        }
    }

  private:
    static void collect(const Page& page, Ref ref, std::vector<Ref>& leaves) {
        if (is_leaf(ref))
            return leaves.push_back(ref);
        const Children children = Children::of(page.at<Node>(ref).children);
        for (int i = 0; i < children.count; i++)
            collect(page, children.ref(uint32_t(i)), leaves);
    }
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
std::vector<Hit> hits_of(const Listed& in, std::span<const Ray> rays, Accepts& accepts) {
    std::vector<Hit> hits;
    for (size_t first = 0; first < rays.size(); first += W) {
        const std::span<const Ray> some = rays.subspan(first, std::min(rays.size() - first, size_t(W)));
        const ListHits<W> found = ListTracer<W, Asked, Accepts>(in.list, lanes_of<W>(some), accepts).run();
        for (int i = 0; i < int(some.size()); i++) {
            Hit hit{found.t[i], found.u[i], found.v[i]};
            if (const int n = found.triangle[i]; n >= 0)
                std::tie(hit.leaf, hit.primitive) = in.places[size_t(n)];
            hits.push_back(hit);
        }
    }
    return hits;
}
template <int W, Query Asked>
std::vector<Hit> hits_of(const Listed& in, std::span<const Ray> rays) {
    AcceptsAll all;
    return hits_of<W, Asked>(in, rays, all);
}

// `walls`: distances are those of planes, which trees have but for rounding.
void expect_as_the_tree(const Page& page, const std::vector<Ray>& rays, bool walls = false) {
    const auto is_same = [&](Hit a, const Hit& b) {
        if (walls && std::abs(a.t - b.t) < 1e-6f * (1 + b.t))
            a.t = b.t;
        return a == b;
    };
    const Listed list(page);
    const std::vector<Hit> one = hits_of<1, Query::Closest>(list, rays),
                           eight = hits_of<8, Query::Closest>(list, rays),
                           sixteen = hits_of<16, Query::Closest>(list, rays),
                           any = hits_of<8, Query::Any>(list, rays);
    std::vector<Hit> tree(rays.size());
    closest(page, rays, tree);
    Oracle oracle(page);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit of_oracle = oracle.closest(rays[i]);
        ASSERT_EQ(of_oracle, tree[i]) << "ray " << i;
        ASSERT_TRUE(is_same(one[i], of_oracle)) << "ray " << i;
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
    EXPECT_EQ(Listed(soup.page()).list.vertices().size(), 8u); // each is looked at once
    std::vector<Ray> rays;
    for (int x = -2; x <= 2; x++)
        for (int y = -2; y <= 2; y++)
            for (int z = -2; z <= 2; z++) // of all of these, those at a border too
                if (x != 0 || y != 0 || z != 0)
                    rays.push_back({{0, 0, 0}, 0, Vec3f(float(x), float(y), float(z)) * 0.5f});
    expect_as_the_tree(soup.page(), rays, true);
    for (const Hit& h : hits_of<8, Query::Closest>(Listed(soup.page()), rays))
        EXPECT_TRUE(h.found());
}

TEST(TriangleList, OfHitsAtOneDistanceTheFirstCounts) {
    Soup soup;
    for (int i = 0; i < 20; i++)
        soup.add({-1, -1, 1}, {1, -1, 1}, {0, 1, 1});
    soup.build_page();
    const std::vector<Ray> rays(9, {{0, 0, 0}, 0, {0, 0, 1}});
    expect_as_the_tree(soup.page(), rays, true);
}

// The finer the lattice, the more bits leaves need.
TEST(TriangleList, HasLeavesOfAllKinds) {
    size_t pages[3] = {};
    for (int finer = -8; finer <= 14; finer += 2) {
        const Soup soup = random_soup(60, 3, finer);
        for (int kind = 0; kind < 3; kind++)
            pages[kind] += soup.page().header().section[int(Kind::Triangle32) + kind].leaf_bytes != 0;
        expect_as_the_tree(soup.page(), random_rays(2000, 4), true);
    }
    for (int kind = 0; kind < 3; kind++)
        EXPECT_GT(pages[kind], 0u) << kind;
}

TEST(TriangleList, RaysThatAreNoneHitNothing) {
    const Soup soup = random_soup(60, 5);
    const Listed list(soup.page());
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

// A wall a million times as wide as it is far: along its normal it is where it is, whatever way rays come.
TEST(TriangleList, WallsAreWhereTheyAre) {
    Random random(9);
    for (int axis = 0; axis < 3; axis++) {
        TriangleList list;
        Vec3f corner[4];
        for (int i = 0; i < 4; i++) {
            corner[i][axis] = 0.53f;
            corner[i][(axis + 1) % 3] = i & 1 ? 1e5f : -1e5f,
                                   corner[i][(axis + 2) % 3] = i & 2 ? 1e5f : -1e5f;
        }
        list.add({corner[0], corner[1], corner[2]}), list.add({corner[3], corner[2], corner[1]});
        AcceptsAll all;
        for (int i = 0; i < 1000; i++) {
            Ray r{random.in_box(100), 0, random.direction()};
            r.o[axis] = 0.53f - random.uniform(1e-4f, 2e-4f), r.d[axis] = std::abs(r.d[axis]);
            const double t = (0.53f - double(r.o[axis])) / double(r.d[axis]);
            const ListHits<8> hit =
                ListTracer<8, Query::Closest, AcceptsAll>(list, lanes_of<8>({&r, 1}), all).run();
            ASSERT_GE(hit.triangle[0], 0);
            ASSERT_NEAR(hit.t[0], t, 2e-7 * t);
        }
    }
}

// What is refused is not there: the next behind it is.
TEST(TriangleList, AsksWhoAccepts) {
    const Soup soup = random_soup(100, 6);
    const Listed list(soup.page());
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
        const auto at = std::ranges::find(list.places, std::pair(h.leaf, h.primitive));
        return is_there(size_t(at - list.places.begin()), h.u);
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

} // namespace kanuka::hierarchy::testing
