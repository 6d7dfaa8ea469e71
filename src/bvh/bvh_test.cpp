// Rays against grids and meshes: hits of brute force, conventions of u, v and the face, presence,
// watertightness, widths.
#include "bvh/test_geometry.h"

#include <atomic>

#include <gtest/gtest.h>

#include "base/cancel.h"
#include "base/tasks.h"
#include "base/test_statistics.h"

namespace kanuka::bvh {
namespace {

using namespace testing;

// Hits agree with brute force, but where a ray passes an edge as close as rounding.
void compare(const Shapes& shapes, const std::vector<Ray>& rays, const std::vector<Hit>& hits,
             int least_hits) {
    int found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Reference r = trace(shapes.triangles, rays[i]);
        if (r.margin < 1e-5)
            continue;
        ASSERT_EQ(hits[i].hit, r.triangle != nullptr) << "ray " << i;
        if (!hits[i].hit)
            continue;
        found++;
        ASSERT_NEAR(hits[i].t, r.t, 2e-5 * (1 + r.t)) << "ray " << i;
        ASSERT_EQ(hits[i].shape, r.triangle->shape) << "ray " << i;
        // The normal of the winding: cross(dP/du, dP/dv).
        const Point n = cross(r.triangle->b - r.triangle->a, r.triangle->c - r.triangle->a), Ng(hits[i].Ng);
        ASSERT_GT(dot(n, Ng) / std::sqrt(dot(n, n) * dot(Ng, Ng)), 0.99999) << "ray " << i;
    }
    EXPECT_GT(found, least_hits);
}

} // namespace

TEST(Bvh, SphereLatticeAgainstBruteForce) {
    Shapes shapes;
    shapes.add_sphere({0.1f, 0.2f, 0.3f}, 1, 24);
    const auto rays = random_rays(3000, 1.5f, 1);
    for (bool watertight : {true, false}) {
        const auto scene = shapes.flat_scene({.watertight = watertight, .pages_from = 0});
        compare(shapes, rays, intersect<8>(*scene, rays), 800);
    }
}

TEST(Bvh, RandomQuadsAgainstBruteForce) {
    Shapes shapes;
    std::mt19937 g(2);
    std::uniform_real_distribution<float> u(-1, 1);
    const auto corner = [&](const Vec3f& c) { return c + Vec3f(u(g), u(g), u(g)) * 0.3f; };
    for (int i = 0; i < 300; i++) {
        const Vec3f c(u(g), u(g), u(g));
        const std::vector<Vec3f> points = {corner(c), corner(c), corner(c), corner(c)};
        if (i % 3 == 0)
            shapes.add_grid(1, 1, points);
        else if (i % 3 == 1)
            shapes.add_mesh(4, points, {0, 1, 2, 3});
        else
            shapes.add_mesh(3, points, {0, 1, 2, 2, 1, 3});
    }
    const auto scene = shapes.flat_scene();
    const auto rays = random_rays(4000, 1.5f, 3);
    compare(shapes, rays, intersect<8>(*scene, rays), 2000);
}

// A landscape of a few polygons is as large as all that stands on it: 2^-17 of it would show there.
TEST(Bvh, FewLargePolygonsStayWhereTheyAre) {
    Shapes shapes;
    const float far = 5000, height = 0.53f;
    shapes.add_mesh(4, {{-far, -far, height}, {far, -far, height}, {far, far, height}, {-far, far, height}},
                    {0, 1, 2, 3});
    shapes.add_sphere({3, 3, 1.53f}, 1, 24);
    const auto scene = shapes.flat_scene();
    EXPECT_GT(scene->page_bytes().built, 0u);
    std::vector<Ray> rays;
    for (int i = 0; i < 64; i++)
        rays.push_back({{float(i % 8) - 4, float(i / 8) - 8, 2.53f}, {0, 0, -1}});
    for (const Hit& h : intersect<8>(*scene, rays))
        EXPECT_NEAR(h.t, 2, 0.002f);
}

// u and v run over the whole grid; a cell splits into (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0).
TEST(Bvh, GridCoordinatesNameThePlace) {
    Shapes shapes;
    std::mt19937 g(4);
    std::uniform_real_distribution<float> u(0, 1);
    constexpr int MU = 5, MV = 3;
    std::vector<Vec3f> points;
    for (int j = 0; j <= MV; j++)
        for (int i = 0; i <= MU; i++)
            points.push_back({float(i), float(j), u(g)});
    shapes.add_grid(MU, MV, points);
    const auto scene = shapes.flat_scene();
    std::vector<Ray> rays;
    for (int i = 0; i < 2000; i++)
        rays.push_back({{u(g) * MU, u(g) * MV, 5}, {0.01f, 0.02f, -1}});
    int both[2] = {0, 0};
    const auto hits = intersect<8>(*scene, rays);
    for (size_t k = 0; k < rays.size(); k++) {
        if (!hits[k].hit)
            continue;
        const double x = double(hits[k].u) * MU, y = double(hits[k].v) * MV;
        const int i = std::min(int(x), MU - 1), j = std::min(int(y), MV - 1);
        const double fx = x - i, fy = y - j;
        const auto at = [&](int a, int b) { return shapes.vertex(0, size_t((j + b) * (MU + 1) + i + a)); };
        const bool second = fx + fy > 1;
        both[second]++;
        const Point p = second
                            ? at(1, 1) + (at(0, 1) - at(1, 1)) * (1 - fx) + (at(1, 0) - at(1, 1)) * (1 - fy)
                            : at(0, 0) + (at(1, 0) - at(0, 0)) * fx + (at(0, 1) - at(0, 0)) * fy;
        const Point q = Point(rays[k].o) + Point(rays[k].d) * double(hits[k].t);
        ASSERT_LT(std::sqrt(dot(p - q, p - q)), 2e-5) << "u " << hits[k].u << " v " << hits[k].v;
    }
    EXPECT_GT(both[0], 500);
    EXPECT_GT(both[1], 500);
}

// Meshes: prim is the face. Triangles have v0 + u (v1 - v0) + v (v2 - v0); quads split into (v0, v1, v3) and
// (v2, v3, v1).
TEST(Bvh, MeshCoordinatesNameThePlace) {
    std::mt19937 g(5);
    std::uniform_real_distribution<float> u(0, 1);
    const std::vector<Vec3f> points = {{0, 0, 0.2f}, {1, 0, 0},    {1, 1, 0.5f},
                                       {0, 1, 0},    {2, 0, 0.3f}, {2, 1, 0.1f}};
    for (int n : {3, 4}) {
        const std::vector<uint32_t> indices = n == 3
                                                  ? std::vector<uint32_t>{0, 1, 3, 2, 3, 1, 1, 4, 2, 5, 2, 4}
                                                  : std::vector<uint32_t>{0, 1, 2, 3, 1, 4, 5, 2};
        Shapes shapes;
        shapes.add_mesh(n, points, indices);
        const auto scene = shapes.flat_scene();
        const auto at = [&](uint32_t i) { return shapes.vertex(0, i); };
        std::vector<Ray> rays;
        for (int i = 0; i < 1000; i++)
            rays.push_back({{2 * u(g), u(g), 5}, {0, 0.01f, -1}});
        std::vector<int> faces(indices.size() / size_t(n), 0);
        const auto hits = intersect<8>(*scene, rays);
        for (size_t k = 0; k < rays.size(); k++) {
            if (!hits[k].hit)
                continue;
            ASSERT_LT(size_t(hits[k].prim), faces.size());
            faces[size_t(hits[k].prim)]++;
            const uint32_t* f = &indices[size_t(hits[k].prim * n)];
            const double a = hits[k].u, b = hits[k].v;
            const Point p =
                n == 3       ? at(f[0]) + (at(f[1]) - at(f[0])) * a + (at(f[2]) - at(f[0])) * b
                : a + b <= 1 ? at(f[0]) + (at(f[1]) - at(f[0])) * a + (at(f[3]) - at(f[0])) * b
                             : at(f[2]) + (at(f[3]) - at(f[2])) * (1 - a) + (at(f[1]) - at(f[2])) * (1 - b);
            const Point q = Point(rays[k].o) + Point(rays[k].d) * double(hits[k].t);
            ASSERT_LT(std::sqrt(dot(p - q, p - q)), 2e-5);
        }
        for (int count : faces)
            EXPECT_GT(count, 100);
    }
}

TEST(Bvh, ATriangleInAQuadMeshRepeatsItsLastVertex) {
    Shapes shapes;
    shapes.add_mesh(4, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2, 2});
    const auto scene = shapes.flat_scene();
    const auto hits = intersect<1>(*scene, {{{0.2f, 0.3f, 1}, {0, 0, -1}}, {{0.7f, 0.7f, 1}, {0, 0, -1}}});
    EXPECT_TRUE(hits[0].hit);
    EXPECT_FALSE(hits[1].hit);
}

TEST(Bvh, DistancesEndAtTheLimitAndCountInTheDirection) {
    Shapes shapes;
    shapes.add_grid(1, 1, {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}});
    const auto scene = shapes.flat_scene();
    const std::vector<Ray> ray = {{{0.1f, 0.2f, 4}, {0, 0, -2}}};
    EXPECT_FLOAT_EQ(intersect<1>(*scene, ray)[0].t, 2);
    EXPECT_TRUE(occluded<1>(*scene, ray, 0, 2.01f)[0]);
    EXPECT_FALSE(occluded<1>(*scene, ray, 0, 1.99f)[0]);
    RayPacket<8> idle = packet<8>(ray.data(), 1);
    idle.active = Mask<8>(false);
    HitPacket<8> hits;
    scene->intersect(idle, hits);
    EXPECT_TRUE(none(hits.hit));
    EXPECT_TRUE(none(scene->occluded(idle)));
}

TEST(Bvh, WidthsAgree) {
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 20);
    shapes.add_sphere({0.8f, 0, 0}, 0.5f, 10, 0.5f); // half present
    const auto scene = shapes.flat_scene();
    const auto rays = random_rays(5000, 1.5f, 6);
    const auto one = intersect<1>(*scene, rays), eight = intersect<8>(*scene, rays),
               sixteen = intersect<16>(*scene, rays);
    const auto shadow = occluded<1>(*scene, rays);
    EXPECT_EQ(shadow, occluded<8>(*scene, rays));
    EXPECT_EQ(shadow, occluded<16>(*scene, rays));
    int differ = 0;
    for (size_t i = 0; i < rays.size(); i++)
        for (const auto* wide : {&eight, &sixteen}) {
            const Hit &a = one[i], &b = (*wide)[i];
            if (a.hit != b.hit ||
                (a.hit && (a.shape != b.shape || std::abs(a.t - b.t) > 1e-4f * (1 + a.t)))) {
                differ++;
                continue;
            }
            if (a.hit) {
                ASSERT_NEAR(a.u, b.u, 1e-3f);
                ASSERT_NEAR(a.v, b.v, 1e-3f);
            }
        }
    EXPECT_LE(differ, 4); // a ray may graze an edge or a cut-out's hash may see another last digit
}

TEST(Bvh, OccludedIsIntersected) {
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 16);
    shapes.add_sphere({0.5f, 0.5f, 0}, 0.8f, 16, 0.3f);
    const auto scene = shapes.flat_scene();
    const auto rays = random_rays(20000, 1.5f, 7);
    const auto hits = intersect<8>(*scene, rays);
    const auto shadow = occluded<8>(*scene, rays);
    int differ = 0;
    for (size_t i = 0; i < rays.size(); i++)
        differ += hits[i].hit != shadow[i];
    EXPECT_LE(differ, 2);
}

// A surface of presence p stops a share p of rays, whatever their seeds; the same seed decides the same.
TEST(Bvh, PresenceIsTheShareOfHits) {
    for (bool mesh : {false, true})
        for (float p : {0.0f, 0.2f, 0.75f, 1.0f}) {
            Shapes shapes;
            const std::vector<Vec3f> points = {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}};
            if (mesh)
                shapes.add_mesh(3, points, {0, 1, 2, 3, 2, 1}, p);
            else
                shapes.add_grid(1, 1, points, p);
            const auto scene = shapes.flat_scene();
            constexpr int Count = 40000;
            // Distinct places with distinct seeds, and one place with distinct seeds.
            std::vector<Ray> spread, same(Count, {{0.1f, 0.2f, 2}, {0, 0, -1}});
            std::mt19937 g(8);
            std::uniform_real_distribution<float> u(-1, 1);
            for (int i = 0; i < Count; i++)
                spread.push_back({{u(g), u(g), 2}, {0, 0, -1}});
            for (const auto* rays : {&spread, &same}) {
                const auto hits = intersect<8>(*scene, *rays, 12345);
                double n = 0;
                for (const Hit& h : hits)
                    n += h.hit;
                const double error = std::sqrt(std::max(double(p) * (1 - double(p)), 0.0) / Count);
                EXPECT_NEAR(n / Count, p, 4.5 * error + 1e-12) << mesh;
                const auto again = occluded<8>(*scene, *rays, 12345);
                for (size_t i = 0; i < hits.size(); i++)
                    ASSERT_EQ(hits[i].hit, again[i]);
            }
        }
}

// Two layers of one grid or of two are decided apart: 1 - (1 - p)^2.
TEST(Bvh, PresenceOfLayersIsIndependent) {
    for (bool one_shape : {false, true}) {
        Shapes shapes;
        if (one_shape) // a strip folded back over itself
            shapes.add_grid(3, 1,
                            {{-1, -1, 0},
                             {1, -1, 0},
                             {1, -1, 1},
                             {-1, -1, 1},
                             {-1, 1, 0},
                             {1, 1, 0},
                             {1, 1, 1},
                             {-1, 1, 1}},
                            0.5f);
        else
            for (float z : {0.0f, 1.0f})
                shapes.add_grid(1, 1, {{-1, -1, z}, {1, -1, z}, {-1, 1, z}, {1, 1, z}}, 0.5f);
        const auto scene = shapes.flat_scene();
        constexpr int Count = 40000;
        const auto shadow = occluded<8>(*scene, std::vector<Ray>(Count, {{0.1f, 0.2f, 3}, {0, 0, -1}}), 99);
        const double n = double(std::count(shadow.begin(), shadow.end(), true));
        EXPECT_NEAR(n / Count, 0.75, 4.5 * std::sqrt(0.75 * 0.25 / Count)) << one_shape;
    }
}

// No ray from inside gets out of a closed lattice. Robust mode decides an edge alike for both of its
// triangles, but not yet a vertex for all of its own: of rays aimed at a vertex to the last digit, just under
// one in a hundred gets through.
TEST(Bvh, ClosedLatticesDoNotLeak) {
    Shapes shapes;
    shapes.add_sphere({0.1f, 0.2f, 0.3f}, 1, 64);
    const auto scene = shapes.flat_scene();
    const float* P = shapes.store.floats(shapes.store.shapes()[0]) + shapes.store.shapes()[0].positions;
    std::mt19937 g(9);
    const auto unit = [&] { return float(g() >> 8) * 0x1p-23f - 1; };
    constexpr int Row = 129, Rows = 65;
    enum Aim { Anywhere, AtEdge, AtVertex };
    const auto missed = [&](Aim aim, int count) {
        RayPacket<8> rays;
        HitPacket<8> hits;
        rays.t_max = Float<8>(1e30f);
        rays.active = Mask<8>(true);
        rays.seed = Int<8>(0);
        int64_t missed = 0;
        for (int k = 0; k < count / 8; k++) {
            for (int i = 0; i < 8; i++) {
                const Vec3f o(0.3f * unit(), 0.3f * unit(), 0.3f * unit());
                Vec3f d(unit(), unit(), unit());
                if (aim != Anywhere) {
                    const int v = int(g() % (Row * (Rows - 1))),
                              step[] = {1, Row, Row - 1}; // two sides and the diagonal
                    const int w = v + step[g() % 3];
                    const Vec3f a(P[3 * v], P[3 * v + 1], P[3 * v + 2]),
                        b(P[3 * w], P[3 * w + 1], P[3 * w + 2]);
                    d = lerp(aim == AtVertex ? 0.0f : 0.01f + 0.49f * (unit() + 1), a, b) - o;
                }
                for (int c = 0; c < 3; c++)
                    rays.o[c].v[i] = o[c], rays.d[c].v[i] = d[c];
            }
            scene->intersect(rays, hits);
            missed += 8 - __builtin_popcount(hits.hit.bits());
        }
        return missed;
    };
    EXPECT_EQ(missed(Anywhere, 4000000), 0);
    EXPECT_LT(missed(AtEdge, 200000), 20);
    EXPECT_LT(missed(AtVertex, 200000), 2000);
}

// What is broken does not stop the rest.
TEST(Bvh, BrokenGeometryIsNeverHit) {
    const float NaN = std::numeric_limits<float>::quiet_NaN(), Inf = std::numeric_limits<float>::infinity();
    Shapes shapes;
    shapes.add_grid(1, 1, {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}});
    for (float bad : {NaN, Inf}) {
        shapes.add_grid(1, 1, {{-1, -1, 1}, {1, -1, 1}, {-1, bad, 1}, {1, 1, 1}});
        shapes.add_mesh(3, {{-1, -1, 1}, {1, bad, 1}, {-1, 1, 1}}, {0, 1, 2});
    }
    shapes.add_grid(1, 1, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}}); // a point
    const auto scene = shapes.flat_scene();
    std::vector<Ray> rays(16, {{0.3f, 0.2f, 5}, {0, 0, -1}});
    rays[3].d.x = NaN;
    rays[4].o.y = NaN;
    rays[5].d = {0, 0, 0};
    rays[6].d = {Inf, 0, 0};
    const auto hits = intersect<8>(*scene, rays);
    for (size_t i = 0; i < rays.size(); i++)
        if (i < 3 || i > 6) {
            EXPECT_TRUE(hits[i].hit);
            EXPECT_EQ(hits[i].shape, 0);
        } else {
            EXPECT_FALSE(hits[i].hit) << i;
        }
}

TEST(Bvh, AnEmptySceneIsMissed) {
    store::Store store;
    GroupDesc world;
    const Scene scene(store, std::span(&world, 1), {.pages_from = 0});
    EXPECT_FALSE(intersect<1>(scene, {{{0, 0, 0}, {0, 0, 1}}})[0].hit);
    EXPECT_TRUE(scene.bounds().empty());
}

// Embree asks as it builds, and ends soon after the answer.
TEST(Bvh, ABuildIsCancelled) {
    Shapes shapes;
    std::vector<Vec3f> points;
    std::vector<uint32_t> indices;
    constexpr uint32_t N = 400;
    for (uint32_t i = 0; i < N * N; i++)
        points.push_back({float(i % N), float(i / N), float(i * 7 % 5)});
    for (uint32_t i = 0; i + N + 1 < N * N; i++)
        indices.insert(indices.end(), {i, i + 1, i + N});
    shapes.add_mesh(3, points, indices);
    std::atomic<int> asked{0};
    const int last = std::numeric_limits<int>::max();
    const auto build = [&](int yes_at) {
        asked = 0;
        tasks::with_threads(1, [&] {
            shapes.flat_scene(
                {.cancelled = [&asked, yes_at] { return ++asked >= yes_at; }, .pages_from = AllInEmbree});
        });
        return asked.load();
    };
    const int whole = build(last);
    ASSERT_GT(whole, 40);
    for (const int at : {1, whole / 2}) {
        EXPECT_THROW(build(at), tasks::Cancelled);
        EXPECT_LE(asked - at, 16); // what goes on side by side may ask again
    }
}

TEST(Bvh, BoundsAndMemory) {
    Shapes shapes;
    shapes.add_sphere({1, 2, 3}, 2, 16);
    const auto scene = shapes.flat_scene();
    const Bounds3f b = scene->bounds();
    EXPECT_LT(length(b.center() - Vec3f(1, 2, 3)), 1e-3f);
    EXPECT_LT(length(b.diagonal() - Vec3f(4, 4, 4)), 1e-3f);
    EXPECT_GT(scene->bytes(), 0u);
}

} // namespace kanuka::bvh
