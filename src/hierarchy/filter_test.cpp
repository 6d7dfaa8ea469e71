// Filters: what they refuse is not there. Beside all candidates in doubles, and beside one lane to the bit.
#include <gtest/gtest.h>
#include <numeric>

#include "hierarchy/queue.h"
#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::testing {
namespace {

struct Meeting {
    uint32_t face;
    double t, u, v;
};
// Above zero: it is there for that ray; below: it is refused. How far from zero says how sure that is.
using Rule = double (*)(size_t ray, const Meeting&);

double by_face(size_t ray, const Meeting& c) {
    return (c.face + ray) % 3 == 0 ? -1 : 1;
}
double by_place(size_t, const Meeting& c) {
    return (c.u - 0.5) * (c.v - 0.4); // two of four fields of each cell
}
double by_distance(size_t ray, const Meeting& c) {
    return c.t - 0.25 * double(ray % 8);
}
double nothing(size_t, const Meeting&) {
    return -1;
}
constexpr Rule Rules[] = {by_face, by_place, by_distance, nothing};

// The same triangles twice: as grids, and as a mesh. Layers within each other, so that rays have more to hit.
struct Scene {
    std::vector<TestGrid> grids = ball(2, 9, 1, 0.1f, 5);
    Lattice lattice;
    PageMemory memory;
    std::vector<Face> faces;
    bool is_mesh;

    explicit Scene(bool mesh) : is_mesh(mesh) {
        for (float radius : {0.8f, 0.5f})
            for (TestGrid& g : ball(2, 7, radius, 0.05f, 7))
                grids.push_back(std::move(g));
        const std::vector<GridView> grid_views = views(grids);
        const MeshOfGrids triangles(grids);
        const MeshView mesh_view = triangles.view();
        const Content content = mesh ? Content{{}, {&mesh_view, 1}} : Content{grid_views, {}};
        lattice = votes_of(content).lattice();
        memory = build(content, lattice);
        faces = faces_of(grids, lattice);
    }
    Meeting candidate(const Page& page, const Hit& h) const {
        if (is_mesh)
            return {page.name(h.leaf, int(h.primitive)), h.t, h.u, h.v};
        const Cell cell = cell_of(page, h.leaf, h.primitive / 2);
        uint32_t face = 0;
        for (uint32_t g = 0; g < cell.grid; g++)
            face += uint32_t(grids[g].columns * grids[g].rows * 2);
        face += uint32_t(cell.row * grids[cell.grid].columns + cell.column) * 2 + h.primitive % 2;
        return {face, h.t, h.u, h.v};
    }
};

struct Filter {
    static constexpr bool Filters = true;
    const Scene& scene;
    Rule rule;
    std::span<const size_t> number; // of rays, as the rule knows them

    bool accepts(const Candidate& c) const { return accepts(c.ray, c.page, c.hit); }
    bool accepts(size_t ray, const Page& page, const Hit& h) const {
        return rule(number[ray], scene.candidate(page, h)) > 0;
    }
};

struct Expected {
    double t = INFINITY;
    uint32_t face = 0;
    double margin = INFINITY; // of the least sure decision
};
// Every candidate there is, in doubles.
Expected brute_force(const Scene& scene, const Ray& r, size_t ray, Rule rule) {
    Expected best;
    double second = INFINITY;
    const Point o(r.o), d(r.d);
    for (const Face& f : scene.faces) {
        const Point a(f.a), e1 = Point(f.b) - a, e2 = Point(f.c) - a, p = cross(d, e2);
        const double det = dot(e1, p);
        if (!(det != 0))
            continue;
        const Point s = o - a, q = cross(s, e1);
        Meeting c{f.name, dot(e2, q) / det, dot(s, p) / det, dot(d, q) / det};
        const double inside = std::min({c.u, c.v, 1 - c.u - c.v});
        if (!(c.t >= r.t_min && c.t <= r.t_max))
            continue;
        best.margin = std::min(best.margin, std::abs(inside));
        if (!(inside >= 0))
            continue;
        if (!scene.is_mesh && f.name % 2 == 1)
            c.u = 1 - c.u, c.v = 1 - c.v; // within the cell
        const double there = rule(ray, c);
        best.margin = std::min(best.margin, std::abs(there));
        if (there > 0 && c.t < best.t)
            second = best.t, best.t = c.t, best.face = f.name;
        else if (there > 0)
            second = std::min(second, c.t);
    }
    if (second < INFINITY)
        best.margin = std::min(best.margin, second - best.t);
    return best;
}

std::vector<Ray> random_rays(size_t count) {
    Random random(21);
    std::vector<Ray> rays(count);
    for (Ray& r : rays)
        r.o = random.in_box(0.9f), r.d = random.direction();
    return rays;
}
std::vector<size_t> in_order(size_t count) {
    std::vector<size_t> number(count);
    std::iota(number.begin(), number.end(), size_t(0));
    return number;
}

void expect_as_brute_force(const Scene& scene, Rule rule) {
    const std::vector<Ray> rays = random_rays(1500);
    const std::vector<size_t> number = in_order(rays.size());
    Filter filter{scene, rule, number};
    const Page page = scene.memory.page();
    std::vector<Hit> closest(rays.size()), any(rays.size());
    std::vector<uint8_t> hidden(rays.size());
    find_closest<8>(page, rays, closest, filter);
    find_any<8>(page, rays, hidden, filter);
    RayQueue<8, Query::Any, Filter>(page, rays, filter).run([&](size_t i, const Hit& h, const InstancePath&) {
        any[i] = h;
    });
    size_t compared = 0, found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Expected e = brute_force(scene, rays[i], i, rule);
        if (e.margin < 1e-4)
            continue;
        compared++;
        ASSERT_EQ(closest[i].found(), e.t < INFINITY) << "ray " << i;
        ASSERT_EQ(hidden[i] != 0, e.t < INFINITY) << "ray " << i;
        ASSERT_EQ(any[i].found(), e.t < INFINITY) << "ray " << i;
        if (!closest[i].found())
            continue;
        found++;
        EXPECT_NEAR(closest[i].t, e.t, 2e-5 * (1 + e.t)) << "ray " << i;
        EXPECT_EQ(scene.candidate(page, closest[i]).face, e.face) << "ray " << i;
        EXPECT_GT(rule(i, scene.candidate(page, any[i])), 0) << "ray " << i;
    }
    EXPECT_GT(compared, 1000u);
    EXPECT_EQ(found > 400, rule != nothing) << found;
}

void expect_same_bits(const Scene& scene, Rule rule) {
    const std::vector<Ray> rays = random_rays(6000);
    std::vector<size_t> number = in_order(rays.size());
    Filter filter{scene, rule, number};
    const Page page = scene.memory.page();
    std::vector<Hit> eight(rays.size()), sixteen(rays.size()), shuffled(rays.size());
    find_closest<8>(page, rays, eight, filter);
    find_closest<16>(page, rays, sixteen, filter);
    Oracle oracle(page);
    for (size_t i = 0; i < rays.size(); i++) {
        oracle.accepts = [&](const Hit& h) { return filter.accepts(i, page, h); };
        const Hit one = oracle.closest(rays[i]);
        ASSERT_EQ(eight[i], one) << "ray " << i;
        ASSERT_EQ(sixteen[i], one) << "ray " << i;
    }
    // Whatever rays are beside them, and whatever their order.
    std::shuffle(number.begin(), number.end(), std::mt19937(5));
    std::vector<Ray> mixed(rays.size());
    for (size_t i = 0; i < rays.size(); i++)
        mixed[i] = rays[number[i]];
    Filter of_mixed{scene, rule, number};
    find_closest<8>(page, mixed, shuffled, of_mixed);
    for (size_t i = 0; i < rays.size(); i++)
        ASSERT_EQ(shuffled[i], eight[number[i]]) << "ray " << number[i];
}

} // namespace

TEST(Filters, RefuseInGridsAsBruteForceDoes) {
    const Scene scene(false);
    for (Rule rule : Rules)
        expect_as_brute_force(scene, rule);
}

TEST(Filters, RefuseInMeshesAsBruteForceDoes) {
    const Scene scene(true);
    for (Rule rule : Rules)
        expect_as_brute_force(scene, rule);
}

TEST(Filters, FindTheSameBitsByAnyLanesAndInAnyOrder) {
    for (bool mesh : {false, true}) {
        const Scene scene(mesh);
        for (Rule rule : Rules)
            expect_same_bits(scene, rule);
    }
}

} // namespace kanuka::hierarchy::testing
