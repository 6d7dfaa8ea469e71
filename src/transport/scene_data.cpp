#include "transport/scene_data.h"

#include <cmath>
#include <numeric>

#include "color/color.h"
#include "color/photometry.h"
#include "transport/media_setup.h"
#include "transport/quad_pictures.h"
#include "transport/wavelengths.h"

namespace kanuka::transport {

namespace {

using Kind = scene::Light::Kind;

// Any non-negative RGB as scale * S(lambda): twice the maximum, to stay where spectra are smooth.
void uplift_amount(const Rgb& rgb, const color::Palette& palette, float out[4]) {
    const float m = std::max({rgb.x, rgb.y, rgb.z, 0.0f});
    const auto c = palette.emission(m > 0 ? rgb : Rgb(0), 2 * m);
    std::copy(c.begin(), c.end(), out);
}

bool finite(const Transform& t) {
    for (const auto& row : t.m)
        for (double x : row)
            if (!std::isfinite(x))
                return false;
    return true;
}

bool usable(const Rgb& c) {
    return std::isfinite(c.x + c.y + c.z) && std::max({c.x, c.y, c.z}) > 0;
}

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

// One analytic light, its amount uplifted; of soft points and spots it becomes the radiance of their ball.
AnalyticLight make_light(const scene::Light& light, const Transform& render_from_world,
                         const color::Palette& palette, LightBound& bound, std::vector<float>& tables,
                         std::vector<float>& densities) {
    using A = AnalyticLight;
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
    const bool point = light.kind == Kind::Point || light.kind == Kind::Spot;
    if (light.kind == Kind::Spot) {
        a.cos_outer = std::cos(std::clamp(light.cone_angle, 0.0f, 180.0f) * Degrees);
        a.cos_inner = std::cos(std::clamp(light.cone_angle - light.cone_delta_angle, 0.0f, 180.0f) * Degrees);
        a.exponent = int(std::clamp(light.beam_distribution, 0.0f, 1000.0f));
    }
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
    uplift_amount(amount, palette, a.c);
    if (const scene::LightTable* t = light.table.get()) {
        a.table = int(tables.size());
        a.width = t->width, a.height = t->height, a.layers = t->layers;
        a.falloff = t->falloff;
        a.angle = t->angle, a.nearest = t->nearest, a.extent = t->extent;
        tables.insert(tables.end(), t->rgb.begin(), t->rgb.end());
        if (a.shape == A::Quad)
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

// A sky is turned and mirrored, but never stretched: densities would have to follow. The orthogonal factor of
// the polar decomposition, by Newton's iteration (Higham 1986).
Transform nearest_rotation(Transform t) {
    t.m[0][3] = t.m[1][3] = t.m[2][3] = 0;
    const double size = std::cbrt(std::abs(t.determinant3()));
    for (auto& row : t.m)
        for (size_t c = 0; c < 3; c++)
            row[c] /= size;
    for (int k = 0; k < 32; k++) {
        const Transform inverse = t.inverse();
        for (size_t r = 0; r < 3; r++)
            for (size_t c = 0; c < 3; c++)
                t.m[r][c] = 0.5 * (t.m[r][c] + inverse.m[c][r]);
    }
    return t;
}

void fill_map(EnvironmentMap& map, const LatLong& picture, const scene::Light& light,
              const Transform& render_from_world) {
    map.width = picture.width;
    map.height = picture.height;
    map.visible_camera = light.visible_camera;
    map.rgb = picture.rgb;
    const float tint[3] = {light.amount.x, light.amount.y, light.amount.z};
    for (size_t i = 0; i < map.rgb.size(); i++) {
        float& v = map.rgb[i];
        v = std::isfinite(v) ? std::clamp(v * tint[i % 3], 0.0f, color::LargestRadiance) : 0.0f;
    }
    const int w = map.width, h = map.height;
    const auto weight = [&](int i, int j) {
        const float* t = map.rgb.data() + 3 * (size_t(j) * size_t(w) + size_t(i));
        return texel_weight(t[0], t[1], t[2]);
    };
    double sum = 0, all = 0;
    for (int j = 0; j < h; j++) {
        const double sine = std::sin(double(Pi) * (j + 0.5) / h);
        for (int i = 0; i < w; i++)
            sum += double(weight(i, j)) * sine;
        all += sine * w;
    }
    // A picture that is the same everywhere has nothing to be asked for.
    map.mean = float(sum / all * 1.0001);
    PictureCells cells = make_picture_cells(
        w, h + 1,
        [&](int i, int j) { // corners: at the poles, and at texel centres
            const double theta = double(Pi) * std::clamp(j - 0.5, 0.0, double(h)) / h;
            return double(above_mean(weight(i % w, std::clamp(j - 1, 0, h - 1)), map.mean)) *
                   (j == 0 || j == h + 1 ? 0.0 : std::sin(theta));
        },
        [](int) { return 1.0; }, [&](int j) { return j == 0 || j == h ? 0.5 : 1.0; });
    if (cells.total > 0) {
        map.density = float(double(w) * h / (2 * double(Pi) * double(Pi) * cells.total));
        map.cells = std::move(cells);
    }
    const Transform t = nearest_rotation((render_from_world * light.world_from_light).inverse());
    for (size_t r = 0; r < 3; r++)
        for (size_t c = 0; c < 3; c++)
            map.environment_from_render[3 * r + c] = float(t.m[r][c]);
}

// Vose's alias method (1991).
void fill_alias(SceneView& view, std::span<const store::Emitter> emitters,
                const std::vector<int32_t>& sampled) {
    double total = 0;
    for (int32_t e : sampled)
        total += emitters[size_t(e)].power;
    const size_t n = sampled.size();
    view.sampled_emitters = sampled;
    view.alias_probability.assign(n, 1.0f);
    view.alias_other.resize(n);
    std::iota(view.alias_other.begin(), view.alias_other.end(), 0);
    std::vector<double> scaled(n);
    std::vector<int> small, large;
    for (size_t i = 0; i < n; i++) {
        scaled[i] = emitters[size_t(sampled[i])].power / total * double(n);
        (scaled[i] < 1 ? small : large).push_back(int(i));
    }
    while (!small.empty() && !large.empty()) {
        const int s = small.back(), l = large.back();
        small.pop_back();
        view.alias_probability[size_t(s)] = float(scaled[size_t(s)]);
        view.alias_other[size_t(s)] = l;
        scaled[size_t(l)] -= 1 - scaled[size_t(s)];
        if (scaled[size_t(l)] < 1) {
            large.pop_back();
            small.push_back(l);
        }
    }
    for (int32_t e : sampled)
        view.emitter_density[size_t(e)] =
            float(double(emitters[size_t(e)].power) / total / emitters[size_t(e)].area);
}

// What is in the hierarchy, or in the alias table, as a sphere: an estimate for LightChances.
void fill_estimates(SceneView& view, std::span<const LightBound> asked) {
    Bounds3f bounds;
    double power = 0;
    for (const LightBound& b : asked)
        if (b.power > 0) {
            bounds.extend(b.center);
            power += double(b.power);
        }
    if (!bounds.empty()) {
        const Vec3f d = bounds.diagonal();
        view.emitter_center = bounds.center();
        view.emitter_radius2 = std::max(0.25f * dot(d, d), 1e-12f);
        view.emitter_power = float(power);
    }
}

// Lights of the scene: environments, then analytic ones, those to be chosen in turn first.
void fill_lights(SceneView& view, const SceneInputs& in, color::Palette& palette, Journal& journal) {
    // Several constant environments add up; one picture is kept.
    struct Sum {
        Rgb all{0, 0, 0};
        std::vector<Rgb> parts;
        void add(const Rgb& amount) {
            all += amount;
            parts.push_back(amount);
        }
        void uplift(color::Palette& palette, float c[4]) const {
            uplift_amount(all, palette, c);
            if (parts.size() > 1)
                if (const auto sum = palette.sum(parts))
                    std::copy(sum->begin(), sum->end(), c);
        }
    } constant, ambient;
    bool constant_visible = false;
    int32_t constant_sets = 0;
    LargeVector<AnalyticLight> far, near;
    std::vector<LightBound> far_bounds, near_bounds;
    for (const scene::Light& light : in.lights) {
        const bool environment = light.kind == Kind::Environment;
        if (!std::isfinite(light.amount.x + light.amount.y + light.amount.z) ||
            !finite(light.world_from_light)) {
            journal.warning(light.where, "a light whose amount or place is not a number is left out");
            continue;
        }
        if (!usable(light.amount))
            continue;
        view.linked |= light.lit_sets != -1;
        view.shadow_linked |= light.passes != 0;
        view.shadowless |= !light.shadows;
        if (light.kind == Kind::Ambient) {
            ambient.add(light.amount);
            view.ambient.sets |= light.lit_sets;
        } else if (environment && light.texture.empty() && !light.table) {
            constant.add(light.amount);
            constant_visible |= light.visible_camera;
            constant_sets |= light.lit_sets;
        } else if (environment) {
            if (!(std::abs(light.world_from_light.determinant3()) > 1e-30)) {
                journal.warning(light.where,
                                "an environment's transformation is flat: its picture is left out");
                continue;
            }
            if (view.map.width == 0 && in.map.width > 0) {
                fill_map(view.map, in.map, light, in.render_from_world);
                view.map_sets = light.lit_sets;
            } else if (view.map.width > 0)
                journal.warning(light.where, "a second environment picture is not used; one scene has one");
        } else {
            LightBound bound;
            AnalyticLight a = make_light(light, in.render_from_world, palette, bound, view.light_tables,
                                         view.light_densities);
            a.source = int32_t(&light - in.lights.data());
            if (const char* what = flaw(light, a)) {
                journal.warning(light.where, what);
                continue;
            }
            bound.sets = light.lit_sets;
            view.light_tables_used |= a.width > 0;
            (a.shape == AnalyticLight::Distant ? far : near).push_back(a);
            (a.shape == AnalyticLight::Distant ? far_bounds : near_bounds).push_back(bound);
        }
    }
    view.ambient.present = usable(ambient.all);
    ambient.uplift(palette, view.ambient.c);
    view.constant.present = usable(constant.all);
    view.constant.visible_camera = constant_visible;
    view.constant_sets = constant_sets;
    constant.uplift(palette, view.constant.c);
    view.spectra = palette.tables();
    view.lights = std::move(far);
    view.bounds = std::move(far_bounds);
    view.lights.insert(view.lights.end(), near.begin(), near.end());
    view.bounds.insert(view.bounds.end(), near_bounds.begin(), near_bounds.end());
    constexpr size_t Few = 16; // cheaper to weigh one by one than by the hierarchy, and more exactly
    const bool few = view.lights.size() <= Few;
    view.distant_lights = int(view.lights.size() - near.size());
    view.lights_by_choice = few ? int(view.lights.size()) : view.distant_lights;
    std::vector<LightBound> met(view.bounds);
    size_t shapes = 0;
    for (size_t k = 0; k < view.lights.size(); k++) {
        view.light_shapes |= 1u << view.lights[k].shape;
        view.points_in_tree |=
            int(k) >= view.lights_by_choice && view.lights[k].shape == AnalyticLight::Delta;
        if (view.lights[k].shape >= AnalyticLight::Quad) {
            shapes++;
            if (few)
                view.met_lights.push_back(int32_t(k));
        } else {
            met[k].power = 0;
            if (view.lights[k].shape == AnalyticLight::Distant && view.lights[k].cone > 0)
                view.suns.push_back(int32_t(k));
        }
    }
    if (!few && shapes > 0)
        view.met_tree = build_light_tree(met);
    view.keeps_normals = shapes > 0 || !view.suns.empty();
}

LightBound bound_of(const store::Emitter& e, const float* placement, int32_t sets) {
    Vec3f p = e.p0, e1 = e.e1, e2 = e.e2;
    float side = e.flags & 1 ? -1.0f : 1.0f;
    if (placement) {
        const float* m = placement;
        const auto turn = [&](const Vec3f& v) {
            return Vec3f(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
                         m[8] * v.x + m[9] * v.y + m[10] * v.z);
        };
        p = turn(p) + Vec3f(m[3], m[7], m[11]);
        e1 = turn(e1), e2 = turn(e2);
        const Vec3f r0(m[0], m[1], m[2]), r1(m[4], m[5], m[6]), r2(m[8], m[9], m[10]);
        side *= std::copysign(1.0f, dot(r0, cross(r1, r2)));
    }
    const Vec3f n = cross(e1, e2), middle = (e1 + e2) * (1 / 3.0f);
    const float twice = length(n);
    LightBound b;
    b.center = p + middle;
    b.radius = std::max({length(middle), length(e1 - middle), length(e2 - middle)});
    b.axis = twice > 0 ? n * (side / twice) : Vec3f(0, 0, 1);
    b.cos_spread = 1;
    b.cos_reach = store::EmissionShape::reach_of(e.flags);
    b.power = twice > 0 && e.area > 0 ? e.power / e.area * 0.5f * twice : 0.0f;
    b.sets = sets;
    return b;
}

// Leaves for the triangles of a group and of what is placed in it, slot by slot.
class SlotFiller {
  public:
    SlotFiller(SceneView& view, const SceneInputs& in, std::vector<LightBound>& leaves)
        : m_view(view), m_in(in), m_leaves(leaves) {}

    void place(const bvh::GroupDesc& group, const float* transform, int first_slot) {
        if (group.emitters > 0) {
            int placement = -1;
            if (transform) {
                placement = int(m_view.placements.size() / 12);
                m_view.placements.insert(m_view.placements.end(), transform, transform + 12);
            }
            fill(group, transform, placement, first_slot);
        }
        for (const auto& in : group.instances) {
            if (in.first_slot < 0)
                continue;
            const bvh::GroupDesc& child = m_in.groups[size_t(in.group)];
            for (size_t i = 0; i + 12 <= in.transforms.size(); i += 12) {
                float m[12];
                const float* t = in.transforms.data() + i;
                for (int r = 0; r < 3; r++)
                    for (int c = 0; c < 4; c++)
                        m[4 * r + c] = transform ? transform[4 * r] * t[c] + transform[4 * r + 1] * t[4 + c] +
                                                       transform[4 * r + 2] * t[8 + c] +
                                                       (c == 3 ? transform[4 * r + 3] : 0)
                                                 : t[4 * r + c];
                place(child, m, first_slot + in.first_slot + int(i / 12) * child.slots);
            }
        }
    }

  private:
    void fill(const bvh::GroupDesc& group, const float* transform, int placement, int first_slot) {
        for (const auto& range : group.shapes)
            for (int s = range.first; s < range.first + range.count; s++) {
                const store::ShapeRecord& shape = m_in.store->shapes()[size_t(s)];
                if (shape.emitter < 0 || shape.motion_segments > 0) // what changes its shape is met by chance
                    continue;
                for (int e = shape.emitter; e < shape.emitter + store::emitter_count(shape); e++) {
                    const int slot = first_slot + e - group.first_emitter;
                    m_leaves[size_t(slot)] = bound_of(m_in.store->emitters()[size_t(e)], transform,
                                                      m_in.store->links_of(s).shone_sets);
                    if (placement >= 0) {
                        m_view.slot_emitter[size_t(slot - m_view.world_slots)] = e;
                        m_view.slot_placement[size_t(slot - m_view.world_slots)] = placement;
                    }
                }
            }
    }

    SceneView& m_view;
    const SceneInputs& m_in;
    std::vector<LightBound>& m_leaves;
};

// The hierarchy, or the alias table where one patch is all there is.
void fill_emitters(SceneView& view, const SceneInputs& in) {
    const bvh::GroupDesc& world = in.groups.back();
    view.triangle_slots = world.slots;
    view.world_slots = world.emitters;
    view.first_emitter = world.first_emitter;
    view.slot_emitter.assign(size_t(world.slots - world.emitters), 0);
    view.slot_placement.assign(size_t(world.slots - world.emitters), 0);
    std::vector<LightBound> leaves(size_t(world.slots));
    SlotFiller(view, in, leaves).place(world, nullptr, 0);
    leaves.insert(leaves.end(), view.bounds.begin(), view.bounds.end());
    for (int k = 0; k < view.lights_by_choice; k++) // asked by choice of their own
        leaves[size_t(view.triangle_slots + k)].power = 0;
    std::vector<int32_t> asked;
    for (size_t i = 0; i < leaves.size() && asked.size() <= 2; i++)
        if (leaves[i].power > 0 && std::isfinite(leaves[i].power))
            asked.push_back(int32_t(i));
    if (asked.empty())
        return;
    view.emitter_choice = 0;
    fill_estimates(view, leaves);
    if (asked.size() <= 2 && asked.back() < view.world_slots && !view.linked) {
        view.emitter_density.assign(in.store->emitters().size() + 1, 0.0f);
        for (int32_t& slot : asked)
            slot += view.first_emitter;
        fill_alias(view, in.store->emitters(), asked);
        return;
    }
    view.tree = build_light_tree(leaves);
    view.keeps_normals = true;
}

} // namespace

SceneView make_scene_view(const SceneInputs& in, Journal& journal) {
    SceneView view;
    view.words = in.store->words();
    view.floats = in.store->floats();
    static const store::ShapeRecord no_shape{};
    view.shapes =
        reinterpret_cast<const int32_t*>(in.store->shapes().empty() ? &no_shape : in.store->shapes().data());
    view.emitters = in.store->emitters().data();
    view.links = in.store->links().data();
    view.bvh = in.bvh;
    view.instanced = in.instanced;
    view.aov_is_color = in.aov_is_color;
    for (const auto& program : in.store->programs())
        view.materials.emplace_back(program);
    for (const auto& m : view.materials) {
        view.keeps_ratios |= m.dispersive;
        if (m.air >= 0 && std::ranges::find(view.airs, m.air) == view.airs.end())
            view.airs.push_back(m.air);
    }
    view.point_lights = in.point_lights;
    for (const PointLight& light : in.point_lights)
        view.shadow_linked |= light.passes != 0;
    for (const store::ShapeRecord& s : in.store->shapes())
        view.tinted |= (s.flags & store::ShapeRecord::Tinted) != 0;
    color::Palette rec709;
    color::Palette& palette = in.palette ? *in.palette : rec709;
    color::Sensor observer;
    if (!in.sensor)
        observer = color::make_sensor(color::Observer::Cie1931, palette.white(), color::Space::Rec709);
    const color::Sensor& sensor = in.sensor ? *in.sensor : observer;
    const color::UpliftTable& uplift = palette.uplift_table();
    view.uplift = {uplift.coefficients.data(), uplift.resolution, uplift.z_factor, uplift.z_offset};
    view.wavelengths = make_wavelengths(sensor, palette.white());
    for (size_t i = 0; i < 9; i++)
        view.sensor_matrix[i] = sensor.output_from_sensor[i / 3][i % 3];
    view.filter_x = in.filter_x.data();
    view.filter_y = in.filter_y.data();
    view.filter_weight_x = in.filter_weight_x.empty() ? nullptr : in.filter_weight_x.data();
    view.filter_weight_y = in.filter_weight_y.empty() ? nullptr : in.filter_weight_y.data();
    view.filter_size = int(in.filter_x.size()) - 1;
    view.filter_cells = in.filter_cells;
    view.camera = in.camera;
    view.moving = in.moving || !in.camera.motion.empty();
    view.shutter_quantiles = in.shutter_quantiles;
    view.integrator = in.integrator;
    view.clamp_direct = in.clamp_direct > 0 ? in.clamp_direct : Unclamped;
    view.clamp_indirect = in.clamp_indirect > 0 ? in.clamp_indirect : Unclamped;
    view.max_depth = in.max_depth;
    view.interreflection = in.interreflection;
    view.seed = in.seed;
    fill_media(view, *in.store, in.volume_depth, journal);

    for (const store::Links& links : in.store->links()) {
        view.linked |= links.lit_sets != 1 || links.shone_sets != -1;
        view.holds_out |= (links.seen & store::Links::HeldOut) != 0;
        view.hides |= (links.seen & store::Links::Unseen) != 0;
        view.backdrops |= (links.seen & store::Links::Backdrop) != 0;
        view.fades |= links.fades();
    }
    fill_lights(view, in, palette, journal);
    fill_emitters(view, in);
    if (view.tree.empty() && view.emitter_density.empty())
        view.emitter_density.assign(in.store->emitters().size() + 1, 0.0f);
    view.choices = view.emitter_choice >= 0 ? 1 : 0;
    view.map_choice = view.map.cells.rows > 0 ? view.choices++ : -1;
    view.first_light_choice = view.choices;
    view.choices += view.lights_by_choice;
    for (int k = 0; view.has_fog && k < view.lights_by_choice; k++)
        if (view.lights[size_t(k)].shape == AnalyticLight::Delta &&
            view.fog_lamps.size() < SceneView::MostFogLamps)
            view.fog_lamps.push_back(k);
    const bool far = view.map_choice >= 0 || view.distant_lights > 0,
               near = view.emitter_choice >= 0 || view.lights_by_choice > view.distant_lights;
    view.asks = far && near && view.choices <= SceneView::FewChoices ? 2 : 1;
    if (view.map_choice >= 0) // pi times the mean over the sphere of what is asked for
        view.map_brings = 0.25f / view.map.density;
    return view;
}

} // namespace kanuka::transport
