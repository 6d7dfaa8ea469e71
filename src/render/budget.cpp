#include "render/budget.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <sys/resource.h>
#include <unistd.h>

#include "base/error.h"

namespace kanuka::render {

namespace {

std::string gigabytes(uint64_t bytes) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f GB", double(bytes) * 1e-9);
    return text;
}

} // namespace

uint64_t machine_memory() {
    uint64_t most = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
    rlimit limit;
    if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        most = std::min(most, uint64_t(limit.rlim_cur));
    for (const char* file : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"})
        if (uint64_t bytes = 0; std::ifstream(file) >> bytes && bytes > 0) // else "max"
            most = std::min(most, bytes);
    return most;
}

// The limit of resources tells the parent's peak too, where that is larger.
uint64_t peak_memory() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:"))
            return std::stoull(line.substr(6)) << 10;
    return 0;
}

void refuse_what_cannot_fit(const Window& window, size_t aovs, uint64_t memory, int sums) {
    constexpr uint64_t Layers = 20; // floats of the picture that is made of the sums
    const uint64_t a_pixel = uint64_t(sums) * (sizeof(transport::PixelSums) + sizeof(float) * aovs) +
                             sizeof(float) * (Layers + aovs);
    const uint64_t pixels = uint64_t(window.width()) * uint64_t(window.height()), bytes = pixels * a_pixel;
    if (bytes > memory)
        throw CannotFit("a picture of " + std::to_string(window.width()) + " by " +
                            std::to_string(window.height()) + " pixels takes " + gigabytes(bytes) +
                            " of memory, and there are " + gigabytes(memory) +
                            ": render it in parts (crop windows" +
                            (sums > 1 ? ", or fewer progressions)" : ")") + ", or smaller",
                        ExitCode::Usage);
}

void refuse_geometry_that_cannot_fit(uint64_t bytes, uint64_t memory) {
    if (bytes > memory / 2) // the tracer's own takes about as much again
        throw CannotFit("the geometry takes more than " + gigabytes(bytes) +
                        ", and as much again to be traced; there are " + gigabytes(memory) +
                        ": a larger shading rate, a smaller picture or instances would do");
}

void refuse_primitive_that_cannot_fit(const Location& where, uint64_t bytes, uint64_t there,
                                      uint64_t memory) {
    throw CannotFit(where, "this primitive takes " + gigabytes(bytes) +
                               " while it is diced and shaded, beside " + gigabytes(there) +
                               " of geometry; there are " + gigabytes(memory) +
                               ": a larger shading rate, a smaller picture, or splitting it up would do");
}

void check_threads(int threads) {
    if (threads < 0 || threads > MostThreads)
        throw Error(std::to_string(threads) + " threads are asked for; there may be 1 to " +
                        std::to_string(MostThreads) + ", or 0 for all that the machine has",
                    ExitCode::Usage);
}

} // namespace kanuka::render
