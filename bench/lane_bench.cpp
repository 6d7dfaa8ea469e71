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

#include "transport/integrators/path.h"
#include "transport/test_scene.h"

using namespace kanuka;
using namespace kanuka::transport;
using namespace kanuka::transport::testing;

namespace {

constexpr int Size = 32; // pixels of a side: one batch

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
        camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.9f, Size, Size);
        inputs.max_depth = 5;
        finish();
    }
};

struct Times {
    uint64_t ticks = 0, hits = 0;
};

template <int W>
Times surface_stage(const Room& room, int progressions) {
    Tracer<W> tracer(room.view);
    std::vector<PixelSums> pixels(size_t(Size * Size), PixelSums{});
    Times times;
    BatchCounts counts;
    for (int p = 0; p < progressions; p++) {
        BatchRequest r;
        r.x0 = r.y0 = 0;
        r.x1 = r.y1 = r.stride = Size;
        r.progression = uint32_t(p);
        r.pixels = pixels.data();
        tracer.generate(r, counts);
        while (tracer.count() > 0 && tracer.bounce() <= tracer.scene.last_step()) {
            tracer.intersect();
            tracer.surfaces(
                [&](SurfaceStage<W>& stage, const bsdf::MaterialCode& code, Int<W> slots, Mask<W> active) {
                    const uint64_t start = __builtin_ia32_rdtsc();
                    SurfaceHit<W> hit(stage.at(), code, slots);
                    stage.arrive(hit, active);
                    stage.next_event(hit, active);
                    times.ticks += __builtin_ia32_rdtsc() - start;
                    times.hits += uint64_t(__builtin_popcount(active.bits()));
                });
        }
        tracer.finish();
    }
    return times;
}

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
                                   surface_stage<16>(room, progressions)};
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
