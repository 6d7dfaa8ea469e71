// What lanes bring on the surface stage: one source at 1, 8 and 16 of them.
//
//     lane_bench [--quick] [--rounds=N]        a line of JSON for each material, with nanoseconds a hit round
//     by round
//
// A room that is of one material altogether, so that nothing else is hit but its lamp; the stage is what the
// path integrator does with hits: their geometry, the light that leaves them, the light that is asked, the
// direction that is drawn. Rays are traced outside of what is timed.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "base/cpu.h"
#include "lane_stage.h"

using namespace kanuka;
using namespace kanuka::transport;
using namespace kanuka::transport::testing;

namespace {

struct Room : TestScene {
    explicit Room(const std::vector<Lobe>& wall) {
        const Vec3f x{2, 0, 0}, y{0, 2, 0}, z{0, 0, 2}, c{0, 0, 2};
        add_quad(c + z, y, x, wall), add_quad(c - z, x, y, wall);
        add_quad(c + x, z, y, wall), add_quad(c - x, y, z, wall);
        add_quad(c + y, x, z, wall), add_quad(c - y, z, x, wall);
        add_quad(c + y * 0.99f, {0.5f, 0, 0}, {0, 0, 0.5f}, {emission(Rgb(10))});
        add_sphere({-0.8f, -1, 2.4f}, 0.9f, 24, wall);
        add_sphere({1, -1.2f, 2.8f}, 0.8f, 24, wall);
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
    bool quick = false;
    int rounds = 5;
    for (int i = 1; i < argc; i++) {
        quick |= std::strcmp(argv[i], "--quick") == 0;
        if (std::strncmp(argv[i], "--rounds=", 9) == 0)
            rounds = std::max(1, std::atoi(argv[i] + 9));
    }
    const int progressions = quick ? 4 : 64;
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
        std::string ns[3];
        for (int round = 0; round < (quick ? 1 : rounds); round++)
            for (int turn = 0; turn < 3; turn++) {
                const int k = round % 2 ? 2 - turn : turn;
                const Times t = k == 0   ? surface_stage<1>(room, progressions)
                                : k == 1 ? surface_stage<8>(room, progressions)
                                         : sixteen_lanes(room, progressions);
                ns[k] +=
                    (ns[k].empty() ? "" : ", ") + std::to_string(double(t.ticks) / rate / double(t.hits));
            }
        std::printf("{\"material\": \"%s\", \"rounds\": {\"1\": [%s], \"8\": [%s], \"16\": [%s]}}\n",
                    material.name, ns[0].c_str(), ns[1].c_str(), ns[2].c_str());
        std::fflush(stdout);
    }
}
