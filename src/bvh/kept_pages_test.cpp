// Pages that come from files: a scene is the same to the bit as where they are built, whatever is in the
// files.
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "base/tasks.h"
#include "bvh/test_geometry.h"
#include "dice/test_scene.h"
#include "store/hierarchy_files.h"

namespace kanuka::bvh::testing {
namespace {

namespace fs = std::filesystem;

// The world: a displaced ball of grids, a mesh, a grid of few cells, one that changes, curves, and two places
// of a group with a mesh and a grid. The ball is moved by `bump`.
struct Place {
    Shapes shapes;
    std::vector<float> matrices;
    std::vector<GroupDesc> groups{2};

    explicit Place(float bump = 0) {
        std::vector<Vec3f> wave;
        for (int j = 0; j <= 12; j++)
            for (int i = 0; i <= 12; i++)
                wave.push_back({float(i) / 6 - 1, float(j) / 6 - 1, 0.2f * std::sin(float(i + 2 * j))});
        shapes.add_grid(12, 12, wave);
        shapes.add_mesh(4, wave, {0, 1, 14, 13, 30, 31, 44, 43});
        shapes.add_sphere({bump, 0, 0}, 1.5f, 16);
        shapes.add_sphere({0, 2, 0}, 0.7f, 8, 0.5f);
        shapes.add_mesh(3, wave, {0, 12, 156, 156, 12, 168, 168, 12, 80});
        shapes.add_grid(1, 1, {{-3, -2, -3}, {3, -2, -3}, {-3, -2, 3}, {3, -2, 3}});
        std::vector<std::vector<Vec3f>> steps{wave, wave, wave};
        for (Vec3f& p : steps[1])
            p.y += 0.4f;
        for (Vec3f& p : steps[2])
            p.z += 0.5f;
        shapes.add_moving_grid(12, 12, steps);
        add_curves();
        for (const float x : {-2.5f, 2.5f})
            for (const float m : {1.0f, 0.0f, 0.0f, x, 0.0f, 0.8f, 0.6f, 0.0f, 0.0f, -0.6f, 0.8f, 0.5f})
                matrices.push_back(m);
        groups[0].shapes.push_back({0, 2});
        groups[1].shapes.push_back({2, int(shapes.store.shapes().size()) - 2});
        groups[1].instances.push_back({0, matrices});
    }

  private:
    void add_curves() {
        scene::Curves c;
        c.cubic = false;
        c.vertices_per_curve = std::vector<int32_t>(4, 3);
        std::vector<float> p;
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 3; k++)
                p.insert(p.end(), {float(i) - 1.5f, float(k - 1), 2 + 0.3f * float(k * k)});
        scene::Primitive curves = dice::test::primitive(c, p);
        curves.primvars.set(
            dice::test::floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {0.2f}));
        dice::DiceTarget target;
        target.pixels_per_unit = 2; // where they are thin
        Journal journal;
        dice::Diced diced = dice::dice(curves, target, dice::test::looking(3), {}, journal);
        grid::LayeringProgram program;
        program.nodes.resize(1);
        grid::VertexInputs inputs;
        const store::ShadedGrid shaded{&diced.mesh_vertices, nullptr, &diced.mesh, &inputs};
        uint64_t bad = 0;
        const int shape =
            shapes.store.add_page(store::encode(std::span(&shaded, 1), program, bad), program, -1);
        EXPECT_TRUE(shapes.store.shapes()[size_t(shape)].flags & store::ShapeRecord::Fibre);
    }
};

// What a scene answers, and where its vertices stand.
struct Answers {
    std::vector<Hit> hits;
    std::vector<bool> hidden;
    Digest vertices;
    Scene::PageBytes bytes;
};

class KeptPages : public ::testing::Test {
  protected:
    void SetUp() override {
        m_folder = (fs::temp_directory_path() / "kanuka-kept-XXXXXX").string();
        ASSERT_NE(mkdtemp(m_folder.data()), nullptr);
    }
    void TearDown() override { fs::remove_all(m_folder); }

    Answers ask(bool has_files, uint64_t page_bytes, float bump = 0, bool writes = true, bool maps = true) {
        Place place(bump);
        store::DiskStore disk({.folder = m_folder, .writes = writes}, m_journal);
        store::HierarchyFiles files(disk, {.maps = maps, .least_bytes = 0});
        const Scene scene(place.shapes.store, place.groups,
                          {.pages_from = 0, .page_bytes = page_bytes, .files = has_files ? &files : nullptr});
        disk.close();
        if (m_prunes)
            store::trim_store(m_folder, 0);
        const std::vector<Ray> rays = random_rays(20000, 4, 3);
        Answers a{intersect<8>(scene, rays), occluded<8>(scene, rays), {}, scene.page_bytes()};
        Digester d;
        for (const store::ShapeRecord& s : place.shapes.store.shapes()) {
            const bool mesh = s.flags & store::ShapeRecord::Mesh, fibre = s.flags & store::ShapeRecord::Fibre;
            const size_t count = mesh ? size_t(s.mu) : size_t(s.mu + 1) * size_t(s.mv + 1);
            d.bytes(place.shapes.store.floats(s) + s.positions, count * (fibre ? 16 : 12));
        }
        a.vertices = d.digest();
        return a;
    }
    static void expect_same(const Answers& a, const Answers& b) {
        ASSERT_EQ(a.hits.size(), b.hits.size());
        int found = 0;
        for (size_t i = 0; i < a.hits.size(); i++) {
            const Hit &x = a.hits[i], &y = b.hits[i];
            ASSERT_EQ(x.hit, y.hit) << i;
            ASSERT_EQ(x.t, y.t) << i;
            ASSERT_TRUE(x.u == y.u && x.v == y.v && x.shape == y.shape && x.prim == y.prim) << i;
            ASSERT_TRUE(x.Ng.x == y.Ng.x && x.Ng.y == y.Ng.y && x.Ng.z == y.Ng.z) << i;
            found += x.hit;
        }
        EXPECT_GT(found, 3000);
        EXPECT_EQ(a.hidden, b.hidden);
        EXPECT_EQ(a.vertices, b.vertices);
        EXPECT_EQ(a.bytes.built + a.bytes.stored, b.bytes.built + b.bytes.stored);
    }
    std::vector<fs::path> files() const {
        std::vector<fs::path> found;
        for (const auto& file : fs::directory_iterator(m_folder))
            found.push_back(file.path());
        std::ranges::sort(found);
        return found;
    }
    std::string bytes_of(const fs::path& path) const {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }

    std::string m_folder;
    Journal m_journal;
    bool m_prunes = false; // once the scene is there
};

constexpr uint64_t One = ~uint64_t(0), Several = 9'000, Each = 1; // bytes of a page: how many a group has

} // namespace

TEST_F(KeptPages, AreNotBuiltAgain) {
    size_t before = 0;
    for (const uint64_t page_bytes : {One, Several, Each}) {
        for (const fs::path& file : files())
            fs::remove(file);
        const Answers without = ask(false, page_bytes), cold = ask(true, page_bytes);
        EXPECT_GT(files().size(), before); // more pages, smaller ones
        before = files().size();
        EXPECT_EQ(cold.bytes.stored, 0u);
        EXPECT_GT(cold.bytes.built, 1000u);
        expect_same(without, cold);
        for (const bool maps : {true, false})
            for (const int threads : {1, 3})
                tasks::with_threads(threads, [&] {
                    const Answers warm = ask(true, page_bytes, 0, threads == 1, maps);
                    EXPECT_EQ(warm.bytes.built, 0u);
                    expect_same(without, warm);
                });
        EXPECT_EQ(files().size(), before);
    }
    EXPECT_TRUE(m_journal.entries().empty());
}

TEST_F(KeptPages, AreTheSameFilesForAnyNumberOfThreads) {
    ask(true, Several);
    const auto before = files();
    std::vector<std::string> bytes;
    for (const fs::path& file : before) {
        bytes.push_back(bytes_of(file));
        fs::remove(file);
    }
    tasks::with_threads(1, [&] { ask(true, Several); });
    ASSERT_EQ(files(), before);
    for (size_t i = 0; i < before.size(); i++)
        EXPECT_EQ(bytes_of(before[i]), bytes[i]);
}

TEST_F(KeptPages, OfOtherShapesAreBuilt) {
    ask(true, One);
    EXPECT_EQ(files().size(), 4u); // what changes has one for each of two intervals
    const float bump =
        std::nextafter(1.5f, 2.0f) - 1.5f; // the last bit of a vertex, on the way to the lattice
    const Answers moved = ask(true, One, bump), again = ask(true, One, bump);
    EXPECT_GT(moved.bytes.built, 0u);
    EXPECT_GT(moved.bytes.stored, 0u); // the group that is placed
    EXPECT_EQ(again.bytes.built, 0u);
    EXPECT_EQ(files().size(), 7u);
    expect_same(ask(false, One, bump), again);
}

TEST_F(KeptPages, ThatAreDamagedAreBuiltAgain) {
    const Answers cold = ask(true, Each);
    const auto all = files();
    ASSERT_GT(all.size(), 5u);
    for (size_t i = 0; i < all.size(); i++) {
        const std::string whole = bytes_of(all[i]);
        std::string damaged = whole.substr(0, i % 2 == 0 ? whole.size() : whole.size() - 64);
        damaged[(i + 1) * 131 % damaged.size()] ^= 4;
        std::ofstream(all[i], std::ios::binary | std::ios::trunc) << damaged;
        const size_t told = m_journal.entries().size();
        const Answers read = ask(true, Each, 0, false), written = ask(true, Each);
        EXPECT_EQ(m_journal.entries().size(), told + 2); // the second will remove it
        for (const Answers* a : {&read, &written}) {
            expect_same(cold, *a);
            EXPECT_GT(a->bytes.built, 0u);
            EXPECT_GT(a->bytes.stored, 0u);
        }
        EXPECT_EQ(bytes_of(all[i]), whole);
    }
    EXPECT_EQ(ask(true, Each).bytes.built, 0u);
}

TEST_F(KeptPages, AreTracedWhenTheirFilesAreGone) {
    const Answers cold = ask(true, One);
    m_prunes = true;
    const Answers warm = ask(true, One);
    EXPECT_EQ(warm.bytes.built, 0u);
    EXPECT_TRUE(files().empty());
    expect_same(cold, warm);
}

} // namespace kanuka::bvh::testing
