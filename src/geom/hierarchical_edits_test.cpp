// Hierarchical edits of subdivision meshes.
#include <algorithm>
#include <cmath>

#include "geom/test_cages.h"

using namespace kanuka;
using namespace kanuka::geom;
using namespace kanuka::geom::testing;

namespace {

using Tag = scene::SubdivisionMesh::Tag;

scene::Primitive cube(std::vector<Tag> tags) {
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>(6, 4);
    m.vertices = std::vector<int32_t>{0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    m.tags = std::move(tags);
    scene::Primitive out;
    out.geometry = m;
    out.primvars.set(
        value("P", scene::Type::Point, scene::Detail::Vertex,
              {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1}));
    return out;
}

// Positions of the corners of all faces that come from face `base`.
std::vector<Vec3f> corners(const Surface& s, int base) {
    std::vector<Vec3f> out;
    for (int f = 0; f < s.faces(); f++)
        if (s.uniform_index(f) == base) {
            const grid::Grid g = evaluate(s, f, {0, 1}, {0, 1});
            for (int i = 0; i < 4; i++)
                out.push_back(g.position(i));
        }
    return out;
}
float lowest(const Surface& s, int base) {
    float z = 1e9f;
    for (const Vec3f& p : corners(s, base))
        z = std::min(z, p.z);
    return z;
}

// Edges that the surface has a fold at: normals of its two faces at the middle.
int folds(const Surface& s) {
    std::vector<std::vector<Vec3f>> normals(s.topology().edges.size());
    for (int f = 0; f < s.faces(); f++)
        for (int side = 0; side < 4; side++) {
            const float middle[4][2] = {{0.5f, 0}, {1, 0.5f}, {0.5f, 1}, {0, 0.5f}};
            const grid::Grid g = evaluate(s, f, {middle[side][0]}, {middle[side][1]});
            normals[s.topology().faces[f].sides[side].edge].push_back(normalize(g.normal(0)));
        }
    int n = 0;
    for (const auto& pair : normals)
        n += pair.size() == 2 && dot(pair[0], pair[1]) < 0.97f;
    return n;
}

} // namespace

// The limit of a regular vertex is (16 v + 4 sum e + sum f) / 36: what is added to it moves it by 4/9.
TEST(HierarchicalEdits, MoveTheLimitPoint) {
    const float before = lowest(*make(cube({})), 0), d = 0.3f;
    const std::vector<std::string> add{"add", "P", "value"};
    // The middle of face 0: corner 2 of its first child, and of that one's third.
    const auto first = make(cube({{"vertexedit", {3, 0, 0, 2}, {0, 0, -d}, add}}));
    EXPECT_EQ(first->faces(), 24);
    const auto second = make(cube({{"vertexedit", {4, 0, 0, 2, 2}, {0, 0, -d}, add}}));
    EXPECT_EQ(second->faces(), 96);
    const auto middle = [](const Surface& s) { // limit of the face's middle
        for (const Vec3f& p : corners(s, 0))
            if (abs(p.x) < 1e-5f && abs(p.y) < 1e-5f)
                return p.z;
        return 0.0f;
    };
    const float rest = middle(*make(cube({{"vertexedit", {3, 0, 0, 2}, {0, 0, 0}, add}})));
    EXPECT_NEAR(middle(*first) - rest, -4.0f / 9 * d, 1e-5f);
    EXPECT_NEAR(middle(*second) - rest, -4.0f / 9 * d, 1e-5f);
    EXPECT_LT(rest, before + 1e-3f); // it was the lowest point
    // Both, one after another; "subtract" takes away; "set" says where, in object space.
    const auto both = make(cube(
        {{"vertexedit", {4, 0, 0, 2, 2, 3, 0, 0, 2}, {0, 0, -d, 0, 0, -d}, {"subtract", "P", "value"}}}));
    EXPECT_GT(middle(*both), rest + 4.0f / 9 * d);
    const auto set = make(cube({{"vertexedit", {3, 0, 0, 2}, {0, 0, -2}, {"set", "P", "value"}}}));
    EXPECT_NEAR(middle(*set) - rest, -4.0f / 9, 1e-5f); // the face's own point lay at z = -1
    Journal journal;
    const auto moved = make_surface(cube({{"vertexedit", {3, 0, 0, 2}, {0, 0, -2}, {"set", "P", "value"}}}),
                                    Transform::translate(0, 0, 5), journal);
    EXPECT_NEAR(lowest(*moved, 0), lowest(*set, 0) + 5, 1e-5f);
    // At level 0 a vertex of valence n moves its limit by n / (n + 5).
    const auto base = make(cube({{"vertexedit", {2, 0, 1}, {0, d, 0}, add}})); // face 0 is 0 3 2 1: vertex 3
    EXPECT_EQ(base->faces(), 6);
    EXPECT_NEAR(corners(*base, 0)[1].y - corners(*make(cube({})), 0)[1].y, 3.0f / 8 * d, 1e-5f);
}

TEST(HierarchicalEdits, HolesAndSharpness) {
    EXPECT_EQ(make(cube({{"faceedit", {2, 0, 1}, {}, {"hole"}}}))->faces(), 23);
    EXPECT_EQ(make(cube({{"faceedit", {1, 3, 2, 0, 1}, {}, {"hole"}}}))->faces(), 4 * 6 - 4 - 1);
    // A hole has no children, and "hole" tags of the mesh stay.
    EXPECT_EQ(make(cube({{"hole", {5}, {}, {}}, {"faceedit", {2, 0, 1, 3, 0, 0, 0}, {}, {"hole"}}}))->faces(),
              96 - 16 - 4 - 1);
    const std::vector<std::string> sharp{"set", "P", "sharpness"};
    EXPECT_EQ(folds(*make(cube({}))), 0);
    // Around the first child of a face that lies on the cube's corner: the two sides towards other faces.
    EXPECT_EQ(folds(*make(cube({{"edgeedit", {3, 0, 0, 0, 3, 0, 0, 3}, {10, 10}, sharp}}))), 2);
    // A crease of the mesh comes down to the finer level, and may be taken away there.
    const Tag ring{"crease", {0, 1, 2, 3, 0}, {10}, {}};
    EXPECT_EQ(folds(*make(cube({ring}))), 4);
    EXPECT_EQ(folds(*make(cube({ring, {"edgeedit", {3, 0, 0, 1}, {0}, sharp}}))), 8);
    EXPECT_EQ(folds(*make(cube({ring, {"edgeedit", {3, 0, 0, 0}, {10}, {"subtract", "P", "sharpness"}}}))),
              7);
    // A corner comes nearer to its cage vertex.
    const auto tip = make(cube({{"vertexedit", {3, 0, 0, 0}, {10}, sharp}}));
    float reach = 0;
    for (const Vec3f& p : corners(*tip, 0))
        reach = std::max(reach, length(p));
    EXPECT_GT(reach, 0.9f); // 0.87 for the smooth one
}

// As deep as a cage of four million faces: a hole of six times 4^7.
TEST(HierarchicalEdits, DeepOnesAreMade) {
    EXPECT_EQ(make(cube({{"faceedit", {8, 0, 0, 0, 0, 0, 0, 0, 0}, {}, {"hole"}}}))->faces(), (6 << 14) - 1);
}

TEST(HierarchicalEdits, WhatFitsNothingIsLeftOut) {
    const std::vector<std::string> add{"add", "P", "value"};
    const std::pair<Tag, const char*> bad[] = {
        {{"vertexedit", {3, 9, 0, 2}, {0, 0, 1}, add}, "no face 9; the mesh has 6"},
        {{"vertexedit", {3, 0, 4, 2}, {0, 0, 1}, add}, "no child 4; there are 4"},
        {{"vertexedit", {3, 0, 1, 4}, {0, 0, 1}, add}, "no vertex 4; it has 4"},
        {{"vertexedit", {9, 0, 1}, {0, 0, 1}, add}, "paths begin with their length"},
        {{"vertexedit", {-2, 0, 1}, {0, 0, 1}, add}, "paths begin with their length"},
        {{"vertexedit", {3, 0, 1, 2}, {0, 1}, add}, "each path takes 3 floatargs, found 2"},
        {{"vertexedit", {3, 0, 1, 2}, {0, 1, INFINITY}, add}, "not finite"},
        {{"vertexedit", {3, 0, 1, 2}, {0, 1, 1}, {}}, "no stringargs"},
        {{"vertexedit", {3, 0, 1, 2}, {0, 1, 1}, {"double", "P", "value"}}, "found \"double\""},
        {{"vertexedit", {3, 0, 1, 2}, {0, 1, 1}, {"add", "Q", "value"}}, "no primitive variable \"Q\""},
        {{"edgeedit", {3, 0, 1, 2}, {0, 1, 1}, add}, "cannot change the \"value\""},
        {{"faceedit", {2, 0, 1}, {}, {"attributes"}}, "found \"attributes\""},
        {{"faceedit", {20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {}, {"hole"}},
         "too fine"},
    };
    for (const auto& [tag, words] : bad) {
        Journal journal;
        // A good edit beside it is made.
        const auto s = make_surface(cube({tag, {"faceedit", {1, 3}, {}, {"hole"}}}), {}, journal);
        ASSERT_EQ(journal.entries().size(), 1u) << words;
        EXPECT_NE(journal.entries()[0].message.find(words), std::string::npos)
            << journal.entries()[0].message;
        EXPECT_EQ(s->faces(), 5) << words;
    }
}

// Edits that change nothing leave the surface and what lies on it as it is, two levels down. Beside
// extraordinary vertices OpenSubdiv's patches are approximations, better ones at finer levels.
static void compare_refined(scene::Primitive plain, const std::vector<int>& bases, float tolerance) {
    const auto a = make(plain);
    std::vector<float> tint;
    for (int f = 0; f < 100; f++)
        tint.push_back(float(f));
    plain.primvars.set(value("tint", scene::Type::Float, scene::Detail::Uniform, tint));
    auto& mesh = std::get<scene::SubdivisionMesh>(plain.geometry);
    mesh.tags.push_back({"vertexedit", {4, 0, 0, 0, 0}, {0, 0, 0}, {"add", "P", "value"}});
    const auto b = make(plain);
    int compared = 0;
    float worst = 0, worst_slope = 0, worst_data = 0, least_cosine = 1;
    for (int f = 0; f < b->faces(); f++) {
        const int base = b->uniform_index(f);
        const std::vector<float> t{0.1f, 0.5f, 0.9f};
        const grid::Grid g = evaluate(*b, f, t, t);
        EXPECT_EQ(g.primvars[1].data[4], float(base));
        if (std::find(bases.begin(), bases.end(), base) == bases.end())
            continue;
        int whole = 0;
        while (a->uniform_index(whole) != base)
            whole++;
        const grid::Grid h = evaluate(*a, whole, {g.u[3], g.u[4], g.u[5]}, {g.v[1], g.v[4], g.v[7]});
        for (int i = 0; i < 9; i++, compared++) {
            worst = std::max(worst, length(g.position(i) - h.position(i)));
            least_cosine = std::min(least_cosine, dot(normalize(g.normal(i)), normalize(h.normal(i))));
            for (int c = 0; c < 3; c++) {
                const size_t k = i + size_t(c) * g.stride;
                worst_slope = std::max({worst_slope, abs(g.dPdu[k] - h.dPdu[k]), abs(g.dPdv[k] - h.dPdv[k])});
            }
            worst_data = std::max({worst_data, abs(g.s[i] - h.s[i]), abs(g.t[i] - h.t[i]),
                                   0.1f * abs(g.primvars[0].data[i] - h.primvars[0].data[i])});
        }
    }
    EXPECT_EQ(compared, int(bases.size()) * 16 * 9);
    EXPECT_LT(worst, tolerance);
    EXPECT_LT(worst_slope, 25 * tolerance);
    EXPECT_LT(worst_data, tolerance);
    EXPECT_GT(least_cosine, 1 - tolerance);
}

TEST(HierarchicalEdits, RefinedCagesHaveTheSameLimit) {
    compare_refined(mixed_mesh(), {0, 3, 4}, 0.015f); // parts of n-gons have their own u and v
    // A regular net with its border, a sharp crease and one that fades out.
    scene::Primitive net;
    scene::SubdivisionMesh m;
    std::vector<float> p, heat, st;
    for (int j = 0; j < 6; j++)
        for (int i = 0; i < 6; i++) {
            p.insert(p.end(), {float(i), float(j), float((i * 5 + j * 3) % 4) / 4});
            heat.push_back(float(i * j % 5));
        }
    std::vector<int32_t> v;
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 5; i++)
            for (const int k : {j * 6 + i, j * 6 + i + 1, (j + 1) * 6 + i + 1, (j + 1) * 6 + i}) {
                v.push_back(k);
                st.insert(st.end(), {float(k % 6) / 5, float(k / 6) / 5});
            }
    m.vertices_per_face = std::vector<int32_t>(25, 4);
    m.vertices = v;
    m.tags = {{"interpolateboundary", {1}, {}, {}},
              {"crease", {6, 7, 8, 9, 10, 11}, {10}, {}},
              {"crease", {24, 25, 26, 27, 28, 29}, {1.5f}, {}}};
    net.geometry = m;
    net.primvars.set(value("P", scene::Type::Point, scene::Detail::Vertex, p));
    net.primvars.set(value("heat", scene::Type::Float, scene::Detail::Varying, heat));
    scene::Value texture = value("st", scene::Type::Float, scene::Detail::FaceVarying, st);
    texture.array_size = 2;
    net.primvars.set(texture);
    std::vector<int> all(25);
    for (int f = 0; f < 25; f++)
        all[f] = f;
    compare_refined(net, all, 1e-5f);
    // Without the border's rule only faces inside have a surface, and children of the others none.
    std::get<scene::SubdivisionMesh>(net.geometry)
        .tags.erase(std::get<scene::SubdivisionMesh>(net.geometry).tags.begin());
    compare_refined(net, {6, 7, 8, 11, 12, 13, 16, 17, 18}, 1e-5f);
}

TEST(HierarchicalEdits, ChangePrimitiveVariables) {
    scene::Primitive p = mixed_mesh();
    auto& tags = std::get<scene::SubdivisionMesh>(p.geometry).tags;
    tags.push_back({"faceedit", {2, 3, 1}, {7, 7, 7}, {"set", "tint", "value"}});
    tags.push_back({"vertexedit", {3, 3, 1, 1}, {100}, {"add", "heat", "value"}});
    tags.push_back({"vertexedit", {3, 3, 2, 2}, {5, 5}, {"add", "st", "value"}});
    scene::Value tint =
        value("tint", scene::Type::Color, scene::Detail::Uniform, std::vector<float>(24, 1.0f));
    p.primvars.set(tint);
    const auto s = make(p), rest = make(mixed_mesh());
    int tinted = 0;
    float hottest = 0, farthest = 0;
    for (int f = 0; f < s->faces(); f++) {
        const grid::Grid g = evaluate(*s, f, {0, 1}, {0, 1});
        tinted += g.primvars[1].data[0] == 7;
        for (int i = 0; i < 4; i++) {
            hottest = std::max(hottest, g.primvars[0].data[i]);
            farthest = std::max(farthest, g.s[i]);
        }
    }
    EXPECT_EQ(tinted, 1);
    EXPECT_GT(hottest, 20);
    EXPECT_GT(farthest, 2);
}
