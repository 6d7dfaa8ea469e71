// Pixel filters, each the product of one function of x and one of y. Shapes and widths are RISpec 3.2's and
// PRMan's: there `catmull-rom` and `mitchell` are radial, here they are the separable forms (PRMan's
// "separable-" ones), which a table an axis can sample.
#include <algorithm>
#include <cmath>

#include "film/filter_cells.h"

namespace kanuka::film {

namespace {

// f(x, w): x from the centre in pixels, |x| <= w / 2; need not be normalised.
struct Kernel {
    const char* name;
    double (*f)(double x, double w);
};

double box(double, double) {
    return 1;
}

double triangle(double x, double w) {
    return 1 - std::abs(x) / (0.5 * w);
}

double gaussian(double x, double w) { // RISpec: exp(-2 r^2) with r = 1 at half the width
    const double r = x / (0.5 * w);
    return std::exp(-2 * r * r);
}

double catmull_rom(double x, double) { // of fixed size: the cubic spans 4 pixels, a smaller width cuts it off
    const double r = std::abs(x);
    if (r >= 2)
        return 0;
    return r < 1 ? (1.5 * r - 2.5) * r * r + 1 : ((-0.5 * r + 2.5) * r - 4) * r + 2;
}

double sinc(double x, double w) { // under the lobe of a cosine of twice the width
    const double a = M_PI * x;
    return std::cos(0.5 * a / w) * (std::abs(a) < 1e-6 ? 1 : std::sin(a) / a);
}

double mitchell(double x, double w) { // Mitchell and Netravali 1988, B = C = 1/3, stretched to the width
    const double r = std::abs(x) / (0.25 * w);
    if (r >= 2)
        return 0;
    return r < 1 ? (7 * r - 12) * r * r + 16.0 / 3 : ((-7.0 / 3 * r + 12) * r - 20) * r + 32.0 / 3;
}

double blackman_harris(double x, double w) { // Harris 1978, 4 terms, -92 dB
    const double a = 2 * M_PI * (x / w + 0.5);
    return 0.35875 - 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) - 0.01168 * std::cos(3 * a);
}

constexpr Kernel kernels[] = {{"box", box},
                              {"triangle", triangle},
                              {"gaussian", gaussian},
                              {"catmull-rom", catmull_rom},
                              {"sinc", sinc},
                              {"mitchell", mitchell},
                              {"blackman-harris", blackman_harris}};

// The integral of |f| from the left, at equidistant points; between them f is taken as linear.
struct Cumulative {
    static constexpr int Steps = 1 << 15;
    double left, step;
    std::vector<double> f, mass; // Steps + 1 points; mass of |f| up to each

    Cumulative(const Kernel& kernel, double width)
        : left(-0.5 * width), step(width / Steps), f(Steps + 1), mass(Steps + 1) {
        for (int i = 0; i <= Steps; i++)
            f[i] = kernel.f(std::clamp(left + i * step, -0.5 * width, 0.5 * width), width);
        for (int i = 0; i < Steps; i++)
            mass[i + 1] = mass[i] + 0.5 * (std::abs(f[i]) + std::abs(f[i + 1])) * step;
    }

    // Where the mass reaches m.
    double inverse(double m) const {
        const auto above = std::upper_bound(mass.begin(), mass.end(), m);
        const size_t i = size_t(std::clamp<std::ptrdiff_t>(above - mass.begin() - 1, 0, Steps - 1));
        const double cell = mass[i + 1] - mass[i];
        return left + step * (double(i) + (cell > 0 ? std::min((m - mass[i]) / cell, 1.0) : 0));
    }
};

// Splits the axis into lobes of one sign, gives each its share of the table's bins (one at the least), and
// cuts each lobe into bins of equal mass. A bin's weight is its signed mass over the mass that uniform u
// gives it, so the mean weight is exactly 1 whatever the shares.
void make_table(const Kernel& kernel, double width, std::vector<float>& table, std::vector<float>& weight) {
    constexpr int Size = Filter::TableSize;
    const Cumulative all(kernel, width);

    struct Lobe {
        double from, to, sign; // mass
        int bins;
    };
    std::vector<Lobe> lobes;
    const double total = all.mass.back();
    double from = 0;
    for (int i = 1; i <= Cumulative::Steps; i++) {
        const bool last = i == Cumulative::Steps,
                   crossing = all.f[i - 1] * all.f[i] < 0 || (all.f[i] == 0 && !last);
        if (!last && !crossing)
            continue;
        const double to = last ? total : all.mass[all.f[i] == 0 ? i : i - 1];
        // Slivers, of rounding at the edge of the support, are not lobes.
        if (to - from > 1e-7 * total) {
            const double sign = all.f[i - 1] < 0 ? -1 : 1;
            if (!lobes.empty() && lobes.back().sign == sign)
                lobes.back().to = to;
            else
                lobes.push_back({from, to, sign, 1});
        }
        from = to;
    }
    lobes.front().from = 0;
    lobes.back().to = total;
    for (size_t i = 1; i < lobes.size(); i++)
        lobes[i].from = lobes[i - 1].to;

    int used = 0;
    double signed_total = 0;
    Lobe* largest = &lobes[0];
    for (Lobe& lobe : lobes) {
        lobe.bins = std::max(1, int(std::lround((lobe.to - lobe.from) / total * Size)));
        used += lobe.bins;
        signed_total += lobe.sign * (lobe.to - lobe.from);
        if (lobe.to - lobe.from > largest->to - largest->from)
            largest = &lobe;
    }
    largest->bins += Size - used;

    table.clear();
    weight.clear();
    for (const Lobe& lobe : lobes)
        for (int b = 0; b < lobe.bins; b++) {
            table.push_back(float(all.inverse(lobe.from + (lobe.to - lobe.from) * b / lobe.bins)));
            weight.push_back(float(lobe.sign * (lobe.to - lobe.from) / lobe.bins * Size / signed_total));
        }
    table.push_back(float(all.inverse(total)));
}

} // namespace

std::vector<std::string> Filter::names() {
    std::vector<std::string> all;
    for (const Kernel& kernel : kernels)
        all.push_back(kernel.name);
    return all;
}

Filter::Filter(const std::string& name, float width_x, float width_y) {
    const auto kernel =
        std::find_if(std::begin(kernels), std::end(kernels), [&](auto& k) { return k.name == name; });
    if (kernel == std::end(kernels)) {
        std::string list;
        for (const Kernel& k : kernels)
            list += (list.empty() ? "" : ", ") + std::string(k.name);
        throw Error("there is no pixel filter \"" + name + "\"; there are " + list);
    }
    constexpr float Widest = 1000;
    if (!(width_x > 0 && width_x <= Widest && width_y > 0 && width_y <= Widest))
        throw Error("pixel filter \"" + name + "\": widths must be above 0 and at most 1000 pixels, not " +
                    std::to_string(width_x) + " and " + std::to_string(width_y));
    make_table(*kernel, width_x, m_table_x, m_weight_x);
    if (width_y == width_x)
        m_table_y = m_table_x, m_weight_y = m_weight_x;
    else
        make_table(*kernel, width_y, m_table_y, m_weight_y);
    const auto not_one = [](float w) { return std::abs(w - 1) > 1e-6f; };
    m_has_weights = std::any_of(m_weight_x.begin(), m_weight_x.end(), not_one) ||
                    std::any_of(m_weight_y.begin(), m_weight_y.end(), not_one);
}

Filter::Sample Filter::sample(float u0, float u1) const {
    if (m_cells.nx > 0)
        return sample_cells(m_cells, u0, u1);
    const auto axis = [](float u, const std::vector<float>& table, const std::vector<float>& weight,
                         float& w) {
        const float s = u * float(TableSize);
        const int i = std::clamp(int(s), 0, TableSize - 1);
        w = weight[i];
        return fma(s - float(i), table[i + 1] - table[i], table[i]);
    };
    float wx, wy;
    const float dx = axis(u0, m_table_x, m_weight_x, wx), dy = axis(u1, m_table_y, m_weight_y, wy);
    return {dx, dy, wx * wy};
}

} // namespace kanuka::film
