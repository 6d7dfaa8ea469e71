// Lanes: Float<W>, Int<W>, Mask<W> hold W values and act on all at once. W = 1 (tests, and a GPU thread), 8
// (AVX2) and 16 (AVX-512) are one source. Built on the compiler's vector types, whose operators cover most of
// this file; intrinsics stand in for the few operations that those lack, in the Native<W> blocks below. Every
// operation is correctly rounded or an explicit sequence of such, so all W compute the same bits.
#pragma once

#include <cstdint>
#include <cstring>
#include <immintrin.h>

#include "base/vec.h"

namespace kanuka {

template <int W>
struct NativeLanes {
    typedef float F __attribute__((vector_size(4 * W), aligned(4 * W)));
    typedef int32_t I __attribute__((vector_size(4 * W), aligned(4 * W)));
    typedef uint32_t U __attribute__((vector_size(4 * W), aligned(4 * W)));
};

template <int W>
struct Mask {
    typename NativeLanes<W>::I v; // all bits of a lane set, or none

    Mask() = default;
    Mask(typename NativeLanes<W>::I v) : v(v) {}
    explicit Mask(bool b) : v(typename NativeLanes<W>::I{} - int(b)) {}
    friend Mask operator&(Mask a, Mask b) { return a.v & b.v; }
    friend Mask operator|(Mask a, Mask b) { return a.v | b.v; }
    friend Mask operator^(Mask a, Mask b) { return a.v ^ b.v; }
    Mask operator!() const { return ~v; }
    Mask& operator&=(Mask o) { return v &= o.v, *this; }
    Mask& operator|=(Mask o) { return v |= o.v, *this; }
    bool operator[](int i) const { return v[i] != 0; }
    uint32_t bits() const {
        if constexpr (W == 1)
            return uint32_t(v[0]) & 1;
        else if constexpr (W == 8)
            return uint32_t(_mm256_movemask_ps((__m256)v));
#ifdef __AVX512F__
        else if constexpr (W == 16)
            return _mm512_movepi32_mask((__m512i)v);
#endif
        else {
            uint32_t b = 0;
            for (int i = 0; i < W; i++)
                b |= uint32_t(v[i] & 1) << i;
            return b;
        }
    }
};

template <int W>
bool any(Mask<W> m) {
    return m.bits() != 0;
}
template <int W>
bool all(Mask<W> m) {
    return m.bits() == (W == 32 ? ~0u : (1u << W) - 1);
}
template <int W>
bool none(Mask<W> m) {
    return m.bits() == 0;
}

template <int W>
struct Float;

template <int W>
struct Int {
    using I = typename NativeLanes<W>::I;
    using U = typename NativeLanes<W>::U;
    I v;

    Int() = default;
    Int(I v) : v(v) {}
    Int(int s) : v(I{} + s) {}
    static Int load(const int32_t* p) {
        Int r;
        std::memcpy(&r.v, p, sizeof r.v);
        return r;
    }
    void store(int32_t* p) const { std::memcpy(p, &v, sizeof v); }
    static Int lane_index() {
        Int r;
        for (int i = 0; i < W; i++)
            r.v[i] = i;
        return r;
    }
    int operator[](int i) const { return v[i]; }

    // Wrap, as hashes want it: signed overflow would be undefined, and optimisers make use of that.
    friend Int operator+(Int a, Int b) { return I(U(a.v) + U(b.v)); }
    friend Int operator-(Int a, Int b) { return I(U(a.v) - U(b.v)); }
    friend Int operator*(Int a, Int b) { return I(U(a.v) * U(b.v)); }
    friend Int operator&(Int a, Int b) { return a.v & b.v; }
    friend Int operator|(Int a, Int b) { return a.v | b.v; }
    friend Int operator^(Int a, Int b) { return a.v ^ b.v; }
    friend Int operator<<(Int a, int s) { return I(U(a.v) << s); }
    friend Int operator>>(Int a, int s) { return I(U(a.v) >> s); } // logical: lanes carry bits, not signs
    friend Int operator<<(Int a, Int s) { return I(U(a.v) << U(s.v)); }
    friend Int operator>>(Int a, Int s) { return I(U(a.v) >> U(s.v)); }
    friend Mask<W> operator<(Int a, Int b) { return I(a.v < b.v); }
    friend Mask<W> operator>(Int a, Int b) { return I(a.v > b.v); }
    friend Mask<W> operator<=(Int a, Int b) { return I(a.v <= b.v); }
    friend Mask<W> operator>=(Int a, Int b) { return I(a.v >= b.v); }
    friend Mask<W> operator==(Int a, Int b) { return I(a.v == b.v); }
    friend Mask<W> operator!=(Int a, Int b) { return I(a.v != b.v); }
};

template <int W>
struct Float {
    using F = typename NativeLanes<W>::F;
    using I = typename NativeLanes<W>::I;
    F v;

    Float() = default;
    Float(F v) : v(v) {}
    Float(float s) : v(s - F{}) {} // minus zero: the one sum that keeps the sign of -0
    explicit Float(Int<W> i) : v(__builtin_convertvector(i.v, F)) {}
    static Float load(const float* p) {
        Float r;
        std::memcpy(&r.v, p, sizeof r.v);
        return r;
    }
    void store(float* p) const { std::memcpy(p, &v, sizeof v); }
    float operator[](int i) const { return v[i]; }

    Float operator-() const { return -v; }
    friend Float operator+(Float a, Float b) { return a.v + b.v; }
    friend Float operator-(Float a, Float b) { return a.v - b.v; }
    friend Float operator*(Float a, Float b) { return a.v * b.v; }
    friend Float operator/(Float a, Float b) { return a.v / b.v; }
    Float& operator+=(Float o) { return v += o.v, *this; }
    Float& operator-=(Float o) { return v -= o.v, *this; }
    Float& operator*=(Float o) { return v *= o.v, *this; }
    friend Mask<W> operator<(Float a, Float b) { return I(a.v < b.v); }
    friend Mask<W> operator>(Float a, Float b) { return I(a.v > b.v); }
    friend Mask<W> operator<=(Float a, Float b) { return I(a.v <= b.v); }
    friend Mask<W> operator>=(Float a, Float b) { return I(a.v >= b.v); }
    friend Mask<W> operator==(Float a, Float b) { return I(a.v == b.v); }
    friend Mask<W> operator!=(Float a, Float b) { return I(a.v != b.v); }
};

template <int W>
Float<W> select(Mask<W> m, Float<W> a, Float<W> b) {
    return m.v ? a.v : b.v;
}
template <int W>
Int<W> select(Mask<W> m, Int<W> a, Int<W> b) {
    return m.v ? a.v : b.v;
}
template <int W>
Vec3<Float<W>> select(Mask<W> m, const Vec3<Float<W>>& a, const Vec3<Float<W>>& b) {
    return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

// min and max return b where either is NaN, as SSE does. By name: of a comparison with a constant the
// compiler makes two instructions.
template <int W>
Float<W> min(Float<W> a, Float<W> b) {
    if constexpr (W == 8)
        return (typename Float<W>::F)_mm256_min_ps((__m256)a.v, (__m256)b.v);
#ifdef __AVX512F__
    else if constexpr (W == 16)
        return (typename Float<W>::F)_mm512_min_ps((__m512)a.v, (__m512)b.v);
#endif
    else
        return a.v < b.v ? a.v : b.v;
}
template <int W>
Float<W> max(Float<W> a, Float<W> b) {
    if constexpr (W == 8)
        return (typename Float<W>::F)_mm256_max_ps((__m256)a.v, (__m256)b.v);
#ifdef __AVX512F__
    else if constexpr (W == 16)
        return (typename Float<W>::F)_mm512_max_ps((__m512)a.v, (__m512)b.v);
#endif
    else
        return a.v > b.v ? a.v : b.v;
}
template <int W>
Int<W> min(Int<W> a, Int<W> b) {
    return a.v < b.v ? a.v : b.v;
}
template <int W>
Int<W> max(Int<W> a, Int<W> b) {
    return a.v > b.v ? a.v : b.v;
}

template <int W>
Float<W> fma(Float<W> a, Float<W> b, Float<W> c) {
    if constexpr (W == 8)
        return (typename Float<W>::F)_mm256_fmadd_ps((__m256)a.v, (__m256)b.v, (__m256)c.v);
#ifdef __AVX512F__
    else if constexpr (W == 16)
        return (typename Float<W>::F)_mm512_fmadd_ps((__m512)a.v, (__m512)b.v, (__m512)c.v);
#endif
    else {
        Float<W> r;
        for (int i = 0; i < W; i++)
            r.v[i] = __builtin_fmaf(a.v[i], b.v[i], c.v[i]);
        return r;
    }
}
template <int W>
Float<W> sqrt(Float<W> a) {
    if constexpr (W == 8)
        return (typename Float<W>::F)_mm256_sqrt_ps((__m256)a.v);
#ifdef __AVX512F__
    else if constexpr (W == 16)
        return (typename Float<W>::F)_mm512_sqrt_ps((__m512)a.v);
#endif
    else {
        Float<W> r;
        for (int i = 0; i < W; i++)
            r.v[i] = __builtin_sqrtf(a.v[i]);
        return r;
    }
}
template <int W>
Float<W> floor(Float<W> a) {
    if constexpr (W == 8)
        return (typename Float<W>::F)_mm256_floor_ps((__m256)a.v);
#ifdef __AVX512F__
    else if constexpr (W == 16)
        return (typename Float<W>::F)_mm512_roundscale_ps((__m512)a.v,
                                                          _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
#endif
    else {
        Float<W> r;
        for (int i = 0; i < W; i++)
            r.v[i] = __builtin_floorf(a.v[i]);
        return r;
    }
}
template <int W>
Int<W> to_int(Float<W> a) { // truncates
    return Int<W>(__builtin_convertvector(a.v, typename Int<W>::I));
}
template <int W>
Int<W> bitcast_int(Float<W> a) {
    return (typename Int<W>::I)a.v;
}
template <int W>
Float<W> bitcast_float(Int<W> a) {
    return (typename Float<W>::F)a.v;
}
template <int W>
Float<W> abs(Float<W> a) {
    return bitcast_float(bitcast_int(a) & Int<W>(0x7fffffff));
}
template <int W>
Float<W> copysign(Float<W> magnitude, Float<W> sign) {
    return bitcast_float((bitcast_int(magnitude) & Int<W>(0x7fffffff)) |
                         (bitcast_int(sign) & Int<W>(int(0x80000000))));
}
template <int W>
Float<W> clamp(Float<W> x, Float<W> lo, Float<W> hi) {
    return min(max(x, lo), hi);
}
template <int W>
Mask<W> is_finite(Float<W> a) {
    return abs(a) <= Float<W>(3.402823466e38f);
}

// base[index], lane by lane; every index must be readable. The store keeps floats and integers in one arena,
// so loads may alias anything.
template <int W>
Float<W> gather(const float* base, Int<W> index) {
    if constexpr (W == 8)
        return (typename Float<W>::F)_mm256_i32gather_ps(base, (__m256i)index.v, 4);
#ifdef __AVX512F__
    else if constexpr (W == 16)
        return (typename Float<W>::F)_mm512_i32gather_ps((__m512i)index.v, base, 4);
#endif
    else {
        Float<W> r;
        for (int i = 0; i < W; i++) {
            float f;
            std::memcpy(&f, base + index.v[i], 4);
            r.v[i] = f;
        }
        return r;
    }
}
template <int W>
Int<W> gather(const int32_t* base, Int<W> index) {
    if constexpr (W == 8)
        return (typename Int<W>::I)_mm256_i32gather_epi32(base, (__m256i)index.v, 4);
#ifdef __AVX512F__
    else if constexpr (W == 16)
        return (typename Int<W>::I)_mm512_i32gather_epi32((__m512i)index.v, base, 4);
#endif
    else {
        Int<W> r;
        for (int i = 0; i < W; i++) {
            int32_t n;
            std::memcpy(&n, base + index.v[i], 4);
            r.v[i] = n;
        }
        return r;
    }
}
template <int W>
Int<W> gather(const uint32_t* base, Int<W> index) {
    return gather(reinterpret_cast<const int32_t*>(base), index); // signed and unsigned may alias
}
template <int W>
void scatter(float* base, Int<W> index, Float<W> value, Mask<W> m) {
    for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const float f = value.v[i];
        std::memcpy(base + index.v[i], &f, 4); // integers pass through here as bits
    }
}

// Half-precision values in the low 16 bits of each lane.
template <int W>
Float<W> half_to_float(Int<W> h) {
    // Exponent rebias by a multiply: exact for all finite halves, subnormals included.
    const Int<W> magnitude = (h & Int<W>(0x7fff)) << 13;
    const Int<W> sign = (h & Int<W>(0x8000)) << 16;
    const Float<W> f = bitcast_float(magnitude) * Float<W>(0x1p112f);
    return bitcast_float(bitcast_int(f) | sign);
}

// Where lane i of a packed register comes from, for each set of lanes that is kept.
struct CompressTable {
    uint64_t from[256] = {}; // a byte a lane
    constexpr CompressTable() {
        for (int bits = 0; bits < 256; bits++)
            for (int i = 0, n = 0; i < 8; i++)
                if (bits >> i & 1)
                    from[bits] |= uint64_t(i) << (8 * n++);
    }
};
inline constexpr CompressTable compress_table;

// Moves the lanes of `bits` to consecutive places from `out` on; returns how many. Up to W places are
// written.
template <int W>
int compress_store(float* out, Float<W> value, uint32_t bits) {
    int n = 0;
    if constexpr (W % 8 == 0) {
        for (int half = 0; half < W / 8; half++) {
            const uint32_t some = bits >> (8 * half) & 0xff;
            const __m256i from = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(int64_t(compress_table.from[some])));
            __m256 v;
            std::memcpy(&v, reinterpret_cast<const char*>(&value.v) + 32 * half, 32);
            _mm256_storeu_ps(out + n, _mm256_permutevar8x32_ps(v, from));
            n += __builtin_popcount(some);
        }
    } else {
        for (; bits; bits &= bits - 1) {
            const float f = value.v[__builtin_ctz(bits)];
            std::memcpy(out + n++, &f, 4);
        }
    }
    return n;
}
template <int W>
int compress_store(int32_t* out, Int<W> value, uint32_t bits) {
    return compress_store(reinterpret_cast<float*>(out), bitcast_float(value), bits); // bits pass unchanged
}

} // namespace kanuka
