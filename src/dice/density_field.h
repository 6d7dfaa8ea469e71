// How much finer, or coarser, a primitive is wanted than the camera asks for it, place by place.
#pragma once

#include <algorithm>
#include <array>

#include "base/vec.h"

namespace kanuka::dice {

struct DensityField {
    static constexpr int Cells = 8, Vertices = Cells + 1; // a side, over the primitive's box in object space
    Vec3f lower{0, 0, 0}, per_unit{0, 0, 0};              // from there on, cells a unit
    std::array<float, size_t(Vertices) * Vertices * Vertices> factor{}; // of edges; x runs fastest

    // Between vertices trilinear; outside of the box as at its border.
    float at(const Vec3f& p) const {
        size_t first = 0, step = 1;
        float f[3];
        size_t steps[3];
        for (int a = 0; a < 3; a++) {
            const float place = (p[a] - lower[a]) * per_unit[a];
            const float x = place > 0 ? std::min(place, float(Cells)) : 0.0f; // no number: anywhere
            const int i = std::min(int(x), Cells - 1);
            f[a] = x - float(i);
            first += size_t(i) * step;
            steps[a] = step;
            step *= Vertices;
        }
        float sum = 0;
        for (int corner = 0; corner < 8; corner++) {
            size_t at = first;
            float weight = 1;
            for (int a = 0; a < 3; a++) {
                const bool upper = corner >> a & 1;
                at += upper ? steps[a] : 0;
                weight *= upper ? f[a] : 1 - f[a];
            }
            sum += weight * factor[at];
        }
        return sum;
    }
};

} // namespace kanuka::dice
