// Scenes that use what those before them have left: rays find, to the bit, what they find in scenes that are
// made anew, whatever was edited in between.
#include <deque>
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "bvh/leftovers.h"
#include "bvh/test_geometry.h"

namespace kanuka::bvh::testing {
namespace {

// Two groups with shapes, one that stands in the other, and a world with shapes and places of both. Some of
// it is there for some rays alone; some moves.
struct Edited {
    std::mt19937 random{51};
    std::vector<float> radii{1.5f, 0.7f, 1.1f, 0.9f}; // of balls: two in a group each, two in the world
    std::vector<Transform> of_first, of_second, inner;
    std::vector<LevelRange> levels; // of places of the second group
    std::deque<MotionPath> paths;   // of the first

    float uniform(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(random); }
    Transform anywhere(float side, double size) {
        return Transform::translate(double(uniform(-side, side)), double(uniform(-side, side)),
                                    double(uniform(-side, side))) *
               Transform::rotate(double(uniform(0, 360)), double(uniform(-1, 1)), 1, double(uniform(-1, 1))) *
               Transform::scale(size * double(uniform(0.5f, 1)), size, size);
    }
    MotionPath way() {
        const Transform start = anywhere(4, 0.3);
        const TransformKey keys[] = {{0, start}, {1, Transform::translate(0.5, 0, 0) * start}};
        return MotionPath(keys);
    }
    LevelRange range() {
        const uint16_t from = uint16_t(uniform(0, 30000));
        return {from, uint16_t(from + 30000)};
    }
    Edited() {
        for (int i = 0; i < 30; i++)
            of_first.push_back(anywhere(4, 0.3));
        for (int i = 0; i < 20; i++)
            of_second.push_back(anywhere(4, 0.2)), levels.push_back(range());
        for (int i = 0; i < 5; i++)
            inner.push_back(anywhere(2, 0.4)), paths.push_back(way());
    }
    size_t one(size_t of) { return std::uniform_int_distribution<size_t>(0, of - 1)(random); }

    static constexpr int Edits = 8;
    void edit(int which) {
        Transform& place = of_first[one(of_first.size())];
        switch (which) {
        case 0:
            return void(place = Transform::translate(0.1, 0.05, -0.1) * place);
        case 1:
            return void(place = anywhere(4, 0.3));
        case 2:
            return of_first.push_back(anywhere(4, 0.3));
        case 3:
            return void(of_first.erase(of_first.begin() + ptrdiff_t(one(of_first.size()))));
        case 4:
            return void(radii[one(radii.size())] *= uniform(0.97f, 1.03f));
        case 5:
            return void(paths[one(paths.size())] = way());
        case 6:
            return void(levels[one(levels.size())] = range());
        case 7:
            return void(inner[one(inner.size())] = anywhere(2, 0.4));
        }
    }
};

struct Standing {
    Shapes shapes;
    std::deque<std::vector<float>> matrices;
    std::vector<MotionPath> paths;
    std::vector<GroupDesc> groups{3};
    std::unique_ptr<Scene> scene;

    std::span<const float> flat(std::span<const Transform> all) {
        matrices.emplace_back();
        for (const Transform& t : all)
            for (size_t k = 0; k < 12; k++)
                matrices.back().push_back(float(t.m[k / 4][k % 4]));
        return matrices.back();
    }
    Standing(const Edited& of, const PagesFrom& from, std::shared_ptr<Leftovers> leftovers)
        : paths(of.paths.begin(), of.paths.end()) {
        int shape = shapes.add_sphere({0, 0, 0}, of.radii[0], 16);
        groups[0].shapes.push_back({shape, 1});
        shape = shapes.add_sphere({0.5f, 0, 0}, of.radii[1], 12, 0.6f);
        groups[1].shapes.push_back({shape, 1});
        groups[1].instances.push_back({0, flat(of.inner)});
        shape = shapes.add_sphere({2, 1, 0}, of.radii[2], 16);
        shapes.add_sphere({2, 1, 0}, of.radii[3], 10, 0.4f);
        shapes.add_sphere({2, 1, 0}, of.radii[3], 10); // lies in the other: ties are decided alike
        groups[2].shapes.push_back({shape, 3});
        groups[2].instances.push_back({0, flat(of.of_first)});
        groups[2].instances.push_back({.group = 1, .places = flat(of.of_second), .levels = of.levels});
        groups[2].instances.push_back({.group = 0, .places = {}, .paths = paths});
        scene = std::make_unique<Scene>(shapes.store, groups,
                                        Scene::Build{.pages_from = from, .leftovers = std::move(leftovers)});
    }
    Digest vertices() const {
        Digester d;
        for (const store::ShapeRecord& s : shapes.store.shapes())
            d.bytes(shapes.store.floats(s) + s.positions, size_t(s.mu + 1) * size_t(s.mv + 1) * 12);
        return d.digest();
    }
};

std::vector<RayPacket<8>> packets(Edited& of, int count) {
    std::vector<RayPacket<8>> all(static_cast<size_t>(count));
    int seed = 0;
    for (RayPacket<8>& p : all) {
        for (int i = 0; i < 8; i++) {
            const auto somewhere = [&] {
                return Vec3f(of.uniform(-5, 5), of.uniform(-5, 5), of.uniform(-5, 5));
            };
            const Vec3f o = somewhere(), d = somewhere() - o;
            for (int c = 0; c < 3; c++)
                p.o[c].v[i] = o[c], p.d[c].v[i] = d[c];
            p.seed.v[i] = seed++;
            p.time.v[i] = of.uniform(0, 1), p.level.v[i] = of.uniform(0, 1);
        }
        p.t_max = Float<8>(1e30f);
        p.active = Mask<8>(true);
    }
    return all;
}

// All bits of all answers.
Digest answers(const Scene& scene, const std::vector<RayPacket<8>>& rays, int& found) {
    std::vector<HitPacket<8>> hits(rays.size());
    for (size_t i = 0; i < rays.size(); i++)
        hits[i].clear(rays[i].t_max);
    scene.intersect<8>(rays, hits);
    std::vector<Mask<8>> hidden(rays.size(), Mask<8>(false));
    scene.find_occluded<8>(rays, hidden);
    Digester d;
    for (size_t i = 0; i < rays.size(); i++)
        for (int k = 0; k < 8; k++) {
            const HitPacket<8>& h = hits[i];
            d(h.hit[k], hidden[i][k]);
            EXPECT_EQ(h.hit[k], hidden[i][k]);
            if (!h.hit[k])
                continue;
            found++;
            d(h.t[k], h.u[k], h.v[k], h.Ng.x[k], h.Ng.y[k], h.Ng.z[k], h.shape[k], h.prim[k], h.instanced[k]);
            if (!h.instanced[k])
                continue;
            d(h.magnitude[k], h.slot_shift[k]);
            for (const auto& row : h.world_from_shape)
                d(row[k]);
        }
    return d.digest();
}

void expect_same_after_edits(const PagesFrom& from, int steps) {
    Edited edited;
    const auto empty = std::make_shared<Leftovers>();
    auto standing = std::make_unique<Standing>(edited, from, empty);
    uint64_t pages = 0, levels = 0;
    int found = 0;
    for (int step = 0; step < steps; step++) {
        edited.edit(step < 2 * Edited::Edits ? step / 2 : std::uniform_int_distribution(0, 7)(edited.random));
        const Standing anew(edited, from, nullptr);
        EXPECT_EQ(anew.scene->kept().pages + anew.scene->kept().levels, 0u);
        tasks::with_threads(1 + step % 3, [&] {
            auto left = standing->scene->leave();
            standing.reset(); // nothing of it is asked for any more
            standing = std::make_unique<Standing>(edited, from, std::move(left));
        });
        pages += standing->scene->kept().pages, levels += standing->scene->kept().levels;
        ASSERT_EQ(standing->vertices(), anew.vertices()) << step;
        const auto rays = packets(edited, 60);
        ASSERT_EQ(answers(*standing->scene, rays, found), answers(*anew.scene, rays, found)) << step;
        EXPECT_EQ(standing->scene->bounds().lo.x, anew.scene->bounds().lo.x);
    }
    EXPECT_GT(found, 100 * steps);
    if (from.cells == 0) {
        EXPECT_GT(pages, uint64_t(2 * steps));
        EXPECT_GT(levels, uint64_t(steps) / 2);
    }
}

} // namespace

TEST(Leftovers, OfScenesInPages) {
    expect_same_after_edits(0, 120);
}

// Balls in the world lie in pages, and Embree has the groups; or all are Embree's.
TEST(Leftovers, OfScenesThatEmbreeHasAPartOf) {
    PagesFrom some;
    some.cells = 400;
    expect_same_after_edits(some, 40);
    expect_same_after_edits(~uint64_t(0), 20);
}

// What is let through is a product of floats: of the same in any order.
TEST(LetThrough, IsTheSameInAnyOrder) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> u(0, 1);
    for (const int count : {2, 5, LetThrough::Most, LetThrough::Most + 6}) {
        std::vector<std::pair<float, Rgb>> all;
        for (int i = 0; i < count; i++)
            all.push_back({u(random) + float(i), Rgb(u(random), u(random), u(random))});
        LetThrough first;
        for (const auto& [t, part] : all)
            first.add(t, part);
        for (int turn = 0; turn < 20; turn++) {
            std::ranges::shuffle(all, random);
            LetThrough other;
            for (const auto& [t, part] : all) {
                other.add(t, part);
                if (count <= LetThrough::Most) // one may come twice
                    other.add(t, part);
            }
            for (float end = 0.5f; end < float(count) + 1; end++) {
                const Rgb a = first.before(end), b = other.before(end);
                if (count <= LetThrough::Most) {
                    EXPECT_TRUE(a.x == b.x && a.y == b.y && a.z == b.z) << count << " " << end;
                } else if (end > float(count)) { // those beyond it count with the last, in their order
                    for (int c = 0; c < 3; c++)
                        EXPECT_NEAR(a[c], b[c], 1e-6f * a[c]);
                }
            }
        }
    }
}

} // namespace kanuka::bvh::testing
