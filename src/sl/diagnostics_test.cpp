// What the compiler says: places, carets, expectations, no cascades; and that no source makes it fall.
#include <filesystem>
#include <fstream>
#include <random>

#include "sl/codegen/cache.h"
#include "sl/test_support.h"

namespace kanuka::sl::test {

static std::string complaints(const std::string& source) {
    Journal journal;
    EXPECT_FALSE(compile(source, {}, &journal)) << source;
    return messages(journal);
}

TEST(SlDiagnostics, PlaceLineCaretAndExpectation) {
    const std::string m = complaints("surface s(float Kd = 1;)\n{\n    Ci = Kd * difuse(N);\n}\n");
    EXPECT_NE(m.find("test.sl:3:15: there is no function \"difuse\"; did you mean \"diffuse\"?"),
              std::string::npos)
        << m;
    EXPECT_NE(m.find("\n    Ci = Kd * difuse(N);\n              ^"), std::string::npos) << m;
}

TEST(SlDiagnostics, Messages) {
    const std::pair<const char*, const char*> cases[] = {
        {"surface s() { float x = 1 }", "expected \";\""},
        {"surface s() { x = 1; }", "\"x\" is not declared"},
        {"surface s() { float a = \"text\"; }", "found string, expected float"},
        {"surface s() { break; }", "outside of a loop"},
        {"surface s() { while (1) { break 3; } }", "inside of 1 loops"},
        {"float f(float x) { return f(x); } surface s() { Ci = f(1); }", "calls itself"},
        {"float f(float x) { return x; } surface s() { Ci = f(1, 2); }", "does not take (float, float)"},
        {"surface s() { Ci = sin(P); }", "does not take (point)"},
        {"surface s() { float a[2]; Ci = a; }", "found float[2]"},
        {"surface s() { float a; a[1] = 2; }", "has no elements"},
        {"surface s() { string x = \"a\"; if (u > 0.5) x = \"b\"; Ci = color(transform(x, P)); }",
         "string cannot vary"},
        {"surface s() { Ci = comp(Cs, 3); }", "component 3"},
        {"surface s() { Ci = \"unfinished; }", "has no end"},
        {"surface s() { /* ", "has no end"},
        {"surface s() { 3 = 4; }", "cannot assign"},
        {"surface s() { Ci += 1; x++; }", "RSL has"},
        {"#include \"nowhere.h\"\nsurface s() {}", "cannot find the file \"nowhere.h\""},
        {"#if 1\nsurface s() {}", "no #endif"},
        {"#bogus\nsurface s() {}", "is not a directive"},
        {"float f() { return 1; }", "has no shader"},
        {"", "has no shader"},
        {"class c() { float x; }", "has no stage"},
        {"class c() { public void mnk_init(output MnkMaterial m) {} }", "this stage must be"},
        {"class c() { public void mnk_prelighting(output MnkMaterialBoundary b) { SetLobe(b, \"a\", 1, "
         "LambertBrdf(\"nope\", 1)); } }",
         "it has diffuseReflectance"},
        {"class c() { public void mnk_prelighting(output MnkMaterialBoundary b) { AddLobe(b, \"a\", "
         "LambertBrdf()); } }",
         "belongs into mnk_init"},
        {"class c() { public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) { float x = "
         "u; printf(\"%f\", x); } }",
         "varies over the surface"},
        {"surface s() { Ci = spline(u, 1, 2); }", "at least 4"},
        {"surface s() { float x; color x; }", "declared twice"},
        {"surface s() { PI = 3; }", "cannot be changed"},
        {"surface s() { float x = sheder->go(1); }", "is not declared"},
        {"surface s() { float x = u->go(1); }", "needs a struct or a shader"},
        {"struct R { float a; } surface s() { R r; Ci = r->b; }", "it has a"},
        {"struct R { float a; } surface s() { R r = R(1, 2); Ci = r->a; }", "has 1 members"},
        {"surface s() { float a[3]; push(a, 1); Ci = a[0]; }", "has a fixed size"},
        {"surface s() { matrix m = 1; Ci = m[0]; }", "found matrix"},
    };
    for (const auto& [source, expected] : cases)
        EXPECT_NE(complaints(source).find(expected), std::string::npos) << source << "\n"
                                                                        << complaints(source);
}

TEST(SlDiagnostics, SeveralInOneRunAndNoCascades) {
    Journal journal;
    compile("surface s(float a = 1;) {\n float x = ;\n float y = nothing + 1;\n float z = y + nothing;\n Ci "
            "= sin(\"x\");\n Oi = Os\n}\n",
            {}, &journal);
    EXPECT_EQ(journal.error_count(), 4u) << messages(journal);
    Journal second;
    compile(
        "surface s(float a = 1;) {\n float y = nothing + 1;\n float z = y + nothing;\n Ci = sin(\"x\");\n}\n",
        {}, &second);
    EXPECT_EQ(second.error_count(), 2u) << messages(second);
}

TEST(SlDiagnostics, Warnings) {
    Journal journal;
    EXPECT_TRUE(
        compile("surface s(float used = 1, unused = 2;) { float x; Oi = 1; Ci = used * x; }", {}, &journal));
    const std::string m = messages(journal);
    EXPECT_NE(m.find("\"unused\" is never used"), std::string::npos) << m;
    EXPECT_NE(m.find("\"x\" is used before it has a value"), std::string::npos) << m;
    EXPECT_FALSE(journal.has_errors());
    // What compilers of the trade let pass.
    const std::pair<const char*, const char*> doubtful[] = {
        {"color c = P; Ci = c;", "a point is taken as a color"},
        {"used = 2; Ci = used;", "is a parameter and is assigned to: a copy of it changes"},
        {"float x = 1; float x = 2; Ci = x;", "declared twice"},
        {"uniform float x = 0; if (u > 0.5) x = 1; Ci = x;", "is declared uniform, but"},
        {"Ci = Cs * N;", "the result is taken as a color"},
        {"color c[2] = {color(0), color(1), color(2)}; Ci = c[1];", "the last are left out"},
        {"float f(float x) { return; } Ci = f(1);", "must return a float"},
    };
    for (const auto& [body, expected] : doubtful) {
        Journal j;
        compile("surface s(float used = 1; float k;) { Oi = 1; " + std::string(body) + " }", {}, &j);
        EXPECT_FALSE(j.has_errors()) << body << "\n" << messages(j);
        EXPECT_NE(messages(j).find(expected), std::string::npos) << body << "\n" << messages(j);
        EXPECT_NE(messages(j).find("has no default value"), std::string::npos);
    }
    // Functions that nothing calls, and outputs that calls set.
    Journal quiet;
    EXPECT_TRUE(compile("float f() { return missing(); }\nvoid g(output float y) { y = 1; }\n"
                        "surface s() { float y; g(y); Oi = 1; Ci = y; }",
                        {}, &quiet));
    EXPECT_NE(messages(quiet).find("which nothing calls: there is no function"), std::string::npos);
    EXPECT_EQ(messages(quiet).find("before it has a value"), std::string::npos);
}

TEST(SlDiagnostics, DocsOfParameters) {
    const auto s = compile("#pragma annotation b \"from the pragma\"\nsurface s(\n  float a = 1; // how "
                           "much\n  float b = 2;\n) { Oi = 1; Ci = a * b; }");
    EXPECT_EQ(s->parameters()[0].doc, "how much");
    EXPECT_EQ(s->parameters()[1].doc, "from the pragma");
}

// ---- includes and the cache
// -----------------------------------------------------------------------------------------------

class SlFiles : public testing::Test {
  protected:
    void SetUp() override {
        m_folder = std::filesystem::temp_directory_path() /
                   ("kanuka_sl_" + std::to_string(getpid()) + "_" +
                    testing::UnitTest::GetInstance()->current_test_info()->name());
        std::filesystem::remove_all(m_folder);
        std::filesystem::create_directories(m_folder);
    }
    void TearDown() override { std::filesystem::remove_all(m_folder); }
    void write(const std::string& name, const std::string& text) { std::ofstream(m_folder / name) << text; }
    CompileOptions options() const {
        CompileOptions o;
        o.cache_dir = (m_folder / "cache").string();
        return o;
    }
    std::filesystem::path m_folder;
};

TEST_F(SlFiles, IncludesAndErrorsWithinThem) {
    std::filesystem::create_directories(m_folder / "inc");
    write("inc/lib.h", "float lib(float x) {\n return x * SCALE;\n}\n");
    write("a.sl", "#include \"lib.h\"\nsurface a() { Oi = 1; Ci = lib(u); }\n");
    Journal journal;
    CompileOptions o = options();
    EXPECT_FALSE(compile_file((m_folder / "a.sl").string(), o, journal));
    o.include_path = {(m_folder / "inc").string()};
    Journal second;
    EXPECT_FALSE(compile_file((m_folder / "a.sl").string(), o, second));
    EXPECT_NE(messages(second).find("lib.h:2:13: \"SCALE\" is not declared"), std::string::npos)
        << messages(second);
    o.defines = {{"SCALE", "2"}};
    Journal third;
    EXPECT_TRUE(compile_file((m_folder / "a.sl").string(), o, third)) << messages(third);
    EXPECT_FALSE(compile_file((m_folder / "missing.sl").string(), o, third));
    write("loop.h", "#include \"loop.h\"\n");
    write("b.sl", "#include \"loop.h\"\nsurface b() {}\n");
    Journal fourth;
    EXPECT_FALSE(compile_file((m_folder / "b.sl").string(), o, fourth));
    EXPECT_NE(messages(fourth).find("include itself"), std::string::npos);
}

TEST_F(SlFiles, CacheIsUsedAndBrokenEntriesAreRecompiled) {
    const std::string source = probe("r = noise(P * 3) + sin(u);");
    const auto run = [&](bool expect_cached) {
        Journal journal;
        const auto s = compile_source("p.sl", source, options(), journal);
        EXPECT_TRUE(s) << messages(journal);
        EXPECT_EQ(s->from_cache(), expect_cached);
        TestServices services;
        grid::Grid g = plane(8, 5);
        return run_probe(*s, g, services);
    };
    const auto fresh = run(false);
    EXPECT_EQ(run(true), fresh);
    std::vector<std::filesystem::path> entries;
    for (const auto& e : std::filesystem::directory_iterator(m_folder / "cache"))
        entries.push_back(e.path());
    ASSERT_EQ(entries.size(), 1u);
    std::string good;
    {
        std::ifstream in(entries[0], std::ios::binary);
        good.assign(std::istreambuf_iterator<char>(in), {});
    }
    const auto damage = [&](const std::string& bytes) {
        std::ofstream(entries[0], std::ios::binary | std::ios::trunc) << bytes;
    };
    damage("");
    EXPECT_EQ(run(false), fresh);
    damage(good.substr(0, good.size() / 2));
    EXPECT_EQ(run(false), fresh);
    std::string flipped = good;
    flipped[flipped.size() / 2] = char(flipped[flipped.size() / 2] ^ 4);
    damage(flipped);
    EXPECT_EQ(run(false), fresh);
    EXPECT_EQ(run(true), fresh); // and replaced by a whole one
    // Other options, other entry.
    CompileOptions o = options();
    o.lanes = 1;
    Journal journal;
    EXPECT_FALSE(compile_source("p.sl", source, o, journal)->from_cache());
    EXPECT_NE(compile_source("p.sl", source, o, journal)->hash(), 0u);
}

TEST_F(SlFiles, CacheIsTrimmedByLastUse) {
    const ObjectCache cache((m_folder / "cache").string());
    for (int i = 0; i < 10; i++)
        cache.write("key" + std::to_string(i), std::string(1000, char('a' + i)));
    std::filesystem::last_write_time(cache.path("key3"),
                                     std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
    cache.trim(3 * 1100);
    EXPECT_TRUE(cache.read("key3").has_value());
    int left = 0;
    for (int i = 0; i < 10; i++)
        left += cache.read("key" + std::to_string(i)).has_value();
    EXPECT_LE(left, 3);
    EXPECT_EQ(*cache.read("key3"), std::string(1000, 'd'));
    EXPECT_FALSE(cache.read("other").has_value());
}

// ---- robustness
// -------------------------------------------------------------------------------------------------------------

TEST(SlFuzz, MutatedSourcesNeverFall) {
    const std::string seeds[] = {probe("float i, x = 0; for (i = 0; i < 5; i += 1) { if (u > 0.5) break; x "
                                       "+= noise(P); } r = x * color(1, 2, 3);"),
                                 "#define A(x) (x)\nfloat f(float x; output color c) { c = A(x); return x; "
                                 "}\nsurface s(float Kd = 1; string t = \"\";) {\n"
                                 " color q; float k = f(Kd, q); if (t != \"\") q *= color texture(t, s, t); "
                                 "Oi = Os; Ci = Os * (q * diffuse(N) + k * specular(N, -I, .1)); }",
                                 "displacement d(float a[3] = {1, 2, 3};) { P += N * a[1] * spline(u, 0, 1, "
                                 "2, 3); N = calculatenormal(P); }"};
    const std::string_view pieces[] = {"(",
                                       ")",
                                       "{",
                                       "}",
                                       ";",
                                       ",",
                                       "\"",
                                       "=",
                                       "+",
                                       "float",
                                       "color",
                                       "[",
                                       "]",
                                       "u",
                                       "P",
                                       "if",
                                       "for",
                                       "return",
                                       "#define A A\n",
                                       "1e99",
                                       ".",
                                       "?",
                                       ":",
                                       "output",
                                       "/*",
                                       "noise",
                                       "diffuse(N)"};
    std::mt19937 random(7);
    int compiled = 0;
    for (int round = 0; round < 400; round++) {
        std::string s = seeds[size_t(round) % 3];
        for (int edits = 1 + int(random() % 2); edits > 0; edits--) {
            const size_t at = random() % s.size();
            switch (random() % 4) {
            case 0:
                s.erase(at, 1 + random() % 6);
                break;
            case 1:
                s.insert(at, pieces[random() % std::size(pieces)]);
                break;
            case 2:
                s[at] = char(32 + random() % 96);
                break;
            default:
                s.insert(at, s.substr(random() % s.size(), random() % 30));
                break;
            }
            if (s.empty())
                s = ";";
        }
        Journal journal;
        CompileOptions o;
        o.use_cache = false;
        o.opt_level = 0;
        const auto shader = compile_source("fuzz.sl", s, o, journal);
        EXPECT_TRUE(shader || journal.has_errors()) << s;
        for (const auto& e : journal.entries())
            EXPECT_EQ(e.message.find("invalid code"), std::string::npos) << e.message << "\n" << s;
        compiled += shader != nullptr;
    }
    EXPECT_GT(compiled, 5);
}

TEST(SlFuzz, DeepNestingIsAnError) {
    std::string parens = "surface s() { Ci = ";
    for (int i = 0; i < 100000; i++)
        parens += "(";
    complaints(parens);
    std::string sum = "surface s() { Oi = 1; float x = u";
    for (int i = 0; i < 5000; i++)
        sum += " + u";
    EXPECT_TRUE(compile(sum + "; Ci = x; }"));
    std::string indices = "surface s() { float x[2]; x";
    for (int i = 0; i < 50000; i++)
        indices += "[0]";
    complaints(indices + " = 1; }");
    std::string calls = "#define A(x) x\nsurface s() { Oi = 1; Ci = ";
    for (int i = 0; i < 100000; i++)
        calls += "A(";
    EXPECT_NE(complaints(calls + "u" + std::string(100000, ')') + "; }").find("nest too deep"),
              std::string::npos);
    std::string macros = "#define A0 u\n";
    for (int i = 1; i < 60; i++)
        macros += "#define A" + std::to_string(i) + " A" + std::to_string(i - 1) + " + A" +
                  std::to_string(i - 1) + "\n";
    EXPECT_NE(complaints(macros + "surface s() { Ci = A59; }").find("4 million"), std::string::npos);
}

TEST(SlDiagnostics, DerivativesOfWhatHoldsOnlyUnderACondition) {
    const auto said = [](const char* statements) {
        Journal journal;
        EXPECT_TRUE(compile(probe(statements), {}, &journal)) << messages(journal);
        return messages(journal);
    };
    const std::string wrong = said("float x = 0;\n if (u > 0.5) {\n x = sin(s);\n r = Du(x); }");
    EXPECT_NE(wrong.find("test.sl:13:"), std::string::npos) << wrong;
    EXPECT_NE(wrong.find("the derivative is taken from neighbours, under a condition that varies"),
              std::string::npos)
        << wrong;
    EXPECT_NE(
        said("float x = 0; if (u > 0.5) { x = s * 2; r = color texture(\"a.tx\", x, t); }").find("\"x\""),
        std::string::npos);
    EXPECT_NE(said("float i = 0; while (i < u * 4) { i += 1; r += filterwidth(i * s); }").find("\"i\""),
              std::string::npos);
    // Right everywhere: computed for all, or by conditions that are one for the surface.
    for (const char* fine :
         {"if (u > 0.5) { float x = sin(s); r = Du(x); }", "float x = sin(s); if (u > 0.5) r = Du(x);",
          "float x = 0; if (u > 0.5) x = 1; r = Du(x);",
          "float x = 0; if (u > 0.5) x = 1; if (v > 0.5) r = Du(x);",
          "if (s > 0.2) r = color texture(\"a.tx\", s * 2, t);",
          "float x = 0; if (time > 0.5) { x = s; r = Du(x); }"})
        EXPECT_EQ(said(fine).find("condition"), std::string::npos) << fine << said(fine);
}

TEST(SlDiagnostics, FullArraysSayWhatWouldDo) {
    TestServices services;
    const auto fill = [&](const std::string& statements, int room = 64) {
        Journal journal;
        CompileOptions o;
        o.use_cache = false;
        o.array_room = room;
        const auto s = compile_source("test.sl", probe(statements), o, journal);
        EXPECT_TRUE(s) << messages(journal);
        grid::Grid g = plane(2, 2);
        services.reports.clear();
        return run_probe(*s, g, services)[0].x;
    };
    // Loops whose length is seen need no cap.
    EXPECT_EQ(fill("float a[]; float i; for (i = 0; i < 100; i += 1) push(a, i); r = a[99];"), 99);
    EXPECT_EQ(services.reports.size(), 0u);
    EXPECT_EQ(
        fill("float a[]; float i, j; for (i = 0; i <= 19; i = i + 1) for (j = 0; j < 10; j += 2) push(a, j);"
             " r = arraylength(a);"),
        100);
    const char* hidden = "float a[]; float i = 0; while (i < 100) {\n push(a, i); i += 1; } r = a[63];";
    EXPECT_EQ(fill(hidden), 99); // the last element takes what there is no room for
    ASSERT_GE(services.reports.size(), 1u);
    EXPECT_NE(services.reports[0].find("test.sl:11:"), std::string::npos) << services.reports[0];
    EXPECT_NE(services.reports[0].find("is full: it has room for 64 values; reserve(array, n)"),
              std::string::npos)
        << services.reports[0];
    EXPECT_EQ(fill(hidden, 128), 63);
    EXPECT_EQ(services.reports.size(), 0u);
    EXPECT_EQ(
        fill("float a[]; reserve(a, 100); float i = 0; while (i < 100) { push(a, i); i += 1; } r = a[99];"),
        99);
}

} // namespace kanuka::sl::test
