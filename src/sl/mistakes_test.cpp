// Mistakes that would otherwise show in pictures alone: names of lobes, values that a lobe cannot take.
#include "sl/test_support.h"

namespace kanuka::sl::test {

namespace {

std::string material(const std::string& init, const std::string& prelighting,
                     const std::string& parameters = {}) {
    return "class m(" + parameters + R"() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material) {
        MnkMaterialBoundary b = CreateBoundary(material);
        )" +
           init + R"(
    }
    public void mnk_prelighting(MnkMaterialBoundary b) {
        )" +
           prelighting + R"(
    }
})";
}

std::string errors(const std::string& source) {
    Journal journal;
    EXPECT_FALSE(compile(source, {}, &journal)) << source;
    return messages(journal);
}

const std::string Paint =
    "AddLobe(b, \"paint\", LambertBrdf()); AddLobe(b, \"varnish\", MicrofacetDielectricBrdf());"
    "AddLayer(b, \"all\", \"coat\", \"varnish\", \"paint\");";

class Listening : public TestServices {
  public:
    struct Entry {
        std::string slot;
        float least, most;
        uint64_t count;
    };
    std::vector<Entry> ranges;
    void out_of_range(const OutOfRange& r) override {
        ranges.push_back({r.slot.name, r.least, r.most, r.count});
    }
};

} // namespace

TEST(SlMistakes, NamesOfLobesAndLayersAreChecked) {
    EXPECT_TRUE(
        compile(material(Paint, "SetLobe(b, \"paint\", u, LambertBrdf()); SetLayer(b, \"all\", v);")));
    const std::pair<std::string, std::string> cases[] = {
        {"SetLobe(b, \"pant\", 1, LambertBrdf());",
         "adds no lobe or layer \"pant\"; did you mean \"paint\"?"},
        {"SetLayer(b, \"al\", u);", "adds no lobe or layer \"al\"; did you mean \"all\"?"},
        {"SetLobe(b, \"something\", 1, LambertBrdf());",
         "adds no lobe or layer \"something\"; it adds \"paint\", \"varnish\", \"all\""},
        {"SetLobe(b, \"paint\", 1, LambertBtdf());",
         "\"paint\" is set to a LambertBtdf, but mnk_init adds it as a LambertBrdf"},
        {"SetLobe(b, \"all\", 1, LambertBrdf());", "adds it as a layer: SetLayer sets its weight"},
    };
    for (const auto& [line, expected] : cases) {
        const std::string said = errors(material(Paint, line));
        EXPECT_NE(said.find(expected), std::string::npos) << said;
        EXPECT_NE(said.find("test.sl:7:"), std::string::npos) << said;
    }
    EXPECT_NE(
        errors(material("AddLobe(b, \"a\", LambertBrdf()); AddLayer(b, \"all\", \"mix\", \"a\", \"c\");", ""))
            .find("adds no lobe or layer \"c\""),
        std::string::npos);
    EXPECT_NE(errors(material("AddLobe(b, \"a\", LambertBrdf()); AddLobe(b, \"c\", LambertBrdf());"
                              "AddLayer(b, \"all\", \"mux\", \"a\", \"c\");",
                              ""))
                  .find("there is no layer \"mux\""),
              std::string::npos);
    // Lobes that mnk_init adds under a condition are there as far as names go, of whichever type.
    EXPECT_TRUE(compile(
        material("if (kind > 0) AddLobe(b, \"a\", LambertBrdf()); else AddLobe(b, \"a\", LambertBtdf());",
                 "SetLobe(b, \"a\", 1, LambertBtdf());", "float kind = 1")));
}

TEST(SlMistakes, NamesThatOnlyTheRunTimeKnows) {
    const auto shader = compile(material("AddLobe(b, name, LambertBrdf()); AddLobe(b, \"b\", LambertBrdf());",
                                         "SetLobe(b, \"a\", u, LambertBrdf());", "string name = \"a\""));
    ASSERT_TRUE(shader);
    TestServices known, unknown;
    shader->instantiate({}, known);
    EXPECT_TRUE(known.reports.empty());
    Argument name{"name", {}, {"other"}};
    shader->instantiate({&name, 1}, unknown);
    ASSERT_EQ(unknown.reports.size(), 1u);
    EXPECT_NE(unknown.reports[0].find("mnk_prelighting sets \"a\", but mnk_init added only \"other\", \"b\""),
              std::string::npos)
        << unknown.reports[0];
}

// What lies outside of its range is kept within, at every vertex and lane, and told with what was seen.
TEST(SlMistakes, ClampedValuesAreTold) {
    for (const Config c : configs()) {
        const auto shader = compile(
            material("AddLobe(b, \"paint\", MicrofacetConductorBrdf(\"roughness\", 7));"
                     "AddLobe(b, \"fine\", LambertBrdf());",
                     "SetLobe(b, \"paint\", 1 + u, MicrofacetConductorBrdf(\"reflectance\", color(u, v - "
                     "0.3, 1)));"
                     "SetLobe(b, \"fine\", 1, LambertBrdf(\"diffuseReflectance\", color(u, 1.00001, 0)));"),
            c);
        ASSERT_TRUE(shader);
        Listening services;
        const auto instance = shader->instantiate({}, services);
        grid::Grid g = plane(8, 5);
        grid::VertexInputs out;
        instance->shade(g, {}, services, out);
        const auto at = [&](const char* name, int i) {
            return value(out, slot(instance->program(), name), i);
        };
        for (int i = 0; i < 54; i++) {
            const float u = float(i % 9) / 8, v = float(i / 9) / 5;
            EXPECT_EQ(at("paint.weight", i).x, 1);
            EXPECT_NEAR(at("paint.reflectance", i).x, u, 1e-6f);
            EXPECT_NEAR(at("paint.reflectance", i).y, std::max(0.0f, v - 0.3f), 1e-6f);
            EXPECT_EQ(at("fine.diffuseReflectance", i).y, 1); // rounding: kept, not told
        }
        EXPECT_EQ(at("paint.roughness", 0).x, 1);
        ASSERT_EQ(services.ranges.size(), 3u);
        const auto find = [&](const char* name) {
            for (const auto& e : services.ranges)
                if (e.slot == name)
                    return e;
            ADD_FAILURE() << name;
            return Listening::Entry{};
        };
        const auto weight = find("paint.weight"), reflectance = find("paint.reflectance"),
                   roughness = find("paint.roughness");
        EXPECT_EQ(weight.count, 48u); // all but those of u = 0
        EXPECT_EQ(weight.least, 1);
        EXPECT_EQ(weight.most, 2);
        EXPECT_EQ(reflectance.count, 18u); // two rows of v
        EXPECT_NEAR(reflectance.least, -0.3f, 1e-6f);
        EXPECT_EQ(roughness.count, 1u);
        EXPECT_EQ(roughness.most, 7);
    }
}

// Of a patch of a mesh its own vertices count, not those that are there as neighbours.
TEST(SlMistakes, NeighboursDoNotCount) {
    const auto shader =
        compile(material("AddLobe(b, \"a\", LambertBrdf());", "SetLobe(b, \"a\", u - 1, LambertBrdf());"));
    Listening services;
    const auto instance = shader->instantiate({}, services);
    grid::Grid g = plane(53, 0);
    auto stencils = std::make_shared<grid::Stencils>();
    stencils->own = 10;
    stencils->first.assign(55, 0);
    stencils->step_u.assign(54, 0), stencils->step_v.assign(54, 0);
    g.stencils = stencils;
    grid::VertexInputs out;
    instance->shade(g, {}, services, out);
    ASSERT_EQ(services.ranges.size(), 1u);
    EXPECT_EQ(services.ranges[0].count, 10u);
    EXPECT_NEAR(services.ranges[0].most, 9.0f / 53 - 1, 1e-6f);
}

} // namespace kanuka::sl::test
