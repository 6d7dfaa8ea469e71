// Reading decimal numbers fast and correctly rounded.
#pragma once

#include <bit>
#include <charconv>
#include <cstdint>
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

// Clinger's fast path (1990): a mantissa below 2^53 times or over an exactly representable power of ten is
// rounded once, hence right. Everything else goes to std::from_chars. Out of range becomes the largest finite
// double, or 0.
inline ScannedNumber scan_number(const char* p, const char* end) {
    static constexpr double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                        1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                        1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+'))
        p++;
    const char* unsigned_start = p;
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
