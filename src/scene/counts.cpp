#include "scene/counts.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kanuka::scene {

size_t PrimvarCounts::of(Detail detail) const {
    switch (detail) {
    case Detail::Constant:
        return 1;
    case Detail::Uniform:
        return uniform;
    case Detail::Varying:
        return varying;
    case Detail::Vertex:
        return vertex;
    case Detail::FaceVarying:
        return face_varying;
    case Detail::FaceVertex:
        return face_vertex;
    }
    return 1;
}

namespace {

template <class... F>
struct Overloaded : F... {
    using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

size_t sum(const Buffer<int32_t>& v) {
    return size_t(std::accumulate(v.begin(), v.end(), int64_t(0)));
}

// One more than the largest index.
size_t index_bound(const Buffer<int32_t>& v) {
    return v.empty() ? 0 : size_t(*std::max_element(v.begin(), v.end())) + 1;
}

// Patches along one direction of a mesh.
size_t patches(bool cubic, int n, int step, bool periodic) {
    if (!cubic)
        return size_t(periodic ? n : n - 1);
    return size_t(periodic ? n / step : (n - 4) / step + 1);
}

PrimvarCounts mesh_counts(size_t faces, size_t corners, size_t vertices) {
    return {faces, vertices, vertices, corners, corners};
}

PrimvarCounts curve_counts(const Curves& c) {
    PrimvarCounts r;
    r.uniform = c.vertices_per_curve.size();
    r.vertex = sum(c.vertices_per_curve);
    if (!c.cubic) {
        r.varying = r.vertex;
    } else {
        for (const int32_t n : c.vertices_per_curve)
            r.varying += patches(true, n, c.basis->step, c.periodic) + (c.periodic ? 0 : 1);
    }
    r.face_varying = r.varying;
    r.face_vertex = r.vertex;
    return r;
}

using Fault = std::optional<std::string>;

Fault count_fault(const char* name, const Buffer<int32_t>& v, int least) {
    for (size_t i = 0; i < v.size(); i++)
        if (v[i] < least)
            return std::string(name) + "[" + std::to_string(i) + "] is " + std::to_string(v[i]) +
                   "; it must be " + std::to_string(least) + " or more";
    return std::nullopt;
}

Fault size_fault(const char* name, size_t expected, size_t found, const char* because) {
    if (expected == found)
        return std::nullopt;
    return std::string(name) + ": expected " + std::to_string(expected) + " values (" + because +
           "), found " + std::to_string(found);
}

Fault index_fault(const Buffer<int32_t>& indices, size_t positions) {
    for (size_t i = 0; i < indices.size(); i++)
        if (indices[i] < 0 || size_t(indices[i]) >= positions)
            return "vertex index " + std::to_string(indices[i]) + " (at [" + std::to_string(i) +
                   "]) is out of range: P has " + std::to_string(positions) +
                   " values, indices run from 0 to " + std::to_string(int64_t(positions) - 1);
    return std::nullopt;
}

Fault polygon_fault(const PolygonMesh& m, size_t positions) {
    Fault f = count_fault("nloops", m.loops_per_face, 1);
    if (!f)
        f = count_fault("nverts", m.vertices_per_loop, 3);
    if (!f && !m.loops_per_face.empty())
        f = size_fault("nverts", sum(m.loops_per_face), m.vertices_per_loop.size(), "the sum of nloops");
    if (f)
        return f;
    if (!m.vertices.empty()) {
        f = m.vertices_per_loop.empty()
                ? size_fault("verts", m.vertices.size() / 3 * 3, m.vertices.size(), "triangles")
                : size_fault("verts", sum(m.vertices_per_loop), m.vertices.size(), "the sum of nverts");
        return f ? f : index_fault(m.vertices, positions);
    }
    const size_t needed = m.vertices_per_loop.empty() ? positions / 3 * 3 : sum(m.vertices_per_loop);
    return positions < needed ? size_fault("P", needed, positions, "the sum of nverts") : std::nullopt;
}

Fault subdivision_fault(const SubdivisionMesh& m, size_t positions) {
    Fault f = count_fault("nverts", m.vertices_per_face, 3);
    if (!f)
        f = size_fault("verts", sum(m.vertices_per_face), m.vertices.size(), "the sum of nverts");
    return f ? f : index_fault(m.vertices, positions);
}

Fault direction_fault(const char* name, bool cubic, int n, int step, bool periodic) {
    if (!cubic ? n >= 2
               : step >= 1 && n <= 1'000'000'000 &&
                     (periodic ? n >= 3 && n % step == 0 : n >= 4 && (n - 4) % step == 0))
        return {}; // of millions of patches: no words
    const std::string found = std::string(name) + " = " + std::to_string(n);
    if (!cubic)
        return found + "; a bilinear mesh needs 2 or more";
    const std::string steps = " with a basis step of " + std::to_string(step);
    if (step < 1 || n > 1'000'000'000)
        return found + steps + " is out of range";
    if (periodic)
        return found + steps + ": a periodic mesh needs a multiple of the step, 3 or more";
    return found + steps + ": a nonperiodic mesh needs 4 plus a multiple of the step";
}

Fault knot_fault(const char* name, int n, int order, const Buffer<float>& knots, float lo, float hi) {
    if (order < 2 || order > 32 || n < order || n > 1'000'000'000)
        return std::string("n") + name + " = " + std::to_string(n) + " with order " + std::to_string(order) +
               "; the order must be 2 to 32 and n no less than the order";
    if (knots.size() != size_t(n) + size_t(order))
        return size_fault((std::string(name) + "knot").c_str(), size_t(n) + size_t(order), knots.size(),
                          "n + order");
    for (size_t i = 0; i < knots.size(); i++)
        if (!std::isfinite(knots[i]) || (i > 0 && knots[i] < knots[i - 1]))
            return std::string(name) + "knot[" + std::to_string(i) + "] falls; knots must rise or stay equal";
    if (!(lo < hi) || lo < knots[size_t(order) - 1] || hi > knots[size_t(n)])
        return std::string(name) + "min and " + name + "max are " + std::to_string(lo) + " and " +
               std::to_string(hi) + "; they must rise within the knots' range from " +
               std::to_string(knots[size_t(order) - 1]) + " to " + std::to_string(knots[size_t(n)]);
    return std::nullopt;
}

// Also keeps every later product of counts far from overflow.
Fault lattice_fault(int nu, int nv, size_t positions) {
    const size_t needed = size_t(nu) * size_t(nv);
    return needed <= positions ? Fault() : size_fault("P", needed, positions, "nu times nv");
}

Fault curves_fault(const Curves& c) {
    if (c.vertices_per_curve.empty())
        return "there are no curves";
    for (size_t i = 0; i < c.vertices_per_curve.size(); i++) {
        if (!direction_fault("", c.cubic, c.vertices_per_curve[i], c.basis->step, c.periodic))
            continue;
        const std::string name = "nvertices[" + std::to_string(i) + "]";
        return direction_fault(name.c_str(), c.cubic, c.vertices_per_curve[i], c.basis->step, c.periodic);
    }
    return std::nullopt;
}

} // namespace

PrimvarCounts primvar_counts(const Geometry& geometry, size_t positions) {
    return std::visit(
        Overloaded{
            [&](const PolygonMesh& m) {
                const size_t corners = !m.vertices.empty()            ? m.vertices.size()
                                       : !m.vertices_per_loop.empty() ? sum(m.vertices_per_loop)
                                                                      : positions / 3 * 3;
                const size_t faces = !m.loops_per_face.empty()      ? m.loops_per_face.size()
                                     : !m.vertices_per_loop.empty() ? m.vertices_per_loop.size()
                                                                    : corners / 3;
                return mesh_counts(faces, corners, m.vertices.empty() ? corners : index_bound(m.vertices));
            },
            [&](const SubdivisionMesh& m) {
                return mesh_counts(m.vertices_per_face.size(), m.vertices.size(), index_bound(m.vertices));
            },
            [&](const PatchMesh& m) {
                const size_t pu = patches(m.cubic, m.nu, m.u_basis->step, m.u_periodic);
                const size_t pv = patches(m.cubic, m.nv, m.v_basis->step, m.v_periodic);
                PrimvarCounts r;
                r.uniform = pu * pv;
                r.varying = (pu + (m.u_periodic ? 0 : 1)) * (pv + (m.v_periodic ? 0 : 1));
                r.vertex = size_t(m.nu) * size_t(m.nv);
                r.face_varying = r.varying;
                r.face_vertex = r.vertex;
                return r;
            },
            [&](const NuPatch& m) {
                const size_t su = size_t(1 + m.nu - m.u_order), sv = size_t(1 + m.nv - m.v_order);
                PrimvarCounts r;
                r.uniform = su * sv;
                r.varying = (su + 1) * (sv + 1);
                r.vertex = size_t(m.nu) * size_t(m.nv);
                r.face_varying = r.varying;
                r.face_vertex = r.vertex;
                return r;
            },
            [&](const Quadric&) { return PrimvarCounts{1, 4, 4, 4, 4}; },
            [&](const Curves& c) { return curve_counts(c); },
            [&](const Points&) { return PrimvarCounts{1, positions, positions, positions, positions}; },
            [&](const Blobby& b) {
                const size_t n = size_t(std::max(b.leaves, 0));
                return PrimvarCounts{1, n, n, n, n};
            },
            [&](const Volume& v) {
                const size_t n = size_t(v.size[0]) * size_t(v.size[1]) * size_t(v.size[2]);
                return PrimvarCounts{1, n, n, n, n};
            },
        },
        geometry);
}

std::optional<std::string> fault_of(const Geometry& geometry, size_t positions) {
    return std::visit(Overloaded{
                          [&](const PolygonMesh& m) { return polygon_fault(m, positions); },
                          [&](const SubdivisionMesh& m) { return subdivision_fault(m, positions); },
                          [&](const PatchMesh& m) {
                              Fault f = direction_fault("nu", m.cubic, m.nu, m.u_basis->step, m.u_periodic);
                              if (!f)
                                  f = direction_fault("nv", m.cubic, m.nv, m.v_basis->step, m.v_periodic);
                              return f ? f : lattice_fault(m.nu, m.nv, positions);
                          },
                          [&](const NuPatch& m) {
                              Fault f = knot_fault("u", m.nu, m.u_order, m.u_knots, m.u_min, m.u_max);
                              if (!f)
                                  f = knot_fault("v", m.nv, m.v_order, m.v_knots, m.v_min, m.v_max);
                              return f ? f : lattice_fault(m.nu, m.nv, positions);
                          },
                          [&](const Curves& c) { return curves_fault(c); },
                          [&](const auto&) { return Fault(); },
                      },
                      geometry);
}

std::string_view kind_name(const Geometry& geometry) {
    constexpr std::string_view quadrics[] = {"Sphere",     "Cone", "Cylinder", "Hyperboloid",
                                             "Paraboloid", "Disk", "Torus"};
    return std::visit(Overloaded{
                          [](const PolygonMesh&) -> std::string_view { return "PolygonMesh"; },
                          [](const SubdivisionMesh&) -> std::string_view { return "SubdivisionMesh"; },
                          [](const PatchMesh&) -> std::string_view { return "PatchMesh"; },
                          [](const NuPatch&) -> std::string_view { return "NuPatch"; },
                          [&](const Quadric& q) -> std::string_view { return quadrics[size_t(q.kind)]; },
                          [](const Curves&) -> std::string_view { return "Curves"; },
                          [](const Points&) -> std::string_view { return "Points"; },
                          [](const Blobby&) -> std::string_view { return "Blobby"; },
                          [](const Volume&) -> std::string_view { return "Volume"; },
                      },
                      geometry);
}

std::string_view kind_name(Light::Kind kind) {
    constexpr std::string_view names[] = {"distant", "point", "spot",   "environment", "ambient",
                                          "quad",    "disk",  "sphere", "cylinder",    "portal"};
    static_assert(std::size(names) == size_t(Light::Kind::Portal) + 1);
    return names[size_t(kind)];
}

} // namespace kanuka::scene
