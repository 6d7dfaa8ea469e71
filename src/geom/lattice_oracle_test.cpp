// Patches, NURBS and quadrics against what defines them, in double and written apart: places, derivatives,
// normals and data, over whole faces, small parts of them, single lines and collapsed sides.
#include "geom/test_lattices.h"

namespace kanuka::geom {
namespace {

using namespace testing;

// ---- bases, by their polynomials (RenderMan Interface 3.2, 5.3)

std::array<double, 4> weights_of(const std::string& basis, double t) {
    const double s = 1 - t;
    if (basis == "bezier")
        return {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    if (basis == "b-spline")
        return {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6,
                t * t * t / 6};
    if (basis == "catmull-rom")
        return {-t * s * s / 2, (3 * t * t * t - 5 * t * t + 2) / 2, (3 * s * s * s - 5 * s * s + 2) / 2,
                -s * t * t / 2};
    if (basis == "hermite")
        return {(1 + 2 * t) * s * s, t * s * s, t * t * (3 - 2 * t), -t * t * s};
    return {t * t * t, t * t, t, 1}; // power
}
int step_of(const std::string& basis) {
    return basis == "bezier" ? 3 : basis == "hermite" ? 2 : basis == "power" ? 4 : 1;
}

double linear(double a, double b, double c, double d, double u, double v) {
    return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
}

struct Net {
    std::string basis_u, basis_v; // "" = bilinear
    int nu, nv;
    bool wrap_u = false, wrap_v = false, rational = false;
};

void expect_net(const Net& net, const Transform& m, uint32_t seed) {
    Random random(seed);
    const int order = net.basis_u.empty() ? 2 : 4, step_u = order == 2 ? 1 : step_of(net.basis_u),
              step_v = order == 2 ? 1 : step_of(net.basis_v);
    const int faces_u = net.wrap_u ? net.nu / step_u : (net.nu - order) / step_u + 1,
              faces_v = net.wrap_v ? net.nv / step_v : (net.nv - order) / step_v + 1;
    const int corners_u = faces_u + (net.wrap_u ? 0 : 1), corners_v = faces_v + (net.wrap_v ? 0 : 1);
    const size_t points = size_t(net.nu) * size_t(net.nv), width = net.rational ? 4 : 3;
    std::vector<float> p = random.some(width * points);
    for (size_t i = 0; i < points; i++) { // a sheet with bumps, so that normals are certain
        const double x = double(i % size_t(net.nu)), y = double(i / size_t(net.nu));
        float* q = &p[width * i];
        q[0] = float(x) + 0.2f * q[0], q[1] = float(y) + 0.2f * q[1];
        if (net.rational) {
            q[3] = 1 + 0.3f * q[3];
            for (int c = 0; c < 3; c++)
                q[c] *= q[3];
        }
    }
    const std::vector<float> vertex = random.some(points), uniform = random.some(size_t(faces_u * faces_v)),
                             varying = random.some(size_t(corners_u * corners_v));
    scene::PatchMesh mesh;
    mesh.nu = net.nu, mesh.nv = net.nv, mesh.u_periodic = net.wrap_u, mesh.v_periodic = net.wrap_v;
    mesh.cubic = order == 4;
    if (mesh.cubic)
        mesh.u_basis = scene::basis_by_name(net.basis_u), mesh.v_basis = scene::basis_by_name(net.basis_v);
    scene::Primitive primitive;
    primitive.geometry = mesh;
    primitive.attributes = with_corners();
    primitive.primvars.set(net.rational ? value("Pw", Type::HPoint, Detail::Vertex, p)
                                        : value("P", Type::Point, Detail::Vertex, p));
    primitive.primvars.set(value("a", Type::Float, Detail::Vertex, vertex));
    primitive.primvars.set(value("b", Type::Float, Detail::Uniform, uniform));
    primitive.primvars.set(value("c", Type::Float, Detail::Varying, varying));
    const auto surface = make(primitive, m);
    ASSERT_TRUE(surface);
    ASSERT_EQ(surface->faces(), faces_u * faces_v);
    const auto weights = [=](const std::string& basis, double t) {
        return order == 4 ? weights_of(basis, t) : std::array<double, 4>{1 - t, t, 0, 0};
    };
    for (int f = 0; f < faces_u * faces_v; f++) {
        const int i0 = f % faces_u, j0 = f / faces_u;
        const auto blend = [=](double u, double v, const std::vector<float>& from, size_t width, size_t c) {
            const auto wu = weights(net.basis_u, u), wv = weights(net.basis_v, v);
            double sum = 0;
            for (int j = 0; j < order; j++)
                for (int i = 0; i < order; i++) {
                    const size_t at = size_t((j0 * step_v + j) % net.nv) * size_t(net.nu) +
                                      size_t((i0 * step_u + i) % net.nu);
                    sum += wu[size_t(i)] * wv[size_t(j)] * double(from[width * at + c]);
                }
            return sum;
        };
        Expected e;
        e.u0 = double(i0) / faces_u, e.u1 = double(i0 + 1) / faces_u;
        e.v0 = double(j0) / faces_v, e.v1 = double(j0 + 1) / faces_v;
        e.place = [=, &p, &m](double u, double v) {
            const double w = net.rational ? blend(u, v, p, 4, 3) : 1;
            Place q;
            for (size_t r = 0; r < 3; r++) {
                q[r] = m.m[r][3];
                for (size_t c = 0; c < 3; c++)
                    q[r] += m.m[r][c] * blend(u, v, p, width, c) / w;
            }
            return q;
        };
        e.data = {[=, &vertex](double u, double v) { return blend(u, v, vertex, 1, 0); },
                  [=, &uniform](double, double) { return double(uniform[size_t(f)]); },
                  [=, &varying](double u, double v) {
                      const auto at = [&](int di, int dj) {
                          return double(
                              varying[size_t((j0 + dj) % corners_v * corners_u + (i0 + di) % corners_u)]);
                      };
                      return linear(at(0, 0), at(1, 0), at(0, 1), at(1, 1), u, v);
                  }};
        expect_face(*surface, f, e, net.basis_u + " x " + net.basis_v);
    }
}

// ---- B-splines, by their definition (Cox and de Boor), on one span

double spline(const std::vector<float>& knots, int span, int i, int degree, double x) {
    if (degree == 0)
        return i == span;
    const auto part = [&](double numerator, int a, int b, int of) {
        const double d = double(knots[size_t(b)]) - double(knots[size_t(a)]);
        return d > 0 ? numerator / d * spline(knots, span, of, degree - 1, x) : 0.0;
    };
    return part(x - double(knots[size_t(i)]), i, i + degree, i) +
           part(double(knots[size_t(i + degree + 1)]) - x, i + 1, i + degree + 1, i + 1);
}

void expect_nurbs(const scene::NuPatch& patch, bool rational, const Transform& m, uint32_t seed) {
    Random random(seed);
    const size_t points = size_t(patch.nu * patch.nv), width = rational ? 4 : 3;
    std::vector<float> p = random.some(width * points);
    for (size_t i = 0; i < points; i++) {
        float* q = &p[width * i];
        q[0] = float(i % size_t(patch.nu)) + 0.2f * q[0], q[1] = float(i / size_t(patch.nu)) + 0.2f * q[1];
        if (rational) {
            q[3] = 1 + 0.3f * q[3];
            for (int c = 0; c < 3; c++)
                q[c] *= q[3];
        }
    }
    const std::vector<float> ku(patch.u_knots.begin(), patch.u_knots.end()),
        kv(patch.v_knots.begin(), patch.v_knots.end());
    struct Span {
        int knot, segment;            // of all intervals, also of those of no length: RISpec, NuPatch
        double from, to, first, last; // the last two: of the whole interval
    };
    const auto spans = [](const std::vector<float>& k, int count, int order, double lo, double hi,
                          int& segments) {
        std::vector<Span> all;
        segments = 0;
        for (int i = order - 1; i < count; i++) {
            const double first = double(k[size_t(i)]), last = double(k[size_t(i + 1)]);
            const double a = std::max(lo, first), b = std::min(hi, last);
            if (b > a)
                all.push_back({i, segments, a, b, first, last});
            segments++;
        }
        return all;
    };
    int segments_u, segments_v;
    const auto us = spans(ku, patch.nu, patch.u_order, double(patch.u_min), double(patch.u_max), segments_u),
               vs = spans(kv, patch.nv, patch.v_order, double(patch.v_min), double(patch.v_max), segments_v);
    const std::vector<float> vertex = random.some(points),
                             uniform = random.some(size_t(segments_u * segments_v)),
                             varying = random.some(size_t((segments_u + 1) * (segments_v + 1)));
    scene::Primitive primitive;
    primitive.geometry = patch;
    primitive.attributes = with_corners();
    primitive.primvars.set(rational ? value("Pw", Type::HPoint, Detail::Vertex, p)
                                    : value("P", Type::Point, Detail::Vertex, p));
    primitive.primvars.set(value("a", Type::Float, Detail::Vertex, vertex));
    primitive.primvars.set(value("b", Type::Float, Detail::Uniform, uniform));
    primitive.primvars.set(value("c", Type::Float, Detail::Varying, varying));
    const auto surface = make(primitive, m);
    ASSERT_TRUE(surface);
    ASSERT_EQ(surface->faces(), int(us.size() * vs.size()));
    for (int f = 0; f < surface->faces(); f++) {
        const Span a = us[size_t(f) % us.size()], b = vs[size_t(f) / us.size()];
        const auto blend = [=, &ku, &kv, &patch](double u, double v, const std::vector<float>& from,
                                                 size_t width, size_t c) {
            const double x = a.from + (a.to - a.from) * u, y = b.from + (b.to - b.from) * v;
            double sum = 0;
            for (int j = b.knot - patch.v_order + 1; j <= b.knot; j++)
                for (int i = a.knot - patch.u_order + 1; i <= a.knot; i++)
                    sum += spline(ku, a.knot, i, patch.u_order - 1, x) *
                           spline(kv, b.knot, j, patch.v_order - 1, y) *
                           double(from[width * size_t(j * patch.nu + i) + c]);
            return sum;
        };
        const double lo_u = us.front().from, lo_v = vs.front().from, wu = us.back().to - lo_u,
                     wv = vs.back().to - lo_v;
        Expected e;
        e.u0 = (a.from - lo_u) / wu, e.u1 = (a.to - lo_u) / wu;
        e.v0 = (b.from - lo_v) / wv, e.v1 = (b.to - lo_v) / wv;
        e.place = [=, &p, &m](double u, double v) {
            const double w = rational ? blend(u, v, p, 4, 3) : 1;
            Place q;
            for (size_t r = 0; r < 3; r++) {
                q[r] = m.m[r][3];
                for (size_t c = 0; c < 3; c++)
                    q[r] += m.m[r][c] * blend(u, v, p, width, c) / w;
            }
            return q;
        };
        e.data = {[=, &vertex](double u, double v) { return blend(u, v, vertex, 1, 0); },
                  [=, &uniform](double, double) {
                      return double(uniform[size_t(b.segment * segments_u + a.segment)]);
                  },
                  [=, &varying](double u, double v) {
                      const auto at = [&](int di, int dj) {
                          return double(
                              varying[size_t((b.segment + dj) * (segments_u + 1) + a.segment + di)]);
                      };
                      const auto of_whole = [](const Span& s, double t) {
                          return (s.from + (s.to - s.from) * t - s.first) / (s.last - s.first);
                      };
                      return linear(at(0, 0), at(1, 0), at(0, 1), at(1, 1), of_whole(a, u), of_whole(b, v));
                  }};
        expect_face(*surface, f, e, "NURBS");
        // By parameters of the whole, as trim curves ask.
        const Place q = e.place(0.3, 0.6);
        const Vec3f at = surface->at_parameters(e.u0 + (e.u1 - e.u0) * 0.3, e.v0 + (e.v1 - e.v0) * 0.6);
        for (int c = 0; c < 3; c++)
            EXPECT_NEAR(at[c], q[size_t(c)], 2e-5);
    }
}

// ---- quadrics, by their equations (RenderMan Interface 3.2, 5.4)

Place quadric_place(const scene::Quadric& q, double u, double v) {
    using K = scene::Quadric::Kind;
    const std::vector<float>& f = q.arguments;
    const auto a = [&](size_t i) { return double(f[i]); };
    const double degree = std::acos(-1.0) / 180, theta = a(f.size() - 1) * degree * u;
    double x = 0, y = 0, z = 0;
    switch (q.kind) {
    case K::Sphere: {
        const double lo = std::asin(std::max(a(1) / a(0), -1.0)), hi = std::asin(std::min(a(2) / a(0), 1.0));
        x = a(0) * std::cos(lo + v * (hi - lo)), z = a(0) * std::sin(lo + v * (hi - lo));
        break;
    }
    case K::Cone:
        x = a(1) * (1 - v), z = a(0) * v;
        break;
    case K::Cylinder:
        x = a(0), z = a(1) + v * (a(2) - a(1));
        break;
    case K::Hyperboloid:
        x = a(0) * (1 - v) + a(3) * v, y = a(1) * (1 - v) + a(4) * v, z = a(2) * (1 - v) + a(5) * v;
        break;
    case K::Paraboloid:
        z = a(1) + v * (a(2) - a(1)), x = a(0) * std::sqrt(z / a(2));
        break;
    case K::Disk:
        x = a(1) * (1 - v), z = a(0);
        break;
    case K::Torus: {
        const double phi = (a(2) + v * (a(3) - a(2))) * degree;
        x = a(0) + a(1) * std::cos(phi), z = a(1) * std::sin(phi);
        break;
    }
    }
    const double c = std::cos(theta), s = std::sin(theta);
    return {x * c - y * s, x * s + y * c, z};
}

const Transform Turned =
    Transform::translate(1, -2, 3) * Transform::rotate(40, 1, 2, 3) * Transform::scale(1, 1.5f, 0.8f);
const Transform Mirrored = Turned * Transform::scale(1, 1, -1);

} // namespace

TEST(LatticeOracles, PatchesOfEveryBasis) {
    const Net nets[] = {{"bezier", "b-spline", 7, 5},
                        {"b-spline", "bezier", 6, 4, true, false},
                        {"catmull-rom", "hermite", 5, 6},
                        {"hermite", "catmull-rom", 8, 5, false, true},
                        {"power", "bezier", 8, 4},
                        {"bezier", "power", 6, 4, true, false},
                        {"", "", 4, 3},
                        {"", "", 5, 4, true, true},
                        {"bezier", "catmull-rom", 7, 6, false, true, true},
                        {"b-spline", "b-spline", 5, 6, true, false, true}};
    uint32_t seed = 1;
    for (const Net& net : nets) {
        expect_net(net, Turned, seed++);
        expect_net(net, Mirrored, seed++);
    }
}

TEST(LatticeOracles, Nurbs) {
    scene::NuPatch patch;
    patch.nu = 7, patch.u_order = 4, patch.nv = 5, patch.v_order = 3;
    patch.u_knots = std::vector<float>{0, 0, 0, 0, 1, 1, 2.5f, 4, 4, 4, 4};
    patch.v_knots = std::vector<float>{-1, 0, 0.5f, 2, 3, 3.25f, 4, 5};
    patch.u_min = 0, patch.u_max = 4, patch.v_min = 0.5f, patch.v_max = 3.25f;
    for (const bool rational : {false, true}) {
        expect_nurbs(patch, rational, Turned, rational ? 11 : 12);
        expect_nurbs(patch, rational, Mirrored, rational ? 13 : 14);
    }
    patch.nu = 7, patch.u_order = 5, patch.nv = 2, patch.v_order = 2;
    patch.u_knots = std::vector<float>{0, 0, 0, 0, 0, 1, 1.5f, 3, 3, 3, 3, 3};
    patch.v_knots = std::vector<float>{2, 2, 3, 3};
    patch.u_max = 3, patch.v_min = 2, patch.v_max = 3;
    expect_nurbs(patch, true, Turned, 15);
}

TEST(LatticeOracles, Quadrics) {
    using K = scene::Quadric::Kind;
    for (const auto& q : std::vector<scene::Quadric>{{K::Sphere, {2, -1.5f, 1.9f, 300}},
                                                     {K::Sphere, {1.5f, -2, 2, 360}},
                                                     {K::Cone, {2, 1, 250}},
                                                     {K::Cylinder, {1, -1, 1.5f, -120}},
                                                     {K::Hyperboloid, {1, 0.5f, 0, 0.2f, 1, 2, 360}},
                                                     {K::Hyperboloid, {1, -0.5f, 0.3f, 1.2f, 0.4f, 2, -80}},
                                                     {K::Paraboloid, {1, 0.1f, 2, 360}},
                                                     {K::Disk, {0.4f, 1, 170}},
                                                     {K::Torus, {2, 0.7f, 10, 300, 360}},
                                                     {K::Torus, {2, 0.7f, 200, -30, -200}}})
        for (const Transform& m : {Turned, Mirrored}) {
            scene::Primitive primitive;
            primitive.geometry = q;
            primitive.attributes = with_corners();
            const std::vector<float> varying{0.3f, -1.2f, 2.5f, 0.9f};
            primitive.primvars.set(value("a", Type::Float, Detail::Varying, varying));
            primitive.primvars.set(value("b", Type::Float, Detail::Uniform, {4.5f}));
            const auto surface = make(primitive, m);
            ASSERT_TRUE(surface);
            const int nu = int(std::ceil(std::abs(q.arguments.back()) / 90)), nv = surface->faces() / nu;
            ASSERT_EQ(nu * nv, surface->faces());
            for (int f = 0; f < surface->faces(); f++) {
                Expected e;
                const int i = f % nu, j = f / nu;
                e.u0 = double(i) / nu, e.u1 = double(i + 1) / nu, e.v0 = double(j) / nv,
                e.v1 = double(j + 1) / nv;
                const auto whole_u = [=](double u) { return e.u0 + (e.u1 - e.u0) * u; };
                const auto whole_v = [=](double v) { return e.v0 + (e.v1 - e.v0) * v; };
                e.place = [=, &q, &m](double u, double v) {
                    const Place p = quadric_place(q, whole_u(u), whole_v(v));
                    Place r;
                    for (size_t k = 0; k < 3; k++)
                        r[k] = m.m[k][0] * p[0] + m.m[k][1] * p[1] + m.m[k][2] * p[2] + m.m[k][3];
                    return r;
                };
                e.data = {[=](double u, double v) {
                              return linear(double(varying[0]), double(varying[1]), double(varying[2]),
                                            double(varying[3]), whole_u(u), whole_v(v));
                          },
                          [](double, double) { return 4.5; }};
                expect_face(*surface, f, e, "quadric " + std::to_string(int(q.kind)), 2e-3);
            }
        }
}

// A cap whose side k is one point has the normal of what lies beside it, along all of that side.
TEST(LatticeOracles, NormalsOfCollapsedSides) {
    for (int side = 0; side < 4; side++) {
        scene::PatchMesh mesh;
        mesh.u_basis = mesh.v_basis = scene::basis_by_name("bezier");
        std::vector<float> p;
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++) {
                const int from = side == 0 ? j : side == 1 ? 3 - i : side == 2 ? 3 - j : i;
                const float along = float(side % 2 ? j : i) - 1.5f, r = float(from);
                p.insert(p.end(), {along * r, r * 2, 0.2f * along * r * r});
            }
        scene::Primitive primitive = geom::testing::primitive(mesh, p);
        primitive.attributes = with_corners();
        const auto surface = make(primitive);
        const auto& face = surface->topology().faces[0];
        for (int k = 0; k < 4; k++)
            EXPECT_EQ(surface->topology().edges[size_t(face.sides[size_t(k)].edge)].point, k == side);
        Expected e;
        e.place = [&](double u, double v) {
            const auto wu = weights_of("bezier", u), wv = weights_of("bezier", v);
            Place q{};
            for (size_t k = 0; k < 16; k++)
                for (size_t c = 0; c < 3; c++)
                    q[c] += wu[k % 4] * wv[k / 4] * double(p[3 * k + c]);
            return q;
        };
        expect_face(*surface, 0, e, "side " + std::to_string(side), 5e-3);
    }
}

} // namespace kanuka::geom
