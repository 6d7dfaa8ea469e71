// Pages of grids against a tracer in doubles, and against the oracle, bit by bit.
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"

namespace kanuka::hierarchy::testing {
namespace {

struct Built {
    std::vector<TestGrid> grids;
    Lattice lattice;
    PageMemory memory;

    explicit Built(std::vector<TestGrid> g) : grids(std::move(g)) {
        const std::vector<GridView> v = views(grids);
        const Content content{v, {}};
        lattice = votes_of(content).lattice();
        memory = build(content, lattice);
    }
    Page page() const { return memory.page(); }
    int leaves(Kind kind) const {
        const Section& s = page().header().section[int(kind)];
        return int(s.leaf_bytes / (UnitsOf[int(kind)] * UnitBytes));
    }
};

std::vector<Ray> random_rays(size_t count, float side, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& r : rays) {
        r.o = random.in_box(side), r.d = random.direction();
        switch (random.below(8)) {
        case 0: // along an axis
            r.d[int(random.below(3))] = 0;
            break;
        case 1:
            r.d = Vec3f(0.0f), r.d[int(random.below(3))] = random.below(2) ? 1.0f : -1.0f;
            break;
        case 2:
            r.t_min = random.uniform(0, side), r.t_max = r.t_min + random.uniform(0, side);
            break;
        case 3:
            r.d = r.d * random.uniform(1e-3f, 1e3f);
            break;
        default:
            break;
        }
    }
    return rays;
}

// The number of the face that a hit is on, as faces_of() numbers them.
uint32_t face_of(const Built& b, const Hit& h) {
    const Cell c = cell_of(b.page(), h.leaf, h.primitive / 2);
    uint32_t first = 0;
    for (uint32_t g = 0; g < c.grid; g++)
        first += uint32_t(b.grids[g].columns * b.grids[g].rows) * 2;
    return first + uint32_t(c.row * b.grids[c.grid].columns + c.column) * 2 + (h.primitive & 1);
}

void expect_as_brute_force(const Built& b, const std::vector<Ray>& rays) {
    const std::vector<Face> faces = faces_of(b.grids, b.lattice);
    std::vector<Hit> hits(rays.size());
    closest(b.page(), rays, hits);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Reference r = brute_force(faces, rays[i]);
        if (r.margin < 1e-4)
            continue; // either would do
        ASSERT_EQ(hits[i].found(), r.t < INFINITY) << "ray " << i;
        if (!hits[i].found())
            continue;
        found++;
        EXPECT_NEAR(hits[i].t, r.t, 2e-5 * (1 + r.t)) << "ray " << i;
        if (face_of(b, hits[i]) != r.name) { // a tie, or as good as one
            const Face& f = faces[face_of(b, hits[i])];
            EXPECT_LT(brute_force({f}, rays[i]).t - r.t, 1e-5 * (1 + r.t)) << "ray " << i;
        }
        // The place within the cell.
        const Face& f = faces[face_of(b, hits[i])];
        const float u = hits[i].primitive & 1 ? 1 - hits[i].u : hits[i].u,
                    v = hits[i].primitive & 1 ? 1 - hits[i].v : hits[i].v;
        const Vec3f p = f.a * (1 - u - v) + f.b * u + f.c * v, q = rays[i].o + rays[i].d * hits[i].t;
        EXPECT_LT(length(p - q), 1e-3f * (1 + length(q - rays[i].o))) << "ray " << i;
    }
    EXPECT_GT(found, rays.size() / 20);
}

void expect_same_bits(const Built& b, const std::vector<Ray>& rays) {
    std::vector<Hit> eight(rays.size()), sixteen(rays.size()), widest(rays.size());
    std::vector<uint8_t> any(rays.size()), any_of_16(rays.size()), any_of_widest(rays.size());
    closest_w8(b.page(), rays, eight), closest_w16(b.page(), rays, sixteen), closest(b.page(), rays, widest);
    occluded_w8(b.page(), rays, any), occluded_w16(b.page(), rays, any_of_16);
    occluded(b.page(), rays, any_of_widest);
    Oracle oracle(b.page());
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit one = oracle.closest(rays[i]);
        ASSERT_EQ(eight[i], one) << "ray " << i;
        ASSERT_EQ(sixteen[i], one) << "ray " << i;
        ASSERT_EQ(widest[i], one) << "ray " << i;
        ASSERT_EQ(any[i] != 0, one.found()) << "ray " << i;
        ASSERT_EQ(any_of_16[i] != 0, one.found()) << "ray " << i;
        ASSERT_EQ(any_of_widest[i] != 0, one.found()) << "ray " << i;
        // A ray finds the same without neighbours.
        if (i % 16 == 0) {
            Hit alone;
            closest_w8(b.page(), {&rays[i], 1}, {&alone, 1});
            ASSERT_EQ(alone, one) << "ray " << i;
        }
    }
}

std::vector<TestGrid> hills() {
    std::vector<TestGrid> grids;
    Random random(3);
    for (int k = 0; k < 40; k++) { // of any size, not of whole leaves
        const Vec3f o = random.in_box(1), x = random.direction(), y = random.direction();
        grids.push_back(
            make_grid(1 + int(random.below(19)), 1 + int(random.below(19)), [&](float u, float v) {
                const Vec3f p = o + x * (0.5f * u) + y * (0.5f * v);
                return p + cross(x, y) * (0.1f * waves(p, 9));
            }));
    }
    return grids;
}

} // namespace

TEST(Grids, AreHitAsByBruteForce) {
    expect_as_brute_force(Built(hills()), random_rays(4000, 1.5f, 1));
    expect_as_brute_force(Built(ball(2, 9, 1, 0.2f, 5)), random_rays(4000, 1.5f, 2));
}

TEST(Grids, AreHitInTheSameBitsByAnyLanes) {
    expect_same_bits(Built(hills()), random_rays(20000, 1.5f, 4));
    expect_same_bits(Built(ball(3, 17, 1, 0.2f, 5)), random_rays(20000, 1.5f, 5));
}

// A step that suits small cells is too fine for large ones: those take more bytes, and lose nothing.
TEST(Grids, OfAllSizesShareAPage) {
    std::vector<TestGrid> grids = ball(2, 8, 1, 0.2f, 5);
    grids.push_back(
        make_grid(8, 8, [](float u, float v) { return Vec3f(60 * u - 30, 9 * u + v - 8, 60 * v - 30); }));
    grids.push_back(
        make_grid(4, 4, [](float u, float v) { return Vec3f(1e6f * u - 5e5f, 1e6f * v - 5e5f, 1e5f); }));
    const Built b(std::move(grids));
    EXPECT_GT(b.leaves(Kind::Grid32), 0);
    EXPECT_GT(b.leaves(Kind::Grid48), 0);
    EXPECT_GT(b.leaves(Kind::GridFloat), 0);
    const std::vector<Ray> rays = random_rays(6000, 3, 6);
    expect_as_brute_force(b, rays);
    expect_same_bits(b, rays);
    // A twentieth of a cell, of the small ones too.
    for (int y = 0; y <= 8; y++)
        for (int x = 0; x <= 8; x++)
            EXPECT_LT(length(b.lattice.snap(b.grids[0].at(x, y)) - b.grids[0].at(x, y)), 0.05f * 0.1f);
}

TEST(Grids, LargerThanATileAreFoundByTheirCells) {
    const Built b({make_grid(700, 3, [](float u, float v) { return Vec3f(700 * u, 3 * v, 0); }),
                   make_grid(3, 300, [](float u, float v) { return Vec3f(3 * u, 300 * v, -5); })});
    for (int x = 0; x < 700; x += 13) {
        Ray r{{float(x) + 0.25f, 1.25f, 1}, 0, {0, 0, -1}};
        Hit h;
        closest(b.page(), {&r, 1}, {&h, 1});
        ASSERT_TRUE(h.found());
        const Cell c = cell_of(b.page(), h.leaf, h.primitive / 2);
        EXPECT_EQ(c.grid, 0u);
        EXPECT_EQ(c.column, x);
        EXPECT_EQ(c.row, 1);
        EXPECT_NEAR(h.u, 0.25f, 1e-3f);
        EXPECT_NEAR(h.v, 0.25f, 1e-3f);
    }
    Ray r{{1.5f, 299.5f, -9}, 0, {0, 0, 1}};
    Hit h;
    closest(b.page(), {&r, 1}, {&h, 1});
    ASSERT_TRUE(h.found());
    EXPECT_EQ(cell_of(b.page(), h.leaf, h.primitive / 2).row, 299);
}

TEST(Grids, ArePackedTheSameByAnyNumberOfThreads) {
    const std::vector<TestGrid> grids = ball(8, 32, 1, 0.2f, 5);
    const std::vector<GridView> v = views(grids);
    std::vector<PageMemory> pages;
    for (int threads : {1, 2, 7})
        tasks::with_threads(threads, [&] {
            const Content content{v, {}};
            pages.push_back(build(content, votes_of(content).lattice()));
        });
    for (const PageMemory& m : pages) {
        ASSERT_EQ(m.size(), pages[0].size());
        EXPECT_EQ(std::memcmp(m.data(), pages[0].data(), m.size()), 0);
    }
    // Eight bytes a micropolygon, all told.
    EXPECT_LT(double(pages[0].size()) / (6 * 64 * 1024), 8.2);
}

} // namespace kanuka::hierarchy::testing
