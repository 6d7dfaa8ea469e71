// Patches of every basis, NURBS, trimmed ones.
#pragma once

#include "dice/test_flat_shapes.h"

namespace kanuka::dice::test {

class PatchShapes : public FlatShapes {
  protected:
    using FlatShapes::FlatShapes;

    // Control points over a lattice: a sheet, a tube where u wraps, a ring where both do.
    std::vector<D3> lattice(int nu, int nv, bool wrap_u, bool wrap_v, double z) {
        std::vector<D3> p;
        for (int j = 0; j < nv; j++)
            for (int i = 0; i < nu; i++) {
                const double u = wrap_u ? double(i) / nu : double(i) / (nu - 1),
                             v = wrap_v ? double(j) / nv : double(j) / (nv - 1);
                D3 q;
                if (!wrap_u && !wrap_v) {
                    q = {2 * u - 1 + uniform(-.25, .25) / nu, 2 * v - 1 + uniform(-.25, .25) / nv,
                         uniform(-z, z)};
                } else {
                    const double a = Turn * (wrap_u ? u : v), b = wrap_u && wrap_v ? Turn * v : 0;
                    const double along = wrap_u ? v : u,
                                 r = wrap_u && wrap_v ? 1 + 0.4 * std::cos(b) : 1 + z * along;
                    q = {r * std::cos(a), r * std::sin(a),
                         wrap_u && wrap_v ? 0.4 * std::sin(b) : along * 1.5};
                }
                p.push_back(rounded(q));
            }
        return p;
    }
    static M4 times(const M4& a, const M4& b) {
        M4 c{};
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++)
                for (int k = 0; k < 4; k++)
                    c[i][j] += a[i][k] * b[k][j];
        return c;
    }
    static M4 inverse(M4 a) { // Gauss-Jordan
        M4 r = basis_matrix("power");
        for (int c = 0; c < 4; c++) {
            int p = c;
            for (int i = c; i < 4; i++)
                p = std::abs(a[i][c]) > std::abs(a[p][c]) ? i : p;
            std::swap(a[c], a[p]), std::swap(r[c], r[p]);
            const double f = 1 / a[c][c];
            for (int k = 0; k < 4; k++)
                a[c][k] *= f, r[c][k] *= f;
            for (int i = 0; i < 4; i++)
                for (int k = 0; i != c && k < 4; k++)
                    if (k == 0) {
                        const double g = a[i][c];
                        for (int l = 0; l < 4; l++)
                            a[i][l] -= g * a[c][l], r[i][l] -= g * r[c][l];
                    }
        }
        return r;
    }
    // The same patch by other control points: in both directions inverse(M) Bezier.
    static std::vector<D3> rebased(const std::vector<D3>& bezier, const std::string& u,
                                   const std::string& v) {
        const M4 mu = times(inverse(basis_matrix(u)), basis_matrix("bezier")),
                 mv = times(inverse(basis_matrix(v)), basis_matrix("bezier"));
        std::vector<D3> out(16);
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++)
                for (int l = 0; l < 4; l++)
                    for (int k = 0; k < 4; k++)
                        out[4 * j + i] = out[4 * j + i] + bezier[4 * l + k] * (mu[i][k] * mv[j][l]);
        for (D3& p : out)
            p = {double(float(p.x)), double(float(p.y)), double(float(p.z))};
        return out;
    }
    void patches(bool cubic, bool mesh) {
        scene::PatchMesh m;
        m.cubic = cubic;
        const int order = cubic ? 4 : 2;
        std::string names[2];
        int step[2];
        for (int k = 0; k < 2; k++) {
            const char* const all[] = {"bezier", "b-spline", "catmull-rom", "hermite", "power"};
            names[k] = all[whole(0, mesh ? 2 : 4)];
            step[k] = !cubic ? 1 : names[k] == "bezier" ? 3 : 1;
        }
        m.u_basis = scene::basis_by_name(names[0]);
        m.v_basis = scene::basis_by_name(names[1]);
        int wraps = 0, count[2] = {1, 1};
        if (mesh) {
            wraps = whole(0, 3);
            for (int k = 0; k < 2; k++)
                count[k] = (wraps >> k & 1) ? whole(step[k] == 3 ? 2 : 4, 6) : whole(1, 3);
        }
        const bool wrap_u = wraps & 1, wrap_v = wraps & 2;
        m.u_periodic = wrap_u, m.v_periodic = wrap_v;
        m.nu = wrap_u ? count[0] * step[0] : order + (count[0] - 1) * step[0];
        m.nv = wrap_v ? count[1] * step[1] : order + (count[1] - 1) * step[1];
        const double z = bend();
        if (cubic)
            shape.note = names[0] + " x " + names[1];
        std::vector<D3> p = lattice(m.nu, m.nv, wrap_u, wrap_v, z);
        std::vector<D3> hull = p;
        if (cubic && !mesh) {
            for (D3& q : hull)
                q = q * 1.02;
            shape.hull = hull;
            p = rebased(p, names[0], names[1]);
        } else if (names[0] == "catmull-rom" || names[1] == "catmull-rom") {
            for (D3& q : hull) // runs past its control points
                q = q * 1.4;
            shape.hull = hull;
        }
        // A third of this is 0.9 % off where a tube is seen nearly along its sides.
        const int cells = std::max(16, 288 / std::max(count[0], count[1]));
        const M4 bu = basis_matrix(names[0]), bv = basis_matrix(names[1]);
        for (int fj = 0; fj < count[1]; fj++)
            for (int fi = 0; fi < count[0]; fi++)
                add_sheet(shape.soup, cells, cells, [&](double u, double v) {
                    std::array<double, 4> wu{1 - u, u}, wv{1 - v, v};
                    if (cubic)
                        wu = basis_weights(bu, u), wv = basis_weights(bv, v);
                    D3 sum;
                    for (int l = 0; l < order; l++)
                        for (int k = 0; k < order; k++)
                            sum = sum +
                                  p[size_t((fj * step[1] + l) % m.nv) * m.nu + (fi * step[0] + k) % m.nu] *
                                      (wu[k] * wv[l]);
                    return sum;
                });
        shape.closed = wrap_u && wrap_v;
        shape.flat = wraps == 0 && z == 0;
        set(m, p);
    }

    static std::vector<double> clamped_knots(int count, int order) {
        std::vector<double> k;
        for (int i = 0; i < count + order; i++)
            k.push_back(std::clamp(i - order + 1, 0, count - order + 1));
        return k;
    }
    void nurbs() {
        scene::NuPatch n{};
        n.u_order = whole(2, 5), n.v_order = whole(2, 5);
        n.nu = n.u_order + whole(0, 3), n.nv = n.v_order + whole(0, 3);
        const auto ku = clamped_knots(n.nu, n.u_order), kv = clamped_knots(n.nv, n.v_order);
        n.u_knots = floats_of(ku), n.v_knots = floats_of(kv);
        n.u_max = float(ku.back()), n.v_max = float(kv.back());
        const double z = bend();
        const std::vector<D3> p = lattice(n.nu, n.nv, false, false, z);
        const bool rational = chance(0.5);
        std::vector<float> pw;
        std::vector<double> w;
        for (const D3& q : p) {
            const double weight = rational ? double(float(uniform(0.6, 1.6))) : 1;
            w.push_back(weight);
            pw.insert(pw.end(),
                      {float(q.x * weight), float(q.y * weight), float(q.z * weight), float(weight)});
        }
        add_sheet(shape.soup, 72, 72, [&](double u, double v) {
            std::vector<double> bu, bv;
            for (int i = 0; i < n.nu; i++)
                bu.push_back(bspline(ku, i, n.u_order, u * ku.back()));
            for (int j = 0; j < n.nv; j++)
                bv.push_back(bspline(kv, j, n.v_order, v * kv.back()));
            D3 sum;
            double total = 0;
            for (int j = 0; j < n.nv; j++)
                for (int i = 0; i < n.nu; i++) {
                    const double b = bu[i] * bv[j] * w[size_t(j) * n.nu + i];
                    sum = sum + p[size_t(j) * n.nu + i] * b;
                    total += b;
                }
            return sum * (1 / total);
        });
        shape.flat = z == 0;
        shape.hull = p;
        shape.primitive = primitive(n);
        shape.primitive.primvars.set(test::floats("Pw", scene::Type::HPoint, scene::Detail::Vertex, pw));
    }
    // A circle as a rational B-spline (The NURBS Book, 7.5: nine points), times a line towards its centre.
    void rational_disc() {
        scene::NuPatch n{};
        n.u_order = 3, n.nu = 9, n.v_order = 2, n.nv = 2;
        n.u_knots = std::vector<float>{0, 0, 0, .25f, .25f, .5f, .5f, .75f, .75f, 1, 1, 1};
        n.v_knots = std::vector<float>{0, 0, 1, 1};
        n.u_max = n.v_max = 1;
        const double inner = chance(0.4) ? 0.0 : uniform(0.2, 0.8);
        constexpr int X[9] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, Y[9] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
        std::vector<float> pw;
        for (const double r : {1.0, inner})
            for (int i = 0; i < 9; i++) {
                const double w = i % 2 ? std::sqrt(0.5) : 1;
                pw.insert(pw.end(), {float(r * X[i] * w * m_stretch), float(r * Y[i] * w), 0, float(w)});
            }
        shape.primitive = primitive(n);
        shape.primitive.primvars.set(test::floats("Pw", scene::Type::HPoint, scene::Detail::Vertex, pw));
        shape.hit = [inner, s = m_stretch](const D3& o, const D3& d) {
            const double t = -o.z / d.z, x = (o.x + t * d.x) / s, y = o.y + t * d.y, r = x * x + y * y;
            return r <= 1 && r >= inner * inner;
        };
        shape.flat = true;
        box(m_stretch, 1, 0, 0);
    }
    // A square of which loops keep or cut parts.
    void trimmed() {
        scene::NuPatch n{};
        n.u_order = n.v_order = n.nu = n.nv = 2;
        n.u_knots = n.v_knots = std::vector<float>{0, 0, 1, 1};
        n.u_max = n.v_max = 1;
        auto trim = std::make_shared<scene::TrimCurves>();
        trim->outside = chance(0.3);
        std::vector<int32_t> curves, order, points;
        std::vector<float> knots, lo, hi, u, v, w;
        std::vector<Loop2> loops;
        std::vector<std::array<double, 3>> circles;
        const int count = whole(1, 3);
        for (int k = 0; k < count; k++) {
            const double cx = count == 1 ? 0.5 : 0.28 + 0.22 * k,
                         cy = count == 1 ? 0.5
                              : k == 1   ? 0.75
                                         : 0.3,
                         r = count == 1 ? uniform(0.2, 0.45) : 0.18;
            curves.push_back(1);
            if (chance(0.5)) { // nine points of a circle
                constexpr int X[9] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, Y[9] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
                order.push_back(3), points.push_back(9);
                for (const float x : {0.f, 0.f, 0.f, .25f, .25f, .5f, .5f, .75f, .75f, 1.f, 1.f, 1.f})
                    knots.push_back(x);
                for (int i = 0; i < 9; i++) {
                    const double weight = i % 2 ? std::sqrt(0.5) : 1;
                    u.push_back(float((cx + r * X[i]) * weight));
                    v.push_back(float((cy + r * Y[i]) * weight));
                    w.push_back(float(weight));
                }
                circles.push_back({cx, cy, r});
                lo.push_back(0), hi.push_back(1);
                continue;
            }
            Loop2 l = chance(0.5) ? star(whole(3, 6)) : ring(whole(3, 8), 0.3, 1, 1);
            for (auto& p : l)
                p = {cx + r * p[0], cy + r * p[1]};
            loops.push_back(l);
            l.push_back(l[0]);
            order.push_back(2), points.push_back(int32_t(l.size()));
            const auto ks = clamped_knots(int(l.size()), 2);
            knots.insert(knots.end(), ks.begin(), ks.end());
            lo.push_back(0), hi.push_back(float(ks.back()));
            for (const auto& p : l)
                u.push_back(float(p[0])), v.push_back(float(p[1])), w.push_back(1);
        }
        trim->curves_per_loop = curves, trim->order = order, trim->points = points, trim->knots = knots;
        trim->min = lo, trim->max = hi, trim->u = u, trim->v = v, trim->w = w;
        n.trim = trim;
        const bool outside = trim->outside;
        const Hit in_loops = hit_polygon(loops);
        shape.hit = [=, s = m_stretch](const D3& o, const D3& d) {
            const double t = -o.z / d.z, x = (o.x + t * d.x) / s, y = o.y + t * d.y;
            if (!(x >= 0 && x <= 1 && y >= 0 && y <= 1))
                return false;
            bool in = !loops.empty() && in_loops({x, y, -1}, {0, 0, 1});
            for (const auto& c : circles)
                in ^= (x - c[0]) * (x - c[0]) + (y - c[1]) * (y - c[1]) < c[2] * c[2];
            return in != outside;
        };
        shape.flat = true;
        set(n, {rounded({0, 0, 0}), rounded({1, 0, 0}), rounded({0, 1, 0}), rounded({1, 1, 0})});
    }
};

} // namespace kanuka::dice::test
