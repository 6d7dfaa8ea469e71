// 3x3 matrices in double: primaries to XYZ, chromatic adaptation. Shared with the build step.
#pragma once

#include <array>

namespace kanuka::color {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<std::array<double, 3>, 3>; // rows

inline Vector3 operator*(const Matrix3& m, const Vector3& v) {
    Vector3 r{};
    for (int i = 0; i < 3; i++)
        r[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return r;
}

inline Matrix3 operator*(const Matrix3& a, const Matrix3& b) {
    Matrix3 r{};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            r[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
    return r;
}

inline Matrix3 inverse(const Matrix3& a) {
    Matrix3 r;
    double det = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int i1 = (j + 1) % 3, i2 = (j + 2) % 3, j1 = (i + 1) % 3, j2 = (i + 2) % 3;
            r[i][j] = a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1];
        }
    for (int i = 0; i < 3; i++)
        det += a[0][i] * r[i][0];
    for (auto& row : r)
        for (double& v : row)
            v /= det;
    return r;
}

struct Chromaticities { // of red, green, blue
    double xy[3][2];
};

inline Vector3 xyz_of_xy(double x, double y) { // Y = 1
    return {x / y, 1, (1 - x - y) / y};
}

// Columns are the primaries, scaled so that (1, 1, 1) is the white (SMPTE RP 177).
inline Matrix3 xyz_from_primaries(const Chromaticities& primaries, const Vector3& white) {
    Matrix3 p;
    for (int c = 0; c < 3; c++) {
        p[0][c] = primaries.xy[c][0] / primaries.xy[c][1];
        p[1][c] = 1;
        p[2][c] = (1 - primaries.xy[c][0] - primaries.xy[c][1]) / primaries.xy[c][1];
    }
    const Matrix3 q = inverse(p);
    for (int c = 0; c < 3; c++) {
        double s = 0;
        for (int k = 0; k < 3; k++)
            s += q[c][k] * white[k];
        for (int k = 0; k < 3; k++)
            p[k][c] *= s;
    }
    return p;
}

// Colours seen under the white `from` as they look under the white `to`: von Kries's rule in the cone space
// of Bradford (K. M. Lam, 1985; ICC.1:2022, annex E).
inline Matrix3 adaptation(const Vector3& from, const Vector3& to) {
    constexpr Matrix3 cones{
        {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    const Vector3 a = cones * from, b = cones * to;
    Matrix3 gains{};
    for (int i = 0; i < 3; i++)
        gains[i][i] = b[i] / a[i];
    return inverse(cones) * (gains * cones);
}

inline constexpr Chromaticities Rec709Primaries{{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}}}; // BT.709-6
inline constexpr Chromaticities Rec2020Primaries{
    {{0.708, 0.292}, {0.17, 0.797}, {0.131, 0.046}}};                                           // BT.2020-2
inline constexpr Chromaticities AcesAp0Primaries{{{0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}}}; // ST 2065-1
inline constexpr Chromaticities AcesAp1Primaries{
    {{0.713, 0.293}, {0.165, 0.83}, {0.128, 0.044}}}; // S-2014-004
inline constexpr double AcesWhite[2] = {0.32168, 0.33767};

// What uplift needs of a space: RGB of XYZ under the illuminant that stands for its white. ACES names a
// white that is near to, but not on, the daylight locus; the illuminant (D60) is adapted to it, so that it
// maps to (1, 1, 1) exactly.
inline Matrix3 aces_rgb_from_xyz(const Chromaticities& primaries, const Vector3& d60) {
    const Vector3 white = xyz_of_xy(AcesWhite[0], AcesWhite[1]);
    return inverse(xyz_from_primaries(primaries, white)) * adaptation(d60, white);
}

} // namespace kanuka::color
