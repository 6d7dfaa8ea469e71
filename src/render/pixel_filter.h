// The pixel filter that a scene's options ask for.
#pragma once

#include <memory>

#include "film/film.h"
#include "scene/scene.h"

namespace kanuka::render {

// The name "table" stands for the values of Option "pixelfilter". What cannot be is reported; a Gaussian
// stands in.
std::unique_ptr<film::Filter> make_filter(const scene::Options& options, const Location& where,
                                          Journal& journal);

} // namespace kanuka::render
