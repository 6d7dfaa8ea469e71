// The flow of a file: frames, archives, conditions, recovery from mistakes.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "ingest/rib/requests.h"
#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

namespace fs = std::filesystem;

// ---- frames -----------------------------------------------------------------------------------------

static const std::string ThreeFrames =
    "Format 10 20 1\nFrameBegin 1\nDisplay \"s\" \"zfile\" \"z\"\nFormat 64 64 1\n"
    "Declare \"heat\" \"uniform float\"\nWorldBegin Sphere 1 -1 1 360 WorldEnd\nFrameEnd\n"
    "FrameBegin 2\nLightSource \"pointlight\" 1\nWorldBegin Surface \"a\" \"heat\" 1 Disk 0 1 360 "
    "WorldEnd\nFrameEnd\n"
    "FrameBegin 7\nFormat 5 5 1\nWorldBegin Cone 1 1 360 Cone 1 1 360 WorldEnd\nFrameEnd\n";

TEST(RibFrames, TheFirstThatMakesAPicture) {
    const Parsed r(ThreeFrames);
    EXPECT_EQ(r.scene.options.width, 10); // frame 1's Format ended with it
    ASSERT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_EQ(r.scene.light_shaders.size(), 1u);
    EXPECT_EQ(r.messages().size(), 2u) << r.all_messages(); // Declare in a frame that is passed over counts
    EXPECT_TRUE(r.says("info 8:1 frame 2 is read, number 2 of 3; ask for others")) << r.all_messages();
    EXPECT_TRUE(
        r.says("info 6:1 frame 1 writes what shadow maps or textures are made of and was passed over"));
}

// A face of an environment is no picture that somebody wants to see.
TEST(RibFrames, WhatTexturesAreMadeOfIsPassedOver) {
    std::string text;
    for (const char* side : {"px", "nx", "py", "ny", "pz", "nz"})
        text += std::string("FrameBegin 1\nDisplay \"env.") + side +
                "\" \"file\" \"rgb\"\nWorldBegin Disk 0 1 360 WorldEnd\nFrameEnd\n";
    text +=
        "MakeCubeFaceEnvironment \"env.px\" \"env.nx\" \"env.py\" \"env.ny\" \"env.pz\" \"env.nz\" "
        "\"env.tx\" 90 "
        "\"gaussian\" 2 2\nFrameBegin 7\nDisplay \"ball.tif\" \"file\" \"rgb\"\nWorldBegin Sphere 1 -1 1 360 "
        "WorldEnd\nFrameEnd\n";
    const Parsed r(text);
    ASSERT_EQ(r.scene.options.displays.size(), 1u);
    EXPECT_EQ(r.scene.options.displays[0].file, "ball.tif");
    // Where there is nothing else, that is the picture.
    const Parsed alone(
        "FrameBegin 1\nDisplay \"a.tif\" \"file\" \"rgb\"\nWorldBegin Disk 0 1 360 WorldEnd\nFrameEnd\n"
        "MakeTexture \"a.tif\" \"a.tx\" \"black\" \"black\" \"box\" 1 1\n");
    EXPECT_EQ(alone.scene.primitives.size(), 1u);
}

TEST(RibFrames, ByNumber) {
    RibOptions options;
    options.frame = 7;
    const Parsed seven(ThreeFrames, options);
    EXPECT_EQ(seven.scene.primitives.size(), 2u);
    EXPECT_EQ(seven.scene.options.width, 5);
    EXPECT_TRUE(seven.scene.light_shaders.empty());
    EXPECT_SILENT(seven);
    options.frame = 1;
    const Parsed depth(ThreeFrames, options);
    EXPECT_EQ(depth.scene.options.width, 64);
    EXPECT_EQ(depth.messages().size(), 1u) << depth.all_messages();
    options.frame = 3;
    Journal journal;
    try {
        parse_rib(ThreeFrames, "f.rib", options, journal);
        ADD_FAILURE();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "f.rib: there is no frame 3 with a world; the frames are: 1, 2, 7");
    }
}

TEST(RibFrames, ADepthPassAloneIsAPicture) {
    const Parsed r("Display \"s\" \"zfile\" \"z\" WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_EQ(r.scene.options.integrator, "facing");
    EXPECT_EQ(r.messages().size(), 1u) << r.all_messages();
    EXPECT_TRUE(r.says("the displays ask for depth alone"));
    // It is read twice, and what is said of it is said once.
    Parsed twice("MakeShadow \"s\" \"t\"\nNonsense 1\nDisplay \"s\" \"zfile\" \"z\" WorldBegin Nonsense "
                 "2\nSphere 1 -1 "
                 "1 360 WorldEnd");
    for (const Journal::Entry& e : twice.journal.entries())
        EXPECT_EQ(e.count, e.message.find("Nonsense") == std::string::npos ? 1u : 2u) << e.message;
    EXPECT_EQ(twice.journal.entries().size(), 3u) << twice.all_messages();
}

TEST(RibFrames, WordsInCommentsAreNoFrames) {
    const Parsed r("# FrameBegin 1\nFrameBegin 3\nWorldBegin Sphere 1 -1 1 360 WorldEnd\nFrameEnd\n");
    EXPECT_SILENT(r);
}

TEST(RibFrames, AWorldInAWorldNamesTheFirst) {
    const Parsed r("\nWorldBegin\nWorldBegin\nSphere 1 -1 1 360\nWorldEnd\n");
    EXPECT_TRUE(r.says("error 3:1 WorldBegin was left out: the world has begun already, at test.rib:2:1"))
        << r.all_messages();
}

// As prman and rendrib take them: options in a file of their own.
TEST(RibFrames, SeveralFilesAreOneStream) {
    const fs::path folder = fs::temp_directory_path() / ("kanuka_several_" + std::to_string(::getpid()));
    fs::create_directories(folder / "b");
    std::ofstream(folder / "a.opt") << "Format 30 20 1\nDeclare \"heat\" \"uniform float\"\nAttributeBegin\n";
    std::ofstream(folder / "b/scene.rib")
        << "AttributeEnd\nWorldBegin\nSurface \"a\" \"heat\" 1\nReadArchive "
           "\"ball.rib\"\nWorldEnd\n";
    std::ofstream(folder / "b/ball.rib") << "Sphere 1 -1 1 360\n";
    Journal journal;
    const std::string paths[] = {(folder / "a.opt").string(), (folder / "b/scene.rib").string()};
    const scene::Scene scene = read_ribs(paths, {}, journal);
    for (const Journal::Entry& e : journal.entries())
        ADD_FAILURE() << e.message;
    EXPECT_EQ(scene.options.width, 30);
    EXPECT_EQ(scene.primitives.size(), 1u);
    EXPECT_EQ(scene.file, paths[1]);
    fs::remove_all(folder);
}

TEST(RibFrames, WorldsWithoutFrames) {
    const std::string two =
        "WorldBegin Sphere 1 -1 1 360 WorldEnd\nWorldBegin Disk 0 1 360 Disk 0 1 360 WorldEnd\n";
    EXPECT_EQ(Parsed(two).scene.primitives.size(), 1u);
    EXPECT_TRUE(Parsed(two).says("info 2:1 a further WorldBegin"));
    RibOptions options;
    options.frame = 2;
    EXPECT_EQ(Parsed(two, options).scene.primitives.size(), 2u);
}

// ---- archives, conditions ---------------------------------------------------------------------------

class RibFiles : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string name = (fs::temp_directory_path() / "kanuka_rib_XXXXXX").string();
        folder = mkdtemp(name.data());
    }
    void TearDown() override { fs::remove_all(folder); }
    std::string write(const std::string& name, const std::string& text) const {
        fs::create_directories((folder / name).parent_path());
        std::ofstream(folder / name) << text;
        return (folder / name).string();
    }
    scene::Scene read(const std::string& name, RibOptions options = {}) {
        return read_rib((folder / name).string(), options, journal);
    }
    std::string messages() const {
        std::string s;
        for (const auto& e : journal.entries())
            s += e.where.str() + " " + e.message + "\n";
        return s;
    }
    fs::path folder;
    Journal journal;
};

TEST_F(RibFiles, ArchivesAreFoundFromTheFileThatAsks) {
    write("main.rib", world("ReadArchive \"sub/a.rib\" Option \"x\" \"y\" 1"));
    write("sub/a.rib", "ReadArchive \"b.rib\" Sphere 1 -1 1 360");
    write("sub/b.rib", "Color 1 0 0");
    const scene::Scene s = read("main.rib");
    ASSERT_EQ(s.primitives.size(), 1u);
    EXPECT_EQ(s.primitives[0].attributes->color, Rgb(1, 0, 0));
    EXPECT_EQ(s.primitives[0].where.file, (folder / "sub/a.rib").string());
    EXPECT_EQ(s.file, (folder / "main.rib").string());
}

TEST_F(RibFiles, SearchPaths) {
    write("main.rib", "Option \"searchpath\" \"archive\" \"lib:&\" \"shader\" \"shaders:@\"\n" +
                          world("ReadArchive \"a.rib\" ReadArchive \"c.rib\""));
    write("lib/a.rib", "Sphere 1 -1 1 360");
    write("extra/c.rib", "Disk 0 1 360");
    RibOptions options;
    options.archive_path = {(folder / "extra").string()};
    const scene::Scene s = read("main.rib", options);
    EXPECT_EQ(s.primitives.size(), 2u) << messages();
    EXPECT_EQ(s.options.shader_path.front(), (folder / "shaders").string());
    EXPECT_NE(std::find(s.options.shader_path.begin(), s.options.shader_path.end(), folder.string()),
              s.options.shader_path.end());
}

TEST_F(RibFiles, ArchivesThatReadThemselves) {
    write("main.rib", world("ReadArchive \"a.rib\" Sphere 1 -1 1 360"));
    write("a.rib", "ReadArchive \"b.rib\"");
    write("b.rib", "Disk 0 1 360 ReadArchive \"a.rib\"");
    const scene::Scene s = read("main.rib");
    EXPECT_EQ(s.primitives.size(), 2u);
    EXPECT_NE(messages().find("the archive reads itself"), std::string::npos) << messages();
    EXPECT_EQ(journal.error_count(), 1u);
}

TEST_F(RibFiles, MissingArchivesSayWhereTheyWereLookedFor) {
    write("main.rib", world("ReadArchive \"gone.rib\"\nProcedural \"DelayedReadArchive\" [\"gone2.rib\"] [0 "
                            "1 0 1 0 1]\nSphere 1 -1 1 360"));
    EXPECT_EQ(read("main.rib").primitives.size(), 1u);
    EXPECT_NE(messages().find("main.rib:3:1 ReadArchive \"gone.rib\" was left out: the file is not in \"" +
                              folder.string() + "\""),
              std::string::npos)
        << messages();
    EXPECT_THROW(read("nothing.rib"), Error);
}

TEST_F(RibFiles, DelayedArchivesLeaveNoState) {
    write("main.rib",
          world("Procedural \"DelayedReadArchive\" [\"a.rib\"] [-1 1 -1 1 -1 1] Sphere 1 -1 1 360"));
    write("a.rib", "Color 1 0 0 Translate 1 0 0 Disk 0 1 360");
    const scene::Scene s = read("main.rib");
    ASSERT_EQ(s.primitives.size(), 2u) << messages();
    EXPECT_EQ(s.primitives[0].attributes->color, Rgb(1, 0, 0));
    EXPECT_EQ(s.primitives[1].attributes->color, Rgb(1, 1, 1));
}

TEST(RibArchives, Inline) {
    const Parsed r("ArchiveBegin \"ball\" ArchiveBegin \"inner\" Disk 0 1 360 ArchiveEnd Sphere 1 -1 1 360 "
                   "ReadArchive \"inner\" ArchiveEnd\n" +
                   world("ReadArchive \"ball\" Translate 1 0 0\nReadArchive \"ball\""));
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.primitives.size(), 4u);
    EXPECT_EQ(r.primitive(2).where.str(), "test.rib:1:66");
    EXPECT_TRUE(Parsed("ArchiveBegin \"a\" ReadArchive \"a\" ArchiveEnd " +
                       world("ReadArchive \"a\" Sphere 1 -1 1 360"))
                    .says("reads itself"));
    EXPECT_TRUE(Parsed("ArchiveBegin \"a\" Sphere 1 -1 1 360").says("ArchiveBegin \"a\" is not closed"));
}

TEST(RibConditions, Branches) {
    const auto kind = [](const std::string& quality) {
        const Parsed r(
            "Option \"user\" \"string quality\" \"" + quality + "\"\n" +
            world("IfBegin \"$user:quality == 'high'\" IfBegin \"1\" Sphere 1 -1 1 360 Else Disk 0 1 360 "
                  "IfEnd\n"
                  "ElseIf \"$user:quality == 'low'\" Disk 0 1 360 IfBegin \"0\" Sphere 1 -1 1 360 IfEnd\n"
                  "ElseIf \"1\" Cone 1 1 360 Else Torus 1 1 0 360 360 IfEnd"));
        EXPECT_SILENT(r);
        EXPECT_EQ(r.scene.primitives.size(), 1u);
        return std::get<scene::Quadric>(r.primitive(0).geometry).kind;
    };
    EXPECT_EQ(kind("high"), scene::Quadric::Kind::Sphere);
    EXPECT_EQ(kind("low"), scene::Quadric::Kind::Disk);
    EXPECT_EQ(kind("other"), scene::Quadric::Kind::Cone);
    EXPECT_TRUE(Parsed(world("Else Sphere 1 -1 1 360")).says("Else without IfBegin"));
    EXPECT_TRUE(Parsed(world("IfBegin \"1 +\" Disk 0 1 360 IfEnd Sphere 1 -1 1 360")).says("taken as false"));
}

// ---- mistakes ---------------------------------------------------------------------------------------

TEST(RibErrors, UnknownRequestsDoNotCascade) {
    const Parsed r(world("Shpere 1 -1 1 360\nColor 1 0 0\nFrobnicate [1 2 \"x\"] \"a\" 5\nSphere 1 -1 1 "
                         "360\nShpere 2 -2 2 360"));
    EXPECT_EQ(r.messages().size(), 2u) << r.all_messages();
    EXPECT_TRUE(r.says("error 3:1 unknown request Shpere was left out; did you mean Sphere?"));
    EXPECT_TRUE(r.says("error 5:1 unknown request Frobnicate was left out"));
    EXPECT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_EQ(r.primitive(0).attributes->color, Rgb(1, 0, 0));
}

TEST(RibErrors, UnclosedStringsAndArrays) {
    const Parsed string(world("Surface \"matte\nColor 1 0 0\nSphere 1 -1 1 360"));
    EXPECT_EQ(string.messages().size(), 1u) << string.all_messages();
    EXPECT_TRUE(string.says("error 3:9 Surface: the string that starts here is not closed"));
    EXPECT_EQ(string.primitive(0).attributes->color, Rgb(1, 0, 0));

    const Parsed array(world("Color [1 0 0\nSurface \"matte\"\nSphere 1 -1 1 360"));
    EXPECT_EQ(array.messages().size(), 1u) << array.all_messages();
    EXPECT_TRUE(array.says(
        "error 3:7 Color: the array of \"color\" that starts here is not closed before the request Surface"));
    EXPECT_EQ(array.primitive(0).attributes->surface->name, "matte");

    const Parsed last("WorldBegin Sphere 1 -1 1 360\nSurface \"matte");
    EXPECT_TRUE(last.says("error 2:9 Surface: the string that starts here is not closed"));
    EXPECT_TRUE(
        last.says("error 1:1 WorldBegin is not closed at the end of the file; WorldEnd was added there"));
    EXPECT_EQ(last.scene.primitives.size(), 1u);
}

TEST(RibErrors, WrongArguments) {
    const auto one = [](const std::string& body, const std::string& message) {
        const Parsed r(world(body + "\nSphere 1 -1 1 360"));
        EXPECT_EQ(r.messages().size(), 1u) << r.all_messages();
        EXPECT_TRUE(r.says(message)) << r.all_messages();
        EXPECT_EQ(r.scene.primitives.size(), 1u) << body;
    };
    one("Sphere 1 -1 \"x\" 360", "error 3:1 Sphere: expected 4 numbers (radius zmin zmax thetamax), found 2");
    one("Disk \"x\"",
        "error 3:6 Disk: expected numbers for \"height radius thetamax\", found the string \"x\"");
    one("Surface 5", "error 3:9 Surface: expected a string for \"name\", found a number");
    one("Translate 1 2", "Translate: expected 3 numbers");
    one("Translate 1 2 3 4",
        "Translate: expected the next request, found a number; it takes: Translate dx dy dz");
    one("Translate [1 2 3 4]", "Translate: expected 3 numbers (dx dy dz), found 4");
    one("Color [1 (2 3]", "an array of numbers is expected for \"color\", found the character (");
    one("Surface \"a\" \"Kd\"", "the parameter \"Kd\" has no value");
    one("1 2 3", "error 3:1 WorldBegin: expected the next request, found a number");
    EXPECT_TRUE(
        Parsed("1 2 3\n" + world("Sphere 1 -1 1 360")).says("error 1:1 expected a request, found a number"));
    one("Sides 2.5", "the fraction was cut");
    one("PointsPolygons [3] [0 1 [2]] \"P\" [1]", "found [ in it");
}

TEST(RibErrors, Scopes) {
    const Parsed r("Sphere 1 -1 1 360\nFrameEnd\nWorldBegin\nFormat 1 1 1\nSphere 1 -1 1 "
                   "360\nObjectEnd\nWorldBegin\nWorldEnd\nWorldEnd\n");
    EXPECT_TRUE(r.says(
        "error 1:1 Sphere is not legal here and was left out: it belongs between WorldBegin and WorldEnd"));
    EXPECT_TRUE(r.says("error 2:1 FrameEnd is not legal here"));
    EXPECT_TRUE(r.says("error 4:1 Format is not legal here and was left out: it belongs before WorldBegin"));
    EXPECT_TRUE(r.says("error 6:1 ObjectEnd is not legal here"));
    EXPECT_TRUE(r.says("error 7:1 WorldBegin was left out: the world has begun already, at test.rib:3:1"));
    EXPECT_TRUE(r.says("error 9:1 WorldEnd is not legal here"));
    EXPECT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_EQ(r.scene.options.width, 640);
}

TEST(RibErrors, BlocksThatDoNotMatch) {
    const Parsed r(world("AttributeBegin\nTransformBegin\nColor 1 0 0\nAttributeEnd\nSphere 1 -1 1 "
                         "360\nTransformEnd\nAttributeBegin"));
    EXPECT_TRUE(
        r.says("error 4:1 TransformBegin is not closed before the end of AttributeBegin at test.rib:6:1"));
    EXPECT_TRUE(r.says("error 8:1 TransformEnd without TransformBegin"));
    EXPECT_TRUE(r.says("error 9:1 AttributeBegin is not closed before the end of WorldBegin"));
    EXPECT_EQ(r.primitive(0).attributes->color, Rgb(1, 1, 1));
    const Parsed frame("FrameBegin 1\nWorldBegin\nSphere 1 -1 1 360\nFrameEnd\n");
    EXPECT_TRUE(frame.says("error 2:1 WorldBegin is not closed before FrameEnd"));
    EXPECT_EQ(frame.scene.primitives.size(), 1u);
}

TEST(RibErrors, NothingToRender) {
    EXPECT_TRUE(Parsed("").says("there is nothing to render"));
    EXPECT_TRUE(Parsed("Color 1 0 0").says("there is nothing to render"));
    EXPECT_TRUE(Parsed("WorldBegin WorldEnd").says("the world has no primitives"));
}

// An archive that is rendered by itself: one mistake, however much it draws.
TEST(RibErrors, AnArchiveWithoutAWorldIsOneMistake) {
    std::string text;
    for (int i = 0; i < 70; i++)
        text += "Sphere 1 -1 1 360\nPolygon \"P\" [0 0 0 1 0 0 0 1 0]\n";
    const Parsed r(text);
    EXPECT_EQ(r.journal.error_count(), 1u) << r.all_messages();
    EXPECT_TRUE(
        r.says("there is nothing to render, and 140 requests that belong into a world were left out"));
    // Before a world it is another matter: where it stands is said, too.
    const Parsed early("\nSphere 1 -1 1 360\nDisk 0 1 360\nWorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_EQ(early.journal.error_count(), 1u) << early.all_messages();
    EXPECT_TRUE(
        early.says("error 2:1 Sphere is not legal here and was left out: it belongs between WorldBegin and "
                   "WorldEnd. Requests before the world that were: 2"))
        << early.all_messages();
}

TEST(RibErrors, ShaderParameters) {
    const Parsed r(world("Surface \"a\" \"intensty\" 5 \"lightcolor\" [1 2] \"float Kd\" [1 2] \"mystery\" "
                         "[\"x\" \"y\"]\nSphere 1 -1 1 360"));
    EXPECT_TRUE(r.says("\"intensty\" is not declared and was taken for a float; declare it: \"uniform float "
                       "intensty\" (or is "
                       "\"intensity\" meant?)"));
    EXPECT_TRUE(r.says("\"lightcolor\": expected 3 values (color), found 2; the parameter was left out"));
    EXPECT_TRUE(r.says("\"Kd\": expected 1 values (float), found 2"));
    const auto& p = r.primitive(0).attributes->surface->parameters;
    EXPECT_EQ(p.get_float("intensty", 0), 5);
    EXPECT_FALSE(p.find("lightcolor"));
    EXPECT_EQ(p.find("Kd")->floats.size(), 1u);
    EXPECT_EQ(p.find("mystery")->array_size, 2);
}

TEST(RibErrors, MissingRequestsAreNamedOnce) {
    const Parsed r(
        "PixelSampleImager \"twist\"\nPixelSampleImager \"bend\" \"float k\" [1]\nSystem \"ls\"\n" +
        world("Sphere 1 -1 1 360"));
    EXPECT_EQ(r.messages().size(), 2u) << r.all_messages();
    EXPECT_TRUE(r.says("warning 1:1 PixelSampleImager is not supported"));
    EXPECT_TRUE(r.says("warning 3:1 System \"ls\" was not run"));
}

// ---- binary -----------------------------------------------------------------------------------------

TEST(RibBinary, AWholeSceneMixedWithText) {
    std::string s = "WorldBegin\n";
    const auto bytes = [&](std::initializer_list<int> b) {
        for (const int c : b)
            s += char(c);
    };
    bytes({0314, 0, 0227, 'P', 'o', 'l', 'y', 'g', 'o', 'n'});
    bytes({0315, 9, 0221, 'P'});
    bytes({0246, 0, 0317, 9, 0310, 9});
    for (const float f : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 2.0f, 0.0f}) {
        const auto bits = std::bit_cast<uint32_t>(f);
        bytes({int(bits >> 24), int(bits >> 16 & 255), int(bits >> 8 & 255), int(bits & 255)});
    }
    s += "\nSphere ";
    bytes({0200, 1, 0200, 0xff, 0244, 0x3f, 0x80, 0, 0, 0201, 1, 0x68}); // 1 -1 1 360
    s += "\nWorldEnd\n";
    const Parsed r(s);
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 2u);
    EXPECT_EQ(r.primitive(0).primvars.find("P")->floats[7], 2);
    EXPECT_EQ(std::get<scene::Quadric>(r.primitive(1).geometry).arguments,
              (std::vector<float>{1, -1, 1, 360}));
    EXPECT_TRUE(Parsed(world("Sphere 1 -1 1 360\n\xff\nDisk 0 1 360")).says("a byte of value 255"));
}

// ---- the table --------------------------------------------------------------------------------------

TEST(RibTable, IsWellFormed) {
    std::set<std::string_view> names;
    for (const RequestSpec& r : requests()) {
        EXPECT_TRUE(names.insert(r.name).second) << r.name;
        EXPECT_NE(r.scopes, 0) << r.name;
        const bool done =
            r.support == Support::Full || r.support == Support::Partial || r.support == Support::Kept;
        EXPECT_EQ(done, r.handler != nullptr) << r.name;
        const bool explained = r.support != Support::Missing && r.support != Support::Partial;
        EXPECT_TRUE(explained || !r.note.empty()) << r.name << " has no mend";
        EXPECT_EQ(find_request(r.name), &r);
        bool optional = false;
        for (size_t i = 0; i < r.arg_count(); i++) {
            EXPECT_TRUE(!optional || r.args[i].optional) << r.name;
            optional = r.args[i].optional;
            EXPECT_EQ(r.args[i].type == ArgType::Floats, r.args[i].count > 0) << r.name;
        }
    }
    EXPECT_GE(names.size(), 120u);
}

// The manual's list is made from the table. KANUKA_UPDATE_DOCS=1 in the environment writes it.
TEST(RibTable, TheManualIsCurrent) {
    const std::string path = std::string(KANUKA_SOURCE_DIR) + "/docs/rib.md";
    std::ifstream in(path);
    ASSERT_TRUE(in) << path;
    std::string text((std::istreambuf_iterator<char>(in)), {});
    const std::string begin = "<!-- requests: made from the table, see src/ingest/rib/requests.cpp -->\n",
                      end = "<!-- end of requests -->";
    const size_t from = text.find(begin), to = text.find(end);
    ASSERT_NE(from, std::string::npos);
    ASSERT_NE(to, std::string::npos);
    const std::string wanted = "\n" + requests_markdown() + "\n";
    if (std::getenv("KANUKA_UPDATE_DOCS")) {
        text.replace(from + begin.size(), to - from - begin.size(), wanted);
        std::ofstream(path) << text;
        return;
    }
    EXPECT_EQ(text.substr(from + begin.size(), to - from - begin.size()), wanted)
        << "run this test with KANUKA_UPDATE_DOCS=1 to bring docs/rib.md up to date";
}

} // namespace kanuka::ingest::test
