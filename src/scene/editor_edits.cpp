// Add, Remove, Replace.
#include <algorithm>

#include "scene/edit_checks.h"
#include "scene/links.h"
#include "scene/schema/camera.h"
#include "scene/schema/lights.h"

namespace kanuka::scene {

namespace {

template <class... F>
struct Overloaded : F... {
    using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

std::string no_node(NodeId id) {
    return "there is no node " + to_text(id);
}

} // namespace

Outcome Editor::apply(Edit edit) {
    return std::visit(Overloaded{[&](Add& e) { return add(std::move(e)); },
                                 [&](Remove& e) { return remove(e); }, [&](Set& e) { return set(e); },
                                 [&](SetParameters& e) { return set(std::move(e)); },
                                 [&](Replace& e) { return replace(std::move(e)); }},
                      edit);
}

// ---- Add ----------------------------------------------------------------------------------------------

// Where a node goes: the group, null = the world.
std::optional<Outcome> Editor::find_parent(const Add& edit, Group*& group) {
    group = nullptr;
    const auto refused = [](const std::string& why) { return Outcome{NodeId::None, "parent: " + why}; };
    if (edit.parent != NodeId::World) {
        const auto at = find(edit.parent);
        if (!at)
            return refused(no_node(edit.parent));
        if (at->list != Groups)
            return refused(called(edit.parent) + " has no nodes of its own; the world has, and groups");
        group = &m_scene.groups[at->index];
    }
    const bool in_groups =
        std::holds_alternative<Primitive>(edit.node) || std::holds_alternative<Group::Instances>(edit.node);
    if (group && !in_groups)
        return refused("groups hold primitives and instances; the world holds all else");
    const bool is_group = std::holds_alternative<Group>(edit.node);
    if (is_group && m_keeps_groups)
        return refused("other scenes' groups are numbered on from this one's, which takes no more of them");
    if (is_group && m_scene.groups.size() >= (NodeIndex::MostLists - 1 - OfGroups) / 3)
        return Outcome{NodeId::None, "there are " + std::to_string(m_scene.groups.size()) +
                                         " groups, as many as there can be"};
    return std::nullopt;
}

// What is wrong with a node that is to be added.
Fault Editor::fault_of_new(const Add& edit, const Group* group) const {
    const size_t groups_before =
        size_t(m_first_group) + (group ? size_t(group - m_scene.groups.data()) : m_scene.groups.size());
    return std::visit(Overloaded{[&](const Primitive& p) {
                                     return fault_of(p, group ? group->solids.size() : m_scene.solids.size());
                                 },
                                 [&](const Group& g) { return fault_of(g, groups_before); },
                                 [&](const Group::Instances& i) { return fault_of(i, groups_before); },
                                 [&](const Light& l) { return fault_of(l.world_from_light); },
                                 [&](const ShaderRef& l) { return fault_of(l.world_from_shader); },
                                 [&](const Solid& s) {
                                     return s.parent < int(m_scene.solids.size())
                                                ? Fault()
                                                : "solids come after their parents";
                                 }},
                      edit.node);
}

// Are the ids that the nodes come with, if any, still free?
bool Editor::ids_are_free(const Add& edit) const {
    std::set<NodeId> given;
    const auto is_free = [&](const auto& node) {
        const NodeId id = node.node;
        return id == NodeId::None ||
               (id != NodeId::World && id != camera_node() && !find(id) && given.insert(id).second);
    };
    return std::visit(Overloaded{[&](const Group& g) {
                                     return is_free(g) && std::ranges::all_of(g.primitives, is_free) &&
                                            std::ranges::all_of(g.solids, is_free) &&
                                            std::ranges::all_of(g.instances, is_free);
                                 },
                                 [&](const auto& node) { return is_free(node); }},
                      edit.node);
}

Outcome Editor::add(Add edit) {
    Group* group;
    if (const auto refused = find_parent(edit, group))
        return *refused;
    if (const Fault fault = fault_of_new(edit, group))
        return {NodeId::None, *fault};
    if (!ids_are_free(edit))
        return {NodeId::None,
                "the id that it comes with is another node's: leave it out, or remove that one"};
    std::optional<LightSwitch> on; // few bring sets of lights
    const auto turn_on = [&](Primitive& p) {
        if (!p.attributes->lights_on || m_lights.empty())
            return;
        if (!on)
            on.emplace(m_lights);
        on->turn_on(p);
    };
    const NodeId id = std::visit(
        [&](auto& node) {
            using T = std::remove_cvref_t<decltype(node)>;
            if constexpr (std::is_same_v<T, Primitive>)
                turn_on(node);
            if constexpr (std::is_same_v<T, Group>)
                std::ranges::for_each(node.primitives, turn_on);
            if constexpr (std::is_same_v<T, ShaderRef>)
                if (!node.stand_in && m_stand_in_for)
                    node.stand_in = m_stand_in_for(node);
            if constexpr (std::is_same_v<T, Light>)
                if (node.node == NodeId::None && !has_light(node.name))
                    shine(node.name);
            if constexpr (std::is_same_v<T, ShaderRef>)
                if (node.node == NodeId::None && !has_light(node.handle))
                    shine(node.handle);
            if constexpr (std::is_same_v<T, Primitive> || std::is_same_v<T, Group::Instances>)
                return group ? add(*group, std::move(node)).node : add(std::move(node)).node;
            else
                return add(std::move(node)).node;
        },
        edit.node);
    return {id, {}};
}

bool Editor::has_light(std::string_view name) const {
    return std::ranges::any_of(m_scene.lights, [&](const Light& l) { return l.name == name; }) ||
           std::ranges::any_of(m_scene.light_shaders, [&](const ShaderRef& l) { return l.handle == name; });
}

// A light that is new shines on what was there before it. One that comes back, or shares another's name,
// shines on what it did.
void Editor::shine(const std::string& light) {
    const auto say = [](const std::vector<Primitive>& primitives) {
        return std::ranges::any_of(
            primitives, [](const Primitive& p) { return p.attributes && p.attributes->lights_on; });
    };
    if (!m_says_lights)
        m_says_lights = say(m_scene.primitives) || std::ranges::any_of(m_scene.groups, [&](const Group& g) {
                            return say(g.primitives);
                        });
    if (*m_says_lights)
        LightSwitch({light}).turn_on(m_scene, [&](NodeId id) {
            if (m_delta)
                m_delta->note_changed(id, Aspect::Links);
        });
    if (std::ranges::find(m_lights, light) == m_lights.end())
        m_lights.push_back(light);
}

// ---- Remove -------------------------------------------------------------------------------------------

namespace {

// What stays of a list keeps its order.
template <class Node>
void take_out(std::vector<Node>& list, const std::set<NodeId>& ids) {
    std::erase_if(list, [&](const Node& n) { return ids.contains(n.node); });
}

template <class Do>
void for_each_in(const Group& group, const Do& what) {
    for (const Primitive& p : group.primitives)
        what(p.node);
    for (const Solid& s : group.solids)
        what(s.node);
    for (const Group::Instances& i : group.instances)
        what(i.node);
}

// Where each index of the list goes to; -1 = it is taken out.
template <class Node>
std::vector<int> new_indices(const std::vector<Node>& list, const std::set<NodeId>& ids) {
    std::vector<int> to;
    int next = 0;
    for (const Node& n : list)
        to.push_back(ids.contains(n.node) ? -1 : next++);
    return to;
}

} // namespace

Editor::Uses Editor::uses_beside(const std::set<NodeId>& all) const {
    Uses uses{std::vector<size_t>(m_scene.groups.size()), std::vector<size_t>(m_scene.solids.size())};
    const auto count = [](std::vector<size_t>& of, int number) {
        if (number >= 0 && size_t(number) < of.size())
            of[size_t(number)]++;
    };
    const auto places = [&](const std::vector<Group::Instances>& list) {
        for (const Group::Instances& i : list)
            if (!all.contains(i.node))
                count(uses.groups, i.group - m_first_group);
    };
    places(m_scene.instances);
    for (const Group& g : m_scene.groups)
        if (!all.contains(g.node))
            places(g.instances);
    for (const Solid& s : m_scene.solids)
        if (!all.contains(s.node))
            count(uses.solids, s.parent);
    if (!m_scene.solids.empty())
        for (const Primitive& p : m_scene.primitives)
            if (!all.contains(p.node))
                count(uses.solids, p.solid);
    return uses;
}

// Why it cannot go while all others stay.
Fault Editor::fault_of_removal(NodeId id, const Uses& uses) const {
    const auto at = find(id);
    if (!at)
        return id == NodeId::World || id == camera_node() ? called(id) + " cannot be removed" : no_node(id);
    if (at->list == Groups) {
        if (m_first_group > 0 || m_keeps_groups)
            return called(id) + " stays: groups of other scenes are numbered on from this one's";
        if (const size_t places = uses.groups[at->index]; places > 0)
            return called(id) + " is placed by " + std::to_string(places) +
                   " instances; remove those as well";
    }
    if (at->list == Solids && uses.solids[at->index] > 0)
        return called(id) + " has primitives or solids in it; remove those as well";
    if (at->list >= OfGroups && (at->list - OfGroups) % 3 == Solids)
        return called(id) + " goes with its group; remove that";
    return std::nullopt;
}

Outcome Editor::remove(const Remove& edit) {
    std::set<NodeId> all(edit.ids.begin(), edit.ids.end());
    const Uses uses = uses_beside(all);
    bool solids = false, groups = false, in_groups = false;
    for (const NodeId id : edit.ids) {
        if (const Fault fault = fault_of_removal(id, uses))
            return {NodeId::None, *fault};
        const uint32_t list = find(id)->list;
        solids |= list == Solids;
        groups |= list == Groups;
        in_groups |= list >= OfGroups;
    }
    if (m_delta) {
        std::set<NodeId> gone = all;
        for (const NodeId id : all)
            if (const Group* group = get<Group>(id))
                for_each_in(*group, [&](NodeId in) { gone.insert(in); });
        for (const NodeId id : gone)
            m_delta->note_removed(id);
    }
    // Numbers of what others mean by number.
    if (solids) {
        const std::vector<int> to = new_indices(m_scene.solids, all);
        for (Solid& s : m_scene.solids)
            s.parent = s.parent < 0 || all.contains(s.node) ? s.parent : to[size_t(s.parent)];
        for (Primitive& p : m_scene.primitives)
            p.solid = p.solid < 0 || all.contains(p.node) ? p.solid : to[size_t(p.solid)];
        take_out(m_scene.solids, all);
    }
    if (groups) {
        const std::vector<int> to = new_indices(m_scene.groups, all);
        const auto renumber = [&](Group::Instances& i) { i.group = to[size_t(i.group)]; };
        std::ranges::for_each(m_scene.instances, renumber);
        for (Group& g : m_scene.groups)
            std::ranges::for_each(g.instances, renumber);
        take_out(m_scene.groups, all);
    }
    take_out(m_scene.primitives, all);
    take_out(m_scene.instances, all);
    take_out(m_scene.lights, all);
    take_out(m_scene.light_shaders, all);
    if (in_groups)
        for (Group& g : m_scene.groups) {
            take_out(g.primitives, all);
            take_out(g.instances, all);
        }
    m_index.clear();
    m_indexed = Indexed::Nothing;
    return {};
}

// ---- Replace ------------------------------------------------------------------------------------------

namespace {

std::shared_ptr<const Motion> moving(std::vector<TransformKey> places, std::vector<Motion::Shape> shapes) {
    if (places.size() < 2)
        places.clear();
    if (shapes.size() < 2)
        shapes.clear();
    if (places.empty() && shapes.empty())
        return nullptr;
    auto motion = std::make_shared<Motion>();
    motion->places = std::move(places);
    motion->shapes = std::move(shapes);
    return motion;
}

// With its co-shaders.
Fault place(ShaderRef& light, const Placement& placement) {
    if (placement.keys.size() > 1)
        return "a light does not move: give it one transform";
    if (!light.coshaders.empty()) { // a reader may have kept a light that is flattened
        if (fault_of(light.world_from_shader))
            return "light \"" + light.handle +
                   "\" stands flattened, and where its co-shaders would go is not known";
        const Transform now_from_before = placement.transform * light.world_from_shader.inverse();
        for (ShaderRef& c : light.coshaders)
            transform_shader(now_from_before, c);
    }
    light.world_from_shader = placement.transform;
    return std::nullopt;
}

Fault place(Light& light, const Placement& placement) {
    if (placement.keys.size() > 1)
        return "a light does not move: give it one transform";
    if (!light.source) {
        light.world_from_light = placement.transform;
        return std::nullopt;
    }
    LightSource source = *light.source;
    source.placement = placement.transform;
    remake(light, std::move(source));
    return std::nullopt;
}

// By each row, and by what rows cannot say.
Fault fault_of_parameters(const Camera& camera) {
    for (const CameraParameter& row : camera_parameters())
        if (Fault fault = row.refused(row.get(camera)))
            return fault;
    return fault_of_fov(camera);
}

Fault place(Primitive& p, Placement& placement) {
    p.world_from_object = placement.transform;
    p.motion = moving(std::move(placement.keys), p.motion ? p.motion->shapes : std::vector<Motion::Shape>());
    return std::nullopt;
}

} // namespace

static Fault put(Places& places, Group::Instances& instances) {
    if (const Fault fault = fault_of(places))
        return fault;
    const size_t count = places.transforms.size() / 12 / std::max<size_t>(places.times.size(), 1);
    if (const Fault fault = fault_of(places.variation.value_or(instances.variation), count))
        return fault;
    if (places.variation)
        instances.variation = std::move(*places.variation);
    instances.transforms = std::move(places.transforms);
    instances.times = std::move(places.times);
    return std::nullopt;
}

Outcome Editor::replace(Replace edit) {
    const auto wrong = [&](const char* what, const char* of) {
        return Outcome{NodeId::None,
                       called(edit.id) + " has no " + what + " that could be replaced; " + of + " have"};
    };
    const auto done = [&](Aspects aspects) {
        if (m_delta)
            m_delta->note_changed(edit.id, aspects);
        return Outcome{edit.id, {}};
    };
    const auto refused = [](const std::string& why) { return Outcome{NodeId::None, why}; };

    if (auto* camera = std::get_if<Camera>(&edit.with)) {
        if (edit.id != camera_node())
            return refused(called(edit.id) + " is no camera");
        Fault fault = fault_of(Placement{camera->camera_from_world, camera->motion});
        if (!fault)
            fault = fault_of_parameters(*camera);
        if (fault)
            return refused(*fault);
        m_camera = std::move(*camera);
        return done(Aspect::Placement | Aspect::Parameters);
    }
    if (!find(edit.id) && edit.id != NodeId::World && edit.id != camera_node())
        return refused(no_node(edit.id));
    Primitive* const primitive = at<Primitive>(edit.id);

    if (auto* placement = std::get_if<Placement>(&edit.with)) {
        if (const Fault fault = fault_of(*placement))
            return refused(*fault);
        Light* const light = at<Light>(edit.id);
        ShaderRef* const shader = at<ShaderRef>(edit.id);
        if (!primitive && !light && !shader)
            return wrong("place", "primitives and lights");
        const Fault fault = primitive ? place(*primitive, *placement)
                            : light   ? place(*light, *placement)
                                      : place(*shader, *placement);
        return fault ? refused(*fault) : done(Aspect::Placement);
    }
    if (auto* places = std::get_if<Places>(&edit.with)) {
        Group::Instances* const instances = at<Group::Instances>(edit.id);
        if (!instances)
            return wrong("places", "instances");
        const Fault fault = put(*places, *instances);
        return fault ? refused(*fault) : done(Aspect::Placement);
    }
    if (!primitive)
        return wrong("shape or attributes", "primitives");
    if (auto* attributes = std::get_if<std::shared_ptr<const Attributes>>(&edit.with)) {
        if (!*attributes)
            return refused("the primitive has no attributes");
        if ((*attributes)->name != primitive->attributes->name)
            return refused(NameStays);
        primitive->attributes = LightSwitch(m_lights).on(*attributes);
        if (primitive->attributes->lights_on)
            m_says_lights = true;
        return done(Aspect::Attributes | Aspect::Links | Aspect::Parameters);
    }
    Aspects changed = Aspect::Primvars;
    Shape shape{primitive->geometry, {}};
    if (auto* whole = std::get_if<Shape>(&edit.with)) {
        shape = std::move(*whole);
        changed |= Aspect::Geometry;
    } else {
        if (primitive->motion && !primitive->motion->shapes.empty())
            return refused(called(edit.id) + " changes its shape: replace that, with primvars at all times");
        shape.primvars = std::move(std::get<ValueList>(edit.with));
    }
    if (const Fault fault = fault_of(shape))
        return refused(*fault);
    primitive->geometry = std::move(shape.geometry);
    primitive->primvars = std::move(shape.primvars);
    primitive->motion = moving(primitive->motion ? primitive->motion->places : std::vector<TransformKey>(),
                               std::move(shape.shapes));
    return done(changed);
}

} // namespace kanuka::scene
