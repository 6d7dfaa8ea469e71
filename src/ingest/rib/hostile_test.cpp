// Input that means harm, or was damaged on its way: one clear message, bounded memory, and the rest is read.

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sys/resource.h>

#include "ingest/rib/convert.h"
#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

static const std::string Ball = " Sphere 1 -1 1 360 ";

TEST(Hostile, HugeCounts) {
    for (const char* request :
         {"PointsPolygons [2147483647] [0 1 2] \"P\" [0 0 0 1 0 0 1 1 0]",
          "PointsPolygons [3] [0 1 2147483647] \"P\" [0 0 0 1 0 0 1 1 0]",
          "PointsPolygons [2147483647 2147483647 3] [0 1 2] \"P\" [0 0 0 1 0 0 1 1 0]",
          "PointsGeneralPolygons [2147483647] [3] [0 1 2] \"P\" [0 0 0 1 0 0 1 1 0]",
          "SubdivisionMesh \"catmull-clark\" [2147483647] [0 1 2] \"P\" [0 0 0 1 0 0 1 1 0]",
          "SubdivisionMesh \"catmull-clark\" [3] [0 1 2] [\"crease\"] [2147483647 1] [0 1] [2] \"P\" [0 0 0 "
          "1 0 "
          "0 1 1 0]",
          "PatchMesh \"bilinear\" 2147483648 \"nonperiodic\" 2147483648 \"nonperiodic\" \"P\" [0 0 0]",
          "PatchMesh \"bicubic\" 65536 \"nonperiodic\" 65536 \"periodic\" \"P\" [0 0 0]",
          "NuPatch 2147483647 2147483647 [0 1] 0 1 2 2 [0 0 1 1] 0 1 \"P\" [0 0 0]",
          "Curves \"linear\" [2147483647] \"nonperiodic\" \"P\" [0 0 0 1 1 1]",
          "Curves \"cubic\" [-2147483648] \"periodic\" \"P\" [0 0 0 1 1 1]",
          "Sphere 1 -1 1 360 \"uniform float[2147483648] x\" [1]",
          "Polygon \"P\" [0 0 0 1 0 0 1 1 0] \"uniform float[1000000] x\" [1]"}) {
        const Parsed p(world(request + Ball));
        EXPECT_GE(p.messages(Severity::Warning).size(), 1u) << request;
        EXPECT_LE(p.messages(Severity::Warning).size(), 2u) << request << p.all_messages();
        EXPECT_GE(p.scene.primitives.size(), 1u) << request;
    }
    const Parsed huge("Format 2147483648 2147483648 1\nPixelSamples 1e9 1e9\n" + world(Ball));
    EXPECT_EQ(huge.scene.primitives.size(), 1u);
    EXPECT_GE(huge.scene.options.samples, 0);
}

TEST(Hostile, MatricesThatAreNoNumbers) {
    const Parsed p(
        world("AttributeBegin Transform [nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]" + Ball +
              "AttributeEnd AttributeBegin ConcatTransform [1e38 0 0 0 0 1e38 0 0 0 0 1e38 0 0 0 0 "
              "1e-38]" +
              Ball + "AttributeEnd AttributeBegin Scale 0 0 0" + Ball +
              "AttributeEnd AttributeBegin Scale 1e-300 inf 1" + Ball + "AttributeEnd" + Ball));
    EXPECT_GE(p.journal.error_count(), 3u) << p.all_messages();
    for (const scene::Primitive& primitive : p.scene.primitives)
        for (const auto& row : primitive.world_from_object->m)
            for (const double v : row)
                EXPECT_TRUE(std::isfinite(v));
}

static double resident_megabytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

TEST(Hostile, AMillionOpenBlocks) {
    const double before = resident_megabytes();
    std::string begins, ends;
    for (int i = 0; i < 1000000; i++) {
        begins += "AttributeBegin\n";
        ends += "AttributeEnd\n";
    }
    const Parsed open(world(begins + Ball));
    EXPECT_EQ(open.scene.primitives.size(), 1u);
    EXPECT_TRUE(open.says("deep"));
    EXPECT_LE(open.messages().size(), 60u);
    EXPECT_LT(resident_megabytes() - before, 600);
    const Parsed closed(world(begins + Ball + ends + Ball));
    EXPECT_EQ(closed.scene.primitives.size(), 2u);
    EXPECT_LE(closed.messages().size(), 60u);
}

TEST(Hostile, ManyDifferentMistakesAreCounted) {
    std::string text;
    for (int i = 0; i < 20000; i++)
        text += "Unknown" + std::to_string(i) + " 1 2 3\n";
    const Parsed p(world(text + Ball));
    EXPECT_EQ(p.scene.primitives.size(), 1u);
    EXPECT_LT(p.messages().size(), 2100u);
}

TEST(Hostile, ArchivesThatReadEachOther) {
    std::string name = (std::filesystem::temp_directory_path() / "kanuka_hostile_XXXXXX").string();
    const std::filesystem::path folder = mkdtemp(name.data());
    std::ofstream(folder / "a.rib") << "ReadArchive \"b.rib\" Sphere 1 -1 1 360\n";
    std::ofstream(folder / "b.rib") << "ReadArchive \"./a.rib\" ReadArchive \"b.rib\" Sphere 1 -1 1 360\n";
    Journal journal;
    const auto scene = parse_rib(world("ReadArchive \"a.rib\""), (folder / "top.rib").string(), {}, journal);
    EXPECT_EQ(scene.primitives.size(), 2u);
    EXPECT_EQ(journal.error_count(), 2u);
    std::filesystem::remove_all(folder);
}

TEST(Hostile, ArchivesThatDouble) { // 2^60 reads
    std::string text = "ArchiveBegin \"a0\" ArchiveEnd\n";
    for (int i = 1; i < 60; i++) {
        const std::string before = "ReadArchive \"a" + std::to_string(i - 1) + "\" ";
        text += "ArchiveBegin \"a" + std::to_string(i) + "\" " + before + before + "ArchiveEnd\n";
    }
    const Parsed p(world(text + "ReadArchive \"a59\"" + Ball));
    EXPECT_TRUE(p.says("archives that double")) << p.all_messages().substr(0, 1000);
    EXPECT_EQ(p.scene.primitives.size(), 1u);
}

TEST(Hostile, BinaryCutAnywhere) {
    Journal journal;
    const std::string text = world(
        "Declare \"k\" \"varying float\" Color [1 .5 0] Surface \"matte\" \"uniform string long name\" "
        "[\"a string of more than sixteen bytes\"] PointsPolygons [3 3] [0 1 2 0 2 3] \"P\" [0 0 0 1 0 0 "
        "1 1 0 0 1 0] \"k\" [1 2 3 4.5]" +
        Ball);
    const std::string binary = convert_text(text, "t.rib", {.binary = true}, journal);
    size_t primitives = 0;
    for (size_t size = 0; size < binary.size(); size++)
        primitives += Parsed(binary.substr(0, size)).scene.primitives.size();
    EXPECT_GT(primitives, 0u);
    // A length beyond the end of the file.
    for (const char* token : {"\313\377\377\377\377", "\243\377\377\377\377",
                              "\316\377\377\243\377\377\377\377", "\320\377\377", "\246\377", "\317\001"})
        EXPECT_GE(Parsed(world("Color " + std::string(token) + Ball)).journal.error_count(), 1u);
}

TEST(Hostile, OneLongLineIsReadInOneGo) { // columns must not be counted from its start every time
    std::string text;
    for (int i = 0; i < 200000; i++)
        text += "Color 1 0 0 Color 0 1 0 ";
    text += Ball;
    for (int i = 0; i < 20000; i++)
        text += "Sphere 1 ";
    const auto start = std::chrono::steady_clock::now();
    const Parsed p(world(text));
    EXPECT_EQ(p.scene.primitives.size(), 1u);
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 20);
}

} // namespace kanuka::ingest::test
