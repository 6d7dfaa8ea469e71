// The tables of uplift, knot by knot: what a knot's spectrum looks like under the white, by a sum of the
// test's own.
#include "color/uplift_fit.h"

#include <gtest/gtest.h>

#include "color/spaces.h"

namespace kanuka::color {
namespace {

using Triple = std::array<double, 3>;

constexpr int Knots = 8;

Response response_of(Space space) {
    const Matrix3 from_xyz = space_from_xyz(space);
    Response response;
    double white = 0;
    for (int i = 0; i < LambdaCount; i++)
        white += double(cie_y()[i]) * white_illuminant(space)[i];
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < LambdaCount; i++)
            response[c].push_back(
                (from_xyz[c][0] * cie_x()[i] + from_xyz[c][1] * cie_y()[i] + from_xyz[c][2] * cie_z()[i]) *
                white_illuminant(space)[i] / white);
    return response;
}

struct Knot {
    Triple wanted, found; // colours
    double highest;       // of the polynomial, over the visible range
};

// After the layout that uplift.h gives: table m holds colours whose component m is the largest.
Knot knot(const std::vector<float>& table, const Response& response, int m, int z, int y, int x) {
    Knot k;
    const double largest = uplift_scale(z, Knots);
    const auto ratio = [](int i) { return double(i) / (Knots - 1) * (double(i) / (Knots - 1)); };
    k.wanted[m] = largest;
    k.wanted[(m + 1) % 3] = largest * ratio(x);
    k.wanted[(m + 2) % 3] = largest * ratio(y);
    const double mean = (k.wanted[0] + k.wanted[1] + k.wanted[2]) / 3;
    const float* q = &table[(((size_t(m) * Knots + z) * Knots + y) * Knots + x) * 3];
    k.found = {};
    k.highest = -1e30;
    for (int i = 0; i < LambdaCount; i++) {
        const double l = i / (LambdaCount - 1.0);
        const double f = q[0] * l * l + q[1] * l + (q[2] + mean - 0.5);
        k.highest = std::max(k.highest, f);
        // Jakob and Hanika (2019), equation 3, of c = q / sqrt(n), without the cancellation below 0.
        const double c = f / std::sqrt(mean * (1 - mean)), root = std::sqrt(1 + c * c);
        const double reflectance = mean >= 1 ? 1 : c < 0 ? 0.5 / (root * (root - c)) : 0.5 + 0.5 * c / root;
        for (int j = 0; j < 3; j++)
            k.found[j] += response[j][i] * reflectance;
    }
    return k;
}

template <class F>
void for_each_knot(F f) {
    for (int m = 0; m < 3; m++)
        for (int z = 0; z < Knots; z++)
            for (int y = 0; y < Knots; y++)
                for (int x = 0; x < Knots; x++)
                    f(m, z, y, x);
}

} // namespace

TEST(UpliftFit, EveryKnotOfRec709HasItsColour) {
    double residual = 1;
    const Response response = response_of(Space::Rec709);
    const auto table = fit_uplift_table(response, Knots, false, residual);
    EXPECT_LT(residual, 1e-6);
    ASSERT_EQ(table.size(), size_t(3 * Knots * Knots * Knots * 3));
    for_each_knot([&](int m, int z, int y, int x) {
        const Knot k = knot(table, response, m, z, y, x);
        for (int c = 0; c < 3; c++) // tables are floats
            ASSERT_NEAR(k.found[c], k.wanted[c], 1e-4 * k.wanted[m]) << m << ' ' << z << ' ' << y << ' ' << x;
    });
}

// What no reflectance can be comes out between its grey and itself, dark colours as well as bright ones; the
// darkest stay dark all the way to black.
TEST(UpliftFit, KnotsOfAWideSpaceLieBetweenGreyAndTheirColour) {
    double residual = 1;
    const Response response = response_of(Space::AcesCg);
    const auto table = fit_uplift_table(response, Knots, true, residual);
    EXPECT_LT(residual, 1e-6);
    double reached = 0;
    int short_of = 0, knots = 0;
    for_each_knot([&](int m, int z, int y, int x) {
        const Knot k = knot(table, response, m, z, y, x);
        const double mean = (k.wanted[0] + k.wanted[1] + k.wanted[2]) / 3;
        double along = 0, whole = 0;
        for (int c = 0; c < 3; c++) {
            along += (k.found[c] - mean) * (k.wanted[c] - mean);
            whole += (k.wanted[c] - mean) * (k.wanted[c] - mean);
        }
        const double t = whole > 1e-20 ? along / whole : 1;
        for (int c = 0; c < 3; c++)
            ASSERT_NEAR(k.found[c], mean + t * (k.wanted[c] - mean), 1e-4 * k.wanted[m])
                << m << ' ' << z << ' ' << y << ' ' << x;
        ASSERT_LT(t, 1.001) << m << ' ' << z << ' ' << y << ' ' << x;
        if (z == 0) { // serves all that is darker
            ASSERT_LT(k.highest, -0.02 + 1e-4) << m << ' ' << y << ' ' << x;
            return;
        }
        ASSERT_GT(t, 0.6) << m << ' ' << z << ' ' << y << ' ' << x;
        reached += t;
        short_of += t < 0.999;
        knots++;
    });
    EXPECT_GT(reached / knots, 0.9);
    EXPECT_GT(short_of, 0);
}

// What is said of a table is what its worst knot is off by, also where no fit comes near, as for saturated
// colours of a wide space that are not moved towards grey.
TEST(UpliftFit, ResidualIsThatOfTheWorstKnot) {
    const Response response = response_of(Space::AcesCg);
    double residual = 0, worst = 0;
    const auto table = fit_uplift_table(response, Knots, false, residual);
    for_each_knot([&](int m, int z, int y, int x) {
        const Knot k = knot(table, response, m, z, y, x);
        for (int c = 0; c < 3; c++)
            worst = std::max(worst, std::abs(k.found[c] - k.wanted[c]) / k.wanted[m]);
    });
    EXPECT_GT(worst, 0.1);
    EXPECT_NEAR(residual, worst, 1e-4);
}

} // namespace kanuka::color
