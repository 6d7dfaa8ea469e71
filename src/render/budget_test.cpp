#include "render/budget.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <malloc.h>

#include <gtest/gtest.h>

#include "ingest/rib/rib.h"
#include "render/session.h"

using namespace kanuka;
using namespace kanuka::render;

TEST(Budget, PicturesThatCannotFitAreRefusedWithTheFigure) {
    constexpr uint64_t Gigabyte = 1000000000;
    EXPECT_NO_THROW(refuse_what_cannot_fit({0, 0, 1920, 1080}, 8, 1 * Gigabyte));
    EXPECT_NO_THROW(refuse_what_cannot_fit({29000, 29000, 30000, 30000}, 0, 1 * Gigabyte)); // a crop window
    try {
        refuse_what_cannot_fit({0, 0, 30000, 30000}, 0, 24 * Gigabyte);
        FAIL();
    } catch (const Error& e) {
        // 9e8 pixels: more than 9e8 times the 20 floats of a picture, less than four times that.
        const std::string what = e.what();
        const double figure = std::stod(what.substr(what.find("takes ") + 6));
        EXPECT_GT(figure, 72);
        EXPECT_LT(figure, 288);
        EXPECT_NE(what.find("30000 by 30000"), std::string::npos) << what;
        EXPECT_NE(what.find("there are 24.0 GB"), std::string::npos) << what;
    }
    // Parts keep the sums of each of their blocks.
    EXPECT_NO_THROW(refuse_what_cannot_fit({0, 0, 1920, 1080}, 0, 1 * Gigabyte, 3));
    try {
        refuse_what_cannot_fit({0, 0, 1920, 1080}, 0, 1 * Gigabyte, 5);
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("fewer progressions"), std::string::npos) << e.what();
    }
    EXPECT_GT(machine_memory(), Gigabyte / 4);
}

TEST(Budget, Threads) {
    EXPECT_NO_THROW(check_threads(0));
    EXPECT_NO_THROW(check_threads(4096));
    EXPECT_THROW(check_threads(-1), Error);
    EXPECT_THROW(check_threads(2000000000), Error);
}

TEST(Budget, Geometry) {
    EXPECT_NO_THROW(refuse_geometry_that_cannot_fit(1000, 3000));
    EXPECT_THROW(refuse_geometry_that_cannot_fit(2000, 3000), Error);
}

// Forty balls that fit one by one, but not together: the render ends with the figure, once they are too many,
// and not when all forty are there.
TEST(Budget, PrimitivesThatDoNotFitTogether) {
    std::string folder = (std::filesystem::temp_directory_path() / "kanuka-budget-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    setenv("KANUKA_SHADER_CACHE", (folder + "/cache").c_str(), 1);
    std::ofstream(folder + "/lumps.sl") << "surface lumps() { Oi = 1; Ci = color noise(P * 20); }";
    constexpr uint64_t Memory = 64 << 20;
    Stats stats;
    const auto render = [&](int balls) {
        std::string text = "Option \"searchpath\" \"shader\" \"" + folder +
                           ":&\"\nProjection \"perspective\" \"fov\" 45\nTranslate 0 0 4\nWorldBegin\n"
                           "Surface \"lumps\"\nShadingRate 0.5\n";
        for (int i = 0; i < balls; i++)
            text += "Sphere 1 -1 1 360\n";
        Journal journal;
        const scene::Scene scene = ingest::parse_rib(text + "WorldEnd\n", "balls.rib", {}, journal);
        Overrides overrides;
        overrides.options.set("resolution", scene::Setting{{256, 256}, {}});
        overrides.options.set("samples", 1);
        overrides.threads = 1;
        overrides.standard_shaders = KANUKA_SOURCE_DIR "/shaders";
        overrides.memory = Memory;
        kanuka::render::render(scene, overrides, journal, stats, {});
    };
    render(1);
    const uint64_t each = stats.count.shader_evaluations, bytes = stats.bytes.grids + stats.bytes.lobe_inputs;
    ASSERT_GT(bytes, Memory / 80);
    ASSERT_LT(bytes, Memory / 2);
    stats.count.shader_evaluations = 0;
    try {
        render(40);
        ADD_FAILURE();
    } catch (const CannotFit& e) {
        EXPECT_NE(std::string(e.what()).find("there are 0.1 GB"), std::string::npos) << e.what();
    }
    EXPECT_LE(stats.count.shader_evaluations, each * (Memory / 2 / bytes + 2));
    std::filesystem::remove_all(folder);
}

namespace {

// Bytes; the largest since the last call of forget_peak().
uint64_t peak_rss() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:"))
            return std::stoull(line.substr(6)) << 10;
    return 0;
}
bool forget_peak() {
    std::ofstream file("/proc/self/clear_refs");
    return bool(file << "5" << std::flush);
}

} // namespace

// One ball of some million micropolygons: half of what its render takes, by the system's own figure, is too
// little, which is known before it is shaded; twice as much is enough.
TEST(Budget, APrimitiveInFlight) {
    std::string folder = (std::filesystem::temp_directory_path() / "kanuka-budget-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    setenv("KANUKA_SHADER_CACHE", (folder + "/cache").c_str(), 1);
    std::ofstream(folder + "/lumps.sl")
        << "surface lumps() { Oi = 1; Ci = color noise(P * 20) * diffuse(normalize(N)); }";
    std::ofstream(folder + "/shines.sl") << "surface shines() { Oi = 1; Ci = color noise(P * 20); }";
    Journal journal;
    Stats stats;
    const auto render = [&](const std::string& shader, const std::string& rate, uint64_t memory) {
        const scene::Scene scene = ingest::parse_rib(
            "Option \"searchpath\" \"shader\" \"" + folder +
                ":&\"\nProjection \"perspective\" \"fov\" 45\nTranslate 0 0 4\nWorldBegin\nSurface \"" +
                shader + "\"\nShadingRate " + rate + "\nSphere 1 -1 1 360\nWorldEnd\n",
            "ball.rib", {}, journal);
        Overrides overrides;
        overrides.options.set("resolution", scene::Setting{{256, 256}, {}});
        overrides.options.set("samples", 1);
        overrides.threads = 1;
        overrides.standard_shaders = KANUKA_SOURCE_DIR "/shaders";
        overrides.memory = memory;
        stats.count.shader_evaluations = 0;
        kanuka::render::render(scene, overrides, journal, stats, {});
    };
    constexpr uint64_t Plenty = uint64_t(1) << 40;
    for (const char* shader : {"lumps", "shines"}) {
        render(shader, "10", Plenty); // what every render takes
        malloc_trim(0);               // what is free already counts
        ASSERT_TRUE(forget_peak());
        const uint64_t before = peak_rss();
        render(shader, "0.02", Plenty);
        const uint64_t taken = peak_rss() - before;
        ASSERT_GT(stats.count.shader_evaluations, 1000000u);
        ASSERT_GT(taken, 100u << 20);
        EXPECT_NO_THROW(render(shader, "0.02", 2 * taken)) << shader;
        try {
            render(shader, "0.02", taken / 2);
            ADD_FAILURE() << shader;
        } catch (const CannotFit& e) {
            EXPECT_EQ(e.where().line, 7) << e.what();
            EXPECT_NE(std::string(e.what()).find("while it is diced and shaded"), std::string::npos)
                << e.what();
        }
        EXPECT_EQ(stats.count.shader_evaluations, 0u) << shader;
    }
    std::filesystem::remove_all(folder);
}
