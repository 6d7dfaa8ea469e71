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

void linear_weights(Line t, Weights& w);                             // 2 terms
void cubic_weights(Line t, const BasisMatrix& basis, Weights& w);    // 4 terms
inline constexpr BasisMatrix BezierBasis{{{-1, 3, -3, 1}, {3, -6, 3, 0}, {-3, 3, 0, 0}, {1, 0, 0, 0}}};

// One component: control[j * wu.terms() + i]. Row j of the lattice begins at out + j * pitch.
void tensor_values(const float* control, const Weights& wu, const Weights& wv, float* out, int pitch);
// Slopes too, per unit of u and v. Any output may be null.
void tensor_slopes(const float* control, const Weights& wu, const Weights& wv, float* out, float* du, float* dv,
                   int pitch);

} // namespace kanuka::geom
