// Quadrics with partial sweeps: a profile (x, y, z)(v) turned about the z axis by the angle u * theta.
// RISpec 3.2, 5.4.
#include "geom/kinds.h"
#include "geom/lattice_surface.h"

namespace kanuka::geom {
namespace {

using Kind = scene::Quadric::Kind;

// A point of the profile, its slope per unit of v, and the direction of the profile there (where the slope
// vanishes or is infinite, the limit).
struct ProfilePoint {
    double x, y, z, dx, dy, dz, tx, ty, tz;
};

double radians(double degrees) {
    return degrees * (3.14159265358979323846 / 180);
}

class QuadricSurface : public Surface {
  public:
    QuadricSurface(const scene::Primitive& primitive, const Transform& m)
        : Surface(primitive, m), m_q(std::get<scene::Quadric>(primitive.geometry)) {}

    // `moving`: sweeps may change on the way, and faces must not: all have as many as a whole turn.
    bool prepare(const scene::Primitive& primitive, bool moving, Journal& journal) {
        if (const std::string why = read_arguments(); !why.empty()) {
            journal.error(primitive.where, "a quadric was left out: " + why);
            return false;
        }
        if (m_page_from_object.determinant3() != 0)
            m_inverse = m_page_from_object.inverse();
        m_primvars = collect_primvars(primitive, m_page_from_object, {1, 4, 4, 4}, journal);
        LatticeShape shape;
        shape.nu = m_nu = moving ? 4 : std::clamp(int(std::ceil(std::abs(m_theta) / 90 - 1e-6)), 1, 4);
        shape.nv = m_nv = profile_faces(moving);
        set_lattice(find_lattice(*this, shape));
        return true;
    }

    void positions(int face, Line u, Line v, float* out, int stride) const override {
        const FaceRange r = range(face);
        std::vector<double> turn = rotation(r, u);
        for (int j = 0; j < v.count; j++) {
            const ProfilePoint p = profile(r.v0 + double(r.v1 - r.v0) * v[j]);
            for (int i = 0; i < u.count; i++) {
                const double c = turn[2 * i], s = turn[2 * i + 1];
                const Vec3f q = page_point(p.x * c - p.y * s, p.x * s + p.y * c, p.z);
                const size_t at = size_t(j) * u.count + i;
                out[at] = q.x, out[at + stride] = q.y, out[at + 2 * size_t(stride)] = q.z;
            }
        }
    }

    FaceRange range(int face) const override {
        const int i = face % m_nu, j = face / m_nu;
        return {float(i) / m_nu, float(i + 1) / m_nu, float(j) / m_nv, float(j + 1) / m_nv};
    }
    int uniform_index(int) const override { return 0; }

  protected:
    bool owns_normals(int) const override { return true; }

    void shape(int face, Line u, Line v, Lattice out) const override {
        grid::Grid& g = out.grid;
        const FaceRange r = range(face);
        const std::vector<double> turn = rotation(r, u);
        const double theta = radians(m_theta), ru = r.u1 - r.u0, rv = r.v1 - r.v0;
        const double sign = m_orientation;
        const auto& m = m_page_from_object.m;
        const size_t n = size_t(g.stride);
        for (int j = 0; j < v.count; j++) {
            const ProfilePoint p = profile(r.v0 + rv * v[j]);
            // Normal at angle 0: direction of turning x direction of the profile. On the axis, where turning
            // moves nothing, the direction that it has just beside is taken.
            double ax = -p.y, ay = p.x;
            if (ax == 0 && ay == 0)
                ax = -m_axis_y, ay = m_axis_x;
            if (theta < 0)
                ax = -ax, ay = -ay;
            const double nx = ay * p.tz, ny = -ax * p.tz, nz = ax * p.ty - ay * p.tx;
            for (int i = 0; i < u.count; i++) {
                const double c = turn[2 * i], s = turn[2 * i + 1];
                const size_t at = out.base + size_t(j) * out.pitch + i;
                const double x = p.x * c - p.y * s, y = p.x * s + p.y * c;
                const double ux = -y * theta * ru, uy = x * theta * ru;
                const double vx = (p.dx * c - p.dy * s) * rv, vy = (p.dx * s + p.dy * c) * rv, vz = p.dz * rv;
                for (int k = 0; k < 3; k++) {
                    g.P[at + k * n] = float(m[k][0] * x + m[k][1] * y + m[k][2] * p.z + m[k][3]);
                    g.dPdu[at + k * n] = float(m[k][0] * ux + m[k][1] * uy);
                    g.dPdv[at + k * n] = float(m[k][0] * vx + m[k][1] * vy + m[k][2] * vz);
                }
                const Vec3f o{float((nx * c - ny * s) * sign), float((nx * s + ny * c) * sign),
                              float(nz * sign)};
                const Vec3f w = normalize(m_page_from_object.normal(o, m_inverse));
                for (int k = 0; k < 3; k++)
                    g.Ng[at + k * n] = w[k];
            }
        }
        // All classes are four corner values over the whole quadric.
        Weights lu(2, u.count), lv(2, v.count);
        std::vector<float> wholeu(u.count), wholev(v.count);
        for (int i = 0; i < u.count; i++)
            wholeu[i] = r.u0 + (r.u1 - r.u0) * u[i];
        for (int j = 0; j < v.count; j++)
            wholev[j] = r.v0 + (r.v1 - r.v0) * v[j];
        linear_weights({wholeu.data(), u.count}, lu);
        linear_weights({wholev.data(), v.count}, lv);
        for (const Primvar& p : m_primvars.list)
            for (int c = 0; c < p.components; c++) {
                float q[4];
                for (int k = 0; k < 4; k++)
                    q[k] = p(p.detail == scene::Detail::Uniform ? 0 : k, c);
                tensor_values(q, lu, lv, p.destination(g, c) + out.base, out.pitch);
            }
    }

  private:
    std::string read_arguments() {
        constexpr size_t Needed[] = {4, 3, 4, 7, 4, 3, 5};
        const std::vector<float>& a = m_q.arguments;
        if (a.size() < Needed[int(m_q.kind)])
            return "it needs " + std::to_string(Needed[int(m_q.kind)]) + " numbers, found " +
                   std::to_string(a.size());
        for (float f : a)
            if (!std::isfinite(f))
                return "a number is not finite";
        m_theta = std::clamp(double(a[Needed[int(m_q.kind)] - 1]), -360.0, 360.0);
        if (m_theta == 0)
            return "its sweep angle is zero";
        if (m_q.kind == Kind::Sphere) {
            if (a[0] == 0)
                return "its radius is zero";
            m_from = std::asin(std::clamp(double(a[1]) / a[0], -1.0, 1.0));
            m_to = std::asin(std::clamp(double(a[2]) / a[0], -1.0, 1.0));
        } else if (m_q.kind == Kind::Torus) {
            m_from = radians(a[2]);
            m_to = radians(std::clamp(double(a[3]), a[2] - 360.0, a[2] + 360.0));
        } else if (m_q.kind == Kind::Paraboloid && !(a[2] > 0)) {
            return "a paraboloid needs zmax > 0";
        }
        // Normals are computed in object space, where only a reversed orientation turns them.
        m_orientation = m_flips == (m_page_from_object.determinant3() < 0) ? 1 : -1;
        for (const double v : {0.0, 0.25, 0.5, 0.75, 1.0}) {
            const ProfilePoint p = profile(v);
            const double r = std::hypot(p.x, p.y);
            for (const auto& row : m_page_from_object.m)
                if (!(r * std::hypot(row[0], row[1]) + std::abs(row[2] * p.z) + std::abs(row[3]) <=
                      double(ControlPoints::Farthest)))
                    return "it reaches farther than 1e18";
        }
        // On the axis, points beside it tell in which direction it is left.
        const ProfilePoint start = profile(0.25), end = profile(0.75);
        const double x = start.x + end.x, y = start.y + end.y, l = std::sqrt(x * x + y * y);
        m_axis_x = l > 0 ? x / l : 1;
        m_axis_y = l > 0 ? y / l : 0;
        return {};
    }

    int profile_faces(bool moving) const {
        const double sweep = std::abs(m_to - m_from);
        if (m_q.kind == Kind::Sphere || m_q.kind == Kind::Torus)
            return moving ? 4 : std::clamp(int(std::ceil(sweep / radians(90) - 1e-6)), 1, 4);
        return 1;
    }

    ProfilePoint profile(double v) const {
        const std::vector<float>& a = m_q.arguments;
        ProfilePoint p{};
        switch (m_q.kind) {
        case Kind::Sphere:
        case Kind::Torus: {
            const bool sphere = m_q.kind == Kind::Sphere;
            const double r = sphere ? a[0] : a[1], offset = sphere ? 0.0 : a[0];
            const double d = m_to - m_from;
            const bool around = v == 1 && std::abs(d) > radians(360) * (1 - 1e-12);
            const double phi = around ? m_from : m_from + d * v;
            double c = std::cos(phi), s = std::sin(phi);
            if (sphere && std::abs(c) < 1e-9) // exactly on the axis
                c = 0, s = s > 0 ? 1 : -1;
            p = {offset + r * c, 0, r * s, -r * s * d, 0, r * c * d, -r * s * d, 0, r * c * d};
            if (d == 0)
                p.tx = -r * s, p.tz = r * c;
            return p;
        }
        case Kind::Cone:
            p = {a[1] * (1 - v), 0, a[0] * v, -a[1], 0, a[0]};
            break;
        case Kind::Cylinder:
            p = {a[0], 0, a[1] + (double(a[2]) - a[1]) * v, 0, 0, double(a[2]) - a[1]};
            break;
        case Kind::Disk:
            p = {a[1] * (1 - v), 0, a[0], -a[1], 0, 0};
            break;
        case Kind::Hyperboloid:
            p = {a[0] + (double(a[3]) - a[0]) * v,
                 a[1] + (double(a[4]) - a[1]) * v,
                 a[2] + (double(a[5]) - a[2]) * v,
                 double(a[3]) - a[0],
                 double(a[4]) - a[1],
                 double(a[5]) - a[2]};
            break;
        case Kind::Paraboloid: {
            const double dz = double(a[2]) - a[1], z = a[1] + dz * v, zmax = a[2];
            const double x = a[0] * std::sqrt(std::max(0.0, z / zmax));
            const double slope = a[0] * a[0] / (2 * zmax); // x dx/dz
            p = {x, 0, z, x > 0 ? slope / x * dz : 0, 0, dz, slope * dz, 0, x * dz};
            return p;
        }
        }
        p.tx = p.dx, p.ty = p.dy, p.tz = p.dz;
        return p;
    }

    std::vector<double> rotation(const FaceRange& r, Line u) const {
        std::vector<double> turn(size_t(2) * u.count);
        for (int i = 0; i < u.count; i++) {
            const double t = r.u0 + double(r.u1 - r.u0) * u[i];
            // A whole turn ends where it began, bit for bit: shapes in motion have no seam to be joined by.
            const double a = t == 1 && std::abs(m_theta) == 360 ? 0 : radians(m_theta * t);
            turn[2 * i] = std::cos(a);
            turn[2 * i + 1] = std::sin(a);
        }
        return turn;
    }

    Vec3f page_point(double x, double y, double z) const {
        const auto& m = m_page_from_object.m;
        return {float(m[0][0] * x + m[0][1] * y + m[0][2] * z + m[0][3]),
                float(m[1][0] * x + m[1][1] * y + m[1][2] * z + m[1][3]),
                float(m[2][0] * x + m[2][1] * y + m[2][2] * z + m[2][3])};
    }

    const scene::Quadric m_q;
    Transform m_inverse;
    double m_theta = 360, m_from = 0, m_to = 1, m_axis_x = 1, m_axis_y = 0, m_orientation = 1;
    int m_nu = 1, m_nv = 1;
};

} // namespace

SurfacePtr make_quadric(const scene::Primitive& primitive, const scene::Quadric&, const Transform& m,
                        Journal& journal, SurfaceHints hints) {
    auto surface = std::make_unique<QuadricSurface>(primitive, m);
    return surface->prepare(primitive, hints.moving, journal) ? std::move(surface) : nullptr;
}

} // namespace kanuka::geom
