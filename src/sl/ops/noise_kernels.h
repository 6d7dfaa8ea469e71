// Gradient noise after Perlin (SIGGRAPH 2002): the quintic fade, gradients picked by a hash. The hash is
// arithmetic (32-bit multiply and xorshift, after Wang's and Jarzynski and Olano's studies, JCGT 9(3), 2020)
// in place of the permutation table, so that lanes need no gathers and the period is 2^32. Included once per
// instruction set.
#pragma once

#include <cmath>
#include <cstring>

#include "sl/ops/noise.h"

namespace kanuka::sl::ops::KANUKA_NOISE_ISA {

template <int W>
struct Vectors {
    typedef float F __attribute__((vector_size(W * 4)));
    typedef int32_t I __attribute__((vector_size(W * 4)));
    typedef uint32_t U __attribute__((vector_size(W * 4)));
};

template <int W>
struct Kernel {
    using F = typename Vectors<W>::F;
    using I = typename Vectors<W>::I;
    using U = typename Vectors<W>::U;

    static F load(const float* p) {
        F f;
        std::memcpy(&f, p, sizeof f);
        return f;
    }
    static void store(float* p, F f) { std::memcpy(p, &f, sizeof f); }
    static F broadcast(float x) { return F{} + x; }
    static F bits(I m) {
        F f;
        std::memcpy(&f, &m, sizeof f);
        return f;
    }
    static U to_bits(F f) {
        U u;
        std::memcpy(&u, &f, sizeof u);
        return u;
    }

    // floor(x) as an integer, for |x| < 2^31; beyond that the fraction is zero and the hash is of whatever
    // remains.
    static I floor_int(F x, F& fraction) {
        I i = __builtin_convertvector(x, I);
        F back = __builtin_convertvector(i, F);
        i = I(U(i) + U(back > x)); // a comparison is -1 where true; the least number wraps
        fraction = x - __builtin_convertvector(i, F);
        // NaN and huge values: no fraction, so results stay in range.
        const I good = (fraction >= 0.0f) & (fraction <= 1.0f);
        fraction = bits(I(to_bits(fraction)) & good);
        return i;
    }

    // The high bits of the result are the good ones.
    static U mix(U h) {
        h ^= h >> 15;
        h *= 0x2c1b3c6du; // constants: C. Wellons' search of two-round hashes with low bias
        h ^= h >> 12;
        h *= 0x297a2d39u;
        return h;
    }
    static constexpr uint32_t Prime[4] = {0x8da6b343u, 0xd8163841u, 0xcb1ab31fu, 0x165667b1u};

    static F fade(F t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); }
    static F lerp(F t, F a, F b) { return a + t * (b - a); }
    // Bit k of h, counted from the top, as the sign of a lane: what a blend looks at.
    static I bit(U h, int k) { return I(h << k); }
    static F choose(I sign, F a, F b) { return sign < 0 ? a : b; }
    // x with its sign flipped where bit k from the top is set.
    static F signed_by(U h, int k, F x) {
        const U u = to_bits(x) ^ ((h << k) & 0x80000000u);
        F f;
        std::memcpy(&f, &u, sizeof f);
        return f;
    }

    // Dot product of the corner's gradient, picked by the top five bits of h, and the offset to it.
    template <int D>
    static F gradient(U h, const F* d) {
        if constexpr (D == 1) {
            // slopes +-1/4 to +-2
            const F g = __builtin_convertvector(I((h >> 28) & 7u), F) * 0.25f + 0.25f;
            return signed_by(h, 0, g * d[0]);
        } else if constexpr (D == 2) {
            const F a = choose(bit(h, 2), d[1], d[0]), b = choose(bit(h, 2), d[0], d[1]);
            return signed_by(h, 0, a) + signed_by(h, 1, b * 0.5f);
        } else if constexpr (D == 3) {
            // the twelve edges of a cube, four of them twice
            const I b0 = bit(h, 0), b2 = bit(h, 2), b3 = bit(h, 3);
            const F a = choose(b3, d[1], d[0]);
            const F b = choose(b3 | b2, choose(b3 & b2 & ~b0, d[0], d[2]), d[1]);
            return signed_by(h, 0, a) + signed_by(h, 1, b);
        } else {
            // the 32 edges of a hypercube: three of four offsets
            const I b3 = bit(h, 3), b4 = bit(h, 4);
            const F a = choose(b3 & b4, d[1], d[0]);
            const F b = choose(b4, d[2], d[1]);
            const F c = choose(b3 | b4, d[3], d[2]);
            return signed_by(h, 0, a) + signed_by(h, 1, b) + signed_by(h, 2, c);
        }
    }

    // Largest absolute value of the sum above over the cell, so that the result lies within [-1, 1].
    template <int D>
    static constexpr float scale() {
        return D == 1 ? 1.0f : D == 2 ? 1.25f : D == 3 ? 0.98f : 0.84f;
    }

    template <int D>
    static F interpolate(const F* corner, const F* t) {
        F a[1 << D];
        for (int c = 0; c < (1 << D); c++)
            a[c] = corner[c];
        for (int d = 0; d < D; d++)
            for (int c = 0; c < (1 << (D - d - 1)); c++)
                a[c] = lerp(t[d], a[2 * c], a[2 * c + 1]);
        return a[0];
    }

    template <int D, int C, bool Periodic, bool Signed>
    static void gradient_noise(const float* in, float* out) {
        F fraction[D], t[D];
        U low[D], high[D]; // hashed lattice coordinates
        for (int d = 0; d < D; d++) {
            I i = floor_int(load(in + d * W), fraction[d]);
            I j = I(U(i) + 1u); // the largest number wraps
            if constexpr (Periodic) {
                F f = load(in + (D + d) * W);
                I period = __builtin_convertvector(f + 0.5f, I);
                period = period < 1 ? I{} + 1 : period;
                i %= period;
                i += (i < 0) & period;
                j = i + 1;
                j &= ~(j == period);
            }
            t[d] = fade(fraction[d]);
            low[d] = U(i) * Prime[d];
            high[d] = U(j) * Prime[d];
        }
        // Hashes of the corners: sums of the axes' hashes, shared between neighbours.
        U corner_hash[1 << D];
        corner_hash[0] = low[0] + uint32_t(D) * 0x9e3779b9u;
        corner_hash[1] = high[0] + uint32_t(D) * 0x9e3779b9u;
        for (int k = 1; k < D; k++)
            for (int c = 0; c < (1 << k); c++) {
                corner_hash[c + (1 << k)] = corner_hash[c] + high[k];
                corner_hash[c] += low[k];
            }
        F corner[C][1 << D];
        for (int c = 0; c < (1 << D); c++) {
            F d[D];
            for (int k = 0; k < D; k++)
                d[k] = (c >> k) & 1 ? fraction[k] - 1.0f : fraction[k];
            const U h = mix(corner_hash[c]);
            // three results read disjoint bits of one hash
            for (int r = 0; r < C; r++)
                corner[r][c] = gradient<D>(h << (5 * r), d);
        }
        for (int r = 0; r < C; r++) {
            const F n = interpolate<D>(corner[r], t) * scale<D>();
            store(out + r * W, Signed ? n : n * 0.5f + 0.5f);
        }
    }

    template <int D, int C>
    static void cell_noise(const float* in, float* out) {
        U h = U{} + 0x5bd1e995u + uint32_t(D);
        for (int d = 0; d < D; d++) {
            F fraction;
            h ^= U(floor_int(load(in + d * W), fraction)) * Prime[d];
            h = mix(h);
        }
        for (int r = 0; r < C; r++) {
            const U k = mix(h + uint32_t(r) * 0x9e3779b9u);
            store(out + r * W, __builtin_convertvector(I(k >> 8), F) * (1.0f / 16777216.0f));
        }
    }

    // A single point goes through the same code in the first of W lanes: the same bits, and faster than code
    // for one.
    template <NoiseFunction Wide, int Inputs, int C>
    static void single(const float* in, float* out) {
        float wide_in[Inputs * W], wide_out[C * W];
        for (int c = 0; c < Inputs; c++)
            store(wide_in + c * W, broadcast(in[c]));
        Wide(wide_in, wide_out);
        for (int c = 0; c < C; c++)
            out[c] = wide_out[c * W];
    }

    template <int D, int C>
    static NoiseFunction select(NoiseKind kind, bool one) {
        constexpr NoiseFunction Noise = gradient_noise<D, C, false, false>,
                                Signed = gradient_noise<D, C, false, true>,
                                Periodic = gradient_noise<D, C, true, false>, Cell = cell_noise<D, C>;
        switch (kind) {
        case NoiseKind::Noise:
            return one ? single<Noise, D, C> : Noise;
        case NoiseKind::SignedNoise:
            return one ? single<Signed, D, C> : Signed;
        case NoiseKind::PeriodicNoise:
            return one ? single<Periodic, 2 * D, C> : Periodic;
        case NoiseKind::CellNoise:
            return one ? single<Cell, D, C> : Cell;
        }
        return nullptr;
    }

    // one: a kernel for a single point rather than W.
    static NoiseFunction find(const NoiseKernel& k, bool one) {
        switch (k.dimensions * 4 + k.results) {
        case 5:
            return select<1, 1>(k.kind, one);
        case 7:
            return select<1, 3>(k.kind, one);
        case 9:
            return select<2, 1>(k.kind, one);
        case 11:
            return select<2, 3>(k.kind, one);
        case 13:
            return select<3, 1>(k.kind, one);
        case 15:
            return select<3, 3>(k.kind, one);
        case 17:
            return select<4, 1>(k.kind, one);
        default:
            return select<4, 3>(k.kind, one);
        }
    }
};

} // namespace kanuka::sl::ops::KANUKA_NOISE_ISA
