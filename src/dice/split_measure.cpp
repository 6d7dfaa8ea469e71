// What edges and pieces ask for: lengths of lines on the surface, and who is cut for them.
#include <algorithm>

#include "base/tasks.h"
#include "dice/split.h"

namespace kanuka::dice {

constexpr int EdgeSamples = 9;

void Splitter::positions(const geom::Surface& surface, const Edge& e, int samples, float* xyz) const {
    float t[EdgeSamples];
    for (int i = 0; i < samples; i++)
        t[i] = e.t0 + (e.t1 - e.t0) * (float(i) / float(samples - 1));
    if (e.topology >= 0) {
        surface.edge_positions(e.topology, {t, samples}, xyz, samples);
    } else {
        const geom::Line line{t, samples}, one{&e.fixed, 1};
        surface.positions(e.face, e.axis == 0 ? line : one, e.axis == 0 ? one : line, xyz, samples);
    }
}

static void join(LineMeasure& m, const LineMeasure& other) {
    m.cells = std::max(m.cells, other.cells);
    m.uneven |= other.uneven;
    m.tiny &= other.tiny;
}

LineMeasure Splitter::measure(const Edge& e, int samples) const {
    LineMeasure m{.tiny = true};
    Vec3f p[EdgeSamples];
    const auto find = [&](const geom::Surface& surface, int count) {
        float xyz[3 * EdgeSamples];
        positions(surface, e, count, xyz);
        for (int i = 0; i < count; i++)
            p[i] = {xyz[i], xyz[count + i], xyz[2 * count + i]};
    };
    const auto add = [&](const geom::Surface& surface) {
        if (!surface.bulges()) {
            find(surface, 3);
            if (const std::optional<LineMeasure> brief = m_rule.short_line(p)) {
                join(m, *brief);
                return;
            }
        }
        find(surface, samples);
        join(m, m_rule.line(p, samples));
    };
    add(m_surface);
    for (const geom::Surface* surface : m_later)
        add(*surface);
    return m;
}

// Many edges at once, which differ in where they are alone.
void Splitter::measure(const Edge* list, const int* which, int count, int samples, LineMeasure* out) const {
    float xyz[3 * EdgeSamples * Grain], lengths[(EdgeSamples - 1) * Grain];
    const int stride = EdgeSamples * int(Grain);
    const auto add = [&](const geom::Surface& surface) {
        for (int k = 0; k < count; k++) {
            float own[3 * EdgeSamples];
            positions(surface, list[which[k]], samples, own);
            for (int c = 0; c < 3; c++)
                for (int i = 0; i < samples; i++)
                    xyz[c * stride + i * count + k] = own[c * samples + i];
        }
        m_rule.density.cells(xyz, xyz + count, stride, (samples - 1) * count, lengths);
        for (int k = 0; k < count; k++)
            join(out[which[k]], RateRule::line(lengths + k, count, samples - 1));
    };
    for (int k = 0; k < count; k++)
        out[which[k]] = {};
    add(m_surface);
    for (const geom::Surface* surface : m_later)
        add(*surface);
}

void Splitter::measure(const Edge* list, int count, LineMeasure* out) const {
    // Most edges of fine meshes are short: three points tell, unless the surface may make an arch between
    // them.
    constexpr float Short = 2;
    int which[Grain] = {}, n = 0;
    for (int k = 0; k < count; k++)
        if (!list[k].point)
            which[n++] = k;
    if (m_rule.shape_only || m_rule.is_coarse()) {
        for (int i = 0; i < n; i++)
            out[which[i]] = measure(list[which[i]], EdgeSamples);
        return;
    }
    if (!m_surface.bulges()) {
        measure(list, which, n, 3, out);
        n = int(std::remove_if(which, which + n, [&](int k) { return out[k].cells <= Short; }) - which);
    }
    if (n > 0)
        measure(list, which, n, EdgeSamples, out);
}

bool Splitter::wants_cut(Edge& e, const LineMeasure& m) const {
    e.tiny = m.tiny;
    if (e.point) {
        e.cells = 1;
        return false;
    }
    // A vertex of its own where faces use its halves: moved to an end it would take a corner of theirs along.
    e.cells = std::max(round_to_power(m.cells), e.middle >= 0 ? 2 : 1);
    if (e.cells <= m_rule.max_cells && !m.uneven)
        return false;
    if (e.t1 - e.t0 > m_rule.least_range)
        return true;
    e.cells = std::min(e.cells, m_rule.max_cells);
    return false;
}

// Measures the edges from `begin` on, cuts those that want it, and goes on with their halves.
void Splitter::grow_edges(size_t begin) {
    std::vector<char> cut_it;
    while (begin < edges.size() && edges.size() <= m_most_edges) {
        const size_t end = edges.size();
        cut_it.assign(end - begin, 0);
        tasks::parallel_chunks(end - begin, Grain, [&](size_t from, size_t to) {
            LineMeasure measures[Grain];
            measure(&edges[begin + from], int(to - from), measures);
            for (size_t i = from; i < to; i++)
                cut_it[i] = wants_cut(edges[begin + i], measures[i - from]);
        });
        each_twin(begin, [&](size_t i, size_t k) {
            edges[i].cells = edges[k].cells = std::max(edges[i].cells, edges[k].cells);
            cut_it[i - begin] = cut_it[k - begin] = cut_it[i - begin] || cut_it[k - begin];
        });
        for (size_t i = begin; i < end; i++) {
            if (!cut_it[i - begin])
                continue;
            Edge e = edges[i];
            if (e.middle < 0)
                e.middle = m_vertices++;
            edges[i].middle = e.middle;
            edges[i].child = int(edges.size());
            Edge first = e, second = e;
            first.t1 = second.t0 = (e.t0 + e.t1) / 2;
            first.b = second.a = e.middle;
            first.middle = second.middle = first.twin = second.twin = -1;
            edges.push_back(first);
            edges.push_back(second);
            for (int half = 0; half < 2 && e.twin >= 0 && e.twin < int(i); half++) {
                const int own = edges[i].child + half, its = edges[size_t(e.twin)].child + half;
                edges[size_t(own)].twin = its, edges[size_t(its)].twin = own;
            }
        }
        begin = end;
    }
}

void Splitter::measure_interior(const geom::Surface& surface, const Piece& piece, int n, Interior& m) const {
    float us[5], vs[5], xyz[3 * 25];
    for (int i = 0; i < n; i++) {
        us[i] = piece.u0 + (piece.u1 - piece.u0) * (float(i) / float(n - 1));
        vs[i] = piece.v0 + (piece.v1 - piece.v0) * (float(i) / float(n - 1));
    }
    surface.positions(piece.face, {us, n}, {vs, n}, xyz, n * n);
    const auto at = [&](int i, int j) {
        const int k = j * n + i;
        return Vec3f{xyz[k], xyz[n * n + k], xyz[2 * n * n + k]};
    };
    for (int k = 1; k < n - 1; k++) {
        Vec3f row[5], column[5];
        for (int i = 0; i < n; i++) {
            row[i] = at(i, k);
            column[i] = at(k, i);
        }
        const LineMeasure u = m_rule.line(row, n), v = m_rule.line(column, n);
        m.want_u = std::max(m.want_u, u.cells), m.want_v = std::max(m.want_v, v.cells);
        m.least_u = std::min(m.least_u, u.cells), m.least_v = std::min(m.least_v, v.cells);
        m.uneven_u |= u.uneven, m.uneven_v |= v.uneven;
    }
    if (m_rule.shape_only) {
        const float twist = m_rule.twist(at(0, 0), at(n - 1, 0), at(n - 1, n - 1), at(0, n - 1));
        m.want_u = std::max(m.want_u, twist), m.want_v = std::max(m.want_v, twist);
        m.twist = std::max(m.twist, twist);
    }
}

void Splitter::plan(Piece& piece, int& split) const {
    // The patch lattice is sampled where interior lines can be longer than the sides: in bulging patches, and
    // where the camera is nearer to the middle than to the sides.
    const auto side_cells = [&](int k) {
        const Segment& s = piece.sides[k];
        return is_cut(s) ? 2 * m_rule.max_cells : edges[s.edge].point ? 0 : current(s).cells;
    };
    const int along_u[2] = {side_cells(0), side_cells(2)}, along_v[2] = {side_cells(3), side_cells(1)};
    const int most = std::max(std::max(along_u[0], along_u[1]), std::max(along_v[0], along_v[1]));
    const bool small = most <= 2 && !m_surface.bulges();
    float want_u = float(std::max(along_u[0], along_u[1])), want_v = float(std::max(along_v[0], along_v[1]));
    float least_u = float(std::min(along_u[0], along_u[1])),
          least_v = float(std::min(along_v[0], along_v[1]));
    bool uneven_u = is_cut(piece.sides[0]) || is_cut(piece.sides[2]);
    bool uneven_v = is_cut(piece.sides[1]) || is_cut(piece.sides[3]);
    const bool tiny =
        most == 1 && std::ranges::all_of(piece.sides, [&](const Segment& s) { return edges[s.edge].tiny; });
    if (!small || (m_rule.shape_only && !tiny)) {
        const int n = most > 4 || m_surface.bulges() ? 5 : 3;
        Interior m{want_u, want_v, least_u, least_v, uneven_u, uneven_v};
        measure_interior(m_surface, piece, n, m);
        for (const geom::Surface* surface : m_later)
            measure_interior(*surface, piece, n, m);
        want_u = m.want_u, want_v = m.want_v;
        least_u = m.least_u, least_v = m.least_v;
        uneven_u = m.uneven_u, uneven_v = m.uneven_v;
        piece.twist = round_to_power(m.twist);
    }
    const int nu = std::max(round_to_power(want_u), std::max(along_u[0], along_u[1]));
    const int nv = std::max(round_to_power(want_v), std::max(along_v[0], along_v[1]));
    bool cut_u = uneven_u || nu > m_rule.max_cells, cut_v = uneven_v || nv > m_rule.max_cells;
    if (!m_rule.shape_only) {
        // A piece whose rows need very different numbers of cells wastes most of them.
        cut_v |= nu >= 8 && nv >= 4 && want_u > 4 * least_u;
        cut_u |= nv >= 8 && nu >= 4 && want_v > 4 * least_v;
    }
    cut_u = cut_u && piece.u1 - piece.u0 > m_rule.least_range;
    cut_v = cut_v && piece.v1 - piece.v0 > m_rule.least_range;
    if (cut_u && cut_v)
        (nu >= nv ? cut_v : cut_u) = false;
    split = cut_u ? 1 : cut_v ? 2 : 0;
    piece.nu = std::min(nu, m_rule.max_cells);
    piece.nv = std::min(nv, m_rule.max_cells);
}

} // namespace kanuka::dice
