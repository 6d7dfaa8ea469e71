#include "scene/picture_name.h"

#include <algorithm>
#include <cctype>

namespace kanuka::scene {

namespace {

constexpr std::string_view Suffixes[] = {"als",   "bmp", "dpx", "exr", "gif",  "hdr",  "iff", "it",
                                         "jpeg",  "jpg", "mpg", "pct", "pic",  "pict", "png", "pnm",
                                         "ppm",   "psd", "ras", "rgb", "rgba", "rla",  "sgi", "sun",
                                         "targa", "tex", "tga", "tif", "tiff", "tx",   "xpm"};

} // namespace

bool is_picture_suffix(std::string_view suffix) {
    if (suffix.size() < 2 || suffix[0] != '.')
        return false;
    std::string lower(suffix.substr(1));
    std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return std::ranges::find(Suffixes, lower) != std::end(Suffixes);
}

std::string picture_file(std::string_view name) {
    const size_t folder = name.rfind('/') == std::string_view::npos ? 0 : name.rfind('/') + 1;
    const size_t dot = name.rfind('.');
    const bool suffixed =
        dot != std::string_view::npos && dot > folder && is_picture_suffix(name.substr(dot));
    return std::string(suffixed ? name.substr(0, dot) : name) + ".exr";
}

} // namespace kanuka::scene
