#include "python/looks.h"

#include <algorithm>

#include <nanobind/stl/vector.h>

#include "python/arrays.h"
#include "scene/counts.h"

namespace kanuka::python {

using scene::Detail;
using scene::Type;

namespace {

template <nb::handle Looks::* Member>
void as_it_is(Looks& looks, nb::handle value, const char*) {
    looks.*Member = value;
}

constexpr Keyword<Looks> Rows[] = {
    {"material", "Material | Shader | str | None", "None", "", "the surface", as_it_is<&Looks::material>},
    {"transform", "ArrayLike | None", "None", "4x4, acting on columns", "places it; (T, 4, 4) where it moves",
     as_it_is<&Looks::transform>},
    {"area_light", "Sequence[float] | Shader | None", "None", "radiance", "that the surface sends out",
     as_it_is<&Looks::area_light>},
    {"name", "str", "''", "", "by which scene.node() finds it", put<&Looks::name>},
    {"shading_rate", "float", "1", "pixels", "area of a micropolygon", put<&Looks::shading_rate>},
    {"variants", "int", "1", "1 to 64",
     "how many times the surface is shaded, with the variable \"variant\" from 0 on, for instances to show "
     "or blend",
     put<&Looks::variants>},
    {"visible_camera", "bool", "True", "", "whether the camera sees it", put<&Looks::visible_camera>},
    {"double_sided", "bool", "True", "", "whether it is there from its inside", put<&Looks::double_sided>},
    {"reverse_orientation", "bool", "False", "", "turns the outside in", put<&Looks::reverse_orientation>},
    {"times", "Sequence[float] | None", "None", "0 to 1 while the shutter is open",
     "of what moves; None: evenly", as_it_is<&Looks::times>},
    {"solid", "Solid | None", "None", "", "that it bounds, of Scene.add_solid()", as_it_is<&Looks::solid>},
    {"lights_off", "Sequence[str]", "[]", "names or groups of lights", "that do not shine on it",
     put<&Looks::lights_off>},
    {"shadows_off", "Sequence[str]", "[]", "likewise", "that shine through it", put<&Looks::shadows_off>},
};

constexpr std::span<const Keyword<Looks>> Table{Rows};

// A Material, a surface Shader, or the name of one.
Material material_of(nb::handle given) {
    Material material;
    if (nb::isinstance<Material>(given))
        return nb::cast<const Material&>(given);
    if (nb::isinstance<scene::ShaderRef>(given))
        material.surface = nb::cast<const scene::ShaderRef&>(given);
    else if (nb::isinstance<nb::str>(given))
        material.surface.name = nb::cast<std::string>(given);
    else
        wrong_argument("material", "Material | Shader | str | None", given);
    return material;
}

std::shared_ptr<const scene::Attributes> attributes(const Looks& looks) {
    auto result = std::make_shared<scene::Attributes>();
    if (!looks.material.is_none()) {
        const Material material = material_of(looks.material);
        result->surface = material.surface;
        result->displacement = material.displacement;
        result->displacement_bound = material.displacement_bound;
        result->color = material.color;
        result->color_spectrum = material.color_spectrum;
        result->opacity = material.opacity;
    }
    if (nb::isinstance<scene::ShaderRef>(looks.area_light)) {
        result->area_light = nb::cast<scene::ShaderRef>(looks.area_light);
    } else if (!looks.area_light.is_none()) {
        scene::ShaderRef light;
        light.name = "arealight";
        const Rgb radiance = rgb(looks.area_light, "area_light");
        light.parameters.set({.name = "intensity", .type = Type::Float, .floats = std::vector<float>{1}});
        light.parameters.set({.name = "lightcolor",
                              .type = Type::Color,
                              .floats = std::vector<float>{radiance.x, radiance.y, radiance.z}});
        result->area_light = light;
    }
    result->shading_rate = looks.shading_rate;
    if (looks.variants < 1 || looks.variants > 64)
        throw nb::value_error("variants: expected 1 to 64");
    result->variants = looks.variants;
    result->sides = looks.double_sided ? 2 : 1;
    result->reverse_orientation = looks.reverse_orientation;
    result->visible_camera = looks.visible_camera;
    result->name = looks.name;
    result->lights_off = looks.lights_off;
    result->shadows_off = looks.shadows_off;
    return result;
}

} // namespace

namespace {

// Its number among the solids of where the shape goes. Of a union and the like the shape bounds a part alone.
int solid_of(nb::handle given, const Place& place) {
    if (given.is_none())
        return -1;
    const Solid& solid = argument<Solid>(given, "solid");
    if (solid.owner.get() != &place.scene ||
        solid.group != (place.group ? place.group->id : scene::NodeId::None))
        throw nb::value_error("solid: it is of another scene or group than the shape");
    scene::Group* const group = place.now();
    std::vector<scene::Solid>& all = group ? group->solids : place.scene.scene.solids;
    const auto found = std::ranges::find(all, solid.id, &scene::Solid::node);
    if (found == all.end())
        throw nb::value_error("solid: it was removed from its scene");
    const int index = int(found - all.begin());
    if (found->kind == scene::Solid::Kind::Primitive)
        return index;
    const scene::Solid part{scene::Solid::Kind::Primitive, index};
    if (group)
        place.scene.editor->add(*group, part);
    else
        place.scene.editor->add(part);
    return int(all.size()) - 1;
}

} // namespace

Looks looks_of(const char* call, const nb::kwargs& given) {
    Looks looks;
    take_keywords(looks, Table, call, given);
    return looks;
}

std::string looks_signature() {
    return keyword_signature(Table);
}

scene::Group* Place::now() const {
    check_idle(scene);
    return group ? &group->get() : nullptr;
}
Place place(Scene& s) {
    check_idle(s);
    return {s, nullptr};
}
Place place(Group& g) {
    const Place place{*g.owner, &g};
    place.now();
    return place;
}

int add(Place place, scene::Primitive primitive, const Looks& looks) {
    primitive.attributes = attributes(looks);
    const std::vector<TransformKey> places = transform_keys(looks.transform, looks.times, "transform");
    primitive.world_from_object = places[0].transform;
    if (places.size() < 2 && !primitive.motion) // nothing moves: still, they are times
        check_times(looks.times);
    if (places.size() > 1) {
        auto motion = primitive.motion ? std::make_shared<scene::Motion>(*primitive.motion)
                                       : std::make_shared<scene::Motion>();
        motion->places = places;
        primitive.motion = std::move(motion);
    }
    primitive.solid = solid_of(looks.solid, place);
    scene::Group* const group = place.now();
    primitive.id = place.scene.next_id++;
    scene::Editor& editor = *place.scene.editor;
    const int id = primitive.id;
    const scene::NodeId node =
        (group ? editor.add(*group, std::move(primitive)) : editor.add(std::move(primitive))).node;
    if (!place.scene.numbers.empty())
        place.scene.numbers[id] = node;
    tell_of_repeat(place.scene);
    return id;
}

nb::list slices(nb::handle array, size_t dimensions) {
    nb::list list;
    nb::object even;
    try {
        even = nb::module_::import_("numpy").attr("asarray")(array);
    } catch (nb::python_error&) { // what it is will be said where it is used
    }
    if (!even.is_valid() || nb::cast<size_t>(even.attr("ndim")) != dimensions + 1) {
        list.append(array);
        return list;
    }
    for (nb::handle slice : even)
        list.append(slice);
    if (list.size() == 0)
        throw nb::value_error("points: there is no time at all");
    return list;
}

scene::Value positions(nb::handle points, bool homogeneous) {
    scene::Value P;
    P.name = homogeneous ? "Pw" : "P";
    P.type = homogeneous ? Type::HPoint : Type::Point;
    P.detail = Detail::Vertex;
    P.floats = float_rows(points, homogeneous ? 4 : 3, "points").buffer;
    return P;
}

int add(Place place, scene::Geometry geometry, const PointPrimvars& given, const Looks& looks) {
    scene::Primitive primitive;
    primitive.geometry = std::move(geometry);
    primitive.primvars.set(positions(given.points[0], given.homogeneous));
    const size_t vertices = primitive.primvars.values[0].items();
    if (const auto* curves = std::get_if<scene::Curves>(&primitive.geometry)) {
        int64_t total = 0;
        for (const int32_t n : curves->vertices_per_curve)
            total += n;
        if (total != int64_t(vertices))
            throw nb::value_error(("counts: they add up to " + std::to_string(total) + ", but there are " +
                                   std::to_string(vertices) + " points")
                                      .c_str());
    }
    if (const auto fault = scene::fault_of(primitive.geometry, vertices))
        throw nb::value_error(fault->c_str());
    const scene::PrimvarCounts n = scene::primvar_counts(primitive.geometry, vertices);
    const DetailCount counts[] = {{Detail::Vertex, n.vertex},
                                  {Detail::Varying, n.varying},
                                  {Detail::FaceVarying, n.face_varying},
                                  {Detail::Uniform, n.uniform},
                                  {Detail::Constant, 1}};
    add_primvars(primitive, given, counts, looks.times);
    return add(place, std::move(primitive), looks);
}

void add_primvars(scene::Primitive& primitive, const PointPrimvars& given,
                  std::span<const DetailCount> counts, nb::handle times) {
    if (!given.widths.is_none())
        primitive.primvars.set(primvar("float width", given.widths, counts, "widths"));
    if (!given.normals.is_none())
        primitive.primvars.set(primvar("normal N", slices(given.normals, 2)[0], counts, "normals"));
    if (!given.uv.is_none())
        primitive.primvars.set(primvar("float[2] st", given.uv, counts, "uv"));
    for (auto [key, value] : given.primvars)
        primitive.primvars.set(primvar(argument<std::string>(key, "primvars: a name"), value, counts));
    add_shapes(primitive, given.points, given.normals, counts, times);
}

void add_shapes(scene::Primitive& primitive, nb::list points, nb::handle normals,
                std::span<const DetailCount> counts, nb::handle times) {
    if (points.size() < 2)
        return;
    const std::vector<double> at = sample_times(times, points.size(), "points");
    const nb::list n = normals.is_none() ? nb::list() : slices(normals, 2);
    if (n.size() > 1 && n.size() != points.size())
        throw nb::value_error("normals: expected as many times as points has, or one");
    auto motion = std::make_shared<scene::Motion>();
    for (size_t i = 0; i < at.size(); i++) {
        scene::Value P = positions(points[i], primitive.primvars.values[0].type == Type::HPoint);
        if (P.floats.size() != primitive.primvars.values[0].floats.size())
            throw nb::value_error("points: they must be as many at all times");
        motion->shapes.push_back({at[i], primitive.geometry, primitive.primvars});
        motion->shapes.back().primvars.set(std::move(P));
        if (n.size() > 1)
            motion->shapes.back().primvars.set(primvar("normal N", n[i], counts, "normals"));
    }
    primitive.motion = std::move(motion);
}

} // namespace kanuka::python
