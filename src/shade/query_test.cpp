#include "shade/query.h"

#include <gtest/gtest.h>

#include "shade/test_support.h"

namespace kanuka::shade {

namespace {

struct Answer {
    bool known = false;
    float floats[16] = {};
    std::string text;
};

Answer ask(sl::Query::Kind kind, const char* name, bool text, const Facts& facts, const char* file = "") {
    Journal journal;
    Textures textures({}, 1 << 20, journal);
    Answer a;
    const sl::Query q{kind, name, file, text, 16, a.floats, &a.text};
    a.known = answer(q, facts, textures);
    return a;
}

} // namespace

TEST(Query, AttributesOptionsRendererTextures) {
    scene::Attributes attributes;
    attributes.shading_rate = 2.5f;
    attributes.name = "teapot";
    attributes.user.set(test::value("user:age", scene::Type::Float, {41}));
    scene::Options options;
    options.width = 300;
    options.height = 200;
    scene::Camera camera;
    const Facts facts{&attributes, &options, &camera};
    using enum sl::Query::Kind;

    EXPECT_EQ(ask(Attribute, "ShadingRate", false, facts).floats[0], 2.5f);
    EXPECT_EQ(ask(Attribute, "Ri:ShadingRate", false, facts).floats[0], 2.5f);
    EXPECT_EQ(ask(Attribute, "user:age", false, facts).floats[0], 41);
    EXPECT_EQ(ask(Attribute, "identifier:name", true, facts).text, "teapot");
    EXPECT_FALSE(ask(Attribute, "user:height", false, facts).known);
    EXPECT_FALSE(ask(Attribute, "user:age", true, facts).known); // a number is no text
    EXPECT_EQ(ask(Option, "Format", false, facts).floats[1], 200);
    EXPECT_EQ(ask(Option, "FrameAspectRatio", false, facts).floats[0], 1.5f);
    EXPECT_EQ(ask(Renderer, "renderer", true, facts).text, "kanuka");
    EXPECT_FALSE(ask(Renderer, "weight", false, facts).known);
    const Answer missing = ask(Texture, "exists", false, facts, "nowhere.tx");
    EXPECT_TRUE(missing.known);
    EXPECT_EQ(missing.floats[0], 0);
    EXPECT_FALSE(ask(Texture, "resolution", false, facts, "nowhere.tx").known);

    // What differs in any of it differs in the key.
    scene::Attributes other = attributes;
    EXPECT_EQ(attribute_key(attributes), attribute_key(other));
    other.user.set(test::value("user:age", scene::Type::Float, {42}));
    EXPECT_NE(attribute_key(attributes), attribute_key(other));
}

} // namespace kanuka::shade
