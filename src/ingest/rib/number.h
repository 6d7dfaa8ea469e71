// Reading decimal numbers fast and correctly rounded.
#pragma once

#include <bit>
#include <charconv>
#include <cstdint>
#include <immintrin.h>
#include <limits>

namespace kanuka::ingest {

struct ScannedNumber {
    double value = 0;
    const char* end = nullptr; // null = not a number
    bool integer = false;      // written without point and exponent
};

inline bool starts_number(char c) {
    return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.';
}

// Numbers of at most 16 characters without exponent, nearly all there are, without a branch on any of their
// digits: how long a number is and where its point stands is as good as random, and a wrong guess costs more
// than all the arithmetic. The digits are moved together to the end of 16 bytes and multiplied up in pairs
// (as in Lemire 2021, section 5, but for any length). `p` is behind the sign; 32 bytes from it on are
// readable. False: not of this form.
struct ShortNumber {
    uint64_t mantissa;
    int length, behind; // characters; digits behind the point
    bool point;
};

inline bool scan_short(const char* p, ShortNumber& n) {
    const __m128i text = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
    const __m128i value = _mm_sub_epi8(text, _mm_set1_epi8('0'));
    const auto digits =
        unsigned(_mm_movemask_epi8(_mm_cmpeq_epi8(_mm_min_epu8(value, _mm_set1_epi8(9)), value)));
    const auto points = unsigned(_mm_movemask_epi8(_mm_cmpeq_epi8(text, _mm_set1_epi8('.'))));
    const int length = std::countr_one(digits | points);
    const unsigned mine = points & ((1u << length) - 1);
    const int point = mine ? std::countr_zero(mine) : length;
    const int count = length - (mine != 0); // digits
    if (length >= 16 || count == 0 || (mine & (mine - 1)) != 0 || (p[length] | 0x20) == 'e')
        return false;
    // Byte i of the result is digit i - (16 - count); behind the point it stands one further on in the text.
    // Indices below 0 have their top bit set, which pshufb turns to 0.
    const __m128i counting = _mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    __m128i index = _mm_sub_epi8(counting, _mm_set1_epi8(char(16 - count)));
    index = _mm_sub_epi8(index, _mm_cmpgt_epi8(index, _mm_set1_epi8(char(point - 1))));
    const __m128i aligned = _mm_shuffle_epi8(value, index);
    const __m128i pairs =
        _mm_maddubs_epi16(aligned, _mm_setr_epi8(10, 1, 10, 1, 10, 1, 10, 1, 10, 1, 10, 1, 10, 1, 10, 1));
    const __m128i fours = _mm_madd_epi16(pairs, _mm_setr_epi16(100, 1, 100, 1, 100, 1, 100, 1));
    const __m128i packed = _mm_packus_epi32(fours, fours);
    const __m128i eights = _mm_madd_epi16(packed, _mm_setr_epi16(10000, 1, 10000, 1, 10000, 1, 10000, 1));
    const auto both = uint64_t(_mm_cvtsi128_si64(eights));
    n.mantissa = (both & 0xffffffff) * 100000000 + (both >> 32);
    n.length = length;
    n.behind = length - point - (mine != 0);
    n.point = mine != 0;
    return true;
}

// Clinger's fast path (1990): a mantissa below 2^53 times or over an exactly representable power of ten is
// rounded once, hence right. Everything else goes to std::from_chars. Out of range becomes the largest finite
// double, or 0.
inline ScannedNumber scan_number(const char* p, const char* end) {
    static constexpr double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                        1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                        1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const bool negative = p < end && *p == '-';
    p += p < end && (*p == '-' || *p == '+');
    const char* unsigned_start = p;
    if (ShortNumber n; end - p >= 32 && scan_short(p, n)) { // 15 digits fit into 2^53
        ScannedNumber r;
        r.value = double(n.mantissa) / powers[n.behind];
        r.value = negative ? -r.value : r.value;
        r.end = p + n.length;
        r.integer = !n.point;
        return r;
    }
    uint64_t mantissa = 0;
    int digits = 0, exponent = 0;
    for (; p < end && unsigned(*p - '0') < 10; p++, digits++)
        mantissa = mantissa * 10 + unsigned(*p - '0');
    ScannedNumber r;
    r.integer = true;
    if (p < end && *p == '.') {
        r.integer = false;
        const char* point = ++p;
        for (; p < end && unsigned(*p - '0') < 10; p++)
            mantissa = mantissa * 10 + unsigned(*p - '0');
        digits += int(p - point);
        exponent = -int(p - point);
    }
    if (digits == 0)
        return {};
    if (p < end && (*p == 'e' || *p == 'E')) {
        const char* q = p + 1;
        const bool negative_exponent = q < end && *q == '-';
        if (q < end && (*q == '-' || *q == '+'))
            q++;
        if (q < end && unsigned(*q - '0') < 10) {
            int e = 0;
            for (; q < end && unsigned(*q - '0') < 10; q++)
                e = e < 100000 ? e * 10 + (*q - '0') : e;
            exponent += negative_exponent ? -e : e;
            r.integer = false;
            p = q;
        }
    }
    r.end = p;
    if (digits <= 18 && mantissa < (uint64_t(1) << 53) && exponent >= -22 && exponent <= 22) {
        const double m = double(mantissa);
        r.value = exponent < 0 ? m / powers[-exponent] : m * powers[exponent];
        r.value = negative ? -r.value : r.value;
        return r;
    }
    const auto [ptr, ec] = std::from_chars(unsigned_start, p, r.value);
    if (ec == std::errc::result_out_of_range)
        r.value = exponent > 0 || digits > 300 ? std::numeric_limits<double>::max() : 0;
    r.value = negative ? -r.value : r.value;
    return r;
}

// To the nearest float of the decimal itself. Rounding twice can only go wrong where the double lies exactly
// between two floats, or among the denormal floats, which lie elsewhere; then the text is read again.
inline float to_float(const ScannedNumber& n, const char* text) {
    const double magnitude = n.value < 0 ? -n.value : n.value;
    if (magnitude > double(std::numeric_limits<float>::max()))
        return n.value < 0 ? -std::numeric_limits<float>::max() : std::numeric_limits<float>::max();
    const bool middle = (std::bit_cast<uint64_t>(n.value) & 0x1fffffff) == 0x10000000;
    const bool denormal = magnitude < double(std::numeric_limits<float>::min()) && magnitude != 0;
    float value = float(n.value);
    if (middle || denormal)
        std::from_chars(*text == '+' ? text + 1 : text, n.end,
                        value); // leaves `value` where it is out of range
    return value;
}

} // namespace kanuka::ingest
