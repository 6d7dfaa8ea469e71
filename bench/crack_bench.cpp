// Light leaks through random subdivision, NURBS and displaced surfaces, diced for random cameras. Not run by
// the tests, which do the same with fewer rays.
//   kanuka_crack_bench [--rays N] [--scenes N] [--seed N] [--aimed 0|1]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "render/test_cracks.h"

int main(int argc, char** argv) {
    uint64_t rays = 100'000'000, scenes = 400, seed = 0;
    bool aimed = true; // half of the rays at lines and corners where grids meet
    for (int i = 1; i + 1 < argc; i += 2) {
        const uint64_t n = uint64_t(std::atof(argv[i + 1]));
        if (std::strcmp(argv[i], "--rays") == 0)
            rays = n;
        else if (std::strcmp(argv[i], "--scenes") == 0)
            scenes = n;
        else if (std::strcmp(argv[i], "--seed") == 0)
            seed = n;
        else if (std::strcmp(argv[i], "--aimed") == 0)
            aimed = n != 0;
    }
    scenes = std::max<uint64_t>(1, scenes);
    const auto start = std::chrono::steady_clock::now();
    uint64_t traced = 0, micropolygons = 0, leaks[3] = {};
    for (uint64_t s = 0; s < scenes; s++) {
        const kanuka::render::testing::CrackScene scene(uint32_t(seed + s));
        const uint64_t n = rays / scenes + (s < rays % scenes);
        const auto found = scene.leaks(n, uint32_t(seed + s), aimed);
        if (found[0] + found[1] > 0)
            std::printf("seed %llu, %s: %llu leaks anywhere, %llu at edges, %llu at corners, of %llu rays\n",
                        (unsigned long long)(seed + s), scene.kind.c_str(), (unsigned long long)found[0],
                        (unsigned long long)found[1], (unsigned long long)found[2], (unsigned long long)n);
        for (int k = 0; k < 3; k++)
            leaks[k] += found[size_t(k)];
        traced += n, micropolygons += scene.micropolygons;
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%llu surfaces of %.3g traced cells, %.4g rays, leaks: %llu anywhere, %llu at edges, %llu at "
                "corners; %.1f s\n",
                (unsigned long long)scenes, double(micropolygons), double(traced),
                (unsigned long long)leaks[0], (unsigned long long)leaks[1], (unsigned long long)leaks[2],
                seconds);
    return leaks[0] + leaks[1] > 0; // those at corners: see test_cracks.h
}
