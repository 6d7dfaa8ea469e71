// Members of a class on their way from displacement to surface: begin, displacement and surface run once
// each, on one set of members.
#include "sl/test_support.h"

namespace kanuka::sl {
namespace {

using namespace test;

constexpr const char* Source = R"(
class carved(float height = 0.5) {
    float depth = 0, begun = 0, untouched = 7, folded = 1;
    color tint = 0;
    string word = "begin";
    public void begin() { begun = zcomp(P) + 10; depth = -1; }
    void carve(output point P;) { depth = height * u; P += depth * vector (0, 0, 1); }
    public void displacement(output point P; output normal N) {
        carve(P);
        tint = color(depth, v, 1);
        if (u > 0.5)
            folded = 2;
        word = "displaced";
    }
    public void surface(output color Ci, Oi) {
        Oi = 1;
        Ci = diffuse(N) * (tint * 0.1 + color(0, 0, begun + untouched + folded) / 100);
    }
})";

std::vector<Vec3f> shaded(const Instance& instance, grid::Grid& g, TestServices& services, bool displace) {
    if (displace)
        instance.displace(g, {}, services);
    grid::VertexInputs out;
    instance.shade(g, {}, services, out);
    std::vector<Vec3f> r;
    const int reflectance = slot(instance.program(), "diffuse.diffuseReflectance");
    const int weight = slot(instance.program(), "diffuse.weight");
    for (int i = 0; i < g.vertices(); i++)
        r.push_back(value(out, reflectance, i) * (weight < 0 ? 1 : value(out, weight, i).x));
    return r;
}

} // namespace

TEST(SlMembers, TravelFromDisplacementToSurface) {
    for (const Config c : configs()) {
        const auto shader = compile(Source, c);
        ASSERT_TRUE(shader);
        ASSERT_EQ(shader->parameters().size(), 1u); // what travels is no parameter to the world
        TestServices services;
        const auto instance = shader->instantiate({}, services);
        EXPECT_FALSE(instance->uniform_material());
        for (const bool displace : {true, false}) {
            grid::Grid g = plane(8, 5);
            const std::vector<Vec3f> r = shaded(*instance, g, services, displace);
            for (int i = 0; i < 54; i++) {
                const float u = float(i % 9) / 8, v = float(i / 9) / 5, folded = u > 0.5f ? 2 : 1;
                const Vec3f expected(0.05f * u, 0.1f * v, 0.1f + (10 + 7 + folded) / 100);
                EXPECT_NEAR(length(r[size_t(i)] - expected), 0, 1e-5f) << i << " displaced " << displace;
                EXPECT_NEAR(g.position(i).z, displace ? 0.5f * u : 0, 1e-6f);
            }
        }
        EXPECT_TRUE(services.reports.empty());
    }
}

TEST(SlMembers, OnlyWhatTheSurfaceReadsTravels) {
    const auto shader = compile(Source);
    ASSERT_TRUE(shader);
    TestServices services;
    grid::Grid g = plane(8, 5);
    shader->instantiate({}, services)->displace(g, {}, services);
    std::vector<std::string> names;
    for (const grid::Channel& c : g.primvars)
        names.push_back(c.name);
    std::sort(names.begin(), names.end());
    const std::vector<std::string> expected = {"displaced.begun", "displaced.folded", "displaced.tint"};
    EXPECT_EQ(names, expected);
}

TEST(SlMembers, DisplacingTwiceLeavesTheLastValues) {
    const auto shader = compile(Source);
    ASSERT_TRUE(shader);
    TestServices services;
    const auto instance = shader->instantiate({}, services);
    grid::Grid g = plane(8, 5);
    instance->displace(g, {}, services);
    const size_t channels = g.primvars.size();
    const std::vector<Vec3f> r = shaded(*instance, g, services, true);
    EXPECT_EQ(g.primvars.size(), channels);
    EXPECT_NEAR(r[8].z, 0.1f + (10.5f + 7 + 2) / 100, 1e-5f); // begin saw what was displaced once
}

// Output parameters do as members do: in prelighting, and in the variable that a display asks for.
TEST(SlMembers, OutputParametersTravelToo) {
    for (const Config c : configs()) {
        CompileOptions o;
        o.lanes = c.lanes, o.opt_level = c.opt, o.use_cache = false;
        o.aovs = {"depth", "tint", "kept"};
        Journal journal;
        const auto shader = compile_source("carved.sl", R"(
class carved(float height = 0.5; output varying float depth = 3; output varying color tint = 0;
             output varying float kept = 4; output varying float seen = 0) {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "diffuse", LambertBrdf());
    }
    public void mnk_displacement(output point P; output normal N) {
        depth = depth + height * u;
        tint = color(depth, v, 1);
    }
    public void mnk_prelighting(MnkMaterialBoundary b) {
        SetLobe(b, "diffuse", 1, LambertBrdf("diffuseReflectance", tint * 0.1));
        depth = depth * 2;
    }
})",
                                           o, journal);
        ASSERT_TRUE(shader) << (journal.entries().empty() ? "" : journal.entries()[0].message);
        TestServices services;
        const auto instance = shader->instantiate({}, services);
        ASSERT_EQ(instance->aovs(), (std::vector<std::string>{"depth", "tint", "kept"}));
        for (const bool displace : {true, false}) {
            grid::Grid g = plane(8, 5);
            if (displace)
                instance->displace(g, {}, services);
            grid::VertexInputs out;
            std::vector<grid::SlotValues> aovs;
            instance->shade_with_aovs(g, {}, services, out, aovs);
            const int reflectance = slot(instance->program(), "diffuse.diffuseReflectance");
            ASSERT_EQ(aovs.size(), 3u);
            ASSERT_FALSE(aovs[0].uniform);
            ASSERT_FALSE(aovs[1].uniform);
            for (size_t i = 0; i < 54; i++) {
                const float u = float(i % 9) / 8, v = float(i / 9) / 5, depth = 3 + 0.5f * u;
                EXPECT_NEAR(aovs[0].data[i], 2 * depth, 1e-5f) << displace;
                EXPECT_NEAR(aovs[1].data[i], depth, 1e-5f);
                EXPECT_NEAR(aovs[1].data[i + size_t(out.stride)], v, 1e-5f);
                EXPECT_NEAR(value(out, reflectance, int(i)).x, 0.1f * depth, 1e-5f);
            }
            EXPECT_EQ(aovs[2].value.x, 4);
        }
        EXPECT_TRUE(services.reports.empty());
    }
}

} // namespace kanuka::sl
