#include "geom/lattice_surface.h"

namespace kanuka::geom {

namespace {

constexpr int Samples = 9; // along a side of one face

// Points along a side of the whole lattice.
std::vector<Vec3f> side_points(const Surface& surface, const LatticeShape& shape, int side) {
    const bool along_u = side == 0 || side == 2;
    const int faces = along_u ? shape.nu : shape.nv;
    float t[Samples], fixed = side == 1 || side == 2 ? 1.0f : 0.0f;
    for (int i = 0; i < Samples; i++)
        t[i] = float(i) / (Samples - 1);
    std::vector<Vec3f> points;
    for (int k = 0; k < faces; k++) {
        const int i = along_u ? k : side == 1 ? shape.nu - 1 : 0;
        const int j = along_u ? (side == 2 ? shape.nv - 1 : 0) : k;
        float p[3 * Samples];
        const Line line{t, Samples}, one{&fixed, 1};
        surface.positions(j * shape.nu + i, along_u ? line : one, along_u ? one : line, p, Samples);
        for (int s = 0; s < Samples; s++)
            points.push_back({p[s], p[Samples + s], p[2 * Samples + s]});
    }
    return points;
}

} // namespace

LatticeShape find_lattice(const Surface& surface, LatticeShape shape) {
    std::array<std::vector<Vec3f>, 4> sides;
    Bounds3f bounds;
    for (int s = 0; s < 4; s++) {
        sides[s] = side_points(surface, shape, s);
        for (const Vec3f& p : sides[s])
            bounds.extend(p);
    }
    const float near = 4e-7f * (length(bounds.diagonal()) + length(bounds.center()) * 0.25f);
    const auto same = [&](const Vec3f& a, const Vec3f& b) { return length_squared(a - b) <= near * near; };
    for (int s = 0; s < 4; s++) {
        const bool wraps = s == 0 || s == 2 ? shape.wrap_v : shape.wrap_u;
        shape.pole[s] = !wraps && std::all_of(sides[s].begin(), sides[s].end(),
                                              [&](const Vec3f& p) { return same(p, sides[s][0]); });
    }
    const auto meet = [&](int a, int b) {
        return !shape.pole[a] && !shape.pole[b] &&
               std::equal(sides[a].begin(), sides[a].end(), sides[b].begin(), same);
    };
    shape.wrap_u = shape.wrap_u || meet(3, 1);
    shape.wrap_v = shape.wrap_v || meet(0, 2);
    return shape;
}

void share_lattice(Surface& first, std::span<const std::unique_ptr<Surface>> later) {
    LatticeShape all = first.lattice();
    for (const auto& s : later) {
        const LatticeShape& own = s->lattice();
        if (own.nu != all.nu || own.nv != all.nv)
            return;
        for (size_t k = 0; k < 4; k++)
            all.pole[k] = all.pole[k] && own.pole[k];
        all.twins_u |= all.wrap_u != own.wrap_u, all.wrap_u &= own.wrap_u;
        all.twins_v |= all.wrap_v != own.wrap_v, all.wrap_v &= own.wrap_v;
    }
    if (all.nu == 0)
        return;
    first.set_lattice(all);
    for (const auto& s : later)
        s->set_lattice(all);
}

bool FiniteFaces::find(ControlPoints& points, size_t used, int faces, int each,
                       const std::function<size_t(int, int)>& vertex, const char* what, const Location& where,
                       Journal& journal) {
    size_t good = 0, bad = 0;
    for (size_t i = used; i-- > 0;)
        if (points.finite(i))
            good = i;
        else
            bad++;
    if (bad == 0)
        return faces > 0;
    std::vector<int> kept;
    for (int f = 0; f < faces; f++) {
        int k = 0;
        while (k < each && points.finite(vertex(f, k)))
            k++;
        if (k == each)
            kept.push_back(f);
    }
    const size_t all = size_t(faces);
    Dropped{all - kept.size(), 0, 0}.report(all, what, where, journal);
    for (size_t i = 0; i < used && bad < used; i++)
        if (!points.finite(i)) {
            std::copy_n(&points.xyz[3 * good], 3, &points.xyz[3 * i]);
            if (!points.weights.empty())
                points.weights[i] = points.weights[good];
        }
    if (kept.size() < all)
        m_kept = kept;
    return !kept.empty();
}

void FiniteFaces::keep(Topology& topology) const {
    if (!m_kept.empty())
        topology = kept_faces(topology, m_kept);
}

void divide_rational(const float* w, const float* wu, const float* wv, int count_u, int count_v,
                     Lattice lattice) {
    grid::Grid& g = lattice.grid;
    for (int c = 0; c < 3; c++)
        for (int j = 0; j < count_v; j++) {
            const size_t at = size_t(c) * g.stride + lattice.base + size_t(j) * lattice.pitch;
            float *p = &g.P[at], *pu = &g.dPdu[at], *pv = &g.dPdv[at];
            for (int i = 0; i < count_u; i++) {
                const int k = j * count_u + i;
                const float inv = 1 / w[k];
                p[i] *= inv;
                pu[i] = (pu[i] - p[i] * wu[k]) * inv; // quotient rule
                pv[i] = (pv[i] - p[i] * wv[k]) * inv;
            }
        }
}

} // namespace kanuka::geom
