#include "store/compress.h"

#include <cstring>
#include <zstd.h>

namespace kanuka::store {

namespace {

constexpr int Level = 3; // higher ones take three times as long for a tenth

} // namespace

std::vector<char> compress(std::span<const uint32_t> words) {
    const size_t n = words.size(), bytes = 4 * n;
    std::vector<char> shuffled(bytes);
    for (size_t i = 0; i < n; i++)
        for (size_t b = 0; b < 4; b++)
            shuffled[b * n + i] = char(words[i] >> (8 * b));
    std::vector<char> out(ZSTD_compressBound(bytes));
    const size_t made = ZSTD_compress(out.data(), out.size(), shuffled.data(), bytes, Level);
    if (ZSTD_isError(made) || made >= bytes || bytes / made >= MostCompressed)
        return {};
    out.resize(made);
    return out;
}

bool decompress(std::span<const char> bytes, std::span<uint32_t> words) {
    const size_t n = words.size();
    std::vector<char> shuffled(4 * n);
    if (ZSTD_decompress(shuffled.data(), shuffled.size(), bytes.data(), bytes.size()) != shuffled.size())
        return false;
    for (size_t i = 0; i < n; i++) {
        uint32_t word = 0;
        for (size_t b = 0; b < 4; b++)
            word |= uint32_t(uint8_t(shuffled[b * n + i])) << (8 * b);
        words[i] = word;
    }
    return true;
}

} // namespace kanuka::store
