#include "geom/ground_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

namespace kanuka::geom {
namespace {

constexpr uint32_t Magic = 0x2F0867AB;
constexpr size_t Header = 8 + 2 * 64;

uint32_t turned(uint32_t v) {
    return v >> 24 | (v >> 8 & 0xFF00) | (v << 8 & 0xFF0000) | v << 24;
}

} // namespace

std::shared_ptr<const GroundMap> GroundMap::read(const std::string& path, std::string& why) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    const auto word = [&](size_t at) {
        uint32_t v;
        std::memcpy(&v, bytes.data() + at, 4);
        return v;
    };
    if (bytes.empty()) {
        why = "there is no file of depths \"" + path +
              "\". A renderer that makes shadow maps writes it (Display \"FILE\" \"zfile\" \"z\"); it is "
              "looked for in "
              "Option \"searchpath\" \"texture\"";
        return nullptr;
    }
    if (bytes.size() < Header || (word(0) != Magic && turned(word(0)) != Magic)) {
        why = "\"" + path + "\" is no file of depths (they begin with 2F0867AB)";
        return nullptr;
    }
    const bool turn = word(0) != Magic;
    const auto number = [&](size_t at) { return std::bit_cast<float>(turn ? turned(word(at)) : word(at)); };
    const auto size = [&](size_t at) {
        uint16_t v;
        std::memcpy(&v, bytes.data() + at, 2);
        return int(turn ? uint16_t(v >> 8 | v << 8) : v);
    };
    auto map = std::make_shared<GroundMap>();
    map->m_width = size(4);
    map->m_height = size(6);
    const size_t texels = size_t(map->m_width) * size_t(map->m_height);
    if (texels == 0 || bytes.size() < Header + 4 * texels) {
        why = "\"" + path + "\" ends early: " + std::to_string(map->m_width) + " x " +
              std::to_string(map->m_height) + " depths take " + std::to_string(Header + 4 * texels) +
              " bytes, found " + std::to_string(bytes.size());
        return nullptr;
    }
    for (size_t r = 0; r < 4; r++)
        for (size_t c = 0; c < 4; c++) { // row vectors there, columns here
            map->m_screen_from_world.m[c][r] = double(number(8 + 4 * (4 * r + c)));
            map->m_camera_from_world.m[c][r] = double(number(72 + 4 * (4 * r + c)));
            if (!std::isfinite(map->m_screen_from_world.m[c][r] + map->m_camera_from_world.m[c][r])) {
                why = "\"" + path + "\" has matrices that are not finite";
                return nullptr;
            }
        }
    map->m_depths.resize(texels);
    for (size_t i = 0; i < texels; i++) {
        const float z = number(Header + 4 * i);
        map->m_depths[i] = std::isfinite(z) && z < float(Nothing) ? z : float(Nothing);
    }
    map->make_levels();
    return map;
}

void GroundMap::make_levels() {
    // Each texel with its neighbours, between which depths are interpolated; then squares of four.
    Level level{m_width, m_height, m_depths, m_depths};
    for (int y = 0; y < m_height; y++)
        for (int x = 0; x < m_width; x++)
            for (int j = std::max(0, y - 1); j <= std::min(m_height - 1, y + 1); j++)
                for (int i = std::max(0, x - 1); i <= std::min(m_width - 1, x + 1); i++) {
                    const float z = m_depths[size_t(j) * m_width + i];
                    float &lo = level.lo[size_t(y) * m_width + x], &hi = level.hi[size_t(y) * m_width + x];
                    lo = std::min(lo, z), hi = std::max(hi, z);
                }
    m_levels.push_back(std::move(level));
    while (m_levels.back().width > 1 || m_levels.back().height > 1) {
        const Level& fine = m_levels.back();
        Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}, {}};
        const size_t n = size_t(coarse.width) * size_t(coarse.height);
        coarse.lo.assign(n, float(Nothing));
        coarse.hi.assign(n, -float(Nothing));
        for (int y = 0; y < fine.height; y++)
            for (int x = 0; x < fine.width; x++) {
                const size_t from = size_t(y) * fine.width + x, to = size_t(y / 2) * coarse.width + x / 2;
                coarse.lo[to] = std::min(coarse.lo[to], fine.lo[from]);
                coarse.hi[to] = std::max(coarse.hi[to], fine.hi[from]);
            }
        m_levels.push_back(std::move(coarse));
    }
}

static double row(const Transform& m, size_t r, const double* p) {
    return m.m[r][0] * p[0] + m.m[r][1] * p[1] + m.m[r][2] * p[2] + m.m[r][3];
}

bool GroundMap::raster(const double* p, double* xy) const {
    const double w = row(m_screen_from_world, 3, p);
    if (!(w > 0))
        return false;
    xy[0] = (0.5 + 0.5 * row(m_screen_from_world, 0, p) / w) * m_width;
    xy[1] = (0.5 - 0.5 * row(m_screen_from_world, 1, p) / w) * m_height;
    return true;
}

double GroundMap::depth(double x, double y) const {
    if (!(x >= 0 && y >= 0 && x <= m_width && y <= m_height))
        return Nothing;
    const double fx = std::clamp(x - 0.5, 0.0, m_width - 1.0), fy = std::clamp(y - 0.5, 0.0, m_height - 1.0);
    const int i = std::min(int(fx), std::max(0, m_width - 2)),
              j = std::min(int(fy), std::max(0, m_height - 2));
    const int right = std::min(i + 1, m_width - 1), below = std::min(j + 1, m_height - 1);
    const auto at = [&](int a, int b) { return double(m_depths[size_t(b) * m_width + a]); };
    const double u = fx - i, v = fy - j;
    return (1 - v) * ((1 - u) * at(i, j) + u * at(right, j)) +
           v * ((1 - u) * at(i, below) + u * at(right, below));
}

double GroundMap::height(const double* p) const {
    double xy[2];
    return raster(p, xy) ? depth(xy[0], xy[1]) - row(m_camera_from_world, 2, p) : Nothing;
}

GroundMap::Range GroundMap::heights(const double (*corners)[3]) const {
    double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300}, near = 1e300, far = -1e300;
    for (int k = 0; k < 8; k++) {
        const double z = row(m_camera_from_world, 2, corners[k]);
        near = std::min(near, z), far = std::max(far, z);
        double xy[2];
        if (!raster(corners[k], xy)) { // it may be anywhere in the picture
            lo[0] = lo[1] = -1;
            hi[0] = m_width + 1, hi[1] = m_height + 1;
            continue;
        }
        for (int c = 0; c < 2; c++)
            lo[c] = std::min(lo[c], xy[c]), hi[c] = std::max(hi[c], xy[c]);
    }
    if (hi[0] < 0 || hi[1] < 0 || lo[0] > m_width || lo[1] > m_height)
        return {Nothing, Nothing};
    const bool beside = lo[0] < 0 || lo[1] < 0 || hi[0] > m_width || hi[1] > m_height;
    int a[2], b[2];
    const int last[2] = {m_width - 1, m_height - 1};
    for (int c = 0; c < 2; c++) {
        a[c] = int(std::clamp(lo[c], 0.0, double(last[c])));
        b[c] = int(std::clamp(hi[c], 0.0, double(last[c])));
    }
    size_t k = 0;
    while (k + 1 < m_levels.size() && std::max((b[0] >> k) - (a[0] >> k), (b[1] >> k) - (a[1] >> k)) > 2)
        k++;
    const Level& level = m_levels[k];
    double least = Nothing, most = beside ? Nothing : -Nothing;
    for (int y = a[1] >> k; y <= b[1] >> k; y++)
        for (int x = a[0] >> k; x <= b[0] >> k; x++) {
            least = std::min(least, double(level.lo[size_t(y) * level.width + x]));
            most = std::max(most, double(level.hi[size_t(y) * level.width + x]));
        }
    return {least - far, most - near};
}

} // namespace kanuka::geom
