// A forest of instances of one page beside Embree's instances of the same grid: bytes and time of the level
// above, and of rays.
//
//     instance_bench [--instances=N] [--rays=N] [--rounds=N] [--json]
//
// Both build with two threads and trace with one, whose time counts. Rounds go through all tracers in turn;
// figures are medians. Embree's instances are RTC_GEOMETRY_TYPE_INSTANCE, each a geometry of its own: what it
// has for places of their own.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <embree3/rtcore.h>
#include <oneapi/tbb/global_control.h>
#include <vector>

#include "hierarchy/queue.h"
#include "hierarchy/test_oracle.h"
#include "timing.h"

using namespace kanuka;
using namespace kanuka::hierarchy;
using namespace kanuka::hierarchy::testing;

namespace {

std::vector<Placement> forest(size_t count, uint32_t page) {
    Random random(1);
    const size_t side = size_t(std::ceil(std::sqrt(double(count))));
    std::vector<Placement> all(count);
    for (size_t i = 0; i < count; i++) {
        const double x = (double(i % side) + double(random.uniform()) - double(side) / 2) * 2.5,
                     z = (double(i / side) + double(random.uniform()) - double(side) / 2) * 2.5;
        const double size = double(random.uniform(0.6f, 1.4f));
        all[i] = {Transform::translate(x, size * 1.3, z) *
                      Transform::rotate(double(random.uniform(0, 360)), 0, 1, 0) *
                      Transform::scale(size, size * 1.6, size),
                  page};
    }
    return all;
}

class Embree {
  public:
    Embree(const std::vector<TestGrid>& grids, const Lattice& lattice, const std::vector<Placement>& places) {
        rtcSetDeviceMemoryMonitorFunction(
            m_device, [](void* user, ssize_t n, bool) { return *static_cast<int64_t*>(user) += n, true; },
            &m_bytes);
        for (const TestGrid& g : grids) {
            const uint32_t first = uint32_t(m_positions.size() / 3), row = uint32_t(g.columns + 1);
            m_grids.push_back({first, row, uint16_t(row), uint16_t(g.rows + 1)});
            for (size_t i = 0; i < g.positions.size(); i += 3) {
                const Vec3f p = lattice.snap({g.positions[i], g.positions[i + 1], g.positions[i + 2]});
                m_positions.insert(m_positions.end(), {p.x, p.y, p.z});
            }
        }
        const size_t vertices = m_positions.size() / 3;
        m_positions.resize(m_positions.size() + 4);
        RTCScene tree = rtcNewScene(m_device);
        rtcSetSceneFlags(tree, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry g = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_GRID);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, m_positions.data(), 0, 12,
                                   vertices);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, m_grids.data(), 0,
                                   sizeof(RTCGrid), m_grids.size());
        attach(tree, g);
        rtcCommitScene(tree);
        const int64_t before = m_bytes;
        const double start = seconds(CLOCK_MONOTONIC);
        m_scene = rtcNewScene(m_device);
        rtcSetSceneFlags(m_scene, RTC_SCENE_FLAG_ROBUST);
        for (const Placement& p : places) {
            RTCGeometry i = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_INSTANCE);
            rtcSetGeometryInstancedScene(i, tree);
            float m[12];
            for (size_t c = 0; c < 4; c++)
                for (size_t r = 0; r < 3; r++)
                    m[3 * c + r] = float(p.world_from_page.m[r][c]);
            rtcSetGeometryTransform(i, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, m);
            attach(m_scene, i);
        }
        const double placed = seconds(CLOCK_MONOTONIC);
        rtcCommitScene(m_scene);
        bytes_each = double(m_bytes - before) / double(places.size());
        place_s = placed - start, build_s = seconds(CLOCK_MONOTONIC) - placed;
    }
    double bytes_each = 0, place_s = 0, build_s = 0; // of the instances
    void trace(const std::vector<Ray>& rays, std::vector<float>& t) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        for (size_t i = 0; i < rays.size(); i++) {
            const Ray& r = rays[i];
            RTCRayHit e{};
            e.ray.org_x = r.o.x, e.ray.org_y = r.o.y, e.ray.org_z = r.o.z, e.ray.tnear = r.t_min;
            e.ray.dir_x = r.d.x, e.ray.dir_y = r.d.y, e.ray.dir_z = r.d.z, e.ray.tfar = r.t_max;
            e.ray.mask = ~0u, e.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(m_scene, &context, &e);
            t[i] = e.hit.geomID == RTC_INVALID_GEOMETRY_ID ? INFINITY : e.ray.tfar;
        }
    }

  private:
    static void attach(RTCScene scene, RTCGeometry g) {
        rtcCommitGeometry(g);
        rtcAttachGeometry(scene, g);
        rtcReleaseGeometry(g);
    }
    RTCDevice m_device = rtcNewDevice("threads=2");
    RTCScene m_scene = nullptr;
    int64_t m_bytes = 0;
    std::vector<float> m_positions;
    std::vector<RTCGrid> m_grids;
};

std::vector<Ray> camera_rays(size_t count, double side) {
    const int width = int(std::sqrt(double(count)));
    std::vector<Ray> rays;
    for (int y = 0; y < width; y++)
        for (int x = 0; x < width; x++)
            rays.push_back({{0, 12, float(-0.3 * side)},
                            0,
                            normalize(Vec3f((float(x) / float(width) - 0.5f) * 1.4f,
                                            -0.15f - 0.5f * float(y) / float(width), 1))});
    return rays;
}
// From where those hit, anywhere.
std::vector<Ray> bounce_rays(const std::vector<Ray>& rays, const std::vector<InstanceHit>& hits) {
    Random random(2);
    std::vector<Ray> out;
    for (size_t i = 0; i < rays.size(); i++)
        if (hits[i].hit.found())
            out.push_back({rays[i].o + rays[i].d * (hits[i].hit.t * 0.9999f), 1e-3f, random.direction()});
    return out;
}

} // namespace

int main(int argc, char** argv) {
    size_t instances = 1000000, count = 262144;
    int rounds = 5;
    bool json = false;
    for (int i = 1; i < argc; i++) {
        const auto value = [&](const char* name) {
            const size_t n = std::strlen(name);
            return std::strncmp(argv[i], name, n) == 0 ? argv[i] + n : nullptr;
        };
        if (const char* v = value("--instances="))
            instances = size_t(std::atol(v));
        else if (const char* v = value("--rays="))
            count = size_t(std::atol(v));
        else if (const char* v = value("--rounds="))
            rounds = std::max(1, std::atoi(v));
        else if (std::strcmp(argv[i], "--json") == 0)
            json = true;
    }
    const oneapi::tbb::global_control two(oneapi::tbb::global_control::max_allowed_parallelism, 2);
    const std::vector<TestGrid> grids = ball(2, 16, 1, 0.25f, 4);
    const std::vector<GridView> all = views(grids);
    const Content content{all, {}};
    const Lattice lattice = votes_of(content).lattice();
    const PageMemory tree = build(content, lattice);
    const std::vector<Placement> places = forest(instances, 0);
    std::vector<float> matrices(12 * instances); // as a scene has them
    for (size_t k = 0; k < matrices.size(); k++)
        matrices[k] = float(places[k / 12].world_from_page.m[k % 12 / 4][k % 4]);
    Placements all_places{0};
    all_places.world_from_page = Places(matrices);
    std::vector<double> built, cpu;
    World world;
    uint32_t root = 0;
    for (int round = 0; round < rounds; round++) {
        world = World();
        world.add(tree.page());
        const double start = seconds(CLOCK_MONOTONIC), cpu_start = seconds(CLOCK_PROCESS_CPUTIME_ID);
        root = world.add(std::span(&all_places, 1));
        built.push_back(seconds(CLOCK_MONOTONIC) - start);
        cpu.push_back(seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu_start);
    }
    const Embree embree(grids, lattice, places);
    const double bytes_each = double(world.level_bytes()) / double(instances);
    if (json)
        std::printf("{\"instances\": %zu, \"bytes_each\": %.2f, \"build_s\": %.4f, \"build_cpu_s\": %.4f, "
                    "\"embree_bytes_each\": %.2f, "
                    "\"embree_place_s\": %.4f, \"embree_build_s\": %.4f}\n",
                    instances, bytes_each, median(built), median(cpu), embree.bytes_each, embree.place_s,
                    embree.build_s);
    else
        std::printf(
            "%zu instances of %zu bytes\n%-16s %6.1f bytes an instance, transform included; %.3f s to "
            "build\n%-16s %6.1f bytes an instance, %.3f s to place, %.3f s to build\n",
            instances, tree.size(), "pages", bytes_each, median(built), "Embree robust", embree.bytes_each,
            embree.place_s, embree.build_s);

    const double side = std::sqrt(double(instances)) * 2.5;
    EverythingIsThere everything;
    std::vector<Ray> rays = camera_rays(count, side);
    std::vector<InstanceHit> hits(rays.size());
    for (const char* name : {"camera", "bounce 1", "bounce 2"}) {
        if (std::strcmp(name, "camera") != 0)
            rays = bounce_rays(rays, hits), hits.resize(rays.size());
        std::vector<float> t(rays.size());
        std::vector<double> ours, theirs;
        for (int round = 0; round < rounds; round++) {
            const double start = seconds(CLOCK_THREAD_CPUTIME_ID);
            find_closest<8>(world, root, rays, hits, everything);
            const double then = seconds(CLOCK_THREAD_CPUTIME_ID);
            embree.trace(rays, t);
            ours.push_back((then - start) * 1e9 / double(rays.size()));
            theirs.push_back((seconds(CLOCK_THREAD_CPUTIME_ID) - then) * 1e9 / double(rays.size()));
        }
        size_t found = 0, differ = 0;
        for (size_t i = 0; i < rays.size(); i++) {
            found += hits[i].hit.found();
            differ += hits[i].hit.found() != std::isfinite(t[i]) ||
                      (std::isfinite(t[i]) && std::abs(hits[i].hit.t - t[i]) > 1e-3f * (1 + t[i]));
        }
        if (json) {
            std::printf("{\"rays\": \"%s\", \"count\": %zu, \"differ\": %zu", name, rays.size(), differ);
            for (const auto& [tracer, ns] : {std::pair("pages", &ours), std::pair("embree", &theirs)}) {
                std::printf(", \"%s_ns\": [", tracer);
                for (size_t k = 0; k < ns->size(); k++)
                    std::printf("%s%.2f", k == 0 ? "" : ", ", (*ns)[k]);
                std::printf("]");
            }
            std::printf("}\n");
            continue;
        }
        std::printf("%-9s %8zu rays, %8zu hit, %5zu differ: pages %7.1f ns, Embree %7.1f ns, ratio %.2f\n",
                    name, rays.size(), found, differ, median(ours), median(theirs),
                    median(ours) / median(theirs));
    }
}
