// Everything that is in a page, for rays that are given as an array: by the widest vectors that this machine
// has. Whoever filters hits instantiates queue.h for itself.
#pragma once

#include <span>

#include "hierarchy/page.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

// Thread safety: any number of threads may trace a page at once.
void closest(const Page& page, std::span<const Ray> rays, std::span<Hit> hits);
void occluded(const Page& page, std::span<const Ray> rays, std::span<uint8_t> hidden);

// By so many lanes, for tests and benchmarks. Sixteen without AVX-512 are two registers each.
void closest_w8(const Page& page, std::span<const Ray> rays, std::span<Hit> hits);
void occluded_w8(const Page& page, std::span<const Ray> rays, std::span<uint8_t> hidden);
void closest_w16(const Page& page, std::span<const Ray> rays, std::span<Hit> hits);
void occluded_w16(const Page& page, std::span<const Ray> rays, std::span<uint8_t> hidden);
// Built for AVX-512.
void closest_avx512(const Page& page, std::span<const Ray> rays, std::span<Hit> hits);
void occluded_avx512(const Page& page, std::span<const Ray> rays, std::span<uint8_t> hidden);

} // namespace kanuka::hierarchy
