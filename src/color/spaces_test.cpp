#include "color/spaces.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "color/difference.h"

namespace kanuka::color {
namespace {

void expect_near(const Matrix3& a, const Matrix3& b, double tolerance) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            EXPECT_NEAR(a[i][k], b[i][k], tolerance) << i << " " << k;
}

} // namespace

TEST(Spaces, AcesMatricesAreThePublishedOnes) {
    // S-2008-001 and S-2014-004: XYZ from AP0 and AP1, behind the adaptation of our D60 to ACES's white.
    const Matrix3 undo = inverse(adaptation(white_xyz(Space::AcesCg), xyz_of_xy(AcesWhite[0], AcesWhite[1])));
    const Matrix3 ap0{{{0.9525523959, 0.0, 0.0000936786},
                       {0.3439664498, 0.7281660966, -0.0721325464},
                       {0.0, 0.0, 1.0088251844}}};
    const Matrix3 ap1{{{0.6624541811, 0.1340042065, 0.1561876870},
                       {0.2722287168, 0.6740817658, 0.0536895174},
                       {-0.0055746495, 0.0040607335, 1.0103391003}}};
    expect_near(xyz_from_space(Space::Aces2065), undo * ap0, 2e-9);
    expect_near(xyz_from_space(Space::AcesCg), undo * ap1, 2e-9);
}

TEST(Spaces, ConversionsKeepWhiteAndAreThePublishedOnes) {
    // AP1 from linear Rec.709 with Bradford's adaptation, as the ACES transforms have it; D65 there is the
    // rounded 0.3127, 0.3290.
    expect_near(convert(Space::Rec709, Space::AcesCg),
                {{{0.6130974024, 0.3395231462, 0.0473794514},
                  {0.0701937225, 0.9163538791, 0.0134523985},
                  {0.0206155929, 0.1095697729, 0.8698146342}}},
                2e-4);
    // BT.2087-0: Rec.2020 from Rec.709.
    expect_near(convert(Space::Rec709, Space::Rec2020),
                {{{0.6274, 0.3293, 0.0433}, {0.0691, 0.9195, 0.0114}, {0.0164, 0.0880, 0.8956}}}, 1e-4);
    for (const Space from : {Space::Rec709, Space::Rec2020, Space::AcesCg, Space::Aces2065})
        for (const Space to : {Space::Rec709, Space::Rec2020, Space::AcesCg, Space::Aces2065}) {
            const Rgb white = transform(convert(from, to), Rgb(1));
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(white[c], 1, 1e-6);
            expect_near(convert(from, to) * convert(to, from), {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 1e-12);
        }
}

TEST(Spaces, WhiteLightIsWhite) {
    for (const Space s : {Space::Rec709, Space::Rec2020, Space::AcesCg, Space::Aces2065}) {
        const Vector3 rgb = space_from_xyz(s) * white_xyz(s);
        for (const double v : rgb)
            EXPECT_NEAR(v, 1, 1e-9) << info(s).name;
    }
    // The run-time matrix is the build's.
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            EXPECT_NEAR(space_from_xyz(Space::Rec709)[i][k], rgb_from_xyz[i][k], 1e-6);
}

TEST(Spaces, Names) {
    EXPECT_EQ(find_space("acescg"), Space::AcesCg);
    EXPECT_EQ(find_space("srgb"), Space::Rec709);
    EXPECT_FALSE(find_space("prophoto"));
    EXPECT_EQ(space_names(true), "rec709, rec2020, acescg");
    EXPECT_EQ(space_names(false), "rec709, rec2020, acescg, aces2065, xyz");
}

TEST(Display, EncodingsAreTheStandards) {
    EXPECT_NEAR(display_encode(Display::Srgb, 0.18f), 0.461356f, 1e-6f); // IEC 61966-2-1
    EXPECT_NEAR(display_encode(Display::Srgb, 0.002f), 0.02584f, 1e-6f);
    EXPECT_NEAR(display_encode(Display::Rec709, 0.18f), std::pow(0.18, 1 / 2.4), 1e-6); // BT.1886
    EXPECT_NEAR(rec709_camera_encode(0.18f), 0.409f, 1e-3f); // BT.709-6: 1.099 * 0.18^0.45 - 0.099
    EXPECT_NEAR(rec709_camera_encode(0.01f), 0.045f, 1e-6f);
    for (int i = -20; i <= 200; i++) {
        const float v = float(i) / 100;
        for (const Display d : {Display::Srgb, Display::Rec709})
            EXPECT_NEAR(display_decode(d, display_encode(d, v)), v, 3e-6f);
        EXPECT_NEAR(rec709_camera_decode(rec709_camera_encode(v)), v, 3e-6f);
    }
}

// Pairs of Sharma, Wu and Dalal (2005), table 1.
TEST(Difference, Ciede2000) {
    struct Pair {
        Vector3 a, b;
        double e;
    };
    const Pair pairs[] = {{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
                          {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
                          {{50, 0, 0}, {50, -1, 2}, 2.3669},
                          {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
                          {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
                          {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
                          {{50, 2.5, 0}, {50, 3.2592, 0.3350}, 1.0000},
                          {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
                          {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
                          {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
    for (const Pair& p : pairs) {
        EXPECT_NEAR(delta_e_2000(p.a, p.b), p.e, 5e-5);
        EXPECT_NEAR(delta_e_2000(p.b, p.a), p.e, 5e-5);
    }
}

// Sharma, Wu and Dalal (2005), equations 2 to 22, as they are printed: in degrees, with their cases of the
// mean hue. Their pairs have four digits, too few for what the turn of blues adds at other hues.
TEST(Difference, Ciede2000AtAllHues) {
    constexpr double Degrees = 180 / std::numbers::pi;
    const auto hue = [](double a, double b) {
        const double h = std::atan2(b, a) * Degrees;
        return h < 0 ? h + 360 : h;
    };
    const auto published = [&](const Vector3& p, const Vector3& q) {
        const double c1 = std::sqrt(p[1] * p[1] + p[2] * p[2]), c2 = std::sqrt(q[1] * q[1] + q[2] * q[2]);
        const double c7 = std::pow((c1 + c2) / 2, 7),
                     g = 0.5 * (1 - std::sqrt(c7 / (c7 + std::pow(25.0, 7))));
        const double a1 = (1 + g) * p[1], a2 = (1 + g) * q[1];
        const double C1 = std::sqrt(a1 * a1 + p[2] * p[2]), C2 = std::sqrt(a2 * a2 + q[2] * q[2]);
        const double h1 = hue(a1, p[2]), h2 = hue(a2, q[2]);
        const double dh = std::abs(h2 - h1) <= 180 ? h2 - h1 : h2 > h1 ? h2 - h1 - 360 : h2 - h1 + 360;
        const double mean_h = std::abs(h1 - h2) <= 180 ? (h1 + h2) / 2
                              : h1 + h2 < 360          ? (h1 + h2 + 360) / 2
                                                       : (h1 + h2 - 360) / 2;
        const double dL = q[0] - p[0], dC = C2 - C1, dH = 2 * std::sqrt(C1 * C2) * std::sin(dh / 2 / Degrees);
        const double L = (p[0] + q[0]) / 2, C = (C1 + C2) / 2, C7 = std::pow(C, 7);
        const auto cosine = [&](double degrees) { return std::cos(degrees / Degrees); };
        const double T = 1 - 0.17 * cosine(mean_h - 30) + 0.24 * cosine(2 * mean_h) +
                         0.32 * cosine(3 * mean_h + 6) - 0.20 * cosine(4 * mean_h - 63);
        const double turn = 30 * std::exp(-std::pow((mean_h - 275) / 25, 2));
        const double RC = 2 * std::sqrt(C7 / (C7 + std::pow(25.0, 7)));
        const double SL = 1 + 0.015 * std::pow(L - 50, 2) / std::sqrt(20 + std::pow(L - 50, 2));
        const double SC = 1 + 0.045 * C, SH = 1 + 0.015 * C * T, RT = -std::sin(2 * turn / Degrees) * RC;
        return std::sqrt(std::pow(dL / SL, 2) + std::pow(dC / SC, 2) + std::pow(dH / SH, 2) +
                         RT * (dC / SC) * (dH / SH));
    };
    for (double h1 = 1.3; h1 < 360; h1 += 7)
        for (double h2 = 3.1; h2 < 360; h2 += 11) {
            const Vector3 p{40, 60 * std::cos(h1 / Degrees), 60 * std::sin(h1 / Degrees)};
            const Vector3 q{55, 95 * std::cos(h2 / Degrees), 95 * std::sin(h2 / Degrees)};
            EXPECT_NEAR(delta_e_2000(p, q), published(p, q), 1e-10) << h1 << ' ' << h2;
        }
}

} // namespace kanuka::color
