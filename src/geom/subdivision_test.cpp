#include <algorithm>
#include <cmath>

#include "geom/test_cages.h"

using namespace kanuka;
using namespace kanuka::geom;
using namespace kanuka::geom::testing;

namespace {

std::vector<float> steps(int n, float from = 0, float to = 1) {
    std::vector<float> t(n + 1);
    for (int i = 0; i <= n; i++)
        t[i] = from + (to - from) * float(i) / float(n);
    return t;
}

} // namespace

// Dense lattices of irregular faces are filled by polynomials of their parts, single points are not.
// Regular n-gon of radius 1 (Archimedes): as one face of n corners, and as n quads around a vertex of valence
// n / 2.
TEST(Subdivision, HugeFacesAndValencesEndAsPolygons) {
    constexpr int N = 2000;
    for (const bool one_face : {true, false}) {
        scene::SubdivisionMesh m;
        std::vector<float> p;
        std::vector<int32_t> sizes, vertices;
        for (int i = 0; i < N; i++) {
            const double a = 2 * M_PI * i / N;
            p.insert(p.end(), {float(std::cos(a)), float(std::sin(a)), 0});
        }
        p.insert(p.end(), {0, 0, 0});
        if (one_face) {
            sizes.push_back(N);
            for (int i = 0; i < N; i++)
                vertices.push_back(i);
        }
        for (int i = 0; i < N && !one_face; i += 2) {
            sizes.push_back(4);
            vertices.insert(vertices.end(), {N, i, i + 1, (i + 2) % N});
        }
        m.vertices_per_face = sizes, m.vertices = vertices;
        m.tags = {{"interpolateboundary", {1}, {}, {}}};
        scene::Primitive prim;
        prim.geometry = m;
        prim.primvars.set(value("P", scene::Type::Point, scene::Detail::Vertex, p));
        Journal journal;
        const auto s = make_surface(prim, {}, journal);
        ASSERT_TRUE(s);
        ASSERT_EQ(journal.entries().size(), 1u);
        EXPECT_NE(
            journal.entries()[0].message.find(one_face ? "a face of 2000 corners" : "a vertex of 1000 faces"),
            std::string::npos);
        double area = 0;
        for (size_t f = 0; f < s->topology().faces.size(); f++) {
            const grid::Grid g = evaluate(*s, int(f), steps(1), steps(1));
            const auto cross_z = [](const Vec3f& a, const Vec3f& b) {
                return double(a.x) * double(b.y) - double(a.y) * double(b.x);
            };
            area += 0.5 * cross_z(g.position(3) - g.position(0), g.position(2) - g.position(1));
        }
        EXPECT_NEAR(std::abs(area), 0.5 * N * std::sin(2 * M_PI / N), 1e-4);
    }
}

TEST(Subdivision, DenseLatticesAreThatOfTheirPoints) {
    const auto made = make(mixed_mesh());
    const Surface& s = *made;
    double worst_p = 0, worst_slope = 0, worst_channel = 0;
    for (int f = 0; f < s.faces(); f++)
        for (const auto& [from, to] : {std::pair{0.0f, 1.0f}, std::pair{0.5f, 0.75f}}) {
            const std::vector<float> t = steps(23, from, to);
            const grid::Grid g = evaluate(s, f, t, t);
            for (int j = 0; j <= 23; j++)
                for (int i = 0; i <= 23; i++) {
                    const grid::Grid one = evaluate(s, f, {t[i]}, {t[j]});
                    const int k = j * 24 + i;
                    const size_t n = size_t(g.stride), o = size_t(one.stride);
                    worst_p = std::max(worst_p, double(length(g.position(k) - one.position(0))));
                    for (int c = 0; c < 3; c++) {
                        worst_slope = std::max(worst_slope, double(abs(g.dPdu[k + c * n] - one.dPdu[c * o])));
                        worst_slope = std::max(worst_slope, double(abs(g.dPdv[k + c * n] - one.dPdv[c * o])));
                    }
                    for (const double d : {g.s[k] - one.s[0], g.t[k] - one.t[0],
                                           g.primvars[0].data[k] - one.primvars[0].data[0]})
                        worst_channel = std::max(worst_channel, std::fabs(d));
                }
        }
    EXPECT_LT(worst_p, 6e-6);
    EXPECT_LT(worst_slope, 6e-3); // OpenSubdiv leaves a term of the slopes of Gregory patches out
    EXPECT_LT(worst_channel, 3e-5);
}

namespace {

// `copies` of a mesh beside each other, all but the first elsewhere.
scene::Primitive repeated(const scene::Primitive& one, int copies) {
    const auto& mesh = std::get<scene::SubdivisionMesh>(one.geometry);
    const int points = int(one.primvars.find("P")->floats.size() / 3);
    scene::SubdivisionMesh all;
    all.tags = {mesh.tags[0]};
    std::vector<int32_t> sizes, vertices;
    scene::Primitive out;
    for (int k = 0; k < copies; k++) {
        sizes.insert(sizes.end(), mesh.vertices_per_face.begin(), mesh.vertices_per_face.end());
        for (const int v : mesh.vertices)
            vertices.push_back(v + k * points);
        all.tags.push_back(mesh.tags[1]);
        for (int& v : all.tags.back().ints)
            v += k * points;
    }
    all.vertices_per_face = std::move(sizes);
    all.vertices = std::move(vertices);
    out.geometry = std::move(all);
    for (const scene::Value& v : one.primvars.values) {
        std::vector<float> floats;
        for (int k = 0; k < copies; k++)
            for (size_t i = 0; i < v.floats.size(); i++)
                floats.push_back(v.floats[i] + (v.name == "P" && i % 3 == 2 ? 5.0f * float(k) : 0));
        scene::Value longer = v;
        longer.floats = std::move(floats);
        out.primvars.set(longer);
    }
    return out;
}

// A closed strip of 9 x 9 quads around a torus; with `tag`, a crease of no sharpness along one of its edges.
scene::Primitive torus(bool tag) {
    constexpr int N = 9;
    std::vector<float> p;
    std::vector<int32_t> index;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            const float a = 2 * Pi * float(i) / N, b = 2 * Pi * float(j) / N, r = 2 + std::cos(b);
            p.insert(p.end(), {r * std::cos(a), r * std::sin(a), std::sin(b + 0.3f * std::cos(a))});
            const int i1 = (i + 1) % N, j1 = (j + 1) % N;
            index.insert(index.end(), {j * N + i, j * N + i1, j1 * N + i1, j1 * N + i});
        }
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>(N * N, 4);
    m.vertices = std::move(index);
    if (tag)
        for (int v = 0; v + 1 < N * N; v++)
            if (v % N + 1 < N)
                m.tags.push_back({"crease", {v, v + 1}, {0}, {}});
    scene::Primitive out;
    out.geometry = m;
    out.primvars.set(value("P", scene::Type::Point, scene::Detail::Vertex, p));
    return out;
}

struct Difference {
    double p = 0, slope = 0, channel = 0;
};
Difference difference(const grid::Grid& a, const grid::Grid& b) {
    Difference d;
    const size_t n = size_t(a.stride);
    for (int k = 0; k < a.vertices(); k++) {
        d.p = std::max(d.p, double(length(a.position(k) - b.position(k))));
        for (int c = 0; c < 3; c++)
            for (const auto slopes : {&grid::Grid::dPdu, &grid::Grid::dPdv})
                d.slope = std::max(d.slope, double(abs((a.*slopes)[k + c * n] - (b.*slopes)[k + c * n])));
        d.channel = std::max({d.channel, double(abs(a.s[k] - b.s[k])), double(abs(a.t[k] - b.t[k]))});
        for (size_t c = 0; c < a.primvars.size(); c++)
            d.channel = std::max(d.channel, double(abs(a.primvars[c].data[k] - b.primvars[c].data[k])));
    }
    return d;
}

} // namespace

// Faces whose surroundings many others have are evaluated by matrices that were made once; a few are not.
TEST(Subdivision, FacesOfAKindAreWhatOpenSubdivMakesOfOne) {
    const scene::Primitive mesh = mixed_mesh();
    const auto one = make(mesh), many = make(repeated(mesh, 40));
    ASSERT_EQ(many->faces(), 40 * one->faces());
    for (int f = 0; f < one->faces(); f++)
        for (const auto& [n, from, to] :
             {std::tuple{23, 0.0f, 1.0f}, std::tuple{2, 0.0f, 1.0f}, std::tuple{7, 0.5f, 0.5625f}}) {
            const std::vector<float> u = steps(n, from, to), v = steps(n + 1, 0, 0.75f);
            const Difference d = difference(evaluate(*one, f, u, v), evaluate(*many, f, u, v));
            EXPECT_LT(d.p, 4e-6) << f;
            EXPECT_LT(d.slope, 3e-4) << f;
            EXPECT_LT(d.channel, 2e-5) << f;
            const std::vector<float> middle{0.5f};
            const Vec3f a = evaluate(*many, f, middle, middle).position(0),
                        b = evaluate(*many, 39 * one->faces() + f, middle, middle).position(0);
            EXPECT_LT(length(b - a - Vec3f(0, 0, 39 * 5)), 6e-5);
        }
}

TEST(Subdivision, RegularFacesAreWhatOpenSubdivMakesOfThem) {
    const auto plain = make(torus(false)), tagged = make(torus(true));
    for (int f = 0; f < plain->faces(); f++)
        for (const auto& [n, from, to] : {std::tuple{4, 0.0f, 1.0f}, std::tuple{7, 0.5f, 0.5625f}}) {
            const std::vector<float> u = steps(n, from, to), v = steps(n - 1, 0.25f, 0.75f);
            const Difference d = difference(evaluate(*plain, f, u, v), evaluate(*tagged, f, u, v));
            EXPECT_LT(d.p, 2e-6) << f;
            EXPECT_LT(d.slope, 5e-5) << f;
        }
}
