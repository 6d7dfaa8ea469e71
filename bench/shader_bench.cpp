// Times the shading-language compiler and what it makes. Not run by the tests; bench/shaders.py does.
//   kanuka_shader_bench FILE.sl [--lanes N] [--opt N] [--cache FOLDER] [--grid N] [--seconds S]
//   kanuka_shader_bench --arithmetic     a long arithmetic shader against the same maths in C++
// Prints one JSON object. Evaluations are of all stages of a surface at a vertex, on one thread.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <sys/resource.h>

#include "arithmetic.h"
#include "sl/sl.h"

using namespace kanuka;

namespace {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Quiet : sl::Services {
    void texture(const sl::TextureRequest& q) override { fill(q); }
    void environment(const sl::TextureRequest& q, const float*, const float*, const float*) override {
        fill(q);
    }
    bool transform(const char*, const char*, float m[16]) override {
        for (int i = 0; i < 16; i++)
            m[i] = i % 5 == 0;
        return true;
    }
    void report(Severity, const Location&, const std::string&) override {}
    static void fill(const sl::TextureRequest& q) {
        for (int c = 0; c < q.channels; c++)
            std::fill_n(q.result + c * q.result_stride, q.count, 0.5f);
    }
};

grid::Grid make_grid(int n) {
    grid::Grid g;
    g.allocate(n, n);
    const size_t stride = size_t(g.stride);
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++) {
            const size_t k = size_t(j * (n + 1) + i);
            g.u[k] = g.s[k] = float(i) / float(n);
            g.v[k] = g.t[k] = float(j) / float(n);
            g.P[k] = 3 * g.u[k], g.P[stride + k] = 3 * g.v[k], g.P[2 * stride + k] = std::sin(5 * g.u[k]);
            g.N[2 * stride + k] = g.Ng[2 * stride + k] = 1;
            g.dPdu[k] = g.dPdv[stride + k] = 3;
        }
    return g;
}

// Seconds a vertex: the best of three rounds of about `seconds`.
double time_shader(const sl::Shader& shader, int n, double seconds) {
    Quiet services;
    const auto instance = shader.instantiate({}, services);
    grid::Grid g = make_grid(n);
    grid::VertexInputs out;
    const auto once = [&] {
        if (instance->displaces())
            instance->displace(g, {}, services);
        instance->shade(g, {}, services, out);
    };
    once();
    double best = 1e30;
    for (int round = 0; round < 3; round++) {
        const double start = now();
        int runs = 0;
        do
            once(), runs++;
        while (now() - start < seconds);
        best = std::min(best, (now() - start) / runs / g.vertices());
    }
    return best;
}

sl::CompileOptions options(int lanes, int opt, const std::string& cache) {
    sl::CompileOptions o;
    o.lanes = lanes;
    o.opt_level = opt;
    o.use_cache = !cache.empty();
    o.cache_dir = cache;
    return o;
}

void print_messages(const Journal& journal) {
    for (const auto& e : journal.entries())
        std::fprintf(stderr, "%s: %s\n", e.where.str().c_str(), e.message.c_str());
}

int arithmetic() {
    std::printf("{");
    for (int lanes : {1, 8, 16}) {
        Journal journal;
        const auto shader =
            sl::compile_source("arithmetic.sl", arithmetic_shader(), options(lanes, 2, ""), journal);
        if (!shader) {
            print_messages(journal);
            return 1;
        }
        std::printf("\"lanes%d_ns\": %.3f, ", lanes, 1e9 * time_shader(*shader, 64, 0.3));
    }
    grid::Grid g = make_grid(64);
    std::vector<float> r(size_t(g.stride) * 3);
    double best = 1e30;
    for (int round = 0; round < 3; round++) {
        const double start = now();
        int runs = 0;
        do
            arithmetic_by_hand(g.vertices(), g.P.data(), g.P.data() + g.stride, g.P.data() + 2 * g.stride,
                               r.data(), r.data() + g.stride, r.data() + 2 * g.stride),
                runs++;
        while (now() - start < 0.3);
        best = std::min(best, (now() - start) / runs / g.vertices());
    }
    std::printf("\"by_hand_ns\": %.3f}\n", 1e9 * best);
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    std::string file, cache;
    int lanes = 0, opt = 2, grid = 32;
    double seconds = 0.5;
    for (int i = 1; i < argc; i++) {
        const auto is = [&](const char* name) { return std::strcmp(argv[i], name) == 0 && i + 1 < argc; };
        if (std::strcmp(argv[i], "--arithmetic") == 0)
            return arithmetic();
        if (is("--lanes"))
            lanes = std::atoi(argv[++i]);
        else if (is("--opt"))
            opt = std::atoi(argv[++i]);
        else if (is("--cache"))
            cache = argv[++i];
        else if (is("--grid"))
            grid = std::max(1, std::atoi(argv[++i]));
        else if (is("--seconds"))
            seconds = std::atof(argv[++i]);
        else
            file = argv[i];
    }
    Journal journal;
    const double start = now();
    const auto shader = sl::compile_file(file, options(lanes, opt, cache), journal);
    const double compiled = now() - start;
    if (!shader) {
        print_messages(journal);
        return 1;
    }
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    const long compile_rss = usage.ru_maxrss;
    std::printf("{\"compile_s\": %.4f, \"from_cache\": %s, \"peak_bytes\": %ld", compiled,
                shader->from_cache() ? "true" : "false", compile_rss * 1024);
    if (seconds > 0)
        std::printf(", \"vertex_ns\": %.2f", 1e9 * time_shader(*shader, grid, seconds));
    std::printf("}\n");
    return 0;
}
