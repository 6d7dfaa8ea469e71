// Lobes that stand on a normal of their own, as a smooth coat does over bumpy paint.
//
// A lobe's own frame is the material's, turned as little as takes +z to that normal. What it sends below the
// material's horizon is mirrored there, as the tangent facet of microfacet-based normal mapping does with
// what leans beyond the surface (Schüssler, Heitz, Hanika and Dachsbacher 2017; transport/scattering.h):
// nothing is lost, and values and densities agree. A view from below its own horizon counts as one along it.
#pragma once

#include "bsdf/lobe_inputs.h"

namespace kanuka::bsdf {

// To the frame of a normal, and back (Rodrigues).
template <int W>
struct Turn {
    using F = Float<W>;
    using V = Vec3<F>;

    V n; // unit, in the material's frame, n.z > 0
    F k; // 1 / (1 + n.z)

    Turn() = default;
    // `normal` of any length, on either side; zero is the material's own. Not within six degrees of its
    // horizon.
    explicit Turn(const V& normal) {
        const F zero(0.0f), one(1.0f), size2 = dot(normal, normal);
        const Mask<W> is = (size2 > F(1e-20f)) & is_finite(size2);
        n = normal * (copysign(one, normal.z) / sqrt(select(is, size2, one)));
        n.z = max(n.z, F(0.1f));
        n = n * (one / sqrt(dot(n, n)));
        n = kanuka::select(is, n, V(zero, zero, one));
        k = one / (one + n.z);
    }
    V to(const V& w) const { return turned(w, V(n.y, -n.x, F(0.0f))); }
    V from(const V& w) const { return turned(w, V(-n.y, n.x, F(0.0f))); }
    // A view, on the lobe's side of its surface.
    V seen(const V& wo) const {
        V w = to(wo);
        w.z = max(w.z, F(1e-3f));
        return w * (F(1.0f) / sqrt(dot(w, w)));
    }

  private:
    V turned(const V& w, const V& axis) const {
        const V once = cross(axis, w);
        return w + once + cross(axis, once) * k;
    }
};

template <int W>
Vec3<Float<W>> mirrored_at_horizon(const Vec3<Float<W>>& w) {
    return {w.x, w.y, -w.z};
}

} // namespace kanuka::bsdf
