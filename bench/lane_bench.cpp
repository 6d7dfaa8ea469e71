// What lanes bring on the surface stage: one source at 1, 8 and 16 of them.
//
//     lane_bench [--quick]        one line of JSON a material, times are medians of five rounds
//
// A room whose things are of one material; the stage is what the path integrator does with hits: their
// geometry, the light that leaves them, the light that is asked, the direction that is drawn. Rays are traced
// outside of what is timed.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "base/cpu.h"
#include "lane_stage.h"

using namespace kanuka;
using namespace kanuka::transport;
using namespace kanuka::transport::testing;

namespace {

struct Room : TestScene {
    explicit Room(const std::vector<Lobe>& things) {
        const std::vector<Lobe> wall{matte({0.7f, 0.6f, 0.5f})};
        const Vec3f x{2, 0, 0}, y{0, 2, 0}, z{0, 0, 2}, c{0, 0, 2};
        add_quad(c + z, y, x, wall), add_quad(c - z, x, y, wall);
        add_quad(c + x, z, y, wall), add_quad(c - x, y, z, wall);
        add_quad(c + y, x, z, wall), add_quad(c - y, z, x, wall);
        add_quad(c + y * 0.99f, {0.5f, 0, 0}, {0, 0, 0.5f}, {glow(Rgb(10))});
        add_sphere({-0.8f, -1, 2.4f}, 0.9f, 24, things);
        add_sphere({1, -1.2f, 2.8f}, 0.8f, 24, things);
        camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.9f, RoomSize, RoomSize);
        inputs.max_depth = 5;
        finish();
    }
};

double ticks_a_nanosecond() {
    const auto start = std::chrono::steady_clock::now();
    const uint64_t ticks = __builtin_ia32_rdtsc();
    while (std::chrono::steady_clock::now() - start < std::chrono::milliseconds(50)) {
    }
    const auto ns =
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
    return double(__builtin_ia32_rdtsc() - ticks) / ns;
}

} // namespace

int main(int argc, char** argv) {
    const bool quick = argc > 1 && std::strcmp(argv[1], "--quick") == 0;
    const double rate = ticks_a_nanosecond();
    const auto sixteen_lanes = has_avx512() ? surface_stage_avx512 : surface_stage_16;
    const Lobe coat{grid::LobeId::MicrofacetDielectricBrdf, {Vec3f(0.1f)}};
    const struct {
        const char* name;
        std::vector<Lobe> lobes;
    } materials[] = {{"matte", {matte(Rgb(0.6f))}},
                     {"metal", {metal(0.2f, Rgb(0.9f))}},
                     {"glass", {glass(0.1f)}},
                     {"coated", {matte(Rgb(0.5f)), coat}}};
    for (const auto& material : materials) {
        const Room room(material.lobes);
        const int rounds = quick ? 1 : 5, progressions = quick ? 4 : 64;
        std::vector<double> ns[3];
        for (int round = 0; round < rounds; round++) {
            const Times times[] = {surface_stage<1>(room, progressions), surface_stage<8>(room, progressions),
                                   sixteen_lanes(room, progressions)};
            for (int k = 0; k < 3; k++)
                ns[k].push_back(double(times[k].ticks) / rate / double(times[k].hits));
        }
        for (auto& each : ns)
            std::nth_element(each.begin(), each.begin() + rounds / 2, each.end());
        const double one = ns[0][size_t(rounds / 2)], eight = ns[1][size_t(rounds / 2)],
                     sixteen = ns[2][size_t(rounds / 2)];
        std::printf("{\"material\": \"%s\", \"ns_1\": %.1f, \"ns_8\": %.1f, \"ns_16\": %.1f, \"of_8\": %.2f, "
                    "\"of_16\": %.2f}\n",
                    material.name, one, eight, sixteen, one / eight, one / sixteen);
        std::fflush(stdout);
    }
}
