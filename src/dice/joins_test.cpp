// Which vertices of neighbouring faces are one, by what normals they were given; and traced lattices of a
// shape that lies along either of its parameters, forwards or backwards.
#include <cmath>
#include <gtest/gtest.h>

#include "dice/test_oracles.h"
#include "dice/test_scene.h"

namespace kanuka::dice {
namespace {

using namespace test;
using scene::Detail;
using scene::Type;

Diced run(const scene::Primitive& p, const DiceOptions& o, const Displace& displace = {}) {
    Journal journal;
    Diced d = dice::dice(p, {}, o, displace, journal);
    EXPECT_TRUE(journal.entries().empty());
    return d;
}

Vec3f leaning(double degrees, float size) {
    const double a = degrees * std::acos(-1.0) / 180;
    return {size * float(std::sin(a)), 0, -size * float(std::cos(a))};
}

// Two squares side by side whose normals, of any length, lean apart by an angle where they meet.
scene::Primitive pair(double degrees, float size) {
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>{4, 4};
    m.vertices = std::vector<int32_t>{0, 1, 4, 3, 1, 2, 5, 4};
    scene::Primitive p = primitive(m, {-1, -1, 0, 0, -1, 0, 1, -1, 0, -1, 1, 0, 0, 1, 0, 1, 1, 0});
    std::vector<float> n;
    for (const double a : {-degrees / 2, degrees / 2})
        for (int k = 0; k < 4; k++) {
            const Vec3f v = leaning(a, size);
            n.insert(n.end(), {v.x, v.y, v.z});
        }
    p.primvars.set(floats("N", Type::Normal, Detail::FaceVarying, n));
    return p;
}

} // namespace

// Grids share the normals of their seams where those differ by less than about a degree, after displacement
// too, whatever the normals' lengths.
TEST(Joins, NormalsOfSeamsGoByTheirAngle) {
    for (const float size : {0.01f, 0.3f, 1.0f, 4.0f, 100.0f})
        for (const double degrees : {0.3, 1.0, 1.3, 25.0}) {
            const Diced d = run(pair(degrees, size), looking(3, 200), [&](grid::Grid& g) {
                for (size_t i = 0; i < size_t(g.vertices()); i++) // tilted, each grid another way
                    g.N[i + size_t(g.stride)] += size * (g.P[0] < -0.5f ? 0.1f : -0.1f);
            });
            std::map<Key, std::array<std::vector<Vec3f>, 2>> seen; // by square
            for (const grid::Grid& g : d.grids)
                for (int i = 0; i < g.vertices(); i++) {
                    const Vec3f p = g.position(i);
                    if (std::abs(p.x) < 1e-6f)
                        seen[positive_zero({p.x, p.y, p.z})]
                            [g.position(0).x + g.position(g.vertices() - 1).x > 0]
                                .push_back(g.normal(i));
                }
            size_t same = 0, apart = 0;
            for (const auto& [at, normals] : seen)
                for (const Vec3f& left : normals[0])
                    for (const Vec3f& right : normals[1])
                        (left == right ? same : apart)++;
            EXPECT_GT(same + apart, 20u);
            EXPECT_EQ(degrees < 1.1 ? apart : same, 0u) << size << " " << degrees;
        }
}

// Of patches finer than the rate, which become one mesh: vertices where normals agree, two where they are
// folded.
TEST(Joins, MergedPatchesShareTheirVertices) {
    constexpr int N = 40;
    for (const float size : {0.0f, 0.02f, 1.0f, 50.0f}) // 0: the surface's own normals
        for (const double fold : {0.0, 0.8, 1.4, 20.0}) {
            scene::PatchMesh m;
            m.cubic = false;
            m.nu = m.nv = N + 1;
            std::vector<float> p, n;
            const double slope = std::tan(fold / 2 * std::acos(-1.0) / 180);
            for (int j = 0; j <= N; j++)
                for (int i = 0; i <= N; i++) {
                    const float x = float(i) / N - 0.5f, y = float(j) / N - 0.5f;
                    p.insert(p.end(), {x, y, std::abs(x) * float(slope)});
                    const Vec3f v = leaning(8 * double(x), size);
                    n.insert(n.end(), {v.x, v.y, v.z});
                }
            scene::Primitive patch = primitive(m, p);
            if (size > 0)
                patch.primvars.set(floats("N", Type::Normal, Detail::Vertex, n));
            const Diced d = run(patch, looking(4, 32));
            ASSERT_TRUE(d.is_mesh);
            const bool folded = size == 0 && fold > 1.1;
            EXPECT_EQ(d.mesh_vertices.vertices(), (N + 1) * (N + 1) + (folded ? N + 1 : 0))
                << size << " " << fold;
        }
}

namespace {

// z = height (1 - in) along^2 over the unit square: straight and flat at in = 1, straight along
// `in`. across: in runs along u; backwards: from 1 to 0, `along` too.
scene::Primitive ruled(float height, bool across, bool backwards) {
    scene::PatchMesh m;
    m.cubic = true;
    m.nu = m.nv = 4;
    m.u_basis = m.v_basis = scene::basis_by_name("bezier");
    const float bump[4] = {0, 0, height / 3, height}; // of t^2
    std::vector<float> p;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            const int a = across ? j : i, b = across ? i : j; // along, in
            const int k = backwards ? 3 - a : a, l = backwards ? 3 - b : b;
            const float t = float(k) / 3, in = float(l) / 3;
            p.insert(p.end(), {t, in, (1 - in) * bump[k]});
        }
    return primitive(m, p);
}
double height_of(double height, double t, double in) {
    return (1 - in) * height * t * t;
}

} // namespace

// A bent side opposite a straight one, at either end of u or of v: the lattice is near both, and the same
// whichever end it is.
TEST(Joins, FansBesideAnySide) {
    for (const float height : {0.2f, 0.6f})
        for (const float tolerance : {0.3f, 1.0f}) {
            for (const bool across : {false, true}) {
                std::array<int, 6> first{};
                for (const bool backwards : {false, true}) {
                    DiceOptions o = looking(3);
                    o.geometry_tolerance = tolerance, o.normal_tolerance = 60;
                    DiceTarget target;
                    target.pixels_per_unit = 32;
                    Journal journal;
                    const scene::Primitive p = ruled(height, across, backwards);
                    const Diced d = dice::dice(p, target, o, {}, journal);
                    ASSERT_EQ(d.grids.size(), 1u);
                    const grid::TracedGrid& t = d.traced[0];
                    // Along and in; then the bent side, the straight one and the two between.
                    const auto side = [&](bool straight) {
                        const bool low = straight == backwards;
                        return across ? (low ? grid::UMin : grid::UMax) : (low ? grid::VMin : grid::VMax);
                    };
                    const auto between = [&](bool end) {
                        const bool low = end == backwards;
                        return across ? (low ? grid::VMin : grid::VMax) : (low ? grid::UMin : grid::UMax);
                    };
                    const std::array<int, 6> steps{across ? t.step_v : t.step_u, across ? t.step_u : t.step_v,
                                                   t.edge_step[side(false)],     t.edge_step[side(true)],
                                                   t.edge_step[between(false)],  t.edge_step[between(true)]};
                    if (!backwards)
                        first = steps;
                    EXPECT_EQ(steps, first) << height << " " << tolerance << " " << across << backwards;
                    EXPECT_LT(steps[3], 32); // what lies beside it is twisted
                    double worst = 0;
                    for (const auto& q : traced_triangles(d, 0))
                        for (int i = 0; i <= 6; i++)
                            for (int j = 0; i + j <= 6; j++) {
                                const D3 at = q[0] + (q[1] - q[0]) * (i / 6.0) + (q[2] - q[0]) * (j / 6.0);
                                worst =
                                    std::max(worst, std::abs(at.z - height_of(double(height), at.x, at.y)));
                            }
                    EXPECT_LE(32 * worst, 1.05 * double(tolerance)) << height << " " << across << backwards;
                }
            }
        }
}

} // namespace kanuka::dice
