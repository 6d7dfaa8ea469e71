// Co-shaders of the scene: found, connected, bound; what is wrong is told and the rest goes on.
#include "shade/shade.h"
#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

constexpr const char* Layered = R"(class layered(shader layers[] = {}; shader under = null) {
    public void surface(output color Ci, Oi) {
        uniform float i;
        color c = 0;
        for (i = 0; i < arraylength(layers); i += 1)
            c += layers[i]->get();
        if (under != null)
            c += under->get();
        Ci = c * diffuse(N);
    }
})";
constexpr const char* Tint =
    R"(class tint(color c = 0.125; varying float wave = 0; shader next = null; string __category = "a") {
    public color get() {
        color r = c + wave;
        if (next != null)
            r += next->get();
        return r;
    }
})";
constexpr const char* ByName = R"(surface byname(string layer = "one") {
    shader s = getshader(layer);
    color c = s->get();
    shader all[] = getshaders("category", "b");
    Ci = (c + arraylength(all)) * diffuse(N);
})";

struct CoShaders : testing::Test {
    test::TemporaryFolder folder;
    scene::Scene scene;
    scene::Attributes attributes;
    scene::Primitive primitive;
    Journal journal;
    Stats stats;
    std::unique_ptr<ShadingSystem> system;

    CoShaders() {
        scene.file = folder.str() + "/scene.rib";
        folder.write("layered.sl", Layered);
        folder.write("tint.sl", Tint);
        folder.write("byname.sl", ByName);
        folder.write("broken.sl", "class broken(");
        ShadingOptions options;
        options.cache_dir = folder.str() + "/cache";
        system = ShadingSystem::create(options, scene, journal, stats);
    }
    static scene::ShaderRef ref(const std::string& name, const std::string& handle = {},
                                std::vector<scene::Value> values = {}) {
        scene::ShaderRef r;
        r.name = name;
        r.handle = handle;
        r.parameters.values = std::move(values);
        r.where = {"scene.rib", 7, 1};
        return r;
    }
    static scene::Value texts(const std::string& name, std::vector<std::string> strings) {
        scene::Value v = test::text(name, "");
        v.array_size = int(strings.size());
        v.strings = std::move(strings);
        return v;
    }
    static scene::Value color(float r, float g, float b) {
        return test::value("c", scene::Type::Color, {r, g, b});
    }
    // The diffuse reflectance at a vertex.
    Vec3f shade(size_t vertex = 0) {
        primitive.attributes = std::make_shared<scene::Attributes>(attributes);
        const auto material = system->material(primitive, {}, {});
        grid::Grid g;
        g.allocate(2, 2);
        for (size_t i = 0; i < 9; i++) {
            g.u[i] = g.s[i] = float(i % 3) / 2;
            g.v[i] = g.t[i] = float(i / 3) / 2;
            g.P[i] = g.u[i];
            g.P[size_t(g.stride) + i] = g.v[i];
            g.N[2 * size_t(g.stride) + i] = g.Ng[2 * size_t(g.stride) + i] = 1;
        }
        grid::Channel wave{"wave", 1, g.stride, std::vector<float>(size_t(g.stride) + 32, 0.0f)};
        for (size_t i = 0; i < 9; i++)
            wave.data[i] = float(i) / 64;
        g.primvars.push_back(std::move(wave));
        grid::VertexInputs out;
        material->shade(g, out);
        const grid::LayeringProgram& p = material->program();
        for (size_t s = 0; s < p.slots.size(); s++)
            if (p.slots[s].name == "diffuse.diffuseReflectance") {
                const grid::SlotValues& v = out.slots[s];
                const size_t n = size_t(g.stride);
                return v.uniform ? v.value
                                 : Vec3f(v.data[vertex], v.data[n + vertex], v.data[2 * n + vertex]);
            }
        return {-1, -1, -1};
    }
    std::string said() const {
        std::string all;
        for (const auto& e : journal.entries())
            all += e.where.str() + ": " + e.message + "\n";
        return all;
    }
};

} // namespace

TEST_F(CoShaders, HandlesConnectThem) {
    attributes.coshaders = {ref("tint", "red", {color(0.5f, 0, 0)}),
                            ref("tint", "green", {color(0, 0.25f, 0)}),
                            ref("tint", "blue", {color(0, 0, 0.5f), test::text("next", "green")})};
    attributes.surface = ref("layered", "", {texts("layers", {"red", "green"}), test::text("under", "blue")});
    EXPECT_EQ(shade(), Vec3f(0.5f, 0.5f, 0.5f));
    // Other values are data; another connection is another program.
    attributes.coshaders[0].parameters.values = {color(0.25f, 0, 0)};
    EXPECT_EQ(shade(), Vec3f(0.25f, 0.5f, 0.5f));
    attributes.surface->parameters.values[0] = texts("layers", {"green"});
    EXPECT_EQ(shade(), Vec3f(0, 0.5f, 0.5f));
    EXPECT_EQ(said(), "");
}

TEST_F(CoShaders, FoundByNameAndCategory) {
    attributes.coshaders = {ref("tint", "one", {color(0.25f, 0, 0)}),
                            ref("tint", "two", {color(0, 0.25f, 0)})};
    attributes.surface = ref("byname", "", {test::text("layer", "two")});
    EXPECT_EQ(shade(), Vec3f(0, 0.25f, 0));
    attributes.surface = ref("byname");
    EXPECT_EQ(shade(), Vec3f(0.25f, 0, 0));
    attributes.coshaders[1].parameters.values.push_back(test::text("__category", "x, b"));
    EXPECT_EQ(shade(), Vec3f(1, 1, 1)); // one of category b: 1.25, held within 1
}

TEST_F(CoShaders, PrimvarsSetTheirParameters) {
    attributes.coshaders = {ref("tint", "red", {color(0.25f, 0, 0)})};
    attributes.surface = ref("layered", "", {test::text("under", "red")});
    scene::Value wave =
        test::value("wave", scene::Type::Float, std::vector<float>(9), scene::Detail::Varying);
    primitive.primvars.values = {wave};
    EXPECT_EQ(shade(8), Vec3f(0.25f + 0.125f, 0.125f, 0.125f));
    EXPECT_EQ(said(), "");
}

TEST_F(CoShaders, OnesOfTheirOwn) {
    // As Python makes them: each brings what it is connected to.
    scene::ShaderRef blue = ref("tint", "next", {color(0, 0, 0.5f)});
    scene::ShaderRef red = ref("tint", "under", {color(0.5f, 0, 0), test::text("next", "next")});
    red.coshaders = {blue};
    attributes.surface = ref("layered", "", {test::text("under", "under")});
    attributes.surface->coshaders = {red};
    EXPECT_EQ(shade(), Vec3f(0.5f, 0, 0.5f));
    EXPECT_EQ(said(), "");
}

TEST_F(CoShaders, WhatIsNotThereIsToldAndNull) {
    attributes.coshaders = {ref("tint", "red", {color(0.5f, 0, 0)}), ref("broken", "bad"),
                            ref("gone", "lost")};
    attributes.surface = ref("layered", "", {texts("layers", {"red", "missing", "bad", "lost"})});
    EXPECT_EQ(shade(), Vec3f(0.5f, 0, 0));
    EXPECT_NE(said().find("names co-shader \"missing\", which is not declared here; there is red, bad, lost"),
              std::string::npos)
        << said();
    EXPECT_NE(said().find("\"broken\""), std::string::npos);
    EXPECT_NE(said().find("shader \"gone\" is not found"), std::string::npos);
}

TEST_F(CoShaders, CirclesAreCut) {
    attributes.coshaders = {ref("tint", "A", {color(0.5f, 0, 0), test::text("next", "B")}),
                            ref("tint", "B", {color(0, 0.25f, 0), test::text("next", "A")})};
    attributes.surface = ref("layered", "", {test::text("under", "A")});
    EXPECT_EQ(shade(), Vec3f(0.5f, 0.25f, 0));
    EXPECT_NE(said().find("scene.rib:7:1: co-shaders are connected in a circle: A -> B -> A"),
              std::string::npos)
        << said();
}

TEST_F(CoShaders, LightsHaveTheirs) {
    folder.write("lamp.sl", "light lamp(shader filter = null) { illuminate(point(0, 0, 2))"
                            " { Cl = 1 / (L . L); if (filter != null) Cl *= filter->get(); } }");
    scene::ShaderRef lamp = ref("lamp", "l", {test::text("filter", "gel")});
    lamp.coshaders = {ref("tint", "gel", {color(0.5f, 0.25f, 0)})};
    const auto lights = system->lights({lamp}, Bounds3f{{-1, -1, 0}, {1, 1, 0}});
    ASSERT_EQ(lights.size(), 1u) << said();
    EXPECT_NEAR(lights[0].amount.x, 2 * lights[0].amount.y, 1e-4f);
    EXPECT_NEAR(lights[0].amount.z, 0, 1e-3f);
    EXPECT_EQ(said(), "");
}

} // namespace kanuka::shade
