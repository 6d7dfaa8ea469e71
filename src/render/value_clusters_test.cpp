#include "render/value_clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace kanuka::render::test {

namespace {

std::vector<std::vector<float>> in_rows(const Rows& rows) {
    std::vector<std::vector<float>> all;
    for (size_t i = 0; i < rows.count(); i++)
        all.emplace_back(rows[i].begin(), rows[i].end());
    return all;
}

Rows random_rows(size_t count, size_t width, int values, uint32_t seed) {
    std::mt19937 random(seed);
    Rows rows{width, {}};
    for (size_t i = 0; i < count * width; i++)
        rows.values.push_back(float(int(random() % uint32_t(values))) / 8);
    return rows;
}

double error_of(const Rows& rows, std::span<const uint32_t> weights, const Rows& means) {
    double sum = 0;
    for (size_t i = 0; i < rows.count(); i++) {
        double least = 1e30;
        for (size_t k = 0; k < means.count(); k++) {
            double square = 0;
            for (size_t c = 0; c < rows.width; c++)
                square += double(rows[i][c] - means[k][c]) * double(rows[i][c] - means[k][c]);
            least = std::min(least, square);
        }
        sum += weights[i] * least;
    }
    return sum;
}

} // namespace

TEST(ValueClusters, DistinctRowsAreThoseOfASet) {
    const Rows rows = random_rows(500, 3, 4, 1);
    std::vector<uint32_t> which, weights;
    const Rows distinct = distinct_rows(rows, which, weights);
    const auto all = in_rows(rows);
    const std::set<std::vector<float>> expected(all.begin(), all.end());
    EXPECT_EQ(in_rows(distinct), std::vector(expected.begin(), expected.end()));
    for (size_t i = 0; i < all.size(); i++)
        EXPECT_TRUE(std::ranges::equal(distinct[which[i]], all[i]));
    for (size_t k = 0; k < weights.size(); k++)
        EXPECT_EQ(weights[k], std::ranges::count(which, uint32_t(k)));
}

TEST(ValueClusters, AsManyAsThereAreRowsAreTheRows) {
    std::vector<uint32_t> which, weights, nearest;
    const Rows distinct = distinct_rows(random_rows(60, 2, 6, 2), which, weights);
    const Rows means = cluster(distinct, weights, std::vector<float>(2, 1.0f), distinct.count(), nearest);
    for (size_t i = 0; i < distinct.count(); i++)
        EXPECT_TRUE(std::ranges::equal(means[nearest[i]], distinct[i])) << i;
}

// Of numbers along a line, all ways to part them in two are few. Of every other row of them, some are far
// off.
TEST(ValueClusters, TwoOfALineAreTheBest) {
    for (uint32_t seed = 0; seed < 20; seed++) {
        std::vector<uint32_t> which, weights, nearest;
        Rows numbers = random_rows(40, 1, 64, seed);
        for (size_t i = 0; seed % 2 == 0 && i < seed; i++)
            numbers.values[i] += 9;
        const Rows line = distinct_rows(numbers, which, weights);
        double best = 1e30;
        for (size_t cut = 1; cut < line.count(); cut++) {
            Rows two{1, {}};
            for (const auto& [from, to] : {std::pair(size_t(0), cut), std::pair(cut, line.count())}) {
                double sum = 0, of = 0;
                for (size_t i = from; i < to; i++)
                    sum += weights[i] * line[i][0], of += weights[i];
                two.values.push_back(float(sum / of));
            }
            best = std::min(best, error_of(line, weights, two));
        }
        const Rows means = cluster(line, weights, std::vector<float>(1, 1.0f), 2, nearest);
        EXPECT_LE(error_of(line, weights, means), 1.0001 * best) << seed;
    }
}

TEST(ValueClusters, MoreAreNearer) {
    std::vector<uint32_t> which, weights, nearest;
    const Rows rows = distinct_rows(random_rows(400, 3, 9, 3), which, weights);
    double before = 1e30;
    for (const size_t count : {1, 2, 4, 8, 16, 32}) {
        const Rows means = cluster(rows, weights, std::vector<float>(3, 1.0f), count, nearest);
        EXPECT_EQ(means.count(), count);
        const double error = error_of(rows, weights, means);
        EXPECT_LT(error, before);
        before = error;
    }
}

// A tenth has no exact mean.
TEST(ValueClusters, OneRowIsOneWhateverIsAskedFor) {
    std::vector<uint32_t> which, weights, nearest;
    const Rows rows = distinct_rows(Rows{1, std::vector<float>(7, 0.1f)}, which, weights);
    const Rows means = cluster(rows, weights, std::vector<float>(1, 1.0f), 4, nearest);
    ASSERT_EQ(means.count(), 1u);
    EXPECT_FLOAT_EQ(means[0][0], 0.1f);
}

} // namespace kanuka::render::test
