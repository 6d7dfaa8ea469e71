// Fibres in pages, beside their segments in doubles: as a cone between tangent circles and two balls.
#include <gtest/gtest.h>

#include "hierarchy/decode.h"
#include "hierarchy/queue.h"
#include "hierarchy/test_oracle.h"

using namespace kanuka;
using namespace kanuka::hierarchy;
using namespace kanuka::hierarchy::testing;

namespace {

struct Fibres {
    std::vector<float> vertices; // xyz, radius
    std::vector<uint32_t> first;

    void add(const std::vector<Vec3f>& points, const std::vector<float>& radii) {
        for (size_t i = 0; i < points.size(); i++) {
            if (i + 1 < points.size())
                first.push_back(uint32_t(vertices.size() / 4));
            vertices.insert(vertices.end(), {points[i].x, points[i].y, points[i].z, radii[i]});
        }
    }
    FibreView view() const { return {vertices.data(), vertices.size() / 4, first.data(), first.size()}; }
};

struct Tested {
    FibreLattice lattice;
    PageMemory memory;
    std::vector<Segment> segments; // on the lattice, by name

    explicit Tested(const Fibres& f) {
        const FibreView view = f.view();
        lattice = fibre_lattice_of({&view, 1});
        memory = build({{}, {}, false, {&view, 1}}, {{}, {}, lattice});
        for (const uint32_t v : f.first) {
            Segment s;
            for (uint32_t e = 0; e < 2; e++) {
                const float* p = f.vertices.data() + 4 * (v + e);
                s.end[e] = lattice.places.snap({p[0], p[1], p[2]});
                s.radius[e] = lattice.radius(lattice.word(p[3]));
            }
            segments.push_back(s);
        }
    }
    Page page() const { return memory.page(); }
};

// Where a line is in a segment: of the quadric of the cone that touches both balls, between its two circles,
// and of the balls.
struct Span {
    double enter = INFINITY, leave = -INFINITY;
    bool empty() const { return !(enter <= leave); }
};
Span span_of(const Segment& s, const Ray& ray) {
    Span in;
    const Point d(ray.d), o(ray.o);
    const double dd = dot(d, d);
    const auto add_roots = [&](double a, double b, double c, const auto& counts) { // a t^2 + 2 b t + c = 0
        const double h = b * b - a * c;
        if (h < 0)
            return;
        const double q = -(b + std::copysign(std::sqrt(h), b));
        for (const double t : {q / a, c / q})
            if (std::isfinite(t) && counts(t))
                in.enter = std::min(in.enter, t), in.leave = std::max(in.leave, t);
    };
    for (int e = 0; e < 2; e++) {
        const Point from = o - Point(s.end[e]);
        const double r = double(s.radius[e]);
        add_roots(dd, dot(from, d), dot(from, from) - r * r, [](double) { return true; });
    }
    const Point axis = Point(s.end[1]) - Point(s.end[0]), from = o - Point(s.end[0]);
    const double r = double(s.radius[0]), grows = double(s.radius[1]) - r, mm = dot(axis, axis);
    const double slope =
        mm - grows * grows; // of the cone: points q with q^2 slope = (q . axis + r grows)^2 ...
    if (slope <= 0)
        return in;
    // |q|^2 - r^2 - (q . axis + r grows)^2 / slope = 0: the largest over s of r(s)^2 - |q - s axis|^2 is
    // zero.
    const double md = dot(axis, d), mf = dot(axis, from) + r * grows;
    add_roots(dd - md * md / slope, dot(from, d) - md * mf / slope, dot(from, from) - r * r - mf * mf / slope,
              [&](double t) {
                  const double along = (mf + t * md) / slope;
                  return along >= 0 && along <= 1;
              });
    return in;
}

// Hairs of all lengths and widths, straight, bent, pointed; some of one point, some with one end in the
// other.
Fibres tangle(unsigned seed, int count, float size = 1, const Vec3f& at = Vec3f(0.0f)) {
    Random random(seed);
    Fibres f;
    for (int i = 0; i < count; i++) {
        Vec3f p = at + random.in_box(size), d = random.direction();
        std::vector<Vec3f> points;
        std::vector<float> radii;
        const float length = size * random.uniform(0.02f, 0.3f),
                    radius = size * random.uniform(0.001f, 0.02f);
        const int n = 2 + int(random.below(5));
        for (int k = 0; k < n; k++) {
            points.push_back(p);
            radii.push_back(i % 5 == 0 && k == n - 1 ? 0 : radius * random.uniform(0.6f, 1.4f));
            p += d * (i % 17 == 0 ? 0.0f : i % 11 == 0 ? 0.3f * radius : length);
            d = normalize(d + random.in_box(0.7f));
        }
        f.add(points, radii);
    }
    return f;
}

std::vector<Ray> rays_at(const Tested& t, unsigned seed, int count, float size = 1,
                         const Vec3f& at = Vec3f(0.0f)) {
    Random random(seed);
    std::vector<Ray> rays;
    for (int i = 0; i < count; i++) {
        const Segment& s = t.segments[random.below(uint32_t(t.segments.size()))];
        const Vec3f target = i % 3 == 0   ? at + random.in_box(size)
                             : i % 3 == 1 ? s.end[random.below(2)]
                                          : s.end[0] + (s.end[1] - s.end[0]) * random.uniform();
        Ray r;
        r.o = at + random.in_box(2 * size);
        r.d = target + random.in_box(2 * s.radius[0]) - r.o;
        if (i % 16 == 7) // along a segment
            r.d = s.end[1] - s.end[0],
            r.o = s.end[0] - r.d * random.uniform(0.5f, 2) + random.in_box(s.radius[0]);
        if (i % 16 == 8) { // from inside of one
            r.o = s.end[0] + (s.end[1] - s.end[0]) * random.uniform() + random.in_box(0.4f * s.radius[0]);
            r.d = random.direction() * size;
        }
        rays.push_back(r);
    }
    return rays;
}

std::vector<Hit> trace(const Page& page, std::span<const Ray> rays) {
    std::vector<Hit> hits(rays.size());
    EverythingIsThere all;
    find_closest<8>(page, rays, hits, all);
    return hits;
}

double largest(const Vec3f& v) {
    return double(std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
}

// The hit is one of those that doubles find, but for rays that pass by as near as rounding.
void expect_right(const Tested& t, const std::vector<Ray>& rays) {
    const std::vector<Hit> hits = trace(t.page(), rays);
    size_t found = 0, unsure = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Ray& r = rays[i];
        double best = INFINITY, inner = INFINITY; // of what is as it is; of what is thinner
        uint32_t which = 0;
        const double reach = std::sqrt(dot(Point(r.d), Point(r.d)));
        bool near = false; // does the ray pass some segment so closely that rounding decides?
        for (uint32_t n = 0; n < t.segments.size(); n++) {
            const auto first = [&](double wider) {
                Segment s = t.segments[n];
                const double error = 1e-6 * (largest(r.o - s.end[0]) + largest(s.end[1] - s.end[0]));
                for (float& radius : s.radius)
                    radius = float(std::max(0.0, double(radius) + wider * error));
                const Span in = span_of(s, r);
                return in.empty() || in.leave < 0 ? INFINITY : in.enter >= 0 ? in.enter : in.leave;
            };
            const double here = first(0), wide = first(1), thin = first(-1);
            if (here < best)
                best = here, which = n;
            inner = std::min(inner, thin);
            near |=
                std::isfinite(wide) != std::isfinite(thin) || std::abs(wide - thin) * reach > 1e-3 * reach;
        }
        const Hit& h = hits[i];
        if (h.found() != std::isfinite(best)) {
            EXPECT_TRUE(near) << i << " " << h.t << " " << best;
            unsure++;
            continue;
        }
        if (!h.found())
            continue;
        found++;
        if (std::abs(double(h.t) - best) <= 2e-5 * (1 + std::abs(best))) {
            if (near)
                continue;
            const uint32_t name = t.page().name(h.leaf, int(h.primitive / 2));
            const Span in = span_of(t.segments[name], r);
            const double mine = h.primitive % 2 ? in.leave : in.enter;
            EXPECT_NEAR(double(h.t), mine, 2e-5 * (1 + std::abs(mine))) << i << " " << name << " " << which;
        } else {
            EXPECT_TRUE(near) << i << ": " << h.t << " " << best << ", segment " << which;
            unsure++;
        }
    }
    EXPECT_GT(found, rays.size() / 5);
    EXPECT_LT(unsure, rays.size() / 50);
}

TEST(Fibres, AreHitWhereDoublesHaveThem) {
    for (unsigned seed = 1; seed <= 4; seed++) {
        const Tested t(tangle(seed, 40));
        expect_right(t, rays_at(t, seed + 10, 4000));
    }
}

TEST(Fibres, OfAnySizeAnywhere) {
    for (const float size : {1e-5f, 1e5f}) {
        const Tested t(tangle(5, 40, size));
        expect_right(t, rays_at(t, 3, 2000, size));
    }
    const Vec3f far(3000, -2000, 1000);
    const Tested t(tangle(6, 40, 1, far));
    expect_right(t, rays_at(t, 4, 2000, 1, far));
}

TEST(Fibres, AllKindsOfLeavesFindTheSame) {
    Fibres f; // a brush
    Random random(7);
    for (int i = 0; i < 400; i++) {
        const Vec3f root(float(i % 20) * 0.02f, 0, float(i / 20) * 0.02f), lean = random.in_box(0.02f);
        f.add({root, root + Vec3f(0, 0.1f, 0) + lean, root + Vec3f(0, 0.2f, 0) + lean * 3.0f},
              {0.003f, 0.002f, 0.001f});
    }
    const Tested brush(f);
    const auto bytes = [](const Tested& t, Kind kind) {
        return t.page().header().section[int(kind)].leaf_bytes;
    };
    EXPECT_GT(bytes(brush, Kind::Fibre32), 90 * sizeof(Fibre32));
    expect_right(brush, rays_at(brush, 2, 3000, 0.4f));
    // Longer ones among them take more bytes a leaf.
    f.add({{-1, 0.05f, 0.1f}, {1, 0.1f, 0}}, {0.01f, 0.02f});
    f.add({{-60, 2, 0.1f}, {60, 3, 0}}, {0.1f, 0.2f});
    const Tested more(f);
    EXPECT_GT(bytes(more, Kind::Fibre32), 0u);
    EXPECT_GT(bytes(more, Kind::Fibre48), 0u);
    EXPECT_GT(bytes(more, Kind::FibreFloat), 0u);
    expect_right(more, rays_at(more, 9, 3000, 0.4f));
}

// Normals lead away from the axis, as far as the fibre is thick.
TEST(Fibres, HaveRoundNormals) {
    const Tested t(tangle(8, 40));
    const std::vector<Ray> rays = rays_at(t, 5, 4000);
    const std::vector<Hit> hits = trace(t.page(), rays);
    int found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        if (!hits[i].found())
            continue;
        const Segment s = segment_of(t.page(), hits[i].leaf, hits[i].primitive / 2);
        const Segment& same = t.segments[t.page().name(hits[i].leaf, int(hits[i].primitive / 2))];
        EXPECT_EQ(s.end[1], same.end[1]);
        EXPECT_EQ(s.radius[0], same.radius[0]);
        const Vec3f n = normal_of(t.page(), rays[i], hits[i]);
        const float radius = s.radius[0] + hits[i].u * (s.radius[1] - s.radius[0]);
        EXPECT_NEAR(length(n), radius, 1e-5f);
        if (radius > 1e-3f) {
            EXPECT_EQ(dot(n, rays[i].d) > 0, hits[i].primitive % 2 == 1) << i;
            found++;
        }
    }
    EXPECT_GT(found, 500);
}

struct OnlyExits {
    static constexpr bool Filters = true;
    bool accepts(const Candidate& c) const { return c.hit.primitive % 2 == 1; }
};
// A ray goes in and out of a segment: who refuses the one is asked of the other.
TEST(Fibres, AreLeftWhereTheyWereNotEntered) {
    Fibres f;
    f.add({{-1, 0, 0}, {1, 0, 0}}, {0.25f, 0.25f});
    const Tested t(f);
    OnlyExits exits;
    const Ray rays[] = {{{0, 0, 3}, 0, {0, 0, -1}},
                        {{0, 0, 3}, 2.9f, {0, 0, -1}},
                        {{0, 0, 3}, 3.3f, {0, 0, -1}},
                        {{3, 0, 0}, 0, {-1, 0, 0}}};
    Hit hits[4];
    find_closest<8>(t.page(), std::span(rays), std::span(hits), exits);
    const float expected[] = {3.25f, 3.25f, INFINITY, 4.25f};
    for (int i = 0; i < 4; i++)
        EXPECT_FLOAT_EQ(hits[i].t, expected[i]) << i;
    EXPECT_NEAR(trace(t.page(), rays)[3].t, 1.75f, 1e-6f); // the ball at its end
}

// Rays side by side go together, and find the same bits.
TEST(Fibres, PacketsFindTheSame) {
    const Tested t(tangle(9, 400));
    std::vector<Ray> rays;
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++) {
            Ray r;
            r.o = {0, 0, 4}, r.d = {float(x - 32) / 100, float(y - 32) / 100, -1};
            rays.push_back(r);
        }
    const std::vector<Hit> together = trace(t.page(), rays);
    EverythingIsThere all;
    std::vector<Hit> alone(rays.size());
    RayQueue<8, Query::Closest, EverythingIsThere>(t.page(), rays, all)
        .run_alone([&](size_t i, const Hit& h, const InstancePath&) { alone[i] = h; });
    EXPECT_EQ(together, alone);
    std::vector<uint8_t> hidden(rays.size());
    find_any<8>(t.page(), rays, hidden, all);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        EXPECT_EQ(hidden[i] != 0, alone[i].found());
        found += alone[i].found();
    }
    EXPECT_GT(found, 400u);
}

TEST(Fibres, ThatAreNowhereAreLeftOut) {
    Fibres f = tangle(10, 3);
    const size_t before = f.first.size();
    f.add({{NAN, 0, 0}, {1, 0, 0}}, {0.1f, 0.1f});
    f.add({{1e30f, 0, 0}, {1, 0, 0}}, {0.1f, 0.1f});
    f.add({{0, 0, 0}, {1, 0, 0}}, {INFINITY, 0.1f});
    f.first.push_back(uint32_t(f.vertices.size() / 4) - 1); // no second vertex
    f.first.push_back(~0u);
    const FibreView view = f.view();
    const PageMemory memory = build({{}, {}, false, {&view, 1}}, Lattice{});
    EXPECT_EQ(refusal_of(memory.bytes()), "");
    std::vector<bool> named(f.first.size());
    const Header& h = memory.page().header();
    for (int k = int(Kind::Fibre32); k <= int(Kind::FibreFloat); k++) {
        const Section& s = h.section[k];
        const uint32_t* names = reinterpret_cast<const uint32_t*>(memory.page().bytes() + s.names);
        const uint64_t each = UnitsOf[k] * UnitBytes;
        for (uint64_t i = 0; i + each <= s.leaf_bytes; i += each)
            for (uint64_t n = 0; n < 8; n++)
                named[names[i / each * 8 + n]] = true;
    }
    for (size_t i = 0; i < before; i++)
        EXPECT_TRUE(named[i]) << i;
    EXPECT_FALSE(named[before]);
    const PageMemory nothing = build({}, Lattice{});
    EXPECT_EQ(nothing.page().header().root, NoRef);
}

// Radii keep twelve bits, whatever the largest is.
TEST(Fibres, RadiiKeepTheirDigits) {
    for (const float largest : {1e-12f, 0.3f, 7e9f}) {
        const FibreLattice lattice = FibreLattice::of({}, largest);
        for (float r = largest; r > largest * 1e-9f; r *= 0.77f)
            EXPECT_NEAR(lattice.radius(lattice.word(r)), r, r * 0x1p-12f);
        EXPECT_LT(lattice.radius(lattice.word(0)), largest * 1e-9f);
        EXPECT_EQ(lattice.word(lattice.radius(lattice.word(largest))), lattice.word(largest));
    }
}

} // namespace
