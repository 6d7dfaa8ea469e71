// Regular faces of a few points, as meshes finer than the rate have them: the cost of a face is that of
// finding its control points and a few dozen multiplications.
#include <algorithm>

#include "geom/subdivision_kinds.h"

namespace kanuka::geom {
namespace {

// Lattices of a few points, three components at a time. (The compiler makes of these what intrinsics would.)
using Float4 = float __attribute__((vector_size(16)));
constexpr int FewPoints = 40, FewAcross = 9;

Float4 bspline_values(float t) {
    const auto row = [](int k) {
        const auto& m = BsplineBasis[k];
        return Float4{m[0], m[1], m[2], m[3]};
    };
    return ((row(0) * t + row(1)) * t + row(2)) * t + row(3);
}

Float4 bspline_slopes(float t) {
    const auto row = [](int k, float by) {
        const auto& m = BsplineBasis[k];
        return Float4{by * m[0], by * m[1], by * m[2], by * m[3]};
    };
    return (row(0, 3) * t + row(1, 2)) * t + row(2, 1);
}

Float4 load3(const float* p) {
    return Float4{p[0], p[1], p[2], 0};
}

void fill_few(const float* values, const int* points, Line u, Line v, const PatchTarget* t, int pitch) {
    Float4 p[16], bu[FewAcross], su[FewAcross];
    const Float4 origin = load3(values + size_t(points[5]) * 3);
    for (int k = 0; k < 16; k++)
        p[k] = load3(values + size_t(points[k]) * 3) - origin;
    const bool slopes = t[0].du != nullptr;
    for (int i = 0; i < u.count; i++) {
        bu[i] = bspline_values(u[i]);
        if (slopes)
            su[i] = bspline_slopes(u[i]);
    }
    const auto blend = [](const Float4* q, int step, const Float4& w) {
        return (q[0] * w[0] + q[step] * w[1]) + (q[2 * step] * w[2] + q[3 * step] * w[3]);
    };
    const auto store = [&](size_t at, float* PatchTarget::* to, const Float4& x) {
        for (int c = 0; c < 3; c++)
            (t[c].*to)[at] = x[c];
    };
    for (int j = 0; j < v.count; j++) {
        const Float4 bv = bspline_values(v[j]);
        Float4 q[4], s[4];
        for (int i = 0; i < 4; i++)
            q[i] = blend(p + i, 4, bv);
        if (slopes) {
            const Float4 sv = bspline_slopes(v[j]);
            for (int i = 0; i < 4; i++)
                s[i] = blend(p + i, 4, sv);
        }
        for (int i = 0; i < u.count; i++) {
            const size_t at = size_t(j) * pitch + i;
            store(at, &PatchTarget::value, blend(q, 1, bu[i]) + origin);
            if (slopes) {
                store(at, &PatchTarget::du, blend(q, 1, su[i]));
                store(at, &PatchTarget::dv, blend(s, 1, bu[i]));
            }
        }
    }
}

} // namespace

void bspline_side(const float* xyz, const int* points, int side, Line t, float* out, int stride) {
    const bool along_u = side == grid::VMin || side == grid::VMax;
    const int step = along_u ? 1 : 4, across = along_u ? 4 : 1;
    const int first = side == grid::UMax || side == grid::VMax ? across : 0;
    const Float4 origin = load3(xyz + size_t(points[5]) * 3);
    Float4 q[4];
    for (int i = 0; i < 4; i++) {
        const auto p = [&](int j) {
            return load3(xyz + size_t(points[first + i * step + j * across]) * 3) - origin;
        };
        q[i] = (p(0) + p(2)) * (1.0f / 6) + p(1) * (4.0f / 6);
    }
    for (int i = 0; i < t.count; i++) {
        const Float4 w = bspline_values(t[i]);
        const Float4 x = (q[0] * w[0] + q[1] * w[1]) + (q[2] * w[2] + q[3] * w[3]) + origin;
        for (int c = 0; c < 3; c++)
            out[size_t(c) * stride + i] = x[c];
    }
}

void fill_bspline(const float* values, const int* points, Line u, Line v, const PatchTarget* targets,
                  int count, int pitch) {
    const auto wide = [](Line t) { return t.count == 1 || t[t.count - 1] - t[0] >= 0.25f; };
    if (count == 3 && u.count * v.count <= FewPoints && std::max(u.count, v.count) <= FewAcross && wide(u) &&
        wide(v))
        fill_few(values, points, u, v, targets, pitch);
    else
        fill_bspline(ControlValues(values, count, points, 16), u, v, targets, count, pitch);
}

} // namespace kanuka::geom
