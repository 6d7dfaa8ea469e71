#include "scene/summary.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace kanuka::scene {

static Primitive sphere(double x) {
    Primitive p;
    p.geometry = Quadric{Quadric::Kind::Sphere, {1, -1, 1, 360}};
    p.world_from_object = Transform::translate(x, 0, 0);
    auto a = std::make_shared<Attributes>();
    a->surface = ShaderRef{"plastic", "", {}, {}, {}};
    p.attributes = a;
    return p;
}

static Group::Instances instances(int group, std::vector<float> x) {
    Group::Instances r;
    r.group = group;
    std::vector<float> t;
    for (const float v : x)
        t.insert(t.end(), {1, 0, 0, v, 0, 1, 0, 0, 0, 0, 1, 0});
    r.transforms = std::move(t);
    return r;
}

static Scene example() {
    Scene s;
    s.file = "example \"quoted\".rib";
    s.primitives.push_back(sphere(0));
    s.groups.resize(2);
    s.groups[0].primitives = {sphere(0), sphere(2)};
    s.groups[1].instances = {instances(0, {0, 10})};
    s.instances = {instances(1, {100})};
    s.light_shaders = {ShaderRef{"pointlight", "1", {}, {}, {}}, ShaderRef{"pointlight", "2", {}, {}, {}}};
    return s;
}

TEST(Summary, CountsThroughInstances) {
    const Summary s = summarize(example());
    EXPECT_EQ(s.primitives, 1u);
    EXPECT_EQ(s.group_primitives, 2u);
    EXPECT_EQ(s.instances, 1u);
    EXPECT_EQ(s.instanced_primitives, 4u);
    EXPECT_EQ(s.by_kind.at("Sphere"), 3u);
    EXPECT_EQ(s.surfaces.at("plastic"), 3u);
    EXPECT_EQ(s.light_shaders.at("pointlight"), 2u);
    EXPECT_EQ(s.bounds.lo.x, -1);
    EXPECT_EQ(s.bounds.hi.x, 113);
    EXPECT_EQ(s.bounds.hi.z, 1);
}

TEST(Summary, JsonAndText) {
    const auto j = nlohmann::json::parse(to_json(summarize(example())));
    EXPECT_EQ(j["file"], "example \"quoted\".rib");
    EXPECT_EQ(j["primitives"]["by_kind"]["Sphere"], 3);
    EXPECT_EQ(j["instances"]["primitives"], 4);
    EXPECT_EQ(j["bounds"][1][0], 113);
    EXPECT_EQ(j["camera"]["projection"], "perspective");
    EXPECT_TRUE(nlohmann::json::parse(to_json(summarize(Scene{})))["bounds"].is_null());
    EXPECT_NE(to_text(summarize(example())).find("3 (Sphere 3)"), std::string::npos)
        << to_text(summarize(example()));
}

} // namespace kanuka::scene
