#include "scene/editor.h"

#include <charconv>

#include "base/spelling.h"

namespace kanuka::scene {

static_assert(sizeof(NodeId) == 8);

Editor::Editor(Scene& scene, Options& options, Camera& camera, int first_group)
    : m_scene(scene), m_options(options), m_camera(camera), m_first_group(first_group) {
    const bool empty = scene.primitives.empty() && scene.groups.empty() && scene.instances.empty() &&
                       scene.lights.empty() && scene.light_shaders.empty() && scene.solids.empty();
    m_indexed = empty ? Indexed::Named : Indexed::Nothing;
    if (empty)
        m_says_lights = false;
}

void Editor::set_root(NodeId root) {
    m_root = root;
    m_scene.unnamed = {};
}

Editor::Parent Editor::parent(Group& group) {
    return {group.node, group.unnamed, OfGroups + 3 * uint32_t(&group - m_scene.groups.data())};
}

// ---- adding -------------------------------------------------------------------------------------------

Primitive& Editor::add(Group& to, Primitive primitive) {
    to.primitives.push_back(std::move(primitive));
    name_primitive(parent(to), to.primitives.back(), to.primitives.size() - 1);
    return to.primitives.back();
}

Group::Instances& Editor::add(Group::Instances instances) {
    m_scene.instances.push_back(std::move(instances));
    name_instances(world(), m_scene.instances.back(), m_scene.instances.size() - 1);
    return m_scene.instances.back();
}

Group::Instances& Editor::add(Group& to, Group::Instances instances) {
    to.instances.push_back(std::move(instances));
    name_instances(parent(to), to.instances.back(), to.instances.size() - 1);
    return to.instances.back();
}

Group& Editor::add(Group group) {
    m_scene.groups.push_back(std::move(group));
    Group& g = m_scene.groups.back();
    name_node(world(), NodeKind::Group, g.name, g, {Groups, uint32_t(m_scene.groups.size() - 1)});
    const Parent in_group = parent(g);
    // First what brings its id, which none of the others is given then.
    for (const bool brings_its_own : {true, false}) {
        const auto each = [&](auto& nodes, auto name) {
            for (size_t i = 0; i < nodes.size(); i++)
                if (brings_its_own == (nodes[i].node != NodeId::None))
                    (this->*name)(in_group, nodes[i], i);
        };
        each(g.primitives, &Editor::name_primitive);
        each(g.solids, &Editor::name_solid);
        each(g.instances, &Editor::name_instances);
    }
    return g;
}

Light& Editor::add(Light light) {
    m_scene.lights.push_back(std::move(light));
    Light& l = m_scene.lights.back();
    name_node(world(), NodeKind::Light, l.name, l, {Lights, uint32_t(m_scene.lights.size() - 1)});
    return l;
}

ShaderRef& Editor::add(ShaderRef light) {
    m_scene.light_shaders.push_back(std::move(light));
    ShaderRef& l = m_scene.light_shaders.back();
    name_node(world(), NodeKind::Light, l.handle, l,
              {LightShaders, uint32_t(m_scene.light_shaders.size() - 1)});
    return l;
}

Solid& Editor::add(Solid solid) {
    m_scene.solids.push_back(solid);
    name_solid(world(), m_scene.solids.back(), m_scene.solids.size() - 1);
    return m_scene.solids.back();
}

Solid& Editor::add(Group& to, Solid solid) {
    to.solids.push_back(solid);
    name_solid(parent(to), to.solids.back(), to.solids.size() - 1);
    return to.solids.back();
}

// ---- names --------------------------------------------------------------------------------------------

static const Location& where_of(const auto& node) {
    static const Location nowhere;
    if constexpr (requires { node.where; })
        return node.where;
    else
        return nowhere;
}

template <class Node>
void Editor::name_node(const Parent& parent, NodeKind kind, std::string_view name, Node& node, NodePlace at) {
    const bool brings_its_own = node.node != NodeId::None;
    if (!brings_its_own)
        node.node = name.empty() ? free_number(parent, kind)
                                 : free_name(named_node(parent.id, kind, name), kind, name, where_of(node));
    else if (m_indexed != Indexed::All) // numbers that are given from here on may be that one
        index_all();
    const auto id_of = [&](NodePlace p) { return id_at(p); };
    if ((m_indexed == Indexed::All || (m_indexed == Indexed::Named && !name.empty())) &&
        !(brings_its_own && m_index.find(node.node, id_of))) // index_all() has seen it
        m_index.insert(node.node, at, id_of);
    if (m_delta)
        m_delta->note_added(node.node);
}

void Editor::name_primitive(const Parent& parent, Primitive& primitive, size_t index) {
    const std::string_view name = primitive.attributes ? primitive.attributes->name : std::string_view();
    if (primitive.attributes && primitive.attributes->lights_on)
        m_says_lights = true;
    name_node(parent, NodeKind::Primitive, name, primitive, {parent.lists + Primitives, uint32_t(index)});
}

void Editor::name_solid(const Parent& parent, Solid& solid, size_t index) {
    name_node(parent, NodeKind::Solid, {}, solid, {parent.lists + Solids, uint32_t(index)});
}

void Editor::name_instances(const Parent& parent, Group::Instances& instances, size_t index) {
    if (instances.node == NodeId::None) {
        const int local = instances.group - m_first_group;
        const NodeId group = local >= 0 && local < int(m_scene.groups.size())
                                 ? m_scene.groups[size_t(local)].node
                                 : numbered_node(NodeId::World, NodeKind::Group, uint32_t(instances.group));
        instances.node =
            free_name(instances_node(parent.id, group, instances.times.data(), instances.times.size()),
                      NodeKind::Instances, {}, {});
    }
    // By another name than the empty one: they count as named.
    name_node(parent, NodeKind::Instances, "instances", instances,
              {parent.lists + Instances, uint32_t(index)});
}

// A number that was given once is not given again while the editor lives, whatever was removed.
NodeId Editor::free_name(NodeId first, NodeKind kind, std::string_view name, const Location& where) {
    if (!is_taken(first) && !m_repeats.contains(first))
        return first;
    // The object of RIB becomes a group for each look, and may be placed at several times: nobody named them
    // twice.
    if (!m_repeat && kind != NodeKind::Group && kind != NodeKind::Instances)
        m_repeat = {kind, std::string(name), where};
    uint32_t& count = m_repeats[first];
    if (count ==
        0) { // another editor may have begun: up to the first that is free, by doubling, then halving
        uint32_t taken = 1, open = 2;
        for (; is_taken(repeated_node(first, open)); open *= 2)
            taken = open;
        while (open - taken > 1) {
            const uint32_t middle = taken + (open - taken) / 2;
            (is_taken(repeated_node(first, middle)) ? taken : open) = middle;
        }
        count = taken;
    }
    while (is_taken(repeated_node(first, ++count))) {
    }
    return repeated_node(first, count);
}

NodeId Editor::free_number(const Parent& parent, NodeKind kind) {
    for (;;) {
        const NodeId id = numbered_node(parent.id, kind, parent.unnamed[size_t(kind)]++);
        // One that came with its id may have it, but for scenes that were empty and got none such.
        if (m_indexed == Indexed::Named || !is_taken(id))
            return id;
    }
}

std::string Editor::Repeat::message() const {
    return "there is a " + std::string(scene::name(kind)) + " \"" + name + "\" already: this one is \"" +
           name + "#2\" to whoever edits the scene, and so on for others of one name";
}

// ---- the index ----------------------------------------------------------------------------------------

NodeId Editor::id_at(NodePlace at) const {
    const auto id_in = [&](const auto& list) { return list[at.index].node; };
    switch (at.list) {
    case Primitives:
        return id_in(m_scene.primitives);
    case Solids:
        return id_in(m_scene.solids);
    case Instances:
        return id_in(m_scene.instances);
    case Lights:
        return id_in(m_scene.lights);
    case LightShaders:
        return id_in(m_scene.light_shaders);
    case Groups:
        return id_in(m_scene.groups);
    default:
        break;
    }
    const Group& group = m_scene.groups[(at.list - OfGroups) / 3];
    const uint32_t list = (at.list - OfGroups) % 3;
    return list == Primitives ? id_in(group.primitives)
           : list == Solids   ? id_in(group.solids)
                              : id_in(group.instances);
}

void Editor::index_all() const {
    m_index.clear();
    const auto all_of = [&](uint32_t list, const auto& nodes) {
        for (size_t i = 0; i < nodes.size(); i++)
            if (nodes[i].node != NodeId::None) // else it is about to get one
                m_index.insert(nodes[i].node, {list, uint32_t(i)}, [&](NodePlace p) { return id_at(p); });
    };
    all_of(Primitives, m_scene.primitives);
    all_of(Solids, m_scene.solids);
    all_of(Instances, m_scene.instances);
    all_of(Lights, m_scene.lights);
    all_of(LightShaders, m_scene.light_shaders);
    all_of(Groups, m_scene.groups);
    for (size_t g = 0; g < m_scene.groups.size(); g++) {
        const uint32_t first = OfGroups + 3 * uint32_t(g);
        all_of(first + Primitives, m_scene.groups[g].primitives);
        all_of(first + Solids, m_scene.groups[g].solids);
        all_of(first + Instances, m_scene.groups[g].instances);
    }
    m_indexed = Indexed::All;
}

std::optional<NodePlace> Editor::find(NodeId id) const {
    if (m_indexed != Indexed::All)
        index_all();
    return m_index.find(id, [&](NodePlace p) { return id_at(p); });
}

bool Editor::is_taken(NodeId named) {
    if (m_indexed == Indexed::Nothing)
        index_all();
    return m_index.find(named, [&](NodePlace p) { return id_at(p); }).has_value();
}

template <class Node>
Node* Editor::at(NodeId id) const {
    const auto at = find(id);
    if (!at)
        return nullptr;
    const bool in_group = at->list >= OfGroups;
    Group* const group = in_group ? &m_scene.groups[(at->list - OfGroups) / 3] : nullptr;
    const uint32_t list = in_group ? (at->list - OfGroups) % 3 : at->list;
    const auto of = [&](uint32_t which, auto& nodes) -> Node* {
        return list == which ? &nodes[at->index] : nullptr;
    };
    if constexpr (std::is_same_v<Node, Primitive>)
        return of(Primitives, group ? group->primitives : m_scene.primitives);
    else if constexpr (std::is_same_v<Node, Solid>)
        return of(Solids, group ? group->solids : m_scene.solids);
    else if constexpr (std::is_same_v<Node, Group::Instances>)
        return of(Instances, group ? group->instances : m_scene.instances);
    else if constexpr (std::is_same_v<Node, Light>)
        return of(Lights, m_scene.lights);
    else if constexpr (std::is_same_v<Node, ShaderRef>)
        return of(LightShaders, m_scene.light_shaders);
    else
        return of(Groups, m_scene.groups);
}
template Primitive* Editor::at<Primitive>(NodeId) const;
template Solid* Editor::at<Solid>(NodeId) const;
template Group::Instances* Editor::at<Group::Instances>(NodeId) const;
template Light* Editor::at<Light>(NodeId) const;
template ShaderRef* Editor::at<ShaderRef>(NodeId) const;
template Group* Editor::at<Group>(NodeId) const;

// ---- finding ------------------------------------------------------------------------------------------

std::optional<NodeKind> Editor::kind(NodeId id) const {
    if (id == camera_node())
        return NodeKind::Camera;
    const auto at = find(id);
    if (!at)
        return std::nullopt;
    constexpr NodeKind kinds[] = {NodeKind::Primitive, NodeKind::Solid, NodeKind::Instances,
                                  NodeKind::Light,     NodeKind::Light, NodeKind::Group};
    return kinds[at->list < OfGroups ? at->list : (at->list - OfGroups) % 3];
}

std::string_view Editor::name(NodeId id) const {
    if (id == camera_node())
        return "camera";
    if (const auto* p = get<Primitive>(id))
        return p->attributes->name;
    if (const auto* g = get<Group>(id))
        return g->name;
    if (const auto* l = get<Light>(id))
        return l->name;
    if (const auto* l = get<ShaderRef>(id))
        return l->handle;
    return {};
}

std::string Editor::called(NodeId id) const {
    if (id == NodeId::World)
        return "the world";
    const auto found = kind(id);
    if (found == NodeKind::Camera)
        return "the camera";
    const std::string_view given = name(id);
    return (found ? std::string(scene::name(*found)) : "node") + " " +
           (given.empty() ? to_text(id) : "\"" + std::string(given) + "\"");
}

std::vector<NodeId> Editor::find(std::string_view name, NodeId parent) const {
    std::vector<NodeId> all;
    const auto look = [&](std::string_view given, uint32_t number) {
        for (const NodeKind kind :
             {NodeKind::Primitive, NodeKind::Group, NodeKind::Light, NodeKind::Camera}) {
            const NodeId first = named_node(parent, kind, given),
                         id = number < 2 ? first : repeated_node(first, number);
            if (id == camera_node() || find(id))
                all.push_back(id);
        }
    };
    look(name, 1);
    uint32_t number = 0;
    const size_t mark = name.rfind('#');
    if (all.empty() && mark != name.npos)
        if (std::from_chars(name.data() + mark + 1, name.data() + name.size(), number).ptr ==
            name.data() + name.size())
            look(name.substr(0, mark), number);
    return all;
}

std::string Editor::question(std::string_view name, NodeId parent) const {
    Nearest nearest(name);
    const auto offer = [&](const auto& nodes) {
        for (const auto& node : nodes)
            nearest.offer(this->name(node.node));
    };
    if (const Group* group = get<Group>(parent)) {
        offer(group->primitives);
    } else {
        nearest.offer("camera");
        offer(m_scene.primitives), offer(m_scene.groups);
        offer(m_scene.lights), offer(m_scene.light_shaders);
    }
    return nearest.question();
}

} // namespace kanuka::scene
