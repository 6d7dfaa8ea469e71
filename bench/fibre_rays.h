// Rays at tangles of fibres, by pages and by Embree's round linear curves on the same vertices, for
// ray_bench. Where the two differ, segments in doubles say who is right.
#pragma once

#include <embree3/rtcore.h>

#include "hierarchy/queue.h"
#include "hierarchy/test_fibres.h"

namespace kanuka::hierarchy::bench {

class FibreRays {
  public:
    explicit FibreRays(uint32_t seed) : m_fibres(testing::tangle(seed, Hairs)), m_traced(m_fibres) {
        for (const Segment& s : m_traced.segments) { // as the lattice has them
            m_first.push_back(uint32_t(m_vertices.size() / 4));
            for (int e = 0; e < 2; e++)
                m_vertices.insert(m_vertices.end(), {s.end[e].x, s.end[e].y, s.end[e].z, s.radius[e]});
        }
        m_scene = rtcNewScene(m_device);
        rtcSetSceneFlags(m_scene, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry g = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, m_vertices.data(), 0, 16,
                                   m_vertices.size() / 4);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, m_first.data(), 0, 4,
                                   m_first.size());
        rtcCommitGeometry(g);
        rtcAttachGeometry(m_scene, g);
        rtcReleaseGeometry(g);
        rtcCommitScene(m_scene);
    }
    ~FibreRays() {
        rtcReleaseScene(m_scene);
        rtcReleaseDevice(m_device);
    }
    FibreRays(const FibreRays&) = delete;

    size_t segments() const { return m_traced.segments.size(); }

    // Aims: anywhere, at ends of segments, along them.
    Ray ray(testing::Random& random, int aim) const {
        const Segment& s = m_traced.segments[random.below(uint32_t(m_traced.segments.size()))];
        const Vec3f o = random.in_box(2), near = random.in_box(2 * s.radius[0]);
        if (aim == 0)
            return {o, 0, random.in_box(1) - o};
        return {o, 0, s.end[0] + (s.end[1] - s.end[0]) * (aim == 1 ? 0.0f : random.uniform()) + near - o};
    }

    struct Counts {
        uint64_t rays = 0, found = 0, differ = 0, ours_right = 0, embree_right = 0, tie = 0, neither = 0,
                 any_differs = 0;
    };
    void trace(std::span<const Ray> rays, Counts& counts) const {
        EverythingIsThere all;
        std::vector<Hit> hits(rays.size());
        std::vector<uint8_t> any(rays.size());
        find_closest<8>(m_traced.page(), rays, hits, all);
        find_any<8>(m_traced.page(), rays, any, all);
        for (size_t i = 0; i < rays.size(); i++) {
            const float theirs = embree(rays[i]),
                        ours = hits[i].found() ? hits[i].t : std::numeric_limits<float>::infinity();
            counts.rays++;
            counts.found += hits[i].found();
            counts.any_differs += any[i] != hits[i].found();
            if (std::isfinite(ours) == std::isfinite(theirs) &&
                (!std::isfinite(ours) || std::abs(ours - theirs) <= 4e-6f * (1 + ours)))
                continue;
            const Borders borders(m_traced.segments, rays[i]);
            const bool we = borders.allow(double(ours)), they = borders.allow(double(theirs));
            counts.differ++;
            (we ? they ? counts.tie : counts.ours_right : they ? counts.embree_right : counts.neither)++;
        }
    }

  private:
    static constexpr int Hairs = 400;

    // What rounding allows of a hit: each segment as much thicker and thinner as a ray may be off, by 16 eps
    // of the largest distance of its ends.
    class Borders {
      public:
        Borders(const std::vector<Segment>& segments, const Ray& ray) {
            for (const Segment& s : segments) {
                double largest = 0;
                for (int e = 0; e < 2; e++)
                    for (int a = 0; a < 3; a++)
                        largest = std::max(largest, double(std::abs(s.end[e][a] - ray.o[a])));
                const double off = 16 * 0x1p-24 * largest;
                const auto span = [&](double more) {
                    Segment t = s;
                    for (float& r : t.radius)
                        r = float(std::max(0.0, double(r) + more));
                    return testing::span_of(t, ray);
                };
                const testing::Span wide = span(off + 1e-7 * double(s.radius[0] + s.radius[1])),
                                    thin = span(-off - 1e-7 * double(s.radius[0] + s.radius[1]));
                if (wide.empty() || wide.leave < 0)
                    continue;
                const double late = 1e-6 * (1 + std::abs(wide.enter));
                if (wide.enter >= 0 || thin.empty() || thin.enter >= 0)
                    m_allowed.push_back({wide.enter - late, (thin.empty() ? wide.leave : thin.enter) + late});
                if (wide.enter < late)
                    m_allowed.push_back({(thin.empty() ? wide.enter : thin.leave) - late, wide.leave + late});
                if (!thin.empty() && thin.leave >= 0)
                    m_last = std::min(m_last, (thin.enter >= 0 ? thin.enter : wide.leave) + late);
            }
        }
        bool allow(double t) const {
            if (!std::isfinite(t))
                return !std::isfinite(m_last);
            return t <= m_last && std::ranges::any_of(m_allowed, [t](const auto& in) {
                       return t >= in.first && t <= in.second;
                   });
        }

      private:
        std::vector<std::pair<double, double>> m_allowed;
        double m_last = INFINITY; // something is hit for certain by then
    };

    float embree(const Ray& r) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit e{};
        e.ray.org_x = r.o.x, e.ray.org_y = r.o.y, e.ray.org_z = r.o.z;
        e.ray.dir_x = r.d.x, e.ray.dir_y = r.d.y, e.ray.dir_z = r.d.z;
        e.ray.tfar = INFINITY, e.ray.mask = ~0u;
        e.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(m_scene, &context, &e);
        return e.hit.geomID == RTC_INVALID_GEOMETRY_ID ? INFINITY : e.ray.tfar;
    }

    testing::Fibres m_fibres;
    testing::TracedFibres m_traced;
    std::vector<float> m_vertices;
    std::vector<uint32_t> m_first;
    RTCDevice m_device = rtcNewDevice("threads=1");
    RTCScene m_scene = nullptr;
};

} // namespace kanuka::hierarchy::bench
