// Small things in large scenes: nodes with eight bits a plane have boxes as coarse as they are wide
// themselves.
#include <gtest/gtest.h>

#include "hierarchy/node_lanes.h"
#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::testing {
namespace {

// A ball of triangles about the origin; beside it, if asked for, ground that is so wide.
PageMemory ball_on_ground(float width) {
    constexpr int Around = 64, Down = 32;
    std::vector<float> positions;
    std::vector<uint32_t> corners;
    const auto add = [&](float x, float y, float z) { positions.insert(positions.end(), {x, y, z}); };
    for (int j = 0; j <= Down; j++)
        for (int i = 0; i < Around; i++) {
            const float theta = float(M_PI) * float(j) / Down, phi = 2 * float(M_PI) * float(i) / Around;
            add(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
        }
    for (uint32_t j = 0; j < Down; j++)
        for (uint32_t i = 0; i < Around; i++) {
            const uint32_t a = j * Around + i, b = j * Around + (i + 1) % Around, c = a + Around,
                           d = b + Around;
            corners.insert(corners.end(), {a, b, c, b, d, c});
        }
    std::vector<MeshView> meshes{
        {positions.data(), positions.size() / 3, corners.data(), corners.size() / 3}};
    const std::vector<float> ground{-width, -1, -width, width,  -1, -width,
                                    width,  -1, width,  -width, -1, width};
    const std::vector<uint32_t> ground_corners{0, 1, 2, 0, 2, 3};
    if (width > 0)
        meshes.push_back({ground.data(), 4, ground_corners.data(), 2});
    const Content content{{}, meshes};
    return build(content, Lattice{});
}

// Nodes that rays look at which start on the ball, in the mean.
double nodes_a_ray(const Page& page) {
    constexpr int Rays = 2000;
    Random random(5);
    uint64_t nodes = 0;
    for (int n = 0; n < Rays; n++) {
        const Vec3f from = random.direction();
        const TracedRay ray(Ray{from * 1.001f, 0, random.direction()});
        std::vector<Ref> todo{page.header().root};
        while (!todo.empty()) {
            const Ref ref = todo.back();
            todo.pop_back();
            if (is_leaf(ref))
                continue;
            nodes++;
            const Node& node = page.at<Node>(ref);
            alignas(32) uint32_t keys[8];
            const Entered entered = enter_children(node, ray).sorted();
            _mm256_store_si256(reinterpret_cast<__m256i*>(keys), entered.keys);
            for (int k = 0; k < entered.count; k++)
                todo.push_back(Children::of(node.children).ref(keys[k] & 7));
        }
    }
    return double(nodes) / Rays;
}

} // namespace

// The ground's own nodes are some of those. To open small boxes in a node as wide as the ground, whose steps
// are wider than they are, has rays look at all of them: 4.5 nodes more instead of 2.8.
TEST(Stadium, CostsFewNodesMoreThanWhatStandsInIt) {
    const double alone = nodes_a_ray(ball_on_ground(0).page());
    for (const float width : {10.0f, 1e3f, 1e5f}) {
        const double more = nodes_a_ray(ball_on_ground(width).page()) - alone;
        EXPECT_LT(more, 3.5) << width << ", of " << alone;
    }
}

} // namespace kanuka::hierarchy::testing
