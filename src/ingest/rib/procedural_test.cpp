// Procedurals: programs, archives and plug-ins that make RIB.

#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "ingest/rib/programs.h"
#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

namespace fs = std::filesystem;

namespace {

class ProceduralTest : public ::testing::Test {
  protected:
    ProceduralTest()
        : m_folder(fs::temp_directory_path() / ("kanuka_procedural_" + std::to_string(getpid()))) {
        fs::create_directories(m_folder);
        m_options.archive_path = {m_folder.string()};
    }
    ~ProceduralTest() override { fs::remove_all(m_folder); }

    std::string script(const std::string& name, const std::string& body) {
        const fs::path path = m_folder / name;
        std::ofstream(path) << "#!/bin/sh\n" << body;
        fs::permissions(path, fs::perms::owner_all);
        return path.string();
    }
    static std::string procedural(const std::string& program, const std::string& arguments) {
        return "Procedural \"RunProgram\" [\"" + program + "\" \"" + arguments + "\"] [-1 1 -1 1 4 6]\n";
    }

    fs::path m_folder;
    RibOptions m_options;
};

} // namespace

TEST_F(ProceduralTest, ProgramsAnswerLineByLine) {
    // One process answers all requests; it counts them.
    const std::string program =
        script("count", "n=0\nwhile read detail args; do\nn=$((n+1))\n"
                        "echo \"Attribute \\\"identifier\\\" \\\"name\\\" [\\\"$n $args\\\"]\"\n"
                        "echo \"Sphere 1 -1 1 360\"\nprintf '\\377'\ndone\n");
    const Parsed r(
        world("Color 1 0 0\n" + procedural(program, "a b") + procedural(program, "c") + "Sphere 2 -2 2 360"),
        m_options);
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 3u);
    EXPECT_EQ(r.primitive(0).attributes->name, "1 a b");
    EXPECT_EQ(r.primitive(1).attributes->name, "2 c");
    EXPECT_EQ(r.primitive(2).attributes->name, ""); // the state is as before
    EXPECT_EQ(r.primitive(0).attributes->color.y, 0);
}

TEST_F(ProceduralTest, ProgramsAreToldTheDetail) {
    const std::string program =
        script("detail", "read detail args\necho \"# $detail\" > " + (m_folder / "told").string() +
                             "\necho 'Sphere 1 -1 1 360'\n");
    // A square of 2 x 2 in front of a camera of 90 degrees, 4 units away, front side: half of the height.
    const Parsed r("Format 100 100 1\n" + world(procedural(program, "")), m_options);
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.primitives.size(), 1u); // it ended without the mark, but well
    std::ifstream told(m_folder / "told");
    std::string hash;
    double detail = 0;
    told >> hash >> detail;
    EXPECT_NEAR(detail, 625, 1);
}

TEST_F(ProceduralTest, TroubleIsReportedWhereTheyAreCalled) {
    const std::string fails = script("fails", "read line\nexit 3\n");
    const std::string wrong = script("wrong", "read line\necho 'Sphere 1 -1 1 360'\necho 'Sphare 2'\n");
    const Parsed r(
        world("\n" + procedural(fails, "") + procedural("/no/such/program", "") + procedural(wrong, "")),
        m_options);
    EXPECT_TRUE(r.says("error 4:1 Procedural \"RunProgram\" \"" + fails +
                       "\" was left out: it ended with status 3 and no answer"))
        << r.all_messages();
    EXPECT_TRUE(
        r.says("error 5:1 Procedural \"RunProgram\" \"/no/such/program\" was left out: it cannot be started"))
        << r.all_messages();
    EXPECT_TRUE(r.says("unknown request Sphare")) << r.all_messages();
    EXPECT_EQ(r.scene.primitives.size(), 1u);
}

TEST_F(ProceduralTest, ProgramsMayBeForbidden) {
    const std::string marker = (m_folder / "ran").string();
    const std::string program = script("mark", "touch " + marker + "\n");
    m_options.run_programs = false;
    const Parsed r(world(procedural(program, "")), m_options);
    EXPECT_TRUE(r.says("running programs is forbidden")) << r.all_messages();
    m_options.run_programs = true;
    const Parsed s("Option \"procedural\" \"int runprograms\" 0\n" + world(procedural(program, "")),
                   m_options);
    EXPECT_TRUE(s.says("running programs is forbidden")) << s.all_messages();
    EXPECT_FALSE(fs::exists(marker));
}

TEST_F(ProceduralTest, SilentProgramsAreGivenUp) {
    const std::string program = script("sleeps", "exec sleep 100\n");
    Programs programs;
    EXPECT_THROW(programs.ask(program, {}, "1\n", {.seconds = 0.1}), Error);
    const std::string endless =
        script("endless", "while :; do echo aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa; done\n");
    EXPECT_THROW(programs.ask(endless, {}, "1\n", {.seconds = 5, .bytes = 100000}), Error);
}

TEST_F(ProceduralTest, RecursionEnds) {
    const std::string program =
        script("again", "while read detail args; do\necho 'Sphere 1 -1 1 360'\n"
                        "echo 'Procedural \"RunProgram\" [\"again\" \"\"] [-1 1 -1 1 4 6]'\n"
                        "printf '\\377'\ndone\n");
    const Parsed r(world(procedural(program, "")), m_options);
    EXPECT_TRUE(r.says("100 deep at most")) << r.all_messages();
    EXPECT_EQ(r.scene.primitives.size(), 100u);
    m_options.most_procedurals = 7;
    const Parsed few(world(procedural(program, "")), m_options);
    EXPECT_TRUE(few.says("more than 7")) << few.all_messages();
    EXPECT_EQ(few.scene.primitives.size(), 7u);
}

TEST_F(ProceduralTest, WhatIsBesideThePictureMayStayUnread) {
    std::ofstream(m_folder / "ball.rib") << "Sphere 1 -1 1 360\n";
    const std::string body = "Procedural \"DelayedReadArchive\" [\"ball.rib\"] [-1 1 -1 1 4 6]\n" // seen
                             "Procedural \"DelayedReadArchive\" [\"ball.rib\"] [90 91 -1 1 4 6]\n"
                             "Procedural \"DelayedReadArchive\" [\"ball.rib\"] [-1 1 -1 1 -6 -4]\n"
                             "Procedural \"DelayedReadArchive\" [\"ball.rib\"] [-99 99 -1 1 -6 4]\n";
    const Parsed all(world(body), m_options);
    EXPECT_SILENT(all);
    EXPECT_EQ(all.scene.primitives.size(), 4u); // rays reach them
    const Parsed seen("Option \"procedural\" \"int offscreen\" 0\n" + world(body), m_options);
    EXPECT_SILENT(seen);
    EXPECT_EQ(seen.scene.primitives.size(), 2u);
}

TEST_F(ProceduralTest, Procedural2) {
    std::ofstream(m_folder / "ball.rib") << "Sphere 1 -1 1 360\n";
    const Parsed r(
        world("Procedural2 \"DelayedReadArchive2\" \"SimpleBound\" \"string filename\" [\"ball.rib\"] "
              "\"float[6] __bound\" [-1 1 -1 1 4 6]"),
        m_options);
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.primitives.size(), 1u);
}

TEST_F(ProceduralTest, PlugInsMakeRib) {
    std::vector<ProceduralRequest> asked;
    m_options.procedural = [&](const ProceduralRequest& request) -> std::optional<std::string> {
        asked.push_back(request);
        if (request.arguments.at(0) == "throws")
            throw Error("no such fur");
        if (request.arguments[0] != "fur")
            return std::nullopt;
        return "Sphere 1 -1 1 360 Procedural \"DynamicLoad\" [\"other\" \"\"] [-1 1 -1 1 4 6]";
    };
    const Parsed r(world("Procedural \"DynamicLoad\" [\"fur\" \"7 long\"] [-1 1 -1 1 4 6]\n"
                         "Procedural \"DynamicLoad\" [\"throws\" \"\"] [-1 1 -1 1 4 6]\n"),
                   m_options);
    ASSERT_EQ(asked.size(), 3u);
    EXPECT_EQ(asked[0].arguments[1], "7 long");
    EXPECT_EQ(asked[0].where.line, 3);
    EXPECT_EQ(r.scene.primitives.size(), 1u);
    EXPECT_TRUE(r.says("error 4:1 Procedural \"DynamicLoad\" \"throws\" was left out: no such fur"))
        << r.all_messages();
    EXPECT_TRUE(r.says("\"other\" was left out: no plug-in of that name")) << r.all_messages();
}

} // namespace kanuka::ingest::test
