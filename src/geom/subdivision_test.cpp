#include <gtest/gtest.h>

#include "geom/surface.h"

using namespace kanuka;
using namespace kanuka::geom;

namespace {

scene::Value value(std::string name, scene::Type type, scene::Detail detail, std::vector<float> floats) {
    scene::Value v;
    v.name = std::move(name);
    v.type = type;
    v.detail = detail;
    v.floats = std::move(floats);
    return v;
}

std::unique_ptr<Surface> make(const scene::Primitive& p) {
    Journal journal;
    auto s = make_surface(p, {}, journal);
    EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
    return s;
}

grid::Grid evaluate(const Surface& s, int face, const std::vector<float>& u, const std::vector<float>& v) {
    grid::Grid g;
    g.allocate(int(u.size()) - 1, int(v.size()) - 1);
    s.allocate_channels(g);
    s.evaluate(face, {u.data(), int(u.size())}, {v.data(), int(v.size())}, {g, 0, g.nu + 1});
    return g;
}

std::vector<float> steps(int n, float from = 0, float to = 1) {
    std::vector<float> t(n + 1);
    for (int i = 0; i <= n; i++)
        t[i] = from + (to - from) * float(i) / float(n);
    return t;
}

// Quads around vertices of valence 3 to 6, triangles, a pentagon, creases, a border; texture coordinates at
// corners and a value at vertices.
scene::Primitive mixed_mesh() {
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>{4, 3, 3, 4, 4, 5, 3, 3};
    m.vertices = std::vector<int32_t>{0, 1, 5, 4, 1, 2, 5,  2, 6, 5, 2,  3, 7,  6, 4,
                                      5, 9, 8, 5, 6, 7, 10, 9, 8, 9, 11, 9, 10, 11};
    m.tags = {{"interpolateboundary", {1}, {}, {}}, {"crease", {1, 5, 9}, {2.5f}, {}}};
    scene::Primitive out;
    out.geometry = m;
    std::vector<float> p;
    const float xy[12][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 1},       {1, 1.1f},
                             {2, 1}, {3, 1}, {0, 2}, {1, 2}, {2.4f, 2.3f}, {0.8f, 3}};
    for (int i = 0; i < 12; i++)
        p.insert(p.end(), {xy[i][0], xy[i][1], 0.4f * float(i * 5 % 7) / 7});
    std::vector<float> heat, st;
    for (int i = 0; i < 12; i++)
        heat.push_back(float(i * 7 % 5));
    for (const int v : std::get<scene::SubdivisionMesh>(out.geometry).vertices)
        st.insert(st.end(), {xy[v][0] / 3, xy[v][1] / 3});
    out.primvars.set(value("P", scene::Type::Point, scene::Detail::Vertex, p));
    out.primvars.set(value("heat", scene::Type::Float, scene::Detail::Vertex, heat));
    scene::Value texture = value("st", scene::Type::Float, scene::Detail::FaceVarying, st);
    texture.array_size = 2;
    out.primvars.set(texture);
    return out;
}

} // namespace

// Dense lattices of irregular faces are filled by polynomials of their parts, single points are not.
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
