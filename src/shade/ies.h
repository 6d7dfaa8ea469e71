// Photometric files of luminaires: IESNA LM-63 (1986, 1991, 1995, 2002), type C.
#pragma once

#include <memory>
#include <string_view>

#include "base/error.h"
#include "scene/scene.h"

namespace kanuka::shade {

// Luminous intensity by direction, its largest value made 1. Vertical angle 0 is the light's +z, horizontal
// angle 0 its +x, 90 degrees its +y; between angles it is linear. `text` may be anything: throws Error with
// `file` and the line of what cannot be read.
std::shared_ptr<const scene::LightTable> parse_ies(std::string_view text, const std::string& file);
// Null = reported for `asker`.
std::shared_ptr<const scene::LightTable> read_ies(const std::string& file, const Location& asker,
                                                  Journal& journal);

} // namespace kanuka::shade
