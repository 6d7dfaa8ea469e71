// Ids of what a file holds: the same whenever it is read, and of what was there before whatever comes after.
#include <gtest/gtest.h>
#include <map>
#include <set>

#include "ingest/rib/rib.h"
#include "ingest/rib/test_support.h"

namespace kanuka::ingest {
namespace {

using scene::NodeId;
using scene::NodeKind;

const std::string Ball = "Sphere 1 -1 1 360\n";
std::string named(const std::string& name, const std::string& what) {
    return "AttributeBegin Attribute \"identifier\" \"string name\" [\"" + name + "\"]\n" + what +
           "AttributeEnd\n";
}

scene::Scene read(const std::string& text, Journal* journal = nullptr, const RibOptions& options = {}) {
    Journal unheard;
    return parse_rib(text, "test.rib", options, journal ? *journal : unheard);
}

std::vector<NodeId> ids(const scene::Scene& s) {
    std::vector<NodeId> all;
    const auto take = [&](const auto& list) {
        for (const auto& node : list)
            all.push_back(node.node);
    };
    take(s.primitives), take(s.solids), take(s.instances), take(s.light_shaders), take(s.groups);
    for (const scene::Group& g : s.groups)
        take(g.primitives), take(g.solids), take(g.instances);
    return all;
}

const std::string Before = "WorldBegin\nLightSource \"pointlight\" 1\nLightSource \"pointlight\" \"key\"\n"
                           "ObjectBegin 1\n" +
                           Ball + named("leaf", Ball) + "ObjectEnd\n" + named("ball", Ball) + Ball +
                           named("ball", Ball + "Color 1 0 0 ObjectInstance 1\n") +
                           "MotionBegin [0 1] Translate 0 0 0 Translate 1 0 0 MotionEnd ObjectInstance 1\n"
                           "SolidBegin \"union\" SolidBegin \"primitive\"\n" +
                           Ball + "SolidEnd SolidEnd\n";
const std::string After = "LightSource \"pointlight\" 1\nColor 0 1 0 ObjectInstance 1\nSolidBegin "
                          "\"primitive\"\n" +
                          Ball + "SolidEnd\n" + Ball + named("ball", Ball) + named("new", Ball);

TEST(Identity, TheSameWheneverItIsRead) {
    const std::vector<NodeId> all = ids(read(Before + "WorldEnd\n"));
    EXPECT_EQ(all, ids(read(Before + "WorldEnd\n")));
    EXPECT_EQ(std::set(all.begin(), all.end()).size(), all.size());
    EXPECT_FALSE(std::set(all.begin(), all.end()).contains(NodeId::None));
}

TEST(Identity, WhatComesAfterChangesNoneBefore) {
    const std::vector<NodeId> before = ids(read(Before + "WorldEnd\n")),
                              after = ids(read(Before + After + "WorldEnd\n"));
    const std::set<NodeId> all(after.begin(), after.end());
    EXPECT_EQ(all.size(), after.size());
    EXPECT_GT(after.size(), before.size() + 6);
    for (const NodeId id : before)
        EXPECT_TRUE(all.contains(id)) << scene::to_text(id);
}

TEST(Identity, NamesAreThoseOfTheFile) {
    const scene::Scene s = read(Before + "WorldEnd\n");
    const auto of = [](NodeKind kind, const char* name) { return named_node(NodeId::World, kind, name); };
    EXPECT_EQ(s.primitives[0].node, of(NodeKind::Primitive, "ball"));
    EXPECT_EQ(s.primitives[1].node, numbered_node(NodeId::World, NodeKind::Primitive, 0));
    EXPECT_EQ(s.primitives[2].node, repeated_node(of(NodeKind::Primitive, "ball"), 2));
    EXPECT_EQ(s.light_shaders[0].node, of(NodeKind::Light, "1"));
    EXPECT_EQ(s.light_shaders[1].node, of(NodeKind::Light, "key"));
    EXPECT_EQ(s.groups[0].node, of(NodeKind::Group, "1"));
    EXPECT_EQ(s.groups[1].node, repeated_node(of(NodeKind::Group, "1"), 2)); // of another look
    EXPECT_EQ(s.groups[1].primitives[1].node, named_node(s.groups[1].node, NodeKind::Primitive, "leaf"));
}

TEST(Identity, OfTheSecondOfOneNameIsTold) {
    Journal journal;
    read("WorldBegin\n" + named("ball", Ball + Ball + Ball) + named("cube", Ball + Ball) + "WorldEnd\n",
         &journal);
    const auto entries = journal.entries();
    ASSERT_EQ(entries.size(), 1u);
    EXPECT_EQ(entries[0].severity, Severity::Info);
    EXPECT_EQ(entries[0].where.line, 4);
    EXPECT_TRUE(entries[0].message.starts_with("there is a primitive \"ball\" already"))
        << entries[0].message;
}

TEST(Identity, OfTheSecondLightOfOneHandle) {
    const std::string light = "LightSource \"pointlight\" 1\n";
    const scene::Scene s = read("WorldBegin\n" + light + light + light + Ball + "WorldEnd\n");
    ASSERT_EQ(s.light_shaders.size(), 3u);
    EXPECT_EQ(s.light_shaders[1].handle, "1#2");
    EXPECT_EQ(s.light_shaders[2].handle, "1#3");
}

// In whichever order rays meet them.
TEST(Identity, OfWhatIsReadOnDemand) {
    std::string text = "WorldBegin\n" + Ball;
    for (int i = 0; i < 3; i++)
        text += "Procedural \"DynamicLoad\" [\"two\" \"\"] [-1 1 -1 1 -1 1]\n";
    text += "WorldEnd\n";
    const auto made = [&](std::vector<std::vector<uint32_t>> order) {
        RibOptions options;
        options.procedural = [](const ProceduralRequest&) { return Ball + named("leaf", Ball); };
        std::shared_ptr<scene::Delayed> delayed;
        options.on_demand = &delayed;
        const scene::Scene s = read(text, nullptr, options);
        std::multiset<NodeId> all{s.primitives[0].node};
        for (const auto& which : order)
            delayed->read(which);
        for (const scene::Scene& part : delayed->parts())
            for (const NodeId id : ids(part))
                all.insert(id);
        return all;
    };
    const std::multiset<NodeId> all = made({{0, 1, 2}});
    EXPECT_EQ(std::set(all.begin(), all.end()).size(), 7u);
    EXPECT_EQ(all, made({{2}, {1, 0}}));
}

// Those that procedurals bring are named under them.
TEST(Identity, OfProceduralsInProcedurals) {
    std::string text = "WorldBegin\n";
    for (const char* which : {"a", "b"})
        text += "Procedural \"DynamicLoad\" [\"two\" \"" + std::string(which) + "\"] [-1 1 -1 1 -1 1]\n";
    text += "WorldEnd\n";
    const auto made = [&](std::vector<std::vector<uint32_t>> order) {
        RibOptions options;
        options.procedural = [](const ProceduralRequest& r) {
            const std::string which = r.arguments.back();
            if (which.size() > 1)
                return named("leaf " + which, Ball);
            return named("branch", Ball) + "Procedural \"DynamicLoad\" [\"two\" \"" + which +
                   "1\"] [-1 1 -1 1 -1 1] Procedural \"DynamicLoad\" [\"two\" \"" + which +
                   "2\"] [-1 1 -1 1 -1 1]\n";
        };
        std::shared_ptr<scene::Delayed> delayed;
        options.on_demand = &delayed;
        read(text, nullptr, options);
        std::map<std::string, NodeId> all; // leaves are told apart
        for (const auto& which : order)
            delayed->read(which);
        for (const scene::Scene& part : delayed->parts())
            for (const scene::Primitive& p : part.primitives)
                if (p.attributes->name != "branch")
                    all[p.attributes->name] = p.node;
        return all;
    };
    const auto all = made({{0}, {1}, {2, 3, 4, 5}});
    EXPECT_EQ(all.size(), 4u);
    EXPECT_EQ(all, made({{1}, {0}, {5, 4}, {2, 3}}));
}

} // namespace
} // namespace kanuka::ingest
