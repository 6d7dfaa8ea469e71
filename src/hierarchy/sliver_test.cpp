// Triangles whose height is as little of their length as rounding is: the distance of a hit, and its place in
// the triangle, are as right as of any other.
#include <gtest/gtest.h>

#include "hierarchy/decode.h"
#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"

namespace kanuka::hierarchy::testing {
namespace {

constexpr double Epsilon = 0x1p-24;

struct Slivers {
    std::vector<TestGrid> grids;
    std::vector<float> positions;
    std::vector<uint32_t> corners;
    PageMemory memory;

    MeshView mesh() const {
        return {positions.data(), positions.size() / 3, corners.data(), corners.size() / 3};
    }
    void build_page() {
        const std::vector<GridView> v = views(grids);
        const MeshView m = mesh();
        memory = build({v, std::span(&m, corners.empty() ? 0 : 1)}, Lattice{-24});
    }
    Page page() const { return memory.page(); }
};

struct Line {
    Vec3f from, along, across; // across: of unit length
    explicit Line(Random& random)
        : from(random.in_box(0.3f)), along(random.direction() * random.uniform(0.2f, 0.6f)),
          across(normalize(cross(along, random.direction()))) {}
    Vec3f at(float x, float height) const { return from + along * x + across * (length(along) * height); }
};

constexpr float MeasuredHeight = 5e-6f; // of the length, as trimming left some

// From what is lost in rounding to what is not.
float some_height(Random& random) {
    return random.below(2) ? MeasuredHeight : std::pow(10.0f, random.uniform(-7, -4));
}

Slivers slivers_of_a_mesh(size_t count) {
    Slivers s;
    Random random(1);
    for (size_t i = 0; i < count; i++) {
        const Line line(random);
        const float height = some_height(random), middle = random.uniform(-0.2f, 1.2f);
        for (const Vec3f& p : {line.at(0, 0), line.at(1, 0), line.at(middle, height)}) {
            s.corners.push_back(uint32_t(s.positions.size() / 3));
            s.positions.insert(s.positions.end(), {p.x, p.y, p.z});
        }
    }
    s.build_page();
    return s;
}

Slivers slivers_of_grids(size_t count) {
    Slivers s;
    Random random(2);
    for (size_t i = 0; i < count; i++) {
        const Line line(random);
        const float height = some_height(random);
        const int columns = 1 + int(random.below(2)), rows = 1 + int(random.below(4));
        s.grids.push_back(make_grid(columns, rows, [&](float u, float v) {
            return line.at(u, v * float(rows) * height / float(columns));
        }));
    }
    s.build_page();
    return s;
}

// Aimed at the slivers, and at the lines on which they lie.
std::vector<Ray> aimed_rays(const Slivers& s, size_t count) {
    Random random(3);
    std::vector<Face> faces = faces_of(s.grids, Lattice{-24});
    for (size_t f = 0; f < s.corners.size(); f += 3) {
        const auto at = [&](size_t k) {
            const float* p = &s.positions[3 * s.corners[f + k]];
            return Lattice{-24}.snap({p[0], p[1], p[2]});
        };
        faces.push_back({at(0), at(1), at(2), uint32_t(faces.size())});
    }
    std::vector<Ray> rays(count);
    for (Ray& r : rays) {
        const Face& f = faces[random.below(uint32_t(faces.size()))];
        float u = random.uniform(), v = random.uniform() * (1 - u);
        if (random.below(4) == 0)
            u = random.uniform(-1, 2), v = 0;
        r.o = random.in_box(1.5f);
        r.d = (f.a + (f.b - f.a) * u + (f.c - f.a) * v - r.o) * random.uniform(0.5f, 2);
    }
    return rays;
}

double length(const Point& p) {
    return std::sqrt(dot(p, p));
}
double distance(const Point& p, const Point& a, const Point& b) {
    const Point e = b - a, q = p - a;
    const double squared = dot(e, e), s = squared > 0 ? std::clamp(dot(q, e) / squared, 0.0, 1.0) : 0;
    return length({q.x - s * e.x, q.y - s * e.y, q.z - s * e.z});
}
double distance(const Point& p, const Point& a, const Point& b, const Point& c) {
    const double nearest = std::min({distance(p, a, b), distance(p, b, c), distance(p, c, a)});
    const Point n = cross(b - a, c - a);
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
        if (dot(cross(to - from, p - from), n) <= 0)
            return nearest;
    return std::min(nearest, std::abs(dot(p - a, n)) / length(n));
}

// What docs/hierarchy.md says of offsets, of the triangle that was hit. Its plane may lie in any direction,
// so not the distances along the ray are compared but the points: how far from the triangle.
void expect_on_the_triangle(const Slivers& s, const std::vector<Ray>& rays) {
    std::vector<Hit> hits(rays.size());
    closest(s.page(), rays, hits);
    size_t found = 0;
    double furthest = 0, furthest_by_weights = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit& h = hits[i];
        if (!h.found())
            continue;
        found++;
        const Ray& r = rays[i];
        const Corners corners = corners_of(s.page(), h.leaf, h.primitive);
        const Point a(corners.at[0]), b(corners.at[1]), c(corners.at[2]);
        // Of the second triangle of a cell the weights are what is left of the cell.
        const bool turned = !is_of_triangles(kind_of(h.leaf)) && h.primitive % 2 == 1;
        const double t(h.t), u(turned ? 1 - h.u : h.u), v(turned ? 1 - h.v : h.v);
        const Point hit(double(r.o.x) + t * double(r.d.x), double(r.o.y) + t * double(r.d.y),
                        double(r.o.z) + t * double(r.d.z));
        const auto weighted = [&](double p, double q, double w) { return p + u * (q - p) + v * (w - p); };
        const Point by_weights(weighted(a.x, b.x, c.x), weighted(a.y, b.y, c.y), weighted(a.z, b.z, c.z));
        const double scale = std::max({length(b - a), length(c - b), length(a - c)}) + t * length(Point(r.d));
        furthest = std::max(furthest, distance(hit, a, b, c) / (Epsilon * scale));
        furthest_by_weights = std::max(furthest_by_weights, length(by_weights - hit) / (Epsilon * scale));
        ASSERT_TRUE(u >= 0 && v >= 0 && u + v <= 1 + 4 * Epsilon) << "ray " << i << ": " << u << " " << v;
    }
    EXPECT_GT(found, rays.size() / 2);
    EXPECT_LT(furthest, 8);
    EXPECT_LT(furthest_by_weights, 8);
}

void expect_same_bits(const Slivers& s, const std::vector<Ray>& rays) {
    std::vector<Hit> eight(rays.size()), sixteen(rays.size()), widest(rays.size());
    std::vector<uint8_t> any(rays.size()), any_of_sixteen(rays.size());
    closest_w8(s.page(), rays, eight), closest_w16(s.page(), rays, sixteen), closest(s.page(), rays, widest);
    occluded_w8(s.page(), rays, any), occluded_w16(s.page(), rays, any_of_sixteen);
    Oracle oracle(s.page());
    for (size_t i = 0; i < rays.size(); i++) {
        const Hit one = oracle.closest(rays[i]);
        ASSERT_EQ(eight[i], one) << "ray " << i;
        ASSERT_EQ(sixteen[i], one) << "ray " << i;
        ASSERT_EQ(widest[i], one) << "ray " << i;
        ASSERT_EQ(any[i] != 0, one.found()) << "ray " << i;
        ASSERT_EQ(any_of_sixteen[i] != 0, one.found()) << "ray " << i;
    }
}

// Sixteen rays of neighbouring pixels to one sliver: they go together.
std::vector<Ray> side_by_side(const std::vector<Ray>& rays) {
    std::vector<Ray> all;
    for (const Ray& r : rays)
        for (int k = 0; k < 16; k++) {
            all.push_back(r);
            all.back().d.x += 1e-7f * float(k);
        }
    return all;
}

} // namespace

TEST(Slivers, OfMeshesAreHitWhereTheyAre) {
    const Slivers s = slivers_of_a_mesh(500);
    EXPECT_GT(s.page().header().section[int(Kind::TriangleFloat)].leaf_bytes, 0u);
    expect_on_the_triangle(s, aimed_rays(s, 100000));
}

TEST(Slivers, OfGridsAreHitWhereTheyAre) {
    const Slivers s = slivers_of_grids(200);
    EXPECT_GT(s.page().header().section[int(Kind::GridFloat)].leaf_bytes, 0u);
    expect_on_the_triangle(s, aimed_rays(s, 100000));
}

TEST(Slivers, AreHitInTheSameBitsByAnyLanes) {
    for (const Slivers& s : {slivers_of_a_mesh(500), slivers_of_grids(200)}) {
        expect_same_bits(s, aimed_rays(s, 20000));
        expect_same_bits(s, side_by_side(aimed_rays(s, 2000)));
    }
}

// Of a displaced sphere beside its pole: a triangle that the ray runs in line with, beyond its end. All
// weights but one are rounded to zero.
TEST(Slivers, ArePassedByBeyondTheirEnds) {
    Slivers s;
    s.positions = {-0x1.2p-7f, -0x1.4p-5f, -0x1.fccp-1f, 0, 0, -1, -0x1.2p-8f, -0x1.4p-6f, -0x1.fe8p-1f};
    s.corners = {0, 1, 2};
    s.build_page();
    Ray r{{0, 0, 0}, 0, {-0x1.2b022p-12f, -0x1.4c3b4p-10f, -0x1.ffe502p-1f}};
    Hit h;
    closest(s.page(), {&r, 1}, {&h, 1});
    EXPECT_FALSE(h.found()) << h.t;
    r.d = {-0x1.2p-8f, -0x1.4p-6f, -0x1.fe8p-1f}; // at the corner between the others
    closest(s.page(), {&r, 1}, {&h, 1});
    ASSERT_TRUE(h.found());
    EXPECT_NEAR(h.t, 1, 1e-6);
}

// A ball whose triangles are cut at points beside the middles of their edges: every second one is a sliver.
TEST(Slivers, LetNoRayOut) {
    MeshOfGrids whole(ball(4, 8, 1, 0.15f, 5));
    Slivers s;
    Random random(4);
    const Lattice lattice{-22};
    for (size_t f = 0; f < whole.corners.size(); f += 3) {
        Vec3f p[3];
        for (size_t k = 0; k < 3; k++) {
            const float* from = &whole.positions[3 * whole.corners[f + k]];
            p[k] = lattice.snap({from[0], from[1], from[2]});
        }
        const float off = std::pow(10.0f, random.uniform(-7, -4));
        const Vec3f inner = p[0] * 0.5f + p[1] * (0.5f - off) + p[2] * off;
        const Vec3f cut[9] = {p[0], p[1], inner, p[1], p[2], inner, p[2], p[0], inner};
        for (const Vec3f& q : cut) {
            s.corners.push_back(uint32_t(s.positions.size() / 3));
            s.positions.insert(s.positions.end(), {q.x, q.y, q.z});
        }
    }
    const MeshView mesh = s.mesh();
    s.memory = build({{}, {&mesh, 1}}, lattice);
    std::vector<Ray> rays(300000);
    for (size_t i = 0; i < rays.size(); i++) {
        const size_t face = random.below(uint32_t(s.corners.size() / 3)) * 3, k = random.below(3);
        const auto at = [&](size_t corner) {
            const float* from = &s.positions[3 * (face + corner % 3)];
            return lattice.snap({from[0], from[1], from[2]});
        };
        const float along = i % 3 == 0 ? 0 : random.uniform();
        rays[i].o = random.in_box(0.3f);
        rays[i].d = at(k) + (at(k + 1) - at(k)) * along - rays[i].o;
    }
    std::vector<Hit> hits(rays.size());
    std::vector<uint8_t> any(rays.size());
    closest(s.page(), rays, hits), occluded(s.page(), rays, any);
    for (size_t i = 0; i < rays.size(); i++)
        ASSERT_TRUE(hits[i].found() && any[i] != 0) << "ray " << i;
    rays.resize(20000);
    expect_same_bits(s, rays);
}

} // namespace kanuka::hierarchy::testing
