// Differences to the neighbours on meshes, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/tasks.h"
#include "dice/test_scene.h"
#include "grid/mesh_patches.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

// All vertices of a mesh, each with the differences of a function of position along u and along v.
struct Differences {
    std::vector<float> u, v, step_u, step_v;
};
template <class F>
Differences differences(const Diced& d, F f, int rings = 1) {
    const grid::Grid& g = d.mesh_vertices;
    const grid::MeshPatches patches(g, d.mesh, d.mesh_rest.empty() ? g.P : d.mesh_rest, rings);
    const size_t n = size_t(g.vertices());
    Differences out{std::vector<float>(n, NAN), std::vector<float>(n, NAN), std::vector<float>(n, NAN),
                    std::vector<float>(n, NAN)};
    for (size_t k = 0; k < patches.count(); k++) {
        grid::Grid patch;
        std::vector<uint32_t> vertices;
        patches.cut(k, patch, vertices);
        const grid::Stencils& s = *patch.stencils;
        std::vector<float> x;
        for (int i = 0; i < patch.vertices(); i++)
            x.push_back(f(patch, i));
        for (size_t i = 0; i < size_t(s.own); i++) {
            double du = 0, dv = 0;
            for (uint32_t e = s.first[i]; e < s.first[i + 1]; e++) {
                du += double(s.along_u[e]) * double(x[s.vertex[e]] - x[i]);
                dv += double(s.along_v[e]) * double(x[s.vertex[e]] - x[i]);
            }
            EXPECT_TRUE(std::isnan(out.u[vertices[i]])); // every vertex is in one patch
            out.u[vertices[i]] = float(du), out.v[vertices[i]] = float(dv);
            out.step_u[vertices[i]] = s.step_u[i], out.step_v[vertices[i]] = s.step_v[i];
        }
    }
    for (const float x : out.u)
        EXPECT_TRUE(std::isfinite(x));
    for (const float x : out.v)
        EXPECT_TRUE(std::isfinite(x));
    return out;
}

DiceTarget neighbours() {
    DiceTarget t;
    t.shading = {false, false, true, 1};
    return t;
}

Diced run(const scene::Primitive& p, const DiceTarget& target, const DiceOptions& options = looking(50, 64)) {
    Journal journal;
    Diced d = dice::dice(p, target, options, {}, journal);
    EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
    EXPECT_TRUE(d.is_mesh);
    return d;
}

// n x m squares of 2 by 3 in the plane z = x; corners in the order of (u, v) = (0,0), (1,0), (1,1), (0,1).
constexpr int N = 30;
scene::Primitive lattice(int sides, float jitter = 0) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> d(-jitter, jitter);
    std::vector<float> p;
    std::vector<int32_t> v, sizes;
    for (int j = 0; j <= N; j++)
        for (int i = 0; i <= N; i++) {
            const float x = 0.02f * (float(i) + d(random)), y = 0.03f * (float(j) + d(random));
            p.insert(p.end(), {x, y, x});
        }
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            const int a = j * (N + 1) + i, b = a + 1, c = b + N + 1, e = a + N + 1;
            if (sides == 4)
                v.insert(v.end(), {a, b, c, e}), sizes.push_back(4);
            else
                v.insert(v.end(), {a, b, c, a, c, e}), sizes.insert(sizes.end(), {3, 3});
        }
    scene::PolygonMesh m;
    m.vertices_per_loop = sizes;
    m.vertices = v;
    return primitive(m, p);
}

float x_of(const grid::Grid& g, int i) {
    return g.position(i).x;
}
float y_of(const grid::Grid& g, int i) {
    return g.position(i).y;
}

} // namespace

// What a grid's central differences give: one cell along each side, at corners and borders too.
TEST(MeshDerivatives, OfALatticeAreThoseOfAGrid) {
    const Diced d = run(lattice(4), neighbours());
    const Differences x = differences(d, x_of), y = differences(d, y_of);
    for (size_t i = 0; i < x.u.size(); i++) {
        EXPECT_NEAR(x.u[i], 0.02, 2e-6);
        EXPECT_NEAR(x.v[i], 0, 2e-6);
        EXPECT_NEAR(y.u[i], 0, 2e-6);
        EXPECT_NEAR(y.v[i], 0.03, 3e-6);
        EXPECT_NEAR(x.step_u[i], 1, 1e-4); // u runs once over each face
        EXPECT_NEAR(x.step_v[i], 1, 1e-4);
    }
    // Of second order inside: exact for squares of coordinates.
    const Differences q = differences(d, [](const grid::Grid& g, int i) {
        const Vec3f p = g.position(i);
        return p.x * p.x + p.y * p.x;
    });
    for (int j = 1; j < N; j++)
        for (int i = 1; i < N; i++) {
            const double px = 0.02 * i, py = 0.03 * j;
            EXPECT_NEAR(q.u[size_t(j * (N + 1) + i)], 0.02 * (2 * px + py), 2e-6);
            EXPECT_NEAR(q.v[size_t(j * (N + 1) + i)], 0.03 * px, 2e-6);
        }
}

// Quads that were two triangles each, and triangles that stay such, whatever their first corner.
TEST(MeshDerivatives, OfTriangles) {
    for (const bool shuffled : {false, true}) {
        scene::Primitive p = lattice(3);
        if (shuffled) { // no two neighbours in a row
            auto m = std::get<scene::PolygonMesh>(p.geometry);
            std::vector<int32_t> v(m.vertices.begin(), m.vertices.end());
            std::mt19937 random(3);
            for (size_t t = v.size() / 3; t-- > 1;) {
                const size_t other = random() % (t + 1);
                std::swap_ranges(&v[3 * t], &v[3 * t] + 3,
                                 &v[3 * other] == &v[3 * t] ? &v[3 * t] : &v[3 * other]);
            }
            m.vertices = v;
            p.geometry = m;
        }
        const Diced d = run(p, neighbours());
        EXPECT_EQ(d.mesh.vertices_per_face, shuffled ? 3 : 4);
        const Differences x = differences(d, x_of), y = differences(d, y_of);
        double area = 0;
        for (size_t i = 0; i < x.u.size(); i++)
            area += std::abs(double(x.u[i]) * y.v[i] - double(x.v[i]) * y.u[i]);
        // A vertex stands for one square: two triangles.
        EXPECT_NEAR(area / double(x.u.size()), 0.02 * 0.03, 1e-2 * 0.02 * 0.03);
        // The differences are those of a linear function, so along dPdu and dPdv they follow from the steps.
        const grid::Grid& g = d.mesh_vertices;
        const size_t n = size_t(g.stride);
        for (size_t i = 0; i < x.u.size(); i++) {
            EXPECT_NEAR(x.u[i], double(g.dPdu[i]) * x.step_u[i], 1e-6);
            EXPECT_NEAR(x.v[i], double(g.dPdv[i]) * x.step_v[i], 1e-6);
            EXPECT_NEAR(y.u[i], double(g.dPdu[i + n]) * x.step_u[i], 1e-6);
            EXPECT_NEAR(y.v[i], double(g.dPdv[i + n]) * x.step_v[i], 1e-6);
        }
    }
}

// Irregular rings: linear functions exactly, others but for what Taylor's second term leaves where a ring is
// lopsided: max|f''| / 2 d^2 = 0.018 for edges d of 0.038 if it were all on one side. The oracle is the
// analytic gradient.
TEST(MeshDerivatives, OfIrregularMeshes) {
    for (const int sides : {3, 4}) {
        const Diced d = run(lattice(sides, 0.3f), neighbours());
        const auto f = [](double x, double y) { return std::sin(4 * x) * std::cos(3 * y); };
        const Differences x = differences(d, x_of), y = differences(d, y_of),
                          l = differences(d, [](const grid::Grid& g,
                                                int i) { return 3 * g.position(i).x - 2 * g.position(i).y; }),
                          s = differences(d, [&](const grid::Grid& g, int i) {
                              return float(f(double(g.position(i).x), double(g.position(i).y)));
                          });
        double wrong = 0, all = 0;
        for (int j = 1; j < N; j++)
            for (int i = 1; i < N; i++) {
                const size_t k = size_t(j * (N + 1) + i);
                const Vec3f p = d.mesh_vertices.position(int(k));
                const double fx = 4 * std::cos(4 * double(p.x)) * std::cos(3 * double(p.y)),
                             fy = -3 * std::sin(4 * double(p.x)) * std::sin(3 * double(p.y));
                EXPECT_NEAR(s.u[k], fx * double(x.u[k]) + fy * double(y.u[k]), 0.018 / 3);
                EXPECT_NEAR(s.v[k], fx * double(x.v[k]) + fy * double(y.v[k]), 0.018 / 3);
                const double expected = fx * double(x.u[k]) + fy * double(y.u[k]);
                wrong += (double(s.u[k]) - expected) * (double(s.u[k]) - expected);
                all += expected * expected;
                EXPECT_NEAR(l.u[k], 3 * double(x.u[k]) - 2 * double(y.u[k]), 1e-6);
                EXPECT_NEAR(l.v[k], 3 * double(x.v[k]) - 2 * double(y.v[k]), 1e-6);
            }
        EXPECT_LT(std::sqrt(wrong / all), 0.03);
    }
}

// u and v that are read are those of each face, at vertices of its own.
TEST(MeshDerivatives, ParametersOfFaces) {
    DiceTarget t = neighbours();
    t.shading.parameters = true;
    const Diced d = run(lattice(4), t);
    EXPECT_EQ(d.mesh_vertices.vertices(), N * N * 4);
    const Differences u = differences(d, [](const grid::Grid& g, int i) { return g.u[size_t(i)]; }),
                      v = differences(d, [](const grid::Grid& g, int i) { return g.v[size_t(i)]; }),
                      x = differences(d, x_of);
    for (size_t i = 0; i < u.u.size(); i++) {
        EXPECT_NEAR(u.u[i], 1, 1e-4);
        EXPECT_NEAR(u.v[i], 0, 1e-4);
        EXPECT_NEAR(v.u[i], 0, 1e-4);
        EXPECT_NEAR(v.v[i], 1, 1e-4);
        EXPECT_NEAR(x.u[i], 0.02, 2e-6);
    }
    for (size_t f = 0; f < size_t(N * N); f++) {
        double sum = 0;
        for (int k = 0; k < 4; k++)
            sum += double(d.mesh_vertices.u[d.mesh.indices[4 * f + size_t(k)]]);
        EXPECT_EQ(sum, 2);
    }
    EXPECT_EQ(run(lattice(4), neighbours()).mesh_vertices.vertices(), (N + 1) * (N + 1));
}

// A seam in the data: each side by itself, nothing across.
TEST(MeshDerivatives, StopAtSeams) {
    scene::Primitive p = lattice(4);
    const auto& m = std::get<scene::PolygonMesh>(p.geometry);
    const auto& points = p.primvars.find("P")->floats;
    std::vector<float> st;
    for (size_t c = 0; c < m.vertices.size(); c++) {
        const int32_t i = m.vertices[c];
        st.insert(st.end(), {points[size_t(3 * i)] + (int(c / 4) % N >= N / 2 ? 100.0f : 0.0f),
                             points[size_t(3 * i) + 1]});
    }
    p.primvars.set(floats("st", Type::Float, Detail::FaceVarying, st, 2));
    const Differences s =
        differences(run(p, neighbours()), [](const grid::Grid& g, int i) { return g.s[size_t(i)]; });
    for (size_t i = 0; i < s.u.size(); i++) {
        EXPECT_NEAR(s.u[i], 0.02, 1e-4);
        EXPECT_NEAR(s.v[i], 0, 1e-4);
    }
}

// Triangles of no area, faces alone, vertices of no face, a fan that is one line: something defined.
TEST(MeshDerivatives, OfBadFaces) {
    std::vector<float> p;
    std::vector<int32_t> v, sizes;
    for (int k = 0; k < 12; k++) { // of its own, each turned and moved
        const float a = 0.5f * float(k), x = 0.1f * float(k);
        for (const auto& [cx, cy] : {std::pair{0.0f, 0.0f}, {0.04f, 0.0f}, {0.0f, 0.02f}})
            p.insert(p.end(),
                     {x + cx * std::cos(a) - cy * std::sin(a), cx * std::sin(a) + cy * std::cos(a), 0});
        v.insert(v.end(), {3 * k, 3 * k + 1, 3 * k + 2});
        sizes.push_back(3);
    }
    p.insert(p.end(), {5, 5, 5}); // nobody's
    for (const auto& t : {std::array{0, 0, 1}, std::array{3, 4, 4}, std::array{6, 7, 6}}) {
        v.insert(v.end(), t.begin(), t.end());
        sizes.push_back(3);
    }
    scene::PolygonMesh m;
    m.vertices_per_loop = sizes;
    m.vertices = v;
    Journal journal;
    const Diced d = dice::dice(primitive(m, p), neighbours(), looking(100, 10), {}, journal);
    ASSERT_TRUE(d.is_mesh);
    const Differences x = differences(d, x_of), y = differences(d, y_of);
    EXPECT_EQ(x.u[36], 0);
    for (size_t i = 0; i < 36; i++) // twice the triangle
        EXPECT_NEAR(std::abs(x.u[i] * y.v[i] - x.v[i] * y.u[i]), 0.04 * 0.02, 1e-6);
}

// Where the whole surface has one u and v, they are its own; a closed one has a seam.
TEST(MeshDerivatives, OfASurfaceOfItsOwnParameters) {
    constexpr int M = 40;
    scene::NuPatch m{};
    m.nu = M + 2, m.nv = M, m.u_order = 3, m.v_order = 2; // closed: a quadratic spline over M knots
    std::vector<float> p, ku, kv;
    for (int k = 0; k < M + 5; k++)
        ku.push_back(float(k - 2));
    for (int k = 0; k < M + 2; k++)
        kv.push_back(float(std::clamp(k - 1, 0, M - 1)));
    m.u_knots = ku, m.v_knots = kv;
    m.u_min = 0, m.u_max = float(M), m.v_min = 0, m.v_max = float(M - 1);
    for (int j = 0; j < M; j++)
        for (int i = 0; i < M + 2; i++) {
            const float a = 2 * Pi * float(i) / float(M);
            p.insert(p.end(), {std::cos(a), std::sin(a), 2 * float(j) / float(M - 1) - 1});
        }
    const Diced d = run(primitive(m, p), neighbours(), looking(10, 20));
    const Differences u = differences(d, [](const grid::Grid& g, int i) { return g.u[size_t(i)]; }),
                      v = differences(d, [](const grid::Grid& g, int i) { return g.v[size_t(i)]; });
    EXPECT_EQ(d.mesh_vertices.vertices(), (M + 1) * M);
    for (size_t i = 0; i < u.u.size(); i++) {
        EXPECT_NEAR(u.u[i], 1.0 / M, 1e-3 / M);
        EXPECT_NEAR(u.v[i], 0, 1e-3 / M);
        EXPECT_NEAR(v.v[i], 1.0 / (M - 1), 1e-3 / M);
        EXPECT_NEAR(u.step_u[i], 1.0 / M, 1e-2 / M);
        EXPECT_NEAR(v.step_v[i], 1.0 / (M - 1), 1e-2 / M);
    }
}

// Displacement that looks at its neighbours, and a bound on what lies between patches: any number of them
// gives the same vertices as one.
TEST(MeshDerivatives, DisplacedPatchByPatch) {
    constexpr int Side = 150; // six patches
    std::vector<float> p;
    std::vector<int32_t> v;
    for (int j = 0; j <= Side; j++)
        for (int i = 0; i <= Side; i++)
            p.insert(p.end(), {0.01f * float(i), 0.01f * float(j), 0});
    for (int j = 0; j < Side; j++)
        for (int i = 0; i < Side; i++) {
            const int a = j * (Side + 1) + i;
            v.insert(v.end(), {a, a + 1, a + Side + 2, a + Side + 1});
        }
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>(size_t(Side * Side), 4);
    m.vertices = v;
    DiceTarget t;
    t.displacing.rings = 2;
    t.shading.rings = 1;
    // z = Du(Du(x^3)) / step^2 = 6 x inside: two differences, one of the other.
    const Displace twice = [](grid::Grid& g) {
        const grid::Stencils& s = *g.stencils;
        std::vector<float> x(size_t(g.vertices())), d(x.size());
        for (size_t i = 0; i < x.size(); i++)
            x[i] = g.P[i] * g.P[i] * g.P[i];
        for (int round = 0; round < 2; round++) {
            for (size_t i = 0; i < x.size(); i++) {
                d[i] = 0;
                for (uint32_t k = s.first[i]; k < s.first[i + 1]; k++)
                    d[i] += s.along_u[k] * (x[s.vertex[k]] - x[i]);
            }
            x = d;
        }
        for (size_t i = 0; i < x.size(); i++)
            g.P[i + 2 * size_t(g.stride)] = x[i] * 1e4f;
    };
    Diced by_threads[2];
    for (const int threads : {1, 3}) {
        Journal journal;
        tasks::with_threads(threads, [&] {
            by_threads[threads / 3] = dice::dice(primitive(m, p), t, looking(50, 64), twice, journal);
        });
    }
    const grid::Grid& g = by_threads[0].mesh_vertices;
    EXPECT_EQ(g.P, by_threads[1].mesh_vertices.P);
    EXPECT_EQ(by_threads[0].mesh_rest.size(), g.P.size());
    for (int j = 0; j <= Side; j++)
        for (int i = 2; i <= Side - 2; i++) {
            const int k = j * (Side + 1) + i;
            EXPECT_NEAR(g.position(k).z, 6 * g.position(k).x, 0.02);
            EXPECT_EQ(by_threads[0].mesh_rest[size_t(k + 2 * g.stride)], 0);
        }
}

// Along a fibre v goes from ring to ring: half of the way from one neighbour to the other at joints, all of
// the way at ends; no curve takes anything of the next one, and nothing lies across.
TEST(MeshDerivatives, OfFibresGoAlongThem) {
    scene::Curves c;
    c.cubic = false;
    c.vertices_per_curve = std::vector<int32_t>{4, 3};
    const std::vector<float> joints{0, 0, 0, 1, 0, 0, 1, 2, 0, 1, 2, 3, /**/ 0, 5, 0, 4, 5, 0, 4, 9, 0};
    scene::Primitive p = primitive(c, joints);
    p.primvars.set(floats("constantwidth", scene::Type::Float, Detail::Constant, {0.001f}));
    p.primvars.set(floats("number", scene::Type::Float, Detail::Vertex, {0, 1, 4, 9, 100, 110, 130}));
    const Diced d = run(p, neighbours());
    ASSERT_FALSE(d.mesh.radius.empty());
    ASSERT_EQ(d.mesh_vertices.vertices(), 7);
    const float in_row[] = {1, 2, 4, 5, 10, 15, 20};
    const Differences n = differences(d, [](const grid::Grid& g, int i) {
        return std::ranges::find(g.primvars, std::string("number"), &grid::Channel::name)->data[size_t(i)];
    });
    for (size_t i = 0; i < 7; i++) {
        EXPECT_FLOAT_EQ(n.v[i], in_row[i]) << i;
        EXPECT_EQ(n.u[i], 0) << i;
        EXPECT_EQ(n.step_u[i], 1) << i;
    }
}
