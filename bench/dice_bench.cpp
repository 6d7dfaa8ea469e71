// Times dicing: a bicubic patch of about four million micropolygons, plain and roughened, a terrain of four
// million triangles that goes through as a mesh, and subdivision surfaces of coarse, fine and irregular
// cages. Not run by the tests. Each line of the output is a JSON object; the best of some runs.
//   kanuka_dice_bench [--threads N] [--quick] [--only PART OF A NAME]
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <string_view>

#include "base/tasks.h"
#include "dice/dice.h"

using namespace kanuka;

namespace {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Of all threads of the process.
double cpu_now() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

scene::Value points(std::vector<float> p) {
    scene::Value v;
    v.name = "P";
    v.type = scene::Type::Point;
    v.detail = scene::Detail::Vertex;
    v.floats = std::move(p);
    return v;
}

scene::Primitive wavy_patch() {
    scene::PatchMesh mesh;
    mesh.u_basis = mesh.v_basis = scene::basis_by_name("bezier");
    std::vector<float> p;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            p.insert(p.end(), {i / 1.5f - 1, j / 1.5f - 1, 0.3f * float((i * 7 + j * 5) % 3)});
    scene::Primitive primitive;
    primitive.geometry = mesh;
    primitive.primvars.set(points(p));
    return primitive;
}

// Squares cut in two triangles each, row by row.
scene::Primitive terrain(int n) {
    std::vector<float> p;
    std::vector<int32_t> index;
    p.reserve(size_t(3) * (n + 1) * (n + 1));
    index.reserve(size_t(6) * n * n);
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++) {
            const float x = 2.0f * float(i) / float(n) - 1, y = 2.0f * float(j) / float(n) - 1;
            p.insert(p.end(), {x, y, 0.05f * std::sin(40 * x) * std::cos(37 * y)});
        }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
            index.insert(index.end(), {a, b, c, a, c, d});
        }
    scene::PolygonMesh mesh;
    mesh.vertices = std::move(index);
    scene::Primitive primitive;
    primitive.geometry = mesh;
    primitive.primvars.set(points(std::move(p)));
    return primitive;
}

// A torus of n x n quads as a subdivision cage.
scene::Primitive torus_cage(int n) {
    std::vector<float> p;
    std::vector<int32_t> index;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const float a = 2 * Pi * float(i) / float(n), b = 2 * Pi * float(j) / float(n);
            const float r = 0.7f + 0.3f * std::cos(b);
            p.insert(p.end(), {r * std::cos(a), r * std::sin(a), 0.3f * std::sin(b)});
            const int i1 = (i + 1) % n, j1 = (j + 1) % n;
            index.insert(index.end(), {j * n + i, j * n + i1, j1 * n + i1, j1 * n + i});
        }
    scene::SubdivisionMesh mesh;
    mesh.vertices_per_face = std::vector<int32_t>(size_t(n) * n, 4);
    mesh.vertices = std::move(index);
    scene::Primitive primitive;
    primitive.geometry = mesh;
    primitive.primvars.set(points(std::move(p)));
    return primitive;
}

// The same with every fourth quad cut into two triangles, a crease round it and texture coordinates at
// corners: one face in two has an extraordinary vertex beside it.
scene::Primitive irregular_cage() {
    constexpr int N = 64;
    scene::Primitive primitive = torus_cage(N);
    auto& mesh = std::get<scene::SubdivisionMesh>(primitive.geometry);
    const std::vector<int32_t> quads(mesh.vertices.begin(), mesh.vertices.end());
    std::vector<int32_t> sizes, index;
    std::vector<float> st;
    scene::SubdivisionMesh::Tag crease;
    crease.name = "crease";
    crease.floats = {3};
    for (int f = 0; f < N * N; f++) {
        const int i = f % N, j = f / N;
        const bool cut = i % 2 == 0 && j % 2 == 0;
        for (const std::array<int, 4> corners :
             {std::array{0, 1, 2, cut ? -1 : 3}, std::array{0, 2, 3, -1}}) {
            if (!cut && corners[1] == 2)
                continue;
            sizes.push_back(corners[3] < 0 ? 3 : 4);
            for (const int k : corners) {
                if (k < 0)
                    continue;
                index.push_back(quads[4 * f + k]);
                st.insert(st.end(), {float(i + (k == 1 || k == 2)) / N, float(j + (k >= 2)) / N});
            }
        }
        if (j == 0)
            crease.ints.push_back(i);
    }
    crease.ints.push_back(0);
    mesh.vertices_per_face = std::move(sizes);
    mesh.vertices = std::move(index);
    mesh.tags = {crease};
    scene::Value value;
    value.name = "st";
    value.type = scene::Type::Float;
    value.detail = scene::Detail::FaceVarying;
    value.array_size = 2;
    value.floats = std::move(st);
    primitive.primvars.set(value);
    return primitive;
}

void roughen(grid::Grid& g) {
    const size_t n = size_t(g.stride);
    for (int i = 0; i < g.stride; i++) {
        // Cheap and rough: the benchmark is about dicing.
        const float h = g.P[i] * 911.3f + g.P[i + n] * 733.7f;
        const float d = 0.002f * (h - std::floor(h) - 0.5f);
        for (int c = 0; c < 3; c++)
            g.P[i + c * n] += g.N[i + c * n] * d;
    }
}

struct Settings {
    int threads = 1, repeats = 3;
    bool quick = false;
    std::string_view only;
};

// A case at `pixels` across; quick runs have a quarter of that.
void run(const Settings& settings, std::string_view name, scene::Primitive (*make)(), int pixels,
         const dice::Displace& displace = {}) {
    if (name.find(settings.only) == name.npos)
        return;
    const scene::Primitive primitive = make();
    dice::DiceOptions options;
    options.camera.page_from_camera = Transform::translate(0, 0, -2);
    options.camera.width = options.camera.height = settings.quick ? pixels / 4 : pixels;
    options.camera.pixels_per_tangent = float(options.camera.width);
    Journal journal;
    double best = std::numeric_limits<double>::infinity(), best_cpu = best;
    size_t vertices = 0, cells = 0, traced = 0, grids = 0;
    for (int repeat = 0; repeat < settings.repeats; repeat++) {
        const double start = now(), start_cpu = cpu_now();
        const dice::Diced d = dice::dice(primitive, {}, options, displace, journal);
        best = std::min(best, now() - start);
        best_cpu = std::min(best_cpu, cpu_now() - start_cpu);
        vertices = cells = traced = 0;
        for (const auto& g : d.grids) {
            cells += size_t(g.nu) * g.nv;
            vertices += size_t(g.vertices());
        }
        for (const auto& t : d.traced)
            traced += size_t(t.mu) * t.mv;
        if (d.is_mesh) {
            cells = traced = d.mesh.indices.size() / d.mesh.vertices_per_face;
            vertices = size_t(d.mesh_vertices.vertices());
        }
        grids = d.grids.size();
    }
    std::printf("{\"case\": \"%.*s\", \"threads\": %d, \"seconds\": %.4f, \"cpu_s\": %.4f, \"grids\": %zu, "
                "\"vertices\": %zu, \"cells\": %zu, \"traced\": %zu, \"vertices_per_cpu_s\": %.4g}\n",
                int(name.size()), name.data(), settings.threads, best, best_cpu, grids, vertices, cells,
                traced, double(vertices) / best_cpu);
    std::fflush(stdout);
    for (const auto& e : journal.entries())
        std::fprintf(stderr, "%s\n", e.message.c_str());
}

} // namespace

int main(int argc, char** argv) {
    Settings settings;
    for (int i = 1; i < argc; i++) {
        const std::string_view word = argv[i];
        if (word == "--quick")
            settings.quick = true;
        else if (word == "--threads" && i + 1 < argc)
            settings.threads = std::max(1, std::atoi(argv[++i]));
        else if (word == "--only" && i + 1 < argc)
            settings.only = argv[++i];
        else {
            std::fprintf(stderr,
                         "usage: kanuka_dice_bench [--threads N] [--quick] [--only PART OF A NAME]\n");
            return 2;
        }
    }
    tasks::with_threads(settings.threads, [&] {
        run(settings, "bicubic patch", wavy_patch, 2048);
        run(settings, "bicubic patch, rough", wavy_patch, 2048, roughen);
        run(settings, "terrain of triangles", [] { return terrain(1414); }, 700);
        run(settings, "terrain, diced", [] { return terrain(256); }, 700);
        run(settings, "subdivision, 1 k faces", [] { return torus_cage(32); }, 1400);
        run(settings, "subdivision, 16 k faces", [] { return torus_cage(128); }, 1400);
        run(settings, "subdivision, 65 k faces", [] { return torus_cage(256); }, 1400);
        run(settings, "subdivision, 4 k irregular faces", irregular_cage, 1400);
        run(settings, "subdivision, 262 k small faces", [] { return torus_cage(512); }, 700);
    });
}
