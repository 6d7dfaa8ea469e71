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
        i += (back > x); // a comparison is -1 where true
        fraction = x - __builtin_convertvector(i, F);
        // NaN and huge values: no fraction, so results stay in range.
        const I good = (fraction >= 0.0f) & (fraction <= 1.0f);
        fraction = bits(I(to_bits(fraction)) & good);
        return i;
    }

    static U mix(U h) {
        h ^= h >> 16;
        h *= 0x7feb352du; // constants: C. Wellons' search of two-round hashes with low bias
        h ^= h >> 15;
        h *= 0x846ca68bu;
        h ^= h >> 16;
        return h;
    }
    static constexpr uint32_t Prime[4] = {0x8da6b343u, 0xd8163841u, 0xcb1ab31fu, 0x165667b1u};

    static F fade(F t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); }
    static F lerp(F t, F a, F b) { return a + t * (b - a); }
    // x with its sign flipped where the bit `k` of h is set.
    static F signed_by(U h, int k, F x) {
        const U sign = (h << (31 - k)) & 0x80000000u;
        const U u = to_bits(x) ^ sign;
        F f;
        std::memcpy(&f, &u, sizeof f);
        return f;
    }
    static F choose(I m, F a, F b) { return bits((I(to_bits(a)) & m) | (I(to_bits(b)) & ~m)); }

    // Dot product of the corner's gradient and the offset to it.
    template <int D>
    static F gradient(U h, const F* d) {
        if constexpr (D == 1) {
            // slopes ±1/8 … ±1 as in Perlin's one-dimensional noise
            const F g = __builtin_convertvector(I((h >> 1) & 7u), F) * 0.125f + 0.125f;
            return signed_by(h, 0, g * d[0]) * 2.0f;
        } else if constexpr (D == 2) {
            const I swap = I(((h >> 2) & 1u)) == 1;
            const F a = choose(swap, d[1], d[0]), b = choose(swap, d[0], d[1]);
            return signed_by(h, 0, a) + signed_by(h, 1, b * 0.5f);
        } else if constexpr (D == 3) {
            // the twelve edges of a cube, four of them twice
            const U k = h & 15u;
            const F a = choose(I(k) < 8, d[0], d[1]);
            const F b = choose(I(k) < 4, d[1], choose((I(k) == 12) | (I(k) == 14), d[0], d[2]));
            return signed_by(h, 0, a) + signed_by(h, 1, b);
        } else {
            // the 32 edges of a hypercube
            const U k = h & 31u;
            const F a = choose(I(k) < 24, d[0], d[1]);
            const F b = choose(I(k) < 16, d[1], d[2]);
            const F c = choose(I(k) < 8, d[2], d[3]);
            return signed_by(h, 0, a) + signed_by(h, 1, b) + signed_by(h, 2, c);
        }
    }

    // Largest absolute value of the sum above over the cell, so that the result lies within [-1, 1].
    template <int D>
    static constexpr float scale() {
        return D == 1 ? 1.0f : D == 2 ? 1.0f : D == 3 ? 0.98f : 0.84f;
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
            I j = i + 1;
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
        F corner[C][1 << D];
        for (int c = 0; c < (1 << D); c++) {
            U h = U{} + uint32_t(D) * 0x9e3779b9u;
            F d[D];
            for (int k = 0; k < D; k++) {
                const bool up = (c >> k) & 1;
                h ^= up ? high[k] : low[k];
                h = (h << 13) | (h >> 19);
                d[k] = up ? fraction[k] - 1.0f : fraction[k];
            }
            h = mix(h);
            // three results read disjoint bits of one hash
            for (int r = 0; r < C; r++)
                corner[r][c] = gradient<D>(h >> (8 * r + 3), d);
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
            const U k = r ? mix(h + uint32_t(r) * 0x9e3779b9u) : h;
            store(out + r * W, __builtin_convertvector(I(k >> 8), F) * (1.0f / 16777216.0f));
        }
    }

    template <int D>
    static NoiseFunction select(NoiseKind kind, int results) {
        const bool one = results == 1;
        switch (kind) {
        case NoiseKind::Noise:
            return one ? gradient_noise<D, 1, false, false> : gradient_noise<D, 3, false, false>;
        case NoiseKind::SignedNoise:
            return one ? gradient_noise<D, 1, false, true> : gradient_noise<D, 3, false, true>;
        case NoiseKind::PeriodicNoise:
            return one ? gradient_noise<D, 1, true, false> : gradient_noise<D, 3, true, false>;
        case NoiseKind::CellNoise:
            return one ? cell_noise<D, 1> : cell_noise<D, 3>;
        }
        return nullptr;
    }

    static NoiseFunction find(const NoiseKernel& k) {
        switch (k.dimensions) {
        case 1:
            return select<1>(k.kind, k.results);
        case 2:
            return select<2>(k.kind, k.results);
        case 3:
            return select<3>(k.kind, k.results);
        default:
            return select<4>(k.kind, k.results);
        }
    }
};

} // namespace kanuka::sl::ops::KANUKA_NOISE_ISA
