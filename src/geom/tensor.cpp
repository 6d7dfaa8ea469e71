#include "geom/tensor.h"

namespace kanuka::geom {

Weights::Weights(int terms, int count) : m_terms(terms), m_count(count), m_pitch((count + 7) / 8 * 8) {
    if (2 * terms * m_pitch > Small) {
        m_large.resize(size_t(2) * terms * m_pitch);
        m_data = m_large.data();
    } else {
        m_data = m_small;
    }
}

void linear_weights(Line t, Weights& w) {
    for (int i = 0; i < t.count; i++) {
        w.value(0)[i] = 1 - t[i];
        w.value(1)[i] = t[i];
        w.slope(0)[i] = -1;
        w.slope(1)[i] = 1;
    }
}

void cubic_weights(Line t, const BasisMatrix& m, Weights& w) {
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < t.count; i++) {
            const float x = t[i];
            w.value(k)[i] = fma(fma(fma(m[0][k], x, m[1][k]), x, m[2][k]), x, m[3][k]);
            w.slope(k)[i] = fma(fma(3 * m[0][k], x, 2 * m[1][k]), x, m[2][k]);
        }
}

// out[i] = sum over k of q[k] * w(k)[i]; K = 0 means `terms`.
template <int K, bool Slope>
static void blend(const float* q, const Weights& w, float* __restrict out) {
    const int n = w.count();
    const auto column = [&](int k) { return Slope ? w.slope(k) : w.value(k); };
    if constexpr (K == 2) {
        const float *w0 = column(0), *w1 = column(1);
        for (int i = 0; i < n; i++)
            out[i] = fma(q[0], w0[i], q[1] * w1[i]);
    } else if constexpr (K == 4) {
        const float *w0 = column(0), *w1 = column(1), *w2 = column(2), *w3 = column(3);
        for (int i = 0; i < n; i++)
            out[i] = fma(q[0], w0[i], fma(q[1], w1[i], fma(q[2], w2[i], q[3] * w3[i])));
    } else {
        for (int i = 0; i < n; i++)
            out[i] = q[0] * column(0)[i];
        for (int k = 1; k < w.terms(); k++) {
            const float* wk = column(k);
            for (int i = 0; i < n; i++)
                out[i] = fma(q[k], wk[i], out[i]);
        }
    }
}

template <int K>
static void rows(const float* control, const Weights& wu, const Weights& wv, float* out, float* du, float* dv,
                 int pitch) {
    const int ku = K ? K : wu.terms(), kv = wv.terms();
    std::array<float, 32> value, slope; // the control points of one row's curve, and their v slopes
    for (int j = 0; j < wv.count(); j++) {
        for (int i = 0; i < ku; i++) {
            float a = 0, b = 0;
            for (int k = 0; k < kv; k++) {
                a = fma(control[k * ku + i], wv.value(k)[j], a);
                b = fma(control[k * ku + i], wv.slope(k)[j], b);
            }
            value[i] = a;
            slope[i] = b;
        }
        if (out)
            blend<K, false>(value.data(), wu, out + size_t(j) * pitch);
        if (du)
            blend<K, true>(value.data(), wu, du + size_t(j) * pitch);
        if (dv)
            blend<K, false>(slope.data(), wu, dv + size_t(j) * pitch);
    }
}

void tensor_slopes(const float* control, const Weights& wu, const Weights& wv, float* out, float* du,
                   float* dv, int pitch) {
    if (wu.terms() == 2)
        rows<2>(control, wu, wv, out, du, dv, pitch);
    else if (wu.terms() == 4)
        rows<4>(control, wu, wv, out, du, dv, pitch);
    else
        rows<0>(control, wu, wv, out, du, dv, pitch);
}

void tensor_values(const float* control, const Weights& wu, const Weights& wv, float* out, int pitch) {
    tensor_slopes(control, wu, wv, out, nullptr, nullptr, pitch);
}

TensorLattice::TensorLattice(Line u, const BasisMatrix* basis_u, Line v, const BasisMatrix* basis_v)
    : m_wu(basis_u ? 4 : 2, u.count), m_wv(basis_v ? 4 : 2, v.count), m_u(restrict_range(u, basis_u, m_wu)),
      m_v(restrict_range(v, basis_v, m_wv)) {}

TensorLattice::Matrix TensorLattice::restrict_range(Line t, const BasisMatrix* basis, Weights& w) {
    const double t0 = t[0], range = double(t[t.count - 1]) - t0, d = range > 0 ? range : 1;
    // Weights in the range's own parameter x = (t - t0) / d; slopes are per unit of t.
    constexpr int Short = 40;
    float local[Short];
    std::vector<float> longer;
    float* x = local;
    if (t.count > Short) {
        longer.resize(t.count);
        x = longer.data();
    }
    for (int i = 0; i < t.count; i++)
        x[i] = float((t[i] - t0) / d);
    if (basis)
        cubic_weights({x, t.count}, BezierBasis, w);
    else
        linear_weights({x, t.count}, w);
    for (int k = 0; k < w.terms(); k++)
        for (int i = 0; i < t.count; i++)
            w.slope(k)[i] *= float(1 / d);
    Matrix m{};
    if (!basis) {
        m[0] = {1 - t0, t0};
        m[1] = {1 - (t0 + d), t0 + d};
        return m;
    }
    // (t0 + d x)^3 … expanded in x, then power to Bezier form.
    const double r[4][4] = {{d * d * d, 0, 0, 0}, // coefficients of x^3
                            {3 * t0 * d * d, d * d, 0, 0},
                            {3 * t0 * t0 * d, 2 * t0 * d, d, 0},
                            {t0 * t0 * t0, t0 * t0, t0, 1}};
    for (int k = 0; k < 4; k++) {
        double c[4] = {};
        for (int p = 0; p < 4; p++)
            for (int q = 0; q < 4; q++)
                c[p] += r[p][q] * double((*basis)[q][k]);
        m[0][k] = c[3];
        m[1][k] = c[3] + c[2] / 3;
        m[2][k] = c[3] + (2 * c[2] + c[1]) / 3;
        m[3][k] = c[3] + c[2] + c[1] + c[0];
    }
    return m;
}

void TensorLattice::slopes(const float* control, float* out, float* du, float* dv, int pitch) const {
    const int ku = m_wu.terms(), kv = m_wv.terms();
    double half[4][4];
    for (int j = 0; j < kv; j++)
        for (int i = 0; i < ku; i++) {
            double sum = 0;
            for (int k = 0; k < ku; k++)
                sum += m_u[i][k] * double(control[j * ku + k]);
            half[j][i] = sum;
        }
    float restricted[16];
    for (int j = 0; j < kv; j++)
        for (int i = 0; i < ku; i++) {
            double sum = 0;
            for (int k = 0; k < kv; k++)
                sum += m_v[j][k] * half[k][i];
            restricted[j * ku + i] = float(sum);
        }
    tensor_slopes(restricted, m_wu, m_wv, out, du, dv, pitch);
}

} // namespace kanuka::geom
