// The part of a triangle that is kept is found by walking: along its sides where they are kept, along the
// trim curve from where it enters to where it leaves. New vertices on a side follow from the side's ends
// alone, in one order, so both neighbours make the same bits; those inside lie in the triangle's plane. So
// the cut surface is the uncut one with a piece missing, watertight and with the same derivatives.
#include "dice/trim.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "dice/trim_polygon.h"

namespace kanuka::dice {
namespace {

using geom::TrimRegion;
using Point = TrimRegion::Point;
using Vertex = grid::TrimmedMesh::Vertex;

class GridCutter {
  public:
    GridCutter(const TrimRegion& region, const grid::Grid& g, std::vector<uint32_t> kept_vertex)
        : m_region(region), m_g(g), m_vertex(std::move(kept_vertex)) {
        const size_t n = size_t(g.vertices());
        m_points.resize(n);
        TrimRegion::Box box;
        for (size_t i = 0; i < n; i++) {
            m_points[i] = TrimRegion::even(double(g.u[i]), double(g.v[i]));
            box.extend(m_points[i]);
        }
        m_region.overlapping(box, m_near);
        // Which vertices are kept: each follows from the one before and the crossings in between.
        m_kept.resize(n);
        m_output.assign(n, UINT32_MAX);
        for (size_t i = 0; i < n; i++) {
            const size_t row = size_t(g.nu) + 1, before = i % row > 0 ? i - 1 : i - row;
            m_kept[i] = i == 0 ? m_region.keeps(m_points[0])
                               : m_kept[before] != crossed_odd(m_points[before], m_points[i]);
        }
    }

    grid::TrimmedMesh run() {
        const uint32_t row = uint32_t(m_g.nu) + 1;
        for (uint32_t j = 0; j < uint32_t(m_g.nv); j++)
            for (uint32_t i = 0; i < uint32_t(m_g.nu); i++) {
                const uint32_t at = j * row + i; // cut in two as the tracer does
                triangle(at, at + 1, at + row);
                triangle(at + row + 1, at + row, at + 1);
            }
        return std::move(m_out);
    }

  private:
    struct Crossing {
        int segment;
        int side;
        double along;    // the side, from its beginning
        uint32_t vertex; // made of it
    };
    // What a segment has inside the triangle.
    struct Inside {
        int segment;
        // Where it comes in, and goes out; two of them in either order. -1: it begins, or ends, inside.
        int crossing[2] = {-1, -1};
        int crossings = 0;
        bool begins = false; // inside
        bool used = false;
    };

    bool crossed_odd(const Point& p, const Point& q) const {
        TrimRegion::Box box;
        box.extend(p), box.extend(q);
        bool odd = false;
        for (const int s : m_near)
            if (m_region.box(s).overlaps(box))
                odd ^= m_region.crosses(s, p, q);
        return odd;
    }

    uint32_t plain(uint32_t v) {
        if (m_output[v] == UINT32_MAX) {
            m_output[v] = uint32_t(m_out.vertices.size());
            m_out.vertices.push_back({v, v, v, 0, 0});
        }
        return m_output[v];
    }

    void emit(uint32_t a, uint32_t b, uint32_t c) {
        if (a != b && b != c && c != a)
            for (const uint32_t v : {a, b, c})
                m_out.indices.push_back(v);
    }

    void triangle(uint32_t a, uint32_t b, uint32_t c) {
        m_corner = {m_vertex[a], m_vertex[b], m_vertex[c]};
        for (size_t k = 0; k < 3; k++)
            m_at[k] = m_points[m_corner[k]];
        const int64_t area = TrimRegion::area(m_at[0], m_at[1], m_at[2]);
        if (area == 0)
            return;
        m_turned = area < 0;
        if (m_turned) {
            std::swap(m_corner[1], m_corner[2]);
            std::swap(m_at[1], m_at[2]);
        }
        TrimRegion::Box box;
        for (const Point& p : m_at)
            box.extend(p);
        m_inside.clear();
        m_crossings.clear();
        bool sound = true;
        for (const int s : m_near)
            if (m_region.box(s).overlaps(box))
                sound &= enter(s);
        if (m_inside.empty() || !sound) {
            // Curves that cross themselves here, too fine to matter: by the middle.
            if (sound ? m_kept[m_corner[0]] : m_region.keeps(middle()))
                output(plain(m_corner[0]), plain(m_corner[1]), plain(m_corner[2]));
            return;
        }
        if (!cut() && m_region.keeps(middle()))
            output(plain(m_corner[0]), plain(m_corner[1]), plain(m_corner[2]));
    }

    Point middle() const {
        return {(m_at[0].x + m_at[1].x + m_at[2].x) / 6 * 2, (m_at[0].y + m_at[1].y + m_at[2].y) / 6 * 2};
    }

    void output(uint32_t a, uint32_t b, uint32_t c) { m_turned ? emit(a, c, b) : emit(a, b, c); }

    bool contains(const Point& p) const {
        for (size_t k = 0; k < 3; k++)
            if (!TrimRegion::left(m_at[k], m_at[(k + 1) % 3], p))
                return false;
        return true;
    }

    // Notes what a segment has inside. False: that cannot be.
    bool enter(int s) {
        Inside in{s};
        in.begins = contains(m_region.begin(s));
        const bool ends = contains(m_region.end(s));
        for (size_t k = 0; k < 3; k++) {
            const size_t l = (k + 1) % 3;
            const bool swap = m_at[l] < m_at[k];
            const Point &p = m_at[swap ? l : k], &q = m_at[swap ? k : l];
            if (!m_region.crosses(s, p, q))
                continue;
            if (in.crossings == 2)
                return false;
            const double sp = double(TrimRegion::area(m_region.begin(s), m_region.end(s), p)),
                         sq = double(TrimRegion::area(m_region.begin(s), m_region.end(s), q));
            const double t = sp == sq ? 0.5 : std::clamp(sp / (sp - sq), 0.0, 1.0);
            const uint32_t vertex = uint32_t(m_out.vertices.size());
            const uint32_t from = m_corner[swap ? l : k], to = m_corner[swap ? k : l];
            m_out.vertices.push_back({from, to, from, float(t), 0});
            in.crossing[in.crossings++] = int(m_crossings.size());
            m_crossings.push_back({s, int(k), swap ? 1 - t : t, vertex});
        }
        if ((in.crossings % 2 == 1) != (in.begins != ends) || (in.crossings == 2 && in.begins))
            return false;
        if (in.crossings == 1 && in.begins)
            std::swap(in.crossing[0], in.crossing[1]);
        if (in.crossings > 0 || in.begins)
            m_inside.push_back(in);
        return true;
    }

    Inside* find(int segment) {
        const auto at = std::lower_bound(m_inside.begin(), m_inside.end(), segment,
                                         [](const Inside& i, int s) { return i.segment < s; });
        return at != m_inside.end() && at->segment == segment ? &*at : nullptr;
    }

    uint32_t inner(const Point& p) {
        // Barycentric in the triangle.
        const double whole = double(TrimRegion::area(m_at[0], m_at[1], m_at[2]));
        const double b = double(TrimRegion::area(m_at[0], p, m_at[2])) / whole,
                     c = double(TrimRegion::area(m_at[0], m_at[1], p)) / whole;
        m_out.vertices.push_back({m_corner[0], m_corner[1], m_corner[2], float(b), float(c)});
        return uint32_t(m_out.vertices.size()) - 1;
    }
    void add_inner(Polygon& o, int trim_point) {
        const Point& p = m_region.points[size_t(trim_point)];
        o.add(p, inner(p));
    }
    void add_crossing(Polygon& o, const Crossing& c) {
        const Point &p = m_at[size_t(c.side)], &q = m_at[size_t(c.side + 1) % 3];
        o.add({p.x + std::llround(double(q.x - p.x) * c.along),
               p.y + std::llround(double(q.y - p.y) * c.along)},
              c.vertex);
    }

    // Follows the curve from a crossing to the one where it leaves again; -1: it does not.
    int follow(int from, Polygon& o) {
        Inside* in = find(m_crossings[size_t(from)].segment);
        bool forward = in && in->crossing[0] == from;
        if (!in || (!forward && in->crossing[1] != from))
            return -1;
        for (size_t steps = 0; steps <= m_inside.size(); steps++) {
            in->used = true;
            if (const int out = in->crossing[forward ? 1 : 0]; out >= 0)
                return out;
            const int point = forward ? m_region.next[size_t(in->segment)] : in->segment;
            add_inner(o, point);
            in = find(forward ? point : m_region.previous[size_t(in->segment)]);
            if (!in)
                return -1;
        }
        return -1;
    }

    // False: the curve does not divide the triangle as it must.
    bool cut() {
        std::vector<Polygon> outlines, holes;
        if (m_crossings.size() % 2 != 0 || !find_at_sides(outlines))
            return false;
        use_dropped();
        if (!find_loops(outlines, holes))
            return false;
        for (size_t h = 0; h < holes.size(); h++) {
            Polygon* best = nullptr;
            for (Polygon& o : outlines)
                if (around(o, holes[h].points[0]) && (!best || extent(o) < extent(*best)))
                    best = &o;
            if (best)
                best->holes.push_back(h);
        }
        for (const Polygon& o : outlines)
            for (const auto& [i, j, k] : triangles_of(o, holes, m_at[0]))
                output(i, j, k);
        return true;
    }

    // Outlines that touch the sides.
    bool find_at_sides(std::vector<Polygon>& outlines) {
        const size_t n = m_crossings.size();
        const bool start = m_kept[m_corner[0]];
        std::vector<int> order(n), place(n);
        for (size_t i = 0; i < n; i++)
            order[i] = int(i);
        std::sort(order.begin(), order.end(), [&](int a, int b) {
            const Crossing &x = m_crossings[size_t(a)], &y = m_crossings[size_t(b)];
            return std::tie(x.side, x.along, x.segment) < std::tie(y.side, y.along, y.segment);
        });
        for (size_t i = 0; i < n; i++)
            place[size_t(order[i])] = int(i);
        const auto kept_after = [&](size_t k) { return start != (k % 2 == 0); };
        std::vector<char> done(n, 0);
        for (size_t first = 0; first < n; first++) {
            if (done[first] || !kept_after(first))
                continue;
            Polygon o;
            size_t k = first;
            do {
                if (done[k])
                    return false;
                done[k] = 1;
                const Crossing& from = m_crossings[size_t(order[k])];
                const Crossing& to = m_crossings[size_t(order[(k + 1) % n])];
                add_crossing(o, from);
                const int last = to.side + (k + 1 == n ? 3 : 0);
                for (int side = from.side; side < last; side++)
                    o.add(m_at[size_t(side + 1) % 3], plain(m_corner[size_t(side + 1) % 3]));
                add_crossing(o, to);
                const int out = follow(order[(k + 1) % n], o);
                if (out < 0)
                    return false;
                k = size_t(place[size_t(out)]);
                if (!kept_after(k))
                    return false;
            } while (k != first);
            outlines.push_back(std::move(o));
        }
        if (n == 0 && start) {
            Polygon o;
            for (size_t k = 0; k < 3; k++)
                o.add(m_at[k], plain(m_corner[k]));
            outlines.push_back(std::move(o));
        }
        return true;
    }

    // Chains beside what is dropped are accounted for too.
    void use_dropped() {
        for (const Crossing& c : m_crossings)
            if (Inside* in = find(c.segment); in && !in->used) {
                Polygon unused;
                in->used = true;
                follow(int(&c - m_crossings.data()), unused);
            }
    }

    // Whole loops inside: islands, and holes.
    bool find_loops(std::vector<Polygon>& islands, std::vector<Polygon>& holes) {
        for (Inside& in : m_inside) {
            if (in.used)
                continue;
            Polygon o;
            int s = in.segment;
            for (Inside* at = &in; at && !at->used; s = m_region.next[size_t(s)], at = find(s)) {
                at->used = true;
                add_inner(o, s);
            }
            if (s != in.segment)
                return false;
            (m_region.keeps_without(m_region.begin(s), s) ? holes : islands).push_back(std::move(o));
        }
        return true;
    }

    const TrimRegion& m_region;
    const grid::Grid& m_g;
    std::vector<uint32_t> m_vertex; // that each lattice vertex has been moved to
    std::vector<Point> m_points;
    std::vector<int> m_near; // segments
    std::vector<char> m_kept;
    std::vector<uint32_t> m_output;
    grid::TrimmedMesh m_out;
    // Of the triangle at hand.
    std::array<uint32_t, 3> m_corner{};
    std::array<Point, 3> m_at;
    bool m_turned = false;
    std::vector<Inside> m_inside;
    std::vector<Crossing> m_crossings;
};

// Sides coarser than the lattice: their vertices are those that the edge keeps, as the traced lattice has it.
std::vector<uint32_t> kept_vertices(const Piece& piece, const grid::Grid& g, const grid::TracedGrid& t) {
    std::vector<uint32_t> kept(size_t(g.vertices()));
    for (size_t i = 0; i < kept.size(); i++)
        kept[i] = uint32_t(i);
    const int row = g.nu + 1;
    for (int side = 0; side < 4; side++) {
        const bool along_u = side == grid::VMin || side == grid::VMax;
        const int n = along_u ? g.nu : g.nv, step = t.edge_step[size_t(side)];
        if (piece.sides[size_t(side)].cells == 0 || step == 1)
            continue;
        const int base = side == grid::VMax ? g.nv * row : side == grid::UMax ? g.nu : 0;
        const int stride = along_u ? 1 : row;
        for (int i = 0; i <= n; i++)
            kept[size_t(base + i * stride)] = uint32_t(base + nearest_kept(i, step, n, side) * step * stride);
    }
    return kept;
}

} // namespace

Kept kept_of(const TrimRegion& region, const grid::Grid& g) {
    TrimRegion::Box box;
    for (int i = 0; i < g.vertices(); i++)
        box.extend(TrimRegion::even(double(g.u[size_t(i)]), double(g.v[size_t(i)])));
    std::vector<int> near;
    region.overlapping(box, near);
    if (!near.empty())
        return Kept::Part;
    return region.keeps(box.lo) ? Kept::All : Kept::None;
}

grid::TrimmedMesh cut_grid(const TrimRegion& region, const Piece& piece, const grid::Grid& g,
                           const grid::TracedGrid& traced) {
    return GridCutter(region, g, kept_vertices(piece, g, traced)).run();
}

TrimRegion make_region(const geom::Surface& surface, const RateRule& rule, const Location& where,
                       Journal& journal) {
    const auto distance = [&](double u0, double v0, double u1, double v1) {
        return rule.density.cells(surface.at_parameters(u0, v0), surface.at_parameters(u1, v1));
    };
    return TrimRegion(*surface.trim(), surface.parameters(), distance, where, journal);
}

} // namespace kanuka::dice
