#include "scene/editor.h"

#include <chrono>
#include <gtest/gtest.h>
#include <map>
#include <set>

namespace kanuka::scene {
namespace {

Primitive primitive(const std::string& name = "") {
    Primitive p;
    p.geometry = Quadric{Quadric::Kind::Sphere, {1, -1, 1, 360}};
    auto attributes = std::make_shared<Attributes>();
    attributes->name = name;
    p.attributes = std::move(attributes);
    return p;
}
Group group(const std::string& name, size_t primitives) {
    Group g;
    g.name = name;
    for (size_t i = 0; i < primitives; i++)
        g.primitives.push_back(primitive());
    return g;
}
Group::Instances instances(int of, std::vector<double> times = {}) {
    Group::Instances in;
    in.group = of;
    in.transforms = std::vector<float>(12 * std::max<size_t>(times.size(), 1));
    in.times = std::move(times);
    return in;
}
Light light(const std::string& name) {
    Light l;
    l.name = name;
    return l;
}
ShaderRef light_shader(const std::string& handle) {
    ShaderRef s;
    s.handle = handle;
    return s;
}

// Every id of a scene, for whoever knows nothing of the editor's index.
std::vector<NodeId> ids(const Scene& scene) {
    std::vector<NodeId> all;
    const auto take = [&](const auto& list) {
        for (const auto& node : list)
            all.push_back(node.node);
    };
    take(scene.primitives), take(scene.solids), take(scene.instances);
    take(scene.lights), take(scene.light_shaders), take(scene.groups);
    for (const Group& g : scene.groups)
        take(g.primitives), take(g.solids), take(g.instances);
    return all;
}

void fill(Editor& editor) {
    editor.add(primitive("ball"));
    editor.add(primitive());
    editor.add(Solid{Solid::Kind::Union});
    editor.add(group("tree", 3));
    editor.add(group("", 1));
    editor.add(instances(0));
    editor.add(instances(1, {0, 1}));
    editor.add(light("key"));
    editor.add(light(""));
    editor.add(light_shader("1"));
    editor.add(primitive("ball"));
}

TEST(Node, PathsTellNodesApart) {
    const NodeId a = named_node(NodeId::World, NodeKind::Light, "a");
    EXPECT_EQ(a, named_node(NodeId::World, NodeKind::Light, "a"));
    const std::set<NodeId> all{NodeId::None,
                               NodeId::World,
                               a,
                               named_node(NodeId::World, NodeKind::Group, "a"),
                               named_node(NodeId::World, NodeKind::Light, "b"),
                               named_node(NodeId::World, NodeKind::Light, ""),
                               named_node(a, NodeKind::Light, "a"),
                               numbered_node(NodeId::World, NodeKind::Light, 0),
                               numbered_node(NodeId::World, NodeKind::Light, 1),
                               numbered_node(NodeId::World, NodeKind::Solid, 0),
                               numbered_node(a, NodeKind::Light, 0),
                               repeated_node(a, 2),
                               repeated_node(a, 3),
                               camera_node()};
    EXPECT_EQ(all.size(), 14u);
    EXPECT_EQ(to_text(NodeId(0x1f)), "0x000000000000001f");
}

TEST(Editor, GivesEveryNodeAnIdOfItsOwn) {
    Scene scene;
    Editor editor(scene);
    fill(editor);
    const std::vector<NodeId> all = ids(scene);
    EXPECT_EQ(std::set(all.begin(), all.end()).size(), 15u);
    EXPECT_EQ(all.size(), 15u);
    EXPECT_FALSE(std::set(all.begin(), all.end()).contains(NodeId::None));
    EXPECT_EQ(scene.primitives[0].node, named_node(NodeId::World, NodeKind::Primitive, "ball"));
    EXPECT_EQ(scene.primitives[2].node, repeated_node(scene.primitives[0].node, 2));
    EXPECT_EQ(scene.groups[0].primitives[2].node,
              numbered_node(named_node(NodeId::World, NodeKind::Group, "tree"), NodeKind::Primitive, 2));
    ASSERT_TRUE(editor.repeat());
    EXPECT_EQ(editor.repeat()->message(), "there is a primitive \"ball\" already: this one is \"ball#2\" to "
                                          "whoever edits the scene, and so on for others of one name");
}

TEST(Editor, IdsAreTheSameAgainAndWhatComesAfterChangesNone) {
    Scene first, second;
    Editor a(first), b(second);
    fill(a), fill(b);
    const std::vector<NodeId> before = ids(first);
    EXPECT_EQ(before, ids(second));
    b.add(primitive("ball"));
    b.add(primitive());
    b.add(light("key"));
    b.add(group("tree", 2));
    b.add(instances(2));
    b.add(instances(0));
    const std::vector<NodeId> after = ids(second);
    const std::set<NodeId> all(after.begin(), after.end());
    EXPECT_EQ(all.size(), after.size());
    for (const NodeId id : before)
        EXPECT_TRUE(all.contains(id));
}

// Another editor of the same scene goes on where the first one stopped.
TEST(Editor, KnowsWhatWasThereBeforeIt) {
    Scene one, two;
    Editor whole(one);
    fill(whole), fill(whole), fill(whole);
    for (int i = 0; i < 3; i++) {
        Editor part(two);
        fill(part);
    }
    EXPECT_EQ(ids(one), ids(two));
}

TEST(Editor, NamesOfGroupsAreTheirOwn) {
    Scene scene;
    Editor editor(scene);
    for (const char* name : {"a", "b"})
        editor.add(group(name, 0));
    for (Group& g : scene.groups) {
        editor.add(g, primitive("leaf"));
        editor.add(g, primitive());
    }
    editor.add(scene.groups[1], instances(0));
    editor.add(primitive("leaf"));
    const std::vector<NodeId> all = ids(scene);
    EXPECT_EQ(std::set(all.begin(), all.end()).size(), 8u);
    EXPECT_FALSE(editor.repeat());
    EXPECT_EQ(scene.groups[1].primitives[0].node,
              named_node(scene.groups[1].node, NodeKind::Primitive, "leaf"));
}

// Ten thousand of one name, in two editors; and as many names.
TEST(Editor, ManyOfOneNameAndManyNames) {
    Scene scene;
    {
        Editor editor(scene);
        for (int i = 0; i < 9000; i++)
            editor.add(primitive("leaf"));
    }
    Editor editor(scene);
    for (int i = 0; i < 1000; i++)
        editor.add(primitive("leaf"));
    for (int i = 0; i < 10000; i++)
        editor.add(primitive("leaf " + std::to_string(i)));
    std::set<NodeId> expected;
    const NodeId leaf = named_node(NodeId::World, NodeKind::Primitive, "leaf");
    expected.insert(leaf);
    for (uint32_t i = 2; i <= 10000; i++)
        expected.insert(repeated_node(leaf, i));
    for (int i = 0; i < 10000; i++)
        expected.insert(named_node(NodeId::World, NodeKind::Primitive, "leaf " + std::to_string(i)));
    const std::vector<NodeId> all = ids(scene);
    EXPECT_EQ(std::set(all.begin(), all.end()), expected);
    EXPECT_EQ(all.size(), expected.size());
    EXPECT_LE(editor.index_bytes(), 20 * all.size() * 4 / 5);
}

// Some come with ids of their own, from another scene or from before: none is given twice.
TEST(Editor, NumbersThatCameAlongAreNotGivenAgain) {
    const auto own = [](uint32_t number) {
        Primitive p = primitive();
        p.node = numbered_node(NodeId::World, NodeKind::Primitive, number);
        return p;
    };
    const auto each_once = [](const Scene& scene) {
        const std::vector<NodeId> all = ids(scene);
        return std::set(all.begin(), all.end()).size() == all.size();
    };
    {
        Scene scene; // through the readers' door, before anybody asked for an id
        Editor editor(scene);
        editor.add(own(0)), editor.add(primitive());
        EXPECT_TRUE(each_once(scene));
    }
    {
        Scene scene; // by an editor that begins with it
        scene.primitives = {own(0), own(2)};
        Editor editor(scene);
        for (int i = 0; i < 3; i++)
            editor.add(primitive());
        EXPECT_TRUE(each_once(scene));
    }
    {
        Scene scene; // after something was removed
        Editor editor(scene);
        editor.apply(Add{NodeId::World, own(1)});
        const NodeId gone = editor.add(primitive("gone")).node;
        editor.apply(Remove{{gone}});
        for (int i = 0; i < 3; i++)
            editor.add(primitive());
        EXPECT_TRUE(each_once(scene));
    }
    {
        Scene scene; // in a group that brings some
        Editor editor(scene);
        Group g = group("tree", 3);
        const NodeId tree = named_node(NodeId::World, NodeKind::Group, "tree");
        g.primitives[2].node = numbered_node(tree, NodeKind::Primitive, 1);
        editor.add(g);
        editor.add(scene.groups[0], primitive());
        EXPECT_TRUE(each_once(scene));
    }
}

// What has no id yet stands in no table: 100 000 of them took minutes.
TEST(Editor, LargeGroupsArriveWithoutIds) {
    Scene scene;
    scene.primitives = {primitive("before")};
    Editor editor(scene);
    const auto begin = std::chrono::steady_clock::now();
    editor.add(group("tree", 100'000));
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
    EXPECT_EQ(editor.kind(scene.groups[0].primitives[99'999].node), NodeKind::Primitive);
    EXPECT_LE(editor.index_bytes(), 20 * 100'002u);
}

} // namespace
} // namespace kanuka::scene
