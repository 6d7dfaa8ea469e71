// How far the kept lattice lies from the full one is bounded, not measured at every candidate: if d_k is the
// largest distance of a vertex of level k (spacing 2^(k-1)) from the middle of its two neighbours on that
// level, piecewise linear interpolation at spacing 2^k is off by at most d_1 + … + d_k, since leaving out one
// more level moves the interpolant by at most d_k. In two directions the bounds add up. A rough surface is
// recognised at the first row.
#include "dice/simplify.h"

#include "base/tasks.h"

namespace kanuka::dice {
namespace {

float tolerance_at(const RateRule& rule, float pixels_per_unit) {
    return rule.geometry_tolerance / std::max(pixels_per_unit, 1e-30f);
}

void choose_edge_step(Edge& e, const std::vector<Vec3f>& p, const RateRule& rule) {
    const int n = e.cells, limit = std::min(n, e.least);
    float pixels = 0;
    for (const int i : {0, n / 2, n})
        pixels = std::max(pixels, rule.density.pixels_per_unit(p[i]));
    const float budget = 0.5f * tolerance_at(rule, pixels);
    const float turn_budget = rule.normal_tolerance * (Pi / 180);
    float error = 0, turn = 0;
    while (e.step * 2 <= limit) {
        const int h = e.step;
        float worst = 0, worst_turn = 0;
        for (int i = h; i < n; i += 2 * h) {
            const Vec3f &a = p[i - h], &b = p[i + h];
            const Vec3f chord = b - a;
            worst = std::max(worst, length(p[i] - (a + b) * 0.5f));
            // Angle between half and whole: distance from the chord over half its length.
            const float l = length(chord);
            if (l > 0)
                worst_turn = std::max(worst_turn, std::atan(2 * length(cross(p[i] - a, chord)) / (l * l)));
        }
        if (!(error + worst <= budget) || !(turn + worst_turn <= turn_budget))
            break;
        error += worst;
        turn += worst_turn;
        e.step *= 2;
    }
    e.error = error;
}

// Beside a side that keeps every `along`-th vertex, a lattice that keeps every `across`-th row is a fan of
// triangles. How many times as far as may be the bilinear quads that they stand for are twisted off them: by
// distance, and by what normals turn.
float side_twist(const grid::Grid& g, const std::vector<float>& positions, int side, int along, int across,
                 float budget, float normal_tolerance) {
    const bool along_u = side == grid::VMin || side == grid::VMax;
    const int n = along_u ? g.nu : g.nv, row = g.nu + 1;
    const int step = along_u ? 1 : row, in = along_u ? row : 1;
    const int base = side == grid::VMax ? g.nv * row : side == grid::UMax ? g.nu : 0;
    const int inwards = side == grid::VMax || side == grid::UMax ? -across * in : across * in;
    const auto at = [&](int k) {
        const float* p = positions.data() + k;
        return Vec3f{p[0], p[g.stride], p[2 * size_t(g.stride)]};
    };
    const float turn = std::tan(2 * std::min(normal_tolerance, 40.0f) * (Pi / 180));
    float worst = 0;
    for (int i = 0; i < n; i += along) {
        const int k = base + i * step, l = k + along * step;
        const Vec3f a = at(k), b = at(l), c = at(l + inwards), d = at(k + inwards);
        const Vec3f normal = cross(c - a, d - b);
        const float size = length(normal);
        if (!(size > 0))
            continue;
        const float distance = 0.25f * abs(dot(a - b + c - d, normal)) / size;
        worst = std::max(worst, distance / std::max(budget, 1e-30f));
        const Vec3f p = cross(b - a, d - a), q = cross(d - c, b - c);
        if (std::min(length_squared(p), length_squared(q)) > 1e-2f * size * size) // not beside a pole
            worst = std::max(worst, length(cross(p, q)) / std::max(turn * abs(dot(p, q)), 1e-30f));
    }
    return worst;
}

template <class Visit>
void each_step(const grid::Grid& g, Visit visit) {
    visit(g.P);
    for (const grid::Grid::Step& later : g.later)
        visit(later.P);
}

int middle_of(const grid::Grid& g) {
    return (g.nv / 2) * (g.nu + 1) + g.nu / 2;
}

float finest_pixels(const RateRule& rule, const grid::Grid& g) {
    float pixels = rule.density.pixels_per_unit(g.position(middle_of(g)));
    for (const int corner : {0, g.nu, g.nv * (g.nu + 1), g.vertices() - 1})
        pixels = std::max(pixels, rule.density.pixels_per_unit(g.position(corner)));
    return pixels;
}

// A straight side of a twisted surface needs vertices for what lies beside it.
void limit_by_twist(Splitter& splitter, const std::vector<grid::Grid>& grids, const RateRule& rule) {
    std::vector<std::array<int, 4>> most(grids.size());
    tasks::parallel_chunks(grids.size(), 16, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k++) {
            const grid::Grid& g = grids[k];
            float budget = -1;
            for (int side = 0; side < 4; side++) {
                const Segment& s = splitter.pieces[k].sides[side];
                int& step = most[k][size_t(side)] = splitter.edges[s.edge].step;
                if (step == 1 || s.cells == 0)
                    continue;
                if (budget < 0)
                    budget =
                        0.5f * tolerance_at(rule, rule.density.pixels_per_unit(g.position(middle_of(g))));
                const bool along_u = side == grid::VMin || side == grid::VMax;
                const int n = along_u ? g.nu : g.nv, across = along_u ? g.nv : g.nu;
                float worst;
                do {
                    worst = 0;
                    each_step(g, [&](const std::vector<float>& p) {
                        worst = std::max(worst, side_twist(g, p, side, n / s.cells * step,
                                                           std::max(1, across * step / s.cells), budget,
                                                           rule.normal_tolerance));
                    });
                } while (worst > 1 && (step /= 2) > 1);
            }
        }
    });
    for (size_t k = 0; k < grids.size(); k++)
        for (int side = 0; side < 4; side++) {
            Edge& e = splitter.edges[splitter.pieces[k].sides[side].edge];
            e.step = std::min(e.step, most[k][size_t(side)]);
        }
}

class GridSteps {
  public:
    GridSteps(const grid::Grid& g, const std::vector<float>& positions, float budget, float cos_tolerance)
        : m_g(g), m_budget(budget), m_cos2(cos_tolerance * cos_tolerance), m_row(g.nu + 1) {
        const float* p = positions.data();
        if (g.edge_cells != std::array<int, 4>{g.nu, g.nv, g.nu, g.nv}) {
            m_even = positions;
            for (int side = 0; side < 4; side++)
                spread(side);
            p = m_even.data();
        }
        for (int c = 0; c < 3; c++)
            m_p[c] = p + size_t(c) * g.stride;
    }

    void choose(int limit_u, int limit_v) {
        float error = 0;
        bool grow_u = limit_u > 1, grow_v = limit_v > 1;
        while (grow_u || grow_v) {
            if (grow_u && (grow_u = added_error_u(su, m_budget - error, error)))
                grow_u = (su *= 2) * 2 <= limit_u;
            if (grow_v && (grow_v = added_error_v(sv, m_budget - error, error)))
                grow_v = (sv *= 2) * 2 <= limit_v;
        }
        if (su == 1 && sv == 1)
            return;
        // A quad is two triangles; the bilinear quad that the bound is about lies a quarter of its twist
        // beside them.
        while ((su > 1 || sv > 1) && error + twist() > m_budget)
            (su >= sv ? su : sv) /= 2;
        if (su == 1 && sv == 1)
            return;
        fine_normals();
        const int both_u = su, both_v = sv;
        sv = 1;
        while (su > 1 && !normals_agree())
            su /= 2;
        const int alone_u = su;
        su = 1;
        sv = both_v;
        while (sv > 1 && !normals_agree())
            sv /= 2;
        su = std::min(both_u, alone_u);
        while ((su > 1 || sv > 1) && !normals_agree())
            (su >= sv ? su : sv) /= 2;
    }

    int su = 1, sv = 1;

  private:
    // Vertices that a side has moved onto a coarser polyline are spread over it evenly again: sliding along
    // the surface is no distance from it.
    void spread(int side) {
        const bool along_u = side == grid::VMin || side == grid::VMax;
        const int n = along_u ? m_g.nu : m_g.nv, stride = along_u ? 1 : m_row, cells = m_g.edge_cells[side];
        const int base = side == grid::VMax ? m_g.nv * m_row : side == grid::UMax ? m_g.nu : 0;
        if (cells == 0 || cells == n)
            return;
        const int run = n / cells;
        for (int c = 0; c < 3; c++) {
            float* p = m_even.data() + size_t(c) * m_g.stride + base;
            for (int i = 0; i < n; i++) {
                const float a = p[i / run * run * stride], b = p[(i / run + 1) * run * stride];
                p[i * stride] = a + (b - a) * (float(i % run) / float(run));
            }
        }
    }

    Vec3f at(int i, int j) const {
        const int k = j * m_row + i;
        return {m_p[0][k], m_p[1][k], m_p[2][k]};
    }

    // Largest squared distance of row + offset from the middle of its neighbours `reach` floats away.
    float middle_distance2(int first, int count, int stride, int reach) const {
        float worst = 0;
        for (int n = 0; n < count; n++) {
            const int k = first + n * stride;
            float d2 = 0;
            for (int c = 0; c < 3; c++) {
                const float d = m_p[c][k] - 0.5f * (m_p[c][k - reach] + m_p[c][k + reach]);
                d2 = fma(d, d, d2);
            }
            worst = std::max(worst, d2);
        }
        return worst;
    }

    bool added_error_u(int h, float left, float& error) const {
        float worst = 0;
        for (int j = 0; j <= m_g.nv; j++) {
            worst = std::max(worst, middle_distance2(j * m_row + h, m_g.nu / (2 * h), 2 * h, h));
            if (!(worst <= left * left))
                return false;
        }
        error += std::sqrt(worst);
        return true;
    }
    bool added_error_v(int h, float left, float& error) const {
        float worst = 0;
        for (int j = h; j < m_g.nv; j += 2 * h) {
            worst = std::max(worst, middle_distance2(j * m_row, m_row, 1, h * m_row));
            if (!(worst <= left * left))
                return false;
        }
        error += std::sqrt(worst);
        return true;
    }

    float twist() const {
        float worst = 0;
        for (int j = 0; j < m_g.nv; j += sv)
            for (int i = 0; i < m_g.nu; i += su)
                worst = std::max(
                    worst, length_squared(at(i, j) - at(i + su, j) - at(i, j + sv) + at(i + su, j + sv)));
        return 0.25f * std::sqrt(worst);
    }

    // Not normalised: cross products of the cells' diagonals.
    void fine_normals() {
        m_normal.resize(size_t(m_g.nu) * m_g.nv * 3);
        const size_t n = size_t(m_g.nu) * m_g.nv;
        float *x = m_normal.data(), *y = x + n, *z = y + n;
        for (int j = 0; j < m_g.nv; j++)
            for (int i = 0; i < m_g.nu; i++) {
                const Vec3f c = cross(at(i + 1, j + 1) - at(i, j), at(i, j + 1) - at(i + 1, j));
                const size_t k = size_t(j) * m_g.nu + i;
                x[k] = c.x, y[k] = c.y, z[k] = c.z;
            }
    }

    // Every fine cell against the triangle that it lies in; on the diagonal against the nearer of both.
    bool normals_agree() const {
        const size_t n = size_t(m_g.nu) * m_g.nv;
        const float *x = m_normal.data(), *y = x + n, *z = y + n;
        for (int j = 0; j < m_g.nv; j += sv)
            for (int i = 0; i < m_g.nu; i += su) {
                const Vec3f a = at(i, j), b = at(i + su, j), c = at(i + su, j + sv), d = at(i, j + sv);
                const Vec3f lower = cross(b - a, d - a), upper = cross(d - c, b - c);
                const float l2 = length_squared(lower) * m_cos2, u2 = length_squared(upper) * m_cos2;
                for (int jj = 0; jj < sv; jj++)
                    for (int ii = 0; ii < su; ii++) {
                        const size_t k = size_t(j + jj) * m_g.nu + i + ii;
                        const Vec3f f{x[k], y[k], z[k]};
                        const float f2 = length_squared(f);
                        const int side =
                            (2 * ii + 1) * sv + (2 * jj + 1) * su - 2 * su * sv; // of the diagonal b-d
                        const float dl = dot(f, lower), du = dot(f, upper);
                        const bool in_lower = dl >= 0 && dl * dl >= f2 * l2,
                                   in_upper = du >= 0 && du * du >= f2 * u2;
                        if (side < 0 ? !in_lower : side > 0 ? !in_upper : !(in_lower || in_upper))
                            return false;
                    }
            }
        return true;
    }

    const grid::Grid& m_g;
    const float m_budget, m_cos2;
    const int m_row;
    const float* m_p[3];
    std::vector<float> m_even, m_normal;
};

} // namespace

void choose_edge_steps(Splitter& splitter, const std::vector<grid::Grid>& grids, const Seams& seams,
                       const RateRule& rule, bool simplify) {
    if (!simplify)
        return;
    const int later = grids.empty() ? 0 : int(grids[0].later.size());
    tasks::parallel_chunks(splitter.edges.size(), 64, [&](size_t begin, size_t end) {
        std::vector<Vec3f> p;
        for (size_t k = begin; k < end; k++) {
            Edge& e = splitter.edges[k];
            if (e.child >= 0 || e.point || e.cells < 2 || e.least > e.cells)
                continue;
            p.resize(e.cells + 1);
            int least = 1 << 30;
            float error = 0;
            for (int step = 0; step <= later; step++) {
                for (int i = 0; i <= e.cells; i++)
                    p[i] = seams.position(grids, splitter.point(e, i), step);
                e.step = 1;
                choose_edge_step(e, p, rule);
                least = std::min(least, e.step);
                error = std::max(error, e.error);
            }
            e.step = least;
            e.error = error;
        }
    });
    limit_by_twist(splitter, grids, rule);
    splitter.each_twin(0, [&](size_t i, size_t k) {
        Edge &a = splitter.edges[i], &b = splitter.edges[k];
        a.step = b.step = std::min(a.step, b.step);
        a.error = b.error = std::max(a.error, b.error);
    });
}

std::vector<float> traced_positions(const Piece& piece, const grid::Grid& g, const std::vector<float>& P,
                                    const grid::TracedGrid& t) {
    const int cells[4] = {g.nu, g.nv, g.nu, g.nv};
    std::vector<float> out(size_t(3) * (t.mu + 1) * (t.mv + 1));
    float* to = out.data();
    for (int j = 0; j <= t.mv; j++)
        for (int i = 0; i <= t.mu; i++, to += 3) {
            const int k = j * t.step_v * (g.nu + 1) + i * t.step_u;
            to[0] = P[k];
            to[1] = P[k + g.stride];
            to[2] = P[k + 2 * size_t(g.stride)];
        }
    // Sides coarser than the lattice: vertices go to the nearest that the edge keeps.
    for (int side = 0; side < 4; side++) {
        const bool along_u = side == grid::VMin || side == grid::VMax;
        const int step = along_u ? t.step_u : t.step_v, n = cells[side], m = n / step;
        const Segment& s = piece.sides[side];
        if (s.cells == 0 || t.edge_step[side] == step)
            continue;
        for (int i = 0; i <= m; i++) {
            const int local = nearest_kept(i * step, t.edge_step[side], n, side) * t.edge_step[side];
            const int k = side == grid::VMin   ? local
                          : side == grid::VMax ? g.nv * (g.nu + 1) + local
                          : side == grid::UMin ? local * (g.nu + 1)
                                               : local * (g.nu + 1) + g.nu;
            const int at = side == grid::VMin   ? i
                           : side == grid::VMax ? t.mv * (t.mu + 1) + i
                           : side == grid::UMin ? i * (t.mu + 1)
                                                : i * (t.mu + 1) + t.mu;
            for (int c = 0; c < 3; c++)
                out[size_t(at) * 3 + c] = P[k + size_t(c) * g.stride];
        }
    }
    return out;
}

grid::TracedGrid choose_steps(const Splitter& splitter, const Piece& piece, const grid::Grid& g,
                              const RateRule& rule, bool simplify) {
    grid::TracedGrid t;
    float edge_error = 0;
    const int cells[4] = {g.nu, g.nv, g.nu, g.nv};
    for (int k = 0; k < 4; k++) {
        const Segment& s = piece.sides[k];
        const Edge& e = splitter.edges[s.edge];
        t.edge_step[k] = s.cells == 0 ? cells[k] : cells[k] / s.cells * e.step;
        edge_error = std::max(edge_error, s.cells == 0 ? 0 : e.error);
    }
    if (simplify) {
        const float pixels = finest_pixels(rule, g);
        const auto steps_of = [&](const std::vector<float>& positions, int limit_u, int limit_v) {
            GridSteps steps(g, positions, std::max(0.0f, tolerance_at(rule, pixels) - edge_error),
                            std::cos(rule.normal_tolerance * (Pi / 180)));
            steps.choose(limit_u, limit_v);
            t.step_u = steps.su;
            t.step_v = steps.sv;
        };
        steps_of(g.P, std::min(t.edge_step[0], t.edge_step[2]), std::min(t.edge_step[1], t.edge_step[3]));
        for (const grid::Grid::Step& later : g.later)
            steps_of(later.P, t.step_u, t.step_v);
        const float budget = std::max(0.0f, tolerance_at(rule, pixels) - edge_error);
        for (int k = 0; k < 4; k++) {
            int& across = k == grid::VMin || k == grid::VMax ? t.step_v : t.step_u;
            const int along = k == grid::VMin || k == grid::VMax ? t.step_u : t.step_v;
            each_step(g, [&](const std::vector<float>& p) {
                while (across > 1 && piece.sides[size_t(k)].cells > 0 && t.edge_step[size_t(k)] > along &&
                       side_twist(g, p, k, t.edge_step[size_t(k)], across, budget, rule.normal_tolerance) > 1)
                    across /= 2;
            });
        }
    }
    t.mu = g.nu / t.step_u;
    t.mv = g.nv / t.step_v;
    return t;
}

} // namespace kanuka::dice
