// A closed surface in Embree, robust, for ray_bench.
#pragma once

#include <embree3/rtcore.h>

#include "closed_surfaces.h"

namespace kanuka::hierarchy::bench {

class Embree {
  public:
    ~Embree() {
        rtcReleaseScene(m_scene);
        rtcReleaseScene(m_inner);
        rtcReleaseDevice(m_device);
    }
    Embree(const Embree&) = delete;
    // Vertices stand on the lattice already.
    explicit Embree(const ClosedSurface& s) {
        for (size_t step = 0; step <= s.later.size(); step++)
            for (const TestGrid& g : s.step(step)) {
                const uint32_t first = uint32_t(m_positions.size() / 3), row = uint32_t(g.columns + 1);
                if (step == 0)
                    m_grids.push_back({first, row, uint16_t(row), uint16_t(g.rows + 1)});
                m_positions.insert(m_positions.end(), g.positions.begin(), g.positions.end());
            }
        for (uint32_t c : s.corners)
            m_corners.push_back(uint32_t(m_positions.size() / 3) + c);
        m_positions.insert(m_positions.end(), s.positions.begin(), s.positions.end());
        m_steps = unsigned(s.later.size()) + 1;
        const size_t vertices = m_positions.size() / 3 / m_steps;
        m_positions.resize(m_positions.size() + 4);
        m_inner = robust_scene();
        if (!m_grids.empty())
            add(RTC_GEOMETRY_TYPE_GRID, RTC_FORMAT_GRID, RTC_BUFFER_TYPE_GRID, m_grids.data(),
                sizeof(RTCGrid), m_grids.size(), vertices);
        if (!m_corners.empty())
            add(RTC_GEOMETRY_TYPE_TRIANGLE, RTC_FORMAT_UINT3, RTC_BUFFER_TYPE_INDEX, m_corners.data(), 12,
                m_corners.size() / 3, vertices);
        rtcCommitScene(m_inner);
        m_scene = s.places.empty() ? m_inner : robust_scene();
        const unsigned steps = s.paths.empty() ? 1 : 2;
        for (size_t i = 0; i < s.places.size(); i++) {
            RTCGeometry g = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_INSTANCE);
            rtcSetGeometryInstancedScene(g, m_inner);
            rtcSetGeometryTimeStepCount(g, steps);
            for (unsigned step = 0; step < steps; step++) {
                const Transform place = s.place(i, float(step));
                float m[12];
                for (size_t c = 0; c < 4; c++)
                    for (size_t r = 0; r < 3; r++)
                        m[3 * c + r] = float(place.m[r][c]);
                rtcSetGeometryTransform(g, step, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, m);
            }
            attach(m_scene, g);
        }
        if (s.places.empty())
            rtcRetainScene(m_scene);
        else
            rtcCommitScene(m_scene);
    }
    // Infinite where nothing is hit; `instance`: which, or -1.
    float trace(const Ray& r, float time, uint32_t& instance) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit e{};
        e.ray.org_x = r.o.x, e.ray.org_y = r.o.y, e.ray.org_z = r.o.z;
        e.ray.dir_x = r.d.x, e.ray.dir_y = r.d.y, e.ray.dir_z = r.d.z;
        e.ray.tfar = INFINITY, e.ray.mask = ~0u, e.ray.time = time;
        e.hit.geomID = e.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(m_scene, &context, &e);
        instance = e.hit.instID[0];
        return e.hit.geomID == RTC_INVALID_GEOMETRY_ID ? INFINITY : e.ray.tfar;
    }

  private:
    RTCScene robust_scene() {
        RTCScene scene = rtcNewScene(m_device);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        return scene;
    }
    void add(RTCGeometryType type, RTCFormat format, RTCBufferType buffer, const void* items, size_t bytes,
             size_t count, size_t vertices) {
        RTCGeometry g = rtcNewGeometry(m_device, type);
        rtcSetGeometryTimeStepCount(g, m_steps);
        for (unsigned step = 0; step < m_steps; step++)
            rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3, m_positions.data(),
                                       step * vertices * 12, 12, vertices);
        rtcSetSharedGeometryBuffer(g, buffer, 0, format, items, 0, bytes, count);
        attach(m_inner, g);
    }
    static void attach(RTCScene scene, RTCGeometry g) {
        rtcCommitGeometry(g);
        rtcAttachGeometry(scene, g);
        rtcReleaseGeometry(g);
    }
    RTCDevice m_device = rtcNewDevice("threads=1");
    RTCScene m_inner = nullptr, m_scene = nullptr;
    std::vector<float> m_positions;
    std::vector<RTCGrid> m_grids;
    std::vector<uint32_t> m_corners;
    unsigned m_steps = 1; // of what changes
};

} // namespace kanuka::hierarchy::bench
