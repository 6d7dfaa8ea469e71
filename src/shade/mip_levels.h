// The levels of a texture, each from the one before it, by a filter of given widths.
#pragma once

#include <OpenImageIO/imagebuf.h>
#include <string>
#include <vector>

namespace kanuka::shade {

struct MipFilter {
    std::string name = "box";
    float s_width = 0, t_width = 0; // in texels of the level that is made (RISpec 7.1); 0 = the filter's own
    std::string s_wrap = "black", t_wrap = "black"; // what lies beyond the picture's edges
};

std::string mip_filter_names(); // "box, triangle, …", for messages
bool is_mip_filter(const std::string& name);

// From the picture itself to a single texel, sides halved and rounded down. Of floats.
std::vector<OIIO::ImageBuf> mip_levels(OIIO::ImageBuf picture, const MipFilter& filter);

} // namespace kanuka::shade
