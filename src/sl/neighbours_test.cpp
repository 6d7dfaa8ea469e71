// What a stage reads, and derivatives on a patch of a mesh: as on the grid of the same vertices.
#include "sl/test_support.h"

namespace kanuka::sl::test {

static grid::Reads reads(const std::string& statements, const std::string& before = {}) {
    const auto shader = compile(probe(statements, before));
    TestServices services;
    return shader ? shader->instantiate({}, services)->reads_shading() : grid::Reads{};
}

TEST(SlNeighbours, WhatAStageReads) {
    EXPECT_EQ(reads("r = noise(P);").rings, 0);
    EXPECT_EQ(reads("r = Du(noise(P));").rings, 1);
    EXPECT_EQ(reads("r = texture(\"a.tx\", s, t);").rings, 1);
    EXPECT_EQ(reads("r = area(P);").rings, 1);
    EXPECT_EQ(reads("float w = filterwidth(s); r = xcomp(calculatenormal(P + w * N));").rings, 2);
    EXPECT_EQ(reads("r = f(u); ", "float f(float x) { return Du(Dv(Du(x))); }").rings, 3);
    EXPECT_EQ(reads("float x = 0; if (filterwidth(s) > 0.1) x = 1; r = Du(x);").rings, 2);
    EXPECT_EQ(reads("float i, x = u; for (i = 0; i < 20; i += 1) x = Du(x); r = x;").rings, 4); // the most
    EXPECT_EQ(reads("r = du;").rings, 1);
    // Du() needs to know how u changes, not u.
    EXPECT_FALSE(reads("r = Du(noise(P));").parameters);
    EXPECT_TRUE(reads("r = u;").parameters);
    EXPECT_TRUE(reads("r = filterwidth(2 * v);").parameters);
    EXPECT_TRUE(reads("r = s;").texture);
    EXPECT_FALSE(reads("r = u;").texture);
    EXPECT_TRUE(reads("r = xcomp(dPdv);").frame);
    EXPECT_FALSE(reads("r = noise(P);").frame);
}

TEST(SlNeighbours, TheEyeIsReadWhereItIsFrozen) {
    const auto reads_eye = [](const std::string& Ci) {
        const auto shader = compile("surface s() { Oi = 1; Ci = " + Ci + "; }");
        TestServices services;
        return shader && shader->instantiate({}, services)->reads_shading().eye;
    };
    EXPECT_FALSE(reads_eye("Cs * diffuse(N)"));
    EXPECT_FALSE(reads_eye("Cs * specular(normalize(N), -normalize(I), 0.1)"));
    EXPECT_TRUE(reads_eye("Cs * pow(1 - abs(normalize(I) . normalize(N)), 3) * diffuse(N)"));
}

// A bent lattice as a grid, and as a mesh with the weights of central differences inside.
TEST(SlNeighbours, AMeshIsAsItsGrid) {
    constexpr int Nu = 20, Nv = 11, Columns = Nu + 1;
    const auto bent = [] {
        grid::Grid g = plane(Nu, Nv);
        for (int i = 0; i < g.vertices(); i++) {
            g.P[size_t(2 * g.stride + i)] = 0.3f * g.P[size_t(i)] * g.P[size_t(i)];
            g.s[size_t(i)] = 2 * g.u[size_t(i)] + g.v[size_t(i)];
        }
        return g;
    };
    auto stencils = std::make_shared<grid::Stencils>();
    stencils->own = Columns * (Nv + 1);
    for (int j = 0; j <= Nv; j++)
        for (int i = 0; i <= Nu; i++) {
            stencils->first.push_back(uint32_t(stencils->vertex.size()));
            stencils->step_u.push_back(1.0f / Nu), stencils->step_v.push_back(1.0f / Nv);
            if (i == 0 || j == 0 || i == Nu || j == Nv)
                continue;
            const int at = j * Columns + i;
            for (const auto& [offset, a, b] : {std::tuple{1, 0.5f, 0.0f},
                                               {-1, -0.5f, 0.0f},
                                               {Columns, 0.0f, 0.5f},
                                               {-Columns, 0.0f, -0.5f}}) {
                stencils->vertex.push_back(uint32_t(at + offset));
                stencils->along_u.push_back(a), stencils->along_v.push_back(b);
            }
        }
    stencils->first.push_back(uint32_t(stencils->vertex.size()));
    class Footprints : public TestServices {
      public:
        std::vector<Vec3f> seen; // dsdu, dsdv, dtdv
        void texture(const TextureRequest& q) override {
            for (int i = 0; i < q.count; i++)
                seen.emplace_back(q.dsdu[i], q.dsdv[i], q.dtdv[i]);
            TestServices::texture(q);
        }
    };
    const std::string statements[] = {
        "r = color(Du(noise(P)), Dv(noise(P)), Deriv(zcomp(P), s));",
        "r = color(area(P), filterwidth(s), filterwidth(u) + filterwidth(v)) ;",
        "vector w = Du(P); r = color(xcomp(w), ycomp(w), zcomp(w));",
        "normal n = calculatenormal(P + 0.1 * noise(3 * P) * N); r = color(xcomp(n), ycomp(n), zcomp(n));",
        "r = texture(\"a.tx\", s, t);",
    };
    for (const std::string& text : statements) {
        std::vector<std::vector<Vec3f>> all;
        for (const Config c : configs()) {
            const auto shader = compile(probe(text), c);
            ASSERT_TRUE(shader);
            Footprints on_grid, on_mesh;
            grid::Grid g = bent(), mesh = bent();
            mesh.nu = mesh.vertices() - 1, mesh.nv = 0;
            mesh.stencils = stencils;
            const std::vector<Vec3f> expected = run_probe(*shader, g, on_grid),
                                     found = run_probe(*shader, mesh, on_mesh);
            ASSERT_EQ(expected.size(), found.size());
            ASSERT_EQ(on_grid.seen.size(), on_mesh.seen.size());
            for (int j = 2; j < Nv - 1; j++)
                for (int i = 2; i < Nu - 1; i++) {
                    const size_t k = size_t(j * Columns + i);
                    EXPECT_NEAR(length(expected[k] - found[k]), 0, 1e-5f * (1 + length(expected[k]))) << text;
                    if (!on_grid.seen.empty()) {
                        EXPECT_NEAR(length(on_grid.seen[k] - on_mesh.seen[k]), 0, 1e-6f);
                    }
                }
            all.push_back(found);
        }
        for (const auto& other :
             all) // the same at any lane count, but for what transcendental functions leave
            for (size_t k = 0; k < other.size(); k++)
                EXPECT_EQ(other[k], all[0][k]) << text;
    }
}

// Normals of a mesh whose faces have their own are there for shaders; without a word of N they stay the
// faces'.
TEST(SlNeighbours, FacetsHaveVertexNormals) {
    for (const bool sets : {false, true}) {
        const auto shader =
            compile(probe("r = color(xcomp(N), ycomp(N), zcomp(N)); " +
                          std::string(sets ? "N = normalize(N + vector(0.1 * u, 0, 0));" : "")));
        ASSERT_TRUE(shader);
        TestServices services;
        grid::Grid g = plane(40, 0);
        g.facets = true;
        std::fill(g.N.begin(), g.N.end(), 0.0f);
        const std::vector<Vec3f> r = run_probe(*shader, g, services);
        EXPECT_EQ(r[7], Vec3f(0, 0, 1));
        EXPECT_EQ(g.facets, !sets);
        EXPECT_NEAR(g.normal(0).z, sets ? 1 : 0, 1e-6f);
        EXPECT_EQ(g.normal(40).x > 0.05f, sets);
    }
}

} // namespace kanuka::sl::test
