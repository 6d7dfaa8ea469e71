// The film: pixels that accumulate, and the writers that put them on disk. Data and files only; who fills it is transport.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/vec.h"

namespace kanuka::film {

// Channels of a rendered picture, with their names in the EXR: R G B A, albedo.R …, N.X …, Z, P.X …, id.
struct Picture {
    int width = 0, height = 0;      // of the data window
    int full_width = 0, full_height = 0, x0 = 0, y0 = 0; // display window, and where the data window sits in it
    struct Channel {
        std::string name;
        bool half = true;           // stored as half; else float
        std::vector<float> data;    // width * height, row by row from the top
    };
    std::vector<Channel> channels;
    std::map<std::string, std::string> metadata; // kanuka.version, kanuka.scene, …
    Channel* find(const std::string& name);
    const Channel* find(const std::string& name) const;
};

// Written to a temporary file beside the target, synced, then renamed: a reader never sees half a picture under the
// final name. Throw Error with ExitCode::Output.
void write_exr(const std::string& path, const Picture& picture);
// sRGB, 8 bits with blue-noise-free rounding; exposure gain and gamma applied to R G B, A kept if there.
void write_png(const std::string& path, const Picture& picture, float gain, float gamma);
Picture read_exr(const std::string& path); // throws Error with ExitCode::Input; hostile files included

// Reconstruction filters by importance sampling: each sample belongs to one pixel, so a picture needs no splatting and
// any thread or host count gives the same bits. The offset from the pixel centre is sampled with density |f|; `weight` is
// +1 or -1 times the normalisation for filters with negative lobes.
class Filter {
  public:
    Filter(const std::string& name, float width_x, float width_y); // throws Error that lists the names
    struct Sample {
        float dx, dy, weight;
    };
    Sample sample(float u0, float u1) const;
    static std::vector<std::string> names();
    // Inverse cumulative tables for the transport kernels: offset of u in [0, 1), `TableSize + 1` entries an axis.
    static constexpr int TableSize = 256;
    const std::vector<float>& table_x() const { return m_table_x; }
    const std::vector<float>& table_y() const { return m_table_y; }

  private:
    std::vector<float> m_table_x, m_table_y, m_weight_x, m_weight_y;
};

struct Comparison {
    double relative_mse = 0; // mean of (a - b)^2 / (b^2 + 0.01), over RGB
    double mean_a = 0, mean_b = 0, mean_ratio = 0;
    double max_error = 0;    // largest absolute difference
    int max_x = 0, max_y = 0;
    double flip = 0;         // mean LDR-FLIP (Andersson et al. 2020) after exposure, 67 pixels a degree
    Picture difference;      // FLIP heat map
};
Comparison compare(const Picture& a, const Picture& b); // throws Error where sizes differ

} // namespace kanuka::film
