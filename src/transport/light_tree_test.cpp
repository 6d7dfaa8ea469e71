// The hierarchy of lights: chances against counts, bounds that never darken a light, the same for any number
// of threads and lanes.
#include <cstring>
#include <gtest/gtest.h>
#include <random>

#include "base/tasks.h"
#include "base/test_statistics.h"
#include "transport/lights.h"

namespace kanuka::transport {
namespace {

struct Random {
    std::mt19937 g;
    explicit Random(uint32_t seed) : g(seed) {}
    float operator()(float lo = -1, float hi = 1) { return std::uniform_real_distribution<float>(lo, hi)(g); }
    Vec3f direction() {
        Vec3f d;
        do
            d = {(*this)(), (*this)(), (*this)()};
        while (dot(d, d) > 1 || dot(d, d) < 1e-3f);
        return normalize(d);
    }
};

// Small one-sided facets, points and spots, in clusters.
std::vector<LightBound> some_lights(int count, uint32_t seed) {
    Random u(seed);
    std::vector<LightBound> lights;
    Vec3f cluster(0, 0, 0);
    for (int i = 0; i < count; i++) {
        if (i % 7 == 0)
            cluster = Vec3f(u(), u(), u()) * 5.0f;
        LightBound b;
        b.center = cluster + Vec3f(u(), u(), u()) * 0.5f;
        b.radius = i % 3 == 0 ? 0.0f : u(0, 0.1f);
        b.axis = u.direction();
        b.cos_spread = i % 3 == 0 ? (i % 2 ? -1.0f : 1.0f) : 1.0f;
        b.cos_reach = i % 3 == 0 && i % 2 == 0 ? 0.7f : 0.0f;
        b.power = std::exp(3 * u());
        b.sets = i % 5 == 0 ? 2 : 3;
        lights.push_back(b);
    }
    return lights;
}

LightQuery some_query(Random& u) {
    return {Vec3f(u(), u(), u()) * 6.0f, u() < 0 ? Vec3f(0, 0, 0) : u.direction(), u() < 0 ? 1 : 2};
}

bool same(const LightTree& a, const LightTree& b) {
    return a.nodes.size() == b.nodes.size() && a.parent == b.parent && a.place == b.place &&
           std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(LightNode)) == 0;
}

} // namespace

TEST(LightTree, ChancesAddUpToOne) {
    Random u(3);
    for (int count : {1, 2, 8, 9, 100, 3000}) {
        const LightTree tree = build_light_tree(some_lights(count, uint32_t(count)));
        for (int k = 0; k < 20; k++) {
            const LightQuery q = some_query(u);
            double sum = 0;
            for (int leaf = 0; leaf < count; leaf++)
                sum += double(chance_of_light(tree, q, leaf));
            if (pick_light(tree, q, 0.5).leaf >= 0) {
                // A branch may turn out dark further down: what it had is lost, not misplaced.
                EXPECT_LT(sum, 1 + 1e-4) << count;
                EXPECT_GT(sum, 0.3) << count;
            }
        }
    }
}

TEST(LightTree, PicksAsOftenAsItSays) {
    Random u(5);
    const int count = 300;
    const LightTree tree = build_light_tree(some_lights(count, 17));
    for (int k = 0; k < 6; k++) {
        const LightQuery q = some_query(u);
        std::vector<double> seen(count + 1), expected(count + 1);
        constexpr int N = 200000;
        expected[count] = N;
        for (int leaf = 0; leaf < count; leaf++) {
            expected[size_t(leaf)] = N * double(chance_of_light(tree, q, leaf));
            expected[count] -= expected[size_t(leaf)];
        }
        expected[count] = std::max(expected[count], 0.0);
        std::mt19937_64 g(k);
        for (int i = 0; i < N; i++) {
            const LightPick pick = pick_light(tree, q, std::uniform_real_distribution<double>(0, 1)(g));
            seen[size_t(pick.leaf < 0 ? count : pick.leaf)]++;
            if (pick.leaf >= 0) {
                ASSERT_NEAR(pick.chance, chance_of_light(tree, q, pick.leaf), 1e-5f * pick.chance);
            }
        }
        EXPECT_GT(testing::chi_square(seen, expected).p, testing::sidak(0.001, 6));
        EXPECT_EQ(testing::chi_square(seen, expected).impossible, 0);
    }
}

// A light that contributes is never without a chance, in whatever company.
TEST(LightTree, BoundsDarkenNoLight) {
    Random u(7);
    const auto lights = some_lights(500, 23);
    const LightTree tree = build_light_tree(lights);
    int lit = 0;
    for (int k = 0; k < 300; k++) {
        const LightQuery q = some_query(u);
        for (size_t i = 0; i < lights.size(); i++) {
            const LightBound& b = lights[i];
            const Vec3f from = normalize(q.P - b.center);
            const bool shines = b.cos_spread == -1 || dot(from, b.axis) > b.cos_reach;
            const bool taken = (q.N.x == 0 && q.N.y == 0 && q.N.z == 0) || dot(q.N, -from) > 0;
            if (shines && taken && (b.sets & q.set)) {
                lit++;
                ASSERT_GT(chance_of_light(tree, q, int(i)), 0) << i;
            }
            if (!(b.sets & q.set)) {
                EXPECT_EQ(chance_of_light(tree, q, int(i)), 0);
            }
        }
    }
    EXPECT_GT(lit, 10000);
}

TEST(LightTree, TheSameForAnyThreadCount) {
    const auto lights = some_lights(50000, 29);
    LightTree reference;
    for (int threads : {1, 2, 4})
        tasks::with_threads(threads, [&] {
            const LightTree tree = build_light_tree(lights);
            if (reference.empty())
                reference = tree;
            EXPECT_TRUE(same(tree, reference)) << threads;
        });
    EXPECT_LT(double(reference.bytes()) / 50000, 110);
}

namespace {

// W points at a time against one at a time.
template <int W>
void expect_lanes_agree(const LightTree& tree, int count) {
    Random u(11);
    for (int k = 0; k < 200; k++) {
        Receiver<W> r;
        Receiver<1> one[W];
        Float<W> u0, u1;
        for (int i = 0; i < W; i++) {
            const LightQuery q = some_query(u);
            for (int c = 0; c < 3; c++) {
                r.P[c].v[i] = q.P[c], r.N[c].v[i] = q.N[c];
                one[i].P[c] = Float<1>(q.P[c]), one[i].N[c] = Float<1>(q.N[c]);
            }
            one[i].oriented = Mask<1>(dot(q.N, q.N) > 0);
            r.set.v[i] = q.set, one[i].set = Int<1>(q.set);
            u0.v[i] = u(0, 1), u1.v[i] = u(0, 1);
        }
        r.oriented = dot(r.N, r.N) > Float<W>(0.0f);
        Int<W> leaf;
        Float<W> chance;
        pick_leaf(tree, r, u0, u1, Mask<W>(true), leaf, chance);
        const Float<W> again = chance_of_leaf(tree, r, leaf, Mask<W>(true));
        for (int i = 0; i < W; i++) {
            Int<1> leaf1;
            Float<1> chance1;
            pick_leaf(tree, one[i], Float<1>(u0[i]), Float<1>(u1[i]), Mask<1>(true), leaf1, chance1);
            EXPECT_EQ(leaf[i], leaf1[0]);
            EXPECT_EQ(chance[i], chance1[0]);
            EXPECT_LT(leaf[i], count);
            if (chance[i] > 0) {
                EXPECT_NEAR(again[i], chance[i], 1e-5f * chance[i]);
            }
        }
    }
}

} // namespace

TEST(LightTree, LanesAgree) {
    for (int count : {3, 8, 200}) {
        const LightTree tree = build_light_tree(some_lights(count, 31));
        EXPECT_EQ(LightTreeView(tree).flat(), count <= 8);
        expect_lanes_agree<1>(tree, count);
        expect_lanes_agree<8>(tree, count);
        expect_lanes_agree<16>(tree, count);
    }
}

// Lanes over points and lanes over children do the same.
TEST(LightTree, FlatOnesAreWalkedAlike) {
    Random u(13);
    const LightTree tree = build_light_tree(some_lights(8, 37));
    for (int k = 0; k < 500; k++) {
        const LightQuery q = some_query(u);
        const Receiver<1> r{{Float<1>(q.P.x), Float<1>(q.P.y), Float<1>(q.P.z)},
                            {Float<1>(q.N.x), Float<1>(q.N.y), Float<1>(q.N.z)},
                            Mask<1>(dot(q.N, q.N) > 0),
                            Int<1>(q.set)};
        const float x = u(0, 1);
        const LightPick pick = pick_light(tree, q, double(x));
        Int<1> leaf;
        Float<1> chance;
        pick_leaf(tree, r, Float<1>(x), Float<1>(0.0f), Mask<1>(true), leaf, chance);
        EXPECT_FLOAT_EQ(chance[0], pick.leaf < 0 ? 0 : pick.chance);
        if (pick.leaf >= 0) {
            EXPECT_EQ(leaf[0], pick.leaf);
        }
    }
}

namespace {

struct Facet {
    double at[3], axis[3], power;
};

// Conty Estevez and Kulla 2018, section 4.1: over all directions, the most that a facet within the cone of
// normals gives there; a facet gives what the cosine leaves, to 90 degrees. By quadrature.
double reach_of_cone(double theta) {
    constexpr int Steps = 400;
    double sum = 0;
    for (int i = 0; i < Steps; i++) {
        const double a = M_PI * (i + 0.5) / Steps, from = std::max(a - theta, 0.0);
        sum += from < M_PI / 2 ? std::cos(from) * std::sin(a) : 0;
    }
    return sum * 2 * M_PI * M_PI / Steps;
}

// Power times reach times surface of the box, and a thousandth of its diagonal's square; a cap of half angle
// t has a mean normal of (1 + cos t) / 2.
double cost_of(const std::vector<Facet>& facets, uint32_t which) {
    double lo[3], hi[3], axis[3] = {}, power = 0;
    int n = 0;
    for (size_t i = 0; i < facets.size(); i++) {
        if (!(which >> i & 1))
            continue;
        for (size_t c = 0; c < 3; c++) {
            lo[c] = n ? std::min(lo[c], facets[i].at[c]) : facets[i].at[c];
            hi[c] = n ? std::max(hi[c], facets[i].at[c]) : facets[i].at[c];
            axis[c] += facets[i].axis[c];
        }
        power += facets[i].power;
        n++;
    }
    const double d[3] = {hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]};
    const double mean = std::hypot(axis[0], axis[1], axis[2]) / n;
    const double box =
        d[0] * d[1] + d[1] * d[2] + d[2] * d[0] + 1e-3 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    return power * reach_of_cone(std::acos(std::clamp(2 * mean - 1, -1.0, 1.0))) * box;
}

// The least cost of parting them at a twelfth of the way along an axis, short ones dearer; that of a given
// part.
double least_cost(const std::vector<Facet>& facets, uint32_t part, double& of_part) {
    const uint32_t all = (1u << facets.size()) - 1;
    double lo[3], d[3], longest = 0, least = 1e300;
    for (size_t c = 0; c < 3; c++) {
        const auto [a, b] = std::ranges::minmax(facets, {}, [&](const Facet& f) { return f.at[c]; });
        lo[c] = a.at[c], d[c] = b.at[c] - a.at[c], longest = std::max(longest, d[c]);
    }
    of_part = 1e300;
    for (size_t c = 0; c < 3; c++)
        for (int cut = 1; cut < 12; cut++) {
            uint32_t low = 0;
            for (size_t i = 0; i < facets.size(); i++)
                low |= uint32_t((facets[i].at[c] - lo[c]) / d[c] * 12 < cut) << i;
            const double cost = (cost_of(facets, low) + cost_of(facets, all & ~low)) * longest / d[c];
            least = std::min(least, cost);
            if (low == part || low == (all & ~part))
                of_part = std::min(of_part, cost);
        }
    return least;
}

} // namespace

// Nine lights are one too many for a node, and parted once: as their power, extent and normals have it.
TEST(LightTree, PartsWhereItCostsLeast) {
    Random u(41);
    for (int k = 0; k < 150; k++) {
        std::vector<Facet> facets;
        std::vector<LightBound> lights;
        const Vec3f mean = u.direction();
        const float narrow = k % 3 == 0 ? 3.0f : k % 3 == 1 ? 1.0f : 0.0f;
        for (int i = 0; i < 9; i++) {
            LightBound b;
            b.center = Vec3f(u(), u(), 0.3f * u());
            b.axis = normalize((u() < 0.6f ? mean : -mean) * narrow + u.direction());
            b.cos_spread = 1, b.cos_reach = 0;
            b.power = std::exp(u());
            lights.push_back(b);
            Facet f;
            for (int c = 0; c < 3; c++)
                f.at[c] = double(b.center[c]), f.axis[c] = double(b.axis[c]);
            f.power = double(b.power);
            facets.push_back(f);
        }
        const LightTree tree = build_light_tree(lights);
        uint32_t part = 0;
        for (size_t i = 0; i < 9; i++) {
            const int32_t node = tree.place[i] / 8,
                          child = node == 0 ? tree.place[i] % 8 : tree.parent[size_t(node)] % 8;
            ASSERT_LT(child, 2);
            part |= uint32_t(child) << i;
        }
        double of_part;
        const double least = least_cost(facets, part, of_part);
        EXPECT_LT(of_part, least * 1.001) << k;
    }
}

// Lights that are all in one place, of no size, of a size beyond numbers, in numbers.
TEST(LightTree, OddLights) {
    std::vector<LightBound> lights(1000);
    for (auto& b : lights)
        b.power = 1;
    LightTree tree = build_light_tree(lights);
    EXPECT_NEAR(chance_of_light(tree, {{1, 0, 0}, {0, 0, 0}, 1}, 77), 1e-3f, 1e-6f);
    lights[3].center.x = std::numeric_limits<float>::quiet_NaN();
    lights[4].power = std::numeric_limits<float>::infinity();
    lights[5].radius = std::numeric_limits<float>::infinity();
    lights[6].power = 0;
    tree = build_light_tree(lights);
    for (int i : {3, 4, 5, 6})
        EXPECT_EQ(chance_of_light(tree, {{1, 0, 0}, {0, 0, 0}, 1}, i), 0);
    EXPECT_TRUE(build_light_tree({}).empty());
    // Each twice as far as the one before.
    for (size_t i = 0; i < lights.size(); i++)
        lights[i] = {{std::pow(1.05f, float(i)), 0, 0}, 0, {0, 0, 1}, -1, 0, 1};
    tree = build_light_tree(lights);
    int found = 0;
    const LightRay beside{{0, 0, -1}, {0, 0, 1}, 1e30f}, through{{-1, 0, 0}, {1, 0, 0}, 1e30f};
    lights_along(tree, 1, &beside, [&](int, int) { found++; });
    EXPECT_EQ(found, 0);
    for (auto& b : lights)
        b.radius = 1;
    tree = build_light_tree(lights);
    lights_along(tree, 1, &through, [&](int, int) { found++; });
    EXPECT_EQ(found, 1000);
}

} // namespace kanuka::transport
