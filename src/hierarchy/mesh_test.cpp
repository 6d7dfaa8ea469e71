// Pages of triangles, and of triangles beside grids.
#include <gtest/gtest.h>

#include "hierarchy/decode.h"
#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"

namespace kanuka::hierarchy::testing {
namespace {

struct TestMesh {
    std::vector<float> positions;
    std::vector<uint32_t> corners;
    MeshView view() const {
        return {positions.data(), positions.size() / 3, corners.data(), corners.size() / 3};
    }
    Vec3f at(uint32_t vertex) const {
        return {positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]};
    }
};

// A closed ball of triangles of all sizes: its poles are fans.
TestMesh globe(int around, int up, float radius, const Vec3f& centre, float bumps) {
    TestMesh m;
    const auto add = [&](const Vec3f& d) {
        const Vec3f p = centre + d * (radius + bumps * waves(d, 7));
        m.positions.insert(m.positions.end(), {p.x, p.y, p.z});
    };
    add({0, 0, 1}), add({0, 0, -1});
    for (int j = 1; j < up; j++)
        for (int i = 0; i < around; i++) {
            const float a = 2 * Pi * float(i) / float(around), b = Pi * float(j) / float(up);
            add({std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)});
        }
    const auto vertex = [&](int i, int j) {
        return j == 0 ? 0u : j == up ? 1u : uint32_t(2 + (j - 1) * around + i % around);
    };
    for (int j = 0; j < up; j++)
        for (int i = 0; i < around; i++) {
            const uint32_t a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i, j + 1),
                           d = vertex(i + 1, j + 1);
            if (j > 0)
                m.corners.insert(m.corners.end(), {a, c, b});
            if (j + 1 < up)
                m.corners.insert(m.corners.end(), {b, c, d});
        }
    return m;
}

struct Built {
    std::vector<TestMesh> meshes;
    std::vector<TestGrid> grids;
    Lattice lattice;
    PageMemory memory;

    explicit Built(std::vector<TestMesh> m, std::vector<TestGrid> g = {})
        : meshes(std::move(m)), grids(std::move(g)) {
        std::vector<MeshView> mesh_views;
        for (const TestMesh& x : meshes)
            mesh_views.push_back(x.view());
        const std::vector<GridView> grid_views = views(grids);
        const Content content{grid_views, mesh_views};
        lattice = votes_of(content).lattice();
        memory = build(content, lattice);
    }
    Page page() const { return memory.page(); }
    std::vector<Face> faces() const {
        std::vector<Face> all;
        for (const TestMesh& m : meshes)
            for (size_t f = 0; f < m.corners.size(); f += 3)
                all.push_back({lattice.snap(m.at(m.corners[f])), lattice.snap(m.at(m.corners[f + 1])),
                               lattice.snap(m.at(m.corners[f + 2])), uint32_t(all.size())});
        return all;
    }
};

std::vector<Ray> random_rays(size_t count, float side, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& r : rays)
        r.o = random.in_box(side), r.d = random.direction() * random.uniform(0.1f, 10);
    return rays;
}

void expect_same_bits(const Built& b, const std::vector<Ray>& rays) {
    std::vector<Hit> eight(rays.size()), sixteen(rays.size()), widest(rays.size());
    std::vector<uint8_t> any(rays.size()), any_of_widest(rays.size());
    closest_w8(b.page(), rays, eight), closest_w16(b.page(), rays, sixteen), closest(b.page(), rays, widest);
    occluded_w8(b.page(), rays, any), occluded(b.page(), rays, any_of_widest);
    Oracle oracle(b.page());
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit one = oracle.closest(rays[i]);
        ASSERT_EQ(eight[i], one) << "ray " << i;
        ASSERT_EQ(sixteen[i], one) << "ray " << i;
        ASSERT_EQ(widest[i], one) << "ray " << i;
        ASSERT_EQ(any[i] != 0, one.found()) << "ray " << i;
        ASSERT_EQ(any_of_widest[i] != 0, one.found()) << "ray " << i;
    }
}

void expect_as_brute_force(const Built& b, const std::vector<Ray>& rays) {
    const std::vector<Face> faces = b.faces();
    std::vector<Hit> hits(rays.size());
    closest(b.page(), rays, hits);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Reference r = brute_force(faces, rays[i]);
        if (r.margin < 1e-4)
            continue;
        ASSERT_EQ(hits[i].found(), r.t < INFINITY) << "ray " << i;
        if (!hits[i].found())
            continue;
        found++;
        EXPECT_NEAR(hits[i].t, r.t, 2e-5 * (1 + r.t)) << "ray " << i;
        const uint32_t name = b.page().name(hits[i].leaf, int(hits[i].primitive));
        EXPECT_EQ(name, r.name) << "ray " << i;
        const Corners c = corners_of(b.page(), hits[i].leaf, hits[i].primitive);
        EXPECT_EQ(c.at[0], faces[name].a);
        EXPECT_EQ(c.at[1], faces[name].b);
        EXPECT_EQ(c.at[2], faces[name].c);
        const Vec3f p = c.at[0] * (1 - hits[i].u - hits[i].v) + c.at[1] * hits[i].u + c.at[2] * hits[i].v;
        EXPECT_LT(length(p - (rays[i].o + rays[i].d * hits[i].t)), 1e-4f) << "ray " << i;
    }
    EXPECT_GT(found, rays.size() / 5);
}

// Rays from within hit something: at random, at vertices, along edges.
void expect_closed(const Built& b) {
    Random random(4);
    std::vector<Ray> rays(200000);
    const TestMesh& m = b.meshes[0];
    for (size_t i = 0; i < rays.size(); i++) {
        Ray& r = rays[i];
        r.o = random.in_box(0.4f);
        const size_t face = random.below(uint32_t(m.corners.size() / 3));
        const Vec3f p = b.lattice.snap(m.at(m.corners[3 * face])),
                    q = b.lattice.snap(m.at(m.corners[3 * face + 1]));
        r.d = i % 3 == 0 ? random.direction() : (i % 3 == 1 ? p : p + (q - p) * random.uniform()) - r.o;
    }
    std::vector<Hit> hits(rays.size());
    closest(b.page(), rays, hits);
    for (size_t i = 0; i < rays.size(); i++)
        ASSERT_TRUE(hits[i].found()) << i;
}

} // namespace

TEST(Meshes, AreHitAsByBruteForce) {
    const Built b({globe(30, 17, 1, {0, 0, 0}, 0.1f), globe(9, 5, 0.3f, {1, 1, 0}, 0)});
    EXPECT_EQ(refusal_of(b.memory.bytes()), "");
    expect_as_brute_force(b, random_rays(5000, 1.5f, 1));
}

TEST(Meshes, AreHitInTheSameBitsByAnyLanes) {
    expect_same_bits(Built({globe(30, 17, 1, {0, 0, 0}, 0.1f), globe(9, 5, 0.3f, {1, 1, 0}, 0)}),
                     random_rays(20000, 1.5f, 2));
    // Beside grids, and where triangles are too large for the step of small ones.
    TestMesh large;
    large.positions = {-500, -500, -2, 500, -500, -2.5f, 0, 700, -3};
    large.corners = {0, 1, 2};
    const Built b({globe(30, 17, 1, {0, 0, 0}, 0.1f), large}, ball(2, 9, 0.7f, 0.05f, 5));
    EXPECT_GT(b.page().header().section[int(Kind::TriangleFloat)].leaf_bytes, 0u);
    EXPECT_GT(b.page().header().section[int(Kind::Grid32)].leaf_bytes, 0u);
    expect_same_bits(b, random_rays(20000, 1.5f, 3));
}

// A globe whose leaves are too large for 32 bits, since one within it is fifty times smaller.
TEST(Meshes, OfAllKindsOfLeavesAreHitAsByBruteForceAndInTheSameBits) {
    const std::vector<TestMesh> globes{globe(30, 17, 1, {0, 0, 0}, 0.1f),
                                       globe(30, 17, 0.02f, {0.3f, 0, 0}, 0)};
    const Built two(globes);
    for (Kind kind : {Kind::Triangle32, Kind::Triangle48})
        EXPECT_GT(two.page().header().section[int(kind)].leaf_bytes, 0u) << int(kind);
    EXPECT_EQ(refusal_of(two.memory.bytes()), "");
    expect_as_brute_force(two, random_rays(5000, 1.2f, 5));
    expect_same_bits(two, random_rays(20000, 1.2f, 6));
    // Floats beside them.
    TestMesh large;
    large.positions = {-500, -500, -2, 500, -500, -2.5f, 0, 700, -3};
    large.corners = {0, 1, 2};
    const Built three({globes[0], globes[1], large});
    for (Kind kind : {Kind::Triangle32, Kind::Triangle48, Kind::TriangleFloat})
        EXPECT_GT(three.page().header().section[int(kind)].leaf_bytes, 0u) << int(kind);
    expect_same_bits(three, random_rays(20000, 1.2f, 7));
}

// The finer the lattice, the more leaves need 48 bits: the large first. Closed where the two kinds meet.
TEST(Meshes, LetNoRayOutWhereKindsOfLeavesMeet) {
    Built b({globe(60, 31, 1, {0, 0, 0}, 0.1f)});
    const MeshView view = b.meshes[0].view();
    int mixed = 0;
    for (int finer = 0; finer < 10; finer++) {
        b.memory = build({{}, {&view, 1}}, b.lattice);
        const Section* sections = b.page().header().section;
        if (sections[int(Kind::Triangle32)].leaf_bytes != 0 &&
            sections[int(Kind::Triangle48)].leaf_bytes != 0) {
            expect_closed(b);
            mixed++;
        }
        b.lattice.exponent--;
    }
    EXPECT_GT(mixed, 0);
}

TEST(Meshes, LetNoRayOut) {
    expect_closed(Built({globe(60, 31, 1, {0, 0, 0}, 0.1f)}));
}

TEST(Meshes, LeaveOutFacesThatAreNowhere) {
    TestMesh m;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    m.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, nan, 0, 0};
    m.corners = {0, 1, 2, 0, 1, 3, 0, 1, 77};
    const Built b({m});
    EXPECT_EQ(refusal_of(b.memory.bytes()), "");
    const Ray r{{0.25f, 0.25f, 1}, 0, {0, 0, -1}};
    Hit h;
    closest(b.page(), {&r, 1}, {&h, 1});
    ASSERT_TRUE(h.found());
    EXPECT_EQ(b.page().name(h.leaf, int(h.primitive)), 0u);
    EXPECT_EQ(corners_of(b.page(), h.leaf, h.primitive).normal(), Vec3f(0, 0, 1));
}

TEST(Meshes, TakeFewBytesATriangle) {
    const Built b({globe(300, 200, 1, {0, 0, 0}, 0.1f)});
    const double bytes = double(b.memory.size()) / double(b.meshes[0].corners.size() / 3);
    EXPECT_LT(bytes, 22);
    RecordProperty("bytes_a_triangle", std::to_string(bytes));
}

// As dicing leaves them where an edge was collapsed, and any triangle that is seen from its edge. A ray that
// passes exactly through one finds the nearest point of it there, with the weights of that point.
TEST(Meshes, TrianglesThatAreSeenAsLinesAreHitWhereTheyAre) {
    const Vec3f a(-1, -0.5f, 2), b(1, 0.5f, 3), middle = (a + b) * 0.5f, behind(0.5f, 0.25f, 4);
    const Vec3f sets[][3] = {{a, b, b}, {a, a, b}, {b, a, b}, {a, middle, b}, {b, middle, a}, {a, behind, b}};
    for (const auto& corners : sets) {
        TestMesh m;
        for (const Vec3f& p : corners)
            m.positions.insert(m.positions.end(), {p.x, p.y, p.z});
        m.corners = {0, 1, 2};
        const Built built({m});
        for (int k = -2; k <= 10; k++) {
            const Vec3f at = lerp(float(k) / 8, a, b);
            const Ray r{{at.x, at.y, -1}, 0, {0, 0, 2}};
            Hit h;
            closest(built.memory.page(), {&r, 1}, {&h, 1});
            ASSERT_EQ(h.found(), k >= 0 && k <= 8) << k;
            if (!h.found())
                continue;
            EXPECT_FLOAT_EQ(h.t, (at.z + 1) / 2);
            const Vec3f hit = corners[0] * (1 - h.u - h.v) + corners[1] * h.u + corners[2] * h.v;
            EXPECT_LT(length(hit - at), 1e-6f);
        }
    }
}

} // namespace kanuka::hierarchy::testing
