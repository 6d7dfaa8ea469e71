// Instances that move, or grids that change, beside the same ones standing still as they are halfway, in
// pages and in Embree, by the queries of the renderer: time a ray, and bytes.
//
//     moving_bench [--instances=N] [--rays=N] [--rounds=N] [--turn=DEGREES] [--travel=UNITS] [--json]
//     moving_bench --cells=N [--times=N] [--rays=N] [--rounds=N] [--travel=UNITS] [--json]
//
// Each thing is two units wide; it travels in a direction of its own and turns about an axis of its own.
// `--cells`: a terrain instead, 250 units wide, whose waves travel, given at so many times (2). Two
// threads build and one traces, whose time counts; rounds go through all scenes in turn, figures are medians,
// of ratios too. Rays have random times, and bounces start where rays of theirs hit. "At once": all rays are
// those through what stands still, and halfway.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <oneapi/tbb/global_control.h>

#include "bvh/test_geometry.h"
#include "timing.h"

using namespace kanuka;
using namespace kanuka::bvh;
using namespace kanuka::bvh::testing;

namespace {

constexpr float Halfway = 0.5f; // of the shutter

struct Settings {
    size_t instances = 100000, rays = 65536;
    int rounds = 7;
    double turn = 20, travel = 1;
    int cells = 0, times = 2;
    bool json = false; // a line for each tracer, and for each kind of ray
};

// A forest: things stand beside each other on a plane, about to overlap.
struct Forest {
    std::vector<float> still;
    std::vector<MotionPath> paths;

    explicit Forest(const Settings& s) {
        std::mt19937 g(1);
        std::uniform_real_distribution<double> u(-1, 1);
        const size_t side = size_t(std::ceil(std::sqrt(double(s.instances))));
        for (size_t i = 0; i < s.instances; i++) {
            const double x = (double(i % side) + 0.5 * u(g) - double(side) / 2) * 2.5,
                         z = (double(i / side) + 0.5 * u(g) - double(side) / 2) * 2.5, size = 1 + 0.4 * u(g);
            const Transform stands = Transform::translate(x, size * 1.3, z) *
                                     Transform::rotate(180 * u(g), 0, 1, 0) *
                                     Transform::scale(size, size * 1.6, size);
            const TransformKey keys[] = {
                {0, stands},
                {1, Transform::translate(s.travel * u(g), s.travel * u(g), s.travel * u(g)) * stands *
                        Transform::rotate(s.turn, u(g), u(g), u(g))}};
            paths.emplace_back(keys);
            still.resize(12 * paths.size());
            paths.back().at(Halfway, &still[12 * i]);
        }
    }
};

void add_ball(Shapes& shapes) {
    constexpr int Cells = 32;
    for (int face = 0; face < 6; face++) {
        std::vector<Vec3f> points;
        for (int j = 0; j <= Cells; j++)
            for (int i = 0; i <= Cells; i++) {
                const float a = 2 * float(i) / Cells - 1, b = 2 * float(j) / Cells - 1,
                            c = face & 1 ? -1.0f : 1.0f;
                const Vec3f d = normalize(face < 2   ? Vec3f(c, a, b)
                                          : face < 4 ? Vec3f(a, c, b)
                                                     : Vec3f(a, b, c));
                points.push_back(d * (1 + 0.15f * std::sin(7 * d.x) * std::sin(6 * d.y) * std::sin(8 * d.z)));
            }
        shapes.add_grid(Cells, Cells, points);
    }
}

// Square grids of 64 cells to a side.
constexpr float Width = 250;
void add_terrain(Shapes& shapes, const Settings& s, bool changes) {
    constexpr int Cells = 64;
    const int across = std::max(1, int(std::sqrt(double(s.cells)) / Cells));
    const auto height = [](float x, float z) {
        float sum = 0;
        for (int octave = 0; octave < 6; octave++) {
            const float f = 0.15f * float(1 << octave);
            sum += std::sin(f * x + float(octave)) * std::sin(f * z + 2) * 3 / float(1 << octave);
        }
        return sum;
    };
    for (int v = 0; v < across; v++)
        for (int u = 0; u < across; u++) {
            std::vector<std::vector<Vec3f>> steps;
            for (int k = 0; k < s.times; k++) {
                const float way = float(s.travel) * float(k) / float(s.times - 1);
                std::vector<Vec3f>& points = steps.emplace_back();
                for (int j = 0; j <= Cells; j++)
                    for (int i = 0; i <= Cells; i++) {
                        const float x = (float(u) + float(i) / Cells) / float(across) * Width - Width / 2,
                                    z = (float(v) + float(j) / Cells) / float(across) * Width - Width / 2;
                        points.push_back({x + 0.3f * way, height(x - way, z), z});
                    }
            }
            if (changes) {
                shapes.add_moving_grid(Cells, Cells, steps);
                continue;
            }
            std::vector<Vec3f> halfway; // its vertices go straight from a time to the next
            const std::vector<Vec3f>&before = steps[size_t(s.times - 1) / 2],
                  &behind = steps[size_t(s.times) / 2];
            for (size_t i = 0; i < before.size(); i++)
                halfway.push_back((before[i] + behind[i]) * 0.5f);
            shapes.add_grid(Cells, Cells, halfway);
        }
}

// Of rounds that lie beside each other: the machine may be shared.
double ratio(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> all;
    for (size_t i = 0; i < a.size(); i++)
        all.push_back(a[i] / b[i]);
    return median(all);
}

struct Tracer {
    const char* name;
    std::unique_ptr<Scene> scene;
    bool moves;
    double built = 0;
    std::vector<double> ns;
};

std::vector<Ray> camera_rays(size_t count, double side) {
    const int width = int(std::sqrt(double(count)));
    std::mt19937 g(2);
    std::uniform_real_distribution<float> u(0, 1);
    std::vector<Ray> rays;
    for (int y = 0; y < width; y++)
        for (int x = 0; x < width; x++)
            rays.push_back({{0, 12, float(-0.3 * side)},
                            normalize(Vec3f((float(x) / float(width) - 0.5f) * 1.4f,
                                            -0.15f - 0.5f * float(y) / float(width), 1)),
                            u(g)});
    return rays;
}

struct Batch {
    std::vector<RayPacket<8>> packets;
    std::vector<HitPacket<8>> hits;

    explicit Batch(const std::vector<Ray>& rays) {
        for (size_t i = 0; i + 8 <= rays.size(); i += 8)
            packets.push_back(packet<8>(&rays[i], 8));
        hits.resize(packets.size());
    }
    // As transport hands rays over.
    void trace(const Scene& scene) {
        constexpr size_t Together = 32;
        for (size_t i = 0; i < packets.size(); i += Together) {
            const size_t n = std::min(Together, packets.size() - i);
            scene.intersect<8>(std::span(packets).subspan(i, n), std::span(hits).subspan(i, n));
        }
    }
    size_t found() const {
        size_t n = 0;
        for (const auto& h : hits)
            n += size_t(__builtin_popcount(h.hit.bits()));
        return n;
    }
    // From where those end, anywhere.
    std::vector<Ray> bounces(const std::vector<Ray>& rays) const {
        std::mt19937 g(3);
        std::normal_distribution<float> u;
        std::vector<Ray> out;
        for (size_t i = 0; i < 8 * packets.size(); i++)
            if (hits[i / 8].hit[int(i % 8)])
                out.push_back({rays[i].o + rays[i].d * (hits[i / 8].t[int(i % 8)] * 0.999f),
                               normalize(Vec3f(u(g), u(g), u(g))), rays[i].time});
        return out;
    }
};

Settings settings_of(int argc, char** argv) {
    Settings s;
    for (int i = 1; i < argc; i++) {
        const auto value = [&](const char* name) {
            const size_t n = std::strlen(name);
            return std::strncmp(argv[i], name, n) == 0 ? argv[i] + n : nullptr;
        };
        if (const char* v = value("--instances="))
            s.instances = size_t(std::atol(v));
        else if (const char* v = value("--rays="))
            s.rays = size_t(std::atol(v));
        else if (const char* v = value("--rounds="))
            s.rounds = std::max(1, std::atoi(v));
        else if (const char* v = value("--turn="))
            s.turn = std::atof(v);
        else if (const char* v = value("--travel="))
            s.travel = std::atof(v);
        else if (const char* v = value("--cells="))
            s.cells = std::atoi(v);
        else if (const char* v = value("--times="))
            s.times = std::max(2, std::atoi(v));
        else if (std::strcmp(argv[i], "--json") == 0)
            s.json = true;
    }
    return s;
}

void say_built(const Tracer& t, double bytes_each, const Settings& s) {
    if (s.json)
        std::printf("{\"tracer\": \"%s\", \"bytes_each\": %.2f, \"build_s\": %.4f}\n", t.name, bytes_each,
                    t.built);
    else
        std::printf("%-15s %6.1f bytes %s, built in %.2f s\n", t.name, bytes_each,
                    s.cells > 0 ? "a cell" : "an instance", t.built);
}

void say_traced(const char* rays, size_t count, std::span<const Tracer, 4> all, const size_t* found,
                const Settings& s) {
    if (s.json) {
        std::printf("{\"rays\": \"%s\", \"count\": %zu", rays, count);
        for (const Tracer& t : all) {
            std::printf(", \"%s\": [", t.name);
            for (size_t i = 0; i < t.ns.size(); i++)
                std::printf(i ? ", %.2f" : "%.2f", t.ns[i]);
            std::printf("]");
        }
        std::printf("}\n");
        return;
    }
    std::printf("%s, %zu rays\n", rays, count);
    for (size_t k = 0; k < 4; k++)
        std::printf("  %-15s %7.1f ns, %.2f of still ones, %zu hit\n", all[k].name, median(all[k].ns),
                    ratio(all[k].ns, all[k & 2].ns), found[k]);
    std::printf("  pages over Embree: still %.2f, moving %.2f\n", ratio(all[0].ns, all[2].ns),
                ratio(all[1].ns, all[3].ns));
}

} // namespace

int main(int argc, char** argv) {
    const Settings settings = settings_of(argc, argv);
    const oneapi::tbb::global_control two(oneapi::tbb::global_control::max_allowed_parallelism, 2);
    const Forest forest(settings);
    Shapes things[2]; // what stands still, and what moves or changes
    if (settings.cells > 0)
        add_terrain(things[0], settings, false), add_terrain(things[1], settings, true);
    else
        add_ball(things[0]), add_ball(things[1]);
    Tracer all[] = {{"pages, still", nullptr, false},
                    {"pages, moving", nullptr, true},
                    {"Embree, still", nullptr, false},
                    {"Embree, moving", nullptr, true}};
    for (Tracer& t : all) {
        Shapes& shapes = things[t.moves];
        std::vector<GroupDesc> groups(settings.cells > 0 ? 1 : 2);
        groups[0].shapes.push_back({0, int(shapes.store.shapes().size())});
        if (settings.cells == 0 && t.moves)
            groups[1].instances.push_back({0, {}, forest.paths});
        else if (settings.cells == 0)
            groups[1].instances.push_back({0, forest.still});
        const double start = seconds(CLOCK_MONOTONIC);
        t.scene = std::make_unique<Scene>(
            shapes.store, groups, Scene::Build{.pages_from = t.name[0] == 'p' ? uint64_t(0) : AllInEmbree});
        t.built = seconds(CLOCK_MONOTONIC) - start;
        const double count =
            settings.cells > 0 ? double(shapes.store.shapes().size()) * 64 * 64 : double(settings.instances);
        say_built(t, double(t.scene->bytes()) / count, settings);
    }
    // Bounces start where rays hit what is traced: of what stands still, and of what moves.
    std::vector<Ray> rays[2];
    rays[0] = rays[1] = camera_rays(
        settings.rays, settings.cells > 0 ? double(Width) : std::sqrt(double(settings.instances)) * 2.5);
    for (const char* name : {"camera", "bounce 1", "bounce 2", "bounce 2, at once"}) {
        if (std::strstr(name, "at once")) {
            rays[1] = rays[0];
            for (Ray& r : rays[1])
                r.time = Halfway;
        }
        Batch batch[2] = {Batch(rays[0]), Batch(rays[1])};
        size_t found[4];
        for (int round = 0; round < settings.rounds; round++)
            for (int k = 3; k >= 0; k--) {
                Tracer& t = all[k];
                const double start = seconds(CLOCK_THREAD_CPUTIME_ID);
                batch[t.moves].trace(*t.scene);
                if (round == 0)
                    t.ns.clear();
                t.ns.push_back((seconds(CLOCK_THREAD_CPUTIME_ID) - start) * 1e9 /
                               double(rays[t.moves].size()));
                found[k] = batch[t.moves].found();
            }
        say_traced(name, rays[1].size(), all, found, settings);
        for (const int moves : {0, 1}) {
            batch[moves].trace(*all[moves].scene);
            if (!std::strstr(name, "bounce 2"))
                rays[moves] = batch[moves].bounces(rays[moves]);
        }
    }
}
