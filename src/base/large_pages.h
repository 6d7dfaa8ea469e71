// Memory that is read all over, such as a hierarchy: in large pages (2 MB on x86), for the processor to look
// up fewer of them. A wish, which the system may not grant. Where memory has a bound (paged_memory.h) it
// comes and goes in small pages.
#pragma once

#include <cstddef>
#include <new>
#include <sys/mman.h>
#include <vector>

#include "base/paged_memory.h"

namespace kanuka {

inline constexpr size_t LargePage = size_t(1) << 21;

inline void want_large_pages(void* p, size_t bytes) {
    madvise(p, bytes, MADV_HUGEPAGE);
}

template <class T>
struct LargePages {
    using value_type = T;

    LargePages() = default;
    template <class U>
    LargePages(const LargePages<U>&) {}
    static std::align_val_t alignment(size_t n) {
        return std::align_val_t(n * sizeof(T) < LargePage ? alignof(T) : LargePage);
    }
    T* allocate(size_t n) {
        if (n * sizeof(T) >= LargePage)
            if (void* paged = paged_memory::allocate(n * sizeof(T)))
                return static_cast<T*>(paged);
        void* p = ::operator new(n * sizeof(T), alignment(n));
        if (n * sizeof(T) >= LargePage)
            want_large_pages(p, n * sizeof(T));
        return static_cast<T*>(p);
    }
    void deallocate(T* p, size_t n) {
        if (n * sizeof(T) < LargePage || !paged_memory::release(p))
            ::operator delete(p, alignment(n));
    }
    friend bool operator==(LargePages, LargePages) { return true; }
};

template <class T>
using LargeVector = std::vector<T, LargePages<T>>;

} // namespace kanuka
