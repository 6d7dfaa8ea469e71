// Tensor-product evaluation over lattices, row by row: the inner loops run over u and vectorise.
#pragma once

#include <array>
#include <vector>

#include "base/vec.h"

namespace kanuka::geom {

// Rising parameters of a lattice in one direction.
struct Line {
    const float* data;
    int count;
    float operator[](int i) const { return data[i]; }
};

// Values and slopes of K basis functions at each parameter of a line: value(k)[i].
class Weights {
  public:
    Weights(int terms, int count);
    int terms() const { return m_terms; }
    int count() const { return m_count; }
    float* value(int k) { return m_data + k * m_pitch; }
    float* slope(int k) { return m_data + (m_terms + k) * m_pitch; }
    const float* value(int k) const { return m_data + k * m_pitch; }
    const float* slope(int k) const { return m_data + (m_terms + k) * m_pitch; }
    Weights(const Weights&) = delete;

  private:
    static constexpr int Small = 2 * 4 * 40;
    int m_terms, m_count, m_pitch;
    alignas(32) float m_small[Small];
    std::vector<float> m_large;
    float* m_data;
};

using BasisMatrix = std::array<std::array<float, 4>, 4>; // row k = coefficients of t^(3-k)
inline constexpr BasisMatrix BezierBasis{{{-1, 3, -3, 1}, {3, -6, 3, 0}, {-3, 3, 0, 0}, {1, 0, 0, 0}}};

void linear_weights(Line t, Weights& w);                          // 2 terms
void cubic_weights(Line t, const BasisMatrix& basis, Weights& w); // 4 terms

// One component: control[j * wu.terms() + i]. Row j of the lattice begins at out + j * pitch.
void tensor_values(const float* control, const Weights& wu, const Weights& wv, float* out, int pitch);
// Slopes too, per unit of u and v. Any output may be null.
void tensor_slopes(const float* control, const Weights& wu, const Weights& wv, float* out, float* du,
                   float* dv, int pitch);

// Bilinear (null bases) or bicubic patches over a lattice. Control points are first restricted to the
// lattice's range, in double and in Bezier form, so that a small piece of a huge patch is smooth down to its
// own last bits; then the piece is evaluated in float. End points are exact.
class TensorLattice {
  public:
    TensorLattice(Line u, const BasisMatrix* basis_u, Line v, const BasisMatrix* basis_v);
    // control[j * terms + i] with 2 or 4 terms either way.
    void values(const float* control, float* out, int pitch) const {
        slopes(control, out, nullptr, nullptr, pitch);
    }
    void slopes(const float* control, float* out, float* du, float* dv, int pitch) const;

  private:
    using Matrix =
        std::array<std::array<double, 4>, 4>; // row k: how restricted control point k mixes the given ones
    static Matrix restrict_range(Line t, const BasisMatrix* basis, Weights& w);

    Weights m_wu, m_wv;
    Matrix m_u, m_v;
};

} // namespace kanuka::geom
