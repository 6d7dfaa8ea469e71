// Scenes of other people, where they are at hand: KANUKA_SHARED, or ../shared beside the repository.

#include <cstdlib>
#include <filesystem>

#include "ingest/rib/test_support.h"
#include "scene/summary.h"

namespace kanuka::ingest::test {

namespace fs = std::filesystem;

class RibScenes : public ::testing::Test {
  protected:
    void SetUp() override {
        const char* shared = std::getenv("KANUKA_SHARED");
        root = fs::path(shared ? shared : KANUKA_SOURCE_DIR "/../shared") / "scenes/rib";
        if (shared || fs::exists(root.parent_path().parent_path())) {
            ASSERT_TRUE(fs::exists(root)) << root << " is not there";
        } else {
            GTEST_SKIP() << root << " is not there: set KANUKA_SHARED";
        }
    }
    scene::Summary read(const std::string& name, uint64_t errors) {
        Journal journal;
        const scene::Scene s = read_rib((root / name).string(), {}, journal);
        std::string all;
        for (const auto& e : journal.entries())
            all += e.where.str() + " " + e.message + "\n";
        EXPECT_EQ(journal.error_count(), errors) << all;
        return scene::summarize(s);
    }
    fs::path root;
};

TEST_F(RibScenes, Vase) {
    const auto s = read("aqsis/scenes/vase/vase.rib", 0);
    EXPECT_EQ(s.primitives, 48u);
    EXPECT_EQ(s.options.width, 480); // the third frame: the first two are shadow maps
    EXPECT_EQ(s.camera.fov, 37);
    EXPECT_EQ(s.displacements.at("dented"), 6u);
    EXPECT_EQ(s.light_shaders.at("shadowspot"), 2u);
}

TEST_F(RibScenes, Bike) {
    const auto s = read("aqsis/features/archives/bike.rib", 0);
    EXPECT_EQ(s.primitives, 5216u);
    EXPECT_EQ(s.control_points, 5216u * 16);
    EXPECT_EQ(s.surfaces.at("plastic"), 5216u);
    EXPECT_EQ(s.light_shaders.at("distantlight"), 3u);
}

TEST_F(RibScenes, Bezier) {
    const auto s = read("aqsis/features/curves/bezier.rib", 0);
    EXPECT_EQ(s.curves, 100u);
    EXPECT_EQ(s.control_points, 400u);
}

TEST_F(RibScenes, Creases) {
    const auto s = read("aqsis/features/subdivision/creases.rib", 0);
    EXPECT_EQ(s.by_kind.at("SubdivisionMesh"), 1u);
    EXPECT_EQ(s.faces, 8u);
}

TEST_F(RibScenes, TheOthers) {
    EXPECT_EQ(read("aqsis/features/levelofdetail/detail.rib", 0).primitives, 11u); // one level of each
    EXPECT_EQ(read("aqsis/features/motionblur/camera.rib", 0).primitives, 1u);
    EXPECT_EQ(read("aqsis/features/motionblur/deformation.rib", 0).primitives, 11u);
    EXPECT_EQ(read("aqsis/features/objectinstance/singlepolygon.rib", 0).instances, 12u);
    EXPECT_EQ(read("aqsis/features/solidmodeling/csg.rib", 0).primitives, 17u);
    EXPECT_EQ(read("aqsis/features/textures/sticky.rib", 0).primitives, 3u);
    EXPECT_EQ(read("aqsis/scenes/microbe/microbe.rib", 0).faces, 1692u);
    EXPECT_EQ(read("aqsis/features/blobby/prman/first.rib", 0).primitives, 1u); // Imager in the world
    EXPECT_EQ(read("every_request.rib", 0).primitives, 25u); // it asks for ErrorHandler "ignore"
}

TEST_F(RibScenes, EveryRequestIsKnown) {
    Journal journal;
    read_rib((root / "every_request.rib").string(), {}, journal);
    for (const auto& e : journal.entries())
        EXPECT_EQ(e.message.find("unknown request"), std::string::npos) << e.message;
}

TEST(RibFuzz, BrokenVersionsOfASceneNeverFail) {
    // Cuts, swaps and strange bytes in a scene that has something of everything. Build with
    // -DKANUKA_SANITIZE=address,undefined to see more than crashes.
    const std::string scene = "##RenderMan RIB\nversion 3.03\nDeclare \"k\" \"varying float[2]\"\nFrameBegin "
                              "1\nFormat 64 64 1\nProjection \"perspective\" "
                              "\"fov\" [30]\nWorldBegin\nLightSource \"pointlight\" 1 \"from\" [0 0 "
                              "1]\nArchiveBegin \"x\" Sphere 1 -1 1 360 ArchiveEnd\n"
                              "AttributeBegin Color [1 .5 0] Surface \"matte\" \"uniform float Kd\" "
                              "1\nObjectBegin 1 ReadArchive \"x\" ObjectEnd\n"
                              "TransformBegin Rotate 30 0 1 0 ObjectInstance 1 "
                              "TransformEnd\nPointsGeneralPolygons [1 1] [3 3] [0 1 2 0 2 3] \"P\" "
                              "[0 0 0 1 0 0 1 1 0 0 1 0] \"k\" [1 2 3 4 5 6 7 8]\nSubdivisionMesh "
                              "\"catmull-clark\" [4] [0 1 2 3] [\"crease\"] [2 1] [0 1] [2] "
                              "\"P\" [0 0 0 1 0 0 1 1 0 0 1 0]\nBasis \"b-spline\" 1 \"b-spline\" 1\nCurves "
                              "\"cubic\" [4] \"periodic\" \"P\" [0 0 0 1 1 1 2 2 2 3 3 3]\n"
                              "NuPatch 2 2 [0 0 1 1] 0 1 2 2 [0 0 1 1] 0 1 \"Pz\" [1 2 3 4]\nMotionBegin [0 "
                              "1] Translate 1 1 1 Translate 2 2 2 MotionEnd\n"
                              "IfBegin \"$user:x == 1 || !0\" Points \"P\" [1 2 3] Else Disk 0 1 360 "
                              "IfEnd\nAttributeEnd\nWorldEnd\nFrameEnd\n";
    uint64_t state = 1;
    const auto random = [&](size_t n) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        return size_t(state >> 33) % n;
    };
    size_t primitives = 0;
    for (int i = 0; i < 3000; i++) {
        std::string s = scene;
        for (size_t edits = 1 + random(6); edits > 0 && !s.empty(); edits--) {
            const size_t at = random(s.size()), length = random(30);
            switch (random(6)) {
            case 0:
                s.erase(at, length);
                break;
            case 1:
                s[at] = char(random(256));
                break;
            case 2:
                s.insert(at, s.substr(random(s.size()), length));
                break;
            case 3:
                s.insert(at, 1, "\"[]#-.e\\9\xc8\xcc\xa0"[random(12)]);
                break;
            case 4:
                s.insert(at, "99999999");
                break;
            default:
                s.resize(at);
            }
        }
        Journal journal;
        primitives += parse_rib(s, "fuzz", {}, journal).primitives.size();
    }
    EXPECT_GT(primitives, 3000u); // most of the damage is local
}

} // namespace kanuka::ingest::test
