#include "shade/light_table.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/latlong.h"
#include "shade/lights.h"

namespace kanuka::shade {

namespace {

constexpr int Columns = 256, Rows = 128, MostLayers = 12, PlaneSize = 512;

struct Samples {
    int width, height;
    sl::Emission emission;
    std::vector<float> rgb; // row by row
};

// Cl on a lattice of points: neighbours are neighbours, so that textures are filtered.
Samples run(const sl::Instance& shader, sl::Services& services, const sl::GridGlobals& globals, int width,
            int height, const std::function<Vec3f(int, int)>& place) {
    grid::Grid points;
    points.allocate(width - 1, height - 1);
    const size_t stride = size_t(points.stride);
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const size_t at = size_t(j) * size_t(width) + size_t(i);
            const Vec3f p = place(i, j);
            for (int c = 0; c < 3; c++)
                points.P[size_t(c) * stride + at] = p[c];
        }
    Samples s{width, height, shader.emit(points, globals, services), {}};
    s.rgb.resize(size_t(width) * size_t(height) * 3);
    for (size_t i = 0; i < s.rgb.size(); i++) {
        const float x = s.emission.Cl[i % 3 * stride + i / 3];
        s.rgb[i] = std::isfinite(x) ? std::max(x, 0.0f) : 0.0f;
    }
    return s;
}

Vec3f column(const Transform& t, int c) {
    return t.vector({c == 0 ? 1.0f : 0.0f, c == 1 ? 1.0f : 0.0f, c == 2 ? 1.0f : 0.0f});
}

// Radii of the ball about `p` that nothing lit is nearer than, and that all of it is within.
void reach(const Bounds3f& lit, const Vec3f& p, float& nearest, float& farthest) {
    float near2 = 0, far2 = 0;
    for (int c = 0; c < 3; c++) {
        const float outside = std::max({lit.lo[c] - p[c], p[c] - lit.hi[c], 0.0f});
        const float across = std::max(std::abs(lit.lo[c] - p[c]), std::abs(lit.hi[c] - p[c]));
        near2 += outside * outside, far2 += across * across;
    }
    farthest = std::max(std::sqrt(far2), 1e-6f);
    nearest = std::clamp(std::sqrt(near2), farthest / float(1 << (MostLayers - 1)), farthest);
}

// Takes the colour and the scale of the whole out of the table into the amount: white texels stay exact, and
// a table of ones goes.
void settle(scene::Light& light, scene::LightTable& table, float unit) {
    Rgb sum(0);
    for (size_t i = 0; i < table.rgb.size(); i++)
        sum[int(i % 3)] += table.rgb[i];
    const float strongest = std::max({sum.x, sum.y, sum.z});
    if (!(strongest > 0)) {
        light.amount = Rgb(0);
        table.rgb.clear();
        return;
    }
    Rgb color = sum * (1 / strongest);
    for (int k = 0; k < 3; k++)
        color[k] = std::max(color[k], 1e-4f);
    float scale = 0, lowest = 1;
    for (size_t i = 0; i < table.rgb.size(); i++)
        scale = std::max(scale, table.rgb[i] / color[int(i % 3)]);
    for (size_t i = 0; i < table.rgb.size(); i++) {
        table.rgb[i] /= color[int(i % 3)] * scale;
        lowest = std::min(lowest, table.rgb[i]);
    }
    light.amount = color * (scale * unit);
    if (lowest > 0.9999f)
        table.rgb.clear();
}

// Columns, rows or layers that are all alike become one.
template <class Same>
bool alike(int count, Same&& same) {
    for (int k = 1; k < count; k++)
        if (!same(k))
            return false;
    return true;
}

bool near(const float* a, const float* b, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (std::abs(a[i] - b[i]) > 1e-4f * std::max(std::abs(a[i]), std::abs(b[i])) + 1e-7f)
            return false;
    return true;
}

void shrink(scene::LightTable& t) {
    const size_t layer = size_t(t.width) * size_t(t.height) * 3;
    if (alike(t.layers, [&](int k) { return near(t.at(0, 0, 0), t.at(k, 0, 0), layer); })) {
        t.layers = 1;
        t.rgb.resize(layer);
    }
    if (alike(t.width, [&](int k) {
            for (int l = 0; l < t.layers; l++)
                for (int j = 0; j < t.height; j++)
                    if (!near(t.at(l, j, 0), t.at(l, j, k), 3))
                        return false;
            return true;
        })) {
        std::vector<float> thin;
        for (int l = 0; l < t.layers; l++)
            for (int j = 0; j < t.height; j++)
                thin.insert(thin.end(), t.at(l, j, 0), t.at(l, j, 0) + 3);
        t.rgb = std::move(thin);
        t.width = 1;
    }
}

// Which power of the distance light falls off with: what two points on each of some rays say, rounded.
int find_falloff(const Samples& near, const Samples& twice) {
    double a = 0, b = 0;
    for (size_t i = 0; i < near.rgb.size(); i++)
        a += double(near.rgb[i]), b += double(twice.rgb[i]);
    if (a <= 0 || b <= 0)
        return 2;
    return std::clamp(int(std::lround(std::log2(a / b))), 0, 4);
}

// Does the place that a light shines from follow what it shines on? Parallel: light as a distant light's,
// from its own side of every point (BMRT's windowlight, projectors by planes, uberlight's parallel rays).
enum class Place { Fixed, Parallel, Moves };
Place place_of(const sl::Instance& shader, sl::Services& services, const sl::GridGlobals& globals,
               const Vec3f& center, float radius, const Vec3f& from, Vec3f& direction) {
    // Behind a window the way from it may be the way to it: the cone's axis knows better.
    if (!(length(direction) > 0))
        direction = length(center - from) > 0 ? normalize(center - from) : Vec3f(0, 0, 1);
    bool moves = false, parallel = true;
    for (const Vec3f& step :
         {Vec3f(0.31f, 0.07f, 0.11f), Vec3f(-0.13f, 0.29f, 0.05f), Vec3f(0.03f, -0.17f, 0.37f)}) {
        const Vec3f there = center + step * radius;
        const Vec3f other = run(shader, services, globals, 2, 2, [&](int i, int j) {
                                return there + Vec3f(float(i), float(j), 0) * (0.01f * radius);
                            }).emission.from;
        moves |= length(other - from) > 1e-3f * radius;
        parallel &= length(cross(there - other, direction)) < 1e-3f * radius;
    }
    return !moves ? Place::Fixed : parallel ? Place::Parallel : Place::Moves;
}

// A light shader, and what it lights.
struct Probe {
    const sl::Instance& shader;
    sl::Services& services;
    sl::GridGlobals globals;
    Bounds3f lit;
    Vec3f center;
    float radius;

    Probe(const sl::Instance& of, sl::Services& asked, const Bounds3f& seen)
        : shader(of), services(asked), lit(seen.empty() ? Bounds3f{{-1, -1, -1}, {1, 1, 1}} : seen),
          center(lit.center()), radius(std::max(0.5f * length(lit.diagonal()), 1e-6f)) {}
    // Four points in the middle.
    Samples middle() const {
        return run(shader, services, globals, 2, 2,
                   [&](int i, int j) { return center + Vec3f(float(i), float(j), 0) * (0.01f * radius); });
    }
};

// Light of one direction: what arrives on a plane across it.
void tabulate_plane(const Probe& at, const sl::Emission& form, Place place, const Vec3f& sun,
                    scene::Light& light, scene::LightTable& table) {
    light.kind = scene::Light::Kind::Distant;
    light.world_from_light = aimed(at.center - sun * at.radius, at.center);
    if (form.form == sl::Emission::Solar)
        light.angle = std::clamp(2 * form.angle * 180 * InvPi, 0.0f, 180.0f);
    const Vec3f x = column(light.world_from_light, 0), y = column(light.world_from_light, 1);
    table.extent = at.radius;
    table.width = table.height = PlaneSize;
    const auto coordinate = [&](int i) { return (2 * (float(i) + 0.5f) / PlaneSize - 1) * at.radius; };
    const auto plane = [&](const Vec3f& middle) {
        return run(at.shader, at.services, at.globals, PlaneSize, PlaneSize,
                   [&](int i, int j) { return middle + x * coordinate(i) + y * coordinate(j); })
            .rgb;
    };
    table.rgb = plane(at.center);
    if (place == Place::Parallel) { // what is not lit yet in the middle may be farther on
        const std::vector<float> farther = plane(at.center + sun * at.radius);
        for (size_t i = 0; i < farther.size(); i++)
            table.rgb[i] = std::max(table.rgb[i], farther[i]);
    }
}

// Light of one place, by direction about the axis; Ps lies on spheres about the light.
void tabulate_directions(const Probe& at, const sl::Emission& form, const Vec3f& axis,
                         const scene::ShaderRef& ref, scene::Light& light, scene::LightTable& table) {
    using Kind = scene::Light::Kind;
    const bool sky = form.form == sl::Emission::Sky;
    light.kind = sky ? Kind::Environment : Kind::Point;
    const Vec3f from = sky ? ref.world_from_shader.point({0, 0, 0}) : form.from;
    const Vec3f z = length(axis) > 0 ? axis : ref.world_from_shader.vector({0, 0, 1});
    light.world_from_light = aimed(from, from + (length(z) > 0 ? normalize(z) : Vec3f(0, 0, 1)));
    const bool cone = length(axis) > 0 && form.angle < Pi && form.angle > 0;
    table.angle = cone ? form.angle : Pi;
    table.width = Columns * (sky ? 2 : 1);
    table.height = Rows * (sky ? 2 : 1);
    const auto sphere = [&](float distance) {
        return run(at.shader, at.services, at.globals, table.width, table.height, [&](int i, int j) {
            const Vec3f d = latlong_direction((float(i) + 0.5f) / float(table.width),
                                              table.angle * InvPi * (float(j) + 0.5f) / float(table.height));
            // A sky is looked at from inside: its light comes from d.
            return from + light.world_from_light.vector(d) * (sky ? -distance : distance);
        });
    };
    if (sky) {
        table.rgb = sphere(at.radius).rgb;
        return;
    }
    float farthest;
    reach(at.lit, from, table.nearest, farthest);
    Samples a = sphere(farthest * 0.5f), b = sphere(farthest);
    table.falloff = find_falloff(a, b);
    table.layers = std::clamp(int(std::ceil(std::log2(farthest / table.nearest))) + 1, 2, MostLayers);
    for (int k = 0; k < table.layers; k++) {
        const float distance = table.nearest * float(1 << k);
        std::vector<float> rgb = sphere(distance).rgb;
        const float unit = std::pow(distance, float(table.falloff));
        for (float& v : rgb)
            v *= unit;
        table.rgb.insert(table.rgb.end(), rgb.begin(), rgb.end());
    }
    shrink(table);
}

} // namespace

scene::Light shade_light(const sl::Instance& shader, const scene::ShaderRef& ref, const Bounds3f& lit,
                         sl::Services& services) {
    using Kind = scene::Light::Kind;
    scene::Light light;
    light.name = ref.handle;
    light.where = ref.where;
    light.visible_camera = false; // light shaders are asked by surfaces alone
    const Probe probe(shader, services, lit);
    const Samples first = probe.middle();
    const sl::Emission& form = first.emission;
    if (form.form == sl::Emission::Ambient) {
        light.kind = Kind::Ambient;
        light.amount = Rgb(first.rgb[0], first.rgb[1], first.rgb[2]);
        if (!near(first.rgb.data(), first.rgb.data() + 9, 3))
            services.report(
                Severity::Warning, ref.where,
                "light \"" + ref.name +
                    "\" has no illuminate or solar statement and differs from place to place; its light in "
                    "the middle of the scene is taken for all of it");
        return light;
    }
    auto table = std::make_shared<scene::LightTable>();
    const Vec3f axis = length(form.axis) > 0 ? normalize(form.axis) : Vec3f(0, 0, 0);
    Vec3f sun = axis;
    Place place = Place::Fixed;
    if (form.form == sl::Emission::Illuminate) {
        place = place_of(shader, services, probe.globals, probe.center, probe.radius, form.from, sun);
        if (place == Place::Moves)
            services.report(Severity::Warning, ref.where,
                            "light \"" + ref.name +
                                "\" shines from a place that differs from point to point, and not in one "
                                "direction; the place for the middle of the scene is taken for all of it");
    }
    if (form.form == sl::Emission::Solar || place == Place::Parallel)
        tabulate_plane(probe, form, place, sun, light, *table);
    else
        tabulate_directions(probe, form, axis, ref, light, *table);
    settle(light, *table, light.kind == Kind::Environment ? 1.0f : IrradianceOfCl);
    const bool plain =
        table->rgb.empty() && (light.kind != Kind::Point || (table->falloff == 2 && table->angle >= Pi));
    if (table->rgb.empty())
        table->width = table->height = table->layers = 1, table->rgb = {1, 1, 1};
    if (!plain)
        light.table = std::move(table);
    return light;
}

} // namespace kanuka::shade
