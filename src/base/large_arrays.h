// Large pages for ordinary vectors: for arrays that are written once from end to end, where the system has
// more work with small pages than the writer has with what is in them.
#pragma once

#include <cstdint>
#include <vector>

#include "base/large_pages.h"

namespace kanuka {

// Room for `n` elements, in large pages where that is much.
template <class T>
void reserve_large(std::vector<T>& v, size_t n) {
    constexpr uintptr_t Page = 4096;
    v.reserve(n);
    char* data = reinterpret_cast<char*>(v.data());
    const size_t skipped = size_t(-reinterpret_cast<uintptr_t>(data)) % Page,
                 bytes = v.capacity() * sizeof(T),
                 whole = bytes > skipped ? (bytes - skipped) / Page * Page : 0;
    if (whole >= 2 * LargePage)
        want_large_pages(data + skipped, whole);
}

} // namespace kanuka
