// Elementary functions over lanes, as fixed sequences of rounded operations: the same bits for every lane
// count, machine and library version. Errors are of the float result, and tested.
#pragma once

#include "base/lanes.h"

namespace kanuka {

// 2^x, relative error below 1e-7 on [-126, 127]; smaller x gives 0.
template <int W>
Float<W> exp2(Float<W> x) {
    const Float<W> clamped = clamp(x, Float<W>(-126.0f), Float<W>(127.0f));
    const Float<W> whole = floor(clamped + Float<W>(0.5f));
    const Float<W> f = clamped - whole; // [-1/2, 1/2]
    // Interpolates 2^f at Chebyshev's nodes; the last digits by search, with the rounding of these very
    // steps.
    Float<W> p = fma(Float<W>(1.54531634e-4f), f, Float<W>(1.33908633e-3f));
    p = fma(p, f, Float<W>(9.61808302e-3f));
    p = fma(p, f, Float<W>(5.55035584e-2f));
    p = fma(p, f, Float<W>(2.40226492e-1f));
    p = fma(p, f, Float<W>(6.93147182e-1f));
    p = fma(p, f, Float<W>(1.0f));
    const Float<W> scale = bitcast_float((to_int(whole) + Int<W>(127)) << 23);
    return select(x < Float<W>(-126.0f), Float<W>(0.0f), p * scale);
}

template <int W>
Float<W> exp(Float<W> x) {
    return exp2(x * Float<W>(1.44269504f));
}

// log2(x) for normal x > 0; absolute error below 2e-7, relative below 4e-7. Zero and less give -126.
template <int W>
Float<W> log2(Float<W> x) {
    const Int<W> bits = bitcast_int(max(x, Float<W>(1.17549435e-38f)));
    // x = 2^e m with m in [1 / sqrt 2, sqrt 2): the exponent as of x / (1 / sqrt 2), no rounding in between.
    const Int<W> e = ((bits - Int<W>(0x3f3504f3)) + Int<W>(0x3f800000)) >> 23;
    const Float<W> m = bitcast_float(bits - ((e - Int<W>(127)) << 23));
    const Float<W> t = (m - Float<W>(1.0f)) / (m + Float<W>(1.0f)), t2 = t * t; // log m = 2 artanh t
    Float<W> p = fma(Float<W>(2.88539008f / 9), t2, Float<W>(2.88539008f / 7));
    p = fma(p, t2, Float<W>(2.88539008f / 5));
    p = fma(p, t2, Float<W>(2.88539008f / 3));
    p = fma(p, t2, Float<W>(2.88539008f));
    return fma(p, t, Float<W>(e - Int<W>(127)));
}

// sin and cos of 2 pi x for x in [0, 1): what sampling needs. Absolute error below 3e-7.
template <int W>
void sincos_2pi(Float<W> x, Float<W>& s, Float<W>& c) {
    const Float<W> q = floor(fma(x, Float<W>(4.0f), Float<W>(0.5f)));       // nearest quarter turn
    const Float<W> r = fma(q, Float<W>(-0.25f), x) * Float<W>(6.28318531f); // [-pi/4, pi/4]
    const Float<W> r2 = r * r;
    Float<W> sp = fma(Float<W>(2.7557319e-6f), r2, Float<W>(-1.9841270e-4f)); // Taylor to r^9, r^10
    sp = fma(sp, r2, Float<W>(8.3333333e-3f));
    sp = fma(sp, r2, Float<W>(-1.6666667e-1f));
    sp = fma(sp * r2, r, r);
    Float<W> cp = fma(Float<W>(-2.7557319e-7f), r2, Float<W>(2.4801587e-5f));
    cp = fma(cp, r2, Float<W>(-1.3888889e-3f));
    cp = fma(cp, r2, Float<W>(4.1666667e-2f));
    cp = fma(cp, r2, Float<W>(-0.5f));
    cp = fma(cp, r2, Float<W>(1.0f));
    const Int<W> quadrant = to_int(q) & Int<W>(3);
    const Mask<W> swap = (quadrant & Int<W>(1)) != Int<W>(0);
    const Float<W> s0 = select(swap, cp, sp), c0 = select(swap, sp, cp);
    s = select((quadrant & Int<W>(2)) != Int<W>(0), -s0, s0);
    const Int<W> cos_sign = (quadrant + Int<W>(1)) & Int<W>(2);
    c = select(cos_sign != Int<W>(0), -c0, c0);
}

// atan2(y, x) / (2 pi) in [0, 1): the azimuth as a fraction of a turn. Absolute error below 1e-6.
template <int W>
Float<W> turn_of(Float<W> y, Float<W> x) {
    const Float<W> ax = abs(x), ay = abs(y);
    const Float<W> hi = max(ax, ay), lo = min(ax, ay);
    const Float<W> t = lo / max(hi, Float<W>(1e-37f)), t2 = t * t; // [0, 1]
    // atan(t)/t by Abramowitz and Stegun 4.4.49.
    Float<W> p = fma(Float<W>(0.0028662257f), t2, Float<W>(-0.0161657367f));
    p = fma(p, t2, Float<W>(0.0429096138f));
    p = fma(p, t2, Float<W>(-0.0752896400f));
    p = fma(p, t2, Float<W>(0.1065626393f));
    p = fma(p, t2, Float<W>(-0.1420889944f));
    p = fma(p, t2, Float<W>(0.1999355085f));
    p = fma(p, t2, Float<W>(-0.3333314528f));
    p = fma(p, t2, Float<W>(1.0f));
    Float<W> a = p * t * Float<W>(0.159154943f);
    a = select(ay > ax, Float<W>(0.25f) - a, a);
    a = select(x < Float<W>(0.0f), Float<W>(0.5f) - a, a);
    a = select(y < Float<W>(0.0f), Float<W>(1.0f) - a, a);
    return select(a >= Float<W>(1.0f), Float<W>(0.0f), a);
}

// acos(x) / pi in [0, 1]. Absolute error below 1e-6. acos(x) = 2 atan2(sqrt(1 - x), sqrt(1 + x)).
template <int W>
Float<W> acos_over_pi(Float<W> x) {
    const Float<W> c = clamp(x, Float<W>(-1.0f), Float<W>(1.0f));
    return Float<W>(4.0f) * turn_of(sqrt(Float<W>(1.0f) - c), sqrt(Float<W>(1.0f) + c));
}

template <int W>
void coordinate_frame(const Vec3<Float<W>>& n, Vec3<Float<W>>& t, Vec3<Float<W>>& b) {
    // Duff et al. 2017, Building an Orthonormal Basis, Revisited.
    const Float<W> one(1.0f), sign = copysign(one, n.z);
    const Float<W> a = -one / (sign + n.z), c = n.x * n.y * a;
    t = {fma(sign * n.x * n.x, a, one), sign * c, -sign * n.x};
    b = {c, fma(n.y * n.y, a, sign), -n.y};
}

} // namespace kanuka
