// Pictures for scenes to name, small, in the formats that textures are read from.
#pragma once

#include <string>

#include "film/film.h"

namespace kanuka::fuzz {

film::Picture sample_picture(); // to be written as EXR
std::string sample_bmp();
std::string sample_tiff();

} // namespace kanuka::fuzz
