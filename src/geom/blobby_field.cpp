#include "geom/blobby_field.h"

#include <algorithm>
#include <cmath>

namespace kanuka::geom {
namespace {

using Interval = BlobbyField::Interval;

// (1 - r^2)^3 within the unit ball: RISpec's 1 - 3 r^2 + 3 r^4 - r^6.
double bump(double r2) {
    const double f = 1 - r2;
    return r2 < 1 ? f * f * f : 0;
}

// Arithmetic that the operations need, on numbers, numbers with gradients, and ranges.
double add(double a, double b) {
    return a + b;
}
double multiply(double a, double b) {
    return a * b;
}
double largest(double a, double b) {
    return std::max(a, b);
}
double smallest(double a, double b) {
    return std::min(a, b);
}
double negate(double a) {
    return -a;
}
constexpr double LeastDivisor = 1e-9;
double guarded(double b) {
    return std::abs(b) < LeastDivisor ? std::copysign(LeastDivisor, b) : b;
}
// Nothing is there where the divisor is nothing: far from all blobs 0 / 0 is 0, and no plateau rises about
// the divisor's own end.
double divide(double a, double b) {
    return b == 0 ? 0 : a / guarded(b);
}

Dual add(const Dual& a, const Dual& b) {
    return {a.v + b.v, a.x + b.x, a.y + b.y, a.z + b.z};
}
Dual scaled(const Dual& a, double f) {
    return {a.v * f, a.x * f, a.y * f, a.z * f};
}
Dual multiply(const Dual& a, const Dual& b) {
    return {a.v * b.v, a.x * b.v + b.x * a.v, a.y * b.v + b.y * a.v, a.z * b.v + b.z * a.v};
}
Dual largest(const Dual& a, const Dual& b) {
    return a.v < b.v ? b : a;
}
Dual smallest(const Dual& a, const Dual& b) {
    return b.v < a.v ? b : a;
}
Dual negate(const Dual& a) {
    return scaled(a, -1);
}
Dual divide(const Dual& a, const Dual& b) {
    if (b.v == 0)
        return {0, 0, 0, 0};
    const double d = guarded(b.v), q = a.v / d;
    return {q, (a.x - q * b.x) / d, (a.y - q * b.y) / d, (a.z - q * b.z) / d};
}

Interval add(const Interval& a, const Interval& b) {
    return {a.lo + b.lo, a.hi + b.hi};
}
Interval multiply(const Interval& a, const Interval& b) {
    const double p[] = {a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi};
    return {*std::min_element(p, p + 4), *std::max_element(p, p + 4)};
}
Interval largest(const Interval& a, const Interval& b) {
    return {std::max(a.lo, b.lo), std::max(a.hi, b.hi)};
}
Interval smallest(const Interval& a, const Interval& b) {
    return {std::min(a.lo, b.lo), std::min(a.hi, b.hi)};
}
Interval negate(const Interval& a) {
    return {-a.hi, -a.lo};
}
Interval divide(const Interval& a, const Interval& b) {
    if (b.lo == 0 && b.hi == 0)
        return {0, 0};
    if (b.lo < LeastDivisor && b.hi > -LeastDivisor)
        return {-1e300, 1e300};
    return multiply(a, {1 / b.hi, 1 / b.lo});
}

} // namespace

void BlobbyField::take(const Transform& m, const double* p, double w, double* q) {
    for (size_t r = 0; r < 3; r++)
        q[r] = m.m[r][0] * p[0] + m.m[r][1] * p[1] + m.m[r][2] * p[2] + w * m.m[r][3];
}

// Squared distance of p from the blob's core over its radius; its gradient where asked for.
double BlobbyField::squared(const Node& node, const double* p, double* gradient) {
    double q[3];
    take(node.to_blob, p, 1, q);
    if (node.op == Op::Segment) {
        double t = 0;
        for (int c = 0; c < 3; c++)
            t += (q[c] - node.p[c]) * node.d[c];
        t = std::clamp(t * node.inverse_length2, 0.0, 1.0);
        for (int c = 0; c < 3; c++)
            q[c] = (q[c] - node.p[c] - t * node.d[c]) * node.inverse_radius;
    }
    if (gradient) { // the core's nearest point stands still to first order
        const double f = 2 * (node.op == Op::Segment ? node.inverse_radius : 1);
        for (size_t c = 0; c < 3; c++)
            gradient[c] =
                f * (q[0] * node.to_blob.m[0][c] + q[1] * node.to_blob.m[1][c] + q[2] * node.to_blob.m[2][c]);
    }
    return q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
}

// A repelling plane at height z: (D b(z / C) - B / z) (1 - e(z / A)), where b rises from 0 to 1 at 1 and
// falls to 0 at 2, and e eases from 0 to 1: below, a barrier keeps the surface out, above it swells.
static double repelling_bump(double r) {
    const double f = r * (2 - r);
    return r > 0 && r < 2 ? f * f * f : 0;
}
static double ease(double r) {
    return r <= 0 ? 0 : r >= 1 ? 1 : r * r * (3 - 2 * r);
}
constexpr double LeastHeight = 1e-6;

double BlobbyField::ground_value(const Node& node, const double* p) const {
    double q[3];
    take(m_world_from_object, p, 1, q);
    const double h = node.ground->height(q);
    if (!(h < node.reach))
        return 0;
    const double z = std::max(h, LeastHeight);
    return (node.swell * repelling_bump(z / node.bulge) - node.barrier / z) * (1 - ease(z / node.reach));
}

Interval BlobbyField::ground_range(const Node& node, const double* lo, const double* hi) const {
    double corners[8][3];
    for (int k = 0; k < 8; k++) {
        const double p[3] = {k & 1 ? hi[0] : lo[0], k & 2 ? hi[1] : lo[1], k & 4 ? hi[2] : lo[2]};
        take(m_world_from_object, p, 1, corners[k]);
    }
    const GroundMap::Range h = node.ground->heights(corners);
    if (!(h.lo < node.reach))
        return {0, 0};
    const double a = std::max(h.lo, LeastHeight), b = std::clamp(h.hi, LeastHeight, node.reach);
    const double r = a / node.bulge, s = b / node.bulge;
    const Interval bump{std::min(repelling_bump(r), repelling_bump(s)),
                        r <= 1 && s >= 1 ? 1 : std::max(repelling_bump(r), repelling_bump(s))};
    const Interval swell = multiply(bump, Interval{node.swell, node.swell});
    const Interval barrier = multiply(Interval{1 / b, 1 / a}, Interval{-node.barrier, -node.barrier});
    return multiply(add(swell, barrier), Interval{1 - ease(b / node.reach), 1 - ease(a / node.reach)});
}

Interval BlobbyField::leaf_range(const Node& node, const double* lo, const double* hi) const {
    double mid[3], half = 0;
    for (int c = 0; c < 3; c++) {
        mid[c] = (lo[c] + hi[c]) / 2;
        half += (hi[c] - lo[c]) * (hi[c] - lo[c]) / 4;
    }
    const double r = std::sqrt(squared(node, mid, nullptr)), reach = node.stretch * std::sqrt(half);
    const double near = std::max(0.0, r - reach), far = r + reach;
    return {bump(far * far), bump(near * near)};
}

// Values of all nodes that a box has, in order; those that are zero there are `T()`.
template <class T, class Leaf>
T BlobbyField::run(Local& local, std::vector<T>& values, Leaf leaf) const {
    T last{};
    for (const int n : local.nodes) {
        const Node& node = m_nodes[size_t(n)];
        T& v = values[size_t(n)];
        const auto in = [&](size_t k) -> const T& { return values[size_t(node.operands[k])]; };
        const auto fold = [&](auto combine) {
            v = in(0);
            for (size_t k = 1; k < node.operands.size(); k++)
                v = combine(v, in(k));
        };
        switch (node.op) {
        case Op::Zero:
            v = T{};
            break;
        case Op::Constant:
        case Op::Ellipsoid:
        case Op::Segment:
        case Op::Ground:
            v = leaf(node);
            break;
        case Op::Add: // what is zero adds nothing
            v = T{};
            for (const int k : node.operands)
                if (!local.zero[size_t(k)])
                    v = add(v, values[size_t(k)]);
            break;
        case Op::Multiply:
            fold([](const T& a, const T& b) { return multiply(a, b); });
            break;
        case Op::Max:
            fold([](const T& a, const T& b) { return largest(a, b); });
            break;
        case Op::Min:
            fold([](const T& a, const T& b) { return smallest(a, b); });
            break;
        case Op::Subtract:
            v = add(in(0), negate(in(1)));
            break;
        case Op::Divide:
            v = divide(in(0), in(1));
            break;
        case Op::Negate:
            v = negate(in(0));
            break;
        }
        last = v;
    }
    return last;
}

void BlobbyField::localize(const double* lo, const double* hi, const Local* outer, Local& local) const {
    const size_t n = m_nodes.size();
    local.nodes.clear();
    local.zero.assign(n, 1);
    local.scratch.assign(n, 0);
    local.duals.assign(n, {});
    std::vector<Interval> ranges(n);
    const auto consider = [&](int i) {
        const Node& node = m_nodes[size_t(i)];
        bool zero = node.op == Op::Zero;
        if (node.op == Op::Ellipsoid || node.op == Op::Segment) {
            ranges[size_t(i)] = leaf_range(node, lo, hi);
            zero = !(ranges[size_t(i)].hi > 0);
        } else if (node.op == Op::Ground) {
            ranges[size_t(i)] = ground_range(node, lo, hi);
            zero = ranges[size_t(i)].lo == 0 && ranges[size_t(i)].hi == 0;
        } else if (!node.operands.empty()) {
            zero = true;
            for (const int k : node.operands)
                zero &= bool(local.zero[size_t(k)]);
        }
        if (!zero) {
            local.zero[size_t(i)] = 0;
            local.nodes.push_back(i);
        }
    };
    if (outer)
        for (const int i : outer->nodes)
            consider(i);
    else
        for (size_t i = 0; i < n; i++)
            consider(int(i));
    if (local.nodes.empty() || local.nodes.back() != int(n) - 1) {
        local.nodes.clear(); // zero all over
        local.crosses = false;
        return;
    }
    const Interval all = run<Interval>(local, ranges, [&](const Node& node) {
        return node.op == Op::Constant ? Interval{node.constant, node.constant}
                                       : ranges[size_t(&node - m_nodes.data())];
    });
    local.crosses = all.lo <= Surface && all.hi >= Surface;
}

double BlobbyField::value(const double* p, Local& local) const {
    return run<double>(local, local.scratch, [&](const Node& node) {
        return node.op == Op::Constant ? node.constant
               : node.op == Op::Ground ? ground_value(node, p)
                                       : bump(squared(node, p, nullptr));
    });
}

Dual BlobbyField::dual(const double* p, Local& local) const {
    return run<Dual>(local, local.duals, [&](const Node& node) {
        if (node.op == Op::Constant)
            return Dual{node.constant, 0, 0, 0};
        double g[3];
        if (node.op == Op::Ground) { // depths are bilinear: differences tell as much as derivatives
            const double step = 1e-3 * std::min(node.reach, node.bulge);
            for (int c = 0; c < 3; c++) {
                double a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
                a[c] -= step, b[c] += step;
                g[c] = (ground_value(node, b) - ground_value(node, a)) / (2 * step);
            }
            return Dual{ground_value(node, p), g[0], g[1], g[2]};
        }
        const double r2 = squared(node, p, g);
        const double slope = r2 < 1 ? -3 * (1 - r2) * (1 - r2) : 0;
        return Dual{bump(r2), slope * g[0], slope * g[1], slope * g[2]};
    });
}

// A sum's parts count by their values, an extremum's by which it is; what is subtracted or divided by has no
// say.
void BlobbyField::influences(const double* p, Local& local, std::vector<double>& by_leaf) const {
    by_leaf.assign(size_t(std::max(m_leaves, 1)), 0);
    value(p, local);
    std::vector<double> share(m_nodes.size(), 0);
    share.back() = 1;
    for (size_t k = local.nodes.size(); k-- > 0;) {
        const int n = local.nodes[k];
        const Node& node = m_nodes[size_t(n)];
        const double own = share[size_t(n)];
        if (own == 0)
            continue;
        const auto of = [&](int i) { return local.zero[size_t(i)] ? 0.0 : local.scratch[size_t(i)]; };
        switch (node.op) {
        case Op::Add:
        case Op::Multiply: {
            double sum = 0;
            for (const int i : node.operands)
                sum += std::max(0.0, of(i));
            for (const int i : node.operands)
                share[size_t(i)] +=
                    own * (sum > 0 ? std::max(0.0, of(i)) / sum : 1.0 / double(node.operands.size()));
            break;
        }
        case Op::Max:
        case Op::Min: {
            int best = node.operands[0];
            for (const int i : node.operands)
                if (node.op == Op::Max ? of(i) > of(best) : of(i) < of(best))
                    best = i;
            share[size_t(best)] += own;
            break;
        }
        case Op::Subtract:
        case Op::Divide:
        case Op::Negate:
            share[size_t(node.operands[0])] += own;
            break;
        default:
            if (node.leaf >= 0)
                by_leaf[size_t(node.leaf)] += own;
        }
    }
    double sum = 0;
    for (const double w : by_leaf)
        sum += w;
    if (!(sum > 0))
        by_leaf[0] = sum = 1;
    for (double& w : by_leaf)
        w /= sum;
}

} // namespace kanuka::geom
