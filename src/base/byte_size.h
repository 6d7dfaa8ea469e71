// Sizes as people write them.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>

namespace kanuka {

// Bytes of 500M or 2G, with K, M, G and T for 2^10, 2^20, 2^30 and 2^40; none = it is no size.
inline std::optional<uint64_t> parse_byte_size(const std::string& text) {
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    const std::string unit = end;
    const double scale = unit.empty()  ? 1
                         : unit == "K" ? double(1 << 10)
                         : unit == "M" ? double(1 << 20)
                         : unit == "G" ? double(1 << 30)
                         : unit == "T" ? double(1ull << 40)
                                       : 0;
    if (end == text.c_str() || !(scale > 0) || !(number >= 0) || !(number * scale < 1e18))
        return std::nullopt;
    return uint64_t(number * scale);
}

} // namespace kanuka
