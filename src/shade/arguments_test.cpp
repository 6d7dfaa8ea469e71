#include "shade/arguments.h"

#include <numeric>

#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

using scene::Detail;
using test::parameter;
using test::value;

struct Arguments : testing::Test {
    test::FakeShader shader{"wood",
                            sl::ShaderKind::Surface,
                            {parameter("Kd", sl::Type::Float), parameter("tint", sl::Type::Color),
                             parameter("origin", sl::Type::Point), parameter("up", sl::Type::Normal),
                             parameter("rings", sl::Type::Float, 3), parameter("map", sl::Type::String)}};
    scene::ShaderRef ref;
    scene::ValueList primvars;
    Spaces spaces;
    Journal journal;

    Arguments() {
        ref.name = "wood";
        ref.where = {"scene.rib", 7, 1};
        spaces.current_from_shader = Transform::translate(10, 0, 0) * Transform::scale(2, 1, 1);
        spaces.current_from_object = Transform::translate(0, 10, 0);
    }
    std::vector<sl::Argument> bind() { return bind_arguments(shader, ref, primvars, spaces, journal); }
    const sl::Argument* find(const std::vector<sl::Argument>& all, const std::string& name) {
        for (const auto& a : all)
            if (a.name == name)
                return &a;
        return nullptr;
    }
    std::string messages() {
        std::string all;
        for (const auto& e : journal.entries())
            all += e.where.str() + ": " + e.message + "\n";
        return all;
    }
};

TEST_F(Arguments, PrimvarsOverrideTheShadersValues) {
    ref.parameters.set(value("Kd", scene::Type::Float, {0.5f}));
    ref.parameters.set(value("tint", scene::Type::Color, {1, 0, 0}));
    primvars.set(value("Kd", scene::Type::Float, {0.25f}, Detail::Constant));
    primvars.set(value("tint", scene::Type::Color, std::vector<float>(12, 0.5f), Detail::Vertex));
    primvars.set(value("P", scene::Type::Point, std::vector<float>(12, 0.5f), Detail::Vertex));
    const auto all = bind();
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(find(all, "Kd")->floats, std::vector{0.25f});
    EXPECT_TRUE(find(all, "tint")->varying);
    EXPECT_EQ(messages(), "");
}

TEST_F(Arguments, IntegersServeAsFloats) {
    scene::Value v;
    v.name = "Kd";
    v.type = scene::Type::Integer;
    v.ints = std::vector<int32_t>{3};
    ref.parameters.set(v);
    EXPECT_EQ(find(bind(), "Kd")->floats, std::vector{3.0f});
}

TEST_F(Arguments, GeometryLeavesInCurrentSpace) {
    ref.parameters.set(value("origin", scene::Type::Point, {1, 2, 3}));
    ref.parameters.set(value("up", scene::Type::Normal, {1, 1, 0}));
    EXPECT_EQ(find(bind(), "origin")->floats, (std::vector<float>{12, 2, 3}));
    EXPECT_EQ(find(bind(), "up")->floats, (std::vector<float>{0.5f, 1, 0}))
        << "normals use the inverse transpose";
    primvars.set(value("origin", scene::Type::Point, {1, 2, 3}, Detail::Constant));
    EXPECT_EQ(find(bind(), "origin")->floats, (std::vector<float>{1, 12, 3}))
        << "primvars are in object space";
}

TEST_F(Arguments, MisfitsAreReportedAndSkipped) {
    ref.parameters.set(value("tint", scene::Type::Float, {1}));
    ref.parameters.set(value("rings", scene::Type::Float, {1, 2}));
    ref.parameters.set(value("gloss", scene::Type::Float, {1}));
    ref.parameters.values[0].where = {"scene.rib", 9, 5};
    primvars.set(value("map", scene::Type::Float, {0, 1}, Detail::Varying));
    EXPECT_TRUE(bind().empty());
    const std::string all = messages();
    EXPECT_NE(all.find("scene.rib:9:5: parameter \"tint\" of shader \"wood\" is a color, not a float"),
              std::string::npos)
        << all;
    EXPECT_NE(all.find("\"rings\" of shader \"wood\" (float[3]) takes 3 values, 2 are given"),
              std::string::npos)
        << all;
    EXPECT_NE(all.find("scene.rib:7:1: shader \"wood\" has no parameter \"gloss\"; it has Kd, tint, origin"),
              std::string::npos)
        << all;
    EXPECT_NE(all.find("primitive variable \"map\" (varying float) does not fit"), std::string::npos) << all;
}

// "tint" [1 0 0] that nobody declared comes as float[3]: the shader knows what it is.
TEST_F(Arguments, PlainNumbersAreWhatTheShaderDeclares) {
    ref.parameters.set(value("tint", scene::Type::Float, {1, 0.5f, 0}));
    ref.parameters.set(value("origin", scene::Type::Float, {1, 2, 3}));
    ref.parameters.set(value("up", scene::Type::Float, {1, 1}));
    for (scene::Value& v : ref.parameters.values)
        v.array_size = int(v.floats.size());
    EXPECT_EQ(find(bind(), "tint")->floats, (std::vector<float>{1, 0.5f, 0}));
    EXPECT_EQ(find(bind(), "origin")->floats, (std::vector<float>{12, 2, 3}))
        << "in shader space, as any point";
    EXPECT_EQ(find(bind(), "up"), nullptr) << "two numbers are no normal";
    EXPECT_NE(messages().find("\"up\" of shader \"wood\" is a normal, not a float[2]"), std::string::npos)
        << messages();
}

// In no space: who reads numbers makes of them what they like.
TEST_F(Arguments, AMatrixIsItsSixteenNumbers) {
    test::FakeShader numbers{
        "n", sl::ShaderKind::Surface, {parameter("m", sl::Type::Float, 16), parameter("c", sl::Type::Color)}};
    std::vector<float> given(16);
    std::iota(given.begin(), given.end(), 1.0f);
    primvars.set(value("m", scene::Type::Matrix, given, Detail::Constant));
    primvars.set(value("c", scene::Type::Matrix, given, Detail::Constant));
    const auto all = bind_arguments(numbers, ref, primvars, spaces, journal);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(find(all, "m")->floats, given);
    EXPECT_NE(messages().find("\"c\" of shader \"wood\" is a color, not a matrix"), std::string::npos);
}

TEST_F(Arguments, HomogeneousPointsAreDividedByTheirWeight) {
    primvars.set(value("origin", scene::Type::HPoint, {2, 4, 6, 2}, Detail::Constant));
    EXPECT_EQ(find(bind(), "origin")->floats, (std::vector<float>{1, 12, 3}));
    primvars.set(value("origin", scene::Type::HPoint, std::vector<float>(16, 1.0f), Detail::Vertex));
    EXPECT_TRUE(find(bind(), "origin")->varying);
    primvars.set(value("up", scene::Type::HPoint, std::vector<float>(16, 1.0f), Detail::Vertex));
    EXPECT_EQ(find(bind(), "up"), nullptr) << "directions have no weight";
}

TEST_F(Arguments, SerializeTellsListsApart) {
    ref.parameters.set(test::text("map", "a"));
    const std::string first = serialize(bind());
    EXPECT_EQ(first, serialize(bind()));
    ref.parameters.set(test::text("map", "b"));
    EXPECT_NE(first, serialize(bind()));
}

} // namespace
} // namespace kanuka::shade
