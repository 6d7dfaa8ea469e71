// Shapes that change: beside all their triangles where they are at the time of each ray, in doubles; beside
// pages that stand still; closed surfaces; damaged pages.
#include <gtest/gtest.h>

#include "hierarchy/decode.h"
#include "hierarchy/queue.h"
#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::testing {
namespace {

enum class As { Grids, Triangles, Quads };

// Quads of grids with corners in order around them.
std::vector<uint32_t> quads_of(const std::vector<TestGrid>& grids) {
    std::vector<uint32_t> corners;
    uint32_t first = 0;
    for (const TestGrid& g : grids) {
        const uint32_t row = uint32_t(g.columns) + 1;
        for (uint32_t y = 0; y < uint32_t(g.rows); y++)
            for (uint32_t x = 0; x < uint32_t(g.columns); x++) {
                const uint32_t a = first + y * row + x;
                corners.insert(corners.end(), {a, a + 1, a + row + 1, a + row});
            }
        first += row * uint32_t(g.rows + 1);
    }
    return corners;
}

// Grids as they are at even times, in pages and listed.
struct Changing {
    std::vector<std::vector<TestGrid>> at; // times
    Lattice lattice;
    std::vector<PageMemory> memory;
    World world;
    uint32_t root = 0;

    Changing(std::vector<std::vector<TestGrid>> keys, As as, int finer = 0) : at(std::move(keys)) {
        std::vector<GridView> all;
        for (const auto& grids : at)
            for (const TestGrid& g : grids)
                all.push_back(g.view());
        lattice = votes_of({all, {}}).lattice();
        lattice.exponent -= finer;
        std::vector<MeshOfGrids> meshes;
        for (const auto& grids : at)
            meshes.emplace_back(grids);
        const std::vector<uint32_t> quads = quads_of(at[0]);
        for (size_t k = 0; k + 1 < at.size(); k++) {
            std::vector<GridView> grids = views(at[k]);
            for (size_t g = 0; g < grids.size(); g++)
                grids[g].later = at[k + 1][g].positions.data();
            MeshView mesh = meshes[k].view();
            if (as == As::Quads)
                mesh.corners = quads.data(), mesh.faces = quads.size() / 4, mesh.sides = 4;
            mesh.later = meshes[k + 1].positions.data();
            memory.push_back(as == As::Grids ? build({grids, {}}, lattice)
                                             : build({{}, {&mesh, 1}}, lattice));
        }
        stand();
    }
    void stand() {
        Placements place{world.add(memory[0].page())};
        for (size_t k = 1; k < memory.size(); k++)
            world.add(memory[k].page());
        place.intervals = uint32_t(memory.size());
        root = world.add({&place, 1});
    }
    std::vector<Face> faces(float time) const {
        const float x = time * float(at.size() - 1);
        const size_t k = std::min(size_t(x), at.size() - 2);
        const float f = x - float(k);
        const std::vector<Face> from = faces_of(at[k], lattice), to = faces_of(at[k + 1], lattice);
        std::vector<Face> out = from;
        const auto move = [f](Vec3f& a, const Vec3f& b) {
            for (int c = 0; c < 3; c++)
                a[c] = float(double(a[c]) + (double(b[c]) - double(a[c])) * double(f));
        };
        for (size_t i = 0; i < out.size(); i++)
            move(out[i].a, to[i].a), move(out[i].b, to[i].b), move(out[i].c, to[i].c);
        return out;
    }
    // The number that faces() have.
    uint32_t face_of(const Hit& h, As as, const Page& page) const {
        if (as != As::Grids) {
            const uint32_t n = page.name(h.leaf, int(h.primitive));
            return n;
        }
        const Cell cell = cell_of(page, h.leaf, h.primitive / 2);
        uint32_t face = 0;
        for (uint32_t g = 0; g < cell.grid; g++)
            face += uint32_t(at[0][g].columns * at[0][g].rows * 2);
        return face + uint32_t(cell.row * at[0][cell.grid].columns + cell.column) * 2 + h.primitive % 2;
    }
    std::vector<InstanceHit> closest(std::span<const Ray> rays, std::span<const float> times) const {
        std::vector<InstanceHit> hits(rays.size());
        EverythingIsThere all;
        find_closest<8>(world, root, rays, hits, all, times);
        return hits;
    }
};

std::vector<TestGrid> moved(std::vector<TestGrid> grids, const std::function<Vec3f(const Vec3f&)>& to) {
    for (TestGrid& g : grids)
        for (size_t i = 0; i < g.positions.size(); i += 3) {
            const Vec3f p = to({g.positions[i], g.positions[i + 1], g.positions[i + 2]});
            g.positions[i] = p.x, g.positions[i + 1] = p.y, g.positions[i + 2] = p.z;
        }
    return grids;
}
// A ball that flies, turns, swells and waves.
std::vector<std::vector<TestGrid>> lively(int times, float size = 1, Vec3f away = Vec3f(0.0f)) {
    const std::vector<TestGrid> ball = testing::ball(1, 10, 1, 0.1f, 3);
    std::vector<std::vector<TestGrid>> at;
    for (int k = 0; k < times; k++) {
        const float f = float(k) / float(times - 1), turn = 1.2f * f;
        at.push_back(moved(ball, [&](const Vec3f& p) {
            const Vec3f q = p * (1 + 0.2f * f + 0.15f * std::sin(5 * p.x + 4 * f));
            return away + size * (Vec3f(q.x * std::cos(turn) - q.y * std::sin(turn),
                                        q.x * std::sin(turn) + q.y * std::cos(turn), q.z) +
                                  Vec3f(1.5f * f, f * f, 0));
        }));
    }
    return at;
}

constexpr float Times[] = {0, 0.1f, 0.25f, 1.0f / 3, 0.5f, 0.7f, 0.99f, 1};
std::vector<float> times_of(size_t rays) {
    std::vector<float> times(rays);
    for (size_t i = 0; i < rays; i++)
        times[i] = Times[i % std::size(Times)];
    return times;
}
std::vector<Ray> rays_around(size_t count, float size, Vec3f away, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& r : rays) {
        r.o = away + size * random.in_box(3);
        r.d = away + size * (random.in_box(1.2f) + Vec3f(0.7f, 0.4f, 0)) - r.o;
    }
    return rays;
}

void expect_as_brute_force(const Changing& c, As as, float size, Vec3f away, double slack) {
    const std::vector<Ray> rays = rays_around(4000, size, away, 7);
    const std::vector<float> times = times_of(rays.size());
    const std::vector<InstanceHit> hits = c.closest(rays, times);
    std::vector<InstanceHit> sixteen(rays.size());
    std::vector<uint8_t> hidden(rays.size());
    EverythingIsThere all;
    find_closest<16>(c.world, c.root, rays, sixteen, all, times);
    find_any<8>(c.world, c.root, rays, hidden, all, times);
    size_t sure = 0, found = 0;
    for (const float time : Times) {
        const std::vector<Face> faces = c.faces(time);
        const size_t interval = std::min(size_t(time * float(c.memory.size())), c.memory.size() - 1);
        for (size_t i = 0; i < rays.size(); i++) {
            if (times[i] != time)
                continue;
            ASSERT_EQ(hits[i], sixteen[i]) << i;
            ASSERT_EQ(hidden[i] != 0, hits[i].hit.found()) << i;
            const Reference want = brute_force(faces, rays[i]);
            if (want.margin < slack * 100)
                continue;
            sure++;
            ASSERT_EQ(hits[i].hit.found(), want.t < INFINITY) << i << " at " << time;
            if (!hits[i].hit.found())
                continue;
            found++;
            const Page page = c.world.page(uint32_t(interval));
            ASSERT_EQ(c.face_of(hits[i].hit, as, page), want.name) << i << " at " << time;
            ASSERT_NEAR(double(hits[i].hit.t), want.t, 30 * slack * (1 + want.t)) << i;
            const float x = time * float(c.memory.size()), f = x - float(interval);
            const Face& face = faces[want.name];
            const Vec3f n = cross(face.b - face.a, face.c - face.a),
                        mine = normal_of(page, rays[i], hits[i].hit, f);
            ASSERT_GT(dot(n, mine), 0.99f * length(n) * length(mine)) << i << " at " << time;
        }
    }
    EXPECT_GT(sure, 3000u);
    EXPECT_GT(found, 800u);
}

} // namespace

TEST(ChangingShapes, AreWhereTheirVerticesAre) {
    for (const As as : {As::Grids, As::Triangles, As::Quads})
        for (const int times : {2, 3, 5})
            expect_as_brute_force(Changing(lively(times), as), as, 1, Vec3f(0.0f), 1e-6);
}

TEST(ChangingShapes, InLeavesOfAllKinds) {
    for (const As as : {As::Grids, As::Triangles})
        for (const int finer : {6, 9, 20}) {
            const Changing c(lively(3), as, finer);
            std::set<Kind> kinds;
            for (const PageMemory& m : c.memory)
                for (int k = 1; k < int(Kind::Count); k++)
                    if (m.page().section(Kind(k)).leaf_bytes > 0)
                        kinds.insert(Kind(k));
            const Kind want = finer == 6        ? (as == As::Grids ? Kind::Grid48 : Kind::Triangle48)
                              : as == As::Grids ? Kind::GridFloat
                                                : Kind::TriangleFloat;
            EXPECT_TRUE(kinds.contains(want) || finer == 9) << finer;
            expect_as_brute_force(c, as, 1, Vec3f(0.0f), 1e-6);
        }
}

TEST(ChangingShapes, TinyHugeAndFarAway) {
    for (const float size : {1e-4f, 1e4f})
        expect_as_brute_force(Changing(lively(3, size), As::Grids), As::Grids, size, Vec3f(0.0f), 1e-6);
    const Vec3f away(3000, -2000, 1000);
    expect_as_brute_force(Changing(lively(3, 1, away), As::Grids), As::Grids, 1, away, 1e-4);
}

// What has the same vertices at all times is hit as in a page of what stands still, to the bit.
TEST(ChangingShapes, ThatDoNotAreAsThoseThatStandStill) {
    const std::vector<TestGrid> grids = ball(1, 10, 1, 0.1f, 3);
    for (const As as : {As::Grids, As::Triangles}) {
        const Changing c({grids, grids, grids}, as);
        const std::vector<GridView> all = views(grids);
        const MeshOfGrids mesh(grids);
        const MeshView view = mesh.view();
        const PageMemory still =
            as == As::Grids ? build({all, {}}, c.lattice) : build({{}, {&view, 1}}, c.lattice);
        const std::vector<Ray> rays = rays_around(4000, 1, Vec3f(0.0f), 9);
        std::vector<float> times = times_of(rays.size());
        const std::vector<InstanceHit> hits = c.closest(rays, times);
        std::vector<Hit> want(rays.size());
        EverythingIsThere everything;
        find_closest<8>(still.page(), rays, want, everything);
        size_t found = 0;
        for (size_t i = 0; i < rays.size(); i++) {
            ASSERT_EQ(hits[i].hit.t, want[i].t) << i;
            ASSERT_EQ(hits[i].hit.u, want[i].u) << i;
            ASSERT_EQ(hits[i].hit.v, want[i].v) << i;
            found += want[i].found();
        }
        EXPECT_GT(found, 800u);
    }
}

// Rays from inside, anywhere, at vertices and along edges, at any time.
TEST(ChangingShapes, NoRayLeavesAClosedOne) {
    const Changing c(lively(4), As::Grids), triangles(lively(4), As::Triangles);
    Random random(5);
    std::vector<Ray> rays;
    std::vector<float> times;
    for (int time = 0; time < 40; time++) {
        const float at = random.uniform();
        const std::vector<Face> faces = c.faces(at);
        double middle[3] = {};
        for (const Face& f : faces)
            for (int a = 0; a < 3; a++)
                middle[a] += double(f.a[a]) / double(faces.size());
        const Vec3f o{float(middle[0]), float(middle[1]), float(middle[2])};
        for (int i = 0; i < 2500; i++) {
            const Face& f = faces[random.below(uint32_t(faces.size()))];
            const float w = i % 3 == 0 ? 0 : random.uniform();
            const Vec3f to = i % 3 == 2 ? o + random.direction() : f.a + (f.b - f.a) * w;
            rays.push_back({o + random.in_box(0.1f), 0, to - o});
            times.push_back(at);
        }
    }
    for (const Changing* shape : {&c, &triangles}) {
        const std::vector<InstanceHit> hits = shape->closest(rays, times);
        std::vector<uint8_t> hidden(rays.size());
        EverythingIsThere all;
        find_any<8>(shape->world, shape->root, rays, hidden, all, times);
        size_t leaks = 0;
        for (size_t i = 0; i < rays.size(); i++)
            leaks += !hits[i].hit.found() || !hidden[i];
        EXPECT_EQ(leaks, 0u);
    }
}

// Vertices that are nowhere at some time take what has them away for its intervals, and no more.
TEST(ChangingShapes, PartsThatAreNowhereForAWhile) {
    for (const As as : {As::Grids, As::Triangles, As::Quads}) {
        auto keys = lively(4);
        keys[1][2].positions[3 * 40] = std::numeric_limits<float>::quiet_NaN();
        for (float& x : keys[3][1].positions)
            x = std::numeric_limits<float>::infinity();
        const Changing c(keys, as);
        const std::vector<Ray> rays = rays_around(3000, 1, Vec3f(0.0f), 11);
        const std::vector<float> times = times_of(rays.size());
        const std::vector<InstanceHit> hits = c.closest(rays, times);
        size_t found = 0;
        for (const float time : Times) {
            std::vector<Face> faces = c.faces(time);
            std::erase_if(faces, [](const Face& f) {
                return !is_somewhere(f.a) || !is_somewhere(f.b) || !is_somewhere(f.c);
            });
            for (size_t i = 0; i < rays.size(); i++) {
                if (times[i] != time)
                    continue;
                const Reference want = brute_force(faces, rays[i]);
                if (want.margin < 1e-4 || time == 1.0f / 3) // where the interval begins, whatever f is
                    continue;
                ASSERT_EQ(hits[i].hit.found(), want.t < INFINITY) << i << " at " << time;
                found += hits[i].hit.found();
            }
        }
        EXPECT_GT(found, 500u);
    }
    auto gone = lively(3);
    for (TestGrid& g : gone[2])
        for (float& x : g.positions)
            x = std::numeric_limits<float>::quiet_NaN();
    const Changing c(gone, As::Grids);
    const std::vector<Ray> rays = rays_around(3000, 1, Vec3f(0.0f), 12);
    const std::vector<float> times = times_of(rays.size());
    const std::vector<InstanceHit> hits = c.closest(rays, times);
    size_t before = 0, after = 0;
    for (size_t i = 0; i < rays.size(); i++)
        (times[i] < 0.5f ? before : after) += hits[i].hit.found();
    EXPECT_GT(before, 300u);
    EXPECT_EQ(after, 0u);
}

// Hairs that wave and grow: at each time as fibres that stand where they are then.
TEST(ChangingShapes, Fibres) {
    constexpr uint32_t Hairs = 60, Each = 9;
    const auto hairs = [](float f) {
        std::vector<float> v;
        Random random(3);
        for (uint32_t h = 0; h < Hairs; h++) {
            const Vec3f from = random.in_box(1), to = random.direction();
            const float phase = random.uniform(0, 6);
            for (uint32_t k = 0; k < Each; k++) {
                const float s = float(k) / float(Each - 1);
                // Straight in time, so that halves of it are what an interval has halfway.
                const Vec3f p =
                    from + to * (s * (1 + 0.5f * f)) + Vec3f(0.3f * std::sin(4 * s + phase) * f, f, 0);
                v.insert(v.end(), {p.x, p.y, p.z, (0.0625f - 0.03125f * std::round(s)) * (1 + f)});
            }
        }
        return v;
    };
    std::vector<uint32_t> first;
    for (uint32_t h = 0; h < Hairs; h++)
        for (uint32_t k = 0; k + 1 < Each; k++)
            first.push_back(h * Each + k);
    const std::vector<float> begin = hairs(0), end = hairs(1);
    const size_t vertices = begin.size() / 4;
    FibreView view{begin.data(), vertices, first.data(), first.size(), end.data()};
    FibreLattice lattice = fibre_lattice_of({&view, 1});
    for (const int finer : {0, 8, 16}) {
        lattice.places.exponent -= finer;
        const PageMemory memory = build({{}, {}, false, {&view, 1}}, {{}, {}, lattice});
        ASSERT_EQ(refusal_of(memory.bytes()), "");
        World world;
        Placements place{world.add(memory.page())};
        place.intervals = 1;
        const uint32_t root = world.add({&place, 1});
        const std::vector<Ray> rays = rays_around(4000, 0.6f, Vec3f(0.0f, 0.4f, 0), 13);
        for (const float time : {0.0f, 0.5f, 1.0f}) {
            const std::vector<float> times(rays.size(), time), stands = hairs(time);
            std::vector<InstanceHit> hits(rays.size());
            std::vector<Hit> want(rays.size());
            EverythingIsThere all;
            find_closest<8>(world, root, rays, hits, all, times);
            const FibreView still{stands.data(), vertices, first.data(), first.size()};
            FibreLattice fine = lattice;
            fine.places.exponent -= 20;
            const PageMemory page = build({{}, {}, false, {&still, 1}}, {{}, {}, fine});
            find_closest<8>(page.page(), rays, want, all);
            const double step = double(power_of_two(lattice.places.exponent));
            size_t found = 0, differ = 0;
            for (size_t i = 0; i < rays.size(); i++) {
                found += want[i].found();
                const double away = double(length(rays[i].d));
                if (hits[i].hit.found() != want[i].found() ||
                    (want[i].found() &&
                     std::abs(double(hits[i].hit.t) - double(want[i].t)) * away > 20 * step + 1e-5))
                    differ++; // along an outline
                else if (want[i].found()) {
                    // Where segments join it may be either.
                    const int mine =
                                  int(memory.page().name(hits[i].hit.leaf, int(hits[i].hit.primitive / 2))),
                              theirs = int(page.page().name(want[i].leaf, int(want[i].primitive / 2)));
                    EXPECT_LE(std::abs(mine - theirs), 1);
                    const Vec3f n = normal_of(memory.page(), rays[i], hits[i].hit, time);
                    const float leaves = hits[i].hit.primitive % 2 ? -1.0f : 1.0f;
                    EXPECT_LT(leaves * dot(n, rays[i].d), 0.1f * length(n) * length(rays[i].d));
                }
            }
            EXPECT_GT(found, 1000u);
            EXPECT_LT(double(differ), finer == 0 ? 0.03 * double(found) : 0.003 * double(found)) << time;
        }
    }
}

// A page whose checksum is forged is refused, or traced in bounds and to the end.
TEST(ChangingShapes, DamagedPagesAreRefusedOrTraced) {
    const Changing c(lively(2), As::Grids), quads(lively(2), As::Quads);
    Random random(17);
    size_t traced = 0;
    for (const Changing* from : {&c, &quads})
        for (int turn = 0; turn < 400; turn++) {
            PageMemory memory = copy_of(from->memory[0]);
            const Header& h = memory.page().header();
            // In the nodes, a leaf, the header: wherever it hurts.
            const size_t at = turn % 3 == 0 ? h.nodes + random.below(uint32_t(h.node_bytes))
                              : turn % 3 == 1
                                  ? sizeof(Header) + random.below(uint32_t(h.nodes - sizeof(Header)))
                                  : 16 + random.below(sizeof(Header) - 16);
            memory.data()[at] ^= std::byte(1u << random.below(8));
            if (!structural_refusal_of(memory.bytes()).empty())
                continue;
            traced++;
            World world;
            Placements place{world.add(memory.page())};
            place.intervals = 1;
            if (!memory.page().changes())
                place.intervals = 0;
            const uint32_t root = world.add({&place, 1});
            const std::vector<Ray> rays = rays_around(64, 1, Vec3f(0.0f), 19);
            const std::vector<float> times = times_of(rays.size());
            std::vector<InstanceHit> hits(rays.size());
            EverythingIsThere all;
            find_closest<8>(world, root, rays, hits, all, times);
            for (const InstanceHit& hit : hits)
                if (hit.hit.found())
                    normal_of(memory.page(), rays[0], hit.hit, 0.5f);
        }
    EXPECT_GT(traced, 100u);
}

} // namespace kanuka::hierarchy::testing
