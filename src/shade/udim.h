// Pictures of many tiles, a file each: "skin.<UDIM>.exr" stands for skin.1001.exr where s and v = 1 - t are
// between 0 and 1, skin.1002.exr to its right (ten in a row), skin.1011.exr above; "skin_<UVTILE>.exr" for
// skin_u1_v1.exr and so on.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sl/sl.h"

namespace kanuka::shade {

bool has_tiles(std::string_view name);
std::string tile_name(const std::string& name, int tile); // 1001 …: the file's

// All tiles there are in the first of the folders that has any, sorted; absolute names are taken as they are.
std::vector<std::string> tile_files(const std::string& name, std::span<const std::string> folders);

// The tile of each point. Vertices lie on borders of tiles as often as not: one there belongs to the tile
// that other points of the request are inside of, else to one that `exists`.
std::vector<int> tiles_of(const sl::TextureRequest& request, const std::function<bool(int tile)>& exists);

// What is looked up in one tile: those of the request's points, in its coordinates.
class TileRequest {
  public:
    TileRequest(const sl::TextureRequest& all, std::span<const int> tiles, int tile);
    const sl::TextureRequest& request(const std::string& file);
    void scatter(const sl::TextureRequest& all) const;

  private:
    std::vector<int> m_points;
    std::vector<float> m_values[6], m_result;
    sl::TextureRequest m_request;
};

} // namespace kanuka::shade
