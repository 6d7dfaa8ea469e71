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

} // namespace kanuka::sl
