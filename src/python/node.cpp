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
                all[v.name.c_str()] = parameter_of(v);
    return all;
}

// What a shader was given for a parameter; a copy, since Python's code may run before it is looked at.
std::optional<scene::Value> given_to(const Node& n, const std::string& key) {
    const scene::ShaderRef* shader = n.owner->editor->shader(n.id, n.shader);
    const scene::Value* value = shader ? shader->parameters.find(key.substr(key.rfind(' ') + 1)) : nullptr;
    return value ? std::optional(*value) : std::nullopt;
}

void set(Node& n, const nb::kwargs& given) {
    scene::Set rows{n.id, {}};
    scene::SetParameters parameters{n.id, n.shader, {}};
    for (auto [key, value] : given) {
        const auto name = nb::cast<std::string>(key);
        const scene::ParameterInfo* row = nullptr;
        const bool has_rows = each_row(n, [&](const auto& r, const auto&) {
            if (name == r.name)
                row = &r;
        });
        rows.values.push_back({name, {}}); // refused, where it is no row
        if (row) {
            rows.values.back().value = setting(*row, value, row->name);
        } else if (!has_rows) {
            const auto before = given_to(n, name);
            parameters.values.push_back(before ? parameter_like(*before, name, value)
                                               : parameter(name, value));
        }
    }
    check_idle_for(n); // the values' own code has run
    const bool is_shader = !n.shader.empty() || n.owner->editor->get<scene::ShaderRef>(n.id);
    is_shader ? applied(*n.owner, std::move(parameters)) : applied(*n.owner, std::move(rows));
}

void place(Node& n, nb::handle matrix) {
    if (matrix.is_none())
        wrong_argument("transform", "ArrayLike", matrix);
    if (!n.shader.empty())
        throw nb::value_error("transform: a shader goes with what it shades");
    scene::Placement placement{transform(matrix, "transform")};
    check_idle_for(n);
    applied(*n.owner, scene::Replace{n.id, std::move(placement)});
}

// ---- finding --------------------------------------------------------------------------------------------

// The first of that number in the scene; none = there is no such primitive.
std::optional<NodeId> by_number(Scene& s, int64_t number) {
    const auto known = s.numbers.find(number);
    if (known != s.numbers.end())
        if (const auto* p = s.editor->get<scene::Primitive>(known->second); p && p->id == number)
            return known->second;
    s.numbers.clear();
    for (const scene::Primitive& p : s.scene.primitives)
        s.numbers.try_emplace(p.id, p.node);
    for (const scene::Group& g : s.scene.groups)
        for (const scene::Primitive& p : g.primitives)
            s.numbers.try_emplace(p.id, p.node);
    const auto found = s.numbers.find(number);
    return found == s.numbers.end() ? std::nullopt : std::optional(found->second);
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

bool has_nodes(const Node& n) {
    return n.id == NodeId::World || (n.shader.empty() && n.owner->editor->get<scene::Group>(n.id));
}

// The nodes that a step leads to: those of that name in the world or a group, or one shader.
std::vector<Node> step_from(const Node& n, const std::string& name) {
    std::vector<Node> all;
    if (has_nodes(n)) {
        for (const NodeId id : n.owner->editor->find(name, n.id))
            all.push_back({n.owner, id});
        return all;
    }
    Node next = n;
    next.shader.push_back(name);
    if (n.owner->editor->shader(next.id, next.shader))
        all.push_back(std::move(next));
    return all;
}

// Of a shader its owner's kind will do as well.
bool is_of_kind(const Node& n, const std::string& kind) {
    return kind.empty() || scene::name(kind_of(n)) == kind ||
           scene::name(*n.owner->editor->kind(n.id)) == kind;
}

[[noreturn]] void nothing_there(const std::vector<Node>& from, const std::string& name,
                                const std::string& kind) {
    const scene::Editor& editor = *from[0].owner->editor;
    if (from.size() == 1 && !has_nodes(from[0]) && kind.empty())
        shader(from[0], {name}); // says what there is
    if (from.size() == 1)
        throw nb::value_error(("there is no " + (kind.empty() ? "node" : kind) + " \"" + name + "\"" +
                               editor.question(name, from[0].id))
                                  .c_str());
    std::string all;
    for (const Node& n : from)
        all += (all.empty() ? "" : ", ") + editor.called(n.id);
    throw nb::value_error(("none of " + all + " has \"" + name + "\"").c_str());
}

// Down from a node. The kind is that of what is looked for, not of what it is in: of several nodes of a name
// those count that the next step leads on from.
Node find(const Node& start, const nb::args& path, const nb::kwargs& keywords) {
    std::string kind;
    for (auto [key, value] : keywords) {
        if (nb::cast<std::string>(key) != "kind")
            unknown_argument("node", nb::cast<std::string>(key), {"kind"});
        if (!value.is_none())
            kind = argument<std::string>(value, "kind");
    }
    const bool in_world = start.id == NodeId::World;
    if (path.size() == 0)
        throw nb::type_error(in_world ? "node() needs a name, or a primitive's number"
                                      : "node() needs a name");
    std::vector<Node> found{start};
    for (size_t i = 0; i < path.size(); i++) {
        const nb::object step = path[i];
        if (i == 0 && in_world && nb::isinstance<nb::int_>(step)) {
            const auto number = argument<int64_t>(step, "path");
            const auto id = by_number(*start.owner, number);
            if (!id)
                throw nb::value_error(("there is no primitive of number " + std::to_string(number)).c_str());
            found.assign(1, Node{start.owner, *id});
            continue;
        }
        const auto name = argument<std::string>(step, "path");
        std::vector<Node> next;
        for (const Node& n : found)
            for (Node& there : step_from(n, name))
                next.push_back(std::move(there));
        const std::vector<Node> before = next;
        if (i + 1 == path.size())
            std::erase_if(next, [&](const Node& n) { return !is_of_kind(n, kind); });
        if (next.empty())
            nothing_there(found, name, before.empty() && !has_nodes(found[0]) ? "" : kind);
        found = std::move(next);
    }
    if (found.size() == 1)
        return found[0];
    std::string kinds;
    for (const Node& n : found)
        kinds += (kinds.empty() ? "" : ", ") + std::string(scene::name(kind_of(n)));
    const nb::object last = path[path.size() - 1];
    throw nb::value_error(("\"" + nb::cast<std::string>(nb::str(last)) +
                           "\" is the name of several nodes: say kind=, one of " + kinds)
                              .c_str());
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
        if (!n)
            throw nb::type_error("nodes: expected Sequence[Node], got None in it");
        if (n->owner.get() != &s)
            throw nb::value_error("nodes: one belongs to another scene");
        if (kind_of(*n) == NodeKind::Shader)
            throw nb::value_error("nodes: a shader goes with what it shades");
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
    node.def(
        "node",
        [](const Node& n, const nb::args& path, const nb::kwargs& keywords) {
            return find(n, path, keywords);
        },
        nb::sig("def node(self, *path: str, kind: str | None = None) -> Node"),
        "A node in a group, or a shader, as Scene.node() finds it from there.");
    node.def(
        "__eq__",
        [](const Node& a, const Node& b) {
            return a.owner == b.owner && a.id == b.id && a.shader == b.shader;
        },
        nb::is_operator());
    node.def("__hash__", [](const Node& n) { return size_t(n.id); });
}

void bind_nodes_of(nb::class_<Scene>& scene) {
    scene.def(
        "node",
        [](std::shared_ptr<Scene> s, const nb::args& path, const nb::kwargs& keywords) {
            return find({s, NodeId::World}, path, keywords);
        },
        nb::sig("def node(self, *path: str | int, kind: str | None = None) -> Node"),
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
