// Rays that go together find what each of them finds alone, to the bit.
#include <algorithm>
#include <bit>
#include <gtest/gtest.h>

#include "hierarchy/queue.h"
#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::testing {
namespace {

constexpr float Infinity = std::numeric_limits<float>::infinity(), Denormal = 1e-40f;

// Pages with each kind of leaf: small cells beside large ones, as grids and as a mesh.
struct Content {
    std::vector<TestGrid> grids = ball(3, 12, 1, 0.2f, 5);
    PageMemory memory;

    explicit Content(bool mesh) {
        grids.push_back(
            make_grid(8, 8, [](float u, float v) { return Vec3f(60 * u - 30, 9 * u + v - 8, 60 * v - 30); }));
        grids.push_back(
            make_grid(4, 4, [](float u, float v) { return Vec3f(1e6f * u - 5e5f, 1e6f * v - 5e5f, 1e5f); }));
        const std::vector<GridView> grid_views = views(grids);
        const MeshOfGrids triangles(grids);
        const MeshView mesh_view = triangles.view();
        const hierarchy::Content content =
            mesh ? hierarchy::Content{{}, {&mesh_view, 1}} : hierarchy::Content{grid_views, {}};
        memory = build(content, votes_of(content).lattice());
    }
};

// Of a camera, by rows of sixteen pixels.
std::vector<Ray> camera_rays(const Vec3f& eye, const Vec3f& to, float spread, unsigned seed) {
    Random random(seed);
    const Vec3f f = normalize(to - eye), x = normalize(cross(f, Vec3f(0.1f, 1, 0.2f))), y = cross(x, f);
    std::vector<Ray> rays;
    for (int k = 0; k < 64 * 64; k++) {
        const int bucket = k / 256, px = bucket % 4 * 16 + k % 16, py = bucket / 4 * 16 + k % 256 / 16;
        rays.push_back(
            {eye, 0, f + x * (spread * (float(px) / 32 - 1)) + y * (spread * (float(py) / 32 - 1))});
        if (random.below(16) == 0)
            rays.back().t_min = random.uniform(0, 2), rays.back().t_max = random.uniform(0, 4);
    }
    return rays;
}
// From one side to a light: origins apart, directions that meet.
std::vector<Ray> shadow_rays(size_t count, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    Vec3f at(0.0f);
    for (size_t i = 0; i < count; i++) {
        if (i % 64 == 0)
            at = random.direction() * 1.4f;
        rays[i].o = at + random.in_box(0.05f);
        rays[i].d = Vec3f(2, 3, -1) + random.in_box(0.2f) - rays[i].o, rays[i].t_max = 0.9999f;
    }
    return rays;
}
std::vector<Ray> random_rays(size_t count, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& r : rays)
        r.o = random.in_box(1.5f), r.d = random.direction();
    return rays;
}
// Among rays that run side by side, some that are none, or hardly.
std::vector<Ray> spoiled(std::vector<Ray> rays) {
    Random random(31);
    const float odd[] = {0, -0.0f, Denormal, -Denormal, 1e-30f, NAN, Infinity, -Infinity, 3e38f, 1e18f};
    for (Ray& r : rays)
        switch (random.below(24)) {
        case 0:
        case 1:
            r.d[int(random.below(3))] = odd[random.below(std::size(odd))];
            break;
        case 2:
            r.o[int(random.below(3))] = odd[random.below(std::size(odd))];
            break;
        case 3:
            r.t_min = odd[random.below(std::size(odd))];
            break;
        case 4:
            r.t_max = odd[random.below(std::size(odd))];
            break;
        case 5:
            r.d = Vec3f(0.0f);
            break;
        default:
            break;
        }
    return rays;
}
// Every second ray is another's.
std::vector<Ray> mixed(std::vector<Ray> rays, const std::vector<Ray>& others) {
    for (size_t i = 0; i < rays.size(); i += 2)
        rays[i] = others[i % others.size()];
    return rays;
}
std::vector<Ray> scaled(std::vector<Ray> rays, float by) {
    for (Ray& r : rays)
        r.d = r.d * by;
    return rays;
}

struct Named {
    const char* name;
    std::vector<Ray> rays;
    bool together; // at least a half of them go together
};
std::vector<Named> all_rays() {
    const std::vector<Ray> camera = camera_rays({2.1f, 1.7f, -2.5f}, {0.1f, 0, 0}, 0.4f, 1),
                           shadow = shadow_rays(4096, 2), random = random_rays(4096, 3);
    std::vector<Ray> down = camera;
    for (size_t i = 0; i < down.size(); i++) // directions with components that are zero, as one sees maps
        down[i] = {{float(i % 64) / 128 - 0.25f, 4, float(i / 64) / 128 - 0.25f},
                   0,
                   {0, i % 3 ? -1.0f : -1.2f, -0.0f}};
    std::vector<Ray> inside = camera_rays({0.01f, 0.02f, 0.03f}, {0.3f, 0.5f, 1}, 0.3f, 4);
    return {{"camera", camera, true},
            {"shadow", shadow, true},
            {"down", down, true},
            {"inside", inside, true},
            {"random", random, false},
            {"mixed", mixed(camera, random), false},
            {"spoiled camera", spoiled(camera), false},
            {"spoiled shadow", spoiled(shadow), false},
            {"spoiled down", spoiled(down), false},
            {"small directions", scaled(camera, 1e-12f), true},
            {"large directions", scaled(camera, 1e15f), true},
            {"few", {camera.begin(), camera.begin() + 77}, true},
            {"one", {camera[0]}, false},
            {"none", {}, false}};
}

template <int W, class Filter>
void expect_as_alone(const Page& page, const Named& named, Filter& filter) {
    const std::span<const Ray> rays = named.rays;
    std::vector<Hit> together(rays.size()), alone(rays.size());
    std::vector<int> hidden(rays.size()), told(rays.size());
    const auto put = [](std::vector<Hit>& hits) {
        return [&hits](size_t i, const Hit& h, const InstancePath&) { hits[i] = h; };
    };
    using Closest = RayQueue<W, Query::Closest, Filter>;
    Closest(page, rays, filter).run_alone(put(alone));
    Closest(page, rays, filter).run([&](size_t i, const Hit& h, const InstancePath&) {
        together[i] = h;
        told[i]++;
    });
    RayQueue<W, Query::Any, Filter>(page, rays, filter).run([&](size_t i, const Hit& h, const InstancePath&) {
        hidden[i] = h.found();
        told[i]++;
    });
    for (size_t i = 0; i < rays.size(); i++) {
        ASSERT_EQ(together[i].leaf, alone[i].leaf) << named.name << ", ray " << i;
        ASSERT_EQ(std::memcmp(&together[i], &alone[i], sizeof(Hit)), 0) << named.name << ", ray " << i;
        ASSERT_EQ(hidden[i] != 0, alone[i].found()) << named.name << ", ray " << i;
        ASSERT_EQ(told[i], 2) << named.name << ", ray " << i;
    }
}

// Refuses by the ray, the face and the place.
struct Picky {
    static constexpr bool Filters = true;
    std::span<const Ray> rays;
    bool accepts(const Candidate& c) const {
        EXPECT_EQ(std::memcmp(&c.here, &rays[c.ray], sizeof(Ray)), 0);
        return (c.hit.leaf + c.hit.primitive + c.ray) % 3 != 0 && c.hit.u < 0.8f;
    }
};

} // namespace

TEST(Packets, FindWhatTheirRaysFindAlone) {
    for (const bool mesh : {false, true}) {
        const Content content(mesh);
        EverythingIsThere all;
        for (const Named& named : all_rays()) {
            expect_as_alone<8>(content.memory.page(), named, all);
            expect_as_alone<16>(content.memory.page(), named, all);
        }
    }
}

TEST(Packets, AskFiltersAsTheirRaysDoAlone) {
    for (const bool mesh : {false, true}) {
        const Content content(mesh);
        for (const Named& named : all_rays()) {
            Picky picky{named.rays};
            expect_as_alone<8>(content.memory.page(), named, picky);
            expect_as_alone<16>(content.memory.page(), named, picky);
        }
    }
}

TEST(Packets, FindWhatTheOracleFinds) {
    for (const bool mesh : {false, true}) {
        const Content content(mesh);
        const Page page = content.memory.page();
        Oracle oracle(page);
        EverythingIsThere all;
        for (const Named& named : all_rays()) {
            // Its boxes have no margin for rays in their planes.
            oracle.looks_everywhere = std::strstr(named.name, "down");
            std::vector<Hit> hits(named.rays.size());
            find_closest<8>(page, named.rays, hits, all);
            for (size_t i = 0; i < hits.size(); i += oracle.looks_everywhere ? 13 : 3) {
                if (std::isnan(named.rays[i].t_max))
                    continue; // and nothing is hit, but that is no number, and not itself
                ASSERT_EQ(hits[i], oracle.closest(named.rays[i])) << named.name << ", ray " << i;
            }
        }
    }
}

// Shapes that swell and drift in one interval of time, which rays are at any time of; at first a few are
// there as it begins, and as it ends.
namespace {

struct ChangingContent {
    std::vector<TestGrid> begin = Content(false).grids, end = begin;
    PageMemory memory;
    World world;
    std::vector<float> times;

    explicit ChangingContent(bool mesh) {
        for (TestGrid& g : end)
            for (size_t i = 0; i < g.positions.size(); i += 3) {
                const float size = 1.2f + 0.1f * std::sin(5 * g.positions[i + 1]);
                for (size_t a = 0; a < 3; a++)
                    g.positions[i + a] = size * g.positions[i + a] + (a == 0 ? 0.3f : -0.1f);
            }
        std::vector<GridView> grids = views(begin);
        for (size_t g = 0; g < grids.size(); g++)
            grids[g].later = end[g].positions.data();
        const MeshOfGrids triangles(begin), later(end);
        MeshView mesh_view = triangles.view();
        mesh_view.later = later.positions.data();
        const hierarchy::Content content =
            mesh ? hierarchy::Content{{}, {&mesh_view, 1}} : hierarchy::Content{grids, {}};
        memory = build(content, votes_of(content).lattice());
        world.add(memory.page());
        Random random(17);
        for (int i = 0; i < 4096; i++)
            times.push_back(i < 48 ? float(i / 16) / 2 : random.uniform(0, 1));
    }
};

template <int W, class Filter>
void expect_as_alone(const ChangingContent& content, const Named& named, Filter& filter) {
    const std::span<const Ray> rays = named.rays;
    const std::span<const float> times = std::span(content.times).first(rays.size());
    std::vector<Hit> together(rays.size()), alone(rays.size());
    std::vector<int> hidden(rays.size());
    const auto put = [](std::vector<Hit>& hits) {
        return [&hits](size_t i, const Hit& h, const InstancePath& path) {
            hits[i] = h;
            EXPECT_EQ(path.depth, 0u);
        };
    };
    using Closest = RayQueue<W, Query::Closest, Filter, MostNesting + 1>;
    Closest(content.world, 0, rays, filter, times, {}, 1).run_alone(put(alone));
    Closest(content.world, 0, rays, filter, times, {}, 1).run(put(together));
    RayQueue<W, Query::Any, Filter, MostNesting + 1>(content.world, 0, rays, filter, times, {}, 1)
        .run([&](size_t i, const Hit& h, const InstancePath&) { hidden[i] = h.found(); });
    for (size_t i = 0; i < rays.size(); i++) {
        ASSERT_EQ(together[i].leaf, alone[i].leaf) << named.name << ", ray " << i;
        ASSERT_EQ(std::memcmp(&together[i], &alone[i], sizeof(Hit)), 0) << named.name << ", ray " << i;
        ASSERT_EQ(hidden[i] != 0, alone[i].found()) << named.name << ", ray " << i;
    }
}

} // namespace

TEST(Packets, ThroughWhatChangesFindWhatTheirRaysFindAlone) {
    for (const bool mesh : {false, true}) {
        const ChangingContent content(mesh);
        ASSERT_TRUE(content.memory.page().changes());
        EverythingIsThere all;
        for (const Named& named : all_rays()) {
            Picky picky{named.rays};
            expect_as_alone<8>(content, named, all);
            expect_as_alone<16>(content, named, all);
            expect_as_alone<8>(content, named, picky);
            expect_as_alone<16>(content, named, picky);
        }
    }
}

// What runs side by side goes together, each ray once; what does not goes alone, in its order.
TEST(Packets, AreOfRaysThatRunSideBySide) {
    RayGroups groups;
    for (const Named& named : all_rays()) {
        groups.sort(named.rays, Vec3f(2.5f));
        std::vector<int> seen(named.rays.size());
        size_t in_packets = 0;
        for (const PacketOfRays& p : groups.packets())
            for (int k = 0; k < p.count; k++, in_packets++) {
                seen[p.ray[k]]++;
                for (int a = 0; a < 3; a++)
                    EXPECT_EQ(std::signbit(named.rays[p.ray[k]].d[a]),
                              std::signbit(named.rays[p.ray[0]].d[a]));
            }
        for (const uint32_t i : groups.alone())
            seen[i]++;
        EXPECT_TRUE(std::ranges::all_of(seen, [](int n) { return n == 1; })) << named.name;
        EXPECT_GE(in_packets * 2, named.together ? named.rays.size() : 0) << named.name;
        if (std::strcmp(named.name, "random") == 0) {
            EXPECT_EQ(in_packets, 0u);
            EXPECT_TRUE(std::ranges::is_sorted(groups.alone()));
        }
    }
}

// Of any node: what is entered together holds what each ray enters, and what each enters in a packet is what
// it enters alone, at the same distance, by 1, 8 and 16 lanes.
namespace {

template <int W>
void expect_same_children(const Node& node, const TracedRay (&rays)[PacketRays], size_t& entered) {
    PacketBoxes<W> boxes;
    boxes.set(rays);
    uint32_t children[PacketRays] = {}, keys[PacketRays][8] = {};
    boxes.enter_each(node, boxes.enter_together(node), 0xffff,
                     [&](uint32_t key, uint32_t which, const float* t) {
                         for (int i = 0; i < PacketRays; i++)
                             if (which >> i & 1) {
                                 children[i] |= 1u << (key & 7);
                                 keys[i][key & 7] = (std::bit_cast<uint32_t>(t[i]) & ~7u) | (key & 7);
                             }
                     });
    for (int i = 0; i < PacketRays; i++) {
        const Entered one = enter_children(node, rays[i]).sorted();
        alignas(32) uint32_t alone[8];
        _mm256_store_si256(reinterpret_cast<__m256i*>(alone), one.keys);
        uint32_t expected = 0;
        for (int k = 0; k < one.count; k++) {
            expected |= 1u << (alone[k] & 7);
            ASSERT_EQ(keys[i][alone[k] & 7], alone[k]) << "ray " << i;
        }
        ASSERT_EQ(children[i], expected) << "ray " << i;
        entered += size_t(one.count);
    }
}

} // namespace

TEST(Packets, EnterTheChildrenThatTheirRaysEnter) {
    const Content content(false);
    const Page page = content.memory.page();
    const Header& h = page.header();
    Random random(8);
    size_t entered = 0;
    for (int round = 0; round < 3000; round++) {
        const Node& node = page.at<Node>(make_ref(
            Kind::Nodes, h.nodes + random.below(uint32_t(h.node_bytes / sizeof(Node))) * sizeof(Node)));
        // Spread by anything from nothing to all there is; along axes too.
        const float spread = round % 5 == 0 ? 0 : std::exp2(random.uniform(-20, 0));
        const Vec3f o = random.direction() * random.uniform(0, 3), to = random.in_box(0.9f) - o;
        Vec3f d = to;
        if (round % 7 == 0)
            d[int(random.below(3))] = random.below(2) ? 0.0f : -0.0f;
        TracedRay rays[PacketRays];
        for (TracedRay& ray : rays) {
            Ray r{o + random.in_box(spread), random.uniform(0, spread), d};
            for (int a = 0; a < 3; a++)
                r.d[a] = d[a] * random.uniform(1 - 0.9f * spread, 1 + spread);
            r.t_max = round % 3 ? Infinity : random.uniform(0.9f, 1.1f);
            ray = TracedRay(r);
            ASSERT_TRUE(ray.traceable);
        }
        expect_same_children<1>(node, rays, entered);
        expect_same_children<8>(node, rays, entered);
        expect_same_children<16>(node, rays, entered);
    }
    EXPECT_GT(entered, 10000u);
}

} // namespace kanuka::hierarchy::testing
