// Pictures to textures: tiled, mip-mapped files that lookups read a little of.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "scene/scene.h"
#include "shade/picture_space.h"

namespace kanuka::shade {

struct TextureMaking {
    enum class Kind { Texture, LatLong, CubeFaces };
    Kind kind = Kind::Texture;
    // One; of CubeFaces six: px nx py ny pz nz, each as seen from the middle of a left-handed space along its
    // axis, with +y up, but for py -z and for ny +z (RISpec 7.2).
    std::vector<std::string> pictures;
    std::string texture;
    std::string s_wrap = "black", t_wrap = "black"; // black, clamp, periodic, mirror
    std::string filter = "box";                     // from a level to the next
    float fov = 90;                                 // of CubeFaces
    float s_width = 0, t_width = 0; // of the filter, in texels of the level that is made; 0 = its own
    PictureSpace space = PictureSpace::Auto;      // of the pictures' values
    std::string_view unfinished_suffix = ".part"; // of the file while it is written
};

// Writes an OpenEXR file of linear light whatever it is called: of halfs where they hold the picture, else of
// floats. CubeFaces become a latitude-longitude picture as environment() looks them up (shade.h). Throws
// Error.
void make_texture(const TextureMaking& making);

// What a scene asks for before its world (MakeTexture and the like), reported where it cannot be. Returns the
// file that each name stands for: what was written, or the picture itself.
std::map<std::string, std::string> make_textures(const scene::ValueList& options,
                                                 const std::vector<std::string>& folders, Journal& journal);

} // namespace kanuka::shade
