#include "scene/counts.h"

#include <gtest/gtest.h>

namespace kanuka::scene {

static Buffer<int32_t> ints(std::vector<int32_t> v) {
    return v;
}

using Five = std::array<size_t, 5>;

static Five all(const Geometry& g, size_t positions = 0) {
    const PrimvarCounts c = primvar_counts(g, positions);
    EXPECT_EQ(c.of(Detail::Constant), 1u);
    return {c.of(Detail::Uniform), c.of(Detail::Varying), c.of(Detail::Vertex), c.of(Detail::FaceVarying),
            c.of(Detail::FaceVertex)};
}

TEST(Counts, Polygons) {
    PolygonMesh m;
    EXPECT_EQ(all(m, 6), (Five{2, 6, 6, 6, 6})); // two triangles without indices
    m.vertices_per_loop = ints({4, 3});
    EXPECT_EQ(all(m, 7), (Five{2, 7, 7, 7, 7}));
    m.vertices = ints({0, 1, 2, 3, 0, 2, 4});
    EXPECT_EQ(all(m, 9), (Five{2, 5, 5, 7, 7})); // the indices count, not what P has to spare
    m.loops_per_face = ints({2});
    EXPECT_EQ(all(m, 9)[0], 1u);
}

TEST(Counts, Patches) {
    PatchMesh m; // one bicubic bezier patch
    EXPECT_EQ(all(m), (Five{1, 4, 16, 4, 16}));
    m.nu = 7;
    EXPECT_EQ(all(m), (Five{2, 6, 28, 6, 28}));
    m.nu = 6;
    m.u_periodic = true;
    EXPECT_EQ(all(m), (Five{2, 4, 24, 4, 24}));
    m.u_basis = basis_by_name("b-spline");
    EXPECT_EQ(all(m), (Five{6, 12, 24, 12, 24}));
    m.cubic = false;
    m.u_periodic = false;
    m.nu = 3, m.nv = 2;
    EXPECT_EQ(all(m), (Five{2, 6, 6, 6, 6}));
    NuPatch n{};
    n.nu = 6, n.u_order = 4, n.nv = 3, n.v_order = 3;
    EXPECT_EQ(all(n), (Five{3, 8, 18, 8, 18}));
}

TEST(Counts, TheRest) {
    EXPECT_EQ(all(Quadric{Quadric::Kind::Sphere, {1, -1, 1, 360}}), (Five{1, 4, 4, 4, 4}));
    EXPECT_EQ(all(Points{}, 5), (Five{1, 5, 5, 5, 5}));
    Curves c;
    c.vertices_per_curve = ints({4, 7});
    EXPECT_EQ(all(c), (Five{2, 5, 11, 5, 11}));
    c.basis = basis_by_name("b-spline");
    EXPECT_EQ(all(c), (Five{2, 7, 11, 7, 11}));
    c.periodic = true;
    EXPECT_EQ(all(c), (Five{2, 11, 11, 11, 11}));
    c.cubic = false;
    EXPECT_EQ(all(c), (Five{2, 11, 11, 11, 11}));
    SubdivisionMesh s;
    s.vertices_per_face = ints({4, 3});
    s.vertices = ints({0, 1, 2, 3, 0, 2, 4});
    EXPECT_EQ(all(s), (Five{2, 5, 5, 7, 7}));
}

static std::string fault(const Geometry& g, size_t positions) {
    return fault_of(g, positions).value_or("");
}

TEST(Counts, Faults) {
    PolygonMesh m;
    m.vertices_per_loop = ints({3});
    m.vertices = ints({0, 1, 2});
    EXPECT_EQ(fault(m, 3), "");
    EXPECT_NE(fault(m, 2).find("vertex index 2"), std::string::npos);
    m.loops_per_face = ints({2});
    EXPECT_NE(fault(m, 3).find("nverts: expected 2"), std::string::npos);
    PatchMesh p;
    EXPECT_EQ(fault(p, 16), "");
    EXPECT_NE(fault(p, 15).find("P: expected 16"), std::string::npos);
    p.nu = 1'000'000'003; // 4 + 3k: sizes must not overflow
    EXPECT_NE(fault(p, 16), "");
    NuPatch n{};
    n.nu = n.nv = 2, n.u_order = n.v_order = 2;
    n.u_knots = n.v_knots = std::vector<float>{0, 0, 1, 1};
    n.u_max = n.v_max = 1;
    EXPECT_EQ(fault(n, 4), "");
    n.v_max = 2;
    EXPECT_NE(fault(n, 4).find("vmin and vmax"), std::string::npos);
    Curves c;
    EXPECT_EQ(fault(c, 4), "there are no curves");
}

} // namespace kanuka::scene
