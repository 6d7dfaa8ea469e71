#include "hierarchy/trace.h"

#include "base/cpu.h"

namespace kanuka::hierarchy {

void closest(const Page& page, std::span<const Ray> rays, std::span<Hit> hits) {
#ifdef KANUKA_HIERARCHY_AVX512
    if (has_avx512())
        return closest_avx512(page, rays, hits);
#endif
    closest_w8(page, rays, hits);
}

void occluded(const Page& page, std::span<const Ray> rays, std::span<uint8_t> hidden) {
#ifdef KANUKA_HIERARCHY_AVX512
    if (has_avx512())
        return occluded_avx512(page, rays, hidden);
#endif
    occluded_w8(page, rays, hidden);
}

} // namespace kanuka::hierarchy
