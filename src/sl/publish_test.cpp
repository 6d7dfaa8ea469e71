// Published shaders, and what the compiler shows of itself.
#include "sl/frontend.h"
#include "sl/ops/manual.h"
#include "sl/test_publish.h"

namespace kanuka::sl::test {

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
