#include "base/motion.h"

namespace kanuka {
namespace {

using M3 = std::array<double, 9>;
using Q = std::array<double, 4>;

double determinant(const M3& m) {
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

M3 cofactors(const M3& m) {
    return {m[4] * m[8] - m[5] * m[7], m[5] * m[6] - m[3] * m[8], m[3] * m[7] - m[4] * m[6],
            m[2] * m[7] - m[1] * m[8], m[0] * m[8] - m[2] * m[6], m[1] * m[6] - m[0] * m[7],
            m[1] * m[5] - m[2] * m[4], m[2] * m[3] - m[0] * m[5], m[0] * m[4] - m[1] * m[3]};
}

// The rotation nearest to m, by Newton's iteration on R = (R + R^-T) / 2, scaled (Higham 1986). A mirroring
// matrix gives the rotation of -m; a singular one none.
bool nearest_rotation(const M3& m, M3& r) {
    r = m;
    if (!(std::abs(determinant(m)) > 1e-280))
        return false;
    if (determinant(m) < 0)
        for (double& x : r)
            x = -x;
    for (int step = 0; step < 60; step++) {
        const double d = determinant(r);
        const M3 c = cofactors(r);
        if (!(std::abs(d) > 1e-300))
            return false;
        // Scaling by the determinant's cube root brings matrices of any size near at once.
        const double g = step < 4 ? 1 / std::cbrt(std::abs(d)) : 1;
        double change = 0;
        M3 next;
        for (size_t i = 0; i < 9; i++) {
            next[i] = 0.5 * (g * r[i] + c[i] / (d * g));
            change = std::max(change, std::abs(next[i] - r[i]));
        }
        r = next;
        if (change < 1e-15)
            break;
    }
    return std::isfinite(r[0] + r[4] + r[8]);
}

Q quaternion(const M3& r) {
    const double trace = r[0] + r[4] + r[8];
    Q q;
    if (trace > 0) {
        const double s = std::sqrt(trace + 1) * 2;
        q = {s / 4, (r[7] - r[5]) / s, (r[2] - r[6]) / s, (r[3] - r[1]) / s};
    } else if (r[0] > r[4] && r[0] > r[8]) {
        const double s = std::sqrt(1 + r[0] - r[4] - r[8]) * 2;
        q = {(r[7] - r[5]) / s, s / 4, (r[1] + r[3]) / s, (r[2] + r[6]) / s};
    } else if (r[4] > r[8]) {
        const double s = std::sqrt(1 + r[4] - r[0] - r[8]) * 2;
        q = {(r[2] - r[6]) / s, (r[1] + r[3]) / s, s / 4, (r[5] + r[7]) / s};
    } else {
        const double s = std::sqrt(1 + r[8] - r[0] - r[4]) * 2;
        q = {(r[3] - r[1]) / s, (r[2] + r[6]) / s, (r[5] + r[7]) / s, s / 4};
    }
    const double l = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& x : q)
        x /= l;
    return q;
}

M3 matrix(const Q& q) {
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
            2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

M3 product(const M3& a, const M3& b) {
    M3 r;
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            r[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    return r;
}

M3 transposed(const M3& m) {
    return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}

double norm(const M3& m, const Vec3f& p) {
    double sum = 0;
    for (size_t i = 0; i < 3; i++) {
        const double x = m[3 * i] * double(p.x) + m[3 * i + 1] * double(p.y) + m[3 * i + 2] * double(p.z);
        sum += x * x;
    }
    return std::sqrt(sum);
}

} // namespace

MotionPath::MotionPath(std::span<const TransformKey> keys, const Transform& before, const Transform& after)
    : m_after(after), m_has_after(!(after == Transform{})) {
    for (const TransformKey& k : keys) {
        const Transform t = before * k.transform;
        Key key;
        key.time = k.time;
        M3 m, r;
        for (size_t i = 0; i < 3; i++) {
            key.translation[i] = t.m[i][3];
            for (size_t j = 0; j < 3; j++)
                m[3 * i + j] = t.m[i][j];
        }
        key.stretch = m;
        if (nearest_rotation(m, r)) {
            key.rotation = quaternion(r);
            key.stretch = product(transposed(matrix(key.rotation)), m);
        }
        if (!m_keys.empty()) {
            Key& last = m_keys.back();
            double d = 0;
            for (size_t i = 0; i < 4; i++)
                d += last.rotation[i] * key.rotation[i];
            if (d < 0) { // the same rotation, by the shorter arc
                for (double& x : key.rotation)
                    x = -x;
                d = -d;
            }
            last.angle = std::acos(std::min(d, 1.0));
        }
        m_keys.push_back(key);
    }
    if (m_keys.empty()) {
        const TransformKey still{0, {}};
        *this = MotionPath({&still, 1}, before, after);
    }
}

MotionPath::Place MotionPath::place(double time) const {
    size_t i = 0;
    while (i + 2 < m_keys.size() && m_keys[i + 1].time <= time)
        i++;
    const Key &a = m_keys[i], &b = m_keys[std::min(i + 1, m_keys.size() - 1)];
    const double span = b.time - a.time;
    return {&a, &b, span > 0 ? std::clamp((time - a.time) / span, 0.0, 1.0) : 0.0};
}

Transform MotionPath::at(double time) const {
    if (m_keys.empty())
        return {};
    const Place p = place(time);
    double wa = 1 - p.f, wb = p.f;
    if (p.a->angle > 1e-6) { // spherical linear interpolation (Shoemake 1985)
        const double s = 1 / std::sin(p.a->angle);
        wa = std::sin(wa * p.a->angle) * s;
        wb = std::sin(wb * p.a->angle) * s;
    }
    Q q;
    double l = 0;
    for (size_t i = 0; i < 4; i++) {
        q[i] = wa * p.a->rotation[i] + wb * p.b->rotation[i];
        l += q[i] * q[i];
    }
    l = 1 / std::sqrt(l);
    for (double& x : q)
        x *= l;
    M3 stretch;
    for (size_t i = 0; i < 9; i++)
        stretch[i] = p.a->stretch[i] + (p.b->stretch[i] - p.a->stretch[i]) * p.f;
    const M3 m = product(matrix(q), stretch);
    Transform t;
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++)
            t.m[i][j] = m[3 * i + j];
        t.m[i][3] = p.a->translation[i] + (p.b->translation[i] - p.a->translation[i]) * p.f;
    }
    return m_has_after ? t * m_after : t;
}

void MotionPath::at(double time, float* out) const {
    const Transform t = at(time);
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 4; j++)
            *out++ = float(t.m[i][j]);
}

std::vector<double> MotionPath::times() const {
    std::vector<double> t;
    for (const Key& k : m_keys)
        t.push_back(k.time);
    return t;
}

double MotionPath::turning() const {
    double sum = 0;
    for (const Key& k : m_keys)
        sum += 2 * k.angle;
    return sum;
}

// x(t) = R(t) S(t) p + T(t) with S and T linear: |x''| <= turn^2 |S p| + 2 turn |S' p|, and the chord is at
// most an eighth of that away.
double MotionPath::deviation(double t0, double t1, const Bounds3f& box) const {
    if (m_keys.size() < 2)
        return 0;
    const Place p = place(0.5 * (t0 + t1));
    const double span = p.b->time - p.a->time;
    if (!(span > 0))
        return 0;
    const double share = std::min(1.0, std::abs(t1 - t0) / span), turn = 2 * p.a->angle * share;
    M3 change;
    for (size_t i = 0; i < 9; i++)
        change[i] = p.b->stretch[i] - p.a->stretch[i];
    double radius = 0, growth = 0;
    for (int k = 0; k < 8; k++) {
        Vec3f c{k & 1 ? box.hi.x : box.lo.x, k & 2 ? box.hi.y : box.lo.y, k & 4 ? box.hi.z : box.lo.z};
        if (m_has_after)
            c = m_after.point(c);
        radius = std::max({radius, norm(p.a->stretch, c), norm(p.b->stretch, c)});
        growth = std::max(growth, norm(change, c) * share);
    }
    return turn * (turn * radius + 2 * growth) / 8;
}

namespace {

struct Box {
    std::array<double, 3> lo, hi;
};
Box placed(const Transform& t, const Bounds3f& box) {
    constexpr double Rounding = 0x1p-20; // of what the sums are made of
    Box out;
    for (size_t a = 0; a < 3; a++) {
        double middle = t.m[a][3], half = 0, size = std::abs(t.m[a][3]);
        for (int k = 0; k < 3; k++) {
            const double m = t.m[a][size_t(k)], at = m * (double(box.lo[k]) + double(box.hi[k])) / 2,
                         reach = std::abs(m) * (double(box.hi[k]) - double(box.lo[k])) / 2;
            middle += at, half += reach, size += std::abs(at) + reach;
        }
        out.lo[a] = middle - half - Rounding * size, out.hi[a] = middle + half + Rounding * size;
    }
    return out;
}

} // namespace

int MotionPath::times_to_bound() const {
    constexpr double TurnAStep = 0.2; // radians: boxes that turn by that much fit well enough
    constexpr int Most = 65;          // Embree takes 129
    const double pieces = std::max({1.0, turning() / TurnAStep, double(m_keys.size()) - 1});
    return 1 + int(std::min(std::ceil(pieces), double(Most - 1)));
}

// Turning boxes swell between two times. Every time's box is widened by what the neighbouring pieces lack:
// measured at several times of a piece, and bounded between those by how far an arc may lie from its chord.
void MotionPath::bound(const Bounds3f& box, std::span<Bounds3f> at_times) const {
    constexpr int Samples = 4; // a piece
    const size_t steps = at_times.size();
    if (box.empty()) {
        std::fill(at_times.begin(), at_times.end(), Bounds3f{{0, 0, 0}, {0, 0, 0}});
        return;
    }
    const auto time_of = [&](size_t step) { return double(step) / double(steps - 1); };
    std::vector<Box> exact, wide;
    for (size_t j = 0; j < steps; j++)
        exact.push_back(placed(at(time_of(j)), box));
    wide = exact;
    std::vector<double> times;
    for (size_t j = 0; j + 1 < steps; j++) {
        const double t0 = time_of(j), t1 = time_of(j + 1);
        times.clear();
        for (int i = 0; i <= Samples; i++)
            times.push_back(t0 + (t1 - t0) * i / Samples);
        for (const Key& k : m_keys)
            if (k.time > t0 && k.time < t1)
                times.push_back(k.time);
        std::sort(times.begin(), times.end());
        std::array<double, 3> lack_low{}, lack_high{};
        double before = 0; // how far what moves may stray from the chord that ends here
        for (size_t i = 0; i < times.size(); i++) {
            const double behind = i + 1 < times.size() ? deviation(times[i], times[i + 1], box) : 0,
                         stray = std::max(before, behind), f = (times[i] - t0) / (t1 - t0);
            const Box now = i == 0                  ? exact[j]
                            : i + 1 == times.size() ? exact[j + 1]
                                                    : placed(at(times[i]), box);
            const auto between = [&](double a, double b) { return a + (b - a) * f; };
            for (size_t c = 0; c < 3; c++) {
                const double lo = between(exact[j].lo[c], exact[j + 1].lo[c]),
                             hi = between(exact[j].hi[c], exact[j + 1].hi[c]);
                lack_low[c] = std::max(lack_low[c], lo - now.lo[c] + stray);
                lack_high[c] = std::max(lack_high[c], now.hi[c] + stray - hi);
            }
            before = behind;
        }
        for (const size_t k : {j, j + 1})
            for (size_t c = 0; c < 3; c++) {
                wide[k].lo[c] = std::min(wide[k].lo[c], exact[k].lo[c] - lack_low[c]);
                wide[k].hi[c] = std::max(wide[k].hi[c], exact[k].hi[c] + lack_high[c]);
            }
    }
    for (size_t j = 0; j < steps; j++)
        for (size_t c = 0; c < 3; c++) {
            // As floats, whose interpolation rounds.
            const double rounding = 0x1p-21 * std::max(std::abs(wide[j].lo[c]), std::abs(wide[j].hi[c]));
            at_times[j].lo[int(c)] = float(wide[j].lo[c] - rounding);
            at_times[j].hi[int(c)] = float(wide[j].hi[c] + rounding);
        }
}

std::vector<TransformKey> compose(std::span<const TransformKey> outer, const Transform& still_outer,
                                  std::span<const TransformKey> inner, const Transform& still_inner) {
    std::vector<double> times;
    for (const auto& list : {outer, inner})
        for (const TransformKey& k : list)
            times.push_back(k.time);
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    const MotionPath a(outer), b(inner);
    std::vector<TransformKey> out;
    for (const double t : times) {
        // At its own keys a path is the matrix that was given, digit by digit.
        const auto at = [&](std::span<const TransformKey> keys, const MotionPath& path,
                            const Transform& still) {
            if (keys.empty())
                return still;
            for (const TransformKey& k : keys)
                if (k.time == t)
                    return k.transform;
            return path.at(t);
        };
        out.push_back({t, at(outer, a, still_outer) * at(inner, b, still_inner)});
    }
    return out;
}

} // namespace kanuka
