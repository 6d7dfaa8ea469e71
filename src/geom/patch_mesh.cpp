// Patch and PatchMesh: bilinear or bicubic in any basis, wrapping round in either direction, rational with
// "Pw".
#include "geom/kinds.h"
#include "geom/lattice_surface.h"

namespace kanuka::geom {
namespace {

using Matrix4 = std::array<std::array<double, 4>, 4>;

// Row k: how Bezier point k mixes the control points of a basis.
Matrix4 bezier_from(const BasisMatrix& basis) {
    Matrix4 m;
    for (int k = 0; k < 4; k++) {
        const double a = basis[0][k], b = basis[1][k], c = basis[2][k], d = basis[3][k]; // of t^3, t^2, t, 1
        m[0][k] = d;
        m[1][k] = d + c / 3;
        m[2][k] = d + (2 * c + b) / 3;
        m[3][k] = a + b + c + d;
    }
    return m;
}

// Do its weights sum to one? Those of slopes (Hermite) and of powers do not: a transform that moves the
// origin may be applied to what they make, but not to them.
bool is_affine(const Matrix4& bezier) {
    return std::all_of(bezier.begin(), bezier.end(), [](const std::array<double, 4>& row) {
        return std::abs(row[0] + row[1] + row[2] + row[3] - 1) < 1e-5;
    });
}

class PatchSurface : public Surface {
  public:
    PatchSurface(const scene::Primitive& primitive, const scene::PatchMesh& mesh, const Transform& m)
        : Surface(primitive, m), m_mesh(mesh), m_placed(m), m_points(control_points(primitive, m)) {
        m_order = mesh.cubic ? 4 : 2;
        m_step_u = mesh.cubic ? std::max(1, mesh.u_basis->step) : 1;
        m_step_v = mesh.cubic ? std::max(1, mesh.v_basis->step) : 1;
        m_nu = mesh.u_periodic ? mesh.nu / m_step_u : (mesh.nu - m_order) / m_step_u + 1;
        m_nv = mesh.v_periodic ? mesh.nv / m_step_v : (mesh.nv - m_order) / m_step_v + 1;
        m_corners_u = mesh.u_periodic ? m_nu : m_nu + 1;
        m_corners_v = mesh.v_periodic ? m_nv : m_nv + 1;
        m_bulges = mesh.cubic;
        if (!mesh.cubic)
            return;
        m_bezier_u = bezier_from(mesh.u_basis->m);
        m_bezier_v = bezier_from(mesh.v_basis->m);
        m_in_bezier = m_points.weights.empty() && !(is_affine(m_bezier_u) && is_affine(m_bezier_v));
        if (!m_in_bezier)
            return;
        for (size_t c = 0; c < 3; c++)
            m_origin[c] = std::exchange(m_placed.m[c][3], 0);
        m_points = control_points(primitive, m_placed);
    }

    bool prepare(const scene::Primitive& primitive, Journal& journal) {
        const scene::PatchMesh& mesh = m_mesh;
        if (mesh.nu < (mesh.u_periodic ? 1 : m_order) || mesh.nv < (mesh.v_periodic ? 1 : m_order) ||
            m_nu < 1 || m_nv < 1) {
            journal.error(primitive.where, "a patch mesh of " + std::to_string(mesh.nu) + " x " +
                                               std::to_string(mesh.nv) +
                                               " control points is too small for its type");
            return false;
        }
        const size_t need = size_t(mesh.nu) * mesh.nv;
        if (const scene::Value* z = primitive.primvars.find("Pz"); m_points.size() == 0 && z)
            height_field(*z);
        if (m_points.size() < need) {
            journal.error(primitive.where, "a patch mesh of " + std::to_string(mesh.nu) + " x " +
                                               std::to_string(mesh.nv) + " needs " + std::to_string(need) +
                                               " control points, found " + std::to_string(m_points.size()));
            return false;
        }
        const auto lattice_vertex = [&](int f, int k) { return vertex_in_lattice(f, k); };
        if (!m_finite.find(m_points, need, m_nu * m_nv, m_order * m_order, lattice_vertex, "patches",
                           primitive.where, journal))
            return false;
        ItemCounts counts;
        counts.uniform = size_t(m_nu) * m_nv;
        counts.varying = counts.facevarying = size_t(m_corners_u) * m_corners_v;
        counts.vertex = need;
        m_primvars = collect_primvars(primitive, m_page_from_object, counts, journal);
        FiniteFaces finite = std::exchange(m_finite, {}); // of the whole lattice first
        const LatticeShape shape = find_lattice(*this, {m_nu, m_nv, mesh.u_periodic, mesh.v_periodic});
        m_finite = std::move(finite);
        set_lattice(shape);
        return true;
    }
    void set_lattice(const LatticeShape& shape) override {
        Surface::set_lattice(shape);
        m_finite.keep(m_topology);
    }

    void positions(int face, Line u, Line v, float* out, int stride) const override {
        const TensorLattice lattice(u, place_basis(m_mesh.u_basis), v, place_basis(m_mesh.v_basis));
        float control[3][16];
        float homogeneous[16];
        gather_points(face, control, homogeneous);
        for (int c = 0; c < 3; c++)
            lattice.values(control[c], out + size_t(c) * stride, u.count);
        if (m_points.weights.empty())
            return;
        std::vector<float> w(size_t(u.count) * v.count);
        lattice.values(homogeneous, w.data(), u.count);
        for (int c = 0; c < 3; c++)
            for (size_t i = 0; i < w.size(); i++)
                out[size_t(c) * stride + i] /= w[i];
    }

    FaceRange range(int face) const override {
        face = m_finite.in_lattice(face);
        const int i = face % m_nu, j = face / m_nu;
        return {float(i) / m_nu, float(i + 1) / m_nu, float(j) / m_nv, float(j + 1) / m_nv};
    }
    int uniform_index(int face) const override { return m_finite.in_lattice(face); }

  protected:
    void shape(int face, Line u, Line v, Lattice out) const override {
        const TensorLattice places(u, place_basis(m_mesh.u_basis), v, place_basis(m_mesh.v_basis));
        const TensorLattice lattice(u, basis(m_mesh.u_basis), v, basis(m_mesh.v_basis));
        grid::Grid& g = out.grid;
        float control[3][16];
        float homogeneous[16];
        gather_points(face, control, homogeneous);
        for (int c = 0; c < 3; c++) {
            const size_t at = size_t(c) * g.stride + out.base;
            places.slopes(control[c], &g.P[at], &g.dPdu[at], &g.dPdv[at], out.pitch);
        }
        if (!m_points.weights.empty())
            project_rational(homogeneous, lattice, u.count, v.count, out);
        const TensorLattice linear(u, nullptr, v, nullptr);
        for (const Primvar& p : m_primvars.list)
            for (int c = 0; c < p.components; c++) {
                float* to = p.destination(g, c) + out.base;
                float q[16];
                if (p.detail == scene::Detail::Uniform) {
                    std::fill_n(q, 4, p(m_finite.in_lattice(face), c));
                    linear.values(q, to, out.pitch);
                } else if (p.detail == scene::Detail::Vertex) {
                    for (int k = 0; k < m_order * m_order; k++)
                        q[k] = p(vertex(face, k), c);
                    lattice.values(q, to, out.pitch);
                } else {
                    for (int k = 0; k < 4; k++)
                        q[k] = p(corner(face, k), c);
                    linear.values(q, to, out.pitch);
                }
            }
    }

  private:
    void height_field(const scene::Value& z) {
        // RISpec: a height field over the unit square of parameter space.
        const int nu = m_mesh.nu, nv = m_mesh.nv;
        if (z.floats.size() < size_t(nu) * nv)
            return;
        m_points.xyz.resize(size_t(nu) * nv * 3);
        for (int j = 0; j < nv; j++)
            for (int i = 0; i < nu; i++) {
                const int at = j * nu + i;
                const Vec3f p = m_placed.point(
                    {nu > 1 ? float(i) / (nu - 1) : 0.0f, nv > 1 ? float(j) / (nv - 1) : 0.0f, z.floats[at]});
                for (int c = 0; c < 3; c++)
                    m_points.xyz[3 * at + c] = p[c];
            }
    }

    const BasisMatrix* basis(const scene::Basis& b) const { return m_mesh.cubic ? &b.m : nullptr; }
    // Of what gather_points gives.
    const BasisMatrix* place_basis(const scene::Basis& b) const {
        return m_in_bezier ? &BezierBasis : basis(b);
    }

    // k-th control point of a face, u fastest.
    size_t vertex(int face, int k) const { return vertex_in_lattice(m_finite.in_lattice(face), k); }
    size_t vertex_in_lattice(int face, int k) const {
        const int i = ((face % m_nu) * m_step_u + k % m_order) % m_mesh.nu;
        const int j = ((face / m_nu) * m_step_v + k / m_order) % m_mesh.nv;
        return size_t(j) * m_mesh.nu + i;
    }
    size_t corner(int face, int k) const {
        face = m_finite.in_lattice(face);
        const int i = (face % m_nu + k % 2) % m_corners_u, j = (face / m_nu + k / 2) % m_corners_v;
        return size_t(j) * m_corners_u + i;
    }

    void gather_points(int face, float control[3][16], float* homogeneous) const {
        for (int k = 0; k < m_order * m_order; k++) {
            const size_t at = vertex(face, k);
            for (int c = 0; c < 3; c++)
                control[c][k] = m_points.xyz[3 * at + c];
            homogeneous[k] = m_points.weights.empty() ? 1 : m_points.weights[at];
        }
        for (int c = 0; c < 3 && m_in_bezier; c++) {
            double half[4][4] = {}, all[16] = {};
            for (int j = 0; j < 4; j++)
                for (int i = 0; i < 4; i++)
                    for (int k = 0; k < 4; k++)
                        half[j][i] += m_bezier_u[i][k] * double(control[c][4 * j + k]);
            for (int j = 0; j < 4; j++)
                for (int i = 0; i < 4; i++)
                    for (int k = 0; k < 4; k++)
                        all[4 * j + i] += m_bezier_v[j][k] * half[k][i];
            for (int k = 0; k < 16; k++)
                control[c][k] = float(all[k] + m_origin[c]);
        }
    }

    static void project_rational(const float* homogeneous, const TensorLattice& lattice, int nu, int nv,
                                 Lattice out) {
        const size_t n = size_t(nu) * nv;
        std::vector<float> w(3 * n);
        lattice.slopes(homogeneous, w.data(), w.data() + n, w.data() + 2 * n, nu);
        divide_rational(w.data(), w.data() + n, w.data() + 2 * n, nu, nv, out);
    }

    const scene::PatchMesh m_mesh;
    // Where control points are, and what is missing to the page's space: only where they are not affine, and
    // made Bezier points in double.
    Transform m_placed;
    std::array<double, 3> m_origin{};
    bool m_in_bezier = false;
    Matrix4 m_bezier_u, m_bezier_v;
    ControlPoints m_points;
    FiniteFaces m_finite;
    int m_order, m_step_u, m_step_v, m_nu, m_nv, m_corners_u, m_corners_v;
};

} // namespace

SurfacePtr make_patch_mesh(const scene::Primitive& primitive, const scene::PatchMesh& mesh,
                           const Transform& m, Journal& journal) {
    auto surface = std::make_unique<PatchSurface>(primitive, mesh, m);
    return surface->prepare(primitive, journal) ? std::move(surface) : nullptr;
}

} // namespace kanuka::geom
