#include "geom/decimate_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kanuka::geom {

namespace {

// Ericson 2005, Real-Time Collision Detection, section 5.1.5.
double distance2_to(const Vec3d& p, const std::array<Vec3d, 3>& t) {
    const Vec3d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
    const auto to = [&](const Vec3d& q) { return dot(p - q, p - q); };
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0)
        return to(t[0]);
    const Vec3d bp = p - t[1];
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3)
        return to(t[1]);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0)
        return to(t[0] + ab * (d1 / (d1 - d3)));
    const Vec3d cp = p - t[2];
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6)
        return to(t[2]);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0)
        return to(t[0] + ac * (d2 / (d2 - d6)));
    const double va = d3 * d6 - d5 * d4, along = d4 - d3, other = d5 - d6;
    if (va <= 0 && along >= 0 && other >= 0 && along + other > 0)
        return to(t[1] + (t[2] - t[1]) * (along / (along + other)));
    const double sum = va + vb + vc;
    if (!(sum > 0))
        return std::min({to(t[0]), to(t[1]), to(t[2])});
    return to(t[0] + ab * (vb / sum) + ac * (vc / sum));
}

// Of a triangle: twice its area over the square of its longest side.
double shape_of(const std::array<Vec3d, 3>& t, const Vec3d& normal) {
    const Vec3d a = t[1] - t[0], b = t[2] - t[1], c = t[0] - t[2];
    const double longest = std::max({dot(a, a), dot(b, b), dot(c, c)});
    return longest > 0 ? std::sqrt(dot(normal, normal)) / longest : 0;
}

} // namespace

DecimatedMesh::DecimatedMesh(const ColoredMesh& mesh) {
    Bounds3f box;
    for (const Vec3f& p : mesh.points)
        box.extend(p);
    if (!mesh.points.empty()) {
        const Vec3f c = box.center();
        m_origin = {double(c.x), double(c.y), double(c.z)};
        m_diagonal = double(length(box.diagonal()));
    }
    for (const Vec3f& p : mesh.points) {
        m_points.push_back(Vec3d{double(p.x), double(p.y), double(p.z)} - m_origin);
        const Vec3d& q = m_points.back();
        m_before.push_back({float(q.x), float(q.y), float(q.z)});
    }
    m_around.resize(mesh.points.size());
    for (size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
        const std::array<uint32_t, 3> f{mesh.triangles[t], mesh.triangles[t + 1], mesh.triangles[t + 2]};
        if (f[0] == f[1] || f[1] == f[2] || f[2] == f[0])
            continue;
        for (const uint32_t v : f)
            m_around[v].push_back(uint32_t(m_faces.size()));
        m_faces.push_back(f);
    }
    m_border.resize(m_points.size());
    m_locked.resize(m_points.size());
    m_on_face.assign(m_faces.size(), None);
    m_next.assign(m_points.size(), None);
    for (uint32_t v = 0; v < m_points.size(); v++) {
        if (m_around[v].empty())
            continue;
        m_next[v] = m_on_face[m_around[v][0]];
        m_on_face[m_around[v][0]] = v;
        const std::vector<uint32_t> beside = neighbours(v);
        // Faces around are a closed fan, or one with two ends. Anything else is no manifold.
        int ends = 0;
        for (const uint32_t other : beside) {
            const int n = faces_at(v, other);
            ends += n == 1;
            m_locked[v] |= n > 2;
        }
        m_border[v] = ends > 0;
        m_locked[v] |= (ends != 0 && ends != 2) || beside.size() != m_around[v].size() + size_t(ends) / 2;
    }
}

std::vector<uint32_t> DecimatedMesh::neighbours(uint32_t v) const {
    std::vector<uint32_t> all;
    all.reserve(2 * m_around[v].size());
    for (const uint32_t f : m_around[v])
        for (const uint32_t other : m_faces[f])
            if (other != v)
                all.push_back(other);
    std::ranges::sort(all);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

int DecimatedMesh::faces_at(uint32_t a, uint32_t b) const {
    int n = 0;
    for (const uint32_t f : m_around[a])
        n += has(f, b);
    return n;
}

bool DecimatedMesh::may_join(uint32_t a, uint32_t b) const {
    const int shared = faces_at(a, b);
    if (shared < 1 || shared > 2 || (shared == 2 && on_border(a) && on_border(b)))
        return false;
    const std::vector<uint32_t> of_a = neighbours(a), of_b = neighbours(b);
    int common = 0;
    size_t around = 0; // of both, without themselves
    for (size_t i = 0, j = 0; i < of_a.size() || j < of_b.size();) {
        const uint32_t va = i < of_a.size() ? of_a[i] : None, vb = j < of_b.size() ? of_b[j] : None;
        const uint32_t v = std::min(va, vb);
        i += va == v, j += vb == v;
        common += va == vb;
        around += v != a && v != b;
    }
    // What is left of a tetrahedron, or of two triangles of a border, would be a face and its back, or
    // nothing.
    return common == shared && around > size_t(shared);
}

std::array<Vec3d, 3> DecimatedMesh::moved(uint32_t f, uint32_t a, uint32_t b, const Vec3d& p) const {
    std::array<Vec3d, 3> t;
    for (size_t k = 0; k < 3; k++)
        t[k] = m_faces[f][k] == a || m_faces[f][k] == b ? p : m_points[m_faces[f][k]];
    return t;
}

bool DecimatedMesh::turns_over(uint32_t a, uint32_t b, const Vec3d& p) const {
    for (const uint32_t v : {a, b})
        for (const uint32_t f : m_around[v]) {
            if (has(f, v == a ? b : a))
                continue;
            const std::array<Vec3d, 3> before = {m_points[m_faces[f][0]], m_points[m_faces[f][1]],
                                                 m_points[m_faces[f][2]]},
                                       after = moved(f, a, b, p);
            const Vec3d n0 = cross(before[1] - before[0], before[2] - before[0]),
                        n1 = cross(after[1] - after[0], after[2] - after[0]);
            const double shape0 = shape_of(before, n0), shape1 = shape_of(after, n1);
            // What is a line already may stay one.
            constexpr double Line = 1e-6, Slender = 0.02;
            if (shape1 < std::min(Slender, 0.5 * shape0) || (shape0 > Line && shape1 <= Line))
                return true;
            if (shape0 > Line && dot(n0, n1) < 0.2 * std::sqrt(dot(n0, n0) * dot(n1, n1)))
                return true;
        }
    return false;
}

bool DecimatedMesh::points_stay_near(uint32_t a, uint32_t b, const Vec3d& p, double most, double& distance2) {
    m_stay.clear(), m_moved.clear();
    for (const uint32_t v : {a, b})
        for (const uint32_t f : m_around[v])
            if (!has(f, v == a ? b : a))
                m_stay.push_back(f);
    std::vector<std::array<Vec3d, 3>> after;
    for (const uint32_t f : m_stay)
        after.push_back(moved(f, a, b, p));
    distance2 = 0;
    const auto look = [&](uint32_t f) {
        for (uint32_t i = m_on_face[f]; i != None; i = m_next[i]) {
            const Vec3d q{double(m_before[i].x), double(m_before[i].y), double(m_before[i].z)};
            double nearest = std::numeric_limits<double>::infinity();
            uint32_t on = None;
            for (size_t k = 0; k < after.size(); k++)
                if (const double d = distance2_to(q, after[k]); d < nearest)
                    nearest = d, on = m_stay[k];
            if (!(nearest <= most * most))
                return false;
            distance2 = std::max(distance2, nearest);
            m_moved.push_back({i, on});
        }
        return true;
    };
    for (const uint32_t f : m_around[a])
        if (!look(f))
            return false;
    for (const uint32_t f : m_around[b])
        if (!has(f, a) && !look(f))
            return false;
    return true;
}

uint32_t DecimatedMesh::join(uint32_t a, uint32_t b, const Vec3d& p) {
    std::vector<uint32_t> gone;
    for (const uint32_t f : m_around[a])
        if (has(f, b))
            gone.push_back(f);
    for (const uint32_t f : gone)
        for (const uint32_t v : m_faces[f])
            if (v != b)
                std::erase(m_around[v], f);
    for (const uint32_t f : m_around[b])
        if (std::ranges::find(gone, f) == gone.end()) {
            m_around[a].push_back(f);
            std::ranges::replace(m_faces[f], b, a);
        }
    std::ranges::sort(m_around[a]);
    m_around[b] = {};
    m_points[a] = p;
    m_border[a] |= m_border[b];
    for (const uint32_t f : m_stay)
        m_on_face[f] = None;
    for (const Moved& m : m_moved) {
        m_next[m.point] = m_on_face[m.face];
        m_on_face[m.face] = m.point;
    }
    return uint32_t(gone.size());
}

} // namespace kanuka::geom
