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

// Of a point that three rows take somewhere.
double norm(const std::array<double, 12>& m, const Vec3f& p) {
    double sum = 0;
    for (size_t i = 0; i < 12; i += 4) {
        const double x = m[i] * double(p.x) + m[i + 1] * double(p.y) + m[i + 2] * double(p.z) + m[i + 3];
        sum += x * x;
    }
    return std::sqrt(sum);
}

// A key's matrix, taken apart.
struct Key {
    double time;
    std::array<double, 3> translation;
    Q rotation{1, 0, 0, 0};
    M3 linear, stretch; // all of it, and without the rotation

    Key(double time, const Transform& t) : time(time) {
        for (size_t i = 0; i < 3; i++) {
            translation[i] = t.m[i][3];
            for (size_t j = 0; j < 3; j++)
                linear[3 * i + j] = t.m[i][j];
        }
        stretch = linear;
        M3 r;
        if (nearest_rotation(linear, r)) {
            rotation = quaternion(r);
            stretch = product(transposed(matrix(rotation)), linear);
        }
    }
    // By the shorter arc from another one; how far that is.
    double angle_from(const Q& other) {
        double d = 0;
        for (size_t i = 0; i < 4; i++)
            d += other[i] * rotation[i];
        if (d < 0) {
            for (double& x : rotation)
                x = -x;
            d = -d;
        }
        return std::acos(std::min(d, 1.0));
    }
    std::array<double, 12> rows(const M3& m, const std::array<double, 3>& moved,
                                const Transform& after) const {
        std::array<double, 12> out;
        for (size_t i = 0; i < 3; i++)
            for (size_t j = 0; j < 4; j++)
                out[4 * i + j] = m[3 * i] * after.m[0][j] + m[3 * i + 1] * after.m[1][j] +
                                 m[3 * i + 2] * after.m[2][j] + (j == 3 ? moved[i] : 0);
        return out;
    }
    // As it is turned and moved; without that.
    std::array<double, 12> whole(const Transform& after) const { return rows(linear, translation, after); }
    std::array<double, 12> stretched(const Transform& after) const { return rows(stretch, {}, after); }
};

// Sine and cosine of angles up to a right one, by Taylor's series: off by a bit or two of the last, and the
// same on every machine, which those of libraries are not.
struct Turn {
    double sine, cosine;

    explicit Turn(double a) {
        const double square = a * a;
        double of_sine = 1, of_cosine = 1;
#pragma GCC unroll 10
        for (int n = 20; n >= 2; n -= 2) {
            of_sine = std::fma(of_sine, square * (-1.0 / (n * (n + 1))), 1);
            of_cosine = std::fma(of_cosine, square * (-1.0 / (n * (n - 1))), 1);
        }
        sine = a * of_sine, cosine = of_cosine;
    }
};

typedef double Row __attribute__((vector_size(32)));
Row row(const double* p) {
    return Row{p[0], p[1], p[2], p[3]};
}

} // namespace

MotionPath::MotionPath(std::span<const TransformKey> keys, const Transform& before, const Transform& after) {
    constexpr double LeastAngle = 1e-6; // what it would be off by is its square
    if (keys.empty()) {
        const TransformKey still{0, {}};
        *this = MotionPath({&still, 1}, before, after);
        return;
    }
    Key last(keys[0].time, before * keys[0].transform);
    m_first.begin = m_first.end = last.time;
    m_first.from = m_first.to = last.whole(after);
    for (size_t k = 1; k < keys.size(); k++) {
        Key next(keys[k].time, before * keys[k].transform);
        Piece& p = k == 1 ? m_first : m_more.emplace_back();
        p.begin = last.time, p.end = next.time;
        p.angle = next.angle_from(last.rotation);
        if (p.angle > LeastAngle) {
            const Turn turn(p.angle);
            p.cotangent = turn.cosine / turn.sine, p.per_sine = 1 / turn.sine;
            p.from = last.stretched(after), p.to = next.stretched(after);
            p.rotation_from = last.rotation, p.rotation_to = next.rotation;
            p.translation_from = last.translation, p.translation_to = next.translation;
        } else {
            p.angle = 0;
            p.from = last.whole(after), p.to = next.whole(after);
        }
        last = next;
    }
}

const MotionPath::Piece& MotionPath::piece_at(double time) const {
    size_t i = 0;
    while (i < m_more.size() && piece(i).end <= time)
        i++;
    return piece(i);
}

void MotionPath::at(double time, Transform& t) const {
    const Piece& p = piece_at(time);
    const double f = p.begin < p.end ? std::clamp((time - p.begin) / (p.end - p.begin), 0.0, 1.0) : 0;
    const auto between = [f](double a, double b) { return a + (b - a) * f; };
    Row rows[3];
    for (size_t i = 0; i < 3; i++) {
        const Row from = row(&p.from[4 * i]), to = row(&p.to[4 * i]);
        rows[i] = from + (to - from) * f;
    }
    if (p.angle > 0) {
        // Spherical linear interpolation (Shoemake 1985): sin((1 - f) a) / sin a and sin(f a) / sin a.
        const Turn turn(f * p.angle);
        const double wa = turn.cosine - p.cotangent * turn.sine, wb = turn.sine * p.per_sine;
        Q q;
        for (size_t i = 0; i < 4; i++)
            q[i] = wa * p.rotation_from[i] + wb * p.rotation_to[i];
        const M3 r = matrix(q);
        const Row x = rows[0], y = rows[1], z = rows[2];
        for (size_t i = 0; i < 3; i++)
            rows[i] = x * r[3 * i] + y * r[3 * i + 1] + z * r[3 * i + 2] +
                      Row{0, 0, 0, between(p.translation_from[i], p.translation_to[i])};
    }
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 4; j++)
            t.m[i][j] = rows[i][j];
}

Transform MotionPath::at(double time) const {
    Transform t;
    at(time, t);
    return t;
}

void MotionPath::at(double time, float* out) const {
    Transform t;
    at(time, t);
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 4; j++)
            *out++ = float(t.m[i][j]);
}

std::vector<double> MotionPath::times() const {
    std::vector<double> t{m_first.begin};
    for (size_t i = 0; moves() && i < count(); i++)
        t.push_back(piece(i).end);
    return t;
}

double MotionPath::turning() const {
    double sum = 0;
    for (size_t i = 0; i < count(); i++)
        sum += 2 * piece(i).angle;
    return sum;
}

// x(t) = R(t) S(t) p + T(t) with S and T linear: |x''| <= turn^2 |S p| + 2 turn |S' p|, and the chord is at
// most an eighth of that away.
double MotionPath::deviation(double t0, double t1, const Bounds3f& box) const {
    const Piece& p = piece_at(0.5 * (t0 + t1));
    if (p.angle == 0)
        return 0;
    const double share = std::min(1.0, std::abs(t1 - t0) / (p.end - p.begin)), turn = 2 * p.angle * share;
    std::array<double, 12> change;
    for (size_t i = 0; i < 12; i++)
        change[i] = p.to[i] - p.from[i];
    double radius = 0, growth = 0;
    for (int k = 0; k < 8; k++) {
        const Vec3f c{k & 1 ? box.hi.x : box.lo.x, k & 2 ? box.hi.y : box.lo.y, k & 4 ? box.hi.z : box.lo.z};
        radius = std::max({radius, norm(p.from, c), norm(p.to, c)});
        growth = std::max(growth, norm(change, c) * share);
    }
    return turn * (turn * radius + 2 * growth) / 8;
}

namespace {

struct Box {
    std::array<double, 3> lo, hi;

    Box() = default;
    explicit Box(const Bounds3f& b) : lo{b.lo.x, b.lo.y, b.lo.z}, hi{b.hi.x, b.hi.y, b.hi.z} {}
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

int MotionPath::times_to_bound(double turn_a_step) const {
    constexpr int Most = 65; // Embree takes 129
    const double pieces = std::max({1.0, turning() / turn_a_step, double(count())});
    return 1 + int(std::min(std::ceil(pieces), double(Most - 1)));
}

// Turning boxes swell between two times. Every time's box is widened by what the neighbouring pieces lack:
// measured at several times of a piece, and bounded between those by how far an arc may lie from its chord.
void MotionPath::bound(const Bounds3f& box, std::span<Bounds3f> at_times, const Around& around) const {
    constexpr int Samples = 4; // a piece
    const size_t steps = at_times.size();
    if (box.empty()) {
        std::fill(at_times.begin(), at_times.end(), Bounds3f{{0, 0, 0}, {0, 0, 0}});
        return;
    }
    const auto time_of = [&](size_t step) { return double(step) / double(steps - 1); };
    const auto box_at = [&](double time) { return around ? Box(around(at(time))) : placed(at(time), box); };
    std::vector<Box> exact, wide;
    for (size_t j = 0; j < steps; j++)
        exact.push_back(box_at(time_of(j)));
    wide = exact;
    std::vector<double> times;
    for (size_t j = 0; j + 1 < steps; j++) {
        const double t0 = time_of(j), t1 = time_of(j + 1);
        times.clear();
        for (int i = 0; i <= Samples; i++)
            times.push_back(t0 + (t1 - t0) * i / Samples);
        for (size_t k = 0; k < m_more.size(); k++)
            if (piece(k).end > t0 && piece(k).end < t1)
                times.push_back(piece(k).end);
        std::sort(times.begin(), times.end());
        std::array<double, 3> lack_low{}, lack_high{};
        double before = 0; // how far what moves may stray from the chord that ends here
        for (size_t i = 0; i < times.size(); i++) {
            const double behind = i + 1 < times.size() ? deviation(times[i], times[i + 1], box) : 0,
                         stray = std::max(before, behind), f = (times[i] - t0) / (t1 - t0);
            const Box now = i == 0 ? exact[j] : i + 1 == times.size() ? exact[j + 1] : box_at(times[i]);
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
