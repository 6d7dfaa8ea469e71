// The shaders that ship: each compiles without a word, documents its parameters, and makes materials that
// hold.
#include <cmath>
#include <set>

#include "shade/shade.h"
#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

namespace fs = std::filesystem;
const fs::path Root = KANUKA_SOURCE_DIR;

std::string messages(const Journal& journal) {
    std::string all;
    for (const auto& e : journal.entries())
        all += e.where.str() + ": " + e.message + "\n";
    return all;
}

std::vector<std::string> shipped() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(Root / "shaders"))
        if (entry.path().extension() == ".sl")
            names.push_back(entry.path().stem().string());
    std::sort(names.begin(), names.end());
    return names;
}

// A unit sphere's patch of 16 x 16 cells, with everything a grid has.
grid::Grid sphere_grid() {
    grid::Grid g;
    g.allocate(16, 16);
    for (int j = 0; j <= 16; j++)
        for (int i = 0; i <= 16; i++) {
            const size_t k = size_t(j * 17 + i);
            const float u = 0.1f + 0.02f * float(i), v = 0.35f + 0.02f * float(j);
            const float phi = u * 2 * Pi, z = -std::cos(v * Pi), r = std::sin(v * Pi);
            const Vec3f p(r * std::cos(phi), r * std::sin(phi), z), du(-p.y * 2 * Pi, p.x * 2 * Pi, 0),
                dv(Pi * -z * std::cos(phi), Pi * -z * std::sin(phi), Pi * r);
            g.u[k] = g.s[k] = u, g.v[k] = g.t[k] = v;
            for (int c = 0; c < 3; c++) {
                const size_t at = size_t(c) * size_t(g.stride) + k;
                g.P[at] = g.N[at] = g.Ng[at] = p[c];
                g.dPdu[at] = du[c], g.dPdv[at] = dv[c];
            }
        }
    return g;
}

struct Shaders : testing::Test {
    scene::Scene scene;
    Journal journal;
    Stats stats;
    test::TemporaryFolder cache;
    std::unique_ptr<ShadingSystem> system;

    Shaders() {
        ShadingOptions options;
        options.standard_shaders = (Root / "shaders").string();
        options.texture_path = {(Root / "scenes/textures").string()};
        options.cache_dir = cache.str();
        system = ShadingSystem::create(options, scene, journal, stats);
    }
    std::shared_ptr<const Material> surface(const std::string& name, std::vector<scene::Value> values = {},
                                            Rgb color = Rgb(1)) {
        scene::Attributes a;
        a.color = color;
        a.surface.emplace();
        a.surface->name = name;
        a.surface->where = {"scene.rib", 1, 1};
        a.surface->parameters.values = std::move(values);
        scene::Primitive p;
        p.attributes = std::make_shared<scene::Attributes>(a);
        return system->material(p, {}, {});
    }
    static const grid::LayerNode* find(const grid::LayeringProgram& program, grid::LobeId lobe) {
        for (const auto& n : program.nodes)
            if (n.op == grid::LayerOp::Lobe && n.lobe == lobe)
                return &n;
        return nullptr;
    }
    static float at(const grid::VertexInputs& in, int slot, int vertex, int component = 0) {
        const grid::SlotValues& s = in.slots[size_t(slot)];
        return s.uniform ? s.value[component] : s.data[size_t(component * in.stride + vertex)];
    }
};

TEST_F(Shaders, EachCompilesSilentlyUnderItsOwnNameWithDocumentedParameters) {
    sl::CompileOptions options;
    options.cache_dir = cache.str();
    const std::set<std::string> standard = {
        "null",         "constant",        "matte",        "metal",        "shinymetal",
        "plastic",      "paintedplastic",  "ambientlight", "distantlight", "pointlight",
        "spotlight",    "depthcue",        "fog",          "bumpy",        "background",
        "clamptoalpha", "paintedconstant", "paintedmatte"};
    const auto names = shipped();
    for (const std::string& name : standard)
        EXPECT_TRUE(std::count(names.begin(), names.end(), name)) << name;
    for (const std::string& name : names) {
        const auto shader = sl::compile_file((Root / "shaders" / (name + ".sl")).string(), options, journal);
        ASSERT_TRUE(shader) << name << "\n" << messages(journal);
        EXPECT_EQ(shader->name(), name);
        for (const sl::Parameter& p : shader->parameters())
            EXPECT_FALSE(p.doc.empty()) << name << "." << p.name;
    }
    EXPECT_EQ(messages(journal), "");
}

TEST_F(Shaders, ClampToAlphaLimitsEachComponent) {
    float r[] = {2, 0.25f}, g[] = {0.1f, 0.5f}, b[] = {0.5f, 3}, alpha[] = {0.5f, 1};
    scene::ShaderRef ref;
    ref.name = "clamptoalpha";
    system->image(ref, {2, 1, 0, 0, 2, 1, r, g, b, alpha});
    EXPECT_EQ(Vec3f(r[0], g[0], b[0]), Vec3f(0.5f, 0.1f, 0.5f));
    EXPECT_EQ(Vec3f(r[1], g[1], b[1]), Vec3f(0.25f, 0.5f, 1));
    EXPECT_EQ(messages(journal), "");
}

TEST_F(Shaders, EachSurfaceStaysWithinItsLobesRanges) {
    sl::CompileOptions options;
    options.cache_dir = cache.str();
    for (const std::string& name : shipped()) {
        const auto shader = sl::compile_file((Root / "shaders" / (name + ".sl")).string(), options, journal);
        ASSERT_TRUE(shader) << name;
        if (shader->kind() != sl::ShaderKind::Class && shader->kind() != sl::ShaderKind::Surface)
            continue;
        const auto material = surface(name);
        grid::Grid g = sphere_grid();
        if (material->displaces())
            material->displace(g);
        for (int i = 0; i < g.vertices(); i++) {
            EXPECT_TRUE(std::isfinite(length(g.position(i)))) << name;
            EXPECT_GT(length(g.normal(i)), 0) << name;
        }
        grid::VertexInputs out;
        material->shade(g, out);
        const grid::LayeringProgram& program = material->program();
        ASSERT_EQ(out.slots.size(), program.slots.size()) << name;
        for (size_t s = 0; s < out.slots.size(); s++)
            for (int i = 0; i < g.vertices(); i += 7)
                for (int c = 0; c < grid::components_of(program.slots[s].type); c++) {
                    const float value = at(out, int(s), i, c);
                    EXPECT_GE(value, program.slots[s].low) << name << " " << program.slots[s].name;
                    EXPECT_LE(value, program.slots[s].high) << name << " " << program.slots[s].name;
                }
    }
    EXPECT_EQ(messages(journal), "");
}

TEST_F(Shaders, MatteReflectsItsColor) {
    const auto m = surface("matte", {}, {0.2f, 0.4f, 0.6f});
    EXPECT_TRUE(m->uniform());
    const grid::LayerNode* leaf = find(m->program(), grid::LobeId::LambertBrdf);
    ASSERT_TRUE(leaf);
    grid::Grid g = sphere_grid();
    grid::VertexInputs out;
    m->shade(g, out);
    for (int c = 0; c < 3; c++) {
        const float weight = leaf->weight < 0 ? 1 : at(out, leaf->weight, 5);
        EXPECT_NEAR(weight * at(out, leaf->inputs[0], 5, c), 0.2f * float(c + 1), 1e-5f);
    }
}

TEST_F(Shaders, GlassHasAnInterior) {
    const auto m = surface("glass", {test::value("ior", scene::Type::Float, {1.75f}),
                                     test::value("absorption", scene::Type::Color, {1, 2, 3})});
    const grid::LayeringProgram& p = m->program();
    ASSERT_TRUE(p.interior);
    EXPECT_FLOAT_EQ(p.interior->ior, 1.75f);
    EXPECT_EQ(p.interior->absorption, Rgb(1, 2, 3));
    EXPECT_TRUE(find(p, grid::LobeId::MicrosurfaceDielectricBsdfRgb_v1));
    EXPECT_TRUE(m->uniform());
}

TEST_F(Shaders, LacquerLaysACoatOverItsBase) {
    const grid::LayeringProgram& p = surface("lacquer")->program();
    const grid::LayerNode& root = p.nodes.back();
    ASSERT_EQ(root.op, grid::LayerOp::Thick);
    EXPECT_EQ(p.nodes[size_t(root.upper)].lobe, grid::LobeId::MicrofacetDielectricBrdf);
    EXPECT_EQ(p.nodes[size_t(root.lower)].op, grid::LayerOp::Mix);
}

TEST_F(Shaders, CarvedGoesInwardsNoDeeperThanItsGrooves) {
    const auto m = surface("carved", {test::value("depth", scene::Type::Float, {0.1f}),
                                      test::value("grain", scene::Type::Float, {0})});
    ASSERT_TRUE(m->displaces());
    grid::Grid g = sphere_grid();
    m->displace(g);
    float least = 2, most = 0;
    for (int i = 0; i < g.vertices(); i++) {
        least = std::min(least, length(g.position(i)));
        most = std::max(most, length(g.position(i)));
    }
    EXPECT_NEAR(most, 1, 0.02f);
    EXPECT_LT(least, 0.95f);
    EXPECT_GE(least, 0.9f - 1e-4f);
}

TEST_F(Shaders, TilesReadTheirTextureAndBendNormalsAtJoints) {
    const auto m = surface("tiles", {test::text("texturename", "terrazzo.png"),
                                     test::value("size", scene::Type::Float, {0.25f})});
    grid::Grid g = sphere_grid();
    const grid::Grid before = g;
    m->displace(g);
    EXPECT_EQ(g.P, before.P);
    EXPECT_NE(g.N, before.N);
    grid::VertexInputs out;
    m->shade(g, out);
    const int slot = find(m->program(), grid::LobeId::LambertBrdf)->inputs[0];
    std::set<float> values;
    for (int i = 0; i < g.vertices(); i++)
        values.insert(at(out, slot, i));
    EXPECT_GT(values.size(), 50u);
    EXPECT_EQ(messages(journal), "");
    EXPECT_GT(system->texture_bytes(), 0u);
}

TEST_F(Shaders, BumpyReadsHeights) {
    scene::Attributes a;
    a.displacement.emplace();
    a.displacement->name = "bumpy";
    a.displacement->parameters.values = {test::text("texturename", "terrazzo.png"),
                                         test::value("Km", scene::Type::Float, {0.1f})};
    scene::Primitive p;
    p.attributes = std::make_shared<scene::Attributes>(a);
    const auto m = system->material(p, {}, {});
    ASSERT_TRUE(m->displaces());
    grid::Grid g = sphere_grid();
    m->displace(g);
    for (int i = 0; i < g.vertices(); i++) {
        EXPECT_GE(length(g.position(i)), 0.999f);
        EXPECT_LE(length(g.position(i)), 1.101f);
    }
    EXPECT_GT(length(g.position(40)), 1.001f);
}

} // namespace
} // namespace kanuka::shade
