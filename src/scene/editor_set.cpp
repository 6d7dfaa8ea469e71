// Set and SetParameters.
#include <algorithm>

#include "base/spelling.h"
#include "scene/editor.h"
#include "scene/parameter_edits.h"
#include "scene/schema/attributes.h"
#include "scene/schema/camera.h"
#include "scene/schema/lights.h"
#include "scene/schema/options.h"

namespace kanuka::scene {

namespace {

// Sets all or none. `unknown` tells that there is no row of a name.
template <class Of, class Find, class Unknown>
Fault assign(Of& of, const std::vector<Set::Assignment>& values, const Find& find, const Unknown& unknown) {
    for (const Set::Assignment& a : values) {
        const auto* row = find(a.row);
        if (!row)
            return unknown(a.row);
        if (Fault fault = row->set(of, a.value))
            return fault;
    }
    return std::nullopt;
}

// "a light has no parameter conangle; did you mean cone_angle?", or what there is.
Fault unknown_name(const std::string& who, const std::string& what, const std::string& name,
                   const std::vector<std::string_view>& known) {
    Nearest nearest(name);
    std::string all;
    for (const std::string_view k : known) {
        nearest.offer(k);
        all += (all.empty() ? "" : ", ") + std::string(k);
    }
    const std::string question = nearest.question();
    return who + " has no " + what + " " + name +
           (!question.empty() ? question
            : known.empty()   ? ""
                              : "; it has " + all);
}

template <class Rows>
std::vector<std::string_view> names_of(const Rows& rows) {
    std::vector<std::string_view> all;
    for (const auto& row : rows)
        all.push_back(row.name);
    return all;
}

// ---- shaders ------------------------------------------------------------------------------------------

struct Slot {
    std::string_view name;
    std::optional<ShaderRef> Attributes::* member;
};
constexpr Slot Slots[] = {
    {"surface", &Attributes::surface},       {"displacement", &Attributes::displacement},
    {"interior", &Attributes::interior},     {"exterior", &Attributes::exterior},
    {"atmosphere", &Attributes::atmosphere}, {"area_light", &Attributes::area_light}};

// The standard light that a light shader of RIB is; null = it is somebody's own, or looks into a shadow map,
// and takes what it says.
const LightKind* standard_light(const ShaderRef& light) {
    const LightKind* kind = find_light_shader(light.name);
    return kind && light.name == kind->shader ? kind : nullptr;
}

// What stands in for a light has the values that it knows, where nobody can choose it anew.
void put_in_stand_in(ShaderRef& light, const std::vector<Value>& values) {
    const LightKind* kind = light.stand_in ? find_light_shader(light.stand_in->name) : nullptr;
    if (!kind)
        return;
    ShaderRef::StandIn changed = *light.stand_in;
    const std::vector<std::string_view> known = kind->shader_parameters();
    for (const Value& value : values)
        if (std::ranges::find(known, value.name) != known.end())
            changed.parameters.set(value);
    light.stand_in = std::make_shared<const ShaderRef::StandIn>(std::move(changed));
}

// Down to a co-shader. `shared`: those of the attributes, which all of their shaders may call. Null: `fault`
// says why.
template <class Shader, class Shaders>
Shader* descend(Shader* shader, std::span<const std::string> handles, Shaders* shared, Fault& fault) {
    for (const std::string& handle : handles) {
        std::vector<std::string_view> known;
        Shader* next = nullptr;
        for (Shaders* list : {&shader->coshaders, shared})
            if (list)
                for (Shader& c : *list) {
                    known.push_back(c.handle);
                    if (!next && c.handle == handle)
                        next = &c;
                }
        if (!next) {
            fault = unknown_name("shader \"" + shader->name + "\"", "co-shader", handle, known);
            return nullptr;
        }
        shader = next;
    }
    return shader;
}

template <class Of> // Attributes, const or not
auto shader_of(Of& attributes, std::span<const std::string> path, Fault& fault)
    -> decltype(&*attributes.surface) {
    std::vector<std::string_view> known;
    for (const Slot& slot : Slots) {
        auto& shader = attributes.*slot.member;
        if (shader && slot.name == path[0])
            return descend(&*shader, path.subspan(1), &attributes.coshaders, fault);
        if (shader)
            known.push_back(slot.name);
    }
    fault = unknown_name("the primitive", "shader", path[0], known);
    return nullptr;
}

Fault put(ShaderRef& shader, const std::vector<Value>& values) {
    for (const Value& value : values)
        if (Fault fault = put_parameter(shader.parameters, value))
            return fault;
    return std::nullopt;
}

bool same(const Value& a, const Value& b) { // of one edit, given to many
    return a.name == b.name && a.type == b.type && a.array_size == b.array_size &&
           std::ranges::equal(a.floats, b.floats) && std::ranges::equal(a.ints, b.ints) &&
           std::ranges::equal(a.strings, b.strings);
}

} // namespace

const ShaderRef* Editor::shader(NodeId id, const std::vector<std::string>& path) const {
    Fault fault;
    if (const auto* p = get<Primitive>(id))
        return path.empty() ? nullptr : shader_of(*p->attributes, path, fault);
    const auto* light = get<ShaderRef>(id);
    return light ? descend(light, path, static_cast<const std::vector<ShaderRef>*>(nullptr), fault) : nullptr;
}

const std::string Editor::NameStays =
    "name: a node is known by it; remove the node, and add it under another name";

// ---- Set ----------------------------------------------------------------------------------------------

Outcome Editor::set(const Set& edit) {
    const auto settle = [&](const Fault& fault, Aspects aspects) {
        if (fault)
            return Outcome{NodeId::None, *fault};
        if (m_delta)
            m_delta->note_changed(edit.id, aspects);
        return Outcome{edit.id, {}};
    };
    const auto unknown = [&](const auto& rows, const char* what) {
        return [names = names_of(rows), who = called(edit.id), what](const std::string& name) {
            return unknown_name(who, what, name, names);
        };
    };
    if (edit.id == NodeId::World) {
        Options changed = m_options;
        const Fault fault = assign(changed, edit.values, find_option, unknown(option_parameters(), "option"));
        if (!fault)
            m_options = std::move(changed);
        return settle(fault, Aspect::Options);
    }
    if (edit.id == camera_node()) {
        Camera changed = m_camera;
        Fault fault =
            assign(changed, edit.values, find_camera_parameter, unknown(camera_parameters(), "parameter"));
        if (!fault)
            fault = fault_of_fov(changed);
        if (!fault)
            m_camera = std::move(changed);
        return settle(fault, Aspect::Parameters);
    }
    if (Light* light = at<Light>(edit.id))
        return set(*light, edit);
    if (Primitive* primitive = at<Primitive>(edit.id)) {
        for (const Set::Assignment& a : edit.values)
            if (a.row == "name")
                return {NodeId::None, NameStays};
        Fault fault;
        change(*primitive, edit, [&](Attributes& a) {
            return fault =
                       assign(a, edit.values, find_attribute, unknown(attribute_parameters(), "attribute"));
        });
        Aspects aspects;
        for (const Set::Assignment& a : edit.values)
            if (const AttributeParameter* row = find_attribute(a.row))
                aspects |= row->links ? Aspect::Links : Aspect::Attributes;
        return settle(fault, aspects);
    }
    if (!find(edit.id))
        return {NodeId::None, "there is no node " + to_text(edit.id)};
    if (const ShaderRef* light = at<ShaderRef>(edit.id))
        return {NodeId::None, called(edit.id) + " is a shader, \"" + light->name +
                                  "\": set its own parameters" +
                                  (find_light_shader(light->name) ? ", in RIB's names and units" : "")};
    return {NodeId::None, called(edit.id) + " has no parameters of its own"};
}

Outcome Editor::set(Light& light, const Set& edit) {
    if (!light.source)
        return {NodeId::None, called(edit.id) + " was given as it is, and is not made from parameters"};
    LightSource source = *light.source;
    std::vector<std::string_view> known;
    for (const LightParameter& row : light_parameters())
        if (row.is_of(*source.kind))
            known.push_back(row.name);
    Aspects aspects;
    for (const Set::Assignment& a : edit.values) {
        if (a.row == "name")
            return {NodeId::None, NameStays};
        const LightParameter* row = find_light_parameter(a.row);
        if (!row || !row->is_of(*source.kind))
            return {NodeId::None, *unknown_name(called(edit.id), "parameter", a.row, known)};
        if (const Fault fault = row->set(source.settings, a.value))
            return {NodeId::None, *fault};
        aspects |= row->links ? Aspect::Links : Aspect::Parameters;
    }
    const Transform before = light.world_from_light;
    remake(light, std::move(source));
    if (light.world_from_light.m != before.m)
        aspects |= Aspect::Placement;
    if (m_delta)
        m_delta->note_changed(edit.id, aspects);
    return {edit.id, {}};
}

// Primitives that share attributes go on doing so where the same edit is made to all of them, one after
// another.
template <class Change>
void Editor::change(Primitive& primitive, const Edit& edit, const Change& how) {
    const auto repeats = [&](const AttributeChange& last) {
        if (primitive.attributes != last.before || edit.index() != last.edit.index())
            return false;
        if (const auto* set = std::get_if<Set>(&edit))
            return set->values == std::get<Set>(last.edit).values;
        const auto &a = std::get<SetParameters>(edit), &b = std::get<SetParameters>(last.edit);
        return a.shader == b.shader &&
               std::ranges::equal(a.values, b.values,
                                  [](const Value& x, const Value& y) { return same(x, y); });
    };
    const auto last = std::ranges::find_if(m_changes, repeats);
    if (last != m_changes.end()) {
        primitive.attributes = last->after;
        return;
    }
    auto changed = std::make_shared<Attributes>(*primitive.attributes);
    if (how(*changed))
        return;
    m_changes[m_next_change] = {primitive.attributes, changed, edit};
    m_next_change = (m_next_change + 1) % m_changes.size();
    primitive.attributes = std::move(changed);
}

// ---- SetParameters ------------------------------------------------------------------------------------

Outcome Editor::set(SetParameters edit) {
    Fault fault;
    Aspects aspects = Aspect::Parameters;
    if (Primitive* primitive = at<Primitive>(edit.id)) {
        if (edit.shader.empty())
            return {NodeId::None, "which shader of " + called(edit.id) + "? Give its slot, as \"surface\""};
        change(*primitive, edit, [&](Attributes& a) {
            ShaderRef* shader = shader_of(a, edit.shader, fault);
            return shader ? fault = put(*shader, edit.values) : fault;
        });
    } else if (ShaderRef* light = at<ShaderRef>(edit.id)) {
        ShaderRef changed = *light;
        ShaderRef* shader =
            descend(&changed, edit.shader, static_cast<std::vector<ShaderRef>*>(nullptr), fault);
        const LightKind* kind = shader == &changed ? standard_light(changed) : nullptr;
        const std::vector<std::string_view> known =
            kind ? kind->shader_parameters() : std::vector<std::string_view>();
        for (Value& value : edit.values) {
            if (kind && !fault && std::ranges::find(known, value.name) == known.end())
                fault = unknown_name(called(edit.id), "parameter", value.name, known);
            if (kind && !fault)
                fault = take_as_light_parameter(*kind, value);
        }
        if (!fault)
            fault = put(*shader, edit.values);
        if (!fault && shader == &changed && m_stand_in_for)
            changed.stand_in = m_stand_in_for(changed);
        else if (!fault && shader == &changed)
            put_in_stand_in(changed, edit.values);
        if (!fault)
            *light = std::move(changed);
        if (!fault && edit.shader.empty() && !edit.values.empty()) {
            aspects = {};
            for (const Value& value : edit.values)
                aspects |= is_link_of_lights(value.name) ? Aspect::Links : Aspect::Parameters;
        }
    } else if (edit.id == NodeId::World) {
        if (edit.shader != std::vector<std::string>{"imager"} || !m_options.imager)
            return {NodeId::None, "the world has no shader but an imager, where one is given"};
        ShaderRef changed = *m_options.imager;
        fault = put(changed, edit.values);
        if (!fault)
            m_options.imager = std::move(changed);
    } else {
        return {NodeId::None, find(edit.id) || edit.id == camera_node()
                                  ? called(edit.id) + " has no shaders"
                                  : "there is no node " + to_text(edit.id)};
    }
    if (fault)
        return {NodeId::None, *fault};
    if (m_delta)
        m_delta->note_changed(edit.id, aspects);
    return {edit.id, {}};
}

} // namespace kanuka::scene
