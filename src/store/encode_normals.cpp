// Shading normals and what follows from them: directions along the surface, and whether facets stand for a
// curve.
#include "store/encode_parts.h"

namespace kanuka::store {

namespace {

Vec3f later_normal(const grid::Grid& grid, size_t step, int i) {
    const std::vector<float>& n = grid.later[step].N;
    return {n[size_t(i)], n[size_t(grid.stride + i)], n[size_t(2 * grid.stride + i)]};
}

} // namespace

// Vertices without a usable normal (poles, NaN) take that of the vertex before; the first ones, that of the
// first that has one.
UnitNormals encode_normals(const grid::Grid& grid, Encoded& out) {
    if (out.shape.flags & ShapeRecord::Fibre) { // the fibre has its own
        out.table.push_back(uint32_t(out.inputs.size()));
        out.table.push_back(0);
        out.inputs.resize(out.inputs.size() + 3 * (grid.later.size() + 1), 0);
        return {.each = {Vec3f(0, 0, 1)}};
    }
    const int count = grid.vertices();
    std::vector<Vec3f> normals(size_t(count), Vec3f(0.0f));
    Vec3f last(0.0f);
    bool flat = true, given = false;
    for (int i = 0; i < count; i++) {
        const Vec3f raw = grid.normal(i);
        normals[size_t(i)] = unit_or_zero(raw);
        flat &= raw == grid.normal(0);
        given |= !(raw == Vec3f(0.0f));
        if (last == Vec3f(0.0f))
            last = normals[size_t(i)];
    }
    for (size_t k = 0; k < grid.later.size() && flat; k++)
        for (int i = 0; i < count && flat; i++)
            flat = later_normal(grid, k, i) == later_normal(grid, k, 0);
    const bool usable = !(last == Vec3f(0.0f));
    flat |= !usable;
    out.table.push_back(uint32_t(out.inputs.size()));
    out.table.push_back(flat ? 0 : 1);
    if (usable)
        out.shape.flags |= ShapeRecord::HasNormals;
    else if (given)
        out.bad += uint64_t(count);
    if (flat) {
        if (usable)
            out.shape.flags |= ShapeRecord::FlatNormal;
        for (float f : {last.x, last.y, last.z})
            out.inputs.push_back(std::bit_cast<uint32_t>(f));
        for (size_t k = 0; k < grid.later.size(); k++) {
            const Vec3f n = unit_or_zero(later_normal(grid, k, 0)), kept = n == Vec3f(0.0f) ? last : n;
            for (float f : {kept.x, kept.y, kept.z})
                out.inputs.push_back(std::bit_cast<uint32_t>(f));
        }
        return {.each = {last}};
    }
    for (Vec3f& n : normals) {
        if (n == Vec3f(0.0f))
            out.bad++;
        else
            last = n;
        n = last;
        out.inputs.push_back(to_oct32(n));
    }
    for (size_t k = 0; k < grid.later.size(); k++)
        for (int i = 0; i < count; i++) {
            const Vec3f n = unit_or_zero(later_normal(grid, k, i));
            out.inputs.push_back(to_oct32(n == Vec3f(0.0f) ? normals[size_t(i)] : n));
        }
    return {.each = std::move(normals)};
}

// Where there is none, some direction across the normal.
void encode_tangents(const grid::Grid& grid, const UnitNormals& normals, Encoded& out) {
    const int count = grid.vertices();
    const auto raw = [&](int i) {
        const size_t at = size_t(i), n = size_t(grid.stride);
        return grid.dPdu.size() < 3 * n ? Vec3f(0.0f)
                                        : Vec3f(grid.dPdu[at], grid.dPdu[n + at], grid.dPdu[2 * n + at]);
    };
    const auto tangent = [&](int i) {
        const Vec3f t = unit_or_zero(raw(i)), n = normals.of(i);
        if (!(t == Vec3f(0.0f)))
            return t;
        return unit_or_zero(std::abs(n.x) < 0.9f ? cross(n, Vec3f(1, 0, 0)) : cross(n, Vec3f(0, 1, 0)));
    };
    bool same = true;
    for (int i = 1; i < count; i++)
        same &= raw(i) == raw(0);
    out.table.push_back(uint32_t(out.inputs.size()));
    out.table.push_back(same ? 0 : 1);
    if (same) {
        const Vec3f t = tangent(0);
        for (float f : {t.x, t.y, t.z})
            out.inputs.push_back(std::bit_cast<uint32_t>(f));
        return;
    }
    for (int i = 0; i < count; i++)
        out.inputs.push_back(to_oct32(tangent(i)));
}

bool is_coarse(const ShadedGrid& shaded, const UnitNormals& normals, const Encoded& encoded) {
    constexpr float LeastCosine = 0.9976f; // 4 degrees
    const ShapeRecord& s = encoded.shape;
    if (!(s.flags & ShapeRecord::HasNormals) || normals.same() || s.motion_segments > 0 ||
        (s.flags & (ShapeRecord::Collapsed | ShapeRecord::Fibre)))
        return false;
    // Of traced corners, with their vertices.
    const auto leans = [&](const std::array<int, 3>& traced, const std::array<int, 3>& vertex) {
        const auto at = [&](int v) {
            const float* p = encoded.positions.data() + size_t(v) * 3;
            return Vec3f(p[0], p[1], p[2]);
        };
        const Vec3f n = unit_or_zero(cross(at(traced[1]) - at(traced[0]), at(traced[2]) - at(traced[0])));
        for (const int v : vertex)
            if (!(n == Vec3f(0.0f)) && std::abs(dot(n, normals.of(v))) < LeastCosine)
                return true;
        return false;
    };
    if (shaded.mesh) {
        const int n = shaded.mesh->vertices_per_face;
        for (size_t f = 0; f < encoded.indices.size(); f += size_t(n)) {
            const auto corner = [&](int k) { return int(encoded.indices[f + size_t(k)]); };
            const std::array<int, 3> a{corner(0), corner(1), corner(n - 1)};
            if (leans(a, a))
                return true;
            if (n == 4)
                if (const std::array<int, 3> b{corner(2), corner(3), corner(1)}; leans(b, b))
                    return true;
        }
        return false;
    }
    const grid::TracedGrid& t = *shaded.traced;
    for (int j = 0; j < t.mv; j++)
        for (int i = 0; i < t.mu; i++) {
            const auto traced = [&](int a, int b) { return (j + b) * (t.mu + 1) + i + a; };
            const auto vertex = [&](int a, int b) {
                return (j + b) * t.step_v * (s.nu + 1) + (i + a) * t.step_u;
            };
            if (leans({traced(0, 0), traced(1, 0), traced(0, 1)},
                      {vertex(0, 0), vertex(1, 0), vertex(0, 1)}) ||
                leans({traced(1, 1), traced(0, 1), traced(1, 0)}, {vertex(1, 1), vertex(0, 1), vertex(1, 0)}))
                return true;
        }
    return false;
}

} // namespace kanuka::store
