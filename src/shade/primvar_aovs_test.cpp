// Layers of primitive variables: which are found, and their values in the primitive's own space.
#include "shade/primvar_aovs.h"

#include <gtest/gtest.h>

namespace kanuka::shade {
namespace {

using scene::Detail;
using scene::Type;

scene::Value value(const char* name, Type type, Detail detail, std::vector<float> floats) {
    scene::Value v;
    v.name = name;
    v.type = type;
    v.detail = detail;
    v.floats = std::move(floats);
    return v;
}

// A strip of three vertices.
grid::Grid strip() {
    grid::Grid g;
    g.allocate(2, 0);
    for (int i = 0; i < 3; i++)
        g.P[size_t(i)] = float(i), g.P[size_t(g.stride + i)] = 5, g.P[size_t(2 * g.stride + i)] = -1;
    return g;
}

void add_channel(grid::Grid& g, const char* name, const std::vector<Vec3f>& values, int components) {
    grid::Channel& c = g.primvars.emplace_back();
    c.name = name, c.components = components, c.stride = g.stride;
    c.data.assign(size_t(components * g.stride), 0.0f);
    for (size_t i = 0; i < values.size(); i++)
        for (int k = 0; k < components; k++)
            c.component(k)[i] = values[i][k];
}

// Values of the only layer at the vertices of the grid.
std::vector<Vec3f> filled(const PrimvarAov& aov, const grid::Grid& g, const Transform& current_from_object) {
    grid::LayeringProgram program;
    add_aov(program, aov.index, aov.name, aov.type, aov.components);
    grid::VertexInputs out;
    out.stride = g.stride;
    out.slots.resize(program.slots.size());
    fill_primvar_aov(aov, program.aovs[0], g, current_from_object, out);
    std::vector<Vec3f> all(3, Vec3f(0.0f));
    for (size_t i = 0; i < 3; i++)
        for (int c = 0; c < aov.components; c++) {
            const grid::SlotValues& slot = out.slots[size_t(program.aovs[0].slots[size_t(c)])];
            all[i][c] = slot.uniform ? slot.value.x : slot.data[i];
        }
    return all;
}

} // namespace

TEST(PrimvarAovs, AreFoundByName) {
    scene::Primitive p;
    p.primvars.set(value("heat", Type::Float, Detail::Varying, {0, 1, 2}));
    p.primvars.set(value("paint", Type::Color, Detail::Constant, {0.1f, 0.2f, 0.3f}));
    p.primvars.set(value("matrix", Type::Matrix, Detail::Constant, std::vector<float>(16, 0.0f)));
    p.primvars.set(value("N", Type::Normal, Detail::Varying, std::vector<float>(9, 0.0f)));
    p.primvars.set(value("short", Type::Color, Detail::Constant, {1}));
    const std::vector<std::string> wanted = {"none", "paint", "heat", "matrix", "N", "short"};
    const auto found = primvar_aovs(p, wanted);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].index, 1);
    EXPECT_EQ(found[0].components, 3);
    EXPECT_FALSE(found[0].varying);
    EXPECT_EQ(found[0].value, Vec3f(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(found[1].index, 2);
    EXPECT_EQ(found[1].components, 1);
    EXPECT_TRUE(found[1].varying);
    grid::LayeringProgram program;
    add_aov(program, 1, "paint", Type::Color, 3);
    add_aov(program, 2, "heat", Type::Float, 1);
    EXPECT_EQ(program.slots.size(), 4u);
    EXPECT_TRUE(program.aovs[0].color);
    EXPECT_FALSE(program.aovs[1].color);
    EXPECT_EQ(program.aovs[1].slots[0], 3);
}

TEST(PrimvarAovs, EveryPrimitiveHasAReferencePosition) {
    scene::Primitive with, under_another_name, without;
    with.primvars.set(value("Pref", Type::Point, Detail::Vertex, std::vector<float>(9, 0.0f)));
    under_another_name.primvars.set(
        value("__Pref", Type::Point, Detail::Vertex, std::vector<float>(9, 0.0f)));
    for (const char* name : {"Pref", "__Pref"}) {
        const std::vector<std::string> wanted = {name};
        for (const auto& [primitive, found] :
             {std::pair{&with, "Pref"}, {&under_another_name, "__Pref"}, {&without, ""}}) {
            const auto aovs = primvar_aovs(*primitive, wanted);
            ASSERT_EQ(aovs.size(), 1u);
            EXPECT_EQ(aovs[0].name, found);
            EXPECT_EQ(aovs[0].components, 3);
            EXPECT_TRUE(aovs[0].varying);
        }
    }
}

// Twice as large along x, turned a quarter about z and moved: (x, y, z) becomes (10 - y, 2 x, z + 4).
TEST(PrimvarAovs, ValuesAreInTheSpaceOfThePrimitive) {
    Transform m;
    m.m[0] = {0, -1, 0, 10}, m.m[1] = {2, 0, 0, 0}, m.m[2] = {0, 0, 1, 4};
    grid::Grid g = strip();
    add_channel(g, "place", {{10, 0, 4}, {7, 2, 5}, {9, -2, 4}}, 3);
    add_channel(g, "way", {{0, 2, 0}, {-1, 0, 0}, {0, 0, 3}}, 3);
    add_channel(g, "across", {{0, 0.5f, 0}, {-1, 0, 0}, {0, 0, 1}}, 3);
    add_channel(g, "paint", {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}, 3);
    add_channel(g, "heat", {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, 1);
    const auto layer = [&](const char* name, Type type, int components) {
        return filled({.name = name, .type = type, .components = components, .varying = true}, g, m);
    };
    const auto near = [](const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
        for (size_t i = 0; i < 3; i++)
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(a[i][c], b[i][c], 1e-6f) << i << " " << c;
    };
    near(layer("place", Type::Point, 3), {{0, 0, 0}, {1, 3, 1}, {-1, 1, 0}});
    near(layer("way", Type::Vector, 3), {{1, 0, 0}, {0, 1, 0}, {0, 0, 3}});
    near(layer("across", Type::Normal, 3), {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    near(layer("paint", Type::Color, 3), {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
    near(layer("heat", Type::Float, 1), {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
    near(layer("", Type::Point, 3), {{2.5f, 10, -5}, {2.5f, 9, -5}, {2.5f, 8, -5}}); // P itself
    near(layer("left out", Type::Color, 3), {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}});
    near(filled({.name = "one", .type = Type::Color, .components = 3, .value = {3, 2, 1}}, g, m),
         {{3, 2, 1}, {3, 2, 1}, {3, 2, 1}});
    m.m[0] = {0, 0, 0, 0}; // flat: nothing to take back, and nothing to fail
    filled({.name = "place", .type = Type::Point, .components = 3, .varying = true}, g, m);
}

} // namespace kanuka::shade
