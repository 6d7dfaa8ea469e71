// How coarse the traced geometry may be, against the geometry of circles; and that it does not matter which
// way round a surface runs.
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <set>

#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;

namespace {

Diced run(const scene::Primitive& p, const DiceOptions& o, const DiceTarget& target = {}) {
    Journal journal;
    Diced d = dice::dice(p, target, o, {}, journal);
    EXPECT_TRUE(journal.entries().empty());
    return d;
}

// A tube of radius 1, a quarter of it a grid of 32 cells, each a micropolygon.
Diced tube(float geometry_tolerance, float normal_tolerance) {
    DiceOptions o = looking(3);
    o.geometry_tolerance = geometry_tolerance, o.normal_tolerance = normal_tolerance;
    DiceTarget target;
    target.pixels_per_unit = float(32 / (M_PI / 2));
    return run(primitive(scene::Quadric{scene::Quadric::Kind::Cylinder, {1, 0, 1, 360}}), o, target);
}

constexpr double CellAngle = M_PI / 2 / 32;

} // namespace

// A chord of k cells lies across the middle of what it stands for, and the last of its cells leans from it by
// half of k - 1 of their angles.
TEST(Simplify, TubesTurnByTheNormalTolerance) {
    for (const double factor : {0.49, 0.51, 1.49, 1.51, 3.49, 3.51, 7.49, 7.51}) {
        const Diced d = tube(1000, float(factor * CellAngle * 180 / M_PI));
        int most = 1;
        while (most * 2 <= 32 && (most * 2 - 1) / 2.0 <= factor)
            most *= 2;
        ASSERT_EQ(d.traced.size(), 4u);
        for (size_t k = 0; k < 4; k++) {
            ASSERT_EQ(d.grids[k].nu, 32);
            EXPECT_EQ(d.traced[k].step_u, most) << factor;
            EXPECT_EQ(d.traced[k].edge_step[grid::VMin], most) << factor;
            EXPECT_EQ(d.traced[k].edge_step[grid::VMax], most) << factor;
            EXPECT_EQ(d.traced[k].mv, 1) << factor; // straight
        }
    }
}

// What shines along its normals shows them: whatever the tolerance, facets turn by half a degree or are
// micropolygons. A tube of 2.8 degrees a cell keeps all of them; straight lines stay one cell.
TEST(Simplify, FacetsOfWhatShinesAlongItsNormalsAreFine) {
    DiceOptions o = looking(3);
    o.geometry_tolerance = 1000, o.normal_tolerance = 90;
    DiceTarget target;
    target.shines_along_normals = true;
    const scene::Primitive tube = primitive(scene::Quadric{scene::Quadric::Kind::Cylinder, {1, 0, 1, 360}});
    for (const double cells : {32.0, 1024.0}) { // of a quarter
        target.pixels_per_unit = float(cells / (M_PI / 2));
        const double angle = 90 / cells;
        const Diced d = run(tube, o, target);
        ASSERT_FALSE(d.traced.empty());
        for (const grid::TracedGrid& t : d.traced) {
            EXPECT_LE((t.step_u - 1) / 2.0 * angle, 0.5) << cells;
            EXPECT_GT((2 * t.step_u - 1) / 2.0 * angle, 0.5) << cells << ": no finer than that";
            EXPECT_EQ(t.mv, 1);
        }
    }
}

// Each time that every other vertex is left out, those h cells from both neighbours lie 1 - cos(h a) from
// their middle. The sums of that may be half of the tolerance along an edge.
TEST(Simplify, TubesKeepTheirDistance) {
    const double unit = 32 / (M_PI / 2); // pixels
    double bound[6] = {};
    for (int k = 1; k < 6; k++)
        bound[k] = bound[k - 1] + 1 - std::cos((1 << (k - 1)) * CellAngle);
    for (int level = 1; level < 5; level++)
        for (const double factor : {0.99, 1.01}) {
            const Diced d = tube(float(2 * bound[level] * unit * factor), 90);
            ASSERT_EQ(d.traced.size(), 4u);
            for (const grid::TracedGrid& t : d.traced) {
                const int step = factor > 1 ? 1 << level : 1 << (level - 1);
                EXPECT_EQ(t.edge_step[grid::VMin], step) << level;
                EXPECT_EQ(t.step_u, step) << level;
                EXPECT_EQ(t.mv, 1);
            }
        }
}

namespace {

// z = height x y over the unit square, 32 cells a side.
Diced saddle(double height, float geometry_tolerance, float normal_tolerance) {
    DiceOptions o = looking(3);
    o.geometry_tolerance = geometry_tolerance, o.normal_tolerance = normal_tolerance;
    DiceTarget target;
    target.pixels_per_unit = 32;
    scene::PatchMesh m;
    m.cubic = false;
    m.nu = m.nv = 2;
    return run(primitive(m, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, float(height)}), o, target);
}

// Of the squares of `step` cells along a side, the largest: how far apart both diagonals' middles lie across
// the square, a half of that each; what the normals of its corners on the side and inside turn, tangent.
struct Twist {
    double distance = 0, turn = 0;
    Twist(double height, int side, int step) {
        const double s = step / 32.0;
        for (int k = 0; k + step <= 32; k += step) {
            const double t = k / 32.0;
            const auto corner = [&](double along, double in) { // in x and y
                const bool far = side == grid::VMax || side == grid::UMax, along_u = side % 2 == 0;
                const double across = far ? 1 - in : in;
                return along_u ? std::array{along, across} : std::array{across, along};
            };
            const auto a = corner(t, 0), c = corner(t + s, s);
            const double nx = height * (a[1] - c[1]), ny = height * (a[0] - c[0]); // of (-h y, -h x, 1)
            const double cz = height * height * (a[0] * c[1] - a[1] * c[0]);
            const double both = 1 + height * height * (a[0] * c[0] + a[1] * c[1]);
            turn = std::max(turn, std::sqrt(nx * nx + ny * ny + cz * cz) / both);
            // The plane across the diagonals, through their mean directions.
            const double mx = height * (a[1] + c[1]), my = height * (a[0] + c[0]);
            distance = std::max(distance, 0.25 * height * s * s / std::sqrt(1 + (mx * mx + my * my) / 4));
        }
    }
};

} // namespace

// Straight sides of a twisted surface keep as many vertices as what lies beside them needs: by what normals
// turn over a square, which may be twice the tolerance, and by how far its two triangles lie from it, which
// may be a half.
TEST(Simplify, StraightSidesFollowTheTwist) {
    for (const double height : {0.3, 1.0})
        for (const int most : {2, 4, 8, 16}) {
            const auto expect = [&](const Diced& d, bool by_turn, double limit) {
                ASSERT_EQ(d.grids.size(), 1u);
                ASSERT_EQ(d.grids[0].nu, 32);
                for (int side = 0; side < 4; side++) {
                    int step = 32;
                    const auto over = [&](const Twist& t) { return (by_turn ? t.turn : t.distance) > limit; };
                    while (step > 1 && over(Twist(height, side, step)))
                        step /= 2;
                    EXPECT_EQ(d.traced[0].edge_step[size_t(side)], step)
                        << height << " " << most << " " << side;
                }
            };
            const Twist at(height, grid::VMin, most);
            for (const double factor : {0.97, 1.03}) {
                const double degrees = std::atan(at.turn * factor) * 180 / M_PI;
                if (degrees < 80)
                    expect(saddle(height, 1000, float(degrees / 2)), true, at.turn * factor);
                expect(saddle(height, float(2 * 32 * at.distance * factor), 90), false, at.distance * factor);
            }
        }
}

namespace {

struct Counts {
    size_t grids, cells, traced;
    bool operator==(const Counts&) const = default;
    friend std::ostream& operator<<(std::ostream& to, const Counts& c) {
        return to << c.grids << " grids, " << c.cells << " cells, " << c.traced << " traced";
    }
};

Counts counts(const Diced& d) {
    return {d.grids.size(), cell_count(d), traced_count(d)};
}

// 4 x 4 points of a Bezier patch: run backwards along u, along v.
scene::Primitive patch(const std::vector<Vec3f>& points, bool back_u, bool back_v) {
    scene::PatchMesh m;
    m.cubic = true;
    m.nu = m.nv = 4;
    m.u_basis = m.v_basis = scene::basis_by_name("bezier");
    std::vector<float> p;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            const Vec3f& q = points[size_t((back_v ? 3 - j : j) * 4 + (back_u ? 3 - i : i))];
            p.insert(p.end(), {q.x, q.y, q.z});
        }
    return primitive(m, p);
}

} // namespace

// Patches that come towards the camera at one corner, narrow towards one side, bulge and twist: all the same
// backwards.
TEST(Simplify, PatchesThatRunBackwardsAreDicedAlike) {
    const auto make = [](auto f) {
        std::vector<Vec3f> points;
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++)
                points.push_back(f(float(i) / 3, float(j) / 3));
        return points;
    };
    const std::vector<Vec3f> shapes[] = {
        make([](float u, float v) { return Vec3f(4 * u - 2, 4 * v - 2, 1.9f - 1.4f * (u + v)); }), // a slope
        make([](float u, float v) { // bent, the nearest corner last
            return Vec3f(3 * u - 1.5f, 3 * v - 1.5f, 1 - 1.2f * (u + v) + 0.3f * u * (1 - u) + 0.2f * v * v);
        }),
        make([](float u, float v) { return Vec3f((2 * u - 1) * (1.05f - v), 2 * v - 1, 0); }), // narrow
        make([](float u, float v) { return Vec3f(2 * u - 1, (2 * v - 1) * (1.05f - u), 0); }),
        make([](float u, float v) { // twisted
            return Vec3f(2 * u - 1, 2 * v - 1, 0.8f * (u - 0.5f) * (v - 0.5f) + 0.2f * u * u * v);
        })};
    for (size_t k = 0; k < std::size(shapes); k++)
        for (const bool uniform : {false, true})
            for (const int pixels : {60, 300}) {
                DiceTarget target;
                target.shade_uniform = uniform;
                const auto run_it = [&](bool back_u, bool back_v) {
                    return counts(run(patch(shapes[k], back_u, back_v), looking(2.5f, pixels), target));
                };
                const Counts forwards = run_it(false, false);
                EXPECT_EQ(run_it(true, false), forwards) << k << uniform << pixels;
                EXPECT_EQ(run_it(false, true), forwards) << k << uniform << pixels;
                EXPECT_EQ(run_it(true, true), forwards) << k << uniform << pixels;
            }
}

// Grids of more cells than a few have their vertices where they belong, too.
TEST(Simplify, LargeGridsHaveTheirPlaces) {
    for (const int most : {16, 64, 256}) {
        DiceOptions o = looking(2, 512);
        o.max_grid_cells = most;
        scene::PolygonMesh m;
        m.vertices_per_loop = std::vector<int32_t>{4};
        const Diced d = run(primitive(m, {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}), o);
        ASSERT_EQ(d.grids.size(), size_t(256 / most) * size_t(256 / most));
        double area = 0;
        for (const grid::Grid& g : d.grids) {
            const Vec3f first = g.position(0), last = g.position(g.vertices() - 1);
            area += double((last.x - first.x) * (last.y - first.y));
            for (int j = 0; j <= g.nv; j++)
                for (int i = 0; i <= g.nu; i++) {
                    const size_t at = size_t(j * (g.nu + 1) + i);
                    const float u = float(i) / float(g.nu), v = float(j) / float(g.nv);
                    const Vec3f p = g.position(int(at));
                    ASSERT_NEAR(p.x, first.x + (last.x - first.x) * u, 1e-6f);
                    ASSERT_NEAR(p.y, first.y + (last.y - first.y) * v, 1e-6f);
                    ASSERT_NEAR(g.u[at], (p.x + 1) / 2, 1e-6f);
                    ASSERT_NEAR(g.v[at], (p.y + 1) / 2, 1e-6f);
                }
        }
        EXPECT_NEAR(area, 4, 1e-5);
    }
}

// Half of two sides lies outside of the picture, where a ninth of the cells will do: 440 pixels need 313 of
// them by their quadratic mean, whichever side comes first or last.
TEST(Simplify, OutlinesMayBeginAtAnyCorner) {
    DiceOptions o;
    o.camera.projection = Projection::Orthographic;
    o.camera.pixels_per_tangent = 64;
    o.camera.width = 256, o.camera.height = 224;
    o.max_grid_cells = 256;
    const float x = 2.0f / 64, y = 220.0f / 64;
    const Vec3f corners[4] = {{-x, -y, 2}, {x, -y, 2}, {x, y, 2}, {-x, y, 2}};
    for (size_t first = 0; first < 4; first++) {
        std::vector<float> p;
        for (size_t k = 0; k < 4; k++)
            for (int c = 0; c < 3; c++)
                p.push_back(corners[(first + k) % 4][c]);
        scene::PolygonMesh m;
        m.vertices_per_loop = std::vector<int32_t>{4};
        const Diced d = run(primitive(m, p), o);
        ASSERT_EQ(d.grids.size(), 1u) << first;
        EXPECT_EQ(first % 2 ? d.grids[0].nu : d.grids[0].nv, 256) << first;
        EXPECT_EQ(first % 2 ? d.grids[0].nv : d.grids[0].nu, 4) << first;
    }
}

// A dent of one vertex in a plane, wherever it lies: its cells turn by more than the tolerance, so none is
// left out.
TEST(Simplify, OneDentKeepsItsVertices) {
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>{4};
    DiceOptions o = looking(3);
    o.geometry_tolerance = 1000, o.normal_tolerance = 5;
    DiceTarget target;
    target.pixels_per_unit = 32;
    for (int at = 9; at < 25; at++)
        for (const bool across : {false, true}) {
            Journal journal;
            const Diced d = dice::dice(
                primitive(m, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}), target, o,
                [&](grid::Grid& g) {
                    for (int k = 12; k < 20; k++) // a ditch away from the borders
                        g.P[2 * size_t(g.stride) + size_t(across ? at * 33 + k : k * 33 + at)] -= 0.01f;
                },
                journal);
            ASSERT_EQ(d.grids.size(), 1u);
            ASSERT_EQ(d.grids[0].nu, 32);
            EXPECT_EQ(d.traced[0].step_u, 1) << at << across;
            EXPECT_EQ(d.traced[0].step_v, 1) << at << across;
        }
}

namespace {

// A square of 32 x 32 cells whose vertices are lifted to `height` of their numbers along u and v.
Diced lifted(float geometry_tolerance, float normal_tolerance, const std::function<float(int, int)>& height) {
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>{4};
    DiceOptions o = looking(3);
    o.geometry_tolerance = geometry_tolerance, o.normal_tolerance = normal_tolerance;
    DiceTarget target;
    target.pixels_per_unit = 32;
    Journal journal;
    Diced d = dice::dice(
        primitive(m, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}), target, o,
        [&](grid::Grid& g) {
            for (int i = 0; i < g.vertices(); i++)
                g.P[2 * size_t(g.stride) + size_t(i)] = height(i % (g.nu + 1), i / (g.nu + 1));
        },
        journal);
    EXPECT_EQ(d.grids.size(), 1u);
    EXPECT_EQ(d.grids[0].nu, 32);
    return d;
}

} // namespace

// A square that is folded along the diagonal that its triangles share is those two, where all triangles on
// the way there, of one row or one column, lean from the fold's sides by less than they do from each other.
TEST(Simplify, FoldsAlongTheDiagonalAreTwoTriangles) {
    for (const float slope : {0.2f, -0.2f}) { // folded by 15.8 degrees; rows lean 12.4 from either side
        const auto up = [&](int i, int j) { return slope / 32 * float(std::max(i + j - 32, 0)); };
        const auto down = [&](int i, int j) { return slope / 32 * float(std::max(32 - i - j, 0)); };
        for (const std::function<float(int, int)>& height : {std::function<float(int, int)>(up), {down}}) {
            const Diced d = lifted(1000, 14, height);
            EXPECT_EQ(d.traced[0].mu, 1) << slope;
            EXPECT_EQ(d.traced[0].mv, 1) << slope;
        }
    }
}

// What sides are off by counts within, as lattices lean on them: z = a n^2 is off by a at every other vertex
// (and by 4 a at every fourth), dents within by half of that more, and both together must stay in the
// tolerance. Across, every other row stands up by three times that: none is left out.
TEST(Simplify, SidesTakeTheirPartOfTheTolerance) {
    const float a = 2e-5f;
    for (const bool along_u : {true, false})
        for (const float tolerance : {2.1f, 2.4f, 2.6f, 2.9f}) {
            const Diced d = lifted(tolerance * a * 32, 90, [&](int i, int j) {
                const int along = along_u ? i : j, across = along_u ? j : i;
                return a * float(along * along) + (across % 2 ? 3 * a - 0.5f * a * float(along % 2) : 0);
            });
            const grid::TracedGrid& t = d.traced[0];
            for (const int side : {grid::VMin, grid::VMax})
                EXPECT_EQ(t.edge_step[size_t(along_u ? side : 3 - side)], 2) << along_u << tolerance;
            EXPECT_EQ(along_u ? t.step_u : t.step_v, tolerance < 2.5f ? 1 : 2) << along_u << tolerance;
            EXPECT_EQ(along_u ? t.step_v : t.step_u, 1) << along_u << tolerance;
        }
}
namespace {

// A sheet of `size`, flat at its border and raised by a tenth of that inside, in 64 cells a side.
Diced raised(double size, float geometry_tolerance) {
    DiceOptions o = looking(3);
    o.geometry_tolerance = geometry_tolerance, o.normal_tolerance = 90;
    DiceTarget target;
    target.pixels_per_unit = float(64 / size);
    scene::PatchMesh m;
    m.u_basis = m.v_basis = scene::basis_by_name("bezier");
    m.nu = m.nv = 4;
    std::vector<float> p;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            const bool inside = i % 3 != 0 && j % 3 != 0;
            p.insert(p.end(), {float(i * size / 3), float(j * size / 3), inside ? float(size / 10) : 0.0f});
        }
    return run(primitive(m, p), o, target);
}

} // namespace

// How coarse a grid becomes depends on pixels, not on the unit that the scene was made in.
TEST(Simplify, UnitsDoNotMatter) {
    std::set<int> steps;
    for (const float tolerance : {0.05f, 0.2f, 0.8f, 3.0f}) {
        const Diced one = raised(1, tolerance);
        for (const double size : {0x1p-10, 0x1p-4, 0x1p6, 0x1p12}) {
            const Diced d = raised(size, tolerance);
            ASSERT_EQ(d.traced.size(), one.traced.size());
            for (size_t k = 0; k < d.traced.size(); k++) {
                EXPECT_EQ(d.traced[k].step_u, one.traced[k].step_u) << tolerance << ' ' << size;
                EXPECT_EQ(d.traced[k].step_v, one.traced[k].step_v) << tolerance << ' ' << size;
                steps.insert(d.traced[k].step_u);
            }
        }
    }
    EXPECT_GT(steps.size(), 2u);
}
