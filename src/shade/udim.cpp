#include "shade/udim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>

namespace kanuka::shade {

namespace fs = std::filesystem;

namespace {

constexpr int First = 1001, Columns = 10, Rows = 900;
constexpr std::array<std::string_view, 3> Marks = {"<UDIM>", "<udim>", "<UVTILE>"};

struct Mark {
    size_t at, size;
    bool uv;
};

std::optional<Mark> find_mark(std::string_view name) {
    for (const std::string_view mark : Marks)
        if (const size_t at = name.rfind(mark); at != std::string_view::npos)
            return Mark{at, mark.size(), mark == "<UVTILE>"};
    return std::nullopt;
}

std::string text_of(int tile, bool uv) {
    if (!uv)
        return std::to_string(tile);
    return "u" + std::to_string((tile - First) % Columns + 1) + "_v" +
           std::to_string((tile - First) / Columns + 1);
}

bool is_tile(std::string_view text, bool uv) {
    if (!uv)
        return text.size() == 4 && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
    const size_t middle = text.find("_v");
    return text.size() <= 10 && text.starts_with('u') && middle != std::string_view::npos &&
           std::ranges::all_of(text.substr(1, middle - 1), [](char c) { return c >= '0' && c <= '9'; }) &&
           std::ranges::all_of(text.substr(middle + 2), [](char c) { return c >= '0' && c <= '9'; });
}

// Where a coordinate lies: among whole tiles, and whether on the border with the one before.
struct Place {
    int tile;
    bool border;
};
Place place(float x, int count) {
    const float low = std::isfinite(x) ? std::clamp(x, 0.0f, float(count)) : 0.0f;
    const float whole = std::floor(low);
    return {std::min(int(whole), count - 1), low == whole && whole > 0 && whole < float(count)};
}

int column_of(int tile) {
    return (tile - First) % Columns;
}
int row_of(int tile) {
    return (tile - First) / Columns;
}

} // namespace

bool has_tiles(std::string_view name) {
    return find_mark(name).has_value();
}

std::string tile_name(const std::string& name, int tile) {
    const auto mark = find_mark(name);
    std::string file = name;
    return mark ? file.replace(mark->at, mark->size, text_of(tile, mark->uv)) : file;
}

std::vector<std::string> tile_files(const std::string& name, std::span<const std::string> folders) {
    const fs::path path(name);
    const std::string pattern = path.filename().string();
    const auto mark = find_mark(pattern);
    if (!mark)
        return {};
    const std::string_view before = std::string_view(pattern).substr(0, mark->at),
                           after = std::string_view(pattern).substr(mark->at + mark->size);
    const std::vector<std::string> itself = {""};
    for (const std::string& folder : path.is_absolute() ? std::span<const std::string>(itself) : folders) {
        std::vector<std::string> files;
        std::error_code failed;
        for (fs::directory_iterator it(fs::path(folder) / path.parent_path(), failed), end;
             !failed && it != end; it.increment(failed)) {
            const std::string file = it->path().filename().string();
            if (file.size() > before.size() + after.size() && file.starts_with(before) &&
                file.ends_with(after) &&
                is_tile(
                    std::string_view(file).substr(before.size(), file.size() - before.size() - after.size()),
                    mark->uv))
                files.push_back(it->path().string());
        }
        std::ranges::sort(files);
        if (!files.empty())
            return files;
    }
    return {};
}

std::vector<int> tiles_of(const sl::TextureRequest& request, const std::function<bool(int)>& exists) {
    const auto tile_at = [](int column, int row) { return First + column + Columns * row; };
    std::vector<int> tiles(size_t(request.count));
    std::vector<std::pair<Place, Place>> places(size_t(request.count));
    std::set<int> inside;
    for (int i = 0; i < request.count; i++) {
        auto& [s, v] = places[size_t(i)];
        s = place(request.s[i], Columns), v = place(1 - request.t[i], Rows);
        tiles[size_t(i)] = tile_at(s.tile, v.tile);
        if (!s.border && !v.border)
            inside.insert(tiles[size_t(i)]);
    }
    for (size_t i = 0; i < tiles.size(); i++) {
        const auto& [s, v] = places[i];
        if (!s.border && !v.border)
            continue;
        const auto first = [&](const std::function<bool(int)>& fits) {
            for (const int down : {0, 1})
                for (const int left : {0, 1})
                    if ((!left || s.border) && (!down || v.border))
                        if (const int tile = tile_at(s.tile - left, v.tile - down); fits(tile)) {
                            tiles[i] = tile;
                            return true;
                        }
            return false;
        };
        if (!first([&](int tile) { return inside.contains(tile); }))
            first(exists);
    }
    return tiles;
}

TileRequest::TileRequest(const sl::TextureRequest& all, std::span<const int> tiles, int tile)
    : m_request(all) {
    for (int i = 0; i < all.count; i++)
        if (tiles[size_t(i)] == tile)
            m_points.push_back(i);
    const float* from[6] = {all.s, all.t, all.dsdu, all.dtdu, all.dsdv, all.dtdv};
    const float shift[6] = {-float(column_of(tile)), float(row_of(tile))};
    for (size_t k = 0; k < 6; k++)
        for (const int point : m_points)
            m_values[k].push_back(from[k] ? from[k][point] + shift[k] : 0);
    m_result.resize(m_points.size() * size_t(std::max(0, all.channels)));
}

const sl::TextureRequest& TileRequest::request(const std::string& file) {
    m_request.file = file.c_str();
    m_request.s = m_values[0].data(), m_request.t = m_values[1].data();
    m_request.dsdu = m_values[2].data(), m_request.dtdu = m_values[3].data();
    m_request.dsdv = m_values[4].data(), m_request.dtdv = m_values[5].data();
    m_request.count = m_request.result_stride = int(m_points.size());
    m_request.result = m_result.data();
    m_request.wrap = "clamp"; // beyond it is another tile
    return m_request;
}

void TileRequest::scatter(const sl::TextureRequest& all) const {
    for (size_t c = 0; c < size_t(std::max(0, all.channels)); c++)
        for (size_t i = 0; i < m_points.size(); i++)
            all.result[c * size_t(all.result_stride) + size_t(m_points[i])] =
                m_result[c * m_points.size() + i];
}

} // namespace kanuka::shade
