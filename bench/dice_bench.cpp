// Times dicing: a bicubic patch of about four million micropolygons, plain and roughened, a terrain of four
// million triangles that goes through as a mesh, and a sphere per thousand. Not run by the tests.
//   kanuka_dice_bench [threads]
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "base/tasks.h"
#include "dice/dice.h"

using namespace kanuka;

namespace {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
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

void run(const char* name, const scene::Primitive& primitive, int pixels, const dice::Displace& displace) {
    dice::DiceOptions options;
    options.camera.render_from_camera = Transform::translate(0, 0, -2);
    options.camera.width = options.camera.height = pixels;
    options.camera.pixels_per_tangent = float(pixels);
    Journal journal;
    for (int repeat = 0; repeat < 3; repeat++) {
        const double start = now();
        const dice::Diced d = dice::dice(primitive, {}, options, displace, journal);
        const double seconds = now() - start;
        double cells = 0, traced = 0;
        for (const auto& g : d.grids)
            cells += double(g.nu) * g.nv;
        for (const auto& t : d.traced)
            traced += double(t.mu) * t.mv;
        if (d.is_mesh)
            cells = traced = double(d.mesh.indices.size()) / d.mesh.vertices_per_face;
        std::printf("%-22s %8.3f s  %7.3f M cells  %7.3f M traced  %6.1f ns a cell\n", name, seconds,
                    cells * 1e-6, traced * 1e-6, seconds / std::max(cells, 1.0) * 1e9);
    }
    for (const auto& e : journal.entries())
        std::printf("  %s\n", e.message.c_str());
}

} // namespace

int main(int argc, char** argv) {
    const int threads = argc > 1 ? std::atoi(argv[1]) : 0;
    tasks::with_threads(threads, [] {
        run("bicubic patch", wavy_patch(), 2048, {});
        run("bicubic patch, rough", wavy_patch(), 2048, roughen);
        run("terrain of triangles", terrain(1414), 700, {});
        run("terrain, diced", terrain(256), 700, {});
        run("subdivision, 4 x 4", torus_cage(256), 1400, {});
        run("subdivision, 1 x 1", torus_cage(512), 700, {});
    });
}
