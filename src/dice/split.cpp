#include "dice/split.h"

#include <algorithm>

#include "base/large_arrays.h"
#include "base/tasks.h"

namespace kanuka::dice {

constexpr int MostCells = 1 << 24; // of an edge; see round_to_power

Splitter::Splitter(const geom::Surface& surface, const RateRule& rule,
                   std::vector<const geom::Surface*> later)
    : m_surface(surface), m_later(std::move(later)), m_rule(rule) {}

bool Splitter::run(double limit) {
    // A grid costs as much as some cells more than it has; every face has one, whatever the rate.
    constexpr double LeastCells = 16;
    limit = std::max(limit, 2 * LeastCells * double(m_surface.topology().faces.size()));
    m_most_edges = size_t(limit / 4);
    start();
    if (edges.size() > m_most_edges)
        return false;
    std::vector<Piece> todo;
    std::swap(todo, pieces);
    std::vector<int> split;
    double total = 0;
    while (!todo.empty()) {
        split.assign(todo.size(), 0);
        tasks::parallel_chunks(todo.size(), Grain, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                plan(todo[i], split[i]);
        });
        std::vector<Piece> next;
        const size_t known_edges = edges.size();
        size_t whole_pieces = 0;
        for (size_t i = 0; i < todo.size(); i++) {
            if (split[i] == 0) {
                refine_twisted(todo[i]);
                total += std::max(LeastCells, double(todo[i].nu) * todo[i].nv);
                todo[whole_pieces++] = todo[i];
            } else {
                cut(todo[i], split[i] - 1, next);
            }
        }
        todo.resize(whole_pieces);
        if (pieces.empty())
            pieces = std::move(todo);
        else
            pieces.insert(pieces.end(), todo.begin(), todo.end());
        grow_edges(known_edges);
        if (total + LeastCells * double(next.size()) > limit || edges.size() > m_most_edges)
            return false;
        // Sides on edges that have just been measured.
        for (Piece& p : next)
            for (Segment& s : p.sides)
                if (s.edge >= int(known_edges) && s.begin == 0 && s.cells == 0)
                    s = whole(s.edge, s.reversed);
        todo = std::move(next);
    }
    for (Piece& p : pieces)
        for (int k = 0; k < 4; k++) {
            Segment& s = p.sides[k];
            Edge& e = edges[s.edge];
            if (s.of != e.cells) {
                s = current(s);
                int& n = k == grid::VMin || k == grid::VMax ? p.nu : p.nv;
                n = std::max(n, s.cells);
            }
            if (s.cells > 0)
                e.least = std::min(e.least, s.cells);
        }
    each_twin(0, [&](size_t i, size_t k) {
        edges[i].least = edges[k].least = std::min(edges[i].least, edges[k].least);
    });
    number_points();
    return true;
}

double Splitter::cells() const {
    double n = 0;
    for (const Piece& p : pieces)
        n += double(p.nu) * p.nv;
    return n;
}

void Splitter::start() {
    const geom::Topology& t = m_surface.topology();
    m_vertices = t.vertices;
    reserve_large(edges, t.edges.size());
    edges.resize(t.edges.size());
    for (size_t i = 0; i < edges.size(); i++) {
        Edge& e = edges[i];
        e.topology = int(i);
        e.a = t.edges[i].a;
        e.b = t.edges[i].b;
        e.middle = t.edges[i].middle;
        e.point = t.edges[i].point;
        e.twin = t.edges[i].twin;
        m_has_twins |= e.twin >= 0;
    }
    m_most_edges += edges.size();
    grow_edges(0);
    if (edges.size() > m_most_edges)
        return;
    reserve_large(pieces, t.faces.size());
    pieces.resize(t.faces.size());
    for (size_t f = 0; f < pieces.size(); f++) {
        pieces[f].face = int(f);
        for (int k = 0; k < 4; k++) {
            const geom::Topology::Side& side = t.faces[f].sides[k];
            Segment s = whole(side.edge, side.reversed);
            if (side.part != geom::Topology::Part::Whole) {
                s = half(s, side.part == geom::Topology::Part::First ? 0 : 1);
                s.reversed = side.reversed;
            }
            pieces[f].sides[k] = s;
        }
    }
}

void Splitter::cut(const Piece& piece, int axis, std::vector<Piece>& out) {
    // Sides that are cut across, then those that stay whole on the first and second half.
    const int low = axis == 0 ? grid::VMin : grid::UMin, high = axis == 0 ? grid::VMax : grid::UMax;
    const int before = axis == 0 ? grid::UMin : grid::VMin, after = axis == 0 ? grid::UMax : grid::VMax;
    Edge e;
    e.face = piece.face;
    e.axis = uint8_t(1 - axis);
    e.fixed = axis == 0 ? (piece.u0 + piece.u1) / 2 : (piece.v0 + piece.v1) / 2;
    e.t0 = axis == 0 ? piece.v0 : piece.u0;
    e.t1 = axis == 0 ? piece.v1 : piece.u1;
    const Segment at_low = shared(piece.sides[low]), at_high = shared(piece.sides[high]);
    e.a = middle_vertex(at_low);
    e.b = middle_vertex(at_high);
    Segment between;
    between.edge = int(edges.size());
    edges.push_back(e);
    Piece first = piece, second = piece;
    (axis == 0 ? first.u1 : first.v1) = e.fixed;
    (axis == 0 ? second.u0 : second.v0) = e.fixed;
    for (const int side : {low, high}) {
        const Segment& s = side == low ? at_low : at_high;
        first.sides[side] = half(s, s.reversed ? 1 : 0);
        second.sides[side] = half(s, s.reversed ? 0 : 1);
    }
    first.sides[before] = piece.sides[before];
    first.sides[after] = between;
    second.sides[before] = between;
    second.sides[after] = piece.sides[after];
    out.push_back(first);
    out.push_back(second);
}

Segment Splitter::whole(int edge, bool reversed) const {
    const Edge& e = edges[edge];
    return {edge, 0, e.child >= 0 ? -1 : e.point ? 0 : e.cells, reversed, e.cells};
}

Segment Splitter::current(Segment s) const {
    const int n = edges[s.edge].cells;
    if (is_cut(s) || n == s.of)
        return s;
    const int more = n / s.of;
    s.begin *= more;
    s.cells *= more;
    s.of = n;
    return s;
}

// A corner that is moved to the end of a long cell takes the lines between the halves along, across what lies
// inside of them.
Segment Splitter::shared(const Segment& s) {
    if (is_cut(s))
        return s;
    Segment now = current(s);
    Edge& e = edges[s.edge];
    if (now.cells != 1 || e.point || 2 * e.cells > m_rule.max_cells)
        return now;
    double_cells(e);
    return current(s);
}

void Splitter::double_cells(Edge& e) {
    e.cells *= 2;
    if (e.twin >= 0)
        edges[size_t(e.twin)].cells = e.cells;
}

Segment Splitter::half(const Segment& s, int which) const {
    if (is_cut(s))
        return whole(edges[s.edge].child + which, s.reversed);
    Segment h = s;
    if (s.cells >= 2) {
        h.cells = s.cells / 2;
        h.begin += which * h.cells;
    } else if (s.cells == 1 && which == 0) {
        h.cells = 0;
    }
    return h;
}

// A straight side of a twisted piece needs one cell of its own, but what lies beside it more.
void Splitter::refine_twisted(const Piece& piece) {
    if (piece.twist == 1)
        return;
    for (int k = 0; k < 4; k++) {
        const int n = std::min(piece.twist, k == grid::VMin || k == grid::VMax ? piece.nu : piece.nv);
        const Segment& s = piece.sides[k];
        if (is_cut(s) || s.cells == 0)
            continue;
        Edge& e = edges[s.edge];
        while (!e.point && current(s).cells < n && 2 * e.cells <= m_rule.max_cells)
            double_cells(e);
    }
}

int Splitter::middle_vertex(const Segment& s) {
    if (is_cut(s))
        return edges[edges[s.edge].child].b;
    return vertex_at(s.edge, s.begin + s.cells / 2);
}

int Splitter::vertex_at(int edge, int index) {
    Edge& e = edges[edge];
    if (index == 0 || e.point)
        return e.a;
    if (index == e.cells)
        return e.b;
    const uint32_t at = uint32_t(index) * uint32_t(MostCells / e.cells);
    int& vertex =
        2 * index == e.cells ? e.middle : m_forced.try_emplace(uint64_t(edge) << 32 | at, -1).first->second;
    if (vertex < 0)
        vertex = m_vertices++;
    return vertex;
}

void Splitter::number_points() {
    int next = m_vertices;
    for (Edge& e : edges)
        if (e.child < 0 && !e.point) {
            e.first_point = next;
            next += e.cells - 1;
        }
    m_point_alias.resize(next);
    for (int i = 0; i < next; i++)
        m_point_alias[i] = i;
    for (const Edge& e : edges)
        if (e.child < 0 && !e.point && e.middle >= 0 && e.cells >= 2)
            m_point_alias[e.first_point + e.cells / 2 - 1] = e.middle;
    for (const auto& [key, vertex] : m_forced) {
        const Edge& e = edges[key >> 32];
        m_point_alias[e.first_point + int(uint32_t(key) / uint32_t(MostCells / e.cells)) - 1] = vertex;
    }
}

int Splitter::polyline_index(const Segment& s, int side, int i, int n) {
    const int k = s.cells == 0 ? 0 : nearest_kept(i, n / s.cells, n, side);
    return s.begin + (s.reversed ? s.cells - k : k);
}

float Splitter::parameter(const Piece& piece, int side, int index) const {
    const Edge& e = edges[piece.sides[side].edge];
    const float t = e.t0 + (e.t1 - e.t0) * (float(index) / float(e.cells));
    if (e.topology < 0)
        return t;
    const float x = geom::side_parameter(m_surface.topology().faces[piece.face].sides[side], t);
    return std::clamp(x, 0.0f, 1.0f);
}

} // namespace kanuka::dice
