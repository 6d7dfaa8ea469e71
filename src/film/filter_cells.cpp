#include "film/filter_cells.h"

#include <algorithm>
#include <cmath>

namespace kanuka::film {

namespace {

// Sums from 0 to 1; the last sums are exactly 1, so that nothing of no mass is ever drawn.
void append_masses(std::span<const double> mass, std::vector<float>& to) {
    double total = 0, sum = 0;
    for (const double m : mass)
        total += m;
    const auto last = std::find_if(mass.rbegin(), mass.rend(), [](double m) { return m > 0; });
    const size_t from_here_all = size_t(mass.rend() - last);
    to.push_back(0);
    for (size_t i = 0; i < mass.size(); i++) {
        sum += mass[i];
        to.push_back(i + 1 >= from_here_all ? 1.0f : float(sum / total));
    }
}

// The step that holds u, and where in it.
int step_of(const float* mass, int count, float& u) {
    const int i = std::clamp(int(std::upper_bound(mass, mass + count, u) - mass) - 1, 0, count - 1);
    u = (u - mass[i]) / (mass[i + 1] - mass[i]);
    return i;
}

} // namespace

Filter::Filter(std::span<const float> values, int nx, int ny, float width_x, float width_y) {
    if (nx < 1 || ny < 1 || nx > MostCells || ny > MostCells || values.size() != size_t(nx) * size_t(ny))
        throw Error("the pixel filter's table must hold the values of 1 to " + std::to_string(MostCells) +
                    " cells along each axis; it has " + std::to_string(values.size()) + " values for " +
                    std::to_string(nx) + " times " + std::to_string(ny));
    if (!(width_x > 0 && width_x <= 1000 && width_y > 0 && width_y <= 1000))
        throw Error("the pixel filter's widths must be above 0 and at most 1000 pixels");
    double total = 0, all = 0;
    for (const float f : values) {
        if (!std::isfinite(f))
            throw Error("the pixel filter's table holds a value that is not a number");
        total += f;
        all += std::abs(f);
    }
    // Where what is negative outweighs the rest nearly or wholly, no sum of samples makes a picture.
    if (!(total > 1e-3 * all))
        throw Error("the pixel filter's integral must be more than 0");

    m_cells.nx = nx, m_cells.ny = ny;
    m_cells.width[0] = width_x, m_cells.width[1] = width_y;
    std::vector<double> mass(size_t(nx), 0.0), row_mass;
    for (int y = 0; y < ny; y++) {
        double sum = 0;
        for (int x = 0; x < nx; x++) {
            const float f = values[size_t(y) * size_t(nx) + size_t(x)];
            sum += mass[size_t(x)] = std::abs(f);
            m_cells.weight.push_back(float((f < 0 ? -all : all) / total));
        }
        row_mass.push_back(sum);
        if (sum == 0) // never drawn, yet a table that divides by nothing
            std::fill(mass.begin(), mass.end(), 1.0);
        append_masses(mass, m_cells.cells);
    }
    append_masses(row_mass, m_cells.rows);
    m_has_weights = all > total;
}

Filter::Sample sample_cells(const Filter::Cells& c, float u0, float u1) {
    const int y = step_of(c.rows.data(), c.ny, u1);
    const int x = step_of(c.cells.data() + size_t(y) * size_t(c.nx + 1), c.nx, u0);
    return {fma(float(x) + u0, c.width[0] / float(c.nx), -0.5f * c.width[0]),
            fma(float(y) + u1, c.width[1] / float(c.ny), -0.5f * c.width[1]),
            c.weight[size_t(y) * size_t(c.nx) + size_t(x)]};
}

} // namespace kanuka::film
