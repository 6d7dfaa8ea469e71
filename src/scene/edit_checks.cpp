#include "scene/edit_checks.h"

#include <algorithm>
#include <cmath>

#include "scene/counts.h"
#include "scene/text_column.h"

namespace kanuka::scene {

namespace {

size_t stored(const Value& v) {
    return v.type == Type::String    ? v.strings.size()
           : v.type == Type::Integer ? v.ints.size()
                                     : v.floats.size();
}

Fault fault_of_times(const std::vector<double>& times) {
    for (size_t i = 0; i < times.size(); i++)
        if (!std::isfinite(times[i]) || (i > 0 && !(times[i] > times[i - 1])))
            return "times: expected finite numbers that rise";
    return std::nullopt;
}

// Of an array that is as long as its geometry asks.
Fault fault_of(const Value& v, const PrimvarCounts& counts) {
    const size_t element = size_t(components(v.type)) * size_t(std::max(v.array_size, 1)),
                 needed = counts.of(v.detail) * element;
    if (v.array_size < 1)
        return "primvar " + v.name + ": expected an array size of 1 or more";
    if (stored(v) == needed)
        return std::nullopt;
    return "primvar " + v.name + ": expected " + std::to_string(needed) + " values (" +
           std::to_string(counts.of(v.detail)) + " " + std::string(name(v.detail)) + "), got " +
           std::to_string(stored(v));
}

Fault fault_of_primvars(const Geometry& geometry, const ValueList& primvars) {
    const bool placed = !std::holds_alternative<Quadric>(geometry) &&
                        !std::holds_alternative<Blobby>(geometry) &&
                        !std::holds_alternative<Volume>(geometry);
    size_t positions = 0;
    for (const std::string_view name : {"P", "Pw"})
        if (const Value* p = primvars.find(name); p && placed) {
            const int floats = name == "P" ? 3 : 4;
            if (components(p->type) != floats || p->array_size != 1 || p->type == Type::String ||
                p->type == Type::Integer || p->detail != Detail::Vertex)
                return "primvar " + std::string(name) + ": expected vertex values of " +
                       std::to_string(floats) + " floats";
            positions = p->items();
        }
    if (placed && positions == 0)
        return "there are no positions: give a primvar P";
    if (const Fault fault = fault_of(geometry, positions))
        return fault;
    const PrimvarCounts counts = primvar_counts(geometry, positions);
    for (const Value& v : primvars.values)
        if (const Fault fault = fault_of(v, counts))
            return fault;
    return std::nullopt;
}

} // namespace

Fault fault_of(const Transform& t) {
    const double determinant = t.determinant3();
    for (const auto& row : t.m)
        for (const double x : row)
            if (!std::isfinite(x))
                return "transform: expected finite numbers";
    if (!std::isfinite(determinant) || determinant == 0)
        return "transform: it flattens what it places; look for a scale of 0";
    return std::nullopt;
}

Fault fault_of(const Placement& placement) {
    std::vector<double> times;
    for (const TransformKey& key : placement.keys) {
        times.push_back(key.time);
        if (const Fault fault = fault_of(key.transform))
            return fault;
    }
    const Fault fault = fault_of_times(times);
    return fault ? fault : fault_of(placement.transform);
}

Fault fault_of(const Shape& shape) {
    if (const Fault fault = fault_of_primvars(shape.geometry, shape.primvars))
        return fault;
    std::vector<double> times;
    for (const Motion::Shape& s : shape.shapes) {
        times.push_back(s.time);
        if (s.geometry.index() != shape.geometry.index())
            return "shapes: expected the same kind of geometry at all times";
        if (const Fault fault = fault_of_primvars(s.geometry, s.primvars))
            return fault;
        for (const std::string_view name : {"P", "Pw"}) {
            const Value *a = shape.primvars.find(name), *b = s.primvars.find(name);
            if (!a != !b || (a && a->items() != b->items()))
                return "shapes: expected as many positions at all times";
        }
    }
    return fault_of_times(times);
}

Fault fault_of(const Places& places) {
    if (const Fault fault = fault_of_times(places.times))
        return fault;
    const size_t times = std::max<size_t>(places.times.size(), 1);
    if (places.transforms.empty() || places.transforms.size() % (12 * times) != 0)
        return "places: expected 12 floats an instance at each of " + std::to_string(times) +
               (times == 1 ? " time" : " times") + ", got " + std::to_string(places.transforms.size());
    if (std::ranges::any_of(places.transforms, [](float x) { return !std::isfinite(x); }))
        return "places: expected finite numbers";
    return std::nullopt;
}

static Fault fault_of_variable(const Value& value, size_t instances) {
    const auto wrong = [&](const std::string& what) { return "primvars: " + value.name + ": " + what; };
    for (const char* own : {"variant", "tint", "roughness"})
        if (value.name == own)
            return wrong("instances have a value of that name, which is said by itself");
    if (value.name.empty() || value.type == Type::Integer || value.type == Type::HPoint)
        return wrong("expected a float, color, point, vector, normal, matrix or string, or an array of them");
    const bool is_text = value.type == Type::String;
    const size_t width = width_of(value), given = is_text ? value.strings.size() : value.floats.size();
    const bool one = value.detail == Detail::Constant && given == width && value.ints.empty();
    const auto numbers_a_text = [&](int32_t i) { return i >= 0 && size_t(i) < given / width; };
    const bool each =
        value.detail == Detail::Uniform && (is_text ? value.ints.size() == instances && given % width == 0 &&
                                                          std::ranges::all_of(value.ints, numbers_a_text)
                                                    : given == width * instances);
    if (!one && !each)
        return wrong("expected a value (constant), or one for each of " + std::to_string(instances) +
                     " instances (uniform)");
    if (std::ranges::any_of(value.floats, [](float x) { return !std::isfinite(x); }))
        return wrong("expected finite numbers");
    return std::nullopt;
}

Fault fault_of(const Variation& variation, size_t instances) {
    const struct {
        const char* name;
        const Buffer<float>& values;
        size_t components;
        float least;
    } all[] = {{"variant", variation.variant, 1, 0},
               {"tint", variation.tint, 3, 0},
               {"roughness", variation.roughness, 1, -1}};
    for (const auto& [name, values, components, least] : all) {
        if (!values.empty() && values.size() != components && values.size() != components * instances)
            return std::string(name) + ": expected " + (components == 1 ? "a number" : "three numbers") +
                   ", or that for each of " + std::to_string(instances) + " instances; got " +
                   std::to_string(values.size()) + " numbers";
        if (std::ranges::any_of(values, [&](float x) { return !(x >= least && x < 1e6f); }))
            return std::string(name) + ": expected numbers from " + std::to_string(int(least)) +
                   " to a million";
    }
    for (const Value& value : variation.primvars.values)
        if (const Fault fault = fault_of_variable(value, instances))
            return fault;
    return std::nullopt;
}

Fault fault_of(const Primitive& p, size_t solids) {
    if (!p.attributes)
        return "the primitive has no attributes";
    if (p.solid >= int(solids))
        return "the primitive bounds solid " + std::to_string(p.solid) + ", and there are " +
               std::to_string(solids);
    const Placement placement{p.world_from_object, p.motion ? p.motion->places : std::vector<TransformKey>()};
    if (const Fault fault = fault_of(placement))
        return fault;
    return fault_of(
        Shape{p.geometry, p.primvars, p.motion ? p.motion->shapes : std::vector<Motion::Shape>()});
}

Fault fault_of(const Group::Instances& instances, size_t groups_before) {
    if (instances.group < 0 || instances.group >= int(groups_before))
        return "instances are of groups that were added before: there are " + std::to_string(groups_before) +
               ", not number " + std::to_string(instances.group);
    if (const Fault fault = fault_of(Places{instances.transforms, instances.times}))
        return fault;
    return fault_of(instances.variation, instances.count());
}

Fault fault_of(const Group& group, size_t groups_before) {
    for (size_t i = 0; i < group.solids.size(); i++)
        if (group.solids[i].parent >= int(i))
            return "solids come after their parents";
    for (const Primitive& p : group.primitives)
        if (const Fault fault = fault_of(p, group.solids.size()))
            return fault;
    for (const Group::Instances& instances : group.instances)
        if (const Fault fault = fault_of(instances, groups_before))
            return fault;
    return std::nullopt;
}

} // namespace kanuka::scene
