// Rays by the thousand million from inside of closed surfaces, through pages of src/hierarchy and through
// Embree, robust, on the same vertices: does any get out, and do both find the same?
//
//     ray_bench [--kind=displaced|subdivided|trimmed|mesh|instances|moving] [--rays=N] [--surfaces=N]
//     [--seed=N]
//     [--threads=N]
//
// A line of JSON. A third of the rays goes anywhere, a third to vertices, a third to points of edges. Where
// the two differ, all triangles in doubles say who is right (exact_hits.h).
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <embree3/rtcore.h>
#include <mutex>

#include "closed_surfaces.h"
#include "exact_hits.h"

#include "base/tasks.h"
#include "hierarchy/queue.h"
#include "hierarchy/trace.h"

using namespace kanuka;
using namespace kanuka::hierarchy;
using namespace kanuka::hierarchy::bench;

namespace {

constexpr int Aims = 3;
constexpr const char* AimName[Aims] = {"anywhere", "vertices", "edges"};
using PerAim = std::array<uint64_t, Aims>;
struct Counts {
    PerAim rays{}, leaks{}, leaks_of_any{}, embree_leaks{};
    uint64_t differ = 0, ours_right = 0, embree_right = 0, tie = 0, neither = 0;

    void add(const Counts& c) {
        for (const auto counts :
             {&Counts::rays, &Counts::leaks, &Counts::leaks_of_any, &Counts::embree_leaks})
            for (size_t a = 0; a < Aims; a++)
                (this->*counts)[a] += (c.*counts)[a];
        for (const auto count :
             {&Counts::differ, &Counts::ours_right, &Counts::embree_right, &Counts::tie, &Counts::neither})
            this->*count += c.*count;
    }
};

// ---- a surface, as both have it
struct Triangle {
    Vec3f corner[3];
};

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
        for (const TestGrid& g : s.grids) {
            const uint32_t first = uint32_t(m_positions.size() / 3), row = uint32_t(g.columns + 1);
            m_grids.push_back({first, row, uint16_t(row), uint16_t(g.rows + 1)});
            m_positions.insert(m_positions.end(), g.positions.begin(), g.positions.end());
        }
        for (uint32_t c : s.corners)
            m_corners.push_back(uint32_t(m_positions.size() / 3) + c);
        m_positions.insert(m_positions.end(), s.positions.begin(), s.positions.end());
        const size_t vertices = m_positions.size() / 3;
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
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, m_positions.data(), 0, 12,
                                   vertices);
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
};

// Lattices as the renderer chooses them, for grids and for meshes.
struct SurfaceLattices {
    Lattice grids, meshes;
    explicit SurfaceLattices(const ClosedSurface& s) {
        const std::vector<GridView> all = testing::views(s.grids);
        const MeshView mesh{s.positions.data(), s.positions.size() / 3, s.corners.data(),
                            s.corners.size() / 3};
        grids = votes_of({all, {}}).lattice();
        meshes = s.is_grid ? grids : votes_of({{}, std::span(&mesh, 1), true}).lattice();
    }
};

ClosedSurface moved_to(const SurfaceLattices& lattices, ClosedSurface s) {
    const auto move = [](const Lattice& lattice, std::vector<float>& p) {
        for (size_t i = 0; i < p.size(); i += 3) {
            const Vec3f q = lattice.snap({p[i], p[i + 1], p[i + 2]});
            for (int c = 0; c < 3; c++)
                p[i + size_t(c)] = q[c];
        }
    };
    for (TestGrid& g : s.grids)
        move(lattices.grids, g.positions);
    move(lattices.meshes, s.positions);
    return s;
}

struct Queue {
    std::vector<Ray> rays;
    std::vector<uint32_t> inside; // which instance they start in
    std::vector<float> times;
};

class Tested {
  public:
    explicit Tested(const ClosedSurface& made)
        : m_lattices(made), m_surface(moved_to(m_lattices, made)), m_embree(m_surface) {
        const std::vector<GridView> grids = testing::views(m_surface.grids);
        const MeshView mesh{m_surface.positions.data(),
                            m_surface.positions.size() / 3,
                            m_surface.corners.data(),
                            m_surface.corners.size() / 3,
                            3,
                            m_surface.is_grid};
        const std::span<const MeshView> meshes(&mesh, m_surface.corners.empty() ? 0 : 1);
        m_page = build({grids, meshes}, {m_lattices.grids, m_lattices.meshes});
        m_root = m_world.add(m_page.page());
        std::vector<Placement> places;
        for (size_t i = 0; i < m_surface.places.size(); i++)
            places.push_back(
                {m_surface.places[i], m_root, m_surface.paths.empty() ? nullptr : &m_surface.paths[i]});
        if (!places.empty())
            m_root = m_world.add(places);
        collect_triangles();
        collect_runs();
        choose_origins();
    }

    size_t triangles() const { return m_triangles.size() * std::max<size_t>(1, m_surface.places.size()); }

    Ray ray(Random& random, int aim, uint32_t& instance, float& time) const {
        const Triangle& t = m_triangles[random.below(uint32_t(m_triangles.size()))];
        const uint32_t k = random.below(3);
        const Vec3f a = t.corner[k], b = t.corner[(k + 1) % 3];
        Vec3f o = m_origins[random.below(uint32_t(m_origins.size()))],
              to = a + (b - a) * (aim == 1 ? 0.0f : random.uniform());
        instance = ~0u;
        if (!m_surface.places.empty()) {
            instance = random.below(uint32_t(m_surface.places.size()));
            if (!m_surface.paths.empty())
                time = random.uniform();
            const Transform place = m_surface.place(instance, time);
            o = place.point(o), to = place.point(to);
        }
        return {o, 0, aim == 0 ? random.direction() : to - o};
    }

    void trace(const Queue& queue, Counts& counts) const {
        const auto& [rays, inside, times] = queue;
        EverythingIsThere all;
        std::vector<InstanceHit> hits(rays.size());
        std::vector<uint8_t> any(rays.size());
        find_closest<8>(m_world, m_root, rays, hits, all, times);
        find_any<8>(m_world, m_root, rays, any, all, times);
        for (size_t i = 0; i < rays.size(); i++) {
            const size_t aim = i % Aims;
            const bool placed = !m_surface.places.empty(), found = hits[i].hit.found();
            uint32_t instance;
            const float t = m_embree.trace(rays[i], times[i], instance),
                        ours = found ? hits[i].hit.t : std::numeric_limits<float>::infinity();
            counts.rays[aim]++;
            counts.leaks[aim] += !found || (placed && hits[i].path.instance[0] != inside[i]);
            counts.leaks_of_any[aim] += !any[i];
            counts.embree_leaks[aim] += !std::isfinite(t) || (placed && instance != inside[i]);
            // Each may be off by 8 eps of the distance of a corner along the ray's longest axis; instances,
            // by as much of the place where the ray starts, for it is rounded once more there.
            const float away = placed ? largest(rays[i].o) : 0,
                        reach = ours + (m_longest + away) / length(rays[i].d);
            if (found != std::isfinite(t) || std::abs(ours - t) > 1.75f * 16 * 0x1p-24f * reach)
                judge(rays[i], times[i], double(ours), double(t), counts);
        }
    }

  private:
    static float largest(const Vec3f& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }
    // Who is right. Something is hit, for the surface is closed.
    void judge(const Ray& ray, float time, double ours, double theirs, Counts& counts) const {
        ExactHits exact(ray, m_surface.places.empty() ? 0 : double(largest(ray.o)));
        if (m_surface.places.empty())
            look_at_all(exact, 1, [](const Vec3f& p) { return Point(p); });
        for (size_t i = 0; i < m_surface.places.size(); i++) {
            const Transform place = m_surface.place(i, time);
            const auto placed = [&m = place.m](const Vec3f& p) {
                const auto row = [&](size_t r) {
                    return m[r][0] * double(p.x) + m[r][1] * double(p.y) + m[r][2] * double(p.z) + m[r][3];
                };
                return Point(row(0), row(1), row(2));
            };
            if (exact.comes_near(placed(Vec3f(0.0f)), MostScale * double(m_radius)))
                look_at_all(exact, MostScale, placed);
        }
        const bool we = std::isfinite(ours) && exact.allow(ours),
                   they = std::isfinite(theirs) && exact.allow(theirs);
        if (!we) // to look at
            std::fprintf(stderr, "wrong: from %a %a %a along %a %a %a: %a, Embree %a\n", double(ray.o.x),
                         double(ray.o.y), double(ray.o.z), double(ray.d.x), double(ray.d.y), double(ray.d.z),
                         ours, theirs);
        counts.differ++;
        (we ? they ? counts.tie : counts.ours_right : they ? counts.embree_right : counts.neither)++;
    }
    template <class Placed>
    void look_at_all(ExactHits& exact, double scale, const Placed& placed) const {
        for (const Run& run : m_runs)
            if (exact.comes_near(placed(run.centre), scale * double(run.radius)))
                for (size_t i = run.begin; i < run.end; i++) {
                    const Vec3f* c = m_triangles[i].corner;
                    exact.look_at(placed(c[0]), placed(c[1]), placed(c[2]));
                }
    }

    void collect_triangles() {
        for (const TestGrid& g : m_surface.grids)
            for (int y = 0; y < g.rows; y++)
                for (int x = 0; x < g.columns; x++) {
                    const Vec3f a = g.at(x, y), b = g.at(x + 1, y), c = g.at(x, y + 1),
                                d = g.at(x + 1, y + 1);
                    m_triangles.push_back({{a, b, c}});
                    m_triangles.push_back({{d, c, b}});
                }
        const auto at = [&](uint32_t i) {
            const float* p = &m_surface.positions[3 * size_t(i)];
            return Vec3f(p[0], p[1], p[2]);
        };
        for (size_t i = 0; i < m_surface.corners.size(); i += 3)
            m_triangles.push_back(
                {{at(m_surface.corners[i]), at(m_surface.corners[i + 1]), at(m_surface.corners[i + 2])}});
        for (const Triangle& t : m_triangles)
            for (int k = 0; k < 3; k++)
                m_longest = std::max(m_longest, length(t.corner[k] - t.corner[(k + 1) % 3]));
    }

    // Points inside: a walk from the middle along rays, where no vertex is as near as the longest edge; so
    // the surface is not there either.
    void choose_origins() {
        constexpr size_t Wanted = 256;
        const Page page = m_page.page();
        Random random(7);
        Vec3f at(0.0f);
        m_origins.push_back(at);
        for (int step = 0; step < 4096 && m_origins.size() < Wanted; step++) {
            const Ray ray{at, 0, random.direction()};
            Hit hit;
            closest(page, std::span(&ray, 1), std::span(&hit, 1));
            const Vec3f next = at + ray.d * (hit.found() ? hit.t * random.uniform(0, 0.98f) : 0);
            const bool clear = std::ranges::all_of(m_triangles, [&](const Triangle& t) {
                return std::ranges::all_of(t.corner,
                                           [&](const Vec3f& p) { return length(p - next) > m_longest; });
            });
            if (clear)
                m_origins.push_back(at = next);
            else
                at = m_origins[random.below(uint32_t(m_origins.size()))];
        }
    }

    struct Run { // of triangles, and a ball around them
        size_t begin, end;
        Vec3f centre;
        float radius;
    };
    void collect_runs() {
        constexpr size_t Length = 16;
        for (size_t begin = 0; begin < m_triangles.size(); begin += Length) {
            Run run{
                begin, std::min(begin + Length, m_triangles.size()),
                m_triangles[begin + Length / 2 < m_triangles.size() ? begin + Length / 2 : begin].corner[0],
                0};
            for (size_t i = begin; i < run.end; i++)
                for (const Vec3f& p : m_triangles[i].corner)
                    run.radius = std::max(run.radius, 1.001f * length(p - run.centre)),
                    m_radius = std::max(m_radius, 1.001f * length(p));
            m_runs.push_back(run);
        }
    }

    SurfaceLattices m_lattices;
    ClosedSurface m_surface;
    Embree m_embree;
    PageMemory m_page;
    World m_world;
    uint32_t m_root = 0;
    std::vector<Triangle> m_triangles; // of one instance
    std::vector<Run> m_runs;
    std::vector<Vec3f> m_origins;
    float m_longest = 0; // edge
    float m_radius = 0;  // of a ball about the origin that holds all
};

// ---- all of a kind
struct Options {
    std::string kind = "displaced";
    uint64_t rays = 1'000'000, surfaces = 8, seed = 0;
    int threads = 0;
};

size_t trace_surface(const Options& o, uint64_t number, Counts& counts) {
    constexpr uint64_t Chunk = 3 << 12;
    const Tested surface(closed_surface(o.kind, uint32_t(o.seed + number)));
    const uint64_t rays = o.rays / o.surfaces + (number < o.rays % o.surfaces);
    std::mutex mutex;
    tasks::parallel_for(size_t((rays + Chunk - 1) / Chunk), [&](size_t chunk) {
        Random random(uint32_t(0x9e3779b9u * uint32_t(o.seed + number) + uint32_t(chunk)));
        const size_t count = std::min(Chunk, rays - chunk * Chunk);
        Queue queue{std::vector<Ray>(count), std::vector<uint32_t>(count), std::vector<float>(count)};
        for (size_t i = 0; i < count; i++)
            queue.rays[i] = surface.ray(random, int(i % Aims), queue.inside[i], queue.times[i]);
        Counts found;
        surface.trace(queue, found);
        const std::lock_guard lock(mutex);
        counts.add(found);
    });
    return surface.triangles();
}

void print(const char* name, const PerAim& counts) {
    std::printf("\"%s\": {", name);
    for (size_t a = 0; a < Aims; a++)
        std::printf("%s\"%s\": %llu", a ? ", " : "", AimName[a], (unsigned long long)counts[a]);
    std::printf("}, ");
}
void print(const char* name, uint64_t count, const char* then = ", ") {
    std::printf("\"%s\": %llu%s", name, (unsigned long long)count, then);
}

} // namespace

int main(int argc, char** argv) {
    Options o;
    for (int i = 1; i < argc; i++) {
        const auto value = [&](const char* name) {
            const size_t n = std::strlen(name);
            return std::strncmp(argv[i], name, n) == 0 ? argv[i] + n : nullptr;
        };
        if (const char* v = value("--kind="))
            o.kind = v;
        else if (const char* v = value("--rays="))
            o.rays = uint64_t(std::atof(v));
        else if (const char* v = value("--surfaces="))
            o.surfaces = std::max(1ull, std::strtoull(v, nullptr, 10));
        else if (const char* v = value("--seed="))
            o.seed = std::strtoull(v, nullptr, 10);
        else if (const char* v = value("--threads="))
            o.threads = std::atoi(v);
    }
    Counts counts;
    size_t triangles = 0;
    for (uint64_t s = 0; s < o.surfaces; s++) {
        tasks::with_threads(o.threads, [&] { triangles += trace_surface(o, s, counts); });
        if ((s + 1) * 20 / o.surfaces != s * 20 / o.surfaces)
            std::fprintf(stderr, "%s: %llu of %llu surfaces, %llu rays differ\n", o.kind.c_str(),
                         (unsigned long long)(s + 1), (unsigned long long)o.surfaces,
                         (unsigned long long)counts.differ);
    }
    std::printf("{\"kind\": \"%s\", ", o.kind.c_str());
    print("surfaces", o.surfaces), print("triangles", triangles);
    print("rays", counts.rays), print("leaks", counts.leaks), print("leaks_of_any", counts.leaks_of_any);
    print("embree_leaks", counts.embree_leaks);
    print("differ", counts.differ), print("ours_right", counts.ours_right);
    print("embree_right", counts.embree_right), print("tie", counts.tie),
        print("neither", counts.neither, "}\n");
}
