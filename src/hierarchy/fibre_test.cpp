// Fibres in pages, beside their segments in doubles: as a cone between tangent circles and two balls.
#include <gtest/gtest.h>

#include "hierarchy/queue.h"
#include "hierarchy/test_fibres.h"

using namespace kanuka;
using namespace kanuka::hierarchy;
using namespace kanuka::hierarchy::testing;

namespace {

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
void expect_right(const TracedFibres& t, const std::vector<Ray>& rays) {
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
        const TracedFibres t(tangle(seed, 40));
        expect_right(t, rays_at(t, seed + 10, 4000));
    }
}

TEST(Fibres, OfAnySizeAnywhere) {
    for (const float size : {1e-5f, 1e5f}) {
        const TracedFibres t(tangle(5, 40, size));
        expect_right(t, rays_at(t, 3, 2000, size));
    }
    const Vec3f far(3000, -2000, 1000);
    const TracedFibres t(tangle(6, 40, 1, far));
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
    const TracedFibres brush(f);
    const auto bytes = [](const TracedFibres& t, Kind kind) {
        return t.page().header().section[int(kind)].leaf_bytes;
    };
    EXPECT_GT(bytes(brush, Kind::Fibre32), 90 * sizeof(Fibre32));
    expect_right(brush, rays_at(brush, 2, 3000, 0.4f));
    // Longer ones among them take more bytes a leaf.
    f.add({{-1, 0.05f, 0.1f}, {1, 0.1f, 0}}, {0.01f, 0.02f});
    f.add({{-60, 2, 0.1f}, {60, 3, 0}}, {0.1f, 0.2f});
    const TracedFibres more(f);
    EXPECT_GT(bytes(more, Kind::Fibre32), 0u);
    EXPECT_GT(bytes(more, Kind::Fibre48), 0u);
    EXPECT_GT(bytes(more, Kind::FibreFloat), 0u);
    expect_right(more, rays_at(more, 9, 3000, 0.4f));
}

// Normals lead away from the axis, as far as the fibre is thick.
TEST(Fibres, HaveRoundNormals) {
    const TracedFibres t(tangle(8, 40));
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
    const TracedFibres t(f);
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
    const TracedFibres t(tangle(9, 400));
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
