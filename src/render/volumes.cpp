#include "render/volumes.h"

#include <algorithm>
#include <cmath>

namespace kanuka::render {

using namespace scene;

namespace {

Value color_value(const char* name, Rgb c) {
    Value v;
    v.name = name;
    v.type = Type::Color;
    v.floats = std::vector<float>{c.x, c.y, c.z};
    return v;
}

Transform unit_from_object(const std::array<float, 6>& bound) {
    const auto width = [&](size_t k) { return double(bound[2 * k + 1]) - double(bound[2 * k]); };
    return Transform::scale(1 / width(0), 1 / width(1), 1 / width(2)) *
           Transform::translate(-double(bound[0]), -double(bound[2]), -double(bound[4]));
}

} // namespace

Primitive boundary_of(const Primitive& primitive, const Volume& volume) {
    Primitive box = primitive;
    box.motion = nullptr;
    if (primitive.attributes &&
        !(primitive.attributes->opacity == Rgb(1))) { // it is of the inside, not of the boundary
        auto whole = std::make_shared<Attributes>(*primitive.attributes);
        whole->opacity = Rgb(1);
        box.attributes = std::move(whole);
    }
    std::erase_if(box.primvars.values,
                  [](const Value& v) { return v.detail != Detail::Constant || v.name == "Os"; });
    Value p;
    p.name = "P";
    p.type = Type::Point;
    p.detail = Detail::Vertex;
    std::vector<float> corners;
    for (size_t k = 0; k < 8; k++)
        corners.insert(corners.end(),
                       {volume.bound[k & 1], volume.bound[2 + (k >> 1 & 1)], volume.bound[4 + (k >> 2)]});
    p.floats = std::move(corners);
    box.primvars.set(std::move(p));
    PolygonMesh mesh; // outsides outwards
    mesh.vertices_per_loop = std::vector<int32_t>(6, 4);
    mesh.vertices =
        std::vector<int32_t>{0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6};
    box.geometry = std::move(mesh);
    return box;
}

std::shared_ptr<const Attributes> as_smoke(const Attributes& attributes) {
    auto smoke = std::make_shared<Attributes>(attributes);
    const Rgb& albedo = attributes.color;
    ShaderRef cloud;
    cloud.name = "cloud";
    cloud.parameters.set(color_value("scattering", attributes.opacity * albedo));
    cloud.parameters.set(color_value("absorption", attributes.opacity * (Rgb(1) - albedo)));
    smoke->surface = std::move(cloud);
    smoke->displacement.reset();
    smoke->opacity = Rgb(1);
    return smoke;
}

Thickness thickness_of(const Primitive& primitive, const Volume& volume,
                       const Transform& render_from_object) {
    Thickness t;
    const Attributes* a = primitive.attributes.get();
    const std::string name = a ? a->density_primvar : Attributes().density_primvar;
    const Value* values = primitive.primvars.find(name);
    if (values && (values->floats.empty() || values->array_size != 1))
        values = nullptr;
    std::vector<float> density;
    if (values) {
        const size_t each = size_t(components(values->type)); // of colours the mean
        for (size_t i = 0; i + each <= values->floats.size(); i += each) {
            double sum = 0;
            for (size_t c = 0; c < each; c++)
                sum += double(values->floats[i + c]);
            const double d = sum / double(each);
            t.bad += !(d >= 0 && std::isfinite(d));
            density.push_back(d >= 0 && std::isfinite(d) ? float(d) : 0.0f);
        }
    } else
        density.push_back(1);
    t.most = *std::max_element(density.begin(), density.end());
    double sum = 0;
    for (const float d : density)
        sum += double(d);
    t.mean = float(sum / double(density.size()));
    const bool even = density.size() == 1;
    if ((even && volume.shape == Volume::Shape::Box) || !(t.most > 0))
        return t;
    t.field = std::make_shared<store::DensityField>();
    t.field->shape = store::DensityField::Shape(volume.shape);
    if (!even)
        t.field->size = volume.size;
    for (float& d : density)
        d /= t.most;
    t.field->density = std::move(density);
    const Transform unit = unit_from_object(volume.bound) * render_from_object.inverse();
    for (size_t k = 0; k < 12; k++)
        t.field->unit_from_render[k] = float(unit.m[k / 4][k % 4]);
    return t;
}

} // namespace kanuka::render
