// Sample points: a net of two or three dimensions for each decision of a path, Owen-scrambled, and shuffled
// on its own (Burley 2020, Practical Hash-based Owen Scrambling). A sample is a pure function of (pixel,
// progression, net, seed). docs/transport.md, "Points".
#pragma once

#include "base/lanes.h"

namespace kanuka {

// Nets that a path consumes. Those of a bounce repeat: net = FirstBounce + bounce * PerBounce + offset.
enum class Net : int {
    Filter = 0, // position in the pixel
    Wavelength, // where the four lie; which of them is the hero
    Lens,
    FirstBounce,
    Scatter = 0, // offsets: direction on the hemisphere; which lobe
    Roulette,    // one number
    Light,       // place on the light; which light or, where there is one choice, which of its parts
    LightMore,   // one number: the other of the two
    PerBounce,
    LevelTime = (1 << 20) - 1, // which levels of detail a path meets; shutter time; likewise apart
    FirstMedium = 1 << 20,     // free paths in media, one each: apart, so that other scenes keep their points
};

inline constexpr int bounce_net(int bounce, Net offset) {
    return int(Net::FirstBounce) + bounce * int(Net::PerBounce) + int(offset);
}
inline constexpr int medium_net(int bounce) {
    return int(Net::FirstMedium) + bounce;
}

// Integer finaliser with full avalanche (constants: C. Wellons, hash-prospector, lowbias32).
template <class I>
I hash_bits(I x) {
    x = x ^ (x >> 16);
    x = x * I(0x7feb352d);
    x = x ^ (x >> 15);
    x = x * I(int(0x846ca68bu));
    return x ^ (x >> 16);
}

template <int W>
Int<W> reverse_bits(Int<W> x) {
    x = ((x >> 1) & Int<W>(0x55555555)) | ((x & Int<W>(0x55555555)) << 1);
    x = ((x >> 2) & Int<W>(0x33333333)) | ((x & Int<W>(0x33333333)) << 2);
    x = ((x >> 4) & Int<W>(0x0f0f0f0f)) | ((x & Int<W>(0x0f0f0f0f)) << 4);
    x = ((x >> 8) & Int<W>(0x00ff00ff)) | ((x & Int<W>(0x00ff00ff)) << 8);
    return (x >> 16) | (x << 16);
}

// Laine and Karras' permutation: every bit is changed by the bits below it alone, so on bit-reversed
// fractions it is a nested uniform scramble (constants: N. Vegdahl 2021, Building a Better LK Hash).
template <int W>
Int<W> laine_karras(Int<W> x, Int<W> seed) {
    x = x ^ (x * Int<W>(0x3d20adea));
    x = x + seed;
    x = x * ((seed >> 16) | Int<W>(1));
    x = x ^ (x * Int<W>(0x05526c56));
    return x ^ (x * Int<W>(0x53a22864));
}

// The upper 24 bits as a float in [0, 1).
template <int W>
Float<W> to_unit(Int<W> bits) {
    return Float<W>(bits >> 8) * Float<W>(0x1p-24f);
}

// ---- polynomials over GF(4) = {0, 1, w, w + 1}, two bits a coefficient, the constant one lowest
// Progression and place of a pixel make f = sum s_k x^k + sum p_j / (x - w)^(j + 1), and dimension a is made
// of the Taylor coefficients of f at a, for a = 0, 1 and w + 1: by Hermite interpolation (of f times a power
// of x - w) 4^j samples of each of 4^k pixels are a net of base 4. Powers of a repeat, and binomials are odd
// where bits of one number are bits of the other (Lucas): so each of these is a step a bit of the digit's
// number.

// times w: (d1, d0) becomes (d1 + d0, d1)
template <class I>
I times_w(I d) {
    const I high = (d >> 1) & I(0x55555555);
    return (((d & I(0x55555555)) ^ high) << 1) | high;
}
// times w^K
template <int K, class I>
I times_power(I d) {
    if constexpr (K % 3 == 0)
        return d;
    else
        return K % 3 == 1 ? times_w(d) : times_w(d) ^ d;
}

// Taylor coefficients at w^K of a polynomial.
template <int K, class I>
I taylor(I s) {
    s = s ^ times_power<K>((s >> 2) & I(0x33333333));
    s = s ^ times_power<2 * K>((s >> 4) & I(0x0f0f0f0f));
    s = s ^ times_power<4 * K>((s >> 8) & I(0x00ff00ff));
    return s ^ times_power<8 * K>((s >> 16) & I(0x0000ffff));
}

// Taylor coefficients, w^K away from w, of sum p_j / (x - w)^(j + 1) for the four digits of p:
// r has sum binomial(j + r, r) w^(-K (j + r + 1)) p_j, and that binomial is odd where j and r share no bit.
template <int K, class I>
I taylor_of_poles(I p) {
    constexpr int G = 3 - K; // w^G: the inverse
    I low = p & I(0x33), high = (p >> 2) & I(0x33);
    p = (low ^ times_power<G>(high)) | (times_power<G>(low) << 2);
    low = p & I(0x0f), high = (p >> 4) & I(0x0f);
    p = (low ^ times_power<2 * G>(high)) | (times_power<2 * G>(low) << 4);
    p = p | (times_power<4 * G>(p) << 8);
    p = p | (times_power<8 * G>(p) << 16);
    return times_power<G>(p);
}

// ---- pixels
inline constexpr int TileBits = 4; // pixels whose points know of one another: 16 by 16

// The seed of a pixel's samples: a hash of its tile, and in the lowest eight bits its place there along a
// Z-shaped curve.
template <int W>
Int<W> pixel_seed(Int<W> x, Int<W> y, uint32_t seed) {
    const Int<W> tile = hash_bits((x >> TileBits) ^
                                  hash_bits((y >> TileBits) ^ Int<W>(int(seed * 0x9e3779b9u + 0x7f4a7c15u))));
    const auto spread = [](Int<W> v) {
        v = (v | (v << 2)) & Int<W>(0x33);
        return (v | (v << 1)) & Int<W>(0x55);
    };
    return (tile & Int<W>(~0xff)) | spread(x & Int<W>(0xf)) | (spread(y & Int<W>(0xf)) << 1);
}

// One stream a path: the pixel's seed, and the progression with its bits reversed.
template <int W>
struct Sampler {
    Int<W> pixel;            // pixel_seed()
    uint32_t reversed_index; // reverse_bits(progression)

    Float<W> sample_1d(int net) const {
        const Int<W> h = hash_bits(pixel ^ salt(net));
        return scrambled(reverse_bits(laine_karras(Int<W>(int(reversed_index)), h)), h, 0x68bc21eb);
    }
    void sample_2d(int net, Float<W>& u0, Float<W>& u1) const {
        const Shuffled f(*this, net);
        f.first_two(u0, u1);
    }
    void sample_3d(int net, Float<W>& u0, Float<W>& u1, Float<W>& u2) const {
        const Shuffled f(*this, net);
        f.first_two(u0, u1);
        u2 = scrambled(taylor<0>(taylor<1>(f.s)) ^ taylor_of_poles<0>(f.p), f.h, 0x51ed270b);
    }

  private:
    static Int<W> salt(int net) { return Int<W>(int(uint32_t(net) * 0x9e3779b9u)); }
    // Digits, the largest lowest, to a number.
    static Float<W> scrambled(Int<W> digits, Int<W> h, int dimension) {
        return to_unit(reverse_bits(laine_karras(digits, hash_bits(h ^ Int<W>(dimension)))));
    }
    // What a net makes of progression and pixel. The shuffle keeps together what is aligned: runs of
    // progressions, squares of pixels.
    struct Shuffled {
        Int<W> h, s, p;

        Shuffled(const Sampler& of, int net)
            : h(hash_bits((of.pixel & Int<W>(~0xff)) ^ salt(net))),
              s(reverse_bits(laine_karras(Int<W>(int(of.reversed_index)), h))),
              p(reverse_bits(laine_karras(reverse_bits(of.pixel), hash_bits(h ^ Int<W>(0x1b873593)))) &
                Int<W>(0xff)) {}
        void first_two(Float<W>& u0, Float<W>& u1) const {
            u0 = scrambled(s ^ taylor_of_poles<1>(p), h, 0x68bc21eb);
            // The first bit of a digit is the sum of its two: so both dimensions are a net of base 2, too.
            Int<W> y = taylor<0>(s) ^ taylor_of_poles<2>(p);
            y = y ^ ((y >> 1) & Int<W>(0x55555555));
            u1 = scrambled(y, h, 0x02e5be93);
        }
    };
};

inline uint32_t reverse_bits_scalar(uint32_t x) {
    return uint32_t(reverse_bits(Int<1>(int(x)))[0]);
}

} // namespace kanuka
