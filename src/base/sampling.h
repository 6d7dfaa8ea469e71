// Sample points: Owen-scrambled Sobol', two dimensions at a time, each pair shuffled on its own (Burley 2020,
// Practical Hash-based Owen Scrambling). A sample is a pure function of (pixel, progression, dimension,
// seed).
#pragma once

#include "base/lanes.h"

namespace kanuka {

// Pairs of dimensions a path consumes. Those of a bounce repeat: pair = FirstBounce + bounce * PerBounce +
// offset.
enum class Dimension : int {
    Filter = 0, // position in the pixel
    Wavelength, // where the four lie; which of them is the hero
    Lens,
    FirstBounce,
    LobeRoulette = 0, // offsets: which lobe; Russian roulette
    Direction,        // on the hemisphere
    LightChoice,      // which light; which of its parts
    LightPosition,    // on the light
    PerBounce,
    LevelTime = (1 << 20) - 1, // which levels of detail a path meets; shutter time; likewise apart
    FirstMedium = 1 << 20, // free paths in media, a pair each: apart, so that other scenes keep their points
};

inline constexpr int bounce_dimension(int bounce, Dimension offset) {
    return int(Dimension::FirstBounce) + bounce * int(Dimension::PerBounce) + int(offset);
}
inline constexpr int medium_dimension(int bounce) {
    return int(Dimension::FirstMedium) + bounce;
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

// One stream a path: the pixel's hash, and the progression with its bits reversed.
template <int W>
struct Sampler {
    Int<W> pixel;            // hash of (x, y, seed)
    uint32_t reversed_index; // reverse_bits(progression)

    void sample_2d(int pair, Float<W>& u0, Float<W>& u1) const {
        const Int<W> h = hash_bits(pixel ^ Int<W>(int(uint32_t(pair) * 0x9e3779b9u)));
        // Shuffle: the permuted index, bits reversed, is Sobol' dimension 0 itself.
        const Int<W> x = laine_karras(Int<W>(int(reversed_index)), h);
        const Int<W> index = reverse_bits(x);
        // Dimension 1 has Pascal's triangle mod 2 as its matrix, the fivefold Kronecker power of [1 1; 0 1];
        // on the index, low bit first, that is five butterfly steps (Helmer et al. 2021, section 5).
        Int<W> y = index;
        y = y ^ ((y >> 1) & Int<W>(0x55555555));
        y = y ^ ((y >> 2) & Int<W>(0x33333333));
        y = y ^ ((y >> 4) & Int<W>(0x0f0f0f0f));
        y = y ^ ((y >> 8) & Int<W>(0x00ff00ff));
        y = y ^ (y >> 16);
        // Both are fractions with bits reversed now: scramble, then reverse.
        u0 = to_unit(reverse_bits(laine_karras(index, hash_bits(h ^ Int<W>(0x68bc21eb)))));
        u1 = to_unit(reverse_bits(laine_karras(y, hash_bits(h ^ Int<W>(0x02e5be93)))));
    }
};

inline uint32_t reverse_bits_scalar(uint32_t x) {
    return uint32_t(reverse_bits(Int<1>(int(x)))[0]);
}

} // namespace kanuka
