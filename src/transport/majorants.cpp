#include "transport/majorants.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kanuka::transport {

namespace {

// Of a lattice with `size` values along an axis: those that densities in a cell are made of. The cell is
// taken to be a little wider, for what rounding does to a ray's place.
struct Span {
    int first, last;
};
Span values_of_cell(int cell, int cells, int size) {
    constexpr double Slack = 1e-4;
    const double step = double(size - 1) / cells;
    return {std::clamp(int(std::floor(cell * step - Slack)), 0, size - 1),
            std::clamp(int(std::ceil((cell + 1) * step + Slack)), 0, size - 1)};
}

// How far rays go in the box on the mean: its three widths' mean.
double width_of(const store::DensityField& field) {
    double sum = 0;
    for (size_t r = 0; r < 3; r++) {
        const float* row = field.unit_from_render.data() + 4 * r;
        sum += 1 / std::max(std::hypot(double(row[0]), double(row[1]), double(row[2])), 1e-30);
    }
    return sum / 3;
}

} // namespace

Majorants bound_density(const store::DensityField& field, int cells) {
    Majorants m;
    for (size_t c = 0; c < 3; c++)
        m.cells[c] = std::clamp(field.size[c] - 1, 1, cells);
    const auto row = [&](int y, int z) {
        return field.density.begin() + (ptrdiff_t(z) * field.size[1] + y) * field.size[0];
    };
    for (int k = 0; k < m.cells[2]; k++)
        for (int j = 0; j < m.cells[1]; j++)
            for (int i = 0; i < m.cells[0]; i++) {
                const Span x = values_of_cell(i, m.cells[0], field.size[0]),
                           y = values_of_cell(j, m.cells[1], field.size[1]),
                           z = values_of_cell(k, m.cells[2], field.size[2]);
                float most = 0;
                for (int c = z.first; c <= z.last; c++)
                    for (int b = y.first; b <= y.last; b++)
                        most = std::max(most, *std::max_element(row(b, c) + x.first, row(b, c) + x.last + 1));
                m.values.push_back(most);
            }
    return m;
}

Majorants make_majorants(const store::DensityField& field, float extinction) {
    // A step to the next cell costs half of a collision, which looks at eight values.
    constexpr double CellCost = 0.5;
    const double depth = extinction * width_of(field);
    Majorants best;
    double least = 0;
    for (int cells = 1; cells <= 16; cells *= 2) {
        Majorants m = bound_density(field, cells);
        const double mean = std::accumulate(m.values.begin(), m.values.end(), 0.0) / double(m.values.size());
        const double passed = double(m.cells[0] + m.cells[1] + m.cells[2]) / 2;
        const double cost = depth * mean + CellCost * passed;
        if (best.values.empty() || cost < least)
            best = std::move(m), least = cost;
    }
    return best;
}

} // namespace kanuka::transport
