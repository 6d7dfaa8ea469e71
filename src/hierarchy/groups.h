// Which rays of a queue go together.
#pragma once

#include <span>
#include <vector>

#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

inline constexpr int PacketRays = 16;

struct PacketOfRays {
    uint32_t ray[PacketRays]; // their numbers in the queue
    int count;
};

// Rays are sorted by the signs of their directions, and of each kind the next sixteen go together where they
// run side by side. The others go alone.
class RayGroups {
  public:
    // Kept by each thread, until its next queue.
    static RayGroups& of_thread() {
        static thread_local RayGroups groups;
        return groups;
    }
    std::span<const PacketOfRays> packets() const { return m_packets; }
    std::span<const uint32_t> alone() const { return m_alone; }

    // `extent`: of the page.
    void sort(std::span<const Ray> rays, const Vec3f& extent) {
        m_packets.clear(), m_left.clear(), m_refused = 0;
        m_furthest = FurthestApart * max(max(extent.x, extent.y), extent.z);
        for (PacketOfRays& p : m_open)
            p.count = 0;
        const auto is_hopeless = [&] { return m_packets.empty() && m_refused >= MostRefused; };
        for (uint32_t i = 0; i < rays.size() && !is_hopeless(); i++) {
            PacketOfRays& p = m_open[_mm_movemask_ps(_mm_loadu_ps(&rays[i].d.x)) & 7];
            p.ray[p.count++] = i;
            if (p.count == PacketRays)
                close(rays, p);
        }
        if (!is_hopeless())
            for (PacketOfRays& p : m_open)
                close(rays, p);
        m_alone = m_left;
        if (m_packets.size() < FewestPackets)
            m_alone = all(rays.size()), m_packets.clear();
    }
    // In their order.
    std::span<const uint32_t> all(size_t count) {
        for (uint32_t i = uint32_t(m_numbers.size()); i < count; i++)
            m_numbers.push_back(i);
        return std::span(m_numbers).first(count);
    }

  private:
    // How far the origins may be from each other, in sizes of the page; and directions, in their own.
    static constexpr float FurthestApart = 0.1f, LargestTurn = 0.5f;
    static constexpr int FewestRays = 12;
    static constexpr size_t FewestPackets = 4; // of fewer each waits for memory where others would go on
    static constexpr int MostRefused = 4;      // so many before there is any packet: rays share nothing

    void close(std::span<const Ray> rays, PacketOfRays& p) {
        if (p.count >= FewestRays && run_together(rays, p)) {
            m_packets.push_back(p);
        } else {
            m_left.insert(m_left.end(), p.ray, p.ray + p.count);
            m_refused++;
        }
        p.count = 0;
    }
    bool run_together(std::span<const Ray> rays, const PacketOfRays& p) const {
        const auto load = [&](int i) { return _mm256_loadu_ps(&rays[p.ray[i]].o.x); }; // all of a ray
        __m256 least = load(0), most = least;
        for (int i = 1; i < p.count; i++)
            least = _mm256_min_ps(least, load(i)), most = _mm256_max_ps(most, load(i));
        const __m256 sign = _mm256_set1_ps(-0.0f);
        alignas(32) float width[8], size[8];
        _mm256_store_ps(width, _mm256_sub_ps(most, least));
        _mm256_store_ps(size, _mm256_max_ps(_mm256_andnot_ps(sign, most), _mm256_andnot_ps(sign, least)));
        const auto largest = [](const float* v) { return max(max(v[0], v[1]), v[2]); };
        return largest(width) <= m_furthest && largest(width + 4) <= LargestTurn * largest(size + 4);
    }

    std::vector<PacketOfRays> m_packets;
    std::vector<uint32_t> m_left, m_numbers;
    std::span<const uint32_t> m_alone;
    int m_refused = 0;
    float m_furthest = 0;
    PacketOfRays m_open[8];
};

} // namespace kanuka::hierarchy
