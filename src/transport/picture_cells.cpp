#include "transport/picture_cells.h"

#include <algorithm>
#include <bit>

namespace kanuka::transport {

PictureCells make_picture_cells(int columns, int rows, const std::function<double(int, int)>& corner,
                                const std::function<double(int)>& width,
                                const std::function<double(int)>& height) {
    PictureCells cells;
    cells.columns = columns, cells.rows = rows;
    cells.marginal.assign(size_t(rows) + 1, 0.0f);
    cells.conditional.assign(size_t(rows) * (size_t(columns) + 1), 0.0f);
    std::vector<double> of_row(static_cast<size_t>(rows)), sums(size_t(columns) + 1), above, below;
    const auto corners = [&](int row) {
        std::vector<double> w(size_t(columns) + 1);
        for (int i = 0; i <= columns; i++)
            w[size_t(i)] = corner(i, row);
        return w;
    };
    below = corners(0);
    for (int j = 0; j < rows; j++) {
        above.swap(below);
        below = corners(j + 1);
        for (size_t i = 0; i < size_t(columns); i++)
            sums[i + 1] =
                sums[i] + 0.25 * width(int(i)) * (above[i] + above[i + 1] + below[i] + below[i + 1]);
        // Rows without weight are never chosen, but their table must rise.
        float* to = cells.conditional.data() + size_t(j) * (size_t(columns) + 1);
        for (size_t i = 0; i <= size_t(columns); i++)
            to[i] = float(sums.back() > 0 ? sums[i] / sums.back() : double(i) / columns);
        cells.total += of_row[size_t(j)] = sums.back() * height(j);
    }
    double sum = 0;
    for (size_t j = 0; j < size_t(rows); j++) {
        sum += of_row[j];
        cells.marginal[j + 1] = float(cells.total > 0 ? sum / cells.total : double(j + 1) / rows);
    }
    return cells;
}

// A quarter as many shares as steps: of as many, still lifes take the same time.
SearchGuide::SearchGuide(std::span<const float> tables, int steps)
    : shares(int(std::bit_floor(unsigned(std::max(steps / 4, 1))))) {
    const size_t values = size_t(steps) + 1, count = tables.size() / values;
    found.reserve(count * (size_t(shares) + 1));
    for (size_t t = 0; t < count; t++) {
        const std::span<const float> table = tables.subspan(t * values, values);
        int32_t i = 0;
        for (int k = 0; k <= shares; k++) {
            const float u = float(k) / float(shares);
            while (i + 1 < steps && table[size_t(i) + 1] <= u)
                i++;
            found.push_back(i);
        }
    }
}

} // namespace kanuka::transport
