#include "bvh/clusters.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>

#include "base/lanes.h"
#include "base/tasks.h"
#include "bvh/boxes.h"
#include "bvh/embree_scene.h"

namespace kanuka::bvh {

namespace {

constexpr size_t Chunk = 4096;
// What one cluster more costs in the tree above, in typical clusters' boxes: more than 1/3, or single
// instances would be best.
constexpr double ClusterCost = 0.5;
constexpr float Infinity = std::numeric_limits<float>::infinity();

bool can_be_hit(const Bounds3f& box) {
    const auto largest = [](const Vec3f& v) {
        return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    };
    return !box.empty() && largest(box.lo) < LargestCoordinate && largest(box.hi) < LargestCoordinate;
}

// Its bits with two zeros between each and the next.
uint64_t spread(uint32_t x) {
    uint64_t v = x & 0x1fffff;
    v = (v | v << 32) & 0x1f00000000ffff;
    v = (v | v << 16) & 0x1f0000ff0000ff;
    v = (v | v << 8) & 0x100f00f00f00f00f;
    v = (v | v << 4) & 0x10c30c30c30c30c3;
    return (v | v << 2) & 0x1249249249249249;
}

// Along Morton's curve (1966): the code of the box's middle in the upper bits, the instance's number in the
// lower ones. More instances leave fewer bits to the code, but still some cells for each.
std::vector<uint64_t> along_curve(const Places& places, const Bounds3f& child) {
    const size_t count = places.size();
    const int number_bits = std::bit_width(count);
    constexpr uint64_t Out = ~uint64_t(0);
    constexpr uint32_t LastCell = 0x1fffff;
    std::vector<uint64_t> keys(count);
    Bounds3f all;
    std::mutex mutex;
    tasks::parallel_chunks(count, Chunk, [&](size_t begin, size_t end) {
        Bounds3f here;
        for (size_t i = begin; i < end; i++) {
            const Matrix m = places[i];
            const Bounds3f box = placed(m.data(), child);
            const bool in = can_be_hit(box) && has_inverse(m.data());
            keys[i] = in ? 0 : Out;
            if (in)
                here.extend(box);
        }
        const std::lock_guard lock(mutex);
        all.extend(here);
    });
    const Vec3f size = all.hi - all.lo;
    const float widest = std::max({size.x, size.y, size.z}),
                cells = widest > 0 ? float(LastCell) / widest : 0.0f;
    const Vec3f middle = (child.lo + child.hi) * 0.5f;
    tasks::parallel_chunks(count, Chunk, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            if (keys[i] == Out)
                continue;
            const Matrix matrix = places[i];
            const float* m = matrix.data();
            const auto along = [&](int r) {
                const float x = m[4 * r] * middle.x + m[4 * r + 1] * middle.y + m[4 * r + 2] * middle.z;
                return std::clamp((x + m[4 * r + 3] - all.lo[r]) * cells, 0.0f, float(LastCell));
            };
            const Vec3f at(along(0), along(1), along(2));
            const uint64_t code =
                spread(uint32_t(at.x)) << 2 | spread(uint32_t(at.y)) << 1 | spread(uint32_t(at.z));
            keys[i] = code << 1 >> number_bits << number_bits | i;
        }
    });
    tasks::parallel_sort(keys);
    keys.erase(std::lower_bound(keys.begin(), keys.end(), Out), keys.end());
    for (uint64_t& key : keys)
        key &= (uint64_t(1) << number_bits) - 1;
    return keys;
}

// Half of what is usual for the area around four neighbours on the curve.
double usual_area(std::span<const Bounds3f> boxes) {
    std::vector<double> areas;
    for (size_t i = 0; i < boxes.size(); i += Cluster::Size) {
        Bounds3f box;
        for (const Bounds3f& b : boxes.subspan(i, std::min(size_t(Cluster::Size), boxes.size() - i)))
            box.extend(b);
        areas.push_back(half_area(box));
    }
    std::nth_element(areas.begin(), areas.begin() + ptrdiff_t(areas.size() / 2), areas.end());
    return areas[areas.size() / 2];
}

// Cuts a run of the curve where that costs rays least, which meet a box in proportion to its area. So none
// reaches over a gap. Returns how many instances each cluster has.
std::vector<uint8_t> cut(std::span<const Bounds3f> boxes) {
    const size_t n = boxes.size();
    const double each = ClusterCost * usual_area(boxes);
    std::vector<double> cost(n + 1, 0.0); // of the best cut of the first so many
    std::vector<uint8_t> last(n + 1, 1);  // how many its last cluster has
    for (size_t i = 1; i <= n; i++) {
        Bounds3f box;
        cost[i] = Infinity; // and one it stays where areas are beyond all numbers
        for (size_t k = 1; k <= std::min(i, size_t(Cluster::Size)); k++) {
            box.extend(boxes[i - k]);
            const double c = cost[i - k] + half_area(box) + each;
            if (c < cost[i])
                cost[i] = c, last[i] = uint8_t(k);
        }
    }
    std::vector<uint8_t> sizes;
    for (size_t i = n; i > 0; i -= last[i])
        sizes.push_back(last[i]);
    std::reverse(sizes.begin(), sizes.end());
    return sizes;
}

// Planes around boxes that lie in `all`, outwards by less than a 255th of that.
void set_boxes(Cluster& c, std::span<const Bounds3f> boxes, const Bounds3f& all) {
    constexpr float Least = std::numeric_limits<float>::min();
    for (int a = 0; a < 3; a++) {
        std::fill_n(c.lo[a], Cluster::Size, uint8_t(0)), std::fill_n(c.hi[a], Cluster::Size, uint8_t(0));
        c.origin[a] = all.lo[a];
        c.step[a] = std::max((all.hi[a] - all.lo[a]) / 255, Least);
        while (c.plane(a, 255) < all.hi[a]) // it was rounded
            c.step[a] *= 1 + 0x1p-20f;
        const auto number = [&](float x) { return std::clamp(int((x - c.origin[a]) / c.step[a]), 0, 255); };
        for (size_t k = 0; k < boxes.size(); k++) {
            int first = number(boxes[k].lo[a]), last = number(boxes[k].hi[a]);
            while (first > 0 && c.plane(a, first) > boxes[k].lo[a])
                first--;
            while (last < 255 && c.plane(a, last) < boxes[k].hi[a])
                last++;
            c.lo[a][k] = uint8_t(first), c.hi[a][k] = uint8_t(last);
        }
    }
}

void fill(Cluster& c, std::span<const uint64_t> instances, std::span<const Bounds3f> boxes) {
    Bounds3f all;
    for (const Bounds3f& box : boxes)
        all.extend(box);
    set_boxes(c, boxes, all);
    std::fill_n(c.instance, Cluster::Size, Cluster::None);
    std::copy(instances.begin(), instances.end(), c.instance);
}

// Of a run of the curve.
std::vector<Cluster> clusters_of(std::span<const uint64_t> run, const Places& places, const Bounds3f& child) {
    std::vector<Bounds3f> boxes(run.size());
    for (size_t i = 0; i < run.size(); i++)
        boxes[i] = placed(places[size_t(run[i])].data(), child);
    const std::vector<uint8_t> sizes = cut(boxes);
    std::vector<Cluster> clusters(sizes.size());
    size_t first = 0;
    for (size_t i = 0; i < sizes.size(); first += sizes[i++])
        fill(clusters[i], run.subspan(first, sizes[i]), std::span(boxes).subspan(first, sizes[i]));
    return clusters;
}

// Slabs are widened as Embree's robust traversal does: by three units in the last place.
constexpr float Ulp = 0x1p-23f, Nearer = 1 - 3 * Ulp, Further = 1 + 3 * Ulp;

template <int W>
Float<W> slopes_of(Float<W> direction) {
    const Float<W> least(1e-18f);
    return Float<W>(1.0f) / select(abs(direction) < least, copysign(least, direction), direction);
}

} // namespace

Bounds3f Cluster::box(int k) const {
    Bounds3f b;
    for (int a = 0; a < 3 && instance[k] != None; a++)
        b.lo[a] = plane(a, lo[a][k]), b.hi[a] = plane(a, hi[a][k]);
    return b;
}

Bounds3f Cluster::bounds() const {
    Bounds3f b;
    for (int k = 0; k < Size; k++)
        b.extend(box(k));
    return b;
}

ClusterBoxes::ClusterBoxes(const Cluster& cluster) {
    using F = Float<Cluster::Size>;
    for (int a = 0; a < 3; a++) {
        const auto planes = [&](const uint8_t* numbers) {
            const __m128 n = _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_loadu_si32(numbers)));
            return F(cluster.origin[a]) + F(cluster.step[a]) * F(F::F(n));
        };
        m_lo[a] = planes(cluster.lo[a]), m_hi[a] = planes(cluster.hi[a]);
    }
    const auto used = Int<Cluster::Size>::load(reinterpret_cast<const int32_t*>(cluster.instance)).v != -1;
    m_used = uint32_t(_mm_movemask_ps(__m128(used)));
}

uint32_t ClusterBoxes::meet(const RTCRay& ray, float entry[Cluster::Size]) const {
    using F = Float<Cluster::Size>;
    const F slopes = slopes_of(F(F::F{ray.dir_x, ray.dir_y, ray.dir_z, 1}));
    const float* origin = &ray.org_x;
    F enter(ray.tnear), leave(ray.tfar);
    for (int a = 0; a < 3; a++) {
        const bool backwards = slopes[a] < 0;
        const F o(origin[a]), slope(slopes[a]);
        enter = max(enter, ((backwards ? m_hi : m_lo)[a] - o) * (slope * F(Nearer)));
        leave = min(leave, ((backwards ? m_lo : m_hi)[a] - o) * (slope * F(Further)));
    }
    enter.store(entry);
    return uint32_t(_mm_movemask_ps(__m128((enter <= leave).v))) & m_used;
}

uint32_t ClusterBoxes::meet_eight(RTCRayN* rays, float entry[Cluster::Size][8]) const {
    using F = Float<8>;
    const F start = F::load(&RTCRayN_tnear(rays, 8, 0)), end = F::load(&RTCRayN_tfar(rays, 8, 0));
    const F origin[3] = {F::load(&RTCRayN_org_x(rays, 8, 0)), F::load(&RTCRayN_org_y(rays, 8, 0)),
                         F::load(&RTCRayN_org_z(rays, 8, 0))};
    const F slope[3] = {slopes_of(F::load(&RTCRayN_dir_x(rays, 8, 0))),
                        slopes_of(F::load(&RTCRayN_dir_y(rays, 8, 0))),
                        slopes_of(F::load(&RTCRayN_dir_z(rays, 8, 0)))};
    uint32_t met = 0;
    for (int k = 0; k < Cluster::Size; k++) {
        if (!(m_used >> k & 1))
            continue;
        F enter = start, leave = end;
        for (int a = 0; a < 3; a++) {
            const Mask<8> backwards = slope[a] < F(0.0f);
            const F lo(m_lo[a][k]), hi(m_hi[a][k]);
            enter = max(enter, (select(backwards, hi, lo) - origin[a]) * (slope[a] * F(Nearer)));
            leave = min(leave, (select(backwards, lo, hi) - origin[a]) * (slope[a] * F(Further)));
        }
        enter.store(entry[k]);
        met |= (enter <= leave).bits() << (8 * k);
    }
    return met;
}

LargeVector<Cluster> cluster_instances(const Places& places, const Bounds3f& child) {
    const std::vector<uint64_t> order = along_curve(places, child);
    std::vector<std::vector<Cluster>> chunks((order.size() + Chunk - 1) / Chunk);
    tasks::parallel_chunks(order.size(), Chunk, [&](size_t begin, size_t end) {
        chunks[begin / Chunk] = clusters_of(std::span(order).subspan(begin, end - begin), places, child);
    });
    std::vector<size_t> first{0}; // cluster of each chunk
    for (const auto& chunk : chunks)
        first.push_back(first.back() + chunk.size());
    LargeVector<Cluster> all(first.back());
    tasks::parallel_chunks(chunks.size(), 1, [&](size_t k, size_t) {
        std::copy(chunks[k].begin(), chunks[k].end(), all.begin() + ptrdiff_t(first[k]));
        chunks[k] = {};
    });
    return all;
}

} // namespace kanuka::bvh
