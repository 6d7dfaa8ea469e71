#include "ingest/rib/objects.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "scene/members.h"
#include "scene/place_shaders.h"

namespace kanuka::ingest {

using scene::Attributes;
using scene::ShaderRef;

namespace {

template <class T>
bool same(const T& a, const T& b) {
    return a == b;
}
bool same(const scene::Value& a, const scene::Value& b) {
    return a.name == b.name && a.type == b.type && a.array_size == b.array_size &&
           std::ranges::equal(a.floats, b.floats) && std::ranges::equal(a.ints, b.ints) &&
           std::ranges::equal(a.strings, b.strings);
}
bool same(const scene::ValueList& a, const scene::ValueList& b) {
    return std::ranges::equal(a.values, b.values, [](const auto& x, const auto& y) { return same(x, y); });
}
// Where a shader was declared does not count: instances share what was shaded once, in the shader space of
// the first. Nor do handles, but where others mean a shader by them.
bool same(const std::vector<ShaderRef>& a, const std::vector<ShaderRef>& b);
bool same(const ShaderRef& a, const ShaderRef& b) {
    return a.name == b.name && same(a.parameters, b.parameters) && same(a.coshaders, b.coshaders);
}
bool same(const std::vector<ShaderRef>& a, const std::vector<ShaderRef>& b) {
    return std::ranges::equal(
        a, b, [](const ShaderRef& x, const ShaderRef& y) { return x.handle == y.handle && same(x, y); });
}
bool same(const std::optional<ShaderRef>& a, const std::optional<ShaderRef>& b) {
    return a && b ? same(*a, *b) : !a && !b;
}
using LightNames = std::shared_ptr<const std::set<std::string>>;
bool same(const LightNames& a, const LightNames& b) {
    return a == b || (a && b && *a == *b);
}

// What inherits from either looks the same, whatever its name.
bool same_look(const Attributes& a, const Attributes& b) {
    const auto lamp = [](const Attributes& of) { return of.area_light ? of.area_light->handle : ""; };
    const auto x = members_of(a), y = members_of(b);
    const auto one = [&](const auto& of_a, const auto& of_b) {
        return static_cast<const void*>(&of_a) == &a.name || same(of_a, of_b);
    };
    const auto all = [&]<size_t... I>(std::index_sequence<I...>) {
        return (one(std::get<I>(x), std::get<I>(y)) && ...);
    };
    return lamp(a) == lamp(b) && all(std::make_index_sequence<std::tuple_size_v<decltype(x)>>());
}

// Of what most often differs; equal looks have equal hashes.
size_t look_hash(const Attributes& a) {
    size_t h = 0;
    const auto add = [&](size_t v) { h = (h ^ v) * 0x9e3779b97f4a7c15ull + (h >> 29); };
    const auto add_float = [&](float v) { add(std::hash<float>{}(v)); };
    for (int i = 0; i < 3; i++)
        add_float(a.color[i]), add_float(a.opacity[i]);
    for (const std::optional<ShaderRef>* shader : {&a.surface, &a.displacement})
        if (*shader) {
            add(std::hash<std::string>{}((*shader)->name));
            for (const scene::Value& v : (*shader)->parameters.values) {
                for (const float f : v.floats)
                    add_float(f);
                for (const std::string& s : v.strings)
                    add(std::hash<std::string>{}(s));
            }
        }
    for (const scene::Value& v : a.user.values)
        for (const float f : v.floats)
            add_float(f);
    return h;
}

} // namespace

std::shared_ptr<const Attributes> inherit(const std::shared_ptr<const Attributes>& inherited,
                                          const std::shared_ptr<const Attributes>& own, uint64_t set) {
    if (set == 0)
        return inherited;
    auto r = std::make_shared<Attributes>(*inherited);
    const auto take = [&](uint64_t field, auto member) {
        if (set & field)
            (*r).*member = (*own).*member;
    };
    take(FieldColor, &Attributes::color);
    take(FieldOpacity, &Attributes::opacity);
    take(FieldShadingRate, &Attributes::shading_rate);
    take(FieldSides, &Attributes::sides);
    take(FieldOrientation, &Attributes::reverse_orientation);
    take(FieldMatte, &Attributes::matte);
    take(FieldSurface, &Attributes::surface);
    take(FieldDisplacement, &Attributes::displacement);
    take(FieldInterior, &Attributes::interior);
    take(FieldExterior, &Attributes::exterior);
    take(FieldAtmosphere, &Attributes::atmosphere);
    take(FieldAreaLight, &Attributes::area_light);
    take(FieldTextureCoordinates, &Attributes::texture_coordinates);
    for (const scene::AttributeParameter& row : scene::attribute_parameters())
        if (set & bit_of(row))
            row.put(*r, row.get(*own));
    if ((set & FieldToggleOrientation) && !(set & FieldOrientation))
        r->reverse_orientation = inherited->reverse_orientation != own->reverse_orientation;
    if (set & FieldCoShaders)
        for (const ShaderRef& c : own->coshaders) {
            std::erase_if(r->coshaders, [&](const ShaderRef& known) { return known.handle == c.handle; });
            r->coshaders.push_back(c);
        }
    if (set & FieldUser)
        for (const scene::Value& value : own->user.values)
            r->user.set(value);
    return r;
}

int Objects::begin(const std::string& handle, const Location& where) {
    ObjectRecord record;
    record.name = handle;
    record.where = where;
    m_records.push_back(std::move(record));
    return int(m_records.size()) - 1;
}

void Objects::end(int object) {
    m_handles[record(object).name] = object;
}

int Objects::find(const std::string& handle) const {
    const auto it = m_handles.find(handle);
    return it == m_handles.end() ? -1 : it->second;
}

static void append_3x4(std::vector<float>& out, const Transform& t) {
    for (size_t row = 0; row < 3; row++)
        for (size_t column = 0; column < 4; column++)
            out.push_back(float(t.m[row][column]));
}

void InstanceLists::add(int group, const Transform& still, const std::vector<TransformKey>& moving,
                        const InstanceDifference& difference) {
    std::vector<double> times;
    for (const TransformKey& k : moving)
        times.push_back(k.time);
    List& list = lists[{group, times, difference.unique, difference.in_looks(), difference.variables()}];
    if (moving.empty())
        append_3x4(list.matrices, still);
    for (const TransformKey& k : moving)
        append_3x4(list.matrices, k.transform);
    if (difference.variant) {
        list.variant.resize(list.count, 0.0f);
        list.variant.push_back(*difference.variant);
    }
    if (difference.roughness) {
        list.roughness.resize(list.count, 0.0f);
        list.roughness.push_back(*difference.roughness);
    }
    if (difference.tint) {
        list.tint.resize(3 * list.count, 1.0f);
        list.tint.insert(list.tint.end(), {difference.tint->x, difference.tint->y, difference.tint->z});
    }
    if (list.count == 0) {
        list.primvars = difference.primvars.values;
        list.values.resize(list.primvars.size());
        for (const scene::Value& primvar : list.primvars)
            list.texts.emplace_back(scene::width_of(primvar));
    }
    for (size_t k = 0; k < list.values.size(); k++) {
        const scene::Value& own = difference.primvars.values[k];
        if (own.type == scene::Type::String)
            list.texts[k].add(std::span(own.strings.data(), own.strings.size()));
        else
            list.values[k].insert(list.values[k].end(), own.floats.begin(), own.floats.end());
    }
    list.count++;
}

std::string InstanceDifference::variables() const {
    std::string all;
    for (const scene::Value& v : primvars.values)
        all += std::string(scene::name(v.type)) + "[" + std::to_string(v.array_size) + "] " + v.name + ";";
    return all;
}

std::vector<scene::Group::Instances> InstanceLists::take(int& next_id) {
    std::vector<scene::Group::Instances> out;
    for (auto& [key, list] : lists) {
        scene::Group::Instances instances;
        std::tie(instances.group, instances.times, instances.unique, std::ignore, std::ignore) = key;
        instances.first_id = next_id;
        const size_t times = std::max<size_t>(instances.times.size(), 1), count = list.count;
        if (times > 1) { // all instances at the first time, then all at the second, …
            std::vector<float> sorted(list.matrices.size());
            for (size_t i = 0; i < count; i++)
                for (size_t k = 0; k < times; k++)
                    std::copy_n(list.matrices.begin() + long(12 * (i * times + k)), 12,
                                sorted.begin() + long(12 * (k * count + i)));
            list.matrices = std::move(sorted);
        }
        next_id += int(count);
        instances.transforms = std::move(list.matrices);
        const auto each = [&](std::vector<float>& values, size_t components, float none) {
            if (!values.empty())
                values.resize(components * count, none);
            return scene::Buffer<float>(std::move(values));
        };
        instances.variation = {
            each(list.variant, 1, 0), each(list.tint, 3, 1), each(list.roughness, 1, 0), {}};
        for (size_t k = 0; k < list.values.size(); k++) {
            if (list.primvars[k].type == scene::Type::String) {
                list.texts[k].move_to(list.primvars[k]);
                continue;
            }
            list.primvars[k].detail = count == 1 ? scene::Detail::Constant : scene::Detail::Uniform;
            list.primvars[k].floats = std::move(list.values[k]);
        }
        instances.variation.primvars.values = std::move(list.primvars);
        out.push_back(std::move(instances));
    }
    lists.clear();
    return out;
}

scene::Value instance_primvar(const scene::Value& given) {
    scene::Value value = given;
    if (value.name.starts_with(InstancePrimvar))
        value.name.erase(0, InstancePrimvar.size());
    value.detail = scene::Detail::Constant;
    if (value.type == scene::Type::Integer) {
        value.type = scene::Type::Float;
        value.floats = std::vector<float>(value.ints.begin(), value.ints.end());
        value.ints = {};
    }
    return value;
}

InstanceDifference Objects::difference_of(std::shared_ptr<const Attributes>& attributes) {
    constexpr std::string_view Names[] = {"instance:variant", "instance:tint", "instance:roughness",
                                          "instance:unique"};
    const auto differs = [&](const scene::Value& v) {
        return v.name.starts_with(InstancePrimvar) || std::ranges::find(Names, v.name) != std::end(Names);
    };
    if (std::ranges::none_of(attributes->user.values, differs))
        return {};
    InstanceDifference difference;
    const auto number = [&](std::string_view name, float least) -> std::optional<float> {
        const scene::Value* v = attributes->user.find(name);
        if (!v || (v->floats.empty() && v->ints.empty()))
            return std::nullopt;
        const float x = v->floats.empty() ? float(v->ints[0]) : v->floats[0];
        return std::isfinite(x) ? std::optional(std::max(x, least)) : std::nullopt;
    };
    difference.variant = number(Names[0], 0);
    difference.unique = number(Names[3], 0).value_or(0) != 0;
    difference.roughness = number(Names[2], -1);
    if (const scene::Value* v = attributes->user.find(Names[1]); v && !v->floats.empty()) {
        const Rgb rgb = attributes->user.get_color(Names[1], Rgb(1, 1, 1));
        if (std::isfinite(rgb.x + rgb.y + rgb.z))
            difference.tint = Rgb(std::max(rgb.x, 0.0f), std::max(rgb.y, 0.0f), std::max(rgb.z, 0.0f));
    }
    for (const scene::Value& v : attributes->user.values)
        if (v.name.starts_with(InstancePrimvar))
            difference.primvars.values.push_back(instance_primvar(v));
    std::ranges::sort(difference.primvars.values, {}, &scene::Value::name);
    auto plain = std::make_shared<Attributes>(*attributes);
    std::erase_if(plain->user.values, differs);
    if (!m_plain || !same_look(*m_plain, *plain))
        m_plain = std::move(plain);
    attributes = m_plain;
    return difference;
}

// Group indices of children are lower than their parent's: children are made first.
int Objects::group_for(const scene::Scene& scene, scene::Editor& editor, int object,
                       const std::shared_ptr<const Attributes>& attributes,
                       const Transform& world_from_object) {
    {
        ObjectRecord& r = record(object);
        if (const auto it = r.by_pointer.find(attributes.get()); it != r.by_pointer.end())
            return it->second.group;
        const auto [first, last] = r.looks.equal_range(look_hash(*attributes));
        for (auto v = first; v != last; ++v)
            if (same_look(*v->second.attributes, *attributes)) {
                r.by_pointer[attributes.get()] = {attributes, v->second.group};
                return v->second.group;
            }
    }
    scene::Group group;
    group.name = record(object).name;
    // Inherited shaders were declared in world space; group members see them from the group.
    auto local = std::make_shared<Attributes>(*attributes);
    place_shaders(world_from_object.inverse(), *local);
    local->atmosphere = attributes->atmosphere; // air stays in the world
    const std::shared_ptr<const Attributes> shared_local = local;
    std::map<std::pair<const Attributes*, uint64_t>, std::shared_ptr<const Attributes>> merged;
    InstanceLists children;
    for (size_t i = 0; i < record(object).members.size(); i++) {
        const ObjectRecord::Member& member = record(object).members[i];
        auto& look = merged[{member.primitive.attributes.get(), member.set}];
        if (!look)
            look = inherit(shared_local, member.primitive.attributes, member.set);
        if (member.object < 0) {
            group.primitives.push_back(member.primitive);
            group.primitives.back().attributes = look;
        } else {
            std::shared_ptr<const Attributes> plain = look;
            const InstanceDifference difference = difference_of(plain);
            const int child =
                group_for(scene, editor, member.object, plain, member.primitive.world_from_object);
            const scene::Primitive& place = record(object).members[i].primitive;
            children.add(child, place.world_from_object,
                         place.motion ? place.motion->places : std::vector<TransformKey>(), difference);
        }
    }
    int first_id = 0;
    group.solids = record(object).solids;
    group.instances = children.take(first_id);
    const int index = m_groups_before + int(scene.groups.size());
    editor.add(std::move(group));
    ObjectRecord& r = record(object);
    r.looks.emplace(look_hash(*attributes), ObjectRecord::Variant{attributes, index});
    r.by_pointer[attributes.get()] = {attributes, index};
    return index;
}

void Objects::instance(const scene::Scene& scene, scene::Editor& editor, int object,
                       const std::shared_ptr<const Attributes>& attributes,
                       const Transform& world_from_object, const std::vector<TransformKey>& moving) {
    std::shared_ptr<const Attributes> plain = attributes;
    const InstanceDifference difference = difference_of(plain);
    m_instances.add(group_for(scene, editor, object, plain, world_from_object), world_from_object, moving,
                    difference);
}

void Objects::forget_groups() {
    m_groups_before = 0;
    for (ObjectRecord& r : m_records) {
        r.looks.clear();
        r.by_pointer.clear();
    }
}

int Objects::finish(const scene::Scene& scene, scene::Editor& editor, int next_id) {
    for (scene::Group::Instances& instances : m_instances.take(next_id))
        editor.add(std::move(instances));
    m_groups_before += int(scene.groups.size());
    return next_id;
}

} // namespace kanuka::ingest
