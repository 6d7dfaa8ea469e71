#include "shade/system.h"

#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

using scene::Detail;
using test::FakeShader;
using test::value;

struct System : testing::Test {
    test::TemporaryFolder folder;
    scene::Scene scene;
    Journal journal;
    ShadingOptions options;
    std::map<std::string, std::shared_ptr<FakeShader>> shaders; // by file stem
    std::unique_ptr<ShadingSystem> system;

    System() {
        scene.file = folder.str() + "/scene.rib";
        add("wood", sl::ShaderKind::Surface, {test::parameter("Kd", sl::Type::Float)});
        add("dents", sl::ShaderKind::Displacement, {});
        add("lacquer", sl::ShaderKind::Class, {});
        options.render_from_world = Transform::translate(0, 0, 100);
        folder.write("broken.sl", "surface broken(");
    }
    void add(const std::string& name, sl::ShaderKind kind, std::vector<sl::Parameter> parameters) {
        folder.write(name + ".sl", "");
        shaders[name] = std::make_shared<FakeShader>(name, kind, std::move(parameters));
    }
    ShadingSystem& make() {
        system = make_shading_system(options, scene, journal,
                                     [this](const std::string& path, const sl::CompileOptions&,
                                            Journal&) -> std::shared_ptr<const sl::Shader> {
                                         const auto found =
                                             shaders.find(std::filesystem::path(path).stem().string());
                                         return found == shaders.end() ? nullptr : found->second;
                                     });
        return *system;
    }
    static scene::Primitive primitive(scene::Attributes attributes = {}) {
        scene::Primitive p;
        p.attributes = std::make_shared<scene::Attributes>(std::move(attributes));
        p.where = {"scene.rib", 20, 1};
        return p;
    }
    static scene::ShaderRef ref(const std::string& name) {
        scene::ShaderRef r;
        r.name = name;
        r.where = {"scene.rib", 10, 1};
        return r;
    }
    std::shared_ptr<const Material> material(const scene::Primitive& p) {
        return system->material(p, options.render_from_world * p.world_from_object,
                                options.render_from_world);
    }
    static grid::Grid grid() {
        grid::Grid g;
        g.allocate(2, 4);
        for (int j = 0; j <= 4; j++)
            for (int i = 0; i <= 2; i++)
                g.u[size_t(j * 3 + i)] = float(i) * 0.25f, g.v[size_t(j * 3 + i)] = float(j) * 0.1f;
        return g;
    }
    std::string messages() {
        std::string all;
        for (const auto& e : journal.entries())
            all += e.where.str() + ": " + e.message + "\n";
        return all;
    }
};

TEST_F(System, WithoutAShaderItIsMatteOfTheAttributesColor) {
    make();
    scene::Attributes a;
    a.color = {0.2f, 0.4f, 0.6f};
    const auto m = material(primitive(a));
    ASSERT_EQ(m->program().nodes.size(), 1u);
    EXPECT_EQ(m->program().nodes[0].lobe, grid::LobeId::LambertBrdf);
    EXPECT_EQ(m->program().presence, -1);
    EXPECT_TRUE(m->uniform());
    EXPECT_FALSE(m->displaces());
    grid::Grid g = grid();
    grid::VertexInputs out;
    m->shade(g, out);
    EXPECT_TRUE(out.slots[0].uniform);
    EXPECT_EQ(out.slots[0].value, Vec3f(0.2f, 0.4f, 0.6f));
    EXPECT_EQ(messages(), "");
}

TEST_F(System, MatteTakesVaryingColorsAndOpacities) {
    make();
    scene::Primitive p = primitive();
    p.primvars.set(value("Cs", scene::Type::Color, std::vector<float>(12, 0.5f), Detail::Vertex));
    p.primvars.set(value("Os", scene::Type::Color, {0.25f, 0.5f, 0.75f}, Detail::Constant));
    const auto m = material(p);
    EXPECT_FALSE(m->uniform());
    ASSERT_EQ(m->program().presence, 1);
    grid::Grid g = grid();
    grid::Channel cs{"Cs", 3, g.stride, std::vector<float>(size_t(g.stride) * 3)};
    cs.component(1)[4] = 0.7f;
    g.primvars.push_back(cs);
    grid::VertexInputs out;
    m->shade(g, out);
    EXPECT_FALSE(out.slots[0].uniform);
    EXPECT_EQ(out.slots[0].data[size_t(g.stride) + 4], 0.7f);
    EXPECT_NEAR(out.slots[1].value.x, 0.5f, 1e-6f);
}

// Compiled shaders of other renderers are called NAME.slo, too: the source beside them serves.
TEST_F(System, CompiledShadersOfOtherRenderersArePassedOver) {
    folder.write("wood.slo", "slc 3Delight\n\x01\x02\x03");
    folder.write("gone.slo", std::string("\x7f"
                                         "ELF\x02\x01\x01",
                                         7));
    make();
    for (int i = 0; i < 3; i++) {
        scene::Attributes a;
        a.surface = ref("wood");
        a.color = Rgb(0.1f * float(i));
        material(primitive(a));
    }
    EXPECT_EQ(shaders["wood"]->instances > 0, true);
    ASSERT_EQ(journal.entries().size(), 1u) << messages();
    EXPECT_EQ(journal.entries()[0].severity, Severity::Info);
    EXPECT_EQ(journal.entries()[0].count, 1u);
    EXPECT_NE(messages().find("wood.slo: was compiled by another renderer and is passed over"),
              std::string::npos);
    scene::Attributes a;
    a.surface = ref("gone");
    material(primitive(a));
    EXPECT_NE(messages().find("There is " + folder.str() + "/gone.slo, which another renderer compiled"),
              std::string::npos)
        << messages();
}

TEST_F(System, AMissingShaderIsSaidOnceWithACount) {
    for (const int line : {7, 5, 9}) {
        scene::Attributes a;
        a.surface = ref("nowhere");
        a.surface->where.line = line;
        scene.primitives.push_back(primitive(a));
    }
    make();
    for (size_t k : {2u, 0u, 1u})
        material(scene.primitives[k]);
    ASSERT_EQ(journal.entries().size(), 1u) << messages();
    EXPECT_EQ(journal.entries()[0].count, 3u);
    EXPECT_EQ(journal.entries()[0].where.line, 7)
        << "the first that the scene holds, not the first that was asked";
}

TEST_F(System, MissingBrokenAndMisplacedShadersBecomeMatte) {
    make();
    for (const char* name : {"nowhere", "broken", "dents"}) {
        scene::Attributes a;
        a.surface = ref(name);
        a.displacement = ref("nowhere");
        const auto m = material(primitive(a));
        EXPECT_EQ(m->program().nodes[0].name, "diffuse") << name;
        EXPECT_FALSE(m->displaces());
        material(primitive(a)); // not reported again
    }
    const std::string all = messages();
    EXPECT_EQ(journal.entries().size(), 4u) << all;
    EXPECT_NE(
        all.find(
            "scene.rib:10:1: shader \"nowhere\" is not found (nowhere.slo or nowhere.sl); searched in \"" +
            folder.str() + "\""),
        std::string::npos);
    EXPECT_NE(all.find("Matte stands in"), std::string::npos);
    EXPECT_NE(all.find("\"broken\" (" + folder.str() + "/broken.sl) does not compile"), std::string::npos);
    EXPECT_NE(all.find("is a displacement shader, where a surface shader is called for"), std::string::npos);
    EXPECT_NE(all.find("The surface is not displaced"), std::string::npos);
}

TEST_F(System, EqualMaterialsAreShared) {
    make();
    scene::Attributes a;
    a.surface = ref("wood");
    scene::Primitive one = primitive(a), two = primitive(a), moved = primitive(a), tinted = primitive(a);
    moved.world_from_object = Transform::translate(1, 0, 0);
    tinted.primvars.set(value("Kd", scene::Type::Float, {0.5f}, Detail::Constant));
    const auto m = material(one);
    EXPECT_EQ(m, material(two));
    EXPECT_NE(m, material(moved));
    EXPECT_EQ(m->hash(), material(moved)->hash()) << "where it stands is told apart by what shaders read";
    EXPECT_EQ(shaders["wood"]->instances, 1) << "but the instance serves both";
    EXPECT_NE(m->hash(), material(tinted)->hash());
    EXPECT_EQ(shaders["wood"]->instances, 2);
    EXPECT_EQ(shaders["wood"]->last_arguments.at(0).floats[0], 0.5f);
}

TEST_F(System, AnInitThatDependsOnObjectSpaceIsRunForEachPrimitive) {
    shaders["wood"]->init_asks_for = "object";
    make();
    scene::Attributes a;
    a.surface = ref("wood");
    scene::Primitive one = primitive(a), moved = primitive(a);
    moved.world_from_object = Transform::translate(1, 0, 0);
    material(one);
    material(moved);
    EXPECT_EQ(shaders["wood"]->instances, 2);
}

TEST_F(System, AreaLightsAddEmissionToTheirSurface) {
    make();
    scene::Attributes a;
    a.surface = ref("wood");
    a.area_light = ref("arealight");
    a.area_light->parameters.set(value("intensity", scene::Type::Float, {3}));
    a.area_light->parameters.set(value("lightcolor", scene::Type::Color, {1, 2, 4}));
    const auto m = material(primitive(a));
    const grid::LayeringProgram& p = m->program();
    EXPECT_TRUE(p.emits());
    ASSERT_EQ(p.nodes.size(), 3u);
    EXPECT_EQ(p.nodes[2].op, grid::LayerOp::Add);
    EXPECT_EQ(p.nodes[size_t(p.nodes[2].upper)].lobe, grid::LobeId::DiffuseEmission);
    EXPECT_EQ(p.nodes[size_t(p.nodes[2].lower)].lobe, grid::LobeId::LambertBrdf);
    grid::Grid g = grid();
    grid::VertexInputs out;
    m->shade(g, out);
    ASSERT_EQ(out.slots.size(), 2u);
    EXPECT_TRUE(out.slots[1].uniform);
    EXPECT_EQ(out.slots[1].value, Vec3f(3, 6, 12));
    EXPECT_EQ(messages(), "");
}

TEST_F(System, OpacityOfClassSurfacesIsPresence) {
    make();
    scene::Attributes a;
    a.surface = ref("lacquer");
    EXPECT_EQ(material(primitive(a))->program().presence, -1);
    a.opacity = {0.5f, 0.5f, 0.5f};
    const auto m = material(primitive(a));
    ASSERT_EQ(m->program().presence, 1);
    grid::Grid g = grid();
    grid::VertexInputs out;
    m->shade(g, out);
    EXPECT_EQ(out.slots[1].value.x, 0.5f);
    a.surface = ref("wood");
    EXPECT_EQ(material(primitive(a))->program().presence, -1) << "classic surfaces say so themselves, by Oi";
}

TEST_F(System, ShadersSeeTheirSpacesAndSteps) {
    options.camera_from_render = Transform::translate(0, 0, -90);
    make();
    scene::Attributes a;
    a.surface = ref("wood");
    a.surface->world_from_shader = Transform::translate(0, 5, 0);
    a.displacement = ref("dents");
    a.displacement->world_from_shader = Transform::translate(7, 0, 0);
    const auto m = material(primitive(a));
    EXPECT_TRUE(m->displaces());
    grid::Grid g = grid();
    grid::VertexInputs out;
    m->displace(g);
    EXPECT_EQ(g.position(3).z, 1);
    EXPECT_EQ(shaders["dents"]->last_shader_to_current[3], 7);
    EXPECT_EQ(shaders["dents"]->last_shader_to_current[11], 100);
    m->shade(g, out);
    const FakeShader& wood = *shaders["wood"];
    EXPECT_EQ(wood.last_shader_to_current[7], 5);
    EXPECT_NEAR(wood.last_globals.du, 0.25f, 1e-6f);
    EXPECT_NEAR(wood.last_globals.dv, 0.1f, 1e-6f);
    EXPECT_EQ(wood.last_globals.E, Vec3f(0, 0, 90));
}

TEST_F(System, GroupPrimitivesAreShadedInGroupSpace) {
    make();
    scene::Attributes a;
    a.surface = ref("wood");
    a.surface->world_from_shader = Transform::translate(0, 5, 0);
    scene::Primitive p = primitive(a);
    p.world_from_object = Transform::translate(3, 0, 0);
    const auto m = system->material(p, p.world_from_object, {});
    grid::Grid g = grid();
    grid::VertexInputs out;
    m->shade(g, out);
    EXPECT_EQ(shaders["wood"]->last_shader_to_current[7], 5);
    EXPECT_EQ(shaders["wood"]->last_shader_to_current[11], 0) << "no offset of render space in a group";
}

TEST_F(System, ATexturesContentIsPartOfTheHash) {
    add("tiled", sl::ShaderKind::Surface, {test::parameter("map", sl::Type::String)});
    folder.write("map.png", "one");
    scene::Attributes a;
    a.surface = ref("tiled");
    a.surface->parameters.set(test::text("map", "map.png"));
    make();
    const uint64_t before = material(primitive(a))->hash();
    folder.write("map.png", "another");
    make();
    EXPECT_NE(before, material(primitive(a))->hash());
}

TEST_F(System, SingularTransformsDoNotThrow) {
    make();
    scene::Attributes a;
    a.surface = ref("wood");
    scene::Primitive p = primitive(a);
    p.world_from_object = Transform::scale(1, 0, 1);
    const auto m = material(p);
    grid::Grid g = grid();
    grid::VertexInputs out;
    m->shade(g, out);
    EXPECT_EQ(out.slots.size(), 1u);
}

} // namespace
} // namespace kanuka::shade
