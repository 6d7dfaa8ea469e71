// Edge collapses in the order of quadric errors (Garland and Heckbert 1997, Surface Simplification Using
// Quadric Error Metrics), with colours as Hoppe 1999 has them. We differ in what is refused: a collapse must
// keep the surface a manifold (Dey, Edelsbrunner, Guha and Nekhayev 1999, Topology Preserving Edge
// Contraction), must turn no face over, and each point of the mesh must stay near, which a quadric, a mean,
// does not say.
#include "geom/decimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geom/decimate_mesh.h"
#include "geom/quadric_error.h"

namespace kanuka::geom {

namespace {

// Colours are compared by their square roots.
Vec3d even(const Vec3f& c) {
    return {std::sqrt(std::max(0.0, double(c.x))), std::sqrt(std::max(0.0, double(c.y))),
            std::sqrt(std::max(0.0, double(c.z)))};
}
Vec3f linear(const Vec3d& c) {
    return {float(c.x * c.x), float(c.y * c.y), float(c.z * c.z)};
}

class Decimator {
    static constexpr double Infinity = std::numeric_limits<double>::infinity();

  public:
    Decimator(const ColoredMesh& mesh, const DecimationLimits& limits) : m_limits(limits), m_mesh(mesh) {
        const bool bounded = std::isfinite(limits.error);
        m_colors = bounded            ? 10.0 * double(limits.error)
                   : limits.color > 0 ? double(limits.color)
                                      : 0.02 * m_mesh.diagonal();
        m_most = bounded ? double(limits.error) : Infinity;
        m_even.reserve(mesh.colors.size());
        for (const Vec3f& c : mesh.colors) {
            m_even.push_back(even(c) * m_colors);
            const double channels[3] = {m_even.back().x, m_even.back().y, m_even.back().z};
            for (size_t k = 0; k < 3; k++) {
                m_least[k] = std::min(m_least[k], channels[k]);
                m_largest[k] = std::max(m_largest[k], channels[k]);
            }
        }
        m_quadrics.resize(mesh.points.size());
        m_version.resize(mesh.points.size());
        for (uint32_t f = 0; f < m_mesh.faces(); f++)
            add_face(f);
        for (uint32_t v = 0; v < mesh.points.size(); v++)
            for (const uint32_t other : m_mesh.neighbours(v))
                if (v < other && may_go(v, other))
                    m_queue.push_back(candidate(v, other));
    }

    std::vector<Decimation::Step> run() {
        std::vector<Decimation::Step> steps;
        std::make_heap(m_queue.begin(), m_queue.end());
        size_t looked_at = 0;
        while (!m_queue.empty()) {
            std::pop_heap(m_queue.begin(), m_queue.end());
            const Candidate c = m_queue.back();
            m_queue.pop_back();
            if (++looked_at % 1024 == 0 && m_limits.cancelled())
                break;
            if (is_new(c))
                collapse(c, steps);
        }
        return steps;
    }

  private:
    struct Candidate {
        float cost;
        uint32_t a, b, version; // the sum of both
        // The cheapest is at the top; of equal ones that of the lowest vertices.
        bool operator<(const Candidate& o) const {
            return cost != o.cost ? cost > o.cost : a != o.a ? a > o.a : b > o.b;
        }
    };
    bool is_new(const Candidate& c) const { return c.version == m_version[c.a] + m_version[c.b]; }
    // Small heaps are fast ones: what is out of date goes now and then.
    void push(const Candidate& c) {
        if (m_queue.size() == m_queue.capacity()) {
            std::erase_if(m_queue, [&](const Candidate& each) { return !is_new(each); });
            std::make_heap(m_queue.begin(), m_queue.end());
            std::vector<Candidate> smaller;
            smaller.reserve(m_queue.size() + m_queue.size() / 4 + 1024);
            smaller.assign(m_queue.begin(), m_queue.end());
            m_queue = std::move(smaller);
        }
        m_queue.push_back(c);
        std::push_heap(m_queue.begin(), m_queue.end());
    }

    void add_face(uint32_t f) {
        const auto& corners = m_mesh.face(f);
        const Vec3d p[3] = {m_mesh.point(corners[0]), m_mesh.point(corners[1]), m_mesh.point(corners[2])};
        const Vec3d e1 = p[1] - p[0], e2 = p[2] - p[0], normal = cross(e1, e2);
        const double twice = std::sqrt(dot(normal, normal)), longest = std::max({dot(e1, e1), dot(e2, e2)});
        if (!(twice > 0))
            return;
        const Vec3d n = normal * (1 / twice);
        QuadricError q;
        q.add_area(0.5 * twice);
        q.add_plane(n, -dot(n, p[0]), 0.5 * twice);
        // The gradients of a sliver say nothing.
        const bool slender = twice < 1e-3 * longest;
        const Vec3d g1 = cross(e2, n) * (1 / twice), g2 = cross(n, e1) * (1 / twice);
        const Vec3d c0 = m_even[corners[0]], c1 = m_even[corners[1]] - c0, c2 = m_even[corners[2]] - c0;
        const double base[3] = {c0.x, c0.y, c0.z}, first[3] = {c1.x, c1.y, c1.z},
                     second[3] = {c2.x, c2.y, c2.z};
        for (size_t k = 0; k < 3; k++) {
            const Vec3d g = slender ? Vec3d() : g1 * first[k] + g2 * second[k];
            q.add_channel(k, g, base[k] - dot(g, p[0]), 0.5 * twice);
        }
        for (const uint32_t v : corners)
            m_quadrics[v] += q;
        for (size_t k = 0; k < 3; k++)
            hold_border(corners[k], corners[(k + 1) % 3], n);
    }
    // A plane across the border's edge, upright on its face.
    void hold_border(uint32_t a, uint32_t b, const Vec3d& n) {
        if (m_mesh.faces_at(a, b) != 1)
            return;
        const Vec3d edge = m_mesh.point(b) - m_mesh.point(a), across = cross(edge, n);
        const double length2 = dot(edge, edge);
        if (!(length2 > 0))
            return;
        QuadricError q;
        const Vec3d unit = across * (1 / std::sqrt(length2));
        q.add_plane(unit, -dot(unit, m_mesh.point(a)), length2);
        m_quadrics[a] += q, m_quadrics[b] += q;
    }

    bool may_go(uint32_t a, uint32_t b) const { return !m_mesh.locked(a) && !m_mesh.locked(b); }
    Candidate candidate(uint32_t a, uint32_t b) const { // a < b
        const Place place = best_place(a, b);
        const Vec3d edge = m_mesh.point(b) - m_mesh.point(a);
        // On what is flat the short edges go first.
        const double slight = 1e-7 * (m_quadrics[a].area() + m_quadrics[b].area()) * dot(edge, edge);
        return {float(place.error + slight), a, b, m_version[a] + m_version[b]};
    }

    struct Place {
        Vec3d point;
        double error;
        std::array<double, 3> colors;
        double area;
    };
    Place best_place(uint32_t a, uint32_t b) const {
        QuadricError q = m_quadrics[a];
        q += m_quadrics[b];
        const Vec3d pa = m_mesh.point(a), pb = m_mesh.point(b), middle = (pa + pb) * 0.5, edge = pb - pa;
        Vec3d p = middle;
        const bool a_border = m_mesh.on_border(a), b_border = m_mesh.on_border(b);
        if (a_border != b_border) {
            p = a_border ? pa : pb;
        } else {
            Vec3d best;
            if (q.best(middle, best) && dot(best - middle, best - middle) <= 4 * dot(edge, edge))
                p = best;
            for (const Vec3d& other : {pa, pb})
                if (q.at(other) < q.at(p))
                    p = other;
        }
        return {p, q.at(p), q.colors(p), q.area()};
    }

    void collapse(const Candidate& c, std::vector<Decimation::Step>& steps) {
        if (!m_mesh.may_join(c.a, c.b))
            return;
        const Place place = best_place(c.a, c.b);
        if (place.error > m_most * m_most * place.area || m_mesh.turns_over(c.a, c.b, place.point))
            return;
        double distance2 = 0;
        if (!m_mesh.points_stay_near(c.a, c.b, place.point, m_most, distance2))
            return;
        const uint32_t gone = m_mesh.join(c.a, c.b, place.point);
        m_quadrics[c.a] += m_quadrics[c.b];
        m_version[c.a]++, m_version[c.b]++;
        m_cost = std::max(m_cost, place.error);
        m_error = std::max(m_error, std::sqrt(distance2));
        const double back = m_colors > 0 ? 1 / m_colors : 0;
        std::array<double, 3> color; // of least squares, which may lead beyond
        for (size_t k = 0; k < 3; k++)
            color[k] = std::clamp(place.colors[k], m_least[k], m_largest[k]) * back;
        steps.push_back({c.b, c.a, gone, float(m_cost), float(m_error), m_mesh.outside(place.point),
                         linear({color[0], color[1], color[2]})});
        for (const uint32_t other : m_mesh.neighbours(c.a))
            if (may_go(c.a, other))
                push(candidate(std::min(c.a, other), std::max(c.a, other)));
    }

    const DecimationLimits& m_limits;
    DecimatedMesh m_mesh;
    double m_colors = 0, m_most = 0, m_cost = 0, m_error = 0;
    std::vector<Vec3d> m_even;
    std::array<double, 3> m_least{Infinity, Infinity, Infinity}, m_largest{0, 0, 0}; // of all colours
    std::vector<QuadricError> m_quadrics;
    std::vector<uint32_t> m_version;
    std::vector<Candidate> m_queue; // a heap
};

} // namespace

Decimation::Decimation(const ColoredMesh& mesh, const DecimationLimits& limits)
    : m_steps(Decimator(mesh, limits).run()) {}

ColoredMesh Decimation::after(const ColoredMesh& mesh, size_t steps) const {
    ColoredMesh left = mesh;
    std::vector<uint32_t> now(mesh.points.size());
    for (uint32_t v = 0; v < now.size(); v++)
        now[v] = v;
    steps = std::min(steps, m_steps.size());
    for (size_t i = 0; i < steps; i++) {
        const Step& s = m_steps[i];
        now[s.removed] = s.kept;
        left.points[s.kept] = s.point, left.colors[s.kept] = s.color;
    }
    const auto vertex = [&](uint32_t v) {
        while (now[v] != v)
            v = now[v] = now[now[v]];
        return v;
    };
    constexpr uint32_t None = ~0u;
    std::vector<uint32_t> number(now.size(), None);
    std::vector<uint32_t> triangles;
    for (size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
        const std::array<uint32_t, 3> v{vertex(mesh.triangles[t]), vertex(mesh.triangles[t + 1]),
                                        vertex(mesh.triangles[t + 2])};
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
            continue;
        for (const uint32_t each : v)
            number[each] = 0, triangles.push_back(each);
    }
    uint32_t count = 0;
    for (uint32_t v = 0; v < number.size(); v++)
        if (number[v] != None) {
            left.points[count] = left.points[v], left.colors[count] = left.colors[v];
            number[v] = count++;
        }
    left.points.resize(count), left.colors.resize(count);
    for (uint32_t& v : triangles)
        v = number[v];
    left.triangles = std::move(triangles);
    return left;
}

std::vector<size_t> share_faces(std::span<const DecimationShare> all, uint64_t faces) {
    struct Cut {
        double cost;
        uint64_t faces;
    };
    std::vector<Cut> cuts;
    uint64_t total = 0;
    const auto cost_of = [](const DecimationShare& s, const Decimation::Step& step) {
        return double(step.cost) * double(s.weight) * double(s.copies);
    };
    for (const DecimationShare& s : all) {
        total += s.faces * s.copies;
        for (const Decimation::Step& step : s.decimation->steps())
            cuts.push_back({cost_of(s, step), step.faces * s.copies});
    }
    std::ranges::sort(cuts, {}, &Cut::cost);
    size_t last = 0;
    for (; last < cuts.size() && total > faces; last++)
        total -= std::min(cuts[last].faces, total);
    const double most = last > 0 ? cuts[last - 1].cost : -1;
    std::vector<size_t> steps;
    for (const DecimationShare& s : all) {
        const auto& of = s.decimation->steps();
        const auto end = std::ranges::upper_bound(
            of, most, {}, [&](const Decimation::Step& step) { return cost_of(s, step); });
        steps.push_back(size_t(end - of.begin()));
    }
    return steps;
}

} // namespace kanuka::geom
