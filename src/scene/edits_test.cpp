// Edits one by one: what they leave, what they share, and why they are refused.
#include <chrono>
#include <cmath>
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
              "Kd: expected a float, got a color; it is declared \"float Kd\"");
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

// Files say by name which lights are on for a primitive. One that comes later shines on all of them; a light
// that comes back, or that has the name of another, on what it did.
TEST(Edits, ALightThatIsAddedShinesOnWhatWasThere) {
    Scene scene;
    Editor editor(scene);
    const auto on = std::make_shared<const std::set<std::string>>(std::set<std::string>{"key"});
    const auto lit = [&](const char* name) {
        Primitive p = ball(name);
        auto a = std::make_shared<Attributes>(*p.attributes);
        a->lights_on = on;
        p.attributes = std::move(a);
        return p;
    };
    const Primitive one = lit("");
    editor.add(light_shader("key"));
    for (int i = 0; i < 3; i++)
        editor.add(one);
    editor.add(lit("another"));
    editor.add(ball("all"));
    Group tree;
    tree.primitives = {lit("leaf")};
    editor.add(tree);
    const NodeId lamp_id = editor.apply(Add{NodeId::World, lamp("lamp")}).id;
    editor.apply(Add{NodeId::World, lamp("")});
    editor.apply(Add{NodeId::World, light_shader("fill")});
    const std::set<std::string> expected{"key", "lamp", "", "fill"};
    const std::vector<Primitive>& all = scene.primitives;
    EXPECT_EQ(*all[0].attributes->lights_on, expected);
    EXPECT_EQ(*scene.groups[0].primitives[0].attributes->lights_on, expected);
    EXPECT_EQ(all[0].attributes, all[2].attributes) << "shared as before";
    EXPECT_EQ(all[0].attributes->lights_on, all[3].attributes->lights_on);
    EXPECT_FALSE(all[4].attributes->lights_on) << "all were on";
    EXPECT_EQ(on->size(), 1u) << "what others hold stays";
    // What comes from before the light as well.
    const NodeId late = editor.apply(Add{NodeId::World, lit("late")}).id;
    EXPECT_EQ(*editor.get<Primitive>(late)->attributes->lights_on, expected);
    EXPECT_EQ(editor.apply(Replace{late, lit("late").attributes}).refusal, "");
    EXPECT_EQ(*editor.get<Primitive>(late)->attributes->lights_on, expected);
    // Which lights are off stays.
    const ShaderRef key = scene.light_shaders[0];
    EXPECT_EQ(editor.apply(Set{late, {{"visible_camera", number(0)}}}).refusal, "");
    auto dark = std::make_shared<Attributes>(*all[0].attributes);
    dark->lights_on = std::make_shared<const std::set<std::string>>();
    scene.primitives[0].attributes = dark;
    editor.apply(Remove{{key.node}});
    editor.apply(Add{NodeId::World, key});
    editor.apply(Add{NodeId::World, lamp("lamp")});
    EXPECT_TRUE(scene.primitives[0].attributes->lights_on->empty());
    EXPECT_EQ(editor.apply(Remove{{lamp_id}}).refusal, "");
}

TEST(Edits, ParametersKeepTheirTypes) {
    Scene scene;
    Editor editor(scene);
    Primitive p = ball("ball");
    auto a = std::make_shared<Attributes>(*p.attributes);
    Value count;
    count.name = "count", count.type = Type::Integer, count.ints = std::vector<int32_t>{2};
    Value row = floats("row", Type::Float, {1, 2, 3});
    row.array_size = 3;
    a->surface->parameters.set(count);
    a->surface->parameters.set(row);
    for (const Value& v : {floats("tint", Type::Color, {1, 1, 1}), floats("h", Type::HPoint, {0, 0, 0, 1}),
                           floats("m", Type::Matrix, std::vector<float>(16, 1))})
        a->surface->parameters.set(v);
    p.attributes = std::move(a);
    const NodeId id = editor.add(p).node;
    const auto set = [&](Value v) { return editor.apply(SetParameters{id, {"surface"}, {v}}).refusal; };
    const auto now = [&](const char* name) {
        return *scene.primitives[0].attributes->surface->parameters.find(name);
    };
    const auto array = [](std::string name, std::vector<float> numbers) {
        Value v = floats(std::move(name), Type::Float, std::move(numbers));
        v.array_size = int(v.floats.size());
        return v;
    };
    Value text;
    text.name = "tint", text.type = Type::String, text.strings = std::vector<std::string>{"D65"};
    EXPECT_EQ(set(floats("count", Type::Float, {3})), "");
    ASSERT_EQ(now("count").ints.size(), 1u);
    EXPECT_EQ(now("count").ints[0], 3);
    EXPECT_EQ(set(floats("count", Type::Float, {2.5f})), "count: expected a whole number, got 2.5");
    EXPECT_EQ(set(floats("count", Type::Float, {1e20f})).substr(0, 29), "count: expected a whole numbe");
    count.name = "Kd";
    EXPECT_EQ(set(count), "");
    EXPECT_EQ(now("Kd").type, Type::Float);
    EXPECT_EQ(now("Kd").floats[0], 2);
    EXPECT_EQ(set(text), "") << "a spectrum in place of a colour";
    EXPECT_EQ(set(floats("tint", Type::Color, {1, 0, 0})), "") << "and back";
    EXPECT_EQ(now("tint").type, Type::Color);
    EXPECT_EQ(set(floats("row", Type::Color, {4, 5, 6})), "");
    EXPECT_EQ(now("row").type, Type::Float);
    EXPECT_EQ(now("row").array_size, 3);
    EXPECT_EQ(now("row").floats[2], 6);
    EXPECT_EQ(set(array("row", {1, 2})),
              "row: expected a float[3], got a float[2]; it is declared \"float[3] row\"");
    EXPECT_EQ(set(array("Kd", {1, 2})), "Kd: expected a float, got a float[2]; it is declared \"float Kd\"");
    EXPECT_EQ(set(array("h", {1, 2, 3, 4})), "");
    EXPECT_EQ(now("h").type, Type::HPoint);
    EXPECT_EQ(now("h").array_size, 1);
    EXPECT_EQ(set(array("m", std::vector<float>(16, 2))), "");
    EXPECT_EQ(now("m").type, Type::Matrix);
    text.name = "Kd";
    EXPECT_EQ(set(text), "Kd: expected a float, got a string; it is declared \"float Kd\"");
    EXPECT_NE(set(array("tint", {})), "");
    Value hollow = floats("new", Type::Color, {1, 2});
    EXPECT_EQ(set(hollow), "new: expected 3 numbers (\"color new\"), got 2");
}

// Of a standard light the rows are known, whatever was given before.
TEST(Edits, ParametersOfStandardLightsAreChecked) {
    Scene scene;
    Editor editor(scene);
    const NodeId id = editor.add(light_shader("key")).node;
    const auto set = [&](Value v) { return editor.apply(SetParameters{id, {}, {std::move(v)}}).refusal; };
    Value text;
    text.name = "intensity", text.type = Type::String, text.strings = std::vector<std::string>{"bright"};
    EXPECT_EQ(set(text), "intensity: expected a float, got a string; it is declared \"float intensity\"");
    text.name = "lightcolor";
    EXPECT_EQ(set(text), "lightcolor: expected a color, got a string; it is declared \"color lightcolor\"");
    text.name = "unit";
    EXPECT_EQ(set(text), "unit: expected lumen, candela, lux, nit or watt, got \"bright\"");
    EXPECT_EQ(set(floats("from", Type::Float, {1})),
              "from: expected a point, got a float; it is declared \"point from\"");
    EXPECT_EQ(set(floats("from", Type::Color, {1, 2, 3})), "");
    EXPECT_EQ(scene.light_shaders[0].parameters.find("from")->type, Type::Point);
    EXPECT_EQ(set(floats("radius", Type::Float, {-1})).substr(0, 17), "radius: expected ");
    EXPECT_EQ(set(floats("radius", Type::Float, {1})), "");
}

TEST(Edits, LightsWithoutAnInverseArePlaced) {
    Scene scene;
    Editor editor(scene);
    ShaderRef light = light_shader("key");
    light.world_from_shader = Transform::scale(1, 0, 1);
    const NodeId id = editor.add(light).node;
    ASSERT_NO_THROW(
        EXPECT_EQ(editor.apply(Replace{id, Placement{Transform::translate(1, 2, 3)}}).refusal, ""));
    EXPECT_EQ(scene.light_shaders[0].world_from_shader.m[0][3], 1);
    light.coshaders.emplace_back();
    light.handle = "other";
    const NodeId other = editor.add(light).node;
    ASSERT_NO_THROW(
        EXPECT_EQ(editor.apply(Replace{other, Placement{Transform::translate(1, 2, 3)}}).refusal,
                  "light \"other\" stands flattened, and where its co-shaders would go is not known"));
}

TEST(Edits, SharingOutlivesEditsThatAlternate) {
    Scene scene;
    Editor editor(scene);
    const Primitive one = ball("");
    for (int i = 0; i < 4; i++)
        editor.add(one);
    for (const Primitive& p : scene.primitives) {
        editor.apply(Set{p.node, {{"visible_camera", number(0)}}});
        editor.apply(SetParameters{p.node, {"surface"}, {floats("Kd", Type::Float, {0.5f})}});
        editor.apply(SetParameters{p.node, {"surface", "base"}, {floats("c", Type::Color, {0, 0, 1})}});
    }
    for (const Primitive& p : scene.primitives)
        EXPECT_EQ(p.attributes, scene.primitives[0].attributes);
}

TEST(Edits, LinksOfALightAreLinks) {
    Scene scene;
    Editor editor(scene);
    const NodeId id = editor.add(light_shader("key")).node;
    Value group;
    group.name = "group", group.type = Type::String, group.strings = std::vector<std::string>{"keys"};
    Delta delta;
    editor.record(&delta);
    EXPECT_EQ(editor.apply(SetParameters{id, {}, {group}}).refusal, "");
    EXPECT_EQ(delta.changed.at(id), Aspects(Aspect::Links));
    EXPECT_EQ(editor.apply(SetParameters{id, {}, {floats("intensity", Type::Float, {2})}}).refusal, "");
    EXPECT_EQ(delta.changed.at(id), Aspect::Links | Aspect::Parameters);
}

TEST(Edits, CamerasAreCheckedAsTheyAreReplaced) {
    Scene scene;
    Editor editor(scene);
    const auto refusal = [&](const Camera& c) { return editor.apply(Replace{camera_node(), c}).refusal; };
    Camera camera;
    camera.fov = 200;
    EXPECT_EQ(refusal(camera), "fov: the field of view must lie between 0 and 180 degrees");
    camera.fov = NAN;
    EXPECT_NE(refusal(camera), "");
    camera.fov = 40;
    camera.motion = {{0, Transform()}, {0, Transform()}};
    EXPECT_EQ(refusal(camera), "times: expected finite numbers that rise");
    camera.motion = {{0, Transform()}, {1, Transform::scale(0, 1, 1)}};
    EXPECT_NE(refusal(camera), "");
    camera.motion = {{0, Transform()}, {1, Transform::scale(2, 2, 2)}};
    EXPECT_EQ(refusal(camera), "");
    EXPECT_EQ(scene.camera.motion.size(), 2u);
}

TEST(Edits, IdsOfTheWorldAndTheCameraAreTheirs) {
    Scene scene;
    Editor editor(scene);
    for (const NodeId id : {NodeId::World, camera_node()}) {
        Primitive p = ball("");
        p.node = id;
        EXPECT_EQ(editor.apply(Add{NodeId::World, p}).refusal,
                  "the id that it comes with is another node's: leave it out, or remove that one");
    }
}

TEST(Edits, PartsCountTheGroupsBefore) {
    Scene scene;
    Editor editor(scene, 5);
    Group::Instances i;
    i.transforms = std::vector<float>(12);
    i.group = 4;
    EXPECT_EQ(editor.apply(Add{NodeId::World, i}).refusal, "");
    i.group = 5;
    EXPECT_NE(editor.apply(Add{NodeId::World, i}).refusal, "");
    editor.apply(Add{NodeId::World, Group{}});
    EXPECT_EQ(editor.apply(Add{NodeId::World, i}).refusal, "");
}

// Each is looked at once: 20 000 of both take hundredths of a second, and took minutes pair by pair.
TEST(Edits, ManyGroupsAndSolidsGoInOnePass) {
    Scene scene;
    Editor editor(scene);
    Remove all;
    for (int i = 0; i < 20000; i++) {
        Group g;
        g.name = std::to_string(i);
        all.ids.push_back(editor.add(std::move(g)).node);
        Group::Instances places;
        places.group = i;
        places.transforms = std::vector<float>(12);
        all.ids.push_back(editor.add(std::move(places)).node);
        all.ids.push_back(editor.add(Solid{Solid::Kind::Union, i % 2 ? i - 1 : -1}).node);
    }
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(editor.apply(all).refusal, "");
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
    EXPECT_TRUE(scene.groups.empty() && scene.solids.empty() && scene.instances.empty());
}

} // namespace
} // namespace kanuka::scene::testing
