#include "store/compress.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <zstd.h>

namespace kanuka::store {

namespace {

constexpr int Level = 3;            // higher ones take three times as long for a tenth
constexpr size_t PieceWords = 8192; // of a page, each with the predictor that suits it

// Signed residuals as 0, -1, 1, -2, …: small ones have no high bits.
template <class Unsigned>
constexpr Unsigned zigzag(Unsigned residual) {
    constexpr int Sign = 8 * sizeof(Unsigned) - 1;
    return Unsigned(Unsigned(residual << 1) ^ Unsigned(0 - (residual >> Sign)));
}
template <class Unsigned>
constexpr Unsigned unzigzag(Unsigned code) {
    return Unsigned(Unsigned(code >> 1) ^ Unsigned(0 - (code & 1)));
}

// A word is predicted by the one `Stride` before it, as a whole or each half by itself; the first by 0.
template <size_t Stride, bool Halves>
struct Delta {
    static uint32_t code(uint32_t word, uint32_t predicted) {
        if constexpr (!Halves)
            return zigzag(word - predicted);
        const uint16_t low = zigzag(uint16_t(word - predicted)),
                       high = zigzag(uint16_t((word >> 16) - (predicted >> 16)));
        return low | uint32_t(high) << 16;
    }
    static uint32_t word(uint32_t code, uint32_t predicted) {
        if constexpr (!Halves)
            return unzigzag(code) + predicted;
        const uint16_t low = uint16_t(unzigzag(uint16_t(code)) + predicted),
                       high = uint16_t(unzigzag(uint16_t(code >> 16)) + (predicted >> 16));
        return low | uint32_t(high) << 16;
    }
    static void encode(std::span<uint32_t> words) {
        for (size_t i = words.size(); i-- > 0;)
            words[i] = code(words[i], i < Stride ? 0 : words[i - Stride]);
    }
    static void decode(std::span<uint32_t> codes) {
        for (size_t i = 0; i < std::min(Stride, codes.size()); i++)
            codes[i] = word(codes[i], 0);
        for (size_t i = Stride; i < codes.size(); i++)
            codes[i] = word(codes[i], codes[i - Stride]);
    }
};
struct None { // words as they are
    static void encode(std::span<uint32_t>) {}
    static void decode(std::span<uint32_t>) {}
};

// Positions are three words; inputs of lobes are halves, or bytes. A piece has the number of its predictor.
struct Predictor {
    void (*encode)(std::span<uint32_t>);
    void (*decode)(std::span<uint32_t>);
};
template <class P>
constexpr Predictor predictor = {P::encode, P::decode};
constexpr Predictor Predictors[] = {predictor<None>, predictor<Delta<3, false>>, predictor<Delta<3, true>>,
                                    predictor<Delta<1, true>>};

// Of the bytes of each significance by themselves, in bits [Shannon 1948].
double entropy(std::span<const uint32_t> words) {
    std::array<std::array<uint32_t, 256>, 4> counts{};
    for (const uint32_t word : words)
        for (size_t b = 0; b < 4; b++)
            counts[b][word >> (8 * b) & 255]++;
    double bits = 0;
    for (const auto& of_byte : counts)
        for (const uint32_t n : of_byte)
            if (n > 0)
                bits -= double(n) * std::log2(double(n) / double(words.size()));
    return bits;
}

// What zstd is given: of each piece the number of its predictor, then the bytes of its codes by significance.
size_t bytes_of(size_t words) {
    return 4 * words + (words + PieceWords - 1) / PieceWords;
}

} // namespace

std::vector<char> compress(std::span<const uint32_t> words) {
    std::vector<char> pieces;
    pieces.reserve(bytes_of(words.size()));
    std::vector<uint32_t> best, codes;
    for (size_t begin = 0; begin < words.size(); begin += PieceWords) {
        const auto piece = words.subspan(begin, std::min(PieceWords, words.size() - begin));
        size_t number = 0;
        double least = std::numeric_limits<double>::infinity();
        for (size_t p = 0; p < std::size(Predictors); p++) {
            codes.assign(piece.begin(), piece.end());
            Predictors[p].encode(codes);
            if (const double bits = entropy(codes); bits < least)
                least = bits, number = p, best.swap(codes);
        }
        pieces.push_back(char(number));
        for (int b = 0; b < 4; b++)
            for (const uint32_t code : best)
                pieces.push_back(char(code >> (8 * b)));
    }
    const size_t bytes = 4 * words.size();
    std::vector<char> out(ZSTD_compressBound(pieces.size()));
    const size_t made = ZSTD_compress(out.data(), out.size(), pieces.data(), pieces.size(), Level);
    if (ZSTD_isError(made) || made >= bytes || bytes / made >= MostCompressed)
        return {};
    out.resize(made);
    return out;
}

bool decompress(std::span<const char> bytes, std::span<uint32_t> words) {
    std::vector<char> pieces(bytes_of(words.size()));
    if (ZSTD_decompress(pieces.data(), pieces.size(), bytes.data(), bytes.size()) != pieces.size())
        return false;
    const char* at = pieces.data();
    for (size_t begin = 0; begin < words.size(); begin += PieceWords) {
        const auto piece = words.subspan(begin, std::min(PieceWords, words.size() - begin));
        const size_t number = uint8_t(*at++), n = piece.size();
        if (number >= std::size(Predictors))
            return false;
        for (size_t i = 0; i < n; i++) {
            uint32_t code = 0;
            for (size_t b = 0; b < 4; b++)
                code |= uint32_t(uint8_t(at[b * n + i])) << (8 * b);
            piece[i] = code;
        }
        Predictors[number].decode(piece);
        at += 4 * n;
    }
    return true;
}

} // namespace kanuka::store
