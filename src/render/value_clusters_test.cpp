#include "render/value_clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
    const Rows means = cluster(distinct, weights, std::vector<float>(2, 1.0f), {}, distinct.count(), nearest);
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
        const Rows means = cluster(line, weights, std::vector<float>(1, 1.0f), {}, 2, nearest);
        EXPECT_LE(error_of(line, weights, means), 1.0001 * best) << seed;
    }
}

TEST(ValueClusters, MoreAreNearer) {
    std::vector<uint32_t> which, weights, nearest;
    const Rows rows = distinct_rows(random_rows(400, 3, 9, 3), which, weights);
    double before = 1e30;
    for (const size_t count : {1, 2, 4, 8, 16, 32}) {
        const Rows means = cluster(rows, weights, std::vector<float>(3, 1.0f), {}, count, nearest);
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
    const Rows means = cluster(rows, weights, std::vector<float>(1, 1.0f), {}, 4, nearest);
    ASSERT_EQ(means.count(), 1u);
    EXPECT_FLOAT_EQ(means[0][0], 0.1f);
}

// Values of three kinds on a line, which lie among each other.
TEST(ValueClusters, KindsAreNotMixed) {
    const Rows rows{1, {0, 1, 2, 3, 10, 11, 12, 13, 20, 21}};
    const std::vector<uint32_t> kinds = {0, 1, 0, 1, 0, 1, 0, 1, 2, 2},
                                weights = {1, 1, 1, 1, 1, 1, 1, 1, 3, 3};
    std::vector<uint32_t> nearest;
    const std::vector<float> scales = {1};
    const Rows means = cluster(rows, weights, scales, kinds, 5, nearest);
    ASSERT_EQ(means.count(), 5u);
    const float expected[] = {1, 2, 1, 2, 11, 12, 11, 12, 20.5f, 20.5f};
    for (size_t i = 0; i < rows.count(); i++)
        EXPECT_EQ(means[nearest[i]][0], expected[i]) << i;
}

// A column that nothing is measured by says which kind a mean is of, to the bit.
TEST(ValueClusters, OfTooManyKindsTheHeaviestStand) {
    const float Odd = 0.1f, Even = 1234567, Rare = 7;
    const Rows rows{2, {Odd, 0, Odd, 0.25f, Even, 10, Even, 12, Rare, 2, Rare, 9}};
    const std::vector<uint32_t> kinds = {0, 0, 1, 1, 2, 2}, weights = {1, 2, 4000000000u, 4000000000u, 1, 1};
    std::vector<uint32_t> nearest;
    const std::vector<float> scales = {INFINITY, 1};
    const Rows means = cluster(rows, weights, scales, kinds, 2, nearest);
    ASSERT_EQ(means.count(), 2u);
    EXPECT_EQ(means[0][0], Even);
    EXPECT_EQ(means[0][1], 11);
    EXPECT_EQ(means[1][0], Odd);
    EXPECT_FLOAT_EQ(means[1][1], 0.5f / 3); // those of other kinds count for nothing
    EXPECT_EQ(nearest, (std::vector<uint32_t>{1, 1, 0, 0, 1, 0}));
    // Nothing but kinds: the most frequent.
    const std::vector<float> none = {INFINITY, INFINITY};
    cluster(rows, weights, none, kinds, 2, nearest);
    EXPECT_EQ(nearest, (std::vector<uint32_t>{1, 1, 0, 0, 0, 0}));
}

} // namespace kanuka::render::test
