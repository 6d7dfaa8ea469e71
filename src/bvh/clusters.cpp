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
std::vector<uint64_t> along_curve(std::span<const float> transforms, const Bounds3f& child) {
    const size_t count = transforms.size() / 12;
    const int number_bits = std::bit_width(count);
    constexpr uint64_t Out = ~uint64_t(0);
    constexpr uint32_t LastCell = 0x1fffff;
    std::vector<uint64_t> keys(count);
    Bounds3f all;
    std::mutex mutex;
    tasks::parallel_chunks(count, Chunk, [&](size_t begin, size_t end) {
        Bounds3f here;
        for (size_t i = begin; i < end; i++) {
            const Bounds3f box = placed(transforms.data() + i * 12, child);
            const bool in = can_be_hit(box);
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
            const float* m = transforms.data() + i * 12;
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
std::vector<uint8_t> cut(std::span<const uint64_t> run, std::span<const float> transforms,
                         const Bounds3f& child) {
    const size_t n = run.size();
    std::vector<Bounds3f> boxes(n);
    for (size_t i = 0; i < n; i++)
        boxes[i] = placed(transforms.data() + size_t(run[i]) * 12, child);
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

void fill(Cluster& c, std::span<const uint64_t> instances, std::span<const float> transforms,
          const Bounds3f& child) {
    for (size_t k = 0; k < Cluster::Size; k++) {
        const size_t i = size_t(instances[k < instances.size() ? k : 0]);
        const bool used = invert(transforms.data() + i * 12, c.child_from_group[k]) && k < instances.size();
        const Bounds3f box = used ? placed(transforms.data() + i * 12, child) : Bounds3f();
        for (int a = 0; a < 3; a++)
            c.lo[a][k] = box.lo[a], c.hi[a][k] = box.hi[a];
        c.instance[k] = uint32_t(i);
    }
}

} // namespace

Bounds3f Cluster::bounds() const {
    Bounds3f b;
    for (int a = 0; a < 3; a++) {
        b.lo[a] = *std::min_element(lo[a], lo[a] + Size);
        b.hi[a] = *std::max_element(hi[a], hi[a] + Size);
    }
    return b;
}

uint32_t Cluster::meet(const RTCRay& ray, float entry[Size]) const {
    using F = Float<Size>;
    // Widened as Embree's robust traversal does: three units in the last place.
    constexpr float Ulp = 0x1p-23f, Nearer = 1 - 3 * Ulp, Further = 1 + 3 * Ulp, Least = 1e-18f;
    const auto limited = [](float d) { return std::abs(d) < Least ? std::copysign(Least, d) : d; };
    const F slopes = F(1.0f) / F(F::F{limited(ray.dir_x), limited(ray.dir_y), limited(ray.dir_z), 1});
    const float* origin = &ray.org_x;
    F enter(ray.tnear), leave(ray.tfar);
    for (int a = 0; a < 3; a++) {
        const bool backwards = slopes[a] < 0;
        const F o(origin[a]), slope(slopes[a]);
        enter = max(enter, (F::load(backwards ? hi[a] : lo[a]) - o) * (slope * F(Nearer)));
        leave = min(leave, (F::load(backwards ? lo[a] : hi[a]) - o) * (slope * F(Further)));
    }
    enter.store(entry);
    return uint32_t(_mm_movemask_ps(__m128((enter <= leave).v)));
}

LargeVector<Cluster> cluster_instances(std::span<const float> transforms, const Bounds3f& child) {
    const std::vector<uint64_t> order = along_curve(transforms, child);
    const auto run = [&](size_t begin, size_t end) { return std::span(order).subspan(begin, end - begin); };
    std::vector<std::vector<uint8_t>> sizes((order.size() + Chunk - 1) / Chunk);
    tasks::parallel_chunks(order.size(), Chunk, [&](size_t begin, size_t end) {
        sizes[begin / Chunk] = cut(run(begin, end), transforms, child);
    });
    std::vector<size_t> first{0}; // cluster of each chunk
    for (const auto& chunk : sizes)
        first.push_back(first.back() + chunk.size());
    LargeVector<Cluster> all(first.back());
    tasks::parallel_chunks(order.size(), Chunk, [&](size_t begin, size_t) {
        Cluster* cluster = all.data() + first[begin / Chunk];
        for (const uint8_t size : sizes[begin / Chunk]) {
            fill(*cluster++, run(begin, begin + size), transforms, child);
            begin += size;
        }
    });
    return all;
}

} // namespace kanuka::bvh
