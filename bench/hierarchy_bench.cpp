// Pages of src/hierarchy beside Embree on the same vertices.
//
//     hierarchy_bench [--scene=terrain|cave|globe|mesh|hair] [--size=N] [--rounds=N] [--rays=N] [--json]
//
// Nanoseconds a ray of one thread (its processor time; medians of rounds, in which all take turns), bytes a
// primitive and milliseconds to build. Rays that surfaces let out: ray_bench.cpp.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <embree3/rtcore.h>
#include <functional>
#include <string>
#include <time.h>
#include <vector>

#include "hierarchy_scenes.h"

#include "base/cpu.h"
#include "hierarchy/decode.h"
#include "hierarchy/queue.h"
#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"

using namespace kanuka;
using namespace kanuka::hierarchy;
using kanuka::hierarchy::testing::Random;
using kanuka::hierarchy::testing::TestGrid;
using namespace kanuka::hierarchy::bench;

namespace {

struct Options {
    std::string scene = "terrain";
    int size = 0, rounds = 5, rays = 256 * 256;
    bool json = false; // a line for each tracer, and for each tracer and kind of ray
};

double wall_ms() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}
double thread_ns() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) * 1e9 + double(t.tv_nsec);
}
double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

// ---- Embree
struct Peer {
    std::string name;
    RTCScene scene;
    double ms = 0;
    int64_t bytes = 0;
};

struct Embree {
    RTCDevice device = rtcNewDevice("threads=2");
    int64_t bytes = 0;
    Embree() {
        rtcSetDeviceMemoryMonitorFunction(
            device, [](void* user, ssize_t n, bool) { return *static_cast<int64_t*>(user) += n, true; },
            &bytes);
    }
};

// Vertices as they stand on the lattice.
struct Vertices {
    std::vector<float> positions, fibres; // of fibres with the radius
    std::vector<RTCGrid> grids;
    std::vector<uint32_t> quads, triangles, segments;

    Vertices(const BenchScene& s, const Lattices& lattices) : segments(s.segments) {
        const Lattice& lattice = lattices.grids;
        for (size_t i = 0; i < s.fibres.size(); i += 4) {
            const float* const v = s.fibres.data() + i;
            const Vec3f p = lattices.fibres.places.snap({v[0], v[1], v[2]});
            fibres.insert(fibres.end(), {p.x, p.y, p.z, lattices.fibres.radius(lattices.fibres.word(v[3]))});
        }
        const auto add = [&](const Vec3f& p) {
            const Vec3f q = lattice.snap(p);
            positions.insert(positions.end(), {q.x, q.y, q.z});
        };
        for (const TestGrid& g : s.grids) {
            const uint32_t first = uint32_t(positions.size() / 3), row = uint32_t(g.columns + 1);
            grids.push_back({first, row, uint16_t(row), uint16_t(g.rows + 1)});
            for (size_t i = 0; i < g.positions.size(); i += 3)
                add({g.positions[i], g.positions[i + 1], g.positions[i + 2]});
            for (uint32_t y = 0; y < uint32_t(g.rows); y++)
                for (uint32_t x = 0; x < uint32_t(g.columns); x++) {
                    const uint32_t a = first + y * row + x;
                    quads.insert(quads.end(), {a, a + 1, a + row + 1, a + row});
                }
        }
        const uint32_t first = uint32_t(positions.size() / 3);
        for (size_t i = 0; i < s.positions.size(); i += 3)
            add({s.positions[i], s.positions[i + 1], s.positions[i + 2]});
        for (uint32_t c : s.corners)
            triangles.push_back(first + c);
        positions.resize(positions.size() + 4);
    }
};

Peer embree(Embree& e, const Vertices& v, RTCGeometryType type, bool robust) {
    Peer p;
    p.name = std::string("Embree ") +
             (type == RTC_GEOMETRY_TYPE_GRID       ? "GRID"
              : type == RTC_GEOMETRY_TYPE_QUAD     ? "QUAD"
              : type == RTC_GEOMETRY_TYPE_TRIANGLE ? "TRIANGLE"
                                                   : "ROUND_LINEAR_CURVE") +
             (robust ? " robust" : "");
    const int64_t before = e.bytes;
    const double start = wall_ms();
    p.scene = rtcNewScene(e.device);
    rtcSetSceneFlags(p.scene, RTCSceneFlags((robust ? RTC_SCENE_FLAG_ROBUST : 0) |
                                            (type == RTC_GEOMETRY_TYPE_GRID ? RTC_SCENE_FLAG_COMPACT : 0)));
    RTCGeometry g = rtcNewGeometry(e.device, type);
    const bool fibres = type == RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE;
    if (fibres)
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, v.fibres.data(), 0, 16,
                                   v.fibres.size() / 4);
    else
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, v.positions.data(), 0, 12,
                                   v.positions.size() / 3 - 1);
    if (type == RTC_GEOMETRY_TYPE_GRID)
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, v.grids.data(), 0,
                                   sizeof(RTCGrid), v.grids.size());
    else if (type == RTC_GEOMETRY_TYPE_QUAD)
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, v.quads.data(), 0, 16,
                                   v.quads.size() / 4);
    else if (fibres)
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, v.segments.data(), 0, 4,
                                   v.segments.size());
    else
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, v.triangles.data(), 0, 12,
                                   v.triangles.size() / 3);
    rtcCommitGeometry(g);
    rtcAttachGeometry(p.scene, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(p.scene);
    p.ms = wall_ms() - start;
    p.bytes = e.bytes - before;
    return p;
}

RTCRay to_embree(const Ray& r) {
    RTCRay e{};
    e.org_x = r.o.x, e.org_y = r.o.y, e.org_z = r.o.z, e.tnear = r.t_min;
    e.dir_x = r.d.x, e.dir_y = r.d.y, e.dir_z = r.d.z, e.tfar = r.t_max;
    e.mask = ~0u;
    return e;
}

size_t trace_peer(RTCScene scene, const std::vector<Ray>& rays, bool any) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    size_t hits = 0;
    for (const Ray& r : rays)
        if (any) {
            RTCRay e = to_embree(r);
            rtcOccluded1(scene, &context, &e);
            hits += e.tfar < 0;
        } else {
            RTCRayHit e{to_embree(r), {}};
            e.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(scene, &context, &e);
            hits += e.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
    return hits;
}

size_t trace_peer_packets(RTCScene scene, const std::vector<Ray>& rays, bool any) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    size_t hits = 0;
    alignas(32) const int valid[8] = {-1, -1, -1, -1, -1, -1, -1, -1};
    for (size_t i = 0; i + 8 <= rays.size(); i += 8) {
        alignas(32) RTCRayHit8 e{};
        for (int k = 0; k < 8; k++) {
            const Ray& r = rays[i + size_t(k)];
            e.ray.org_x[k] = r.o.x, e.ray.org_y[k] = r.o.y, e.ray.org_z[k] = r.o.z, e.ray.tnear[k] = r.t_min;
            e.ray.dir_x[k] = r.d.x, e.ray.dir_y[k] = r.d.y, e.ray.dir_z[k] = r.d.z, e.ray.tfar[k] = r.t_max;
            e.ray.mask[k] = ~0u, e.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        }
        if (any)
            rtcOccluded8(valid, scene, &context, &e.ray);
        else
            rtcIntersect8(valid, scene, &context, &e);
        for (int k = 0; k < 8; k++)
            hits += any ? e.ray.tfar[k] < 0 : e.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
    }
    return hits;
}

// ---- rays
struct RaySet {
    const char* name;
    bool any, coherent;
    std::vector<Ray> rays;
};

std::vector<RaySet> make_rays(const BenchScene& s, const Page& page, int count) {
    std::vector<RaySet> sets{{"camera", false, true, {}},
                             {"bounce 1", false, false, {}},
                             {"bounce 2", false, false, {}},
                             {"shadow", true, false, {}},
                             {"camera's shadow", true, true, {}}};
    Random random(1);
    const Vec3f f = normalize(s.at - s.eye), x = normalize(cross(f, Vec3f(0, 1, 0))), y = cross(x, f);
    const int side = std::max(4, int(std::sqrt(double(count))) / 4 * 4);
    for (int tile = 0; tile < side * side / 16; tile++)
        for (int k = 0; k < 16; k++) { // 4x4 pixels: packets are coherent
            const int px = tile % (side / 4) * 4 + k % 4, py = tile / (side / 4) * 4 + k / 4;
            const float u = (float(px) + random.uniform()) / float(side) * 2 - 1,
                        v = (float(py) + random.uniform()) / float(side) * 2 - 1;
            sets[0].rays.push_back({s.eye, 0, normalize(f + x * (0.6f * u) + y * (0.6f * v))});
        }
    for (int level = 0; level < 2; level++) {
        const std::vector<Ray>& rays = sets[size_t(level)].rays;
        std::vector<Hit> hits(rays.size());
        closest(page, rays, hits);
        for (size_t i = 0; i < rays.size(); i++) {
            if (!hits[i].found())
                continue;
            Vec3f n = normalize(normal_of(page, rays[i], hits[i]));
            if (dot(n, rays[i].d) > 0)
                n = -n;
            const Vec3f p = rays[i].o + rays[i].d * hits[i].t + n * s.offset;
            Vec3f w = random.direction();
            w = normalize(w + n * 1.0001f); // as the cosine
            sets[size_t(level) + 1].rays.push_back({p, 0, w});
            const Vec3f to = s.light + s.light_u * random.uniform() + s.light_v * random.uniform() - p;
            if (dot(to, n) > 0)
                sets[3].rays.push_back({p, 0, to, 0.9999f});
            if (dot(to, n) > 0 && level == 0)
                sets[4].rays.push_back({p, 0, to, 0.9999f});
        }
    }
    for (RaySet& r : sets)
        r.rays.resize(r.rays.size() / 16 * 16);
    return sets;
}

// Bytes of what a page consists of, and how many leaves of a kind there are. Groups begin at multiples of 64
// bytes, so counts are a little too high.
void print_shares(const Page& page, double primitives) {
    const char* const name[] = {"nodes",         "Grid32",     "Grid48",  "GridFloat", "Triangle32",
                                "TriangleFloat", "Triangle48", "Fibre32", "Fibre48",   "FibreFloat"};
    const Header& h = page.header();
    std::printf("%-26s %6.2f bytes a primitive; the lattice's step is %g\n", "  nodes",
                double(h.node_bytes) / primitives, double(h.step));
    for (int k = 1; k < int(Kind::Count); k++) {
        const Section& s = h.section[k];
        if (s.leaf_bytes != 0)
            std::printf("  %-24s %6.2f bytes a primitive, and %.2f of names; %llu leaves\n", name[k],
                        double(s.leaf_bytes) / primitives,
                        double(s.name_count * sizeof(uint32_t)) / primitives,
                        static_cast<unsigned long long>(s.leaf_bytes / (UnitsOf[k] * UnitBytes)));
    }
}

struct Tracer {
    std::string name;
    std::function<size_t(const RaySet&)> trace; // how many hit something
};

void add_ours(std::vector<Tracer>& tracers, const char* name, const Page& page,
              void (*closest_of)(const Page&, std::span<const Ray>, std::span<Hit>),
              void (*any_of)(const Page&, std::span<const Ray>, std::span<uint8_t>)) {
    tracers.push_back({name, [=](const RaySet& r) {
                           size_t n = 0;
                           if (r.any) {
                               std::vector<uint8_t> any(r.rays.size());
                               any_of(page, r.rays, any);
                               for (uint8_t x : any)
                                   n += x;
                           } else {
                               std::vector<Hit> hits(r.rays.size());
                               closest_of(page, r.rays, hits);
                               for (const Hit& h : hits)
                                   n += h.found();
                           }
                           return n;
                       }});
}

// What packets are worth: each ray by itself.
void closest_alone(const Page& page, std::span<const Ray> rays, std::span<Hit> hits) {
    EverythingIsThere all;
    RayQueue<8, Query::Closest, EverythingIsThere>(page, rays, all)
        .run_alone([&](size_t i, const Hit& h, const InstancePath&) { hits[i] = h; });
}
void occluded_alone(const Page& page, std::span<const Ray> rays, std::span<uint8_t> hidden) {
    EverythingIsThere all;
    RayQueue<8, Query::Any, EverythingIsThere>(page, rays, all)
        .run_alone([&](size_t i, const Hit& h, const InstancePath&) { hidden[i] = h.found(); });
}

void compare(const std::vector<Tracer>& tracers, const std::vector<RaySet>& sets, const Options& o) {
    std::vector<std::vector<std::vector<double>>> ns(tracers.size(),
                                                     std::vector<std::vector<double>>(sets.size()));
    std::vector<std::vector<size_t>> hits(tracers.size(), std::vector<size_t>(sets.size()));
    for (int round = 0; round < o.rounds; round++)
        for (size_t q = 0; q < sets.size(); q++)
            for (size_t t = 0; t < tracers.size(); t++) {
                const double start = thread_ns();
                hits[t][q] = tracers[t].trace(sets[q]);
                ns[t][q].push_back((thread_ns() - start) / double(sets[q].rays.size()));
            }
    if (o.json) {
        for (size_t t = 0; t < tracers.size(); t++)
            for (size_t q = 0; q < sets.size(); q++) {
                std::printf(
                    "{\"scene\": \"%s\", \"tracer\": \"%s\", \"rays\": \"%s\", \"hits\": %zu, \"ns\": [",
                    o.scene.c_str(), tracers[t].name.c_str(), sets[q].name, hits[t][q]);
                for (size_t k = 0; k < ns[t][q].size(); k++)
                    std::printf("%s%.2f", k == 0 ? "" : ", ", ns[t][q][k]);
                std::printf("]}\n");
            }
        return;
    }
    std::printf("%-26s", "ns a ray (hits)");
    for (const RaySet& r : sets)
        std::printf("%22s", r.name);
    for (size_t t = 0; t < tracers.size(); t++) {
        std::printf("\n%-26s", tracers[t].name.c_str());
        for (size_t q = 0; q < sets.size(); q++)
            std::printf("%12.1f %9zu", median(ns[t][q]), hits[t][q]);
    }
    std::printf("\n");
}

} // namespace

int main(int argc, char** argv) {
    Options o;
    for (int i = 1; i < argc; i++) {
        const auto value = [&](const char* name) {
            const size_t n = std::strlen(name);
            return std::strncmp(argv[i], name, n) == 0 ? argv[i] + n : nullptr;
        };
        if (const char* v = value("--scene="))
            o.scene = v;
        else if (const char* v = value("--size="))
            o.size = std::atoi(v);
        else if (const char* v = value("--rounds="))
            o.rounds = std::max(1, std::atoi(v));
        else if (const char* v = value("--rays="))
            o.rays = std::max(16, std::atoi(v));
        else if (std::strcmp(argv[i], "--json") == 0)
            o.json = true;
    }
    const BenchScene s = o.scene == "cave"    ? cave(o.size ? o.size : 24)
                         : o.scene == "mesh"  ? terrain_mesh(o.size ? o.size : 20)
                         : o.scene == "globe" ? globe(o.size ? o.size : 220)
                         : o.scene == "hair"  ? hair(o.size ? o.size : 120)
                                              : terrain(o.size ? o.size : 62);
    std::vector<GridView> grids = testing::views(s.grids);
    const MeshView mesh{s.positions.data(), s.positions.size() / 3, s.corners.data(), s.corners.size() / 3};
    const FibreView fibres{s.fibres.data(), s.fibres.size() / 4, s.segments.data(), s.segments.size()};
    const Content content{grids, s.corners.empty() ? std::span<const MeshView>() : std::span(&mesh, 1), false,
                          s.segments.empty() ? std::span<const FibreView>() : std::span(&fibres, 1)};
    std::vector<double> voted, built;
    Lattices lattices;
    PageMemory memory;
    for (int i = 0; i < 3; i++) {
        const double start = wall_ms();
        const Lattice lattice = votes_of(content).lattice();
        lattices = {lattice, lattice, fibre_lattice_of(content.fibres)};
        const double then = wall_ms();
        memory = build(content, lattices);
        voted.push_back(then - start), built.push_back(wall_ms() - then);
    }
    const Page page = memory.page();
    const double primitives = double(s.primitives());
    const auto tell = [&](const char* tracer, double bytes, double positions, double ms) {
        if (o.json)
            std::printf("{\"scene\": \"%s\", \"tracer\": \"%s\", \"primitives\": %.0f, \"bytes_each\": %.3f, "
                        "\"positions_each\": %.3f, \"build_ms\": %.2f}\n",
                        o.scene.c_str(), tracer, primitives, bytes, positions, ms);
        else
            std::printf("%-26s %6.2f bytes each, beside %.2f of positions; %.0f ms to build\n", tracer, bytes,
                        positions, ms);
    };
    if (!o.json)
        std::printf("%s: %.0f primitives; %.0f ms to vote\n", o.scene.c_str(), primitives, median(voted));
    tell("pages, 8 lanes", double(memory.size()) / primitives, 0, median(voted) + median(built));
    if (!o.json)
        print_shares(page, primitives);

    std::vector<Tracer> tracers;
    add_ours(tracers, "pages, 8 lanes", page, closest_w8, occluded_w8);
    add_ours(tracers, "pages, rays alone", page, closest_alone, occluded_alone);
#ifdef KANUKA_HIERARCHY_AVX512
    if (has_avx512())
        add_ours(tracers, "pages, AVX-512", page, closest_avx512, occluded_avx512);
#endif
    Embree e;
    const Vertices vertices(s, lattices);
    std::vector<Peer> peers;
    for (bool robust : {true, false})
        for (RTCGeometryType type :
             s.grids.empty() ? std::vector{s.segments.empty() ? RTC_GEOMETRY_TYPE_TRIANGLE
                                                              : RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE}
                             : std::vector{RTC_GEOMETRY_TYPE_GRID, RTC_GEOMETRY_TYPE_QUAD})
            peers.push_back(embree(e, vertices, type, robust));
    for (const Peer& p : peers) {
        tell(p.name.c_str(), double(p.bytes) / primitives,
             double((vertices.positions.size() + vertices.fibres.size()) * 4) / primitives, p.ms);
        tracers.push_back({p.name, [scene = p.scene](const RaySet& r) {
                               return r.coherent ? trace_peer_packets(scene, r.rays, r.any)
                                                 : trace_peer(scene, r.rays, r.any);
                           }});
    }
    compare(tracers, make_rays(s, page, o.rays), o);
}
