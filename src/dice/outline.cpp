#include "dice/outline.h"

#include "base/tasks.h"
#include "dice/simplify.h"
#include "geom/bend.h"

namespace kanuka::dice {
namespace {

constexpr float Straight = -0.97f; // cosine between the two ways on at a vertex of a smooth line

Vec3f unit_or_zero(const Vec3f& v) {
    const float l = length(v);
    return l > 0 && std::isfinite(l) ? v * (1 / l) : Vec3f(0.0f);
}

} // namespace

struct Outline::Frame {
    const float *P, *Ng, *dPdu, *dPdv;
    size_t stride;
    Vec3f at(const float* a, int i) const {
        const float* p = a + i;
        return {p[0], p[stride], p[2 * stride]};
    }
    float bend(int a, int b) const { return geom::bend_of(at(Ng, a), at(Ng, b), at(P, b) - at(P, a)); }
    float twist(int v, int a, int b) const { return dot(at(Ng, a) - at(Ng, v), at(P, b) - at(P, v)); }
    float part(int v, int a, int b) const {
        return geom::part_of_saddle(bend(v, a), bend(v, b), twist(v, a, b));
    }
};

// A line of the surface that leaves a point.
struct Outline::Run {
    uint32_t key;     // edge, and which way along it
    bool line;        // it is a border, or a crease
    Vec3f normal;     // of the first grid beside it
    Vec3f away, bend; // unit tangent, second difference
};

Outline::Outline(const Splitter& splitter, const Seams& seams, const std::vector<grid::TracedGrid>& traced,
                 const std::vector<char>& displaced)
    : m_splitter(splitter), m_seams(seams), m_traced(traced), m_displaced(displaced),
      m_open(open_edges(splitter.surface().topology())) {}

std::vector<char> open_edges(const geom::Topology& t) {
    std::vector<char> halves(t.edges.size(), 0);
    for (const geom::Topology::Face& f : t.faces)
        for (const geom::Topology::Side& s : f.sides)
            halves[size_t(s.edge)] =
                char(std::min(100, halves[size_t(s.edge)] + (s.part == geom::Topology::Part::Whole ? 2 : 1)));
    for (char& h : halves)
        h = h < 4;
    return halves;
}

Outline::Frame Outline::frame(const GridsAtStep& at, size_t grid) const {
    const grid::Grid &g = at.grids[grid], &f = at.frames[grid];
    return {at.step == 0 ? g.P.data() : g.later[at.step - 1].P.data(), f.Ng.data(), f.dPdu.data(),
            f.dPdv.data(), size_t(g.stride)};
}

bool Outline::is_open(const Segment& s) const {
    const int t = m_splitter.edges[size_t(s.edge)].topology;
    return t >= 0 && m_open[size_t(t)];
}

// visit(side, index of the vertex along it, cells of it, between kept ones, index step, index step inwards)
template <class Visit>
void Outline::each_side(const Seams::Member& m, Visit visit) const {
    const grid::TracedGrid& t = m_traced[m.grid];
    const Piece& piece = m_splitter.pieces[m.grid];
    const int row = piece.nu + 1, i = int(m.vertex) % row, j = int(m.vertex) / row;
    if (j == 0)
        visit(int(grid::VMin), i, piece.nu, t.edge_step[grid::VMin], 1, t.step_v * row);
    if (j == piece.nv)
        visit(int(grid::VMax), i, piece.nu, t.edge_step[grid::VMax], 1, -t.step_v * row);
    if (i == 0)
        visit(int(grid::UMin), j, piece.nv, t.edge_step[grid::UMin], row, t.step_u);
    if (i == piece.nu)
        visit(int(grid::UMax), j, piece.nv, t.edge_step[grid::UMax], row, -t.step_u);
}

// Where the surface is smooth: the mean over all edges that meet there, of which each of two grids has a
// half.
Vec3f Outline::of_point(const GridsAtStep& at, int point) const {
    const std::span<const Seams::Member> members = m_seams.members(point);
    Vec3f sum(0.0f), normal(0.0f);
    float weights = 0, least = 1;
    bool smooth = true, any = false;
    for (const Seams::Member& m : members) {
        if (m_displaced[m.grid])
            return Vec3f(0.0f);
        if (m.moved)
            continue;
        const Frame f = frame(at, m.grid);
        const int v = int(m.vertex);
        const Vec3f n = f.at(f.Ng, v);
        if (!any)
            normal = n;
        any = true;
        smooth &= abs(dot(n, normal)) > SameNormal;
        float bends = 0;
        const auto add = [&](int to, float weight) {
            if (!(length_squared(f.at(f.P, to) - f.at(f.P, v)) > 0))
                return;
            bends += weight * f.bend(v, to);
            weights += weight;
        };
        each_side(m, [&](int side, int k, int n, int step, int along, int inwards) {
            smooth &= !is_open(m_splitter.pieces[m.grid].sides[size_t(side)]);
            if (k - step >= 0)
                add(v - step * along, 0.5f);
            if (k + step <= n)
                add(v + step * along, 0.5f);
            const bool inside = k > 0 && k < n;
            if (inside)
                add(v + inwards, 1);
            const int way = k + step <= n ? step : k - step >= 0 ? -step : 0;
            if (way != 0 && (inside || along == 1)) // of a corner once
                least = std::min(least, f.part(v, v + way * along, v + inwards));
        });
        sum += n * bends;
    }
    if (!smooth)
        return of_line(at, point);
    return weights > 0 ? sum * (least * 4 * geom::BendOfAnEdge / weights) : Vec3f(0.0f);
}

// On a border or a crease: what is on it stands off as the line does, so that whatever else ends there (the
// patch beside, a cap) goes along. Where lines meet or turn at once nothing moves.
Vec3f Outline::of_line(const GridsAtStep& at, int point) const {
    std::vector<Run> runs;
    for (const Seams::Member& m : m_seams.members(point)) {
        if (m.moved)
            continue;
        const Frame f = frame(at, m.grid);
        const int v = int(m.vertex);
        each_side(m, [&](int side, int k, int n, int step, int along, int) {
            const Segment& s = m_splitter.pieces[m.grid].sides[size_t(side)];
            const float* const slopes = along == 1 ? f.dPdu : f.dPdv;
            for (const int way : {-1, 1}) {
                const int to = v + way * step * along;
                if (k + way * step < 0 || k + way * step > n)
                    continue;
                const Vec3f edge = f.at(f.P, to) - f.at(f.P, v), normal = f.at(f.Ng, v);
                if (!(length_squared(edge) > 0))
                    continue;
                const uint32_t key = uint32_t(s.edge) << 1 | uint32_t((way > 0) != s.reversed);
                const auto known = std::ranges::find(runs, key, &Run::key);
                if (known != runs.end()) {
                    known->line |= !(abs(dot(normal, known->normal)) > SameNormal);
                    continue;
                }
                const Vec3f ta = unit_or_zero(f.at(slopes, v)) * float(way),
                            tb = unit_or_zero(f.at(slopes, to)) * float(way);
                const Vec3f turn = tb - ta;
                const bool bends =
                    length_squared(turn) > geom::LeastTurn * geom::LeastTurn && dot(ta, tb) > geom::MostTurn;
                runs.push_back({key, is_open(s), normal, ta, bends ? turn * length(edge) : Vec3f(0.0f)});
            }
        });
    }
    std::erase_if(runs, [](const Run& r) { return !r.line; });
    if (runs.size() != 2 || !(dot(runs[0].away, runs[1].away) < Straight))
        return Vec3f(0.0f);
    const Vec3f along = unit_or_zero(runs[0].away - runs[1].away), bend = runs[0].bend + runs[1].bend;
    return (bend - along * dot(bend, along)) * -geom::BendOfAnEdge;
}

std::vector<Vec3f> Outline::of_points(const GridsAtStep& at) const {
    std::vector<Vec3f> out(size_t(m_splitter.points()), Vec3f(0.0f));
    const int vertices = m_splitter.vertices();
    tasks::parallel_chunks(size_t(vertices), 256, [&](size_t begin, size_t end) {
        for (size_t p = begin; p < end; p++)
            out[p] = of_point(at, int(p));
    });
    tasks::parallel_chunks(m_splitter.edges.size(), 64, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k++) {
            const Edge& e = m_splitter.edges[k];
            if (e.child >= 0 || e.point)
                continue;
            for (int i = e.step; i < e.cells; i += e.step)
                if (const int p = m_splitter.point(e, i); p >= vertices)
                    out[size_t(p)] = of_point(at, p);
        }
    });
    return out;
}

void Outline::add_interior(const Frame& f, const grid::TracedGrid& t, std::vector<float>& out) const {
    const int row = t.mu * t.step_u + 1, su = t.step_u, sv = t.step_v * row;
    if (t.mu < 2 || t.mv < 2)
        return;
    std::vector<float> below(size_t(t.mu)); // bends from the row before
    for (int i = 1; i < t.mu; i++)
        below[size_t(i)] = f.bend(i * su, i * su + sv);
    for (int j = 1; j < t.mv; j++) {
        float left = f.bend(j * sv, j * sv + su);
        for (int i = 1; i < t.mu; i++) {
            const int v = j * sv + i * su;
            const float right = f.bend(v, v + su), above = f.bend(v, v + sv);
            const float part = geom::part_of_saddle(0.5f * (left + right), 0.5f * (below[size_t(i)] + above),
                                                    f.twist(v, v + su, v + sv));
            const Vec3f off =
                f.at(f.Ng, v) * (part * geom::BendOfAnEdge * (left + right + below[size_t(i)] + above));
            left = right;
            below[size_t(i)] = above;
            float* const to = &out[3 * size_t(j * (t.mu + 1) + i)];
            for (int c = 0; c < 3; c++)
                to[c] += off[c];
        }
    }
}

// Where every side has vertices of its own: no two of the lattice's are in one place.
void Outline::add_boundary(size_t grid, const std::vector<Vec3f>& points, std::vector<float>& out) const {
    const grid::TracedGrid& t = m_traced[grid];
    const Piece& piece = m_splitter.pieces[grid];
    for (int side = 0; side < 4; side++) {
        const bool along_u = side == grid::VMin || side == grid::VMax;
        const int n = along_u ? piece.nu : piece.nv, m = along_u ? t.mu : t.mv, step = n / m;
        const int kept = t.edge_step[size_t(side)], row = t.mu + 1, stride = along_u ? 1 : row;
        const int base = side == grid::VMax ? t.mv * row : side == grid::UMax ? t.mu : 0;
        const Segment& s = piece.sides[size_t(side)];
        const Edge& e = m_splitter.edges[size_t(s.edge)];
        // Each corner with the side that begins there, walked around.
        const bool begins = side == grid::VMin || side == grid::UMax;
        for (int i = begins ? 0 : 1; i < m + !begins; i++) {
            const int local = nearest_kept(i * step, kept, n, side) * kept;
            const Vec3f& off =
                points[size_t(m_splitter.point(e, s.begin + (s.reversed ? n - local : local)))];
            float* const to = &out[3 * size_t(base + i * stride)];
            for (int c = 0; c < 3; c++)
                to[c] += off[c];
        }
    }
}

// Others: P of what stands off is changed and restored.
std::vector<float> Outline::trace_collapsed(size_t grid, const GridsAtStep& at, std::vector<float>& P,
                                            const std::vector<Vec3f>& points) const {
    struct Kept {
        size_t index;
        float p;
    };
    std::vector<Kept> before;
    const size_t n = size_t(at.grids[grid].stride);
    for (const BoundaryVertex& b : m_seams.boundary(grid)) {
        const Vec3f& off = points[size_t(b.point)];
        for (int c = 0; c < 3 && !(off == Vec3f(0.0f)); c++) {
            float& p = P[size_t(b.index) + size_t(c) * n];
            before.push_back({size_t(b.index) + size_t(c) * n, p});
            p += off[c];
        }
    }
    std::vector<float> out = traced_positions(m_splitter.pieces[grid], at.grids[grid], P, m_traced[grid]);
    for (const Kept& k : before)
        P[k.index] = k.p;
    return out;
}

std::vector<float> Outline::trace(size_t grid, const GridsAtStep& at, std::vector<float>& P,
                                  const std::vector<Vec3f>& points) const {
    const Piece& piece = m_splitter.pieces[grid];
    bool whole = true;
    for (int side = 0; side < 4; side++)
        whole &= piece.sides[size_t(side)].cells ==
                 (side == grid::VMin || side == grid::VMax ? piece.nu : piece.nv);
    std::vector<float> out;
    if (whole) {
        out = traced_positions(piece, at.grids[grid], P, m_traced[grid]);
        add_boundary(grid, points, out);
    } else {
        out = trace_collapsed(grid, at, P, points);
    }
    if (!m_displaced[grid])
        add_interior(frame(at, grid), m_traced[grid], out);
    return out;
}

} // namespace kanuka::dice
