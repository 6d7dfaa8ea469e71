// Random shapes under random transforms, seen by random cameras at random rates and tolerances: is what is
// traced what stands there? Coverage, layers, open edges.
#pragma once

#include <algorithm>

#include "dice/test_shape_maker.h"

namespace kanuka::dice::test {

struct ShapeCase {
    Kind kind;
    std::string text;
    // Samples of the picture that differ, over the shape's.
    double error = 0;
    double bias = 0, pixels = 0; // at that step: what is too much less what is missing; the samples in pixels
    // Of a flat shape: samples that more than one layer covers; of its outline's length, what open edges
    // differ by.
    double twice = 0, outline = 0;
    // What a line of this part of the tolerance's width around the outline holds, over the shape: traced
    // vertices stand off by half of what chords may be off.
    static constexpr double OfTolerance = 0.6;
    double tolerance = 0;
    size_t open_edges = 0; // of a closed shape
    size_t triangles = 0;
    bool counted = false;  // it was large enough in the raster
    bool straight = false; // its outline: chords are no excuse for layers
    // Half a per cent, or where its few pixels leave that to the tolerance, that.
    bool wrong() const {
        return counted &&
               (error > (straight ? 0.005 : std::max(0.005, tolerance)) ||
                twice > (straight ? 0.005 : std::max(0.005, tolerance)) || outline > 0.005 || open_edges > 0);
    }
};

// Directed edges without a neighbour: their number, and their length.
inline std::pair<size_t, double> open_edges(const Soup& soup) {
    using Edge = std::array<double, 6>;
    std::vector<std::pair<Edge, int>> edges;
    edges.reserve(3 * soup.size());
    for (const auto& t : soup)
        for (int k = 0; k < 3; k++) {
            const D3 &a = t[size_t(k)], &b = t[size_t(k + 1) % 3];
            Edge there{a.x + 0.0, a.y + 0.0, a.z + 0.0, b.x + 0.0, b.y + 0.0, b.z + 0.0};
            const bool turn = std::lexicographical_compare(there.begin() + 3, there.end(), there.begin(),
                                                           there.begin() + 3);
            if (turn)
                std::swap_ranges(there.begin(), there.begin() + 3, there.begin() + 3);
            edges.push_back({there, turn ? -1 : 1});
        }
    std::sort(edges.begin(), edges.end());
    std::pair<size_t, double> open{0, 0};
    for (size_t i = 0, end; i < edges.size(); i = end) {
        int sum = 0;
        for (end = i; end < edges.size() && edges[end].first == edges[i].first; end++)
            sum += edges[end].second;
        const Edge& e = edges[i].first;
        open.first += size_t(std::abs(sum));
        open.second += std::abs(sum) * length(D3{e[3] - e[0], e[4] - e[1], e[5] - e[2]});
    }
    return open;
}

// As random as they come, or diced so finely for the shape's size, and for its area where it is thin, that
// half a per cent is not the settings' to spoil: what is off then is the dicing's fault.
enum class Rates { Random, Fine };

inline ShapeCase run_shape(uint32_t seed, int only_kind = -1, Rates rates = Rates::Random, double finer = 1) {
    std::mt19937 random(seed * 2654435761u + 12345);
    const auto uniform = [&](double lo, double hi) {
        return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    const auto spread = [&](double lo, double hi) { return lo * std::pow(hi / lo, uniform(0, 1)); };
    const auto chance = [&](double p) { return uniform(0, 1) < p; };
    const auto direction = [&] {
        const double z = uniform(-1, 1), a = uniform(0, Turn), r = std::sqrt(1 - z * z);
        return D3{r * std::cos(a), r * std::sin(a), z};
    };
    ShapeCase out;
    out.kind = Kind(only_kind >= 0 ? uint32_t(only_kind) : seed % uint32_t(Kinds));
    const uint32_t shape_seed = uint32_t(random());
    std::vector<Shape> steps;
    steps.push_back(ShapeMaker(out.kind, shape_seed).shape);
    const bool may_change = out.kind != Kind::Blob && out.kind != Kind::Trimmed;
    for (int k = 1; may_change && chance(k == 1 ? 0.15 : 0.5) && k < 3; k++)
        steps.push_back(ShapeMaker(out.kind, shape_seed, 0.3 * k).shape);
    Shape& first = steps[0];

    // Where it stands.
    const bool rigid = out.kind == Kind::Balls || out.kind == Kind::Ribbon ||
                       out.kind == Kind::Discs; // widths are of no direction
    const D3 axis = direction();
    Transform place = Transform::rotate(uniform(0, 360), axis.x, axis.y, axis.z);
    const double size = spread(0.01, 100);
    if (rigid)
        place = place * Transform::scale(size, size, size);
    else
        place = place * Transform::scale(size * uniform(0.4, 1.6) * (chance(0.2) ? -1 : 1),
                                         size * uniform(0.4, 1.6), size * uniform(0.4, 1.6));
    const D3 to = direction() * (size * uniform(0, 3));
    place = Transform::translate(to.x, to.y, to.z) * place;
    D3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    for (const Shape& s : steps)
        for (const D3& p : s.hull) {
            const D3 q = transformed(place, p);
            low = {std::min(low.x, q.x), std::min(low.y, q.y), std::min(low.z, q.z)};
            high = {std::max(high.x, q.x), std::max(high.y, q.y), std::max(high.z, q.z)};
        }
    const D3 center = (low + high) * 0.5;
    const double radius = length(high - low) / 2;

    // Who looks at it, and how.
    const D3 view = direction();
    const double distance = radius * spread(1.3, 20);
    const D3 eye = center - view * distance;
    const D3 aside = direction() * (chance(0.3) ? uniform(0, 0.6) : 0.0);
    const D3 z = unit(view + aside), x = unit(cross(z, direction())), y = cross(z, x);
    Transform camera;
    const D3 columns[4] = {x, y, z, eye};
    for (size_t c = 0; c < 4; c++) {
        camera.m[0][c] = columns[c].x, camera.m[1][c] = columns[c].y, camera.m[2][c] = columns[c].z;
    }
    DiceOptions options;
    options.camera.page_from_camera = camera;
    const bool uniform_shader = chance(0.6);
    const double pixels = uniform_shader ? spread(6, 2000) : spread(6, 300); // across the whole
    double rate = chance(0.5) ? 1 : spread(0.25, 30);
    const int projection = int(uniform(0, 10));
    const bool orthographic = projection == 0;
    options.camera.projection = projection == 0   ? Projection::Orthographic
                                : projection == 1 ? Projection::Fisheye
                                : projection == 2 ? Projection::Spherical
                                                  : Projection::Perspective;
    options.camera.half_angle = 3;
    if (chance(0.1))
        options.camera.pixel_stretch = float(spread(0.25, 4));
    options.camera.offscreen_falloff = 0; // what is beside the picture is coarser by intention
    options.camera.pixels_per_tangent = float(pixels / (2 * radius) * (orthographic ? 1 : distance));
    options.camera.width = options.camera.height = int(pixels * spread(0.5, 4)) + 1;
    const double tolerances[] = {0, 0.1, 1, 1000};
    double tolerance = chance(0.5) ? 0.25 : tolerances[size_t(uniform(0, 4))];
    if (rates == Rates::Fine) {
        const double Across = 300 * std::sqrt(finer),
                     Line = 2e-4 / finer; // micropolygons; of the shape's size
        rate = std::min(rate, pixels * pixels / (Across * Across));
        const bool points = out.kind == Kind::Balls || out.kind == Kind::Discs; // zero is a quarter to them
        tolerance = std::min(points && tolerance == 0 ? 0.25 : tolerance, pixels * Line);
    }
    options.geometry_tolerance = float(tolerance);
    options.max_grid_cells = 1 << int(uniform(2, 7));
    auto attributes = std::make_shared<scene::Attributes>(*first.primitive.attributes);
    attributes->shading_rate = float(rate);
    for (Shape& s : steps)
        s.primitive.attributes = attributes;
    DiceTarget target;
    target.page_from_object = place;
    target.shade_uniform = uniform_shader;
    target.polygons = out.kind == Kind::Balls; // small ones have none else: bvh/ball_test.cpp has those
    const int instanced = chance(0.15) ? 1 + int(chance(0.5)) : 0;
    if (instanced == 1 && first.closed) // tubes and the like: not what a ribbon is
        target.pixels_per_unit = float(pixels / (2 * radius));
    if (instanced == 2 && out.kind != Kind::Ribbon)
        target.instead_from = {camera};
    Displace displace;
    if (chance(0.15))
        displace = [](grid::Grid&) {};
    std::vector<scene::Primitive> later;
    for (size_t k = 1; k < steps.size(); k++)
        later.push_back(steps[k].primitive);
    target.later = later;
    char text[400];
    std::snprintf(text, sizeof text,
                  "seed %u kind %d %s: %g pixels, rate %g, tolerance %g, %s%s, grids of %d, %zu steps, "
                  "projection %d, stretched %g, instanced %d",
                  seed, int(out.kind), KindNames[int(out.kind)], pixels, rate, tolerance,
                  uniform_shader ? "uniform" : "varying", displace ? ", displaced by nothing" : "",
                  options.max_grid_cells, steps.size(), projection, double(options.camera.pixel_stretch),
                  instanced);
    out.text = text + (first.note.empty() ? "" : "; " + first.note);

    Journal journal;
    const Diced diced = dice::dice(first.primitive, target, options, displace, journal);
    for (const auto& e : journal.entries())
        out.text += "; " + e.message;

    // What there is, against what there should be.
    const View from(camera, orthographic, center, radius);
    double line = 0; // the area of one of the tolerance's width along the outline, as a part of the shape's
    for (size_t step = 0; step < steps.size(); step++) {
        const Shape& s = steps[step];
        const Soup soup = traced_triangles(diced, step);
        out.triangles += soup.size();
        Raster truth;
        if (s.hit) {
            truth = trace(from, s.hit, place);
        } else {
            Soup there;
            for (const auto& t : s.soup)
                there.push_back(
                    {transformed(place, t[0]), transformed(place, t[1]), transformed(place, t[2])});
            truth = rasterize(from, there);
        }
        const Difference d = compare(rasterize(from, soup), truth);
        if (d.area < 1500)
            continue;
        out.counted = true;
        // A sample or two may fall on either side of a line for rounding alone.
        const double wrong = std::max(0.0, d.missing + d.extra - 3);
        const double pixel = (orthographic ? 2 * radius : 2 * radius / distance) / pixels / from.spacing();
        if (wrong / d.area > out.error) {
            out.error = wrong / d.area;
            out.bias = (d.extra - d.missing) / d.area;
            out.pixels = wrong / (pixel * pixel);
        }
        if (s.flat)
            out.twice = std::max(out.twice, std::max(0.0, d.twice - 3) / d.area);
        // Where there are fewer pixels up the picture than across, they are so much taller.
        const double tall = std::max(1.0, 1 / double(options.camera.pixel_stretch));
        line = std::max(line, d.outline * pixel * tall * tolerance / d.area);
        out.tolerance =
            std::max(out.tolerance, d.outline * pixel * tall * ShapeCase::OfTolerance *
                                        (rates == Rates::Fine ? 0 : std::max(tolerance, 0.25)) / d.area);
        if (s.closed)
            out.open_edges = std::max(out.open_edges, open_edges(soup).first);
        if (!s.outline_points.empty()) {
            out.straight = true;
            double there = 0;
            for (size_t l = 0; l + 1 < s.outline_first.size(); l++)
                for (size_t i = s.outline_first[l]; i < s.outline_first[l + 1]; i++) {
                    const auto& a = s.outline_points[i];
                    const auto& b =
                        s.outline_points[i + 1 < s.outline_first[l + 1] ? i + 1 : s.outline_first[l]];
                    there +=
                        length(transformed(place, {a[0], a[1], 0}) - transformed(place, {b[0], b[1], 0}));
                }
            out.outline = std::max(out.outline, std::abs(open_edges(soup).second / there - 1));
        }
    }
    constexpr double Thin = 0.0025; // half of what is allowed
    if (rates == Rates::Fine && finer == 1 && line > Thin)
        return run_shape(seed, only_kind, rates, line / Thin);
    return out;
}

} // namespace kanuka::dice::test
