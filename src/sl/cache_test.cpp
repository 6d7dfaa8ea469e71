// The cache of compiled shaders.
#include <chrono>
#include <csignal>
#include <sys/resource.h>
#include <sys/wait.h>

#include "sl/codegen/cache.h"
#include "sl/test_publish.h"

namespace kanuka::sl::test {

TEST_F(SlPublish, CachedShadersAreWhole) {
    write("lib.h", Library);
    CompileOptions o = options();
    o.defines = {{"SCALE", "0.5"}};
    const std::string file = (m_folder / "marble.sl").string();
    Journal journal, second;
    const auto fresh = compile_source(file, Marble, o, journal);
    const auto cached = compile_source(file, Marble, o, second);
    ASSERT_TRUE(fresh && cached) << messages(journal);
    EXPECT_FALSE(fresh->from_cache());
    EXPECT_TRUE(cached->from_cache());
    EXPECT_EQ(messages(second), messages(journal)); // warnings come again
    EXPECT_EQ(cached->name(), "marble");
    EXPECT_EQ(cached->hash(), fresh->hash());
    EXPECT_EQ(cached->stages(), fresh->stages());
    ASSERT_EQ(cached->parameters().size(), fresh->parameters().size());
    for (size_t k = 0; k < fresh->parameters().size(); k++) {
        const Parameter &a = fresh->parameters()[k], &b = cached->parameters()[k];
        EXPECT_EQ(std::tie(a.name, a.type, a.varying, a.output, a.array_size, a.floats, a.strings, a.doc),
                  std::tie(b.name, b.type, b.varying, b.output, b.array_size, b.floats, b.strings, b.doc));
    }
    EXPECT_EQ(shade(*cached), shade(*fresh));
    // Another variant is compiled from the source, which is read again, and is then in the cache too.
    const std::vector<Argument> worn = {{"wear", {}, {}, true}};
    grid::Grid g = plane(8, 5);
    grid::Channel wear;
    wear.name = "wear";
    wear.stride = g.stride;
    wear.data.assign(size_t(g.stride), 0.125f);
    g.primvars.push_back(wear);
    const std::vector<Vec3f> expected = shade(*fresh, worn, g);
    EXPECT_NE(expected, shade(*fresh));
    EXPECT_EQ(shade(*cached, worn, g), expected);
    EXPECT_EQ(shade(*compile_source(file, Marble, o, journal), worn, g), expected);
    // Colours of the grid are such a variant.
    const std::string painted = "surface p() { Oi = Os; Ci = Cs * Os; }";
    grid::Grid colored = plane(4, 4);
    grid::Channel cs;
    cs.name = "Cs";
    cs.components = 3;
    cs.stride = colored.stride;
    cs.data.assign(size_t(colored.stride) * 3, 0.25f);
    colored.primvars.push_back(cs);
    std::vector<Vec3f> first;
    for (int round = 0; round < 3; round++) {
        const auto p = compile_source("p.sl", painted, o, journal);
        TestServices services;
        const auto instance = p->instantiate({}, services);
        EXPECT_FALSE(instance->uniform_material(true));
        EXPECT_TRUE(instance->uniform_material(false));
        const std::vector<Vec3f> values = shade(*p, {}, colored);
        EXPECT_TRUE(round == 0 || values == first);
        first = values;
    }
}

TEST_F(SlPublish, TheCacheKnowsWhatChanged) {
    write("lib.h", Library);
    CompileOptions o = options();
    o.defines = {{"SCALE", "0.5"}};
    const std::string file = (m_folder / "marble.sl").string();
    Journal journal;
    const auto cached = [&](const std::string& text, const CompileOptions& with) {
        const auto shader = compile_source(file, text, with, journal);
        EXPECT_TRUE(shader) << messages(journal);
        return shader && shader->from_cache();
    };
    EXPECT_FALSE(cached(Marble, o));
    EXPECT_TRUE(cached(Marble, o));
    o.defines = {{"SCALE", "0.25"}};
    EXPECT_FALSE(cached(Marble, o));
    write("lib.h", "float wobble(float x) {\n  return SCALE * cos(x);\n}\n");
    EXPECT_FALSE(cached(Marble, o));
    EXPECT_TRUE(cached(Marble, o));
    EXPECT_FALSE(cached(std::string(Marble) + "// more\n", o)); // documentation is kept with the code
    o.opt_level = 0;
    EXPECT_FALSE(cached(Marble, o));
}

TEST_F(SlPublish, ACacheThatCannotBeWrittenIsNoFault) {
    if (geteuid() == 0) { // root writes everywhere: a file stands where the folder would be
        write("cache", "in the way");
    } else {
        fs::create_directories(cache());
        fs::permissions(cache(), fs::perms::owner_read | fs::perms::owner_exec);
    }
    Journal journal;
    for (const char* name : {"a", "b", "c"}) {
        const auto shader =
            compile_source(std::string(name) + ".sl",
                           "surface " + std::string(name) + "() { Oi = 1; Ci = u; }", options(), journal);
        ASSERT_TRUE(shader);
        EXPECT_FALSE(shade(*shader).empty());
    }
    ASSERT_EQ(journal.entries().size(), 1u) << messages(journal);
    EXPECT_EQ(journal.entries()[0].severity, Severity::Warning);
    EXPECT_NE(journal.entries()[0].message.find("cannot be written"), std::string::npos);
}

// A disk that is full after some bytes: a process that may write no more than that, as the system tells it.
TEST_F(SlPublish, AFullDiskLeavesNothingBehind) {
    const pid_t child = fork();
    if (child == 0) {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit little{500, 500};
        setrlimit(RLIMIT_FSIZE, &little);
        Journal journal;
        const auto shader =
            compile_source("a.sl", "surface a() { Oi = 1; Ci = color(u, v, 0); }", options(), journal);
        bool right = shader && !shade(*shader).empty() && journal.entries().size() == 1 &&
                     messages(journal).find("(writing: File too large)") != std::string::npos;
        for (const auto& e : fs::directory_iterator(cache()))
            right = right && e.path().empty();
        _exit(right ? 0 : 1);
    }
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
}

TEST_F(SlPublish, LeftoversGoAndUseIsNoted) {
    const ObjectCache c(cache().string());
    EXPECT_EQ(c.write("shader a, x", "one"), "");
    EXPECT_EQ(c.write("shader b, x", "two"), "");
    const auto now = fs::file_time_type::clock::now();
    const std::string old = c.path("shader a, x") + ".host.1.2.kso.tmp",
                      young = c.path("shader a, x") + ".host.1.3.kso.tmp";
    std::ofstream(old) << "half";
    std::ofstream(young) << "half";
    std::ofstream(cache() / "other.txt") << "not ours";
    fs::last_write_time(old, now - std::chrono::hours(2));
    fs::last_write_time(c.path("shader a, x"), now - std::chrono::hours(5));
    fs::last_write_time(c.path("shader b, x"), now - std::chrono::hours(4));
    EXPECT_TRUE(c.read("shader a, x")); // is now the younger of the two
    EXPECT_EQ(c.trim(60), 2u);          // the leftover, and b
    EXPECT_FALSE(fs::exists(old));
    EXPECT_TRUE(fs::exists(young));
    EXPECT_TRUE(c.read("shader a, x"));
    EXPECT_FALSE(c.read("shader b, x"));
    ASSERT_EQ(c.entries(false).size(), 1u);
    EXPECT_EQ(c.entries(false)[0].shader, "a");
    EXPECT_LT(c.entries(false)[0].age_s, 60);
    std::ofstream(c.path("shader a, x"), std::ios::binary | std::ios::app) << "x";
    EXPECT_FALSE(c.entries(true)[0].problem.empty());
    EXPECT_EQ(c.clear(), 2u);
    EXPECT_TRUE(fs::exists(cache() / "other.txt"));
}

TEST_F(SlPublish, TheLimitHolds) {
    setenv("KANUKA_SHADER_CACHE_SIZE", "64K", 1);
    EXPECT_EQ(cache_limit(), 65536u);
    const ObjectCache c(cache().string());
    for (int k = 0; k < 200; k++)
        c.write("shader s" + std::to_string(k) + ", x", std::string(4096, 'x'));
    uint64_t total = 0;
    for (const CacheEntry& e : c.entries(false))
        total += e.bytes;
    EXPECT_LE(total, 65536u + 65536u / 8);
    EXPECT_GE(total, 32768u);
    for (const auto& [text, bytes] :
         {std::pair{"2G", uint64_t(2) << 30}, std::pair{"1.5M", uint64_t(3) << 19},
          std::pair{"100", uint64_t(100)}, std::pair{"lots", uint64_t(1) << 30},
          std::pair{"-1", uint64_t(1) << 30}, std::pair{"", uint64_t(1) << 30}}) {
        setenv("KANUKA_SHADER_CACHE_SIZE", text, 1);
        EXPECT_EQ(cache_limit(), bytes) << text;
    }
    unsetenv("KANUKA_SHADER_CACHE_SIZE");
}

// Processes that compile, read and damage one shader's entry at once, as a farm does: each has the right
// result.
TEST_F(SlPublish, ManyProcessesAtOnce) {
    const std::string source = "surface many() { Oi = 1; Ci = color(u, v, float noise(P * 3)); }";
    Journal journal;
    CompileOptions alone = options();
    alone.use_cache = false;
    const std::vector<Vec3f> expected = shade(*compile_source("many.sl", source, alone, journal));
    std::vector<pid_t> children;
    for (int k = 0; k < 20; k++) {
        const pid_t child = fork();
        if (child == 0) {
            bool right = true;
            for (int round = 0; round < 3; round++) {
                Journal own;
                const auto shader = compile_source("many.sl", source, options(), own);
                right = right && shader && own.entries().empty() && shade(*shader) == expected;
                if (k % 5 == 0) // and some break it
                    for (const auto& e : fs::directory_iterator(cache()))
                        if (e.path().extension() == ".kso") {
                            std::error_code ec;
                            fs::resize_file(e.path(), 100, ec);
                        }
            }
            _exit(right ? 0 : 1);
        }
        children.push_back(child);
    }
    for (const pid_t child : children) {
        int status = -1;
        waitpid(child, &status, 0);
        EXPECT_EQ(status, 0);
    }
    EXPECT_TRUE(compile_source("many.sl", source, options(), journal));
    EXPECT_TRUE(compile_source("many.sl", source, options(), journal)->from_cache());
    for (const auto& e : fs::directory_iterator(cache()))
        EXPECT_NE(e.path().extension(), ".tmp") << e.path();
}

} // namespace kanuka::sl::test
