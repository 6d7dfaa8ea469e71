// Lights without triangles: their records, tables, and what the choice among lights knows of them.
#include <cmath>

#include "color/color.h"
#include "transport/lights_setup.h"
#include "transport/quad_pictures.h"

namespace kanuka::transport {

namespace {

using Kind = scene::Light::Kind;

constexpr float Degrees = Pi / 180;

// Places on a quad by its picture; see quad_pictures.h.
void fill_quad_density(AnalyticLight& a, const scene::LightTable& t, std::vector<float>& densities) {
    const int w = t.width, h = t.height;
    const auto weight = [&](int i, int j) {
        const float* rgb = t.at(0, std::clamp(j, 0, h - 1), std::clamp(i, 0, w - 1));
        return texel_weight(rgb[0], rgb[1], rgb[2]);
    };
    double sum = 0;
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++)
            sum += double(weight(i, j));
    const float mean = float(sum / (double(w) * h));
    const PictureCells cells = make_picture_cells(
        w + 1, h + 1, [&](int i, int j) { return double(above_mean(weight(i - 1, j - 1), mean)); },
        [&](int i) { return i == 0 || i == w ? 0.5 : 1.0; },
        [&](int j) { return j == 0 || j == h ? 0.5 : 1.0; });
    // As much as is above the mean, so that a picture without contrast changes nothing.
    const double share = std::min(cells.total / std::max(sum, 1e-30), 0.95);
    if (!(share > 0.05))
        return;
    a.picture = int(densities.size());
    densities.insert(densities.end(),
                     {float(share), float(double(w) * h / (cells.total * double(a.area))), mean});
    densities.insert(densities.end(), cells.marginal.begin(), cells.marginal.end());
    densities.insert(densities.end(), cells.conditional.begin(), cells.conditional.end());
}

// What a light is, its size and its bound. scales: of its axes. amount: of soft points and spots it becomes
// the radiance of their ball.
void shape(const scene::Light& light, const Vec3f& scales, AnalyticLight& a, LightBound& bound, Rgb& amount) {
    using A = AnalyticLight;
    const bool point = light.kind == Kind::Point || light.kind == Kind::Spot;
    const float luminance =
        std::max(color::luminance(amount), 1e-3f * std::max({amount.x, amount.y, amount.z}));
    bound.center = a.position;
    bound.axis = a.axis;
    switch (light.kind) {
    case Kind::Distant:
        a.shape = A::Distant;
        a.cone = float(1 - std::cos(0.5 * double(light.angle * Degrees)));
        if (a.cone < 1e-9f) // narrower than floats tell directions apart
            a.cone = 0;
        bound.power = luminance;
        break;
    case Kind::Quad:
    case Kind::Portal:
        a.shape = A::Quad;
        a.half_x = 0.5f * light.width * scales.x, a.half_y = 0.5f * light.height * scales.y;
        a.area = 4 * a.half_x * a.half_y;
        bound = {a.position, std::hypot(a.half_x, a.half_y), a.axis, 1, 0, luminance * a.area};
        break;
    case Kind::Disk:
        a.shape = A::Disk;
        a.half_x = light.radius * scales.x;
        a.area = Pi * a.half_x * a.half_x;
        bound = {a.position, a.half_x, a.axis, 1, 0, luminance * a.area};
        break;
    case Kind::Cylinder:
        a.shape = A::Cylinder;
        a.half_x = light.radius * scales.x, a.half_y = 0.5f * light.height * scales.z;
        a.area = 4 * Pi * a.half_x * a.half_y;
        bound = {a.position, std::hypot(a.half_x, a.half_y), a.axis, -1, 0, luminance * a.area * InvPi};
        break;
    default: // a ball, or a point
        a.shape = light.radius > 0 ? A::Sphere : A::Delta;
        a.half_x = light.radius * (point ? 1 : scales.x);
        a.area = 4 * Pi * a.half_x * a.half_x;
        bound.radius = a.half_x;
        bound.power = luminance * (point ? 1 : 0.25f * a.area);
        if (point && light.radius > 0)
            amount = amount * (4 / a.area);
        if (point)
            a.visible_camera = false; // classic lights are never in the picture
        if (light.kind == Kind::Spot) {
            bound.cos_spread = 1;
            bound.cos_reach = a.cos_outer;
        }
    }
}

// One analytic light, its amount uplifted.
AnalyticLight make_light(const scene::Light& light, const Transform& render_from_world,
                         const color::Palette& palette, LightBound& bound, std::vector<float>& tables,
                         std::vector<float>& densities) {
    const Transform render_from_light = render_from_world * light.world_from_light;
    AnalyticLight a{};
    a.picture = -1;
    Vec3f columns[3], scales(0.0f);
    for (int k = 0; k < 3; k++) {
        columns[k] =
            render_from_light.vector({k == 0 ? 1.0f : 0.0f, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f});
        scales[k] = length(columns[k]);
        columns[k] = columns[k] * (1 / scales[k]);
    }
    a.position = render_from_light.point({0, 0, 0});
    a.x = columns[0], a.y = columns[1], a.axis = columns[2];
    a.cos_outer = a.cos_inner = -2;
    a.visible_camera = light.visible_camera;
    a.sets = light.lit_sets;
    a.passes = light.shadows ? light.passes : AnalyticLight::Shadowless;
    Rgb amount = light.amount;
    if (light.kind == Kind::Spot) {
        a.cos_outer = std::cos(std::clamp(light.cone_angle, 0.0f, 180.0f) * Degrees);
        a.cos_inner = std::cos(std::clamp(light.cone_angle - light.cone_delta_angle, 0.0f, 180.0f) * Degrees);
        a.exponent = int(std::clamp(light.beam_distribution, 0.0f, 1000.0f));
    }
    shape(light, scales, a, bound, amount);
    uplift_amount(amount, palette, a.c);
    if (const scene::LightTable* t = light.table.get()) {
        a.table = int(tables.size());
        a.width = t->width, a.height = t->height, a.layers = t->layers;
        a.falloff = t->falloff;
        a.angle = t->angle, a.nearest = t->nearest, a.extent = t->extent;
        tables.insert(tables.end(), t->rgb.begin(), t->rgb.end());
        if (a.shape == AnalyticLight::Quad)
            fill_quad_density(a, *t, densities);
    }
    return a;
}

// What keeps a light from shining, in words; null = nothing.
const char* flaw(const scene::Light& light, const AnalyticLight& a) {
    if (light.kind != Kind::Distant && light.kind != Kind::Point && light.kind != Kind::Spot && !(a.area > 0))
        return "a light of no area sheds no light: its size or its transformation is 0";
    const float sum = a.area + a.position.x + a.position.y + a.position.z + a.axis.x + a.x.x + a.y.x;
    if (!std::isfinite(sum) || !std::isfinite(a.half_x + a.half_y))
        return "a light whose size or place is not a number is left out";
    return nullptr;
}

} // namespace

void AnalyticFiller::add(const scene::Light& light) {
    LightBound bound;
    AnalyticLight a = make_light(light, m_in.render_from_world, m_palette, bound, m_data.lights.tables,
                                 m_data.lights.densities);
    a.source = int32_t(&light - m_in.lights.data());
    if (const char* what = flaw(light, a)) {
        m_journal.warning(light.where, what);
        return;
    }
    if (light.kind == Kind::Portal) {
        m_data.lights.portals.push_back(a);
        return;
    }
    bound.sets = light.lit_sets;
    m_data.view.lights.has_tables |= a.width > 0;
    (a.shape == AnalyticLight::Distant ? m_far : m_near).push_back(a);
    (a.shape == AnalyticLight::Distant ? m_far_bounds : m_near_bounds).push_back(bound);
}

void AnalyticFiller::finish() {
    LightsView& view = m_data.view.lights;
    LightsData& own = m_data.lights;
    own.analytic = std::move(m_far);
    own.bounds = std::move(m_far_bounds);
    own.analytic.insert(own.analytic.end(), m_near.begin(), m_near.end());
    own.bounds.insert(own.bounds.end(), m_near_bounds.begin(), m_near_bounds.end());
    constexpr size_t Few = 16; // cheaper to weigh one by one than by the hierarchy, and more exactly
    const bool few = own.analytic.size() <= Few;
    view.distant = int(own.analytic.size() - m_near.size());
    view.by_choice = few ? int(own.analytic.size()) : view.distant;
    std::vector<LightBound> hittable(own.bounds);
    size_t shapes = 0;
    for (size_t k = 0; k < own.analytic.size(); k++) {
        const AnalyticLight& light = own.analytic[k];
        view.shapes |= 1u << light.shape;
        view.points_in_tree |= int(k) >= view.by_choice && light.shape == AnalyticLight::Delta;
        if (light.shape >= AnalyticLight::Quad) {
            shapes++;
            if (few)
                own.hittable.push_back(int32_t(k));
        } else {
            hittable[k].power = 0;
            if (light.shape == AnalyticLight::Distant && light.cone > 0)
                own.suns.push_back(int32_t(k));
        }
    }
    if (!few && shapes > 0)
        own.hittable_tree = build_light_tree(hittable);
    view.keeps_normals = shapes > 0 || !own.suns.empty();
    view.analytic = own.analytic;
    view.bounds = own.bounds;
    view.tables = own.tables;
    view.densities = own.densities;
    view.hittable = own.hittable;
    view.hittable_tree = own.hittable_tree;
    view.suns = own.suns;
}

} // namespace kanuka::transport
