// What tests of edits share: nodes, and what a scene's nodes are, in words.
#pragma once

#include <map>

#include "scene/editor.h"
#include "scene/schema/lights.h"

namespace kanuka::scene::testing {

// What is told of a node, by what it is.
using Description = std::map<std::string, std::string>;
inline std::string text(double x) {
    return std::to_string(x);
}
template <class Numbers>
inline std::string text_of(const Numbers& numbers) {
    std::string all;
    for (const auto x : numbers)
        all += text(double(x)) + " ";
    return all;
}
inline std::string text(const Transform& t) {
    std::string all;
    for (const auto& row : t.m)
        all += text_of(row);
    return all;
}
inline std::string parameters(const ShaderRef& shader) {
    std::string all = shader.name;
    for (const Value& v : shader.parameters.values)
        all += " " + v.name + "=" + text_of(v.floats);
    for (const ShaderRef& c : shader.coshaders)
        all += " (" + c.handle + ": " + parameters(c) + ")";
    return all;
}

// What a scene's nodes are, read back from the scene.
inline Description described(const Primitive& p) {
    const Attributes& a = *p.attributes;
    Description d{{"name", a.name},
                  {"radius", text(double(std::get<Quadric>(p.geometry).arguments[0]))},
                  {"place", text(p.world_from_object)},
                  {"visible_camera", text(a.visible_camera)},
                  {"displacement_bound", text(double(a.displacement_bound))},
                  {"surface", parameters(*a.surface)},
                  {"primvars", ""}};
    for (const Value& v : p.primvars.values)
        d["primvars"] += v.name + " " + text_of(v.floats);
    for (const std::string& light : a.lights_off)
        d["lights_off"] += light + " ";
    return d;
}
inline Description described(const Light& l) {
    return {{"name", l.name},
            {"amount", text_of(std::array{l.amount.x, l.amount.y, l.amount.z})},
            {"radius", text(double(l.radius))},
            {"place", text(l.world_from_light)}};
}
inline Description described(const ShaderRef& l) {
    return {{"name", l.handle}, {"shader", parameters(l)}, {"place", text(l.world_from_shader)}};
}

// The scene as the model should have it, in order.
inline std::vector<std::pair<NodeId, Description>> described(const Scene& s) {
    std::vector<std::pair<NodeId, Description>> all;
    const auto take = [&](const auto& nodes, const std::string& parent) {
        for (const auto& n : nodes) {
            all.emplace_back(n.node, described(n));
            all.back().second["parent"] = parent;
        }
    };
    const auto instances = [&](const std::vector<Group::Instances>& list, const std::string& parent) {
        for (const Group::Instances& i : list)
            all.push_back({i.node,
                           {{"group", to_text(s.groups[size_t(i.group)].node)},
                            {"places", text_of(i.transforms)},
                            {"parent", parent}}});
    };
    take(s.primitives, "");
    instances(s.instances, "");
    take(s.lights, "");
    take(s.light_shaders, "");
    for (const Group& g : s.groups) {
        all.push_back({g.node, {{"name", g.name}, {"parent", ""}}});
        take(g.primitives, to_text(g.node));
        instances(g.instances, to_text(g.node));
    }
    return all;
}

// ---- making nodes -------------------------------------------------------------------------------------

inline Value floats(std::string name, Type type, std::vector<float> numbers) {
    Value v;
    v.name = std::move(name);
    v.type = type;
    v.detail = Detail::Constant;
    v.floats = std::move(numbers);
    return v;
}
inline ShaderRef shader(const std::string& name) {
    ShaderRef s;
    s.name = name;
    s.parameters.set(floats("Kd", Type::Float, {1}));
    ShaderRef inner;
    inner.name = "tint";
    inner.handle = "base";
    inner.parameters.set(floats("c", Type::Color, {1, 1, 1}));
    s.coshaders.push_back(inner);
    return s;
}
inline Primitive ball(const std::string& name, float radius = 1) {
    Primitive p;
    p.geometry = Quadric{Quadric::Kind::Sphere, {radius, -radius, radius, 360}};
    auto a = std::make_shared<Attributes>();
    a->name = name;
    a->surface = shader("matte");
    p.attributes = std::move(a);
    return p;
}
inline Light finished(const LightSource& source) {
    Light l = source.settings.light;
    l.world_from_light = source.placement;
    return l;
}
inline Light lamp(const std::string& name) {
    const LightKind* kind = find_light_kind("point");
    LightSource source{kind, kind->defaults(), {}, finished};
    source.settings.light.name = name;
    Light l = finished(source);
    l.source = std::make_shared<const LightSource>(source);
    return l;
}
inline ShaderRef light_shader(const std::string& handle) {
    ShaderRef s;
    s.name = "pointlight";
    s.handle = handle;
    return s;
}
inline Setting number(double x) {
    return {{x}, {}};
}

} // namespace kanuka::scene::testing
