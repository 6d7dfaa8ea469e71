// A plain under any number of lights, for tests and for bench/light_bench.cpp: clusters that differ in power,
// so that what matters at a point is near it, or strong. All lights together keep their area whatever their
// number: where they fill the view, directions drawn from the material find them as well as any choice of
// light does, and facets hide one another.
#pragma once

#include <random>

#include "transport/test_scene.h"

namespace kanuka::transport::testing {

// LitFacets: of a hundred thousand facets in all, which every ray has to get past; the others are dark.
enum class ManyLights { Points, Spheres, Triangles, LitFacets };

struct ManyLightsScene : TestScene {
    static constexpr float Floor = -30;
    static constexpr int Facets = 100000; // of LitFacets

    ManyLightsScene(ManyLights kind, int count, int size) {
        const float half = 20, size_of_one = std::sqrt(1000.0f / float(count));
        add_quad({0, Floor, 0}, {0, 0, half}, {half, 0, 0}, {matte(Rgb(0.7f))});
        for (int i = 0; i < 12; i++) // something to cast shadows
            add_quad({-16.0f + 3 * float(i), Floor + 0.5f, -14 + 6 * float(i % 5)}, {0.4f, 0, 0},
                     {0, 0.5f, 0}, {matte(Rgb(0.5f))});
        std::mt19937 g{uint32_t(count)};
        std::uniform_real_distribution<float> u(0, 1);
        const auto clustered = [&](int n) {
            std::vector<Vec3f> places;
            Vec3f cluster(0, 0, 0);
            for (int i = 0; i < n; i++) {
                if (i % std::max(n / 50, 1) == 0)
                    cluster = {half * (2 * u(g) - 1), Floor + 0.8f + 1.5f * u(g), half * (2 * u(g) - 1)};
                places.push_back(cluster + Vec3f(u(g) - 0.5f, 0.6f * (u(g) - 0.5f), u(g) - 0.5f) * 2.0f);
                places.back().y = std::max(places.back().y, Floor + 0.2f);
            }
            return places;
        };
        const std::vector<Vec3f> places = clustered(count);
        std::vector<float> powers;
        for (int i = 0; i < count; i++)
            powers.push_back(std::exp(2 * u(g)));
        float total = 0;
        for (float p : powers)
            total += p;
        for (size_t i = 0; i < places.size(); i++) {
            const float power = 200 * powers[i] / total;
            scene::Light light;
            light.world_from_light = Transform::translate(places[i].x, places[i].y, places[i].z);
            light.kind = scene::Light::Kind::Point;
            light.amount = Rgb(power);
            if (kind == ManyLights::Spheres) {
                light.kind = scene::Light::Kind::Sphere;
                light.radius = 0.02f * size_of_one;
                light.visible_camera = false;
                light.amount = Rgb(power / (Pi * light.radius * light.radius));
            }
            if (kind == ManyLights::Points || kind == ManyLights::Spheres)
                inputs.lights.push_back(light);
        }
        if (kind == ManyLights::Triangles)
            add_facets(places, powers, 200 / total, 0.03f * size_of_one);
        if (kind == ManyLights::LitFacets) {
            const float side = 0.03f * std::sqrt(1000.0f / Facets);
            add_facets(places, powers, 200 / total, side);
            for (const Vec3f& place : clustered(Facets - count))
                add_quad(place, {side, 0, 0}, {0, 0, side}, {matte(Rgb(0.0f))});
        }
        camera({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, 0.6f, size, size); // facets turn their backs to it
        inputs.max_depth = 2;
        finish();
    }

    // What uniform choice would do: the same hierarchy, every leaf as likely as any.
    void make_uniform() {
        LargeVector<LightNode>& nodes = data.lights.tree.nodes;
        std::vector<double> leaves(nodes.size(), 0);
        for (size_t n = nodes.size(); n-- > 0;) {
            LightNode& node = nodes[n];
            for (int k = 0; k < LightNode::Width; k++) {
                if (!(node.power[k] > 0))
                    continue;
                const double count = node.child[k] < 0 ? 1 : leaves[size_t(node.child[k])];
                leaves[n] += count;
                node.power[k] = float(count);
                node.x[k] = node.y[k] = node.z[k] = 0;
                node.radius[k] = 1e6f;
            }
        }
    }

  private:
    // Each a lattice of its own power: one mesh would do for geometry, but radiance goes by shape.
    void add_facets(const std::vector<Vec3f>& places, const std::vector<float>& powers, float scale,
                    float side) {
        const size_t n = places.size();
        for (size_t i = 0; i < n; i++) {
            const float radiance = powers[i] * scale / (4 * side * side);
            add_quad(places[i], {side, 0, 0}, {0, 0, side}, {emission(Rgb(radiance))});
        }
    }
};

} // namespace kanuka::transport::testing
