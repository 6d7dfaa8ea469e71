// Small vectors, transforms and bounds. Vec3<T> serves scalars (T = float) and lanes (T = Float<W>) alike.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

namespace kanuka {

using std::abs;
using std::max;
using std::min;
using std::sqrt;

inline constexpr float Pi = 3.14159265358979323846f;
inline constexpr float InvPi = 0.31830988618379067154f;

template <class T>
struct Vec2 {
    T x, y;
};

template <class T>
struct Vec3 {
    T x, y, z;

    Vec3() = default;
    constexpr Vec3(T x, T y, T z) : x(x), y(y), z(z) {}
    constexpr explicit Vec3(T s) : x(s), y(s), z(s) {}
    template <class U>
    explicit Vec3(const Vec3<U>& o) : x(T(o.x)), y(T(o.y)), z(T(o.z)) {}

    T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
    const T& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
    Vec3 operator-() const { return {-x, -y, -z}; }
    friend Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
    friend Vec3 operator*(const Vec3& a, const T& s) { return {a.x * s, a.y * s, a.z * s}; }
    friend Vec3 operator*(const T& s, const Vec3& a) { return {a.x * s, a.y * s, a.z * s}; }
    friend Vec3 operator/(const Vec3& a, const T& s) { return a * (T(1.0f) / s); }
    Vec3& operator+=(const Vec3& o) { return *this = *this + o; }
    Vec3& operator-=(const Vec3& o) { return *this = *this - o; }
    Vec3& operator*=(const T& s) { return *this = *this * s; }
    friend bool operator==(const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
};

using Vec2f = Vec2<float>;
using Vec3f = Vec3<float>;

inline float fma(float a, float b, float c) {
    return __builtin_fmaf(a, b, c);
}

template <class T>
T dot(const Vec3<T>& a, const Vec3<T>& b) {
    return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}
template <class T>
Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
    return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}
template <class T>
T length_squared(const Vec3<T>& a) {
    return dot(a, a);
}
template <class T>
T length(const Vec3<T>& a) {
    return sqrt(dot(a, a));
}
template <class T>
Vec3<T> normalize(const Vec3<T>& a) {
    return a * (T(1.0f) / length(a));
}
template <class T>
Vec3<T> lerp(const T& t, const Vec3<T>& a, const Vec3<T>& b) {
    return a + (b - a) * t;
}

// A linear RGB triple (scene-linear Rec.709/D65 unless the name says otherwise). Host side only.
using Rgb = Vec3<float>;

struct Bounds3f {
    Vec3f lo{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
             std::numeric_limits<float>::infinity()};
    Vec3f hi{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
             -std::numeric_limits<float>::infinity()};

    bool empty() const { return lo.x > hi.x || lo.y > hi.y || lo.z > hi.z; }
    void extend(const Vec3f& p) {
        lo = {min(lo.x, p.x), min(lo.y, p.y), min(lo.z, p.z)};
        hi = {max(hi.x, p.x), max(hi.y, p.y), max(hi.z, p.z)};
    }
    void extend(const Bounds3f& b) { // an empty one adds nothing
        lo = {min(lo.x, b.lo.x), min(lo.y, b.lo.y), min(lo.z, b.lo.z)};
        hi = {max(hi.x, b.hi.x), max(hi.y, b.hi.y), max(hi.z, b.hi.z)};
    }
    Vec3f center() const { return (lo + hi) * 0.5f; }
    Vec3f diagonal() const { return hi - lo; }
};

// A 4x4 affine or projective matrix acting on column vectors: p' = M p, stored by rows, m[row][column].
// RenderMan's row-vector matrices are transposed on ingest. Names compose: render_from_camera =
// render_from_world * world_from_camera [pbrt-v4].
struct Transform {
    std::array<std::array<double, 4>, 4> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};

    static Transform translate(double x, double y, double z);
    static Transform scale(double x, double y, double z);
    static Transform rotate(double degrees, double x, double y, double z); // right-hand rule about (x, y, z)
    Transform operator*(const Transform& b) const;
    Transform inverse() const; // throws Error for a singular matrix
    Vec3f point(const Vec3f& p) const;
    Vec3f vector(const Vec3f& v) const;
    // Normals go with the transpose of the inverse: n' = inverse().transposed() n. Not normalised.
    Vec3f normal(const Vec3f& n, const Transform& inverse) const;
    double determinant3() const; // of the linear part; negative = the handedness flips
    bool operator==(const Transform&) const = default;
};

} // namespace kanuka
