// What is done after a render was cancelled, by count: never by the clock, which other work on a machine
// moves.
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "ingest/rib/rib.h"
#include "render/session.h"

using namespace kanuka;

namespace {

// Triangles finer than a pixel.
scene::PolygonMesh fine_mesh(int n, std::vector<float>& points) {
    scene::PolygonMesh mesh;
    std::vector<int32_t> loops, vertices;
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++)
            points.insert(points.end(), {2 * float(i) / float(n) - 1, 2 * float(j) / float(n) - 1,
                                         0.1f * float((i * 7 + j * 3) % 5)});
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int a = j * (n + 1) + i;
            loops.insert(loops.end(), {3, 3});
            vertices.insert(vertices.end(), {a, a + 1, a + n + 2, a, a + n + 2, a + n + 1});
        }
    mesh.vertices_per_loop = loops;
    mesh.vertices = vertices;
    return mesh;
}

struct Outcome {
    render::Result result;
    uint64_t asked = 0, done = 0;
};

// Cancels once `work` counts something, and takes down how much that was.
Outcome cancelled_at_work(const scene::Scene& scene, int threads,
                          std::atomic<uint64_t> Stats::Count::* work) {
    Outcome run;
    Journal journal;
    Stats stats;
    render::Overrides overrides;
    overrides.options.set("resolution", scene::Setting{{32, 32}, {}});
    overrides.options.set("samples", 1);
    overrides.threads = threads;
    overrides.standard_shaders = KANUKA_SOURCE_DIR "/shaders";
    std::atomic<uint64_t> asked{0};
    Progress progress;
    progress.cancelled = [&] {
        uint64_t none = 0;
        const uint64_t now = stats.count.*work;
        if (now > 0)
            asked.compare_exchange_strong(none, now);
        return now > 0;
    };
    run.result = render::render(scene, overrides, journal, stats, progress);
    run.asked = asked, run.done = stats.count.*work;
    return run;
}

class Cancelled : public ::testing::Test {
  protected:
    void SetUp() override {
        m_folder = (std::filesystem::temp_directory_path() / "kanuka-cancel-XXXXXX").string();
        ASSERT_NE(mkdtemp(m_folder.data()), nullptr);
        std::ofstream(m_folder + "/slow.sl")
            << "surface slow() { float x = 0, i; for (i = 0; i < 400; i += 1) x += noise(P * (i + 1)); "
               "Ci = color(x / 400); }";
        setenv("KANUKA_SHADER_CACHE", (m_folder + "/cache").c_str(), 1);
    }
    void TearDown() override { std::filesystem::remove_all(m_folder); }
    scene::Scene read(const std::string& world) const {
        Journal journal;
        return ingest::parse_rib("Option \"searchpath\" \"shader\" \"" + m_folder +
                                     ":&\"\nProjection \"perspective\" \"fov\" 45\nTranslate 0 0 4\n"
                                     "WorldBegin\nSurface \"slow\"\n" +
                                     world + "\nWorldEnd\n",
                                 "cancel.rib", {}, journal);
    }
    std::string m_folder;
};

TEST_F(Cancelled, AMeshIsShadedNoFurther) {
    scene::Scene scene = read("Polygon \"P\" [0 0 0 1 0 0 1 1 0]");
    std::vector<float> points;
    scene.primitives.at(0).geometry = fine_mesh(700, points);
    scene::Value P;
    P.name = "P";
    P.type = scene::Type::Point;
    P.detail = scene::Detail::Vertex;
    P.floats = points;
    scene.primitives[0].primvars.set(P);
    const uint64_t vertices = points.size() / 3;
    for (const int threads : {1, 3}) {
        const Outcome run = cancelled_at_work(scene, threads, &Stats::Count::shader_evaluations);
        EXPECT_TRUE(run.result.cancelled);
        EXPECT_LT(run.asked, vertices); // else it asked too late
        // What each thread was at, and what it began in between.
        EXPECT_LE(run.done - run.asked, uint64_t(threads) * 2 * 4096);
    }
}

TEST_F(Cancelled, GridsAreShadedNoFurther) {
    const scene::Scene scene = read("ShadingRate 0.0005\nSphere 1 -1 1 360");
    for (const int threads : {1, 3}) {
        const Outcome run = cancelled_at_work(scene, threads, &Stats::Count::shader_evaluations);
        EXPECT_TRUE(run.result.cancelled);
        EXPECT_LE(run.done - run.asked, uint64_t(threads) * 2 * 33 * 33);
    }
}

// One bucket, of which a thousand progressions are asked for: after the request it does none.
TEST_F(Cancelled, PathsAreTracedNoFurther) {
    Journal journal;
    const scene::Scene scene =
        ingest::parse_rib("Projection \"perspective\" \"fov\" 45\nTranslate 0 0 4\nWorldBegin\nLightSource "
                          "\"distantlight\" 1\nSurface \"matte\"\nSphere 1 -1 1 360\nWorldEnd\n",
                          "cancel.rib", {}, journal);
    Stats stats;
    render::Overrides overrides;
    overrides.options.set("resolution", scene::Setting{{16, 16}, {}});
    overrides.options.set("samples", 1000);
    overrides.threads = 1;
    overrides.standard_shaders = KANUKA_SOURCE_DIR "/shaders";
    std::atomic<bool> first_done{false};
    std::atomic<int> calls{0};
    Progress progress;
    progress.update = [&](std::string_view phase, double fraction) {
        first_done = first_done || (phase == "progressions" && fraction > 0);
    };
    // Asked before the pass, before the bucket, and then between its progressions.
    progress.cancelled = [&] { return first_done && ++calls > 4; };
    const render::Result result = render::render(scene, overrides, journal, stats, progress);
    EXPECT_TRUE(result.cancelled);
    EXPECT_GE(stats.count.paths, 2u * 256);
    EXPECT_LE(stats.count.paths, 4u * 256);
}

} // namespace
