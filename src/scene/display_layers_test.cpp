#include "scene/display_layers.h"

#include <gtest/gtest.h>

namespace kanuka::scene {
namespace {

using Names = std::vector<std::string>;

TEST(DisplayLayers, ModesOfRISpec) {
    EXPECT_EQ(layers_of_mode("rgb"), Names{"rgb"});
    EXPECT_EQ(layers_of_mode("rgba"), (Names{"rgb", "alpha"}));
    EXPECT_EQ(layers_of_mode("rgbaz"), (Names{"rgb", "alpha", "Z"}));
    EXPECT_EQ(layers_of_mode("rgbz"), (Names{"rgb", "Z"}));
    EXPECT_EQ(layers_of_mode("a"), Names{"alpha"});
    EXPECT_EQ(layers_of_mode("az"), (Names{"alpha", "Z"}));
    EXPECT_EQ(layers_of_mode("z"), Names{"Z"});
    EXPECT_EQ(layers_of_mode(""), (Names{"rgb", "alpha"}));
}

TEST(DisplayLayers, OutputVariablesAndDeclarations) {
    EXPECT_EQ(layers_of_mode("Ci,Oi"), (Names{"rgb", "alpha"}));
    EXPECT_EQ(layers_of_mode("color tint"), Names{"tint"});
    EXPECT_EQ(layers_of_mode("varying float  stripes ,id"), (Names{"stripes", "id"}));
    EXPECT_EQ(layers_of_mode("lpe:C<RD>{1,2}[<L.'key light'>O]"), Names{"lpe:C<RD>{1,2}[<L.'key light'>O]"});
    EXPECT_EQ(layers_of_mode("color lpe:C.* "), Names{"lpe:C.*"});
    EXPECT_EQ(layers_of_mode("rgba,tint,color lpe:CL"), (Names{"rgb", "alpha", "tint", "lpe:CL"}));
    EXPECT_EQ(layers_of_mode("bag"), Names{"bag"}) << "letters, but no mode";
    EXPECT_EQ(layers_of_mode("Z,Z"), Names{"Z"});
}

TEST(DisplayLayers, StandardOnesAreNoOutputVariables) {
    for (const char* name : {"rgb", "alpha", "albedo", "N", "Z", "P", "id"})
        EXPECT_TRUE(is_standard_layer(name)) << name;
    EXPECT_FALSE(is_standard_layer("tint"));
}

} // namespace
} // namespace kanuka::scene
