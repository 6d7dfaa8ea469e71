// Times reading RIB: many small patches, and one big mesh, as text and binary, made here; seconds are
// processor time of the one thread. A line of JSON each.
//   kanuka_rib_bench [megabytes of each text] [folder for the files]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/resource.h>

#include "ingest/rib/convert.h"
#include "ingest/rib/rib.h"

using namespace kanuka;

namespace {

uint64_t state = 1;
float random_number() {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return float(state >> 40) / float(1 << 24);
}

// Bicubic patches of 16 points with four to six digits, a colour now and then: what exporters of spline
// models write.
void write_patches(const std::string& path, size_t bytes) {
    std::ofstream out(path);
    out << "##RenderMan RIB\nProjection \"perspective\" \"fov\" [30]\nTranslate 0 0 5\nWorldBegin\n";
    char text[64];
    size_t written = 0;
    for (int i = 0; written < bytes; i++) {
        std::string patch = i % 100 == 0 ? "Color [0.5 0.2 0.7]\n" : "";
        patch += "Patch \"bicubic\" \"P\" [";
        for (int k = 0; k < 48; k++) {
            std::snprintf(text, sizeof text, "%.4g ", double(random_number() * 20 - 10));
            patch += text;
        }
        patch += "]\n";
        out << patch;
        written += patch.size();
    }
    out << "WorldEnd\n";
}

void write_mesh(const std::string& path, size_t bytes) {
    const int n = int(std::sqrt(double(bytes) / 131)); // bytes a quad
    std::ofstream out(path);
    out << "WorldBegin\nPointsPolygons [";
    for (int i = 0; i < n * n; i++)
        out << "4 ";
    out << "] [";
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int v = j * (n + 1) + i;
            out << v << ' ' << v + 1 << ' ' << v + n + 2 << ' ' << v + n + 1 << '\n';
        }
    out << "] \"P\" [";
    char text[96];
    for (int i = 0; i < (n + 1) * (n + 1); i++) {
        std::snprintf(text, sizeof text, "%.7g %.7g %.7g\n", double(random_number()), double(random_number()),
                      double(random_number()));
        out << text;
    }
    out << "] \"facevarying float[2] st\" [";
    for (int i = 0; i < 4 * n * n; i++) {
        std::snprintf(text, sizeof text, "%.5g %.5g\n", double(random_number()), double(random_number()));
        out << text;
    }
    out << "]\nWorldEnd\n";
}

double processor_time() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

double resident_megabytes() { // what the process has held at most
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

void measure(const char* what, const std::string& path) {
    const double size = double(std::filesystem::file_size(path)) / 1e6;
    double best = 1e30;
    size_t primitives = 0;
    for (int i = 0; i < 3; i++) {
        Journal journal;
        const double start = processor_time();
        const scene::Scene scene = ingest::read_rib(path, {}, journal);
        best = std::min(best, processor_time() - start);
        primitives = scene.primitives.size();
    }
    std::printf(
        "{\"what\": \"%s\", \"bytes\": %.0f, \"primitives\": %zu, \"seconds\": %.4f, \"bytes_per_s\": %.0f, "
        "\"peak_bytes\": %.0f}\n",
        what, size * 1e6, primitives, best, size * 1e6 / best, resident_megabytes() * 1048576);
    std::fflush(stdout);
}

} // namespace

int main(int argc, char** argv) {
    const size_t megabytes = argc > 1 ? size_t(std::atoi(argv[1])) : 100;
    const std::string folder = argc > 2 ? argv[2] : std::filesystem::temp_directory_path().string();
    for (const char* kind : {"patches", "mesh"}) {
        const std::string text = folder + "/kanuka_bench_" + kind + ".rib", binary = text + ".bin";
        kind == std::string("mesh") ? write_mesh(text, megabytes * 1000000)
                                    : write_patches(text, megabytes * 1000000);
        Journal journal;
        ingest::convert_rib(text, binary, {.binary = true}, journal);
        measure((std::string(kind) + ", text").c_str(), text);
        measure((std::string(kind) + ", binary").c_str(), binary);
        std::filesystem::remove(text);
        std::filesystem::remove(binary);
    }
}
