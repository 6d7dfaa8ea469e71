#include "bvh/watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <thread>

#include "base/error.h"
#include "bvh/embree_scene.h"

namespace kanuka::bvh {

namespace {

// Where a ray enters a box; false = it misses it. The ways are widened a little: what grazes a box meets it.
bool enters(const Bounds3f& b, const float* o, const float* d, float t_min, float t_max, float& t) {
    float from = t_min, to = t_max;
    for (int c = 0; c < 3; c++) {
        const float inverse = 1 / d[c];
        float a = (b.lo[c] - o[c]) * inverse, z = (b.hi[c] - o[c]) * inverse;
        if (inverse < 0)
            std::swap(a, z);
        if (!(a == a) || !(z == z)) { // along a face: in the slab or not
            if (o[c] < b.lo[c] || o[c] > b.hi[c])
                return false;
            continue;
        }
        z *= 1 + 4e-7f; // Ize 2013
        from = a > from ? a : from;
        to = z < to ? z : to;
        if (from > to)
            return false;
    }
    t = from;
    return true;
}

// Counts by thread, each its own: a table of claims that never collide.
class ThreadCounts {
  public:
    std::atomic<uint64_t>& mine() {
        const std::thread::id id = std::this_thread::get_id();
        const size_t start = std::hash<std::thread::id>{}(id) % m_slots.size();
        for (size_t k = 0; k < m_slots.size(); k++) {
            Slot& slot = m_slots[(start + k) % m_slots.size()];
            std::thread::id owner = slot.owner.load();
            if (owner == std::thread::id() && slot.owner.compare_exchange_strong(owner, id))
                return slot.count;
            if (owner == id)
                return slot.count;
        }
        return m_slots[start].count; // more than a thousand threads: work is done twice, no harm
    }

  private:
    struct alignas(64) Slot {
        std::atomic<std::thread::id> owner{};
        std::atomic<uint64_t> count{0};
    };
    std::array<Slot, 1024> m_slots;
};

} // namespace

struct Watch::Impl {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::vector<Bounds3f> boxes;
    std::vector<std::atomic<uint8_t>> noted;
    mutable ThreadCounts counts;
};

// Travels with a ray: it wants the nearest box that it enters behind `after`.
struct Watch::Query {
    RTCIntersectContext embree; // first member
    const Watch* watch;
    float t_min, after;
    uint32_t found;
    bool inside; // found boxes that it starts in, which are noted at once

    void note(uint32_t box) {
        watch->m_impl->noted[box].store(1, std::memory_order_relaxed);
        watch->m_impl->counts.mine().fetch_add(1, std::memory_order_relaxed);
    }
};

struct WatchCallbacks {
    static void bounds(const RTCBoundsFunctionArguments* args) {
        const Bounds3f& b = static_cast<const Watch::Impl*>(args->geometryUserPtr)->boxes[args->primID];
        *args->bounds_o = {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, 0};
    }
    static void intersect(const RTCIntersectFunctionNArguments* args) {
        if (args->N != 1 || !args->valid[0])
            return;
        auto& query = *reinterpret_cast<Watch::Query*>(args->context);
        if (query.watch->m_out[args->primID])
            return;
        auto& rh = *reinterpret_cast<RTCRayHit*>(args->rayhit);
        const float o[3] = {rh.ray.org_x, rh.ray.org_y, rh.ray.org_z},
                    d[3] = {rh.ray.dir_x, rh.ray.dir_y, rh.ray.dir_z};
        float t;
        if (!enters(query.watch->m_impl->boxes[args->primID], o, d, query.t_min, rh.ray.tfar, t) ||
            t <= query.after)
            return;
        if (t <= query.t_min) {
            query.note(args->primID);
            query.inside = true;
            return;
        }
        rh.ray.tfar = t;
        rh.hit.geomID = args->geomID;
        rh.hit.primID = args->primID;
        query.found = args->primID;
    }
};

Watch::Watch(std::span<const Bounds3f> boxes) : m_impl(std::make_unique<Impl>()), m_out(boxes.size()) {
    static_assert(offsetof(Query, embree) == 0);
    m_impl->boxes.assign(boxes.begin(), boxes.end());
    m_impl->noted = std::vector<std::atomic<uint8_t>>(boxes.size());
    for (size_t i = 0; i < boxes.size(); i++) {
        Bounds3f& b = m_impl->boxes[i];
        bool good = !b.empty();
        for (int c = 0; c < 3; c++)
            good &= std::abs(b.lo[c]) < LargestCoordinate && std::abs(b.hi[c]) < LargestCoordinate;
        if (!good) { // everywhere: the first ray meets it
            const float far = 0.1f * LargestCoordinate;
            b = {};
            b.extend(Vec3f(-far, -far, -far));
            b.extend(Vec3f(far, far, far));
        }
    }
    m_impl->device = rtcNewDevice(EmbreeSettings);
    if (!m_impl->device)
        throw Error("Embree could not start", ExitCode::Internal);
    m_impl->scene = rtcNewScene(m_impl->device);
    RTCGeometry geometry = rtcNewGeometry(m_impl->device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, unsigned(boxes.size()));
    rtcSetGeometryUserData(geometry, m_impl.get());
    rtcSetGeometryBoundsFunction(geometry, WatchCallbacks::bounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry, WatchCallbacks::intersect);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(m_impl->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(m_impl->scene);
}

Watch::~Watch() {
    rtcReleaseScene(m_impl->scene);
    rtcReleaseDevice(m_impl->device);
}

void Watch::look(const Vec3f& o, const Vec3f& d, float t_min, float t_max) const {
    Query query;
    rtcInitIntersectContext(&query.embree);
    query.watch = this;
    query.t_min = t_min;
    query.after = -std::numeric_limits<float>::infinity();
    for (int k = 0; k < m_reach; k++) {
        RTCRayHit rh;
        rh.ray = {o.x, o.y, o.z, t_min, d.x, d.y, d.z, 0, t_max, unsigned(-1), 0, 0};
        rh.hit.geomID = rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        query.inside = false;
        rtcIntersect1(m_impl->scene, &query.embree, &rh);
        const bool found = rh.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        if (found && !(query.inside && k == 0 && m_reach == 1))
            query.note(query.found);
        if (!found)
            break;
        query.after = rh.ray.tfar;
    }
}

std::vector<uint32_t> Watch::take() {
    std::vector<uint32_t> all;
    for (size_t i = 0; i < m_impl->noted.size(); i++)
        if (m_impl->noted[i].exchange(0, std::memory_order_relaxed))
            all.push_back(uint32_t(i));
    return all;
}

uint64_t Watch::noted_here() const {
    return m_impl->counts.mine().load(std::memory_order_relaxed);
}

} // namespace kanuka::bvh
