// Published shaders, the cache of compiled ones, and what the compiler shows of itself.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sl/codegen/cache.h"
#include "sl/frontend.h"
#include "sl/ops/manual.h"
#include "sl/test_support.h"

namespace kanuka::sl::test {

namespace fs = std::filesystem;

static std::string read_file(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

class SlPublish : public testing::Test {
  protected:
    void SetUp() override {
        m_folder =
            fs::temp_directory_path() / ("kanuka_publish_" + std::to_string(getpid()) + "_" +
                                         testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::remove_all(m_folder);
        fs::create_directories(m_folder);
    }
    void TearDown() override {
        std::error_code ec;
        fs::permissions(m_folder / "cache", fs::perms::owner_all, fs::perm_options::add, ec);
        fs::remove_all(m_folder);
    }
    std::string write(const std::string& name, const std::string& text) {
        std::ofstream(m_folder / name, std::ios::binary) << text;
        return (m_folder / name).string();
    }
    CompileOptions options() const {
        CompileOptions o;
        o.cache_dir = (m_folder / "cache").string();
        o.opt_level = 1;
        return o;
    }
    fs::path cache() const { return m_folder / "cache"; }
    fs::path m_folder;
};

static const char* const Library = "float wobble(float x) {\n  return SCALE * sin(x);\n}\n";
static const char* const Marble = R"(#include "lib.h"
#pragma annotation scale "waves across"
class marble(float scale = 3; color tint = color(0.5, 0.25, 1); /* of the veins */ string picture = "wood.tx";
             varying float wear = 0;) {
    float shared = 2;
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "skin", LambertBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b) {
        color c = tint * (0.5 + 0.25 * wobble(scale * u)) + 0.1 * color texture(picture, s, t) + wear;
        if (match("^x.*", picture) > 0) c = 0;
        SetLobe(b, "skin", 1, LambertBrdf("diffuseReflectance", c * shared * 0.25));
    }
})";

// Slots at all vertices, one after another.
static std::vector<Vec3f> shade(const Shader& shader, std::span<const Argument> arguments = {},
                                grid::Grid g = plane(8, 5)) {
    TestServices services;
    const auto instance = shader.instantiate(arguments, services);
    grid::VertexInputs out;
    instance->shade(g, {}, services, out);
    std::vector<Vec3f> values;
    for (size_t s = 0; s < out.slots.size(); s++)
        for (int i = 0; i < g.vertices(); i++)
            values.push_back(value(out, int(s), i));
    return values;
}

TEST_F(SlPublish, PublishedShadersNeedNothingElse) {
    write("lib.h", Library);
    const std::string file = write("marble.sl", Marble);
    CompileOptions o = options();
    o.defines = {{"SCALE", "0.5"}};
    Journal journal;
    const auto plain = compile_file(file, o, journal);
    ASSERT_TRUE(plain) << messages(journal);
    const auto bytes = publish(file, Marble, o, journal);
    ASSERT_TRUE(bytes) << messages(journal);
    fs::remove(m_folder / "lib.h");
    fs::remove(m_folder / "marble.sl");
    const std::string slo = write("marble.slo", *bytes);
    const auto published = compile_file(slo, options(), journal);
    ASSERT_TRUE(published) << messages(journal);
    EXPECT_FALSE(published->from_cache());
    EXPECT_EQ(shade(*published), shade(*plain));
    EXPECT_EQ(published->hash(), plain->hash());
    ASSERT_EQ(published->parameters().size(), 4u);
    EXPECT_EQ(published->parameters()[0].doc, "waves across");
    EXPECT_EQ(published->parameters()[1].doc, "of the veins");
    ASSERT_EQ(published->textures().size(), 1u);
    EXPECT_EQ(published->textures()[0].parameter, "picture");
    EXPECT_TRUE(compile_file(slo, options(), journal)->from_cache());

    const std::string about = published_metadata(slo, *bytes);
    for (const char* expected : {"\"name\": \"marble\"", "\"kind\": \"class\"", "\"waves across\"",
                                 "[0.5, 0.25, 1]", "\"varying\": true", "\"wood.tx\"", "lib.h"})
        EXPECT_NE(about.find(expected), std::string::npos) << expected << "\n" << about;
    // A published shader published again is the same.
    EXPECT_EQ(publish("other.slo", *bytes, options(), journal), bytes);
}

TEST_F(SlPublish, ErrorsInPublishedShadersNameTheirSource) {
    // What compiled when it was published, and does not for a later compiler: here, what never did.
    const std::string wrong =
        "// first line\nsurface a()\n{\n  float wide = nothing;\n  Ci = Os * wide;\n}\n";
    Journal journal, told;
    FrontEnd front("shows/a.sl", wrong, options(), journal);
    const std::string slo = write_slo(front.sources(), front.source(), ir::Program{});
    EXPECT_FALSE(compile_source("a.slo", slo, options(), told));
    EXPECT_EQ(messages(told).find("shows/a.sl:4:16: \"nothing\" is not declared"), 0u) << messages(told);
    EXPECT_NE(messages(told).find("\n  float wide = nothing;\n               ^"), std::string::npos)
        << messages(told);
    // A run-time message is located there too.
    const std::string faulty = write("f.sl", "surface f()\n{\n  printf(\"here\");\n  Oi = 1; Ci = 0;\n}\n");
    const auto published = publish(faulty, read_file(faulty), options(), journal);
    ASSERT_TRUE(published) << messages(journal);
    for (int round = 0; round < 2; round++) { // compiled, then from the cache
        const auto shader = compile_source("moved/f.slo", *published, options(), journal);
        ASSERT_TRUE(shader);
        EXPECT_EQ(shader->from_cache(), round == 1);
        TestServices services;
        const auto instance = shader->instantiate({}, services);
        grid::Grid g = plane(2, 2);
        grid::VertexInputs out;
        instance->shade(g, {}, services, out);
        ASSERT_EQ(services.reports.size(), 1u);
        EXPECT_EQ(services.reports[0].find(faulty + ":3:"), 0u) << services.reports[0];
    }
}

TEST_F(SlPublish, DamagedFilesAreToldAndNothingElse) {
    Journal journal;
    const std::string source = "surface a(float x = 1;) { Oi = 1; Ci = x * color(u, v, noise(P)); }";
    const std::string good = *publish("a.sl", source, options(), journal);
    const auto told = [&](const std::string& bytes) {
        Journal j;
        EXPECT_FALSE(compile_source("a.slo", bytes, options(), j));
        EXPECT_EQ(j.error_count(), 1u);
        return messages(j);
    };
    for (size_t length = 7; length < good.size(); length += 1 + length / 9)
        EXPECT_NE(told(good.substr(0, length)).find("a.slo: the published shader is "), std::string::npos)
            << length;
    for (size_t at = 9; at < good.size(); at += 1 + at / 9) {
        std::string bad = good;
        bad[at] = char(bad[at] ^ 32);
        EXPECT_NE(told(bad).find("the published shader is damaged"), std::string::npos) << at;
    }
    EXPECT_NE(told(good + "x").find("damaged"), std::string::npos);
    std::string other = good;
    other[7] = '9';
    EXPECT_NE(told(other).find("another version"), std::string::npos);
    EXPECT_THROW(published_metadata("a.sl", source), Error);
    EXPECT_TRUE(compile_source("a.slo", good, options(), journal));
}

// ---- the cache

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
    const std::string old = c.path("shader a, x") + ".host.1.2.tmp",
                      young = c.path("shader a, x") + ".host.1.3.tmp";
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

// ---- showing

TEST_F(SlPublish, StepsCanBeRead) {
    const std::string source = R"(
float twice(float x) { return 2 * x; }
surface s(float Kd = 0.5;) {
    float wave = twice(sin(u));
    color c = 0;
    if (v > 0.5)
        c = color(wave, 1, 0);
    Oi = 1;
    Ci = c * Kd * diffuse(N);
})";
    Journal journal;
    CompileOptions eight_lanes = options(); // every machine runs them, so the text is the same on all
    eight_lanes.lanes = 8;
    const auto text = [&](Emit what, const std::string& stage = "") {
        const auto t = emit("s.sl", source, what, stage, eight_lanes, journal);
        EXPECT_TRUE(t) << messages(journal);
        return t.value_or("");
    };
    const auto has = [](const std::string& all, const std::string& part) {
        EXPECT_NE(all.find(part), std::string::npos) << part << "\n--- in\n" << all;
    };
    has(text(Emit::Rsl), "#line 2 \"s.sl\"");
    has(text(Emit::Ast), "call twice : float");
    has(text(Emit::Ast), "// s.sl:4: float wave = twice(sin(u));");
    const std::string c = text(Emit::C, "prelighting");
    has(c, "// s.sl:4: float wave = twice(sin(u));");
    has(c, "varying float wave = 2 * sin(u);");
    has(c, "if (v > 0.5) {");
    has(c, "float3(wave, 1, 0)");
    has(text(Emit::Ir), "--- region");
    has(text(Emit::Ir), "varying mask tomask");
    has(text(Emit::Llvm), "define");
    has(text(Emit::Llvm), "_ZGVdN8v_sinf"); // at any number of lanes
    has(text(Emit::Asm), "kanuka_shade");
    has(text(Emit::C, "interior"), "has no interior stage");
    EXPECT_FALSE(emit("s.sl", "surface s() { x = 1; }", Emit::C, "", options(), journal));
    // What the preprocessor gives compiles to the same.
    EXPECT_EQ(shade(*compile_source("a.sl", text(Emit::Rsl), options(), journal)),
              shade(*compile_source("b.sl", source, options(), journal)));
}

TEST_F(SlPublish, EveryKindOfShaderCanBeRead) {
    const std::pair<const char*, const char*> shaders[] = {
        {"light l(float a = 1;) { illuminate(point(0, 0, 1)) { Cl = a * u; } }", "result.Cl = "},
        {"volume w(float d = 1;) { Ci = mix(Ci, color(1), exp(-d)); Oi = 1; }", "result.Ci = "},
        {"imager i() { Ci *= 0.5; alpha = 1; }", "result.alpha = 1;"},
        {"displacement d(float k[3] = {1, 2, 3};) { P += N * k[1]; }", "result.P = "},
        {"surface s(output varying color c = 0;) { c = u; Ci = c; Oi = 1; }", "emission.radiance = "},
    };
    CompileOptions o = options();
    o.aovs = {"c"};
    for (const auto& [source, expected] : shaders)
        for (const Emit what : {Emit::Rsl, Emit::Ast, Emit::Ir, Emit::C, Emit::Llvm, Emit::Asm}) {
            Journal journal;
            const auto text = emit("x.sl", source, what, "", o, journal);
            ASSERT_TRUE(text) << source << "\n" << messages(journal);
            EXPECT_GT(text->size(), 30u) << source;
            const bool shown = what != Emit::C || text->find(expected) != std::string::npos;
            EXPECT_TRUE(shown) << *text;
        }
}

// ---- the manual

// The marked parts of docs/language.md are made from the tables; KANUKA_WRITE_DOCS=1 writes them anew.
TEST(SlManual, IsUpToDate) {
    const fs::path file = fs::path(KANUKA_SOURCE_DIR) / "docs/language.md";
    const std::string there = read_file(file);
    std::string made = there;
    for (const auto& [mark, text] : {std::pair{std::string("<!-- lobes -->\n"), ops::lobes_manual()},
                                     std::pair{std::string("<!-- globals -->\n"), ops::globals_manual()},
                                     std::pair{std::string("<!-- shadeops -->\n"), ops::shadeops_index()}}) {
        const size_t begin = made.find(mark), end = made.find("<!-- end -->", begin);
        ASSERT_TRUE(begin != std::string::npos && end != std::string::npos) << mark;
        made.replace(begin + mark.size(), end - begin - mark.size(), text);
    }
    if (std::getenv("KANUKA_WRITE_DOCS"))
        std::ofstream(file, std::ios::binary) << made;
    else
        EXPECT_TRUE(there == made) << "run this test with KANUKA_WRITE_DOCS=1";
}

// The part on oracles is kanuka_bsdf_test's.
TEST(SlManual, LobesPageIsUpToDate) {
    const fs::path file = fs::path(KANUKA_SOURCE_DIR) / "docs/lobes.md";
    const std::string mark = "<!-- oracles -->\n", there = read_file(file);
    std::string made = ops::lobes_page();
    if (const size_t at = there.find(mark); at != std::string::npos)
        made.replace(made.find(mark), std::string::npos, there.substr(at));
    if (std::getenv("KANUKA_WRITE_DOCS"))
        std::ofstream(file, std::ios::binary) << made;
    EXPECT_EQ(read_file(file), made) << "run this test with KANUKA_WRITE_DOCS=1";
}

} // namespace kanuka::sl::test
