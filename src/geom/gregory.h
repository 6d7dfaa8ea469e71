// The terms of which the map of a patch kind is made: 16 of a bicubic Bezier patch and, of Gregory patches,
// four more, since these have two control points for one inside (Loop et al. 2009).
#pragma once

#include <algorithm>

namespace kanuka::geom {

inline constexpr int Bicubic = 16, Gregory = 20; // terms
inline constexpr int Terms = 24;                 // of a matrix's rows, for whole vectors
inline constexpr int Inner[4][2] = {{1, 1}, {2, 1}, {2, 2}, {1, 2}};

// How much of a Gregory patch's inner control points is the first one of the two (Loop et al. 2009, section
// 3): each goes from one to the other about its corner.
template <class T>
void gregory_weights(T s, T t, T* g) {
    const T a = 1 - s, b = 1 - t;
    const auto over = [](T x, T y) { return x / std::max(x + y, T(1e-30)); };
    g[0] = over(s, t);
    g[1] = over(t, a);
    g[2] = over(a, b);
    g[3] = over(b, s);
}

} // namespace kanuka::geom
