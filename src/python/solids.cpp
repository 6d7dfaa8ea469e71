// Solids: trees of set operations on what shapes enclose.
#include <algorithm>

#include "python/arguments.h"
#include "python/looks.h"

namespace kanuka::python {

namespace {

constexpr const char* Kinds[] = {"primitive", "union", "intersection", "difference"};

scene::Solid::Kind kind_of(const std::string& kind) {
    const auto found = std::ranges::find(Kinds, kind, [](const char* k) { return std::string(k); });
    if (found == std::end(Kinds))
        throw nb::value_error(("kind: \"" + kind +
                               "\" is not one of \"primitive\", \"union\", \"intersection\", \"difference\"")
                                  .c_str());
    return scene::Solid::Kind(found - std::begin(Kinds));
}

std::vector<scene::Solid>& solids_of(const Solid& at) {
    if (at.group == scene::NodeId::None)
        return at.owner->scene.solids;
    return Group{at.owner, at.group}.get().solids;
}

Solid add_solid(const std::shared_ptr<Scene>& scene, scene::NodeId group, const std::string& kind,
                const Solid* parent) {
    check_idle(*scene);
    scene::Solid solid{kind_of(kind), -1};
    Solid made{scene, group, scene::NodeId::None};
    if (parent) {
        const auto& all = solids_of(made);
        const auto found = std::ranges::find(all, parent->id, &scene::Solid::node);
        if (found == all.end())
            throw nb::value_error("the solid was removed from its scene");
        if (found->kind == scene::Solid::Kind::Primitive)
            throw nb::value_error("a primitive has shapes, and no parts: add them to a union");
        solid.parent = int(found - all.begin());
    }
    made.id = (group == scene::NodeId::None ? scene->editor->add(solid)
                                            : scene->editor->add(Group{scene, group}.get(), solid))
                  .node;
    return made;
}

constexpr const char* Doc =
    "Begins a solid: 'union', 'intersection', 'difference' (the first less all others), or 'primitive',\n"
    "whose shapes enclose it together. Parts are added by its add(), shapes by solid=: "
    "add_sphere(solid=cut).";

} // namespace

void bind_solids_of(nb::class_<Scene>& scene, nb::class_<Group>& group) {
    define(
        scene, "add_solid",
        [](std::shared_ptr<Scene> s, const std::string& kind) {
            return add_solid(s, scene::NodeId::None, kind, nullptr);
        },
        nb::arg("kind"), Doc);
    define(
        group, "add_solid",
        [](const Group& g, const std::string& kind) { return add_solid(g.owner, g.id, kind, nullptr); },
        nb::arg("kind"), Doc);
}

void bind_solids(nb::module_& m) {
    nb::class_<Solid> solid(m, "Solid", "A node of a tree of set operations; made by Scene.add_solid().");
    define(
        solid, "add",
        [](const Solid& s, const std::string& kind) { return add_solid(s.owner, s.group, kind, &s); },
        nb::arg("kind"), "Adds a part to it, of the same kinds.");
    solid.def_prop_ro("kind", [](const Solid& s) {
        for (const scene::Solid& each : solids_of(s))
            if (each.node == s.id)
                return std::string(Kinds[size_t(each.kind)]);
        throw nb::value_error("the solid was removed from its scene");
    });
}

} // namespace kanuka::python
