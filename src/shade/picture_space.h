#pragma once

namespace kanuka::shade {

// What a picture's values are: as it says itself; data, whatever it says; encoded as sRGB has it.
enum class PictureSpace { Auto, Raw, Srgb };

} // namespace kanuka::shade
