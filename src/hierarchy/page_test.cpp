// Damaged pages, and content that is no geometry at all.
#include <gtest/gtest.h>

#include "hierarchy/decode.h"
#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"

namespace kanuka::hierarchy::testing {
namespace {

PageMemory page_of(const std::vector<TestGrid>& grids) {
    const std::vector<GridView> v = views(grids);
    const Content content{v, {}};
    return build(content, votes_of(content).lattice());
}

// The same with some hair on it.
PageMemory page_with_hair(const std::vector<TestGrid>& grids) {
    const std::vector<GridView> v = views(grids);
    Random random(12);
    std::vector<float> vertices; // xyz, radius
    std::vector<uint32_t> first;
    for (int i = 0; i < 300; i++) {
        const Vec3f root = random.direction();
        first.push_back(uint32_t(vertices.size() / 4));
        for (const float far : {1.0f, i % 50 == 0 ? 30.0f : 1.3f})
            vertices.insert(vertices.end(), {root.x * far, root.y * far, root.z * far, 0.01f});
    }
    const FibreView hair{vertices.data(), vertices.size() / 4, first.data(), first.size()};
    const Content content{v, {}, false, {&hair, 1}};
    return build(content, votes_of(content).lattice());
}

std::vector<Ray> rays_around(size_t count, float side) {
    Random random(11);
    std::vector<Ray> rays(count);
    for (Ray& r : rays)
        r.o = random.in_box(side), r.d = random.direction();
    return rays;
}

Hit trace_one(const Page& page, const Ray& r) {
    Hit h;
    closest(page, {&r, 1}, {&h, 1});
    return h;
}

int64_t height_of(const Page& page, Ref ref, int64_t depth = 0) {
    if (kind_of(ref) != Kind::Nodes)
        return depth;
    const Children c = Children::of(page.at<Node>(ref).children);
    int64_t deepest = depth;
    for (int i = 0; i < c.count; i++)
        deepest = std::max(
            deepest,
            height_of(page, uint32_t(c.kind) << KindShift | (c.offset + uint32_t(i) * UnitsOf[int(c.kind)]),
                      depth + 1));
    return deepest;
}

} // namespace

TEST(Pages, ArePassedWhole) {
    const PageMemory page = page_of(ball(2, 9, 1, 0.2f, 5));
    EXPECT_EQ(refusal_of(page.bytes()), "");
    // Anywhere in memory.
    PageMemory copy(page.size() + 192);
    std::memcpy(copy.data() + 128, page.data(), page.size());
    const std::span<const std::byte> moved(copy.data() + 128, page.size());
    EXPECT_EQ(refusal_of(moved), "");
    for (const Ray& r : rays_around(300, 1.5f))
        EXPECT_EQ(trace_one(Page(moved.data()), r), trace_one(page.page(), r));
}

TEST(Pages, ThatAreDamagedAreRefused) {
    const PageMemory page = page_with_hair(ball(2, 9, 1, 0.2f, 5));
    Random random(7);
    PageMemory damaged = copy_of(page);
    for (int i = 0; i < 2000; i++) {
        const size_t at = random.below(uint32_t(page.page().header().bytes));
        damaged.data()[at] ^= std::byte(1u << random.below(8));
        EXPECT_NE(refusal_of(damaged.bytes()), "") << "byte " << at;
        damaged.data()[at] = page.data()[at];
    }
    EXPECT_NE(refusal_of(page.bytes().first(page.size() / 2)), "");
    EXPECT_NE(refusal_of(page.bytes().first(40)), "");
    EXPECT_NE(refusal_of({}), "");
}

// With the checksum forged, what passes is traced within its bounds, and ends.
TEST(Pages, ThatAreForgedAreTracedInBounds) {
    std::vector<TestGrid> grids = ball(2, 9, 1, 0.2f, 5);
    grids.push_back(
        make_grid(8, 8, [](float u, float v) { return Vec3f(9 * u - 4, 2 * u + v - 4, 9 * v - 4); }));
    grids.push_back(make_grid(4, 4, [](float u, float v) { return Vec3f(1e6f * u, 1e6f * v, 1e5f); }));
    const PageMemory page = page_with_hair(grids);
    const std::vector<Ray> rays = rays_around(200, 1.5f);
    std::vector<Hit> hits(rays.size());
    Random random(8);
    int passed = 0, refused = 0;
    for (int i = 0; i < 3000; i++) {
        PageMemory forged = copy_of(page); // of its own size: a reader out of bounds is out of the allocation
        Header& h = *reinterpret_cast<Header*>(forged.data());
        const uint32_t bytes = uint32_t(h.bytes), changes = 1 + random.below(4);
        for (uint32_t k = 0; k < changes; k++) {
            const size_t at =
                random.below(3) ? h.nodes + random.below(uint32_t(h.node_bytes)) : random.below(bytes);
            forged.data()[at] = std::byte(random.below(256));
        }
        if (h.bytes <= forged.size() && h.bytes >= sizeof(Header))
            h.checksum = checksum_of(forged.bytes());
        if (!refusal_of(forged.bytes()).empty()) {
            refused++;
            continue;
        }
        passed++;
        closest(forged.page(), rays, hits);
        for (const Hit& hit : hits)
            if (hit.found() && is_of_grids(kind_of(hit.leaf)))
                cell_of(forged.page(), hit.leaf, hit.primitive / 2);
            else if (hit.found())
                segment_of(forged.page(), hit.leaf, hit.primitive / 2),
                    forged.page().name(hit.leaf, int(hit.primitive / 2));
    }
    EXPECT_GT(passed, 300);
    EXPECT_GT(refused, 100);
}

TEST(Pages, MayBeEmpty) {
    const PageMemory page = page_of({});
    EXPECT_EQ(refusal_of(page.bytes()), "");
    EXPECT_FALSE(trace_one(page.page(), {{0, 0, 0}, 0, {0, 0, 1}}).found());
    // As good as empty: no vertex is anywhere.
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const PageMemory nowhere = page_of({make_grid(9, 9, [nan](float, float) { return Vec3f(nan); })});
    EXPECT_EQ(refusal_of(nowhere.bytes()), "");
    EXPECT_FALSE(trace_one(nowhere.page(), {{0, 0, 0}, 0, {0, 0, 1}}).found());
}

TEST(Pages, LoseTheCellsOfVerticesThatAreNoNumbersAlone) {
    for (float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f}) {
        TestGrid g = make_grid(10, 10, [](float u, float v) { return Vec3f(10 * u, 10 * v, 0); });
        g.positions[3 * (5 * 11 + 5) + 1] = bad;
        const PageMemory page = page_of({g});
        EXPECT_EQ(refusal_of(page.bytes()), "");
        for (int y = 0; y < 10; y++)
            for (int x = 0; x < 10; x++)
                for (float at : {0.25f, 0.75f}) { // in the first triangle, and the second
                    const Ray r{{float(x) + at, float(y) + at, 1}, 0, {0, 0, -1}};
                    const bool first = at < 0.5f;
                    const bool touches = (x == 5 && y == 5 && first) || (x == 4 && y == 4 && !first) ||
                                         ((x == 4 && y == 5) || (x == 5 && y == 4));
                    EXPECT_EQ(trace_one(page.page(), r).found(), !touches) << x << " " << y << " " << at;
                }
    }
}

TEST(Pages, HoldPointsNeedlesAndOneQuad) {
    std::vector<TestGrid> grids;
    grids.push_back(make_grid(5, 5, [](float, float) { return Vec3f(1, 2, 3); }));
    grids.push_back(make_grid(5, 5, [](float u, float) { return Vec3f(u, u, u); }));
    grids.push_back(make_grid(1, 1, [](float u, float v) { return Vec3f(u, v, 0); }));
    grids.push_back(make_grid(0, 4, [](float, float v) { return Vec3f(0, v, 0); }));
    const PageMemory page = page_of(grids);
    EXPECT_EQ(refusal_of(page.bytes()), "");
    const Hit h = trace_one(page.page(), {{0.25f, 0.5f, 1}, 0, {0, 0, -1}});
    ASSERT_TRUE(h.found());
    EXPECT_EQ(cell_of(page.page(), h.leaf, h.primitive / 2).grid, 2u);
    EXPECT_FLOAT_EQ(h.t, 1);
}

// Boxes that cannot be told apart, and boxes each of which holds the next: trees have an end.
TEST(Pages, StayShallow) {
    std::vector<TestGrid> same, nested;
    for (int i = 0; i < 30000; i++)
        same.push_back(make_grid(1, 1, [](float u, float v) { return Vec3f(u, v, 0); }));
    for (int i = 0; i < 3000; i++)
        nested.push_back(make_grid(1, 1, [i](float u, float v) {
            const float s = std::ldexp(1.0f, i % 100 - 50);
            return Vec3f(s * (u + 1), s * (v + 1), s);
        }));
    for (const auto& grids : {same, nested}) {
        const PageMemory page = page_of(grids);
        EXPECT_EQ(refusal_of(page.bytes()), "");
        EXPECT_LE(height_of(page.page(), page.page().header().root), DeepestNode + 1);
    }
    const Hit h = trace_one(page_of(same).page(), {{0.25f, 0.5f, 1}, 0, {0, 0, -1}});
    EXPECT_FLOAT_EQ(h.t, 1);
}

TEST(Pages, AreNotHitByRaysThatAreNone) {
    const PageMemory page = page_of(ball(2, 9, 1, 0.2f, 5));
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const Ray none[] = {{{0, 0, 0}, 0, {0, 0, 0}},      {{0, 0, 0}, 0, {1e-40f, 0, 0}},
                        {{nan, 0, 0}, 0, {0, 0, 1}},    {{0, 0, 0}, 0, {0, nan, 1}},
                        {{0, inf, 0}, 0, {0, 0, 1}},    {{0, 0, 0}, 0, {0, 0, inf}},
                        {{0, 0, 0}, nan, {0, 0, 1}},    {{0, 0, 0}, 2, {0, 0, 1}, 1},
                        {{0, 0, 0}, 0, {0, 0, 1}, nan}, {{0, 0, 0}, -1, {0, 0, 1}, 5}};
    std::vector<Ray> rays;
    for (int i = 0; i < 20; i++) // among others that are
        for (const Ray& r : none)
            rays.push_back(r), rays.push_back({{0, 0, 0}, 0, {0, 1e-40f, 1}});
    std::vector<Hit> hits(rays.size());
    closest(page.page(), rays, hits);
    for (size_t i = 0; i < hits.size(); i++)
        EXPECT_EQ(hits[i].found(), i % 2 == 1) << i;
}

} // namespace kanuka::hierarchy::testing
