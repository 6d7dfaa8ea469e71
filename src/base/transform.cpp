#include "base/error.h"
#include "base/vec.h"

namespace kanuka {

Transform Transform::translate(double x, double y, double z) {
    Transform t;
    t.m[0][3] = x;
    t.m[1][3] = y;
    t.m[2][3] = z;
    return t;
}

Transform Transform::scale(double x, double y, double z) {
    Transform t;
    t.m[0][0] = x;
    t.m[1][1] = y;
    t.m[2][2] = z;
    return t;
}

Transform Transform::rotate(double degrees, double x, double y, double z) {
    const double len = std::sqrt(x * x + y * y + z * z);
    if (len == 0)
        return {};
    x /= len, y /= len, z /= len;
    const double a = degrees * 3.14159265358979323846 / 180, c = std::cos(a), s = std::sin(a), k = 1 - c;
    Transform t; // Rodrigues' formula
    t.m[0] = {c + x * x * k, x * y * k - z * s, x * z * k + y * s, 0};
    t.m[1] = {y * x * k + z * s, c + y * y * k, y * z * k - x * s, 0};
    t.m[2] = {z * x * k - y * s, z * y * k + x * s, c + z * z * k, 0};
    return t;
}

Transform Transform::operator*(const Transform& b) const {
    Transform r;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            r.m[i][j] = 0;
            for (int k = 0; k < 4; k++)
                r.m[i][j] += m[i][k] * b.m[k][j];
        }
    return r;
}

Transform Transform::inverse() const {
    // Gauss–Jordan with partial pivoting on [M | I].
    auto a = m;
    Transform inv;
    for (int col = 0; col < 4; col++) {
        int pivot = col;
        for (int r = col + 1; r < 4; r++)
            if (std::abs(a[r][col]) > std::abs(a[pivot][col]))
                pivot = r;
        if (!(std::abs(a[pivot][col]) > 1e-300))
            throw Error("a transform is singular and cannot be inverted; check for a scale of zero");
        std::swap(a[pivot], a[col]);
        std::swap(inv.m[pivot], inv.m[col]);
        const double s = 1 / a[col][col];
        for (int j = 0; j < 4; j++)
            a[col][j] *= s, inv.m[col][j] *= s;
        for (int r = 0; r < 4; r++) {
            if (r == col)
                continue;
            const double f = a[r][col];
            for (int j = 0; j < 4; j++)
                a[r][j] -= f * a[col][j], inv.m[r][j] -= f * inv.m[col][j];
        }
    }
    return inv;
}

Vec3f Transform::point(const Vec3f& p) const {
    double r[4];
    for (int i = 0; i < 4; i++)
        r[i] = m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3];
    const double w = r[3] == 1 ? 1 : 1 / r[3];
    return {float(r[0] * w), float(r[1] * w), float(r[2] * w)};
}

Vec3f Transform::vector(const Vec3f& v) const {
    float r[3];
    for (int i = 0; i < 3; i++)
        r[i] = float(m[i][0] * v.x + m[i][1] * v.y + m[i][2] * v.z);
    return {r[0], r[1], r[2]};
}

Vec3f Transform::normal(const Vec3f& n, const Transform& inverse) const {
    float r[3];
    for (int i = 0; i < 3; i++)
        r[i] = float(inverse.m[0][i] * n.x + inverse.m[1][i] * n.y + inverse.m[2][i] * n.z);
    return {r[0], r[1], r[2]};
}

double Transform::determinant3() const {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

} // namespace kanuka
