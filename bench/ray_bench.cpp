// Rays by the thousand million from inside of closed surfaces, through pages of src/hierarchy and through
// Embree, robust, on the same vertices: does any get out, and do both find the same?
//
//     ray_bench [--kind=displaced|subdivided|trimmed|mesh|instances|moving|changing|fibres]
//     [--rays=N] [--surfaces=N] [--seed=N] [--threads=N]
//
// A line of JSON. A third of the rays goes anywhere, a third to vertices, a third to points of edges. Where
// the two differ, all triangles in doubles say who is right (exact_hits.h).
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "closed_surfaces.h"
#include "embree_surface.h"
#include "exact_hits.h"
#include "fibre_rays.h"

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

// Lattices as the renderer chooses them, for grids and for meshes.
struct SurfaceLattices {
    Lattice grids, meshes;
    explicit SurfaceLattices(const ClosedSurface& s) {
        std::vector<GridView> all = testing::views(s.grids);
        for (const std::vector<TestGrid>& step : s.later)
            for (const TestGrid& g : step)
                all.push_back(g.view());
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
    for (std::vector<TestGrid>& step : s.later)
        for (TestGrid& g : step)
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
        const MeshView mesh{m_surface.positions.data(),
                            m_surface.positions.size() / 3,
                            m_surface.corners.data(),
                            m_surface.corners.size() / 3,
                            3,
                            m_surface.is_grid};
        const std::span<const MeshView> meshes(&mesh, m_surface.corners.empty() ? 0 : 1);
        for (size_t k = 0; k < std::max<size_t>(1, m_surface.later.size()); k++) {
            std::vector<GridView> grids = testing::views(m_surface.step(k));
            for (size_t g = 0; g < grids.size() && !m_surface.later.empty(); g++)
                grids[g].later = m_surface.later[k][g].positions.data();
            m_pages.push_back(build({grids, meshes}, {m_lattices.grids, m_lattices.meshes}));
            const uint32_t number = m_world.add(m_pages.back().page());
            m_root = k == 0 ? number : m_root;
        }
        if (!m_surface.later.empty()) {
            Placements changing{m_root};
            changing.intervals = uint32_t(m_surface.later.size());
            m_root = m_world.add({&changing, 1});
        }
        std::vector<Placement> places;
        for (size_t i = 0; i < m_surface.places.size(); i++)
            places.push_back(
                {m_surface.places[i], m_root, m_surface.paths.empty() ? nullptr : &m_surface.paths[i]});
        if (!places.empty())
            m_root = m_world.add(places);
        for (size_t k = 0; k <= m_surface.later.size(); k++)
            m_triangles.push_back(collect_triangles(k));
        collect_runs();
        choose_origins();
    }

    size_t triangles() const { return m_triangles[0].size() * std::max<size_t>(1, m_surface.places.size()); }

    Ray ray(Random& random, int aim, uint32_t& instance, float& time) const {
        const uint32_t triangle = random.below(uint32_t(m_triangles[0].size())), k = random.below(3);
        if (!m_surface.later.empty())
            time = random.uniform();
        const Vec3f a = corner<Vec3f>(triangle, k, time), b = corner<Vec3f>(triangle, (k + 1) % 3, time);
        Vec3f o = m_surface.later.empty() ? m_origins[random.below(uint32_t(m_origins.size()))]
                                          : m_surface.inside(random, time),
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
            const float away = placed                    ? largest(rays[i].o)
                               : m_surface.later.empty() ? 0
                                                         : m_radius,
                        reach = ours + (m_longest + away) / length(rays[i].d);
            if (found != std::isfinite(t) || std::abs(ours - t) > 1.75f * 16 * 0x1p-24f * reach)
                judge(rays[i], times[i], double(ours), double(t), counts);
        }
    }

  private:
    static float largest(const Vec3f& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }
    // Who is right. Something is hit, for the surface is closed.
    void judge(const Ray& ray, float time, double ours, double theirs, Counts& counts) const {
        // Vertices of what changes are rounded twice on the way from the lattice.
        ExactHits exact(ray, !m_surface.places.empty() ? double(largest(ray.o))
                             : m_surface.later.empty() ? 0
                                                       : double(m_radius));
        if (m_surface.places.empty())
            look_at_all(exact, time, 1, [](const Point& p) { return p; });
        for (size_t i = 0; i < m_surface.places.size(); i++) {
            const Transform place = m_surface.place(i, time);
            const auto placed = [&m = place.m](const Point& p) {
                const auto row = [&](size_t r) {
                    return m[r][0] * p.x + m[r][1] * p.y + m[r][2] * p.z + m[r][3];
                };
                return Point(row(0), row(1), row(2));
            };
            if (exact.comes_near(placed(Point(0, 0, 0)), MostScale * double(m_radius)))
                look_at_all(exact, time, MostScale, placed);
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
    void look_at_all(ExactHits& exact, float time, double scale, const Placed& placed) const {
        for (const Run& run : m_runs)
            if (exact.comes_near(placed(Point(run.centre)), scale * double(run.radius)))
                for (uint32_t i = run.begin; i < run.end; i++)
                    exact.look_at(placed(corner<Point>(i, 0, time)), placed(corner<Point>(i, 1, time)),
                                  placed(corner<Point>(i, 2, time)));
    }
    // At a time: by the operations of the renderer, or in doubles.
    template <class P>
    P corner(uint32_t triangle, uint32_t k, float time) const {
        if (m_surface.later.empty())
            return P(m_triangles[0][triangle].corner[k]);
        const Interval at(time, uint32_t(m_surface.later.size()));
        const P a(m_triangles[at.number][triangle].corner[k]),
            b(m_triangles[at.number + 1][triangle].corner[k]);
        const auto between = [&](auto x, auto y) { return x + (y - x) * decltype(x)(at.fraction); };
        return P(between(a.x, b.x), between(a.y, b.y), between(a.z, b.z));
    }

    std::vector<Triangle> collect_triangles(size_t step) {
        std::vector<Triangle> all;
        for (const TestGrid& g : m_surface.step(step))
            for (int y = 0; y < g.rows; y++)
                for (int x = 0; x < g.columns; x++) {
                    const Vec3f a = g.at(x, y), b = g.at(x + 1, y), c = g.at(x, y + 1),
                                d = g.at(x + 1, y + 1);
                    all.push_back({{a, b, c}});
                    all.push_back({{d, c, b}});
                }
        const auto at = [&](uint32_t i) {
            const float* p = &m_surface.positions[3 * size_t(i)];
            return Vec3f(p[0], p[1], p[2]);
        };
        for (size_t i = 0; i < m_surface.corners.size(); i += 3)
            all.push_back(
                {{at(m_surface.corners[i]), at(m_surface.corners[i + 1]), at(m_surface.corners[i + 2])}});
        for (const Triangle& t : all)
            for (int k = 0; k < 3; k++)
                m_longest = std::max(m_longest, length(t.corner[k] - t.corner[(k + 1) % 3]));
        return all;
    }

    // Points inside: a walk from the middle along rays, where no vertex is as near as the longest edge; so
    // the surface is not there either.
    void choose_origins() {
        if (!m_surface.later.empty()) // what changes tells itself
            return;
        constexpr size_t Wanted = 256;
        const Page page = m_pages[0].page();
        Random random(7);
        Vec3f at(0.0f);
        m_origins.push_back(at);
        for (int step = 0; step < 4096 && m_origins.size() < Wanted; step++) {
            const Ray ray{at, 0, random.direction()};
            Hit hit;
            closest(page, std::span(&ray, 1), std::span(&hit, 1));
            const Vec3f next = at + ray.d * (hit.found() ? hit.t * random.uniform(0, 0.98f) : 0);
            const bool clear = std::ranges::all_of(m_triangles[0], [&](const Triangle& t) {
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
        uint32_t begin, end;
        Vec3f centre;
        float radius;
    };
    void collect_runs() {
        constexpr uint32_t Length = 16;
        const uint32_t count = uint32_t(m_triangles[0].size());
        for (uint32_t begin = 0; begin < count; begin += Length) {
            Run run{begin, std::min(begin + Length, count), m_triangles[0][begin].corner[0], 0};
            for (const std::vector<Triangle>& step : m_triangles)
                for (uint32_t i = begin; i < run.end; i++)
                    for (const Vec3f& p : step[i].corner)
                        run.radius = std::max(run.radius, 1.001f * length(p - run.centre)),
                        m_radius = std::max(m_radius, 1.001f * length(p));
            m_runs.push_back(run);
        }
    }

    SurfaceLattices m_lattices;
    ClosedSurface m_surface;
    Embree m_embree;
    std::vector<PageMemory> m_pages; // of what changes one for each interval
    World m_world;
    uint32_t m_root = 0;
    std::vector<std::vector<Triangle>> m_triangles; // of one instance, by steps
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

// Nothing is closed by fibres: what leaks would be counts where closest and any disagree.
size_t trace_fibres(const Options& o, uint64_t number, Counts& counts) {
    constexpr uint64_t Chunk = 3 << 12;
    const FibreRays fibres(uint32_t(o.seed + number));
    const uint64_t rays = o.rays / o.surfaces + (number < o.rays % o.surfaces);
    std::mutex mutex;
    tasks::parallel_for(size_t((rays + Chunk - 1) / Chunk), [&](size_t chunk) {
        Random random(uint32_t(0x9e3779b9u * uint32_t(o.seed + number) + uint32_t(chunk)));
        std::vector<Ray> some(std::min(Chunk, rays - chunk * Chunk));
        for (size_t i = 0; i < some.size(); i++)
            some[i] = fibres.ray(random, int(i % Aims));
        FibreRays::Counts found;
        fibres.trace(some, found);
        const std::lock_guard lock(mutex);
        for (size_t i = 0; i < some.size(); i++)
            counts.rays[i % Aims]++;
        counts.leaks_of_any[0] += found.any_differs;
        counts.differ += found.differ, counts.ours_right += found.ours_right;
        counts.embree_right += found.embree_right, counts.tie += found.tie;
        counts.neither += found.neither;
    });
    return fibres.segments();
}

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
    constexpr const char* Kinds[] = {"displaced", "subdivided", "trimmed",  "mesh",
                                     "instances", "moving",     "changing", "fibres"};
    if (std::ranges::find(Kinds, o.kind) == std::end(Kinds)) {
        std::fprintf(stderr, "ray_bench: \"%s\" is no kind\n", o.kind.c_str());
        return 2;
    }
    Counts counts;
    size_t triangles = 0;
    for (uint64_t s = 0; s < o.surfaces; s++) {
        tasks::with_threads(o.threads, [&] {
            triangles += o.kind == "fibres" ? trace_fibres(o, s, counts) : trace_surface(o, s, counts);
        });
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
