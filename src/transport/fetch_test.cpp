// From hits to the inputs of lobes.
#include <functional>

#include <gtest/gtest.h>

#include "store/quantize.h"
#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr int Size = 40; // more than one bucket

// Albedo of the first hit at each pixel, as the film has it, against `expected` of the position the film has.
void expect_albedo(TestScene& s, const std::function<float(const Vec3f&)>& expected, float tolerance) {
    s.filter = {0, 0}; // rays through the middles of pixels
    s.finish();
    constexpr int N = 512;
    const auto pixels = s.render(N, 8);
    int compared = 0;
    for (const PixelSums& p : pixels) {
        if (p.hits < N)
            continue;
        const Vec3f at(p.position[0] / N, p.position[1] / N, p.position[2] / N);
        compared++;
        EXPECT_NEAR(p.albedo[1] / N, expected(at), tolerance) << at.x << " " << at.y;
    }
    EXPECT_GT(compared, 100);
}

struct VaryingShape {
    grid::Grid grid;
    grid::TracedGrid traced;
    grid::VertexInputs inputs;
    grid::LayeringProgram program;

    // Grey reflectance at each vertex of a lattice over [0, 1]^2 at z = 2.
    VaryingShape(int nu, int nv, const std::function<float(float, float)>& reflectance) {
        std::vector<Vec3f> unused;
        program = make_program({matte(Rgb(1))}, unused);
        for (auto& slot : program.slots)
            slot.uniform = false;
        grid.allocate(nu, nv);
        inputs.stride = grid.stride;
        inputs.slots = {{true, Vec3f(1), {}}, {false, {}, std::vector<float>(size_t(3 * grid.stride), 0.0f)}};
        for (int j = 0; j <= nv; j++)
            for (int i = 0; i <= nu; i++) {
                const size_t at = size_t(j * (nu + 1) + i), stride = size_t(grid.stride);
                const float x = float(i) / float(nu), y = nv ? float(j) / float(nv) : 0;
                grid.P[at] = x, grid.P[stride + at] = y, grid.P[2 * stride + at] = 2;
                grid.N[2 * stride + at] = -1;
                for (size_t c = 0; c < 3; c++)
                    inputs.slots[1].data[c * stride + at] = reflectance(x, y);
            }
    }
    store::ShadedGrid shaded() const { return {&grid, &traced, nullptr, &inputs}; }
};

void look_at_unit_square(TestScene& s) {
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.25f, Size, Size);
    for (auto* x :
         {&s.inputs.camera.left, &s.inputs.camera.right, &s.inputs.camera.top, &s.inputs.camera.bottom})
        *x += 0.25f; // the square fills the picture
    s.inputs.max_depth = 1;
}

float from_stored(float grey) { // what the vertex word keeps
    return store::from_rgb9e5(store::to_rgb9e5(Rgb(grey))).y;
}

} // namespace

// Two densities: one traced cell under sixteen shading cells, bilinear between their vertices.
TEST(Fetch, FineShadingUnderACoarseTrace) {
    const auto checker = [](float x, float y) {
        return (int(x * 4 + 0.5f) + int(y * 4 + 0.5f)) % 2 ? 0.8f : 0.2f;
    };
    VaryingShape v(4, 4, checker);
    v.traced.mu = v.traced.mv = 1;
    v.traced.step_u = v.traced.step_v = 4;
    v.traced.edge_step = {4, 4, 4, 4};
    v.traced.P = {0, 0, 2, 1, 0, 2, 0, 1, 2, 1, 1, 2};
    TestScene s;
    s.add(v.shaded(), v.program);
    look_at_unit_square(s);
    const auto expected = [&](const Vec3f& p) {
        const float x = p.x * 4, y = p.y * 4;
        const int i = std::min(int(x), 3), j = std::min(int(y), 3);
        const auto at = [&](int a, int b) {
            return from_stored(checker(float(i + a) / 4, float(j + b) / 4));
        };
        const float fx = x - float(i), fy = y - float(j);
        return (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) + (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
    };
    expect_albedo(s, expected, 0.02f); // of the film's wavelengths
}

// Traced vertices of an edge that is coarser than the lattice sit on the edge's own polyline, and carry its
// parameters: what is linear over the surface stays linear.
TEST(Fetch, CollapsedEdges) {
    const auto linear = [](float x, float y) { return 0.1f + 0.5f * x + 0.3f * y; };
    VaryingShape v(8, 8, linear);
    v.traced.mu = v.traced.mv = 4;
    v.traced.step_u = v.traced.step_v = 2;
    v.traced.edge_step = {4, 8, 2, 4};
    // From midway towards the nearer end, from the middle of UMax towards its second: as dicing does.
    const auto snap = [](int k, int step, int high = 0) {
        const int rest = k % step;
        return k - rest + (2 * rest > step || (2 * rest == step && 2 * k + high > 8) ? step : 0);
    };
    for (int j = 0; j <= 4; j++)
        for (int i = 0; i <= 4; i++) {
            int x = 2 * i, y = 2 * j;
            if (j == 0)
                x = snap(2 * i, 4);
            if (i == 4)
                y = snap(2 * j, 8, 1);
            if (i == 0)
                y = snap(2 * j, 4);
            for (float f : {float(x) / 8, float(y) / 8, 2.0f})
                v.traced.P.push_back(f);
        }
    TestScene s;
    s.add(v.shaded(), v.program);
    EXPECT_TRUE(s.store.shapes()[0].flags & store::ShapeRecord::Collapsed);
    look_at_unit_square(s);
    expect_albedo(s, [&](const Vec3f& p) { return linear(p.x, p.y); }, 0.02f);
}

TEST(Fetch, Meshes) {
    for (int n : {3, 4}) {
        VaryingShape v(8, 0, [](float, float) { return 0; });
        grid::TracedMesh mesh{n, {}};
        const auto reflectance = [](const Vec3f& p) { return 0.1f + 0.5f * p.x + 0.3f * p.y; };
        for (int j = 0; j < 3; j++)
            for (int i = 0; i < 3; i++) {
                const size_t at = size_t(3 * j + i), stride = size_t(v.grid.stride);
                const Vec3f p(float(i) / 2, float(j) / 2, 2);
                for (size_t c = 0; c < 3; c++) {
                    v.grid.P[c * stride + at] = p[int(c)];
                    v.inputs.slots[1].data[c * stride + at] = reflectance(p);
                }
                const auto vertex = [&](int a, int b) { return uint32_t(3 * (j + b) + i + a); };
                if (i == 2 || j == 2)
                    continue;
                if (n == 4)
                    mesh.indices.insert(mesh.indices.end(),
                                        {vertex(0, 0), vertex(1, 0), vertex(1, 1), vertex(0, 1)});
                else
                    mesh.indices.insert(mesh.indices.end(), {vertex(0, 0), vertex(1, 0), vertex(0, 1),
                                                             vertex(1, 1), vertex(0, 1), vertex(1, 0)});
            }
        TestScene s;
        s.add({&v.grid, nullptr, &mesh, &v.inputs}, v.program);
        look_at_unit_square(s);
        expect_albedo(s, reflectance, 0.02f);
    }
}

} // namespace kanuka::transport
