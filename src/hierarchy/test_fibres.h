// Fibres in pages, and where lines are in their segments, in doubles: as a cone between tangent circles and
// two balls.
#pragma once

#include "hierarchy/decode.h"
#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::testing {

struct Fibres {
    std::vector<float> vertices; // xyz, radius
    std::vector<uint32_t> first;

    void add(const std::vector<Vec3f>& points, const std::vector<float>& radii) {
        for (size_t i = 0; i < points.size(); i++) {
            if (i + 1 < points.size())
                first.push_back(uint32_t(vertices.size() / 4));
            vertices.insert(vertices.end(), {points[i].x, points[i].y, points[i].z, radii[i]});
        }
    }
    FibreView view() const { return {vertices.data(), vertices.size() / 4, first.data(), first.size()}; }
};

struct TracedFibres {
    FibreLattice lattice;
    PageMemory memory;
    std::vector<Segment> segments; // on the lattice, by name

    explicit TracedFibres(const Fibres& f) {
        const FibreView view = f.view();
        lattice = fibre_lattice_of({&view, 1});
        memory = build({{}, {}, false, {&view, 1}}, {{}, {}, lattice});
        for (const uint32_t v : f.first) {
            Segment s;
            for (uint32_t e = 0; e < 2; e++) {
                const float* p = f.vertices.data() + 4 * (v + e);
                s.end[e] = lattice.places.snap({p[0], p[1], p[2]});
                s.radius[e] = lattice.radius(lattice.word(p[3]));
            }
            segments.push_back(s);
        }
    }
    Page page() const { return memory.page(); }
};

// Where a line is in a segment: of the quadric of the cone that touches both balls, between its two circles,
// and of the balls.
struct Span {
    double enter = INFINITY, leave = -INFINITY;
    bool empty() const { return !(enter <= leave); }
};
inline Span span_of(const Segment& s, const Ray& ray) {
    Span in;
    const Point d(ray.d), o(ray.o);
    const double dd = dot(d, d);
    const auto add_roots = [&](double a, double b, double c, const auto& counts) { // a t^2 + 2 b t + c = 0
        const double h = b * b - a * c;
        if (h < 0)
            return;
        const double q = -(b + std::copysign(std::sqrt(h), b));
        for (const double t : {q / a, c / q})
            if (std::isfinite(t) && counts(t))
                in.enter = std::min(in.enter, t), in.leave = std::max(in.leave, t);
    };
    for (int e = 0; e < 2; e++) {
        const Point from = o - Point(s.end[e]);
        const double r = double(s.radius[e]);
        add_roots(dd, dot(from, d), dot(from, from) - r * r, [](double) { return true; });
    }
    const Point axis = Point(s.end[1]) - Point(s.end[0]), from = o - Point(s.end[0]);
    const double r = double(s.radius[0]), grows = double(s.radius[1]) - r, mm = dot(axis, axis);
    const double slope =
        mm - grows * grows; // of the cone: points q with q^2 slope = (q . axis + r grows)^2 ...
    if (slope <= 0)
        return in;
    // |q|^2 - r^2 - (q . axis + r grows)^2 / slope = 0: the largest over s of r(s)^2 - |q - s axis|^2 is
    // zero.
    const double md = dot(axis, d), mf = dot(axis, from) + r * grows;
    add_roots(dd - md * md / slope, dot(from, d) - md * mf / slope, dot(from, from) - r * r - mf * mf / slope,
              [&](double t) {
                  const double along = (mf + t * md) / slope;
                  return along >= 0 && along <= 1;
              });
    return in;
}

// Hairs of all lengths and widths, straight, bent, pointed; some of one point, some with one end in the
// other.
inline Fibres tangle(unsigned seed, int count, float size = 1, const Vec3f& at = Vec3f(0.0f)) {
    Random random(seed);
    Fibres f;
    for (int i = 0; i < count; i++) {
        Vec3f p = at + random.in_box(size), d = random.direction();
        std::vector<Vec3f> points;
        std::vector<float> radii;
        const float length = size * random.uniform(0.02f, 0.3f),
                    radius = size * random.uniform(0.001f, 0.02f);
        const int n = 2 + int(random.below(5));
        for (int k = 0; k < n; k++) {
            points.push_back(p);
            radii.push_back(i % 5 == 0 && k == n - 1 ? 0 : radius * random.uniform(0.6f, 1.4f));
            p += d * (i % 17 == 0 ? 0.0f : i % 11 == 0 ? 0.3f * radius : length);
            d = normalize(d + random.in_box(0.7f));
        }
        f.add(points, radii);
    }
    return f;
}

inline std::vector<Ray> rays_at(const TracedFibres& t, unsigned seed, int count, float size = 1,
                                const Vec3f& at = Vec3f(0.0f)) {
    Random random(seed);
    std::vector<Ray> rays;
    for (int i = 0; i < count; i++) {
        const Segment& s = t.segments[random.below(uint32_t(t.segments.size()))];
        const Vec3f target = i % 3 == 0   ? at + random.in_box(size)
                             : i % 3 == 1 ? s.end[random.below(2)]
                                          : s.end[0] + (s.end[1] - s.end[0]) * random.uniform();
        Ray r;
        r.o = at + random.in_box(2 * size);
        r.d = target + random.in_box(2 * s.radius[0]) - r.o;
        if (i % 16 == 7) // along a segment
            r.d = s.end[1] - s.end[0],
            r.o = s.end[0] - r.d * random.uniform(0.5f, 2) + random.in_box(s.radius[0]);
        if (i % 16 == 8) { // from inside of one
            r.o = s.end[0] + (s.end[1] - s.end[0]) * random.uniform() + random.in_box(0.4f * s.radius[0]);
            r.d = random.direction() * size;
        }
        rays.push_back(r);
    }
    return rays;
}

} // namespace kanuka::hierarchy::testing
