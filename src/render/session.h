// Sessions drive the whole way: scene to picture. The batch session renders to the last pixel.
#pragma once

#include <memory>
#include <string>

#include "base/error.h"
#include "base/progress.h"
#include "base/stats.h"
#include "film/film.h"
#include "scene/delayed.h"
#include "scene/schema/options.h"

namespace kanuka::render {

// What the command line or Python sets over the scene's own options; unset = as the scene says.
struct Overrides {
    scene::OptionEdits options;
    std::optional<int> threads;
    std::optional<float> shading_rate; // multiplies every attribute's
    std::optional<scene::Camera> camera;
    std::vector<std::string> aovs;     // output parameters of surfaces, beside those that displays ask for
    int lanes = 0;                     // transport and shading lanes: 1, 8, 16; 0 = widest
    std::string standard_shaders;      // folder
    scene::Delayed* delayed = nullptr; // procedurals to be read when rays meet them
    std::optional<uint64_t> memory;    // bytes that there are; unset = the machine's
};

struct Result {
    film::Picture picture;
    bool cancelled = false;
};

// Renders the scene. Fills `stats` and the journal; throws Error only where no picture can be made. The
// scene's large buffers may be released as soon as they are diced. Bit-identical for any thread count.
Result render(const scene::Scene& scene, const Overrides& overrides, Journal& journal, Stats& stats,
              const Progress& progress);

} // namespace kanuka::render
