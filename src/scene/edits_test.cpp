// Edits one by one: what they leave, what they share, and why they are refused.
#include <gtest/gtest.h>
#include <set>

#include "scene/edits_test_support.h"

namespace kanuka::scene::testing {
namespace {

TEST(Edits, WhatIsAddedAndRemovedLeavesNothing) {
    Scene scene;
    Editor editor(scene);
    Group tree;
    tree.name = "tree";
    tree.primitives = {ball("leaf"), ball("")};
    editor.add(tree);
    editor.add(ball("ball"));
    editor.add(lamp("key"));
    const auto before = described(scene);
    const std::shared_ptr<const Attributes> attributes = scene.primitives[0].attributes;
    Delta delta;
    editor.record(&delta);
    const NodeId ids[] = {editor.apply(Add{NodeId::World, ball("")}).id,
                          editor.apply(Add{scene.groups[0].node, ball("leaf")}).id,
                          editor.apply(Add{NodeId::World, tree}).id};
    for (const NodeId id : ids)
        EXPECT_EQ(editor.apply(Remove{{id}}).refusal, "");
    EXPECT_EQ(described(scene), before);
    EXPECT_EQ(scene.primitives[0].attributes, attributes);
    EXPECT_TRUE(delta.empty());
    // And what was removed comes back as what it was.
    const Primitive kept = scene.primitives[0];
    EXPECT_EQ(editor.apply(Remove{{kept.node}}).refusal, "");
    EXPECT_EQ(editor.apply(Add{NodeId::World, kept}).id, kept.node);
    EXPECT_TRUE(delta.added.empty() && delta.removed.empty());
    EXPECT_EQ(delta.changed.at(kept.node), EveryAspect);
    EXPECT_EQ(described(scene), before);
}

// Where a light's own shader is missing, what stands in for it is edited as well.
TEST(Edits, StandInsFollowTheirLights) {
    Scene scene;
    Editor editor(scene);
    ShaderRef light = light_shader("key");
    light.name = "theirs";
    light.stand_in = std::make_shared<const ShaderRef::StandIn>("pointlight");
    const auto before = light.stand_in;
    editor.add(light);
    const NodeId id = scene.light_shaders[0].node;
    EXPECT_EQ(editor
                  .apply(SetParameters{
                      id, {}, {floats("intensity", Type::Float, {7}), floats("softness", Type::Float, {2})}})
                  .refusal,
              "");
    const ShaderRef& now = scene.light_shaders[0];
    EXPECT_EQ(now.parameters.get_float("softness", 0), 2);
    EXPECT_EQ(now.stand_in->parameters.get_float("intensity", 1), 7);
    EXPECT_FALSE(now.stand_in->parameters.find("softness")) << "a pointlight has none";
    EXPECT_FALSE(before->parameters.find("intensity")) << "what others hold stays";
}

TEST(Edits, AttributesThatAreSharedStayShared) {
    Scene scene;
    Editor editor(scene);
    const Primitive one = ball("");
    for (int i = 0; i < 5; i++)
        editor.add(one);
    const std::shared_ptr<const Attributes> before = one.attributes;
    for (int i = 0; i < 4; i++)
        editor.apply(Set{scene.primitives[size_t(i)].node, {{"visible_camera", number(0)}}});
    for (int i = 0; i < 3; i++)
        editor.apply(SetParameters{
            scene.primitives[size_t(i)].node, {"surface"}, {floats("Kd", Type::Float, {0.5f})}});
    std::set<const Attributes*> all;
    for (const Primitive& p : scene.primitives)
        all.insert(p.attributes.get());
    EXPECT_EQ(all.size(), 3u);
    EXPECT_EQ(scene.primitives[0].attributes, scene.primitives[2].attributes);
    EXPECT_EQ(scene.primitives[4].attributes, before);
    EXPECT_TRUE(before->visible_camera);
}

TEST(Edits, SolidsAndGroupsKeepTheirNumbers) {
    Scene scene;
    Editor editor(scene);
    const NodeId first = editor.add(Solid{Solid::Kind::Primitive}).node;
    const NodeId second = editor.add(Solid{Solid::Kind::Union}).node;
    editor.add(Solid{Solid::Kind::Primitive, 1});
    for (int solid : {0, 2}) {
        Primitive p = ball(solid == 0 ? "in first" : "in third");
        p.solid = solid;
        editor.add(p);
    }
    EXPECT_EQ(editor.apply(Remove{{first}}).refusal,
              "solid " + to_text(first) + " has primitives or solids in it; remove those as well");
    EXPECT_NE(editor.apply(Remove{{second}}).refusal, "");
    EXPECT_EQ(editor.apply(Remove{{first, editor.find("in first")[0]}}).refusal, "");
    EXPECT_EQ(scene.primitives[0].solid, 1);
    EXPECT_EQ(scene.solids[1].parent, 0);
    for (const char* name : {"a", "b", "c"}) {
        Group g;
        g.name = name;
        editor.add(g);
    }
    Group::Instances i;
    i.group = 1;
    i.transforms = std::vector<float>(12);
    editor.add(scene.groups[2], i);
    const NodeId b = editor.find("b")[0];
    EXPECT_EQ(editor.apply(Remove{{b}}).refusal,
              "group \"b\" is placed by 1 instances; remove those as well");
    EXPECT_EQ(editor.apply(Remove{{editor.find("a")[0]}}).refusal, "");
    EXPECT_EQ(scene.groups[1].instances[0].group, 0);
    EXPECT_EQ(editor.apply(Remove{{editor.find("c")[0], b}}).refusal, "");
    EXPECT_TRUE(scene.groups.empty());
}

TEST(Edits, RefusalsSayWhatWouldDo) {
    Scene scene;
    Editor editor(scene);
    const NodeId p = editor.add(ball("ball")).node, l = editor.add(lamp("key")).node,
                 s = editor.add(light_shader("1")).node;
    const auto refusal = [&](Edit edit) { return editor.apply(std::move(edit)).refusal; };
    EXPECT_EQ(refusal(Remove{{NodeId(77)}}), "there is no node 0x000000000000004d");
    EXPECT_EQ(refusal(Remove{{camera_node()}}), "the camera cannot be removed");
    EXPECT_EQ(refusal(Set{NodeId::World, {{"samplse", number(1)}}}),
              "the world has no option samplse; did you mean samples?");
    EXPECT_EQ(refusal(Set{NodeId::World, {{"samples", number(-1)}}}).substr(0, 17), "samples: expected");
    EXPECT_EQ(refusal(Set{camera_node(), {{"fov", number(200)}}}),
              "fov: the field of view must lie between 0 and 180 degrees");
    EXPECT_EQ(refusal(Set{l, {{"cone_angle", number(20)}}}).substr(0, 61),
              "light \"key\" has no parameter cone_angle; it has amount, spect");
    EXPECT_EQ(refusal(Set{l, {{"radios", number(20)}}}),
              "light \"key\" has no parameter radios; did you mean radius?");
    EXPECT_EQ(refusal(Set{l, {{"radius", number(-1)}}}).substr(0, 46),
              "radius: expected a number of scene units, 0 or");
    EXPECT_EQ(refusal(Set{p, {{"visible_camra", number(1)}}}),
              "primitive \"ball\" has no attribute visible_camra; did you mean visible_camera?");
    EXPECT_EQ(refusal(Set{p, {{"name", {{}, {"cube"}}}}}), Editor::NameStays);
    EXPECT_EQ(refusal(Set{s, {{"amount", number(1)}}}),
              "light \"1\" is a shader, \"pointlight\": set its own parameters, in RIB's names and units");
    EXPECT_EQ(refusal(SetParameters{s, {}, {floats("intensty", Type::Float, {1})}}),
              "light \"1\" has no parameter intensty; did you mean intensity?");
    EXPECT_EQ(refusal(SetParameters{p, {"surfce"}, {floats("Kd", Type::Float, {1})}}),
              "the primitive has no shader surfce; did you mean surface?");
    EXPECT_EQ(refusal(SetParameters{p, {"surface"}, {floats("Kd", Type::Color, {1, 1, 1})}}),
              "Kd: expected a float, got a color");
    EXPECT_EQ(refusal(SetParameters{p, {"surface", "bas"}, {floats("c", Type::Color, {1, 1, 1})}}),
              "shader \"matte\" has no co-shader bas; did you mean base?");
    EXPECT_EQ(refusal(Add{p, ball("")}),
              "parent: primitive \"ball\" has no nodes of its own; the world has, and groups");
    EXPECT_EQ(refusal(Replace{p, Places{std::vector<float>(12)}}),
              "primitive \"ball\" has no places that could be replaced; instances have");
    Primitive twin = ball("twin");
    twin.node = p;
    EXPECT_EQ(refusal(Add{NodeId::World, twin}),
              "the id that it comes with is another node's: leave it out, or remove that one");
    EXPECT_EQ(editor.question("bal"), "; did you mean ball?");
    EXPECT_EQ(editor.question("something else"), "");
}

TEST(Edits, NodesAreFoundByName) {
    Scene scene;
    Editor editor(scene);
    for (int i = 0; i < 3; i++)
        editor.add(ball("ball"));
    editor.add(lamp("ball"));
    editor.add(ball("odd#2"));
    EXPECT_EQ(editor.find("ball"), (std::vector{scene.primitives[0].node, scene.lights[0].node}));
    EXPECT_EQ(editor.find("ball#3"), std::vector{scene.primitives[2].node});
    EXPECT_EQ(editor.find("odd#2"), std::vector{scene.primitives[3].node});
    EXPECT_EQ(editor.find("camera"), std::vector{camera_node()});
    EXPECT_TRUE(editor.find("ball#4").empty());
    EXPECT_TRUE(editor.find("").empty());
    EXPECT_EQ(editor.kind(scene.lights[0].node), NodeKind::Light);
    EXPECT_EQ(editor.name(scene.lights[0].node), "ball");
}

} // namespace
} // namespace kanuka::scene::testing
