// What long work says of itself. The command line draws a bar from it; a library user may listen or stay
// silent.
#pragma once

#include <functional>
#include <string_view>

namespace kanuka {

struct Progress {
    // phase: ingest, dice, shade, build, progressions, film. fraction in [0, 1]. May come from any thread,
    // one at a time.
    std::function<void(std::string_view phase, double fraction)> update = [](std::string_view, double) {};
    // Asked between units of work; true = stop soon and keep what is there.
    std::function<bool()> cancelled = [] { return false; };
};

} // namespace kanuka
