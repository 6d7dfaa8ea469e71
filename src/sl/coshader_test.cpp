// Co-shaders: connected by parameters and by name, methods, members, categories, circles, the cache.
#include <filesystem>
#include <unistd.h>

#include "sl/test_support.h"

namespace kanuka::sl {
namespace {

using namespace test;

CoShader co(std::string handle, std::string source, std::string category = {},
            std::vector<Connection> connections = {}) {
    CoShader c;
    c.handle = handle;
    c.file = handle + ".sl";
    c.text = std::move(source);
    c.category = std::move(category);
    c.connections = std::move(connections);
    return c;
}

struct Case {
    std::vector<CoShader> coshaders;
    std::vector<Connection> connections;
    std::vector<Argument> arguments;
};

// What the probe's statements leave in r, at all lane counts.
std::vector<Vec3f> connect(const Case& given, const std::string& statements,
                           const std::string& parameters = {}, std::string* said = nullptr,
                           const std::string& members = {}) {
    std::vector<Vec3f> first;
    for (const Config c : configs()) {
        Journal journal;
        CompileOptions o;
        o.lanes = c.lanes;
        o.opt_level = c.opt;
        o.use_cache = false;
        o.coshaders = given.coshaders;
        o.connections = given.connections;
        std::string source = probe(statements, {}, parameters);
        if (!members.empty())
            source.insert(source.find("public void mnk_init"), members + "\n");
        const auto shader = compile_source("test.sl", source, o, journal);
        if (said)
            *said = messages(journal);
        if (!shader) {
            ADD_FAILURE() << messages(journal);
            return std::vector<Vec3f>(54, Vec3f(NAN, NAN, NAN));
        }
        grid::Grid g = plane(8, 5);
        grid::Channel wave{"wave", 1, g.stride, std::vector<float>(size_t(g.stride) + 32, 0.0f)};
        for (size_t i = 0; i < 54; i++)
            wave.data[i] = float(i);
        g.primvars.push_back(std::move(wave));
        TestServices services;
        const std::vector<Vec3f> r = run_probe(*shader, g, services, given.arguments);
        if (first.empty())
            first = r;
        for (size_t i = 0; i < r.size(); i++)
            for (int k = 0; k < 3; k++)
                EXPECT_NEAR(r[i][k], first[i][k], 4e-6f * std::max(1.0f, std::abs(first[i][k])));
    }
    return first;
}

const char* const Paint =
    "class paint(color tint = color(1, 2, 3); varying float wave = 0; string __category = \"\") {"
    "  float calls = 0;"
    "  public void begin() { calls = 10; }"
    "  public color get(float k) { calls += 1; return k * tint + wave; }"
    "  public void put(output color c; output float n) { c = tint; n = calls; }"
    "  public color shade(float k; float gain = 2; color extra = 0) { return k * gain + extra; }"
    "}";

} // namespace

TEST(CoShader, AShaderParameterIsCalledThrough) {
    const Case c{{co("a", Paint)}, {{"base", {"a"}}}, {{"a.tint", {4, 5, 6}, {}, false}}};
    const auto r = connect(c, "r = base->get(2);", "shader base = null;");
    EXPECT_EQ(r[7], Vec3f(8, 10, 12));
    // Its type is the method's, not what stands beside it.
    EXPECT_EQ(connect(c, "r = 0.5 * base->get(2) + base->get(1) * color(1, 0, 0);", "shader base = null;")[3],
              Vec3f(8, 5, 6));
}

TEST(CoShader, NullStaysLegal) {
    for (const Case& c :
         {Case{}, Case{{co("a", Paint)}, {}, {}}, Case{{co("a", Paint)}, {{"base", {"gone"}}}, {}}}) {
        EXPECT_EQ(connect(c, "if (base == null) r = color(1, 0, 0); if (base) r += 7; r += base->get(2);",
                          "shader base = null;")[0],
                  Vec3f(1, 0, 0));
        EXPECT_EQ(connect(c,
                          "normal n = base->bend(N); r = base->get(1) * Cs + arraylength(layers)"
                          " + hasmethod(base, \"get\") + getvar(base, \"tint\", r);",
                          "shader base = null; shader layers[] = {};")[0],
                  Vec3f(0, 0, 0));
    }
}

TEST(CoShader, ArraysOfShadersAreGoneThrough) {
    const Case c{{co("a", Paint), co("b", Paint)},
                 {{"layers", {"b", "a", "b"}}},
                 {{"a.tint", {1, 0, 0}, {}, false}, {"b.tint", {0, 1, 0}, {}, false}}};
    EXPECT_EQ(connect(c,
                      "uniform float i; for (i = 0; i < arraylength(layers); i += 1)"
                      " r += layers[i]->get(i + 1);",
                      "shader layers[] = {};")[9],
              Vec3f(2, 4, 0));
}

TEST(CoShader, FoundByHandleAndCategory) {
    Case c{{co("a", Paint, "texture"), co("b", Paint, "light, texture"), co("c", Paint, "light")},
           {{"name", {"b"}}},
           {{"a.tint", {1, 0, 0}, {}, false},
            {"b.tint", {0, 1, 0}, {}, false},
            {"c.tint", {0, 0, 1}, {}, false},
            {"name", {}, {"b"}, false}}};
    EXPECT_EQ(
        connect(c, "shader s = getshader(\"c\"); r = s->get(5); if (getshader(\"d\") == null) r += 1;")[0],
        Vec3f(1, 1, 6));
    EXPECT_EQ(connect(c, "r = getshader(name)->get(1);", "string name = \"\";")[0], Vec3f(0, 1, 0));
    EXPECT_EQ(connect(c, "shader all[] = getshaders(\"category\", \"texture\"); uniform float i;"
                         "for (i = 0; i < arraylength(all); i += 1) r += all[i]->get(1);")[0],
              Vec3f(1, 1, 0));
    EXPECT_EQ(connect(c, "r = arraylength(getshaders());")[0], Vec3f(3, 3, 3));
    // A handle that the run time chooses
    EXPECT_EQ(connect(c, "uniform string n = \"x\"; uniform float i; for (i = 0; i < 2; i += 1)"
                         " { shader s = getshader(n); r += s->get(1); n = \"a\"; }")[0],
              Vec3f(1, 0, 0));
}

TEST(CoShader, MembersOutputsAndQuestions) {
    const Case c{{co("a", Paint)}, {{"base", {"a"}}}, {{"a.tint", {4, 5, 6}, {}, false}}};
    const std::string p = "shader base = null;";
    EXPECT_EQ(connect(c, "color x = 0; float n = 0; r = base->get(1); base->put(x, n); r = x + n;", p)[0],
              Vec3f(15, 16, 17)); // begin() ran, then get()
    EXPECT_EQ(connect(c,
                      "color x = 0; float n = 0; float k = getvar(base, \"tint\", x) +"
                      " getvar(base, \"calls\", n) + getvar(base, \"none\", n); r = x + n + 100 * k;",
                      p)[0],
              Vec3f(214, 215, 216));
    EXPECT_EQ(connect(c, "r = base->tint * 2 + base->calls;", p)[0], Vec3f(18, 20, 22));
    EXPECT_EQ(connect(c, "r = color(hasmethod(base, \"get\"), hasmethod(base, \"got\"), 0);", p)[0],
              Vec3f(1, 0, 0));
    // Arguments by name, where the method gives them defaults
    EXPECT_EQ(connect(c,
                      "r = color(comp(base->shade(3), 0), comp(base->shade(3, \"gain\", 5), 1),"
                      " comp(base->shade(3, \"extra\", color(0, 0, 9)), 2));",
                      p)[0],
              Vec3f(6, 15, 15));
}

TEST(CoShader, PrimvarsReachTheirParameters) {
    Case c{{co("a", Paint)}, {{"base", {"a"}}}, {}};
    Argument wave;
    wave.name = "a.wave";
    wave.varying = true;
    c.arguments.push_back(wave);
    const auto r = connect(c, "r = base->get(1);", "shader base = null;");
    for (size_t i = 0; i < 54; i++)
        EXPECT_EQ(r[i], Vec3f(1, 2, 3) + Vec3f(float(i)));
}

TEST(CoShader, ChainsOfOneClass) {
    const char* layer = "class layer(shader under = null; color c = 0; float w = 0.5) {"
                        "  shader m_under = null;"
                        "  public void begin() { m_under = under; }"
                        "  public color get() { color b = 0; if (m_under != null) b = m_under->get();"
                        "    return w * c + (1 - w) * b; }"
                        "}";
    const Case c{{co("top", layer, "", {{"under", {"middle"}}}),
                  co("middle", layer, "", {{"under", {"bottom"}}}), co("bottom", layer)},
                 {{"base", {"top"}}},
                 {{"top.c", {1, 0, 0}, {}, false},
                  {"middle.c", {0, 1, 0}, {}, false},
                  {"bottom.c", {0, 0, 1}, {}, false},
                  {"bottom.w", {1}, {}, false}}};
    EXPECT_EQ(connect(c, "r = base->get();", "shader base = null;")[0], Vec3f(0.5f, 0.25f, 0.25f));
}

TEST(CoShader, CirclesAreToldAndCut) {
    const char* node = "class node(shader next = null) {"
                       "  public float get() { float x = 1; if (next != null) x += next->get(); return x; }"
                       "}";
    const Case c{
        {co("a", node, "", {{"next", {"b"}}}), co("b", node, "", {{"next", {"a"}}})}, {{"base", {"a"}}}, {}};
    std::string said;
    EXPECT_EQ(connect(c, "r = base->get();", "shader base = null;", &said)[0], Vec3f(2, 2, 2));
    EXPECT_NE(said.find("a -> b -> a"), std::string::npos) << said;
}

TEST(CoShader, BeginOfACalledOneRunsFirst) {
    const char* inner =
        "class inner() { float x = 1; public void begin() { x = 5; } public float get() { return x; } }";
    const char* outer =
        "class outer() { float y = 0; public void begin() { shader s = getshader(\"i\"); y = s->get(); }"
        " public float get() { return y; } }";
    const Case c{{co("o", outer), co("i", inner)}, {}, {}};
    EXPECT_EQ(connect(c, "r = 0; if (u > 2) r = 1; shader s = getshader(\"o\"); r = s->get();")[0],
              Vec3f(5, 5, 5));
}

TEST(CoShader, HandlesKeptInMembersAndLoops) {
    const Case c{{co("a", Paint), co("b", Paint)},
                 {},
                 {{"a.tint", {1, 0, 0}, {}, false}, {"b.tint", {0, 1, 0}, {}, false}}};
    EXPECT_EQ(connect(c, "r = m_s->get(1);", {}, nullptr,
                      "shader m_s = null; public void begin() { m_s = getshader(\"b\"); }")[0],
              Vec3f(0, 1, 0));
    // The call comes before the store that brings it its co-shader.
    EXPECT_EQ(connect(c,
                      "shader s = null; uniform float i; for (i = 0; i < 3; i += 1)"
                      " { r += s->get(1); if (i == 0) s = getshader(\"a\"); else s = getshader(\"b\"); }")[0],
              Vec3f(1, 1, 0));
}

TEST(CoShader, LightPassesThrough) {
    const char* gloss =
        "class gloss(color c = 0.25) {"
        "  public color lit(normal n; vector v) { return c * diffuse(n) + 0.5 * specular(n, v, 0.1); }"
        "}";
    Journal journal;
    CompileOptions o;
    o.use_cache = false;
    o.coshaders = {co("g", gloss), co("classic", "surface classic(float k = 3) { Oi = 1; Ci = k * Cs; }")};
    o.connections = {{"base", {"g"}}, {"old", {"classic"}}};
    const auto shader =
        compile_source("test.sl",
                       "surface s(shader base = null; shader old = null) { normal n = normalize(N);"
                       " color a = 0, o = 0; old->surface(a, o);"
                       " Ci = base->lit(n, -normalize(I)) + a * o; }",
                       o, journal);
    ASSERT_TRUE(shader) << messages(journal);
    TestServices services;
    const auto instance = shader->instantiate({}, services);
    const grid::LayeringProgram& p = instance->program();
    grid::Grid g = plane(8, 5);
    grid::VertexInputs out;
    instance->shade(g, {}, services, out);
    ASSERT_GE(slot(p, "diffuse.diffuseReflectance"), 0);
    EXPECT_EQ(value(out, slot(p, "diffuse.diffuseReflectance"), 3), Vec3f(0.25f, 0.25f, 0.25f));
    EXPECT_EQ(value(out, slot(p, "emission.radiance"), 3), Vec3f(3, 3, 3));
    EXPECT_GE(slot(p, "specular.height"), 0);
}

TEST(CoShader, WhatAShaderAsksFor) {
    const auto use = [](const char* source) { return compile(source)->coshaders(); };
    EXPECT_EQ(use("surface s() { Ci = 1; }"), CoShaderUse::None);
    EXPECT_EQ(use("surface s(shader a = null) { Ci = a->get(); }"), CoShaderUse::Connected);
    EXPECT_EQ(use("surface s() { shader a = getshader(\"x\"); Ci = a->get(); }"), CoShaderUse::Any);
    const auto s = compile("surface s(shader a = null; shader b[] = {}) { Ci = a->get() + b[0]->get(); }");
    EXPECT_EQ(s->parameters()[0].type, Type::Shader);
    EXPECT_EQ(type_name(s->parameters()[1].type), "shader");
    EXPECT_TRUE(s->parameters()[1].resizable);
}

TEST(CoShader, TheCacheKnowsWhatIsConnected) {
    const std::string folder =
        (std::filesystem::temp_directory_path() / ("kanuka_coshader_" + std::to_string(::getpid()))).string();
    std::filesystem::remove_all(folder);
    const auto run = [&](const char* tint, const char* handle, bool& cached) {
        Journal journal;
        CompileOptions o;
        o.cache_dir = folder;
        o.coshaders = {co("a", std::string("class a() { public color get() { return ") + tint + "; } }"),
                       co("b", "class b() { public color get() { return 9; } }")};
        o.connections = {{"base", {handle}}};
        const auto s =
            compile_source("test.sl", probe("r = base->get();", {}, "shader base = null;"), o, journal);
        EXPECT_TRUE(s) << messages(journal);
        cached = s->from_cache();
        grid::Grid g = plane(2, 2);
        TestServices services;
        return std::pair(run_probe(*s, g, services)[0].x, s->hash());
    };
    bool cached = false;
    const auto one = run("2", "a", cached);
    EXPECT_FALSE(cached);
    EXPECT_EQ(run("2", "a", cached), one);
    EXPECT_TRUE(cached);
    EXPECT_EQ(one.first, 2);
    const auto two = run("3", "a", cached), other = run("2", "b", cached);
    EXPECT_FALSE(cached);
    EXPECT_EQ(two.first, 3);
    EXPECT_EQ(other.first, 9);
    EXPECT_NE(two.second, one.second);
    EXPECT_NE(other.second, one.second);
    std::filesystem::remove_all(folder);
}

TEST(CoShader, MissingMethodsAreTold) {
    const Case c{{co("a", Paint)}, {{"base", {"a"}}}, {}};
    std::string said;
    EXPECT_EQ(connect(c, "r = base->grab(1);", "shader base = null;", &said)[0], Vec3f(0, 0, 0));
    EXPECT_NE(said.find("\"a\" (paint) has no public method \"grab\""), std::string::npos) << said;
    connect(c, "if (hasmethod(base, \"grab\") != 0) r = base->grab(1);", "shader base = null;", &said);
    EXPECT_EQ(said.find("grab"), std::string::npos) << said;
}

} // namespace kanuka::sl
