#include "geom/trim.h"

#include <algorithm>
#include <cmath>

namespace kanuka::geom {
namespace {

constexpr int MaxOrder = 32;
constexpr int MostHalvings = 10;
constexpr float Tolerance = 0.05f; // micropolygon edges between a curve and its polygon
constexpr size_t Rows = 256;

using Place = std::array<double, 2>;

// A rational B-spline curve in the plane.
struct Curve {
    int order;
    size_t count;
    const float *knots, *u, *v, *w;
    double lo, hi;

    // De Boor's algorithm in homogeneous coordinates, in double.
    Place at(double t) const {
        size_t k = size_t(order) - 1;
        while (k + 1 < count && t >= double(knots[k + 1]))
            k++;
        std::array<std::array<double, 3>, MaxOrder> d;
        for (size_t j = 0; j < size_t(order); j++) {
            const size_t i = k + 1 - size_t(order) + j;
            d[j] = {double(u[i]), double(v[i]), double(w[i])};
        }
        for (size_t r = 1; r < size_t(order); r++)
            for (size_t j = size_t(order) - 1; j >= r; j--) {
                const size_t i = k + 1 - size_t(order) + j;
                const double a = double(knots[i]), b = double(knots[i + size_t(order) - r]);
                const double f = b > a ? (t - a) / (b - a) : 0;
                for (size_t c = 0; c < 3; c++)
                    d[j][c] = d[j - 1][c] * (1 - f) + d[j][c] * f;
            }
        const auto& q = d[size_t(order) - 1];
        return {q[0] / q[2], q[1] / q[2]};
    }
};

class Flattener {
  public:
    Flattener(const ParameterRange& range, const TrimRegion::Distance& distance, std::vector<Place>& out)
        : m_range(range), m_distance(distance), m_out(out) {}

    // Appends the curve without its end. False: it is not finite.
    bool run(const Curve& curve) {
        m_curve = &curve;
        for (size_t k = size_t(curve.order) - 1; k < curve.count; k++) {
            const double a = std::max(curve.lo, double(curve.knots[k])),
                         b = std::min(curve.hi, double(curve.knots[k + 1]));
            if (!(b > a))
                continue;
            // Enough pieces that a wiggle of the span cannot hide between ends and middle.
            const int pieces = curve.order == 2 && is_polynomial(k) ? 1 : 2 * (curve.order - 1);
            for (int i = 0; i < pieces; i++) {
                const double t0 = a + (b - a) * i / pieces, t1 = a + (b - a) * (i + 1) / pieces;
                const Place p0 = place(t0), p1 = place(t1);
                m_out.push_back(p0);
                if (pieces > 1)
                    halve(t0, t1, p0, p1, 0);
            }
        }
        m_last = place(curve.hi);
        return std::ranges::all_of(m_out,
                                   [](const Place& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); });
    }
    Place last() const { return m_last; }

  private:
    bool is_polynomial(size_t k) const {
        return m_curve->w[k] == m_curve->w[k - 1]; // of the two points of a straight span
    }
    Place place(double t) const {
        const Place p = m_curve->at(t);
        return {(p[0] - m_range.u0) / (m_range.u1 - m_range.u0),
                (p[1] - m_range.v0) / (m_range.v1 - m_range.v0)};
    }
    void halve(double t0, double t1, const Place& p0, const Place& p1, int depth) {
        const double t = (t0 + t1) / 2;
        const Place p = place(t);
        const Place chord = {(p0[0] + p1[0]) / 2, (p0[1] + p1[1]) / 2};
        if (depth >= MostHalvings || !(m_distance(chord[0], chord[1], p[0], p[1]) > Tolerance))
            return;
        halve(t0, t, p0, p, depth + 1);
        m_out.push_back(p);
        halve(t, t1, p, p1, depth + 1);
    }

    const ParameterRange& m_range;
    const TrimRegion::Distance& m_distance;
    std::vector<Place>& m_out;
    const Curve* m_curve = nullptr;
    Place m_last{};
};

std::string fault(const scene::TrimCurves& t, size_t i, size_t knot, size_t point) {
    const int order = t.order[i], count = t.points[i];
    if (order < 2 || order > MaxOrder || count < order)
        return "it has " + std::to_string(count) + " points of order " + std::to_string(order);
    if (knot + size_t(order) + size_t(count) > t.knots.size())
        return "knots are missing";
    if (point + size_t(count) > std::min({t.u.size(), t.v.size(), t.w.size()}))
        return "points are missing";
    const float* k = t.knots.data() + knot;
    for (int j = 1; j < order + count; j++)
        if (!(k[j] >= k[j - 1]) || !std::isfinite(k[j]))
            return "its knots are not in rising order";
    if (!(k[count] > k[order - 1]))
        return "its range is empty";
    return {};
}

} // namespace

TrimRegion::TrimRegion(const scene::TrimCurves& t, const ParameterRange& range, const Distance& distance,
                       const Location& where, Journal& journal)
    : m_outside(t.outside) {
    constexpr double Open = 1e-4; // of the range: loops that end so far from where they began
    size_t curve = 0, knot = 0, point = 0, bad = 0, open = 0;
    std::string why;
    const size_t curves = std::min({t.order.size(), t.points.size(), t.min.size(), t.max.size()});
    for (const int32_t in_loop : t.curves_per_loop) {
        std::vector<Place> loop;
        Place last{};
        for (int32_t c = 0; c < in_loop && curve < curves; c++, curve++) {
            std::string problem = fault(t, curve, knot, point);
            if (problem.empty()) {
                Curve one{t.order[curve],
                          size_t(t.points[curve]),
                          t.knots.data() + knot,
                          t.u.data() + point,
                          t.v.data() + point,
                          t.w.data() + point,
                          0,
                          0};
                one.lo = std::max(double(t.min[curve]), double(one.knots[one.order - 1]));
                one.hi = std::min(double(t.max[curve]), double(one.knots[one.count]));
                std::vector<Place> places;
                Flattener flattener(range, distance, places);
                if (!(one.hi > one.lo))
                    problem = "its range is empty";
                else if (!flattener.run(one))
                    problem = "it is not finite";
                else {
                    open +=
                        !loop.empty() && std::hypot(places[0][0] - last[0], places[0][1] - last[1]) > Open;
                    loop.insert(loop.end(), places.begin(), places.end());
                    last = flattener.last();
                }
            }
            if (!problem.empty()) {
                bad++;
                why = problem;
            }
            knot += size_t(std::max(0, t.order[curve] + t.points[curve]));
            point += size_t(std::max(0, t.points[curve]));
        }
        if (loop.empty())
            continue;
        if (std::hypot(loop[0][0] - last[0], loop[0][1] - last[1]) > Open) {
            open++;
            loop.push_back(last);
        }
        add_loop(loop);
    }
    if (bad > 0)
        journal.error(where, std::to_string(bad) + " of " + std::to_string(t.order.size()) +
                                 " trim curves were left out: " + why);
    if (open > 0)
        journal.warning(where, "trim curves do not meet at " + std::to_string(open) +
                                   " places; they were joined by straight lines");
    make_rows();
}

TrimRegion::Point TrimRegion::even(double u, double v) {
    return {2 * std::llround(u * (Unit / 2)), 2 * std::llround(v * (Unit / 2))};
}

// Loops that run along the border of the surface are moved outside: they cut nothing there.
static int64_t odd_coordinate(double x) {
    constexpr double Near = 1e-6, Beyond = 1e-4;
    x = std::abs(x) < Near ? -Beyond : std::abs(x - 1) < Near ? 1 + Beyond : std::clamp(x, -4.0, 5.0);
    return 2 * std::llround(x * (TrimRegion::Unit / 2)) + 1;
}

void TrimRegion::add_loop(const std::vector<Place>& loop) {
    const size_t first = points.size();
    for (const Place& p : loop) {
        const Point q{odd_coordinate(p[0]), odd_coordinate(p[1])};
        if (points.size() == first || !(q == points.back()))
            points.push_back(q);
    }
    while (points.size() > first + 1 && points.back() == points[first])
        points.pop_back();
    if (points.size() < first + 3) {
        points.resize(first);
        return;
    }
    for (size_t i = first; i < points.size(); i++) {
        next.push_back(int(i + 1 < points.size() ? i + 1 : first));
        previous.push_back(int(i > first ? i - 1 : points.size() - 1));
    }
}

size_t TrimRegion::row_of(int64_t y) const {
    const double f = double(y - m_box.lo.y) / double(std::max<int64_t>(1, m_box.hi.y - m_box.lo.y));
    return size_t(std::clamp(f, 0.0, 1.0) * double(Rows - 1));
}

void TrimRegion::make_rows() {
    m_rows.assign(Rows, {});
    for (const Point& p : points)
        m_box.extend(p);
    for (int i = 0; i < int(points.size()); i++) {
        const Box b = box(i);
        for (size_t r = row_of(b.lo.y); r <= row_of(b.hi.y); r++)
            m_rows[r].push_back(i);
    }
}

void TrimRegion::overlapping(const Box& wanted, std::vector<int>& segments) const {
    segments.clear();
    if (points.empty() || !wanted.overlaps(m_box))
        return;
    for (size_t r = row_of(wanted.lo.y); r <= row_of(wanted.hi.y); r++)
        for (const int i : m_rows[r])
            if (box(i).overlaps(wanted))
                segments.push_back(i);
    std::sort(segments.begin(), segments.end());
    segments.erase(std::unique(segments.begin(), segments.end()), segments.end());
}

// Crossings of a line to the right, which is even in y as everything that is asked about.
bool TrimRegion::odd(const Point& p, const std::vector<int>& segments) const {
    bool odd = false;
    for (const int i : segments) {
        const Point &a = begin(i), &b = end(i);
        if ((a.y > p.y) != (b.y > p.y))
            odd ^= left_of(i, p) == (b.y > a.y); // upwards: p is left of it, so it is right of p
    }
    return odd;
}

bool TrimRegion::keeps(const Point& p) const {
    if (points.empty()) // nothing usable: better whole than gone
        return true;
    if (p.y < m_box.lo.y || p.y > m_box.hi.y)
        return m_outside;
    return odd(p, m_rows[row_of(p.y)]) != m_outside;
}

bool TrimRegion::keeps_without(const Point& p, int first) const {
    std::vector<char> own(points.size(), 0);
    for (int i = first; !own[size_t(i)]; i = next[size_t(i)])
        own[size_t(i)] = 1;
    std::vector<int> others;
    for (int i = 0; i < int(points.size()); i++)
        if (!own[size_t(i)])
            others.push_back(i);
    return odd(p, others) != m_outside;
}

} // namespace kanuka::geom
