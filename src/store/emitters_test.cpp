// Emitters and presence: areas, powers and shapes by angle, on grids and meshes.
#include "store/test_pages.h"

#include <gtest/gtest.h>

#include "color/color.h"

namespace kanuka::store {

using namespace testing;

TEST(Emitters, AreasAndPowersOfAGrid) {
    const auto program = lamp_program();
    HandMade made(4, 3, program);
    for (int i = 0; i < made.grid.vertices(); i++)
        made.at(2, 0, i) = made.at(2, 1, i) = made.at(2, 2, i) = float(i % 5); // linear in u
    made.set_uniform(3, {0.5f, 0, 0});
    Store store;
    store.add_page(encode_one(made, program), program, -1);
    ASSERT_EQ(store.emitters().size(), 24u); // two a cell
    double area = 0, power = 0;
    for (const Emitter& e : store.emitters()) {
        EXPECT_FLOAT_EQ(e.area, 0.5f);
        EXPECT_EQ(e.flags, 0u); // winding and normals agree
        area += e.area;
        power += e.power;
        // Radiance of a triangle: the mean of its corners, by their x, as far as they are there: by half.
        const float x = 0.5f * (e.p0.x * 3 + e.e1.x + e.e2.x) / 3;
        EXPECT_NEAR(e.power, 0.5f * x, 1e-5f);
        const std::array<float, 3> c{e.c0, e.c1, e.c2};
        EXPECT_NEAR(e.scale * color::uplift_eval(c, 550), x, 1e-3f * x); // grey: the same at all wavelengths
    }
    EXPECT_NEAR(area, 12, 1e-5);
    EXPECT_NEAR(power, 12 * 2 * 0.5, 1e-4); // mean radiance 2
    EXPECT_EQ(store.shapes()[0].emitter, 0);
}

TEST(Emitters, MeshesSplitTheirQuads) {
    const auto program = lamp_program();
    HandMade made(5, 0, program); // six vertices in a row; positions below
    const Vec3f points[] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, {3, 0, 0}, {3, 1, 0}};
    for (int i = 0; i < 6; i++)
        for (int c = 0; c < 3; c++)
            made.grid.P[size_t(c * made.grid.stride + i)] = points[i][c];
    made.is_mesh = true;
    Store store;
    for (int n : {4, 3}) {
        made.mesh.vertices_per_face = n;
        made.mesh.indices =
            n == 4 ? std::vector<uint32_t>{0, 1, 2, 3, 1, 4, 5, 2} : std::vector<uint32_t>{0, 1, 2, 1, 4, 5};
        const size_t before = store.emitters().size();
        const int shape = store.add_page(encode_one(made, program), program, -1);
        EXPECT_EQ(store.shapes()[size_t(shape)].emitter, int(before));
        double area = 0;
        for (size_t i = before; i < store.emitters().size(); i++)
            area += store.emitters()[i].area;
        EXPECT_EQ(store.emitters().size() - before, n == 4 ? 4u : 2u);
        EXPECT_FLOAT_EQ(float(area), n == 4 ? 3.0f : 1.5f);
    }
}

// Twice as large: four times the area, a quarter of the radiance, so the same power; corners as they were
// made.
TEST(Emitters, KeepTheirPowerWhereTheirVerticesAreMoved) {
    const auto program = lamp_program();
    const Vec3f points[] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, {3, 0, 0}, {3, 1, 0}};
    for (const int n : {0, 3, 4}) { // a grid; triangles; quads
        HandMade made(5, n == 0 ? 2 : 0, program);
        made.set_uniform(3, {0.5f, 0, 0});
        for (int i = 0; i < made.grid.vertices(); i++)
            made.at(2, 0, i) = made.at(2, 1, i) = made.at(2, 2, i) = float(1 + i % 3);
        if (n > 0) {
            for (int i = 0; i < 6; i++)
                for (int c = 0; c < 3; c++)
                    made.grid.P[size_t(c * made.grid.stride + i)] = points[i][c];
            made.is_mesh = true;
            made.mesh.vertices_per_face = n;
            made.mesh.indices = n == 4 ? std::vector<uint32_t>{0, 1, 2, 3, 1, 4, 5, 2}
                                       : std::vector<uint32_t>{0, 1, 2, 1, 4, 5};
        }
        Store store;
        store.add_page(encode_one(made, program), program, -1);
        const std::vector<Emitter> before(store.emitters().begin(), store.emitters().end());
        ASSERT_FALSE(before.empty());
        store.move_vertices(0, [](const Vec3f& p) { return p * 2.0f; });
        for (size_t i = 0; i < before.size(); i++) {
            const Emitter &a = before[i], &b = store.emitters()[i];
            EXPECT_GT(a.power, 0);
            EXPECT_FLOAT_EQ(b.area, 4 * a.area);
            EXPECT_FLOAT_EQ(b.scale, a.scale / 4);
            EXPECT_EQ(b.power, a.power);
            EXPECT_EQ(b.p0, a.p0 * 2.0f);
            EXPECT_EQ(b.e1, a.e1 * 2.0f);
            EXPECT_EQ(b.e2, a.e2 * 2.0f);
        }
    }
}

TEST(Emitters, ShineWhereNormalsPoint) {
    const auto program = lamp_program();
    HandMade made(1, 1, program);
    for (int i = 0; i < 4; i++)
        made.grid.N[size_t(2 * made.grid.stride + i)] = -1;
    Store store;
    store.add_page(encode_one(made, program), program, -1);
    EXPECT_EQ(store.emitters()[0].flags, 1u);
    for (int i = 0; i < 4; i++)
        made.grid.N[size_t(2 * made.grid.stride + i)] = 0;
    for (bool flips : {false, true}) { // without normals, where the winding says
        made.grid.flips = flips;
        store.add_page(encode_one(made, program), program, -1);
        EXPECT_EQ(store.emitters().back().flags, uint32_t(flips));
    }
}

TEST(Emitters, LayersCoverThem) {
    using namespace grid;
    LayeringProgram p = lamp_program(); // nodes 0 Lambert with weight slot 1, 1 emission
    p.nodes[2].op = LayerOp::Over;      // paint of weight w over a lamp of radiance 0.5
    HandMade made(1, 1, p);
    made.set_uniform(1, {0.75f, 0, 0});
    made.set_uniform(3, {1, 0, 0});
    Store store;
    store.add_page(encode_one(made, p), p, -1);
    EXPECT_NEAR(store.emitters()[0].power, 0.5f * 0.25f * 0.5f, 1e-5f);
    p.nodes[2].op = LayerOp::Coat; // coats are clear to what shines below them
    store.add_page(encode_one(made, p), p, -1);
    EXPECT_NEAR(store.emitters().back().power, 0.5f * 0.5f, 1e-5f);
}

// Cones and powers of the cosine: what an emitter sends, against quadrature, and its bits through a page.
TEST(Emitters, ShapesByAngle) {
    using grid::LobeId;
    struct Case {
        LobeId id;
        float first, second;
    };
    for (const Case& c : {Case{LobeId::ConeEmission, 50, 0.5f}, Case{LobeId::ConeEmission, 90, 1},
                          Case{LobeId::ConeEmission, 20, 0}, Case{LobeId::ProfileEmission, 0, 0},
                          Case{LobeId::ProfileEmission, 0.5f, 0}, Case{LobeId::ProfileEmission, 60, 0}}) {
        auto program = lamp_program();
        program.nodes[1].lobe = c.id;
        for (const char* name : {"first", "second"}) {
            if (c.id == LobeId::ProfileEmission && program.nodes[1].inputs.size() > 1)
                break;
            program.nodes[1].inputs.push_back(int(program.slots.size()));
            program.slots.push_back({grid::InputType::Float, grid::Storage::Half, 0, 100, false, name});
        }
        HandMade made(1, 1, program);
        made.set_uniform(2, {1, 1, 1});
        made.set_uniform(3, {1, 0, 0});
        made.set_uniform(4, {c.first, 0, 0});
        if (program.slots.size() > 5)
            made.set_uniform(5, {c.second, 0, 0});
        Store store;
        store.add_page(encode_one(made, program), program, -1);
        const Emitter& e = store.emitters()[0];
        const double degree = 3.141592653589793 / 180;
        const double outer = std::cos(double(c.first) * degree),
                     inner = std::cos(double(c.first) * (1 - double(c.second)) * degree);
        double sent = 0;
        for (int i = 0; i < 20000; i++) {
            const double x = (i + 0.5) / 20000;
            const double t = std::clamp((x - outer) / std::max(inner - outer, 1e-9), 0.0, 1.0);
            const double falloff =
                c.id == LobeId::ProfileEmission ? std::pow(x, double(c.first)) : t * t * (3 - 2 * t);
            sent += falloff * 2 * x / 20000;
        }
        EXPECT_NEAR(double(e.power) / double(e.area), sent, 1e-3 * sent + 1e-4) << c.first << " " << c.second;
        EXPECT_EQ(bool(e.flags & EmissionShape::Power), c.id == LobeId::ProfileEmission && c.first > 0);
        EXPECT_NEAR(EmissionShape::reach_of(e.flags),
                    c.id == LobeId::ProfileEmission ? 0.0 : std::max(outer, 0.0), 1e-4);
    }
}

TEST(Presence, OnGridsAndMeshes) {
    const auto program = lamp_program();
    HandMade made(2, 2, program);
    for (int i = 0; i < 9; i++)
        made.at(3, 0, i) = float(i % 3) / 2; // = u
    Store store;
    store.add_page(encode_one(made, program), program, -1);
    for (float u : {0.0f, 0.2f, 0.5f, 0.9f, 1.0f})
        for (float v : {0.0f, 0.6f, 1.0f})
            EXPECT_NEAR(store.presence(0, 0, u, v), u, 1e-3f);
    made.is_mesh = true;
    made.mesh.vertices_per_face = 4;
    made.mesh.indices = {0, 1, 4, 3, 1, 2, 5, 4};
    int shape = store.add_page(encode_one(made, program), program, -1);
    EXPECT_NEAR(store.presence(shape, 0, 0.5f, 0.2f), 0.25f, 1e-3f);
    EXPECT_NEAR(store.presence(shape, 1, 0.5f, 0.2f), 0.75f, 1e-3f);
    made.mesh.vertices_per_face = 3;
    made.mesh.indices = {0, 1, 3, 2, 5, 4};
    shape = store.add_page(encode_one(made, program), program, -1);
    EXPECT_NEAR(store.presence(shape, 0, 0.5f, 0.25f), 0.25f, 1e-3f);
    EXPECT_NEAR(store.presence(shape, 1, 0.25f, 0.5f), 0.25f * 1 + 0.25f * 1 + 0.5f * 0.5f, 1e-3f);
    grid::LayeringProgram opaque = program;
    opaque.presence = -1;
    shape = store.add_page(encode_one(made, opaque), opaque, -1);
    EXPECT_EQ(store.presence(shape, 0, 0.5f, 0.5f), 1);
}

} // namespace kanuka::store
