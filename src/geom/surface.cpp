#include "geom/surface.h"

#include <cmath>

#include "base/tasks.h"
#include "geom/kinds.h"

namespace kanuka::geom {

Surface::Surface(const scene::Primitive& primitive, const Transform& page_from_object)
    : m_page_from_object(page_from_object) {
    const scene::Attributes* a = primitive.attributes.get();
    m_texture_coordinates = a ? a->texture_coordinates : scene::Attributes{}.texture_coordinates;
    // In object space the outside is where the components of dPdu x dPdv point, whatever the handedness; a
    // mirroring transform turns the cross product around, a normal not.
    m_flips = (page_from_object.determinant3() < 0) != (a && a->reverse_orientation);
}

void Surface::edge_positions(int edge, Line t, float* out, int stride) const {
    const Topology::Edge& e = m_topology.edges[edge];
    const auto half_of = [&](float x) {
        const int half = x > 0.5f ? 1 : 0;
        return e.face[half] < 0 || e.face[half] == e.face[1 - half] ? int(e.face[0] < 0) : half;
    };
    constexpr int Few = 16;
    float few[Few];
    std::vector<float> many(t.count > Few ? t.count : 0);
    float* const x = many.empty() ? few : many.data();
    for (int i = 0, end; i < t.count; i = end) { // runs that one face evaluates
        const int half = half_of(t[i]), f = e.face[half], side = e.side[half];
        for (end = i; end < t.count && half_of(t[end]) == half; end++)
            x[end - i] = std::clamp(side_parameter(m_topology.faces[f].sides[side], t[end]), 0.0f, 1.0f);
        // Lines rise; a side that is walked backwards is evaluated from its other end.
        const int n = end - i;
        const bool backwards = x[0] > x[n - 1];
        if (backwards)
            std::reverse(x, x + n);
        const Line line{x, n};
        const float fixed = side == 1 || side == 2 ? 1.0f : 0.0f;
        const Line one{&fixed, 1};
        const bool along_u = side == 0 || side == 2;
        positions(f, along_u ? line : one, along_u ? one : line, out + i, stride);
        if (backwards)
            for (int c = 0; c < 3; c++)
                std::reverse(out + size_t(c) * stride + i, out + size_t(c) * stride + end);
    }
}

// Small lattices without gaps go in one row.
constexpr int FewPoints = 64;
static bool is_few(Line u, Line v, const Lattice& out) {
    return out.pitch == u.count && u.count * v.count <= FewPoints;
}

void Surface::evaluate(int face, Line u, Line v, Lattice out) const {
    grid::Grid& g = out.grid;
    const FaceRange r = range(face);
    const std::array<float, 8>& tc = m_texture_coordinates;
    const auto texture = [&](int row, int count, auto&& u_of, auto&& v_of) {
        for (int i = 0; i < count; i++) {
            const float gu = u_of(i), gv = v_of(i);
            g.u[row + i] = gu;
            g.v[row + i] = gv;
            // Bilinear in the corners (0,0), (1,0), (0,1), (1,1) of TextureCoordinates.
            const float w00 = (1 - gu) * (1 - gv), w10 = gu * (1 - gv), w01 = (1 - gu) * gv, w11 = gu * gv;
            g.s[row + i] = w00 * tc[0] + w10 * tc[2] + w01 * tc[4] + w11 * tc[6];
            g.t[row + i] = w00 * tc[1] + w10 * tc[3] + w01 * tc[5] + w11 * tc[7];
        }
    };
    const auto u_at = [&](int i) { return r.u0 + (r.u1 - r.u0) * u[i]; };
    const auto v_at = [&](int j) { return r.v0 + (r.v1 - r.v0) * v[j]; };
    if (is_few(u, v, out)) {
        float us[FewPoints], vs[FewPoints];
        for (int j = 0, k = 0; j < v.count; j++)
            for (int i = 0; i < u.count; i++, k++)
                us[k] = u_at(i), vs[k] = v_at(j);
        texture(out.base, u.count * v.count, [&](int k) { return us[k]; }, [&](int k) { return vs[k]; });
    } else {
        for (int j = 0; j < v.count; j++)
            texture(out.base + j * out.pitch, u.count, u_at, [gv = v_at(j)](int) { return gv; });
    }
    shape(face, u, v, out);
    const float du = r.u1 - r.u0, dv = r.v1 - r.v0;
    if (du != 1 || dv != 1)
        for (int c = 0; c < 3; c++)
            for (int j = 0; j < v.count; j++) {
                float* a = g.dPdu.data() + size_t(c) * g.stride + out.base + j * out.pitch;
                float* b = g.dPdv.data() + size_t(c) * g.stride + out.base + j * out.pitch;
                for (int i = 0; i < u.count; i++) {
                    a[i] /= du;
                    b[i] /= dv;
                }
            }
    frame(face, u, v, out);
}

void Surface::frame(int face, Line u, Line v, Lattice out) const {
    grid::Grid& g = out.grid;
    const size_t n = size_t(g.stride);
    const float sign = m_flips ? -1.0f : 1.0f;
    const bool own = owns_normals(face);
    const auto make_row = [&](int row, int count, int first) { // `first`: of the lattice
        const float *ax = &g.dPdu[row], *ay = ax + n, *az = ay + n;
        const float *bx = &g.dPdv[row], *by = bx + n, *bz = by + n;
        float *nx = &g.Ng[row], *ny = nx + n, *nz = ny + n;
        int degenerate = 0;
        for (int i = 0; i < count && !own; i++) {
            const float x = fma(ay[i], bz[i], -(az[i] * by[i]));
            const float y = fma(az[i], bx[i], -(ax[i] * bz[i]));
            const float z = fma(ax[i], by[i], -(ay[i] * bx[i]));
            const float l = fma(x, x, fma(y, y, z * z));
            const float aa = fma(ax[i], ax[i], fma(ay[i], ay[i], az[i] * az[i]));
            const float bb = fma(bx[i], bx[i], fma(by[i], by[i], bz[i] * bz[i]));
            const float inv = sign / sqrt(l);
            nx[i] = x * inv;
            ny[i] = y * inv;
            nz[i] = z * inv;
            degenerate += !(l > 1e-9f * aa * bb) || !(l > 1e-37f);
        }
        for (int i = 0; i < count && degenerate; i++) {
            const Vec3f a{ax[i], ay[i], az[i]}, b{bx[i], by[i], bz[i]}, c = cross(a, b);
            const float l = length_squared(c);
            if (l > 1e-9f * length_squared(a) * length_squared(b) && l > 1e-37f)
                continue;
            const Vec3f m = normal_beside(face, u[(first + i) % u.count], v[(first + i) / u.count]) * sign;
            nx[i] = m.x, ny[i] = m.y, nz[i] = m.z;
        }
        if (!m_primvars.normals) {
            std::copy_n(nx, count, &g.N[row]);
            std::copy_n(ny, count, &g.N[row + n]);
            std::copy_n(nz, count, &g.N[row + 2 * n]);
        }
    };
    if (is_few(u, v, out))
        make_row(out.base, u.count * v.count, 0);
    else
        for (int j = 0; j < v.count; j++)
            make_row(out.base + j * out.pitch, u.count, j * u.count);
}

// Where derivatives vanish or are parallel (a collapsed side), the normal is the limit from the inside of the
// face.
Vec3f Surface::normal_beside(int face, float u, float v) const {
    grid::Grid g;
    g.allocate(0, 0);
    allocate_channels(g);
    for (const float step : {1e-3f, 1e-2f, 0.1f}) {
        const float uu = u + (0.5f - u) * 2 * step, vv = v + (0.5f - v) * 2 * step;
        shape(face, {&uu, 1}, {&vv, 1}, {g, 0, 1});
        const size_t n = size_t(g.stride);
        const Vec3f a{g.dPdu[0], g.dPdu[n], g.dPdu[2 * n]}, b{g.dPdv[0], g.dPdv[n], g.dPdv[2 * n]};
        const Vec3f c = cross(a, b);
        const float l = length_squared(c);
        if (l > 1e-9f * length_squared(a) * length_squared(b) && l > 1e-37f)
            return c / sqrt(l);
    }
    return {0, 0, 1}; // no area at all
}

ControlPoints control_points(const scene::Primitive& primitive, const Transform& m) {
    ControlPoints out;
    if (const scene::Value* p = primitive.primvars.find("P"); p && !p->floats.empty()) {
        const size_t n = p->floats.size() / 3;
        out.xyz.resize(n * 3);
        const float* in = p->floats.data();
        tasks::parallel_chunks(n, 1 << 16, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                const Vec3f r = m.point({in[3 * i], in[3 * i + 1], in[3 * i + 2]});
                out.xyz[3 * i] = r.x, out.xyz[3 * i + 1] = r.y, out.xyz[3 * i + 2] = r.z;
            }
        });
    } else if (const scene::Value* pw = primitive.primvars.find("Pw"); pw && !pw->floats.empty()) {
        const size_t n = pw->floats.size() / 4;
        out.xyz.resize(n * 3);
        out.weights.resize(n);
        for (size_t i = 0; i < n; i++) {
            const float* q = pw->floats.data() + 4 * i;
            for (int r = 0; r < 3; r++)
                out.xyz[3 * i + r] =
                    float(m.m[r][0] * q[0] + m.m[r][1] * q[1] + m.m[r][2] * q[2] + m.m[r][3] * q[3]);
            out.weights[i] = q[3];
        }
    }
    return out;
}

void Dropped::report(size_t total, std::string_view what, const Location& where, Journal& journal) const {
    const auto say = [&](size_t n, const char* why) {
        if (n > 0)
            journal.warning(where, std::to_string(n) + " of " + std::to_string(total) + " " +
                                       std::string(what) + " " + why + " and were left out");
    };
    say(non_finite, "have positions that are not finite, or farther than 1e18,");
    say(bad_index, "have vertex indices or counts out of range");
    say(degenerate, "have no area");
    say(copies, "have the vertices of another one");
}

std::unique_ptr<Surface> make_surface(const scene::Primitive& primitive, const Transform& m, Journal& journal,
                                      SurfaceHints hints) {
    const auto make = [&](const auto& geometry) -> std::unique_ptr<Surface> {
        using G = std::decay_t<decltype(geometry)>;
        if constexpr (std::is_same_v<G, scene::PolygonMesh>)
            return make_polygons(primitive, geometry, m, journal, hints);
        else if constexpr (std::is_same_v<G, scene::SubdivisionMesh>)
            return make_subdivision(primitive, geometry, m, journal, hints);
        else if constexpr (std::is_same_v<G, scene::PatchMesh>)
            return make_patch_mesh(primitive, geometry, m, journal);
        else if constexpr (std::is_same_v<G, scene::NuPatch>)
            return make_nupatch(primitive, geometry, m, journal);
        else if constexpr (std::is_same_v<G, scene::Quadric>)
            return make_quadric(primitive, geometry, m, journal, hints);
        else
            return nullptr;
    };
    return std::visit(make, primitive.geometry);
}

} // namespace kanuka::geom
