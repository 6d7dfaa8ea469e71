#include "color/materials.h"

#include <gtest/gtest.h>

#include "color/spectrum.h"

namespace kanuka::color {

TEST(Materials, GlassesHaveTheirCataloguesIndices) {
    struct Known {
        const char* name;
        double n_d, abbe;
    };
    // n_d and V of the sources: SCHOTT's catalogue; Malitson 1965; Peter 1923.
    for (const Known& k :
         {Known{"BK7", 1.5168, 64.17}, Known{"F2", 1.62004, 36.37}, Known{"SF11", 1.78472, 25.76},
          Known{"silica", 1.45846, 67.82}, Known{"diamond", 2.4175, 55.3}, Known{"fluorite", 1.43385, 95.0},
          Known{"water", 1.3334, 55.7}, Known{"sapphire", 1.7682, 72.2}}) {
        const auto g = find_glass(k.name);
        ASSERT_TRUE(g) << k.name;
        EXPECT_NEAR(g->eta(LineD), k.n_d, 3e-4) << k.name;
        EXPECT_NEAR(abbe_number(*g), k.abbe, 0.01 * k.abbe) << k.name;
    }
    EXPECT_FALSE(find_glass("jelly"));
    EXPECT_EQ(glass_names().size(), 8u);
    const Table t = find_glass("BK7")->table();
    for (int i = 1; i < LambdaCount; i++)
        EXPECT_LT(t[i], t[i - 1]); // normal dispersion
}

TEST(Materials, AbbeGivesBack) {
    for (const double v : {20.0, 36.4, 64.0}) {
        EXPECT_NEAR(abbe_eta(1.6, v, LineD), 1.6, 1e-12);
        EXPECT_NEAR((abbe_eta(1.6, v, LineD) - 1) / (abbe_eta(1.6, v, LineF) - abbe_eta(1.6, v, LineC)), v,
                    1e-9);
    }
    EXPECT_EQ(abbe_eta(1.5, 0, 400), 1.5);
    EXPECT_EQ(abbe_eta(1.01, 0.1, 780), 1.0) << "light is nowhere faster than in vacuum";
    // Against a catalogue: within 2e-3 of Sellmeier over the visible range.
    const auto bk7 = find_glass("BK7");
    for (double l = 400; l <= 700; l += 25)
        EXPECT_NEAR(abbe_eta(1.5168, 64.17, l), bk7->eta(l), 2e-3) << l;
}

TEST(Materials, MetalsReflectAsMetalsDo) {
    // Johnson and Christy's own table: Ag at 548.6 nm.
    const auto silver = find_metal("Ag");
    ASSERT_TRUE(silver);
    EXPECT_NEAR(silver->at(548.6).eta, 0.06, 2e-3);
    EXPECT_NEAR(silver->at(548.6).k, 3.586, 5e-3);
    EXPECT_NEAR(normal_reflectance(silver->at(550)), 0.98, 0.01);
    const auto gold = find_metal("gold");
    ASSERT_TRUE(gold);
    EXPECT_LT(normal_reflectance(gold->at(450)), 0.45);
    EXPECT_GT(normal_reflectance(gold->at(650)), 0.95);
    EXPECT_EQ(metal_names(),
              (std::vector<std::string>{"Ag", "Al", "Au", "Cr", "Cu", "Fe", "Ni", "Pt", "Ti"}));
    for (const std::string& name : metal_names()) {
        const auto m = find_metal(name);
        for (int i = 0; i < LambdaCount; i++) {
            const double r = normal_reflectance(m->at(LambdaMin + i));
            EXPECT_GT(r, 0.2) << name;
            EXPECT_LT(r, 1) << name;
        }
    }
    EXPECT_FALSE(find_metal("mithril"));
    EXPECT_NEAR(normal_reflectance({1.5, 0}), 0.04, 1e-12);
}

} // namespace kanuka::color
