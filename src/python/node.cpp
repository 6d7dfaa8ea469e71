// Nodes of a scene: what was added, by its name, to be changed or removed.
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "python/keywords.h"
#include "python/parameters.h"
#include "python/values.h"
#include "scene/schema/attributes.h"
#include "scene/schema/camera.h"
#include "scene/schema/lights.h"

namespace kanuka::python {

scene::NodeId applied(Scene& scene, scene::Edit edit) {
    const scene::Outcome outcome = scene.editor->apply(std::move(edit));
    if (!outcome.refusal.empty())
        throw nb::value_error(outcome.refusal.c_str());
    return outcome.id;
}

namespace {

using scene::NodeId;
using scene::NodeKind;

NodeKind kind_of(const Node& n) {
    if (const auto kind = n.owner->editor->kind(n.id))
        return n.shader.empty() ? *kind : NodeKind::Shader;
    throw nb::value_error("the node was removed from its scene");
}

// While a scene is rendered, what is asked of it for the next picture may change.
void check_idle_for(const Node& n) {
    if (kind_of(n) != NodeKind::Camera)
        check_idle(*n.owner);
}

// ---- parameters -----------------------------------------------------------------------------------------

// What has rows in the schema: `use` gets the row and the thing that it reads. False = it has none.
template <class Use>
bool each_row(const Node& n, const Use& use) {
    const scene::Editor& editor = *n.owner->editor;
    if (!n.shader.empty())
        return false;
    if (kind_of(n) == NodeKind::Camera) {
        for (const scene::CameraParameter& row : scene::camera_parameters())
            use(row, n.owner->camera.camera);
    } else if (const auto* primitive = editor.get<scene::Primitive>(n.id)) {
        for (const scene::AttributeParameter& row : scene::attribute_parameters())
            use(row, *primitive->attributes);
    } else if (const auto* light = editor.get<scene::Light>(n.id); light && light->source) {
        for (const scene::LightParameter& row : scene::light_parameters())
            if (row.is_of(*light->source->kind))
                use(row, light->source->settings);
    } else {
        return false;
    }
    return true;
}

nb::dict parameters_of(const Node& n) {
    nb::dict all;
    const bool rows =
        each_row(n, [&](const auto& row, const auto& of) { all[row.name] = object_of(row, row.get(of)); });
    if (!rows)
        if (const scene::ShaderRef* shader = n.owner->editor->shader(n.id, n.shader))
            for (const scene::Value& v : shader->parameters.values)
                all[v.name.c_str()] = value_of(v);
    return all;
}

void set(Node& n, const nb::kwargs& given) {
    check_idle_for(n);
    scene::Set rows{n.id, {}};
    scene::SetParameters parameters{n.id, n.shader, {}};
    bool has_rows = false;
    for (auto [key, value] : given) {
        const auto name = nb::cast<std::string>(key);
        rows.values.push_back({name, {}}); // refused, where it is no row
        has_rows = each_row(n, [&](const auto& row, const auto&) {
            if (name == row.name)
                rows.values.back().value = setting(row, value, row.name);
        });
        if (!has_rows)
            parameters.values.push_back(parameter(name, value));
    }
    const bool is_shader = !n.shader.empty() || n.owner->editor->get<scene::ShaderRef>(n.id);
    is_shader ? applied(*n.owner, std::move(parameters)) : applied(*n.owner, std::move(rows));
}

void place(Node& n, nb::handle matrix) {
    if (matrix.is_none())
        wrong_argument("transform", "ArrayLike", matrix);
    check_idle_for(n);
    if (!n.shader.empty())
        throw nb::value_error("transform: a shader goes with what it shades");
    applied(*n.owner, scene::Replace{n.id, scene::Placement{transform(matrix, "transform")}});
}

// ---- finding --------------------------------------------------------------------------------------------

[[noreturn]] void not_one(const scene::Editor& editor, const std::string& name,
                          const std::vector<NodeId>& found, const std::string& kind, NodeId parent) {
    if (found.empty())
        throw nb::value_error(("there is no " + (kind.empty() ? "node" : kind) + " \"" + name + "\"" +
                               editor.question(name, parent))
                                  .c_str());
    std::string kinds;
    for (const NodeId id : found)
        kinds += (kinds.empty() ? "" : ", ") + std::string(scene::name(*editor.kind(id)));
    throw nb::value_error(
        ("\"" + name + "\" is the name of several nodes: say kind=, one of " + kinds).c_str());
}

NodeId find(const scene::Editor& editor, const std::string& name, const std::string& kind, NodeId parent) {
    std::vector<NodeId> found = editor.find(name, parent);
    if (!kind.empty())
        std::erase_if(found, [&](NodeId id) { return scene::name(*editor.kind(id)) != kind; });
    if (found.size() != 1)
        not_one(editor, name, found, kind, parent);
    return found[0];
}

NodeId by_number(const Scene& s, int64_t number) {
    for (const scene::Primitive& p : s.scene.primitives)
        if (p.id == number)
            return p.node;
    for (const scene::Group& g : s.scene.groups)
        for (const scene::Primitive& p : g.primitives)
            if (p.id == number)
                return p.node;
    throw nb::value_error(("there is no primitive of number " + std::to_string(number)).c_str());
}

// A shader of it, down from the slot.
Node shader(const Node& n, std::vector<std::string> path) {
    Node result = n;
    result.shader.insert(result.shader.end(), path.begin(), path.end());
    if (!n.owner->editor->shader(result.id, result.shader))
        // Says what there is: an edit of nothing is refused as any other of that shader.
        applied(*n.owner, scene::SetParameters{result.id, result.shader, {}});
    return result;
}

Node node(std::shared_ptr<Scene> s, const nb::args& path, const nb::kwargs& keywords) {
    std::string kind;
    for (auto [key, value] : keywords) {
        if (nb::cast<std::string>(key) != "kind")
            unknown_argument("node", nb::cast<std::string>(key), {"kind"});
        kind = argument<std::string>(value, "kind");
    }
    if (path.size() == 0)
        throw nb::type_error("node() needs a name, or a primitive's number");
    Node result{s, NodeId::World};
    std::vector<std::string> slots;
    for (size_t i = 0; i < path.size(); i++) {
        const bool is_parent = result.id == NodeId::World || s->editor->get<scene::Group>(result.id);
        const nb::object step = path[i];
        if (i == 0 && nb::isinstance<nb::int_>(step))
            result.id = by_number(*s, argument<int64_t>(step, "path"));
        else if (const auto name = argument<std::string>(step, "path"); !is_parent)
            slots.push_back(name);
        else // the kind is that of what is looked for, not of the group around it
            result.id = find(*s->editor, name, i + 1 < path.size() ? "" : kind, result.id);
    }
    return slots.empty() ? result : shader(result, std::move(slots));
}

std::string repr(const Node& n) {
    std::string slots;
    for (const std::string& slot : n.shader)
        slots += ", " + slot;
    return "<kanuka.Node: " + n.owner->editor->called(n.id) + slots + ">";
}

void remove(Scene& s, const std::vector<Node*>& nodes) {
    check_idle(s);
    scene::Remove edit;
    for (const Node* n : nodes) {
        if (n->owner.get() != &s)
            throw nb::value_error("nodes: one belongs to another scene");
        if (kind_of(*n) == NodeKind::Shader)
            throw nb::value_error("nodes: a shader goes with what it shades");
        if (kind_of(*n) == NodeKind::Group && s.delayed)
            throw nb::value_error("nodes: groups stay in a scene that is read on demand, whose other groups "
                                  "are numbered by them");
        edit.ids.push_back(n->id);
    }
    applied(s, std::move(edit));
}

} // namespace

void bind_node(nb::module_& m) {
    nb::class_<Node> node(m, "Node",
                          "What was added to a scene: a primitive, group, light, … or a shader of one. It is "
                          "found by its name, Scene.node(), and stays what it is whatever else is changed.");
    node.def_prop_ro(
        "id", [](const Node& n) { return uint64_t(n.id); },
        "64 bits: the same in every reading of a file. A shader has its owner's.");
    node.def_prop_ro("kind", [](const Node& n) { return std::string(scene::name(kind_of(n))); });
    node.def_prop_ro(
        "name", [](const Node& n) { return std::string(n.owner->editor->name(n.id)); },
        "The one that was given; '' = none.");
    node.def_prop_ro("parameters", &parameters_of,
                     "What can be set, by name; of a shader what was given, others have their defaults.",
                     nb::sig("def parameters(self) -> dict[str, object]"));
    define(
        node, "set", &set, nb::arg("parameters"), nb::sig("def set(self, **parameters: object) -> None"),
        "Sets parameters: attributes of primitives (kanuka.attribute_parameters()), what lights and cameras "
        "take\n"
        "(light_kinds(), camera_parameters()), or a shader's own. All or, with a ValueError, none.");
    define(node, "place", &place, nb::arg("transform"),
           nb::sig("def place(self, transform: ArrayLike) -> None"),
           "Places a primitive or light: 4x4, acting on columns, as when it was added.");
    node.def(
        "shader",
        [](const Node& n, const nb::args& path) {
            std::vector<std::string> slots;
            for (const nb::handle slot : path)
                slots.push_back(argument<std::string>(slot, "path"));
            return shader(n, std::move(slots));
        },
        nb::sig("def shader(self, *path: str) -> Node"),
        "A shader of a primitive: 'surface', 'displacement', 'interior', …, then handles of co-shaders.");
    node.def("__repr__", &repr);
    node.def("__eq__", [](const Node& a, const Node& b) {
        return a.owner == b.owner && a.id == b.id && a.shader == b.shader;
    });
    node.def("__hash__", [](const Node& n) { return size_t(n.id); });
}

void bind_nodes_of(nb::class_<Scene>& scene) {
    scene.def("node", &node, nb::sig("def node(self, *path: str | int, kind: str = '') -> Node"),
              "The node of a name: a primitive, group or light, or 'camera'; inside of a group after the "
              "group's name.\n"
              "After a primitive come its shaders: node('ball', 'surface'). The second of one name is "
              "'ball#2'. A number is a\n"
              "primitive's, as add_mesh() returns it. `kind` tells nodes of one name apart: 'light', …");
    define(scene, "remove", &remove, nb::arg("nodes"),
           nb::sig("def remove(self, nodes: Sequence[Node]) -> None"),
           "Removes nodes, all or none; a group goes with what is in it, and not while it is placed.");
}

} // namespace kanuka::python
