// Evaluating regular patches and patch kinds over lattices.
#include <optional>

#include "geom/gregory.h"
#include "geom/subdivision_kinds.h"

namespace kanuka::geom {
namespace {

// Local coordinates and weights of lattice lines in a part. Slopes are per unit of the face's own.
struct LocalLine {
    static constexpr int Short = 40;
    LocalLine(Line line, float origin, float size)
        : large(line.count > Short ? line.count : 0), at(large.empty() ? small : large.data()),
          weights(4, line.count) {
        for (int i = 0; i < line.count; i++)
            at[i] = (line[i] - origin) / size;
    }
    // Few lattice points in a small range of it: the control points' rounding would be seen.
    bool wide() const { return weights.count() == 1 || at[weights.count() - 1] - at[0] >= 0.25f; }
    float small[Short];
    std::vector<float> large;
    float* at;
    Weights weights;
};

void scale_slopes(Weights& w, float by) {
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < w.count(); i++)
            w.slope(k)[i] *= by;
}

void add(float* to, int columns, int rows, int pitch, float value) {
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++)
            to[size_t(j) * pitch + i] += value;
}

void scale(float* to, int columns, int rows, int pitch, float by) {
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++)
            to[size_t(j) * pitch + i] *= by;
}

} // namespace

ControlValues::ControlValues(const float* values, int width, const int* points, int count) : m_count(count) {
    if (size_t(count) * width > Small || width > SmallWidth) {
        m_large.resize(size_t(count + 1) * width);
        m_data = m_large.data();
        m_origin = m_data + size_t(count) * width;
    } else {
        m_data = m_small;
        m_origin = m_small_origin;
    }
    const float* first = values + size_t(points[0]) * width;
    for (int c = 0; c < width; c++)
        m_origin[c] = first[c];
    for (int k = 0; k < count; k++) {
        const float* p = values + size_t(points[k]) * width;
        for (int c = 0; c < width; c++)
            m_data[size_t(c) * count + k] = p[c] - m_origin[c];
    }
}

void fill_bspline(const ControlValues& points, Line u, Line v, const PatchTarget* targets, int count,
                  int pitch) {
    LocalLine lu(u, 0, 1), lv(v, 0, 1);
    const auto each = [&](auto&& evaluate) {
        for (int c = 0; c < count; c++) {
            evaluate(points.component(c), targets[c]);
            add(targets[c].value, u.count, v.count, pitch, points.origin(c));
        }
    };
    if (lu.wide() && lv.wide()) {
        cubic_weights({lu.at, u.count}, BsplineBasis, lu.weights);
        cubic_weights({lv.at, v.count}, BsplineBasis, lv.weights);
        each([&](const float* control, const PatchTarget& t) {
            tensor_slopes(control, lu.weights, lv.weights, t.value, t.du, t.dv, pitch);
        });
        return;
    }
    const TensorLattice lattice(u, &BsplineBasis, v, &BsplineBasis);
    each([&](const float* control, const PatchTarget& t) {
        lattice.slopes(control, t.value, t.du, t.dv, pitch);
    });
}

class PatchKind::Evaluation {
  public:
    Evaluation(const PatchKind& kind, const ControlValues& points, Line u, Line v, const PatchTarget* targets,
               int count, int pitch)
        : m_kind(kind), m_points(points), m_u(u), m_v(v), m_targets(targets), m_count(count), m_pitch(pitch) {
    }

    void visit(int part, const Region& r) {
        if (r.i0 >= r.i1 || r.j0 >= r.j1)
            return;
        const int child = m_kind.m_parts[part].first_child;
        if (child < 0) {
            evaluate(m_kind.m_parts[part], r);
            return;
        }
        const float half = r.size / 2, u = r.u0 + half, v = r.v0 + half;
        const int i = int(std::lower_bound(m_u.data + r.i0, m_u.data + r.i1, u) - m_u.data);
        const int j = int(std::lower_bound(m_v.data + r.j0, m_v.data + r.j1, v) - m_v.data);
        visit(child, {r.i0, i, r.j0, j, r.u0, r.v0, half});
        visit(child + 1, {i, r.i1, r.j0, j, u, r.v0, half});
        visit(child + 2, {r.i0, i, j, r.j1, r.u0, v, half});
        visit(child + 3, {i, r.i1, j, r.j1, u, v, half});
    }

  private:
    void terms(const Part& part, int component, float* out) const {
        const float* x = m_points.component(component);
        const float* m = m_kind.m_matrices.data() + part.matrix;
        const int count = part.gregory ? Terms : Bicubic;
        float sum[Terms] = {};
        for (int p = 0; p < m_kind.m_points; p++, m += Terms)
            for (int k = 0; k < count; k++)
                sum[k] = fma(m[k], x[p], sum[k]);
        std::copy_n(sum, Terms, out);
    }

    void evaluate(const Part& part, const Region& r) {
        const int columns = r.i1 - r.i0, rows = r.j1 - r.j0;
        const size_t at = size_t(r.j0) * m_pitch + r.i0;
        LocalLine u({m_u.data + r.i0, columns}, r.u0, r.size), v({m_v.data + r.j0, rows}, r.v0, r.size);
        const bool wide = u.wide() && v.wide(), slopes = m_targets[0].du != nullptr;
        const float per_unit = 1 / r.size;
        std::optional<TensorLattice> narrow;
        if (!wide)
            narrow.emplace(Line{u.at, columns}, &BezierBasis, Line{v.at, rows}, &BezierBasis);
        if (wide || part.gregory) {
            cubic_weights({u.at, columns}, BezierBasis, u.weights);
            cubic_weights({v.at, rows}, BezierBasis, v.weights);
            if (slopes) {
                scale_slopes(u.weights, per_unit);
                scale_slopes(v.weights, per_unit);
            }
        }
        m_terms.resize(size_t(m_count) * Terms);
        for (int c = 0; c < m_count; c++) {
            float* control = &m_terms[size_t(c) * Terms];
            terms(part, c, control);
            const PatchTarget& t = m_targets[c];
            float *value = t.value + at, *du = t.du ? t.du + at : nullptr, *dv = t.dv ? t.dv + at : nullptr;
            if (wide) {
                tensor_slopes(control, u.weights, v.weights, value, du, dv, m_pitch);
            } else {
                narrow->slopes(control, value, du, dv, m_pitch);
                for (float* slope : {du, dv})
                    if (slope)
                        scale(slope, columns, rows, m_pitch, per_unit);
            }
            add(value, columns, rows, m_pitch, m_points.origin(c));
        }
        if (part.gregory)
            add_gregory(u, v, at);
    }

    // What the inner control points are beyond the first of two. Slopes take them for constants, as
    // OpenSubdiv does: on the borders that is exact.
    void add_gregory(const LocalLine& u, const LocalLine& v, size_t at) {
        const int columns = u.weights.count(), rows = v.weights.count();
        m_line.resize(size_t(8) * columns);
        for (int j = 0; j < rows; j++) {
            for (int i = 0; i < columns; i++) {
                float g[4];
                gregory_weights(u.at[i], v.at[j], g);
                for (int k = 0; k < 4; k++) {
                    m_line[size_t(k) * columns + i] = g[k] * u.weights.value(Inner[k][0])[i];
                    m_line[size_t(4 + k) * columns + i] = g[k] * u.weights.slope(Inner[k][0])[i];
                }
            }
            const float *a = m_line.data(), *d = a + size_t(4) * columns;
            const size_t row = at + size_t(j) * m_pitch;
            for (int c = 0; c < m_count; c++) {
                const PatchTarget& t = m_targets[c];
                float w[4], s[4];
                for (int k = 0; k < 4; k++) {
                    const float more = m_terms[size_t(c) * Terms + 16 + k];
                    w[k] = more * v.weights.value(Inner[k][1])[j];
                    s[k] = more * v.weights.slope(Inner[k][1])[j];
                }
                const auto mix = [&](const float* x, const float* by, float* to) {
                    for (int i = 0; i < columns; i++)
                        to[i] += fma(x[i], by[0],
                                     fma(x[columns + i], by[1],
                                         fma(x[2 * columns + i], by[2], x[3 * columns + i] * by[3])));
                };
                mix(a, w, t.value + row);
                if (t.du) {
                    mix(d, w, t.du + row);
                    mix(a, s, t.dv + row);
                }
            }
        }
    }

    const PatchKind& m_kind;
    const ControlValues& m_points;
    Line m_u, m_v;
    const PatchTarget* m_targets;
    int m_count, m_pitch;
    std::vector<float> m_terms, m_line;
};

void PatchKind::fill(const ControlValues& points, Line u, Line v, const PatchTarget* targets, int count,
                     int pitch) const {
    Evaluation(*this, points, u, v, targets, count, pitch).visit(0, {0, u.count, 0, v.count, 0, 0, 1});
}

} // namespace kanuka::geom
