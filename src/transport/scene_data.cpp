#include "transport/scene_data.h"

#include <cmath>
#include <numeric>

#include "color/color.h"

namespace kanuka::transport {

namespace {

using Kind = scene::Light::Kind;

// Wavelengths are drawn where the sensor looks: density in proportion to the sum of its curves, with a floor
// that keeps the ends of the range from becoming fireflies.
void fill_wavelengths(WavelengthTable& table, const color::Sensor& sensor, const color::Table& white) {
    const auto &x = sensor.importance[0], &y = sensor.importance[1], &z = sensor.importance[2];
    std::vector<double> cumulative(color::LambdaCount, 0);
    double mean = 0;
    for (int i = 0; i < color::LambdaCount; i++)
        mean += double(x[i] + y[i] + z[i]) / color::LambdaCount;
    for (int i = 1; i < color::LambdaCount; i++) {
        const double density =
            0.5 * double(x[i] + y[i] + z[i] + x[i - 1] + y[i - 1] + z[i - 1]) + 0.02 * mean;
        cumulative[size_t(i)] = cumulative[size_t(i) - 1] + density;
    }
    table.quantile.resize(WavelengthTable::Segments + 1);
    size_t at = 0;
    for (int k = 0; k <= WavelengthTable::Segments; k++) {
        const double target = cumulative.back() * k / WavelengthTable::Segments;
        while (at + 2 < cumulative.size() && cumulative[at + 1] < target)
            at++;
        const double f = (target - cumulative[at]) / (cumulative[at + 1] - cumulative[at]);
        table.quantile[size_t(k)] = float((double(at) + f) / (color::LambdaCount - 1));
    }
    for (int i = 0; i < 480; i++) {
        const size_t j = size_t(std::min(i, color::LambdaCount - 1));
        for (int c = 0; c < 3; c++)
            table.sensor[i][c] = sensor.curves[c][j];
        table.sensor[i][3] = table.lookup_white[i] = white[j];
    }
}

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

AnalyticLight make_light(const scene::Light& light, const Transform& render_from_world,
                         const color::Palette& palette, std::vector<float>& tables) {
    const Transform render_from_light = render_from_world * light.world_from_light;
    const float degrees = Pi / 180;
    AnalyticLight a{};
    a.kind = int(light.kind);
    uplift_amount(light.amount, palette, a.c);
    a.position = render_from_light.point({0, 0, 0});
    a.axis = normalize(render_from_light.vector({0, 0, 1}));
    a.cos_outer = std::cos(light.cone_angle * degrees);
    a.cos_inner = std::cos(std::max(0.0f, light.cone_angle - light.cone_delta_angle) * degrees);
    a.exponent = light.beam_distribution;
    a.cos_angle = std::cos(0.5f * light.angle * degrees);
    a.radius = light.radius;
    for (int r = 0; r < 3; r++) {
        const Vec3f axis = normalize(
            render_from_light.vector({r == 0 ? 1.0f : 0.0f, r == 1 ? 1.0f : 0.0f, r == 2 ? 1.0f : 0.0f}));
        for (int c = 0; c < 3; c++)
            a.light_from_render[3 * r + c] = axis[c];
    }
    if (const scene::LightTable* t = light.table.get()) {
        a.table = int(tables.size());
        a.width = t->width, a.height = t->height, a.layers = t->layers;
        a.falloff = t->falloff;
        a.angle = t->angle, a.nearest = t->nearest, a.extent = t->extent;
        tables.insert(tables.end(), t->rgb.begin(), t->rgb.end());
    }
    return a;
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
        v = std::isfinite(v) ? std::clamp(v * tint[i % 3], 0.0f, 1e6f) : 0.0f;
    }
    // Weight of a texel: the largest luminance that bilinear interpolation can bring into it, times its solid
    // angle.
    const int w = map.width, h = map.height;
    std::vector<float> luminance(size_t(w) * h);
    for (size_t i = 0; i < luminance.size(); i++)
        luminance[i] = color::luminance({map.rgb[3 * i], map.rgb[3 * i + 1], map.rgb[3 * i + 2]});
    map.marginal.assign(size_t(h) + 1, 0);
    map.conditional.assign(size_t(h) * (w + 1), 0);
    double total = 0;
    std::vector<double> rows(size_t(h), 0.0);
    for (int j = 0; j < h; j++) {
        const double sine = std::sin(Pi * (j + 0.5) / h);
        std::vector<double> c(size_t(w) + 1, 0.0);
        for (int i = 0; i < w; i++) {
            float m = 0;
            for (int dj = -1; dj <= 1; dj++)
                for (int di = -1; di <= 1; di++)
                    m = std::max(
                        m, luminance[size_t(std::clamp(j + dj, 0, h - 1)) * w + size_t((i + di + w) % w)]);
            c[size_t(i) + 1] = c[size_t(i)] + double(m) + 1e-9;
        }
        rows[size_t(j)] = c.back() * sine;
        total += rows[size_t(j)];
        for (int i = 0; i <= w; i++)
            map.conditional[size_t(j) * (w + 1) + i] = float(c[size_t(i)] / c.back());
    }
    double sum = 0;
    for (int j = 0; j < h; j++) {
        sum += rows[size_t(j)];
        map.marginal[size_t(j) + 1] = float(sum / total);
    }
    map.total = float(total);
    const Transform t = (render_from_world * light.world_from_light).inverse();
    for (int r = 0; r < 3; r++) {
        Vec3f row{float(t.m[r][0]), float(t.m[r][1]), float(t.m[r][2])};
        row = normalize(row);
        for (int c = 0; c < 3; c++)
            map.environment_from_render[3 * r + c] = row[c];
    }
}

// Vose's alias method (1991).
void fill_alias(SceneView& view, const std::vector<store::Emitter>& emitters,
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

// Estimates for LightChances: irradiance, in units of luminance.
void fill_choices(SceneView& view, const std::vector<store::Emitter>& emitters,
                  const std::vector<int32_t>& sampled) {
    Bounds3f bounds;
    double power = 0;
    for (int32_t e : sampled) {
        bounds.extend(emitters[size_t(e)].p0 +
                      (emitters[size_t(e)].e1 + emitters[size_t(e)].e2) * (1 / 3.0f));
        power += emitters[size_t(e)].power;
    }
    if (!sampled.empty()) {
        const Vec3f d = bounds.diagonal();
        view.emitter_center = bounds.center();
        view.emitter_radius2 = std::max(0.25f * dot(d, d), 1e-12f);
        view.emitter_power = float(power);
    }
    if (view.map_choice >= 0) // pi times the mean of luminance over the sphere
        view.map_brings = view.map.total * 0.5f * Pi * Pi / (float(view.map.width) * float(view.map.height));
}

std::vector<int32_t> emitters_to_sample(const SceneInputs& in) {
    std::vector<int32_t> sampled;
    const auto& shapes = in.store->shapes();
    const auto& all = in.store->emitters();
    for (const auto& range : in.world.shapes)
        for (int s = range.first; s < range.first + range.count; s++) {
            const store::ShapeRecord& shape = shapes[size_t(s)];
            if (shape.emitter < 0 || shape.motion_segments > 0) // what changes its shape is met by chance
                continue;
            const bool mesh = shape.flags & store::ShapeRecord::Mesh,
                       quads = shape.flags & store::ShapeRecord::Quads;
            const int triangles = mesh ? shape.mv * (quads ? 2 : 1) : shape.mu * shape.mv * 2;
            for (int e = shape.emitter; e < shape.emitter + triangles; e++)
                if (all[size_t(e)].power > 0 && all[size_t(e)].area > 0 &&
                    std::isfinite(all[size_t(e)].power))
                    sampled.push_back(e);
        }
    return sampled;
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
    view.bvh = in.bvh;
    view.instanced = in.instanced;
    view.aov_is_color = in.aov_is_color;
    for (const auto& program : in.store->programs())
        view.materials.emplace_back(program);
    for (const auto& m : view.materials)
        view.dispersive |= m.dispersive;
    for (const auto& interior : in.store->interiors()) {
        SceneView::Interior i{};
        std::copy(interior.absorption_spectrum.begin(), interior.absorption_spectrum.end(), i.c);
        i.absorbs = interior.absorbs;
        view.interiors.push_back(i);
    }
    color::Palette rec709;
    color::Palette& palette = in.palette ? *in.palette : rec709;
    color::Sensor observer;
    if (!in.sensor)
        observer = color::make_sensor(color::Observer::Cie1931, palette.white(), color::Space::Rec709);
    const color::Sensor& sensor = in.sensor ? *in.sensor : observer;
    const color::UpliftTable& uplift = palette.uplift_table();
    view.uplift = {uplift.coefficients.data(), uplift.resolution, uplift.z_factor, uplift.z_offset};
    fill_wavelengths(view.wavelengths, sensor, palette.white());
    for (size_t i = 0; i < 9; i++)
        view.sensor_matrix[i] = sensor.output_from_sensor[i / 3][i % 3];
    view.filter_x = in.filter_x.data();
    view.filter_y = in.filter_y.data();
    view.filter_weight_x = in.filter_weight_x.empty() ? nullptr : in.filter_weight_x.data();
    view.filter_weight_y = in.filter_weight_y.empty() ? nullptr : in.filter_weight_y.data();
    view.filter_size = int(in.filter_x.size()) - 1;
    view.camera = in.camera;
    view.moving = in.moving || !in.camera.motion.empty();
    view.shutter_quantiles = in.shutter_quantiles;
    view.max_depth = in.max_depth;
    view.seed = in.seed;

    // Lights. Several constant environments add up; one picture is kept.
    Rgb constant(0);
    std::vector<Rgb> constants;
    bool constant_visible = false;
    for (const scene::Light& light : in.lights) {
        const bool environment = light.kind == Kind::Environment || light.kind == Kind::Ambient;
        if (!std::isfinite(light.amount.x + light.amount.y + light.amount.z) ||
            !finite(light.world_from_light)) {
            journal.warning(light.where, "a light whose amount or place is not a number is left out");
            continue;
        }
        if (!usable(light.amount))
            continue;
        if (environment && light.texture.empty() && !light.table) {
            constant += light.amount;
            constants.push_back(light.amount);
            constant_visible |= light.kind == Kind::Environment && light.visible_camera;
        } else if (environment) {
            if (view.map.width == 0 && in.map.width > 0)
                fill_map(view.map, in.map, light, in.render_from_world);
            else if (view.map.width > 0)
                journal.warning(light.where, "a second environment picture is not used; one scene has one");
        } else
            view.lights.push_back(make_light(light, in.render_from_world, palette, view.light_tables));
    }
    view.constant.present = usable(constant);
    view.constant.visible_camera = constant_visible;
    uplift_amount(constant, palette, view.constant.c);
    if (constants.size() > 1)
        if (const auto sum = palette.sum(constants))
            std::copy(sum->begin(), sum->end(), view.constant.c);
    view.spectra = palette.tables();
    const std::vector<int32_t> sampled = emitters_to_sample(in);
    view.emitter_choice = sampled.empty() ? -1 : view.choices++;
    view.map_choice = view.map.width > 0 ? view.choices++ : -1;
    view.first_light_choice = view.choices;
    view.choices += int(view.lights.size());
    view.emitter_density.assign(in.store->emitters().size() + 1, 0.0f);
    if (view.choices > 0)
        fill_choices(view, in.store->emitters(), sampled);
    if (!sampled.empty())
        fill_alias(view, in.store->emitters(), sampled);
    return view;
}

} // namespace kanuka::transport
