// Small scenes made by hand for tests: grids straight into the store, no dicing or shading in between.
#pragma once

#include <array>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <span>

#include "base/tasks.h"
#include "base/test_statistics.h"
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
        for (size_t i = 0; i < l.inputs.size(); i++) { // those not given keep their defaults
            n.inputs.push_back(add(decl.inputs[i].type, decl.inputs[i].storage, decl.inputs[i].low,
                                   decl.inputs[i].high, l.inputs[i]));
            p.slots.back().between = decl.inputs[i].between();
        }
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
    SceneData data;
    SceneView view; // data.view, which tests may change
    std::vector<float> filter{-0.5f, 0.5f};
    Journal journal;
    std::vector<bvh::GroupDesc> groups;
    int most_slots = 1 << 20;
    store::Links links; // of shapes to come
    uint64_t unnumbered = 0;

    // A lattice of (mu + 1) x (mv + 1) points; normals from `normal` or flat.
    void add_lattice(int mu, int mv, const std::vector<Vec3f>& points, const std::vector<Vec3f>& normals,
                     const std::vector<Lobe>& lobes, int interior = -1, bool smooth = false) {
        grid::Grid g;
        g.allocate(mu, mv);
        grid::TracedGrid t;
        t.mu = mu;
        t.mv = mv;
        for (int i = 0; i < g.vertices(); i++)
            for (int c = 0; c < 3; c++) {
                g.P[size_t(c * g.stride + i)] = points[size_t(i)][c];
                g.N[size_t(c * g.stride + i)] = normals[size_t(i)][c];
                const int k = i % (mu + 1) < mu ? i : i - 1; // along u
                g.dPdu[size_t(c * g.stride + i)] = points[size_t(k) + 1][c] - points[size_t(k)][c];
                t.P.push_back(points[size_t(i)][c]);
            }
        std::vector<Vec3f> values;
        const auto program = make_program(lobes, values);
        grid::VertexInputs in;
        in.stride = g.stride;
        for (const Vec3f& v : values)
            in.slots.push_back({true, v, {}});
        add({&g, &t, nullptr, &in, smooth}, program, interior);
    }
    // A quad that changes its shape: corners (-,-), (+,-), (-,+), (+,+) at every step; flat normals of each.
    void add_moving_quad(const std::vector<std::array<Vec3f, 4>>& steps, const std::vector<Lobe>& lobes) {
        grid::Grid g;
        g.allocate(1, 1);
        grid::TracedGrid t;
        t.mu = t.mv = 1;
        for (size_t k = 0; k < steps.size(); k++) {
            const auto& p = steps[k];
            const Vec3f n = normalize(cross(p[1] - p[0], p[2] - p[0]));
            std::vector<float> P(3 * size_t(g.stride)), N(P.size()), packed;
            for (size_t i = 0; i < 4; i++)
                for (int c = 0; c < 3; c++) {
                    P[size_t(c * g.stride) + i] = p[i][c];
                    N[size_t(c * g.stride) + i] = n[c];
                    packed.push_back(p[i][c]);
                }
            if (k == 0)
                g.P = P, g.N = N, t.P = packed;
            else
                g.later.push_back({P, N}), t.later.push_back(packed);
        }
        std::vector<Vec3f> values;
        const auto program = make_program(lobes, values);
        grid::VertexInputs in;
        in.stride = g.stride;
        for (const Vec3f& v : values)
            in.slots.push_back({true, v, {}});
        add({&g, &t, nullptr, &in}, program);
    }
    void add(const store::ShadedGrid& shaded, const grid::LayeringProgram& program, int interior = -1) {
        uint64_t bad = 0;
        const auto page = store::encode(std::span(&shaded, 1), program, bad);
        store.add_page(page, program, interior, links, ++m_id);
    }
    void add_quad(Vec3f p, Vec3f ex, Vec3f ey, const std::vector<Lobe>& lobes, int interior = -1) {
        const Vec3f n = normalize(cross(ex, ey));
        add_lattice(1, 1, {p - ex - ey, p + ex - ey, p - ex + ey, p + ex + ey}, {n, n, n, n}, lobes,
                    interior);
    }
    void add_sphere(Vec3f center, float radius, int n, const std::vector<Lobe>& lobes, int interior = -1,
                    bool smooth = false) {
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
        add_lattice(2 * n, n, points, normals, lobes, interior, smooth);
    }
    // Camera at the origin of render space, looking along +z of `look`.
    void camera(Vec3f right, Vec3f up, Vec3f forward, float half_width, int width, int height) {
        CameraView& c = inputs.camera;
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
    // Shapes from `first_instance` on are one group, instanced once.
    void finish(int first_instance = -1, const Transform& world_from_group = Transform()) {
        const int count = int(store.shapes().size()), flat = first_instance < 0 ? count : first_instance;
        groups.assign(first_instance < 0 ? 1 : 2, {});
        bvh::GroupDesc& world = groups.back();
        world.shapes.push_back({0, flat});
        if (first_instance >= 0) {
            groups[0].shapes.push_back({flat, count - flat});
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 4; c++)
                    m_transforms.push_back(float(world_from_group.m[size_t(r)][size_t(c)]));
            world.instances.push_back({0, m_transforms});
        }
        finish(groups);
    }
    // All groups in pages of our own hierarchy, if the environment asks for it: one of the suite's runs does.
    static bvh::Scene::Build traced_by() {
        bvh::Scene::Build build;
        if (std::getenv("KANUKA_TEST_PAGES"))
            build.pages_from = 0;
        return build;
    }
    // The last group is the world. What the groups point to must stay.
    void finish(std::span<bvh::GroupDesc> groups) {
        unnumbered = bvh::number_emitters(store, groups, most_slots);
        bvh = std::make_unique<bvh::Scene>(store, groups, traced_by());
        inputs.store = &store;
        inputs.bvh = bvh.get();
        inputs.groups = groups;
        inputs.instanced = !groups.back().instances.empty();
        inputs.camera.filter.x = inputs.camera.filter.y = filter;
        data = SceneData(inputs, journal);
        view = data.view;
    }
    uint64_t nan_samples = 0; // of the last render
    // Sums over progressions [0, n), divided by n.
    std::vector<PixelSums> render(int progressions, int lanes) {
        const int w = inputs.camera.width, h = inputs.camera.height;
        std::vector<PixelSums> pixels(size_t(w * h), PixelSums{});
        const int across = (w + 31) / 32, down = (h + 31) / 32;
        std::atomic<uint64_t> bad{0};
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
            bad += counts.nan_samples;
        });
        nan_samples = bad;
        for (auto& p : pixels)
            for (int c = 0; c < 3; c++)
                p.rgb[c] /= std::max(float(progressions) - p.dropped, 1.0f);
        return pixels;
    }

    // Mean of the picture, a channel, and its error: over `seeds` renders of their own.
    struct Estimate {
        kanuka::testing::RunningMean channel[3];
        uint64_t nan_samples = 0;
    };
    Estimate estimate(int progressions, int seeds, int lanes = 8) {
        Estimate e;
        for (int seed = 0; seed < seeds; seed++) {
            view.settings.seed = uint32_t(seed);
            const auto pixels = render(progressions, lanes);
            e.nan_samples += nan_samples;
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (const PixelSums& p : pixels)
                    sum += double(p.rgb[c]);
                e.channel[c].add(sum / double(pixels.size()));
            }
        }
        return e;
    }

    // From the camera through the middle of a pixel, in camera space, z = 1.
    Vec3f pixel_direction(int x, int y) const {
        const CameraView& c = inputs.camera;
        return {c.left + (c.right - c.left) * (float(x) + 0.5f) / float(c.width),
                c.top + (c.bottom - c.top) * (float(y) + 0.5f) / float(c.height), 1};
    }

  private:
    int m_id = 0;
    std::vector<float> m_transforms;
};

// One lobe and what it costs to write it down.
inline Lobe matte(const Rgb& reflectance, float weight = 1) {
    return {grid::LobeId::LambertBrdf, {reflectance}, weight};
}
inline Lobe metal(float roughness, const Rgb& face = Rgb(1), const Rgb& edge = Rgb(1)) {
    return {grid::LobeId::MicrofacetConductorBrdf, {face, edge, Vec3f(roughness)}};
}
inline Lobe glass(float roughness, float ior = 1.5f) {
    return {grid::LobeId::MicrosurfaceDielectricBsdfRgb_v1, {Vec3f(roughness), Rgb(1), Rgb(1), Vec3f(ior)}};
}
inline Lobe prism(float roughness, float ior, float abbe) {
    Lobe l = glass(roughness, ior);
    l.inputs.push_back(Vec3f(abbe));
    return l;
}
inline Lobe emission(const Rgb& radiance) {
    return {grid::LobeId::DiffuseEmission, {radiance}};
}
inline scene::Light constant_sky(const Rgb& radiance) {
    scene::Light l;
    l.kind = scene::Light::Kind::Environment;
    l.amount = radiance;
    return l;
}

} // namespace kanuka::transport::testing
