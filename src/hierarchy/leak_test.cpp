// Closed surfaces let no ray out: not between cells, leaves and grids, not at vertices, along edges or beside
// them.
#include <gtest/gtest.h>

#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"

namespace kanuka::hierarchy::testing {
namespace {

PageMemory page_of(const std::vector<TestGrid>& grids, Lattice& lattice) {
    const std::vector<GridView> v = views(grids);
    const Content content{v, {}};
    lattice = votes_of(content).lattice();
    return build(content, lattice);
}

// Rays from about the middle: anywhere, at vertices, at points of edges, along the edges of the page's own
// boxes. Grids' borders are aimed at as often as all else.
std::vector<Ray> aimed_rays(size_t count, const std::vector<TestGrid>& grids, const Lattice& lattice,
                            const Vec3f& centre, float side, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (size_t i = 0; i < count; i++) {
        Ray& r = rays[i];
        r.o = centre + random.in_box(side);
        if (i % 3 == 0) {
            r.d = random.direction();
            continue;
        }
        const TestGrid& g = grids[random.below(uint32_t(grids.size()))];
        int x = int(random.below(uint32_t(g.columns))), y = int(random.below(uint32_t(g.rows)));
        if (random.below(2))
            (random.below(2) ? x : y) = 0;
        const Vec3f a = lattice.snap(g.at(x, y)),
                    b = lattice.snap(random.below(2) ? g.at(x + 1, y) : g.at(x, y + 1));
        r.d = a + (b - a) * (i % 3 == 1 ? 0.0f : random.uniform()) - r.o;
    }
    return rays;
}

size_t leaks(const Page& page, const std::vector<Ray>& rays) {
    std::vector<Hit> hits(rays.size());
    std::vector<uint8_t> any(rays.size());
    closest(page, rays, hits);
    occluded(page, rays, any);
    size_t n = 0;
    for (size_t i = 0; i < rays.size(); i++)
        n += !hits[i].found() || any[i] == 0;
    return n;
}

constexpr size_t Rays = 200000;

} // namespace

TEST(Leaks, NoneFromADisplacedBall) {
    Lattice lattice;
    const std::vector<TestGrid> grids = ball(6, 21, 1, 0.15f, 9); // 21: leaves that are not whole
    const PageMemory page = page_of(grids, lattice);
    EXPECT_EQ(leaks(page.page(), aimed_rays(Rays, grids, lattice, {0, 0, 0}, 0.3f, 1)), 0u);
}

// Where floats are coarse beside the cells, and where rays come from afar.
TEST(Leaks, NoneFarFromTheOrigin) {
    Lattice lattice;
    const Vec3f centre(1e4f, -3e4f, 2e4f);
    const std::vector<TestGrid> grids = ball(3, 16, 10, 1, 0.7f, centre);
    const PageMemory page = page_of(grids, lattice);
    EXPECT_EQ(leaks(page.page(), aimed_rays(Rays, grids, lattice, centre, 3, 2)), 0u);
}

TEST(Leaks, NoneWhereThingsAreSmallOrLarge) {
    for (float size : {1e-6f, 1e6f}) {
        Lattice lattice;
        const std::vector<TestGrid> grids = ball(2, 16, size, 0.1f * size, 9 / size);
        const PageMemory page = page_of(grids, lattice);
        EXPECT_EQ(leaks(page.page(), aimed_rays(Rays, grids, lattice, {0, 0, 0}, 0.3f * size, 3)), 0u);
    }
}

// A box of flat sides: boxes have no thickness, and rays lie in planes of triangles.
TEST(Leaks, NoneFromACubeOnTheAxes) {
    std::vector<TestGrid> grids;
    for (int a = 0; a < 3; a++)
        for (float side : {-1.0f, 1.0f})
            grids.push_back(make_grid(8, 8, [&](float u, float v) {
                Vec3f p;
                p[a] = side, p[(a + 1) % 3] = 2 * u - 1, p[(a + 2) % 3] = 2 * v - 1;
                return p;
            }));
    Lattice lattice;
    const PageMemory page = page_of(grids, lattice);
    EXPECT_EQ(leaks(page.page(), aimed_rays(Rays, grids, lattice, {0, 0, 0}, 0.9f, 4)), 0u);
    std::vector<Ray> rays = aimed_rays(Rays, grids, lattice, {0, 0, 0}, 0.9f, 5);
    Random random(6);
    for (Ray& r : rays) { // on the lattice of the vertices, along axes and diagonals, from the walls too
        for (int a = 0; a < 3; a++) {
            r.o[a] = float(int(random.below(9)) - 4) / 4;
            r.d[a] = float(int(random.below(3)) - 1);
        }
        if (r.d == Vec3f(0.0f))
            r.d.x = 1;
    }
    EXPECT_EQ(leaks(page.page(), rays), 0u);
}

// A page that is laid over two lattices has cracks: so these tests would see one.
TEST(Leaks, AreSeen) {
    Lattice lattice;
    std::vector<TestGrid> grids = ball(2, 16, 1, 0.1f, 9);
    page_of(grids, lattice);
    for (TestGrid& g : grids)
        if (&g - grids.data() == 5)
            for (float& x : g.positions)
                x *= 1.00001f;
    const PageMemory page = page_of(grids, lattice);
    EXPECT_GT(leaks(page.page(), aimed_rays(Rays, grids, lattice, {0, 0, 0}, 0.3f, 1)), 0u);
}

} // namespace kanuka::hierarchy::testing
