// The film: pictures, and the writers that put them on disk; pixel filters; comparison of pictures. Data and
// files only; who fills them is transport.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/vec.h"
#include "color/spaces.h"

namespace kanuka::film {

// Channels of a rendered picture, with their names in the EXR: R G B A, albedo.R …, N.X …, Z, P.X …, id.
struct Picture {
    int width = 0, height = 0; // of the data window
    // Display window, and where the data window sits in it. full_width = 0: the two are the same.
    int full_width = 0, full_height = 0, x0 = 0, y0 = 0;
    struct Channel {
        std::string name;
        bool half = true;        // stored as half; else float
        std::vector<float> data; // width * height, row by row from the top
    };
    std::vector<Channel> channels;
    color::Space space = color::Space::Rec709;   // of R G B and albedo: the EXR's chromaticities
    bool names_space = false;                    // read from a file that says which space it is in
    float white_luminance = 0;                   // cd/m2 that (1, 1, 1) stands for; 0 = not known
    std::map<std::string, std::string> metadata; // kanuka.version, kanuka.scene, comments, …
    Channel* find(const std::string& name);      // null = not there
    const Channel* find(const std::string& name) const;
};

// Written to a temporary file beside the target, synced, then renamed: a reader never sees half a picture
// under the final name. Throw Error with ExitCode::Output. EXR: scan lines, ZIP. Finite values beyond the
// range of half are stored as its largest. Metadata whose name is one of the format's own attributes goes
// under "kanuka.NAME".
void write_exr(const std::string& path, const Picture& picture);
// How a PNG is encoded: by a display's curve, or, where that is none, by a gamma alone, as RISpec's quantiser
// has it (RISpec 3.2, 4.1.3): then it is marked as nothing.
struct PngEncoding {
    float gamma = 1;
    std::optional<color::Display> display = color::Display::Srgb;
};
inline constexpr std::string_view LinearDisplay = "linear";
// Of a scene, by the name of its display and the gamma of its Exposure. A gamma that a scene sets is the one
// that its pictures were meant to have, so it takes the place of sRGB's curve. Where it is left at 1 nothing
// is known of the display, and a picture without any curve would be too dark on all of today's: it has
// sRGB's. "linear" is for who compares with pictures that were written so.
PngEncoding png_encoding(std::string_view display, float exposure_gamma);
// Rec.709 primaries, 8 bits, rounded to nearest; (gain * C)^(1 / gamma) applied to
// R G B (or the only channel, as grey) before; A, where it is there, is kept, and colour divided by it. NaN
// is black. Pictures in another space are converted, white to white.
void write_png(const std::string& path, const Picture& picture, float gain, float gamma,
               std::optional<color::Display> display = color::Display::Srgb);
// Any flat EXR without subsampled channels, tiled or not; of a multi-part file the first part. Throws Error
// with ExitCode::Input; hostile files included.
Picture read_exr(const std::string& path);

// Reconstruction filters by importance sampling: each sample belongs to one pixel, so a picture needs no
// splatting and any thread or host count gives the same bits. The offset from the pixel centre is sampled
// with density |f|; `weight` carries the sign, and makes the mean 1 for filters with negative lobes (where it
// is about +-integral |f| / integral f). All filters are separable. A sample from the tables, per axis, for u
// in [0, 1):
//   s = u * TableSize, i = int(s), offset = table[i] + (s - i) * (table[i + 1] - table[i]), weight =
//   weight[i].
class Filter {
  public:
    // Widths are whole widths in pixels, as RISpec's PixelFilter. Throws Error that lists the names.
    Filter(const std::string& name, float width_x, float width_y);
    struct Sample {
        float dx, dy, weight;
    };
    // Any function of both, by its values in the middle of nx times ny cells over the width, rows from -y.
    // Throws Error where they are no filter.
    Filter(std::span<const float> values, int nx, int ny, float width_x, float width_y);
    Sample sample(float u0, float u1) const;
    static std::vector<std::string> names();
    static constexpr int TableSize = 1024;
    const std::vector<float>& table_x() const { return m_table_x; } // TableSize + 1 offsets, rising
    const std::vector<float>& table_y() const { return m_table_y; }
    const std::vector<float>& weight_x() const { return m_weight_x; } // TableSize weights; the two multiply
    const std::vector<float>& weight_y() const { return m_weight_y; }
    bool has_weights() const { return m_has_weights; } // false: every weight is 1

    // Of a filter of values, which has these in place of the tables: a row by the first table, a cell of it
    // by the second, an even place in the cell.
    struct Cells {
        int nx = 0, ny = 0; // 0 = it is one of the named
        float width[2] = {0, 0};
        std::vector<float> rows;   // ny + 1 masses of |f| up to each row, from 0 to 1
        std::vector<float> cells;  // ny times nx + 1, likewise along each row
        std::vector<float> weight; // ny times nx
    };
    const Cells& cells() const { return m_cells; }
    static constexpr int MostCells = 1024; // along an axis

  private:
    Cells m_cells;
    std::vector<float> m_table_x, m_table_y, m_weight_x, m_weight_y;
    bool m_has_weights = false;
};

struct Comparison {
    double relative_mse = 0; // mean of (a - b)^2 / (b^2 + 0.01), over RGB
    double mean_a = 0, mean_b = 0, mean_ratio = 0;
    double max_error = 0; // largest absolute difference
    int max_x = 0, max_y = 0;
    double flip = 0; // mean LDR-FLIP (Andersson et al. 2020) after exposure, 67 pixels a degree
    // Pixels with a NaN or infinity in a or b. They count in no mean; in FLIP they count as black.
    uint64_t nonfinite_a = 0, nonfinite_b = 0;
    Picture difference; // FLIP heat map: R G B for eyes, and the values as channel "flip"
};
// `b` is the reference. FLIP sees both times `gain`, clamped to [0, 1]. Throws Error where sizes differ, or R
// G B is not there.
Comparison compare(const Picture& a, const Picture& b, float gain = 1);

} // namespace kanuka::film
