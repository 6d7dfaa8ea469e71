// Rows: records of four to sixteen 32-bit values that lie together in memory, one a lane. Reading them whole
// and turning them over in registers costs a fraction of one gather a field: on Zen 3 sixteen fields take 16
// loads and 32 shuffles where sixteen gathers are some 600 micro-operations. Integers travel as the bits of
// floats.
#pragma once

#include <array>

#include "base/lanes.h"

namespace kanuka {

template <int W, int Fields>
using Row = std::array<Float<W>, Fields>;

namespace detail {

// Four rows of four floats in each half of four registers, turned over: out[k] holds field k of eight rows.
[[gnu::always_inline]] inline void transpose_4x8(__m256 a, __m256 b, __m256 c, __m256 d, __m256 out[4]) {
    const __m256 ab0 = _mm256_unpacklo_ps(a, b), ab1 = _mm256_unpackhi_ps(a, b);
    const __m256 cd0 = _mm256_unpacklo_ps(c, d), cd1 = _mm256_unpackhi_ps(c, d);
    out[0] = _mm256_shuffle_ps(ab0, cd0, 0x44), out[1] = _mm256_shuffle_ps(ab0, cd0, 0xee);
    out[2] = _mm256_shuffle_ps(ab1, cd1, 0x44), out[3] = _mm256_shuffle_ps(ab1, cd1, 0xee);
}

// Registers lie `Step` apart: a Float<16> is two of them. Loops are unrolled, so that rows stay in registers;
// and nothing is copied in pieces narrower than it is read, which processors do not forward.
template <int Fields, int Step>
[[gnu::always_inline]] inline void load_rows_8(const float* base, const int32_t at[8], __m256* out) {
#pragma GCC unroll 4
    for (int f = 0; f < Fields; f += 4) {
        const auto pair = [&](int i) __attribute__((always_inline)) {
            return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(base + at[i] + f)),
                                        _mm_loadu_ps(base + at[i + 4] + f), 1);
        };
        __m256 turned[4];
        transpose_4x8(pair(0), pair(1), pair(2), pair(3), turned);
        out[f * Step] = turned[0], out[(f + 1) * Step] = turned[1];
        out[(f + 2) * Step] = turned[2], out[(f + 3) * Step] = turned[3];
    }
}

template <int Fields, int Step>
[[gnu::always_inline]] inline void store_rows_8(float* const at[8], const __m256* in, uint32_t bits) {
#pragma GCC unroll 4
    for (int f = 0; f < Fields; f += 4) {
        __m256 row[4]; // row[i] holds rows i and i + 4
        transpose_4x8(in[f * Step], in[(f + 1) * Step], in[(f + 2) * Step], in[(f + 3) * Step], row);
#pragma GCC unroll 4
        for (int i = 0; i < 4; i++) {
            if (bits >> i & 1)
                _mm_storeu_ps(at[i] + f, _mm256_castps256_ps128(row[i]));
            if (bits >> (i + 4) & 1)
                _mm_storeu_ps(at[i + 4] + f, _mm256_extractf128_ps(row[i], 1));
        }
    }
}

} // namespace detail

// out[f][lane] = base[at[lane] + f]. All Fields words must be readable.
template <int Fields, int W>
[[gnu::always_inline]] inline Row<W, Fields> load_rows(const float* base, Int<W> at) {
    static_assert(Fields % 4 == 0);
    Row<W, Fields> out;
    if constexpr (W % 8 == 0) {
        alignas(64) int32_t offset[W];
        std::memcpy(offset, &at.v, sizeof offset);
        for (int half = 0; half < W / 8; half++)
            detail::load_rows_8<Fields, W / 8>(base, offset + 8 * half,
                                               reinterpret_cast<__m256*>(out.data()) + half);
    } else {
        for (int i = 0; i < W; i++)
            for (int f = 0; f < Fields; f++) {
                float x;
                std::memcpy(&x, base + at.v[i] + f, 4);
                out[size_t(f)].v[i] = x;
            }
    }
    return out;
}
template <int Fields, int W>
[[gnu::always_inline]] inline Row<W, Fields> load_rows(const void* base, Int<W> at) {
    return load_rows<Fields, W>(static_cast<const float*>(base), at);
}

// base[at[lane] + f] = in[f][lane] for the lanes of m.
template <int W, size_t Fields>
void store_rows(float* base, Int<W> at, const std::array<Float<W>, Fields>& in, Mask<W> m) {
    static_assert(Fields % 4 == 0);
    const uint32_t bits = m.bits();
    if constexpr (W % 8 == 0) {
        for (int half = 0; half < W / 8; half++) {
            float* row[8];
            for (int i = 0; i < 8; i++)
                row[i] = base + at.v[8 * half + i];
            detail::store_rows_8<int(Fields), W / 8>(row, reinterpret_cast<const __m256*>(in.data()) + half,
                                                     bits >> (8 * half) & 0xff);
        }
    } else {
        for (int i = 0; i < W; i++)
            if (bits >> i & 1)
                for (size_t f = 0; f < Fields; f++) {
                    const float x = in[f].v[i];
                    std::memcpy(base + at.v[i] + f, &x, 4);
                }
    }
}

// The lanes of `bits` to consecutive rows from base on; returns how many.
template <int W, size_t Fields>
int compress_rows(float* base, const std::array<Float<W>, Fields>& in, uint32_t bits) {
    static_assert(Fields % 4 == 0);
    if constexpr (W % 8 == 0) {
        int n = 0;
        for (int half = 0; half < W / 8; half++) {
            const uint32_t some = bits >> (8 * half) & 0xff;
            float* at[8];
            for (int i = 0; i < 8; i++) {
                at[i] = base + size_t(n) * Fields;
                n += int(some >> i & 1);
            }
            detail::store_rows_8<int(Fields), W / 8>(at, reinterpret_cast<const __m256*>(in.data()) + half,
                                                     some);
        }
        return n;
    } else {
        int n = 0;
        for (int i = 0; i < W; i++)
            if (bits >> i & 1) {
                for (size_t f = 0; f < Fields; f++) {
                    const float x = in[f].v[i];
                    std::memcpy(base + size_t(n) * Fields + f, &x, 4);
                }
                n++;
            }
        return n;
    }
}

} // namespace kanuka
