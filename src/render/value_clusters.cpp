#include "render/value_clusters.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace kanuka::render {

Rows distinct_rows(const Rows& rows, std::vector<uint32_t>& which, std::vector<uint32_t>& weights) {
    std::vector<uint32_t> order(rows.count());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, [&](uint32_t a, uint32_t b) {
        return std::ranges::lexicographical_compare(rows[a], rows[b]);
    });
    Rows distinct{rows.width, {}};
    which.assign(rows.count(), 0);
    weights.clear();
    for (const uint32_t i : order) {
        const auto row = rows[i];
        if (weights.empty() || !std::ranges::equal(distinct[weights.size() - 1], row)) {
            distinct.values.insert(distinct.values.end(), row.begin(), row.end());
            weights.push_back(0);
        }
        weights.back()++;
        which[i] = uint32_t(weights.size() - 1);
    }
    return distinct;
}

namespace {

class Clusters {
  public:
    // A box for each kind, by weight; no more than `count`.
    Clusters(const Rows& rows, std::span<const uint32_t> weights, std::span<const float> scales,
             std::span<const uint32_t> kinds, size_t count)
        : m_rows(rows), m_weights(weights), m_scales(scales), m_kinds(kinds) {
        const std::vector<uint32_t> order = heaviest_kinds(count);
        m_is_kept.assign(m_kinds.empty() ? 1 : 1 + std::ranges::max(m_kinds), false);
        std::vector<std::vector<uint32_t>> of(m_is_kept.size());
        for (size_t i = 0; i < rows.count(); i++)
            of[kind_of(i)].push_back(uint32_t(i));
        for (const uint32_t kind : order) {
            m_is_kept[kind] = true;
            const size_t begin = m_all.size();
            m_all.insert(m_all.end(), of[kind].begin(), of[kind].end());
            m_boxes.push_back(box(begin, m_all.size()));
        }
    }
    bool is_kept(size_t row) const { return m_is_kept[kind_of(row)]; }
    void split_to(size_t count) {
        while (m_boxes.size() < count) {
            const auto widest = std::ranges::max_element(
                m_boxes, {}, [](const Box& b) { return b.deviation; }); // the first of equal ones
            if (!(widest->deviation > 0))
                return;
            const Box whole = *widest;
            const size_t at = best_cut(whole);
            if (at == whole.begin) { // its rows differ by rounding of the mean alone
                widest->deviation = 0;
                continue;
            }
            *widest = box(whole.begin, at);
            m_boxes.push_back(box(at, whole.end));
        }
    }
    Rows means() const {
        Rows out{m_rows.width, {}};
        for (const Box& b : m_boxes)
            for (const double x : b.mean)
                out.values.push_back(float(x));
        return out;
    }
    uint32_t nearest(size_t i, const Rows& means) const {
        const std::span<const float> row = m_rows[i];
        const bool of_its_kind = is_kept(i);
        uint32_t best = 0;
        double least = std::numeric_limits<double>::infinity();
        for (size_t k = 0; k < means.count(); k++) {
            if (of_its_kind && kind_of(m_all[m_boxes[k].begin]) != kind_of(i))
                continue;
            double sum = 0;
            for (size_t c = 0; c < row.size(); c++)
                sum += square(double(row[c] - means[k][c]) / double(m_scales[c]));
            if (sum < least)
                least = sum, best = uint32_t(k);
        }
        return best;
    }

  private:
    struct Box { // of rows m_all[begin] to m_all[end - 1]
        size_t begin = 0, end = 0, column = 0;
        double deviation = 0; // the sum of squares along the column where it is the largest
        std::vector<double> mean;
    };
    static double square(double x) { return x * x; }
    uint32_t kind_of(size_t row) const { return m_kinds.empty() ? 0 : m_kinds[row]; }
    std::vector<uint32_t> heaviest_kinds(size_t count) const {
        std::vector<uint64_t> weight(m_kinds.empty() ? 1 : 1 + std::ranges::max(m_kinds));
        for (size_t i = 0; i < m_rows.count(); i++)
            weight[kind_of(i)] += m_weights[i];
        std::vector<uint32_t> order(weight.size());
        std::iota(order.begin(), order.end(), 0u);
        std::ranges::stable_sort(order, std::greater(), [&](uint32_t kind) { return weight[kind]; });
        order.resize(std::min(order.size(), count));
        return order;
    }
    // Where the sum of what both parts deviate along the column is the least. Its rows come out in order.
    size_t best_cut(const Box& whole) {
        const auto value = [&](uint32_t i) { return double(m_rows[i][whole.column]); };
        std::sort(m_all.begin() + ptrdiff_t(whole.begin), m_all.begin() + ptrdiff_t(whole.end),
                  [&](uint32_t a, uint32_t b) { return value(a) != value(b) ? value(a) < value(b) : a < b; });
        const double middle = whole.mean[whole.column]; // sums around it keep their digits
        double total = 0;
        for (size_t n = whole.begin; n < whole.end; n++)
            total += m_weights[m_all[n]];
        double weight = 0, sum = 0, most = -1;
        size_t best = whole.begin; // none
        for (size_t n = whole.begin + 1; n < whole.end; n++) {
            weight += m_weights[m_all[n - 1]];
            sum += double(m_weights[m_all[n - 1]]) * (value(m_all[n - 1]) - middle);
            const double between = square(sum) * (1 / weight + 1 / (total - weight)); // of the two means
            if (value(m_all[n]) > value(m_all[n - 1]) && between > most)
                most = between, best = n;
        }
        return best;
    }
    Box box(size_t begin, size_t end) const {
        Box b{begin, end, 0, 0, std::vector<double>(m_rows.width)};
        double total = 0;
        for (size_t n = begin; n < end; n++)
            total += m_weights[m_all[n]];
        for (size_t c = 0; c < m_rows.width; c++) {
            double sum = 0, squares = 0;
            for (size_t n = begin; n < end; n++)
                sum += double(m_weights[m_all[n]]) * double(m_rows[m_all[n]][c]);
            b.mean[c] = sum / total;
            for (size_t n = begin; n < end; n++)
                squares += double(m_weights[m_all[n]]) *
                           square((double(m_rows[m_all[n]][c]) - b.mean[c]) / double(m_scales[c]));
            if (squares > b.deviation)
                b.deviation = squares, b.column = c;
        }
        return b;
    }

    const Rows& m_rows;
    const std::span<const uint32_t> m_weights;
    const std::span<const float> m_scales;
    const std::span<const uint32_t> m_kinds;
    std::vector<bool> m_is_kept; // by kind
    std::vector<uint32_t> m_all; // of kinds that are kept
    std::vector<Box> m_boxes;
};

} // namespace

Rows cluster(const Rows& rows, std::span<const uint32_t> weights, std::span<const float> scales,
             std::span<const uint32_t> kinds, size_t count, std::vector<uint32_t>& which) {
    constexpr int Rounds = 8; // most of what is to be had comes in the first few
    Clusters clusters(rows, weights, scales, kinds, count);
    clusters.split_to(count);
    Rows means = clusters.means();
    which.assign(rows.count(), 0);
    for (int round = 0;; round++) {
        for (size_t i = 0; i < rows.count(); i++)
            which[i] = clusters.nearest(i, means);
        if (round == Rounds)
            return means;
        std::vector<double> sums(means.values.size()), of(means.count());
        for (size_t i = 0; i < rows.count(); i++) {
            if (!clusters.is_kept(i))
                continue;
            of[which[i]] += weights[i];
            for (size_t c = 0; c < rows.width; c++)
                sums[which[i] * rows.width + c] += double(weights[i]) * double(rows[i][c]);
        }
        for (size_t k = 0; k < sums.size(); k++)
            if (of[k / rows.width] > 0)
                means.values[k] = float(sums[k] / of[k / rows.width]);
    }
}

} // namespace kanuka::render
