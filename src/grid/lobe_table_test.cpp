// Names of inputs, which are looked up while compiling, against the table as it is while running.
#include "grid/lobe_table.h"

#include <gtest/gtest.h>

namespace kanuka::grid {
namespace {

// Where an input stands among those of its type, counted from the end.
int place_among(LobeId id, std::string_view name) {
    const std::span<const LobeInput> inputs = lobe(id).inputs;
    int all = 0, after = 0;
    bool found = false;
    const size_t at = size_t(find_input(lobe(id), name));
    for (const LobeInput& input : inputs) {
        const bool same = input.type == inputs[at].type;
        all += same;
        after += found && same;
        found |= input.name == name;
    }
    return all - 1 - after;
}

} // namespace

TEST(LobeTable, NamesAreWhereTheTableHasThem) {
    constexpr LobeId Glass = LobeId::MicrosurfaceDielectricBsdfRgb_v1,
                     Coat = LobeId::MicrofacetDielectricBrdf;
    EXPECT_EQ(input_of(Glass, "abbe"), find_input(lobe(Glass), "abbe"));
    EXPECT_EQ(input_of(Glass, "walks"), find_input(lobe(Glass), "walks"));
    EXPECT_EQ(input_of(Coat, "absorption"), find_input(lobe(Coat), "absorption"));
    EXPECT_EQ(number_of(Glass, "ior"), place_among(Glass, "ior"));
    EXPECT_EQ(number_of(Glass, "walks"), place_among(Glass, "walks"));
    EXPECT_EQ(color_of(Glass, "roughness"), place_among(Glass, "roughness"));
    EXPECT_EQ(color_of(Glass, "transmittance"), place_among(Glass, "transmittance"));
    EXPECT_EQ(number_of(Coat, "thickness"), place_among(Coat, "thickness"));
    EXPECT_EQ(color_of(Coat, "absorption"), place_among(Coat, "absorption"));
    EXPECT_EQ(number_of(LobeId::MetalBrdf, "filmIor"), place_among(LobeId::MetalBrdf, "filmIor"));
}

TEST(LobeTable, HasRoomForAllInputs) {
    for (const LobeDecl& decl : lobe_table()) {
        int colors = 0, numbers = 0;
        for (const LobeInput& input : decl.inputs) {
            colors += input.type == InputType::Color;
            numbers += input.type == InputType::Float;
        }
        EXPECT_LE(colors, MostColors) << decl.name;
        EXPECT_LE(numbers, MostNumbers) << decl.name;
        EXPECT_LE(int(decl.inputs.size()), MostInputs) << decl.name;
        EXPECT_EQ(&lobe(decl.id), &decl);
    }
}

} // namespace kanuka::grid
