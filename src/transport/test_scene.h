// Small scenes made by hand for tests: grids straight into the store, no dicing or shading in between.
#pragma once

#include <array>
#include <numeric>

#include "base/tasks.h"
#include "color/color.h"
#include "transport/kernel.h"
#include "transport/scene_data.h"

namespace kanuka::transport::testing {

struct Lobe {
    grid::LobeId id;
    std::vector<Vec3f> inputs; // one per input of the lobe; floats in x
    float weight = 1;
};

// Leaves joined under Add nodes; all slots uniform.
inline grid::LayeringProgram make_program(const std::vector<Lobe>& lobes, std::vector<Vec3f>& values) {
    grid::LayeringProgram p;
    int root = -1;
    for (const Lobe& l : lobes) {
        grid::LayerNode n;
        n.lobe = l.id;
        const auto add = [&](grid::InputType type, grid::Storage storage, float low, float high, Vec3f v) {
            p.slots.push_back({type, storage, low, high, true, ""});
            values.push_back(v);
            return int(p.slots.size()) - 1;
        };
        n.weight = add(grid::InputType::Float, grid::Storage::Half, 0, 1, {l.weight, 0, 0});
        const auto& decl = grid::lobe(l.id);
        for (size_t i = 0; i < decl.inputs.size(); i++)
            n.inputs.push_back(add(decl.inputs[i].type, decl.inputs[i].storage, decl.inputs[i].low, decl.inputs[i].high, l.inputs[i]));
        p.nodes.push_back(n);
        const int leaf = int(p.nodes.size()) - 1;
        if (root >= 0) {
            grid::LayerNode add_node;
            add_node.op = grid::LayerOp::Add;
            add_node.upper = root;
            add_node.lower = leaf;
            p.nodes.push_back(add_node);
            root = int(p.nodes.size()) - 1;
        } else
            root = leaf;
    }
    return p;
}

class TestScene {
  public:
    store::Store store;
    SceneInputs inputs;
    std::unique_ptr<bvh::Scene> bvh;
    SceneView view;
    std::vector<float> filter{-0.5f, 0.5f};
    Journal journal;

    // A lattice of (mu + 1) x (mv + 1) points; normals from `normal` or flat.
    void add_lattice(int mu, int mv, const std::vector<Vec3f>& points, const std::vector<Vec3f>& normals, const std::vector<Lobe>& lobes) {
        grid::Grid g;
        g.allocate(mu, mv);
        grid::TracedGrid t;
        t.mu = mu;
        t.mv = mv;
        for (int i = 0; i < g.vertices(); i++)
            for (int c = 0; c < 3; c++) {
                g.P[size_t(c * g.stride + i)] = points[size_t(i)][c];
                g.N[size_t(c * g.stride + i)] = normals[size_t(i)][c];
                t.P.push_back(points[size_t(i)][c]);
            }
        std::vector<Vec3f> values;
        const auto program = make_program(lobes, values);
        grid::VertexInputs in;
        in.stride = g.stride;
        for (const Vec3f& v : values)
            in.slots.push_back({true, v, {}});
        const store::ShadedGrid shaded[] = {{&g, &t, nullptr, &in}};
        uint64_t bad = 0;
        const auto page = store::encode(shaded, program, ++m_id, bad);
        store.add_page(page, store.add_program(program), -1);
    }
    void add_quad(Vec3f p, Vec3f ex, Vec3f ey, const std::vector<Lobe>& lobes) {
        const Vec3f n = normalize(cross(ex, ey));
        add_lattice(1, 1, {p - ex - ey, p + ex - ey, p - ex + ey, p + ex + ey}, {n, n, n, n}, lobes);
    }
    void add_sphere(Vec3f center, float radius, int n, const std::vector<Lobe>& lobes) {
        std::vector<Vec3f> points, normals;
        for (int j = 0; j <= n; j++)
            for (int i = 0; i <= 2 * n; i++) {
                const float a = Pi * float(i % (2 * n)) / float(n), b = Pi * float(j) / float(n);
                Vec3f d{std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)};
                if (j == 0 || j == n)
                    d = {0, 0, j == 0 ? 1.0f : -1.0f};
                normals.push_back(d);
                points.push_back(center + d * radius);
            }
        add_lattice(2 * n, n, points, normals, lobes);
    }
    // Camera at the origin of render space, looking along +z of `look`.
    void camera(Vec3f right, Vec3f up, Vec3f forward, float half_width, int width, int height) {
        CameraView& c = inputs.camera;
        c.perspective = true;
        c.right = half_width;
        c.left = -half_width;
        c.top = half_width * float(height) / float(width);
        c.bottom = -c.top;
        c.width = width;
        c.height = height;
        const Vec3f columns[3] = {right, up, forward};
        for (int r = 0; r < 3; r++) {
            for (int k = 0; k < 3; k++)
                c.render_from_camera[4 * r + k] = columns[k][r];
            c.render_from_camera[4 * r + 3] = 0;
        }
    }
    void finish() {
        bvh::GroupDesc world;
        world.shapes.push_back({0, int(store.shapes().size())});
        bvh = std::make_unique<bvh::Scene>(store, std::span(&world, 1), false);
        inputs.store = &store;
        inputs.bvh = bvh.get();
        inputs.world = world;
        inputs.filter_x = inputs.filter_y = filter;
        view = make_scene_view(inputs, journal);
    }
    // Sums over progressions [0, n), divided by n.
    std::vector<PixelSums> render(int progressions, int lanes) {
        const int w = inputs.camera.width, h = inputs.camera.height;
        std::vector<PixelSums> pixels(size_t(w * h), PixelSums{});
        const int across = (w + 31) / 32, down = (h + 31) / 32;
        tasks::parallel_for(size_t(across * down), [&](size_t b) {
            auto kernel = make_kernel(view, lanes);
            BatchCounts counts;
            for (int p = 0; p < progressions; p++) {
                BatchRequest r;
                r.x0 = int(b) % across * 32, r.y0 = int(b) / across * 32;
                r.x1 = std::min(w, r.x0 + 32), r.y1 = std::min(h, r.y0 + 32);
                r.progression = uint32_t(p);
                r.pixels = pixels.data();
                r.stride = w;
                kernel->trace(r, counts);
            }
        });
        for (auto& p : pixels)
            for (int c = 0; c < 3; c++)
                p.rgb[c] /= float(progressions);
        return pixels;
    }

  private:
    int m_id = 0;
};

} // namespace kanuka::transport::testing
