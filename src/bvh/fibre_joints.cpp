#include "bvh/fibre_joints.h"

#include <algorithm>

namespace kanuka::bvh {

namespace {

struct Vec3d {
    double x, y, z;
};
double dot(const Vec3d& a, const Vec3d& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Vec3d between(const float* from, const Vec3d& to) {
    return {to.x - double(from[0]), to.y - double(from[1]), to.z - double(from[2])};
}

// By more than rounding: the largest of r(s)^2 - |p - c(s)|^2 over its balls.
bool is_inside_segment(const float* vertex, const Vec3d& p, double rounding) {
    const float* const next = vertex + 4;
    const double r = double(vertex[3]), grows = double(next[3]) - r;
    const Vec3d axis = between(vertex, {double(next[0]), double(next[1]), double(next[2])}),
                from = between(vertex, p);
    const double slope = dot(axis, axis) - grows * grows;
    double s = grows > 0 ? 1 : 0; // one ball in the other
    if (slope > 0)
        s = std::clamp((dot(from, axis) + r * grows) / slope, 0.0, 1.0);
    const Vec3d off{from.x - s * axis.x, from.y - s * axis.y, from.z - s * axis.z};
    const double radius = r + s * grows;
    return radius * radius - dot(off, off) > 2 * radius * (1e-4 * radius + rounding);
}

} // namespace

bool is_inside_fibre(const store::Store& store, int shape, int segment, Step step, const Vec3f& o,
                     const Vec3f& d, float t) {
    const store::ShapeRecord& s = store.shapes()[size_t(shape)];
    if (s.flags & store::ShapeRecord::Balls) // nothing joins
        return false;
    const uint32_t* const first = store.words(s) + s.indices;
    const float* const vertices = store.floats(s) + s.positions + ptrdiff_t(step.number) * s.motion_stride;
    const double along = double(t);
    const Vec3d p{double(o.x) + along * double(d.x), double(o.y) + along * double(d.y),
                  double(o.z) + along * double(d.z)};
    const double size = std::max({std::abs(double(o.x)) + std::abs(along * double(d.x)),
                                  std::abs(double(o.y)) + std::abs(along * double(d.y)),
                                  std::abs(double(o.z)) + std::abs(along * double(d.z))});
    const double rounding = 4e-7 * size;
    const uint32_t vertex = first[segment];
    const bool before = segment > 0 && first[segment - 1] + 1 == vertex,
               behind = segment + 1 < s.mv && first[segment + 1] == vertex + 1;
    const auto is_inside = [&](uint32_t first_end) {
        const float* const now = vertices + 4 * size_t(first_end);
        float ends[8]; // by the operations of traversal
        for (int k = 0; k < 8; k++)
            ends[k] =
                s.motion_segments > 0 ? now[k] + (now[k + s.motion_stride] - now[k]) * step.fraction : now[k];
        return is_inside_segment(ends, p, rounding);
    };
    return (before && is_inside(vertex - 1)) || (behind && is_inside(vertex + 1));
}

} // namespace kanuka::bvh
