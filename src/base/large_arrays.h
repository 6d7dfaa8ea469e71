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
    const auto begin = (reinterpret_cast<uintptr_t>(v.data()) + Page - 1) / Page * Page,
               end = reinterpret_cast<uintptr_t>(v.data() + v.capacity()) / Page * Page;
    if (end >= begin + 2 * LargePage)
        want_large_pages(reinterpret_cast<void*>(begin), end - begin);
}

} // namespace kanuka
