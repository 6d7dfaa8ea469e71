// How the time of a sample and its noise go with the number of lights.
//
//     light_bench [--quick] [--times]        one line of JSON a measurement; --times: without noise
//
// The time to equal quality of one choice among n lights is noise^2 times time; uniform choice is the
// measure.
#include <chrono>
#include <cstdio>
#include <cstring>

#include "transport/test_many_lights.h"

using namespace kanuka;
using namespace kanuka::transport;
using namespace kanuka::transport::testing;

namespace {

constexpr int Size = 128;

double seconds_of(TestScene& s, int progressions) {
    const auto start = std::chrono::steady_clock::now();
    s.render(progressions, 0);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Standard deviation of a sample over the mean of its pixel, averaged over the picture; means from `truth`.
double noise_of(TestScene& s, const std::vector<PixelSums>& truth, int progressions) {
    s.view.settings.seed = 77;
    double sum = 0;
    const auto pixels = s.render(progressions, 0);
    for (size_t i = 0; i < pixels.size(); i++) {
        const double d = double(pixels[i].rgb[1]) - double(truth[i].rgb[1]);
        sum += d * d / (double(truth[i].rgb[1]) * double(truth[i].rgb[1]) + 1e-3);
    }
    s.view.settings.seed = 0;
    return std::sqrt(sum / double(pixels.size()) * progressions);
}

} // namespace

int main(int argc, char** argv) {
    bool quick = false, times = false;
    for (int i = 1; i < argc; i++) {
        quick |= std::strcmp(argv[i], "--quick") == 0;
        times |= std::strcmp(argv[i], "--times") == 0;
    }
    const struct {
        const char* name;
        ManyLights kind;
    } kinds[] = {{"points", ManyLights::Points},
                 {"spheres", ManyLights::Spheres},
                 {"triangles", ManyLights::Triangles},
                 {"lit facets", ManyLights::LitFacets}};
    for (const auto& kind : kinds)
        for (int count : {10, 100, 1000, 10000, 100000}) {
            if (quick && (count > 10000 || kind.kind == ManyLights::LitFacets))
                continue;
            const auto start = std::chrono::steady_clock::now();
            ManyLightsScene s(kind.kind, count, Size);
            const double build =
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            const int progressions = quick ? 8 : 32;
            s.render(1, 0);
            double best = 1e9;
            for (int round = 0; round < (quick ? 1 : 3); round++)
                best = std::min(best, seconds_of(s, progressions));
            std::printf("{\"lights\": \"%s\", \"count\": %d, \"build_s\": %.4f, \"ns_a_sample\": %.1f",
                        kind.name, count, build, best / progressions / (Size * Size) * 1e9);
            if (times) {
                std::printf("}\n");
                continue;
            }
            const auto truth = s.render(quick ? 64 : 512, 0);
            const double noise = noise_of(s, truth, quick ? 8 : 64);
            double uniform = 0;
            if (!s.view.lights.tree.empty()) {
                s.make_uniform();
                uniform = noise_of(s, truth, quick ? 8 : 64);
            }
            std::printf(", \"noise\": %.4f, \"uniform_noise\": %.4f, \"tree_bytes\": %llu}\n", noise, uniform,
                        static_cast<unsigned long long>(s.data.lights.tree.bytes()));
            std::fflush(stdout);
        }
}
