// The state of a picture on disk, so that what was stopped can go on: the pixels' sums as they are, and how
// far each bucket has come.
//
//   magic, version │ key │ window, AOVs, buckets, pixels that may stop │ progressions of each bucket │ and of
//   each pixel that has stopped │ sums │ sums of AOVs │ XXH3-128 of it all
#pragma once

#include <string>

#include "base/digest.h"
#include "render/accumulator.h"

namespace kanuka::render {

// The file appears under its name whole or not at all. Throws Error where it cannot be written.
void save_checkpoint(const std::string& path, const Digest& key, const Accumulator& gathered);
// Fills `gathered`, which has the window and AOVs of the picture. Throws Error, and changes nothing, where
// the file is damaged, or of another picture than the one that `key` is of.
void load_checkpoint(const std::string& path, const Digest& key, Accumulator& gathered);

} // namespace kanuka::render
