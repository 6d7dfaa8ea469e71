// Meshes of quads: as the triangles that they are cut into, and numbered as those.
#include <gtest/gtest.h>

#include "hierarchy/decode.h"
#include "hierarchy/test_oracle.h"
#include "hierarchy/trace.h"

namespace kanuka::hierarchy::testing {
namespace {

// Quads of a wavy sheet behind a mesh of one triangle; the same as triangles alone.
struct Sheet {
    std::vector<float> positions;
    std::vector<uint32_t> quads, triangles;
    std::vector<float> first{5, 5, 5, 6, 5, 5, 5, 6, 5};
    std::vector<uint32_t> first_corners{0, 1, 2};

    explicit Sheet(int side) {
        for (int j = 0; j <= side; j++)
            for (int i = 0; i <= side; i++) {
                const Vec3f p(float(i), float(j), 2 * waves({float(i), float(j), 1}, 0.7f));
                positions.insert(positions.end(), {p.x, p.y, p.z});
            }
        const uint32_t row = uint32_t(side) + 1;
        for (uint32_t j = 0; j < uint32_t(side); j++)
            for (uint32_t i = 0; i < uint32_t(side); i++) {
                const uint32_t a = j * row + i, b = a + 1, c = a + row + 1, d = a + row;
                quads.insert(quads.end(), {a, b, c, d});
                triangles.insert(triangles.end(), {a, b, d, c, d, b});
            }
    }
    std::vector<MeshView> views(bool as_quads) const {
        const size_t vertices = positions.size() / 3;
        return {{first.data(), 3, first_corners.data(), 1},
                as_quads ? MeshView{positions.data(), vertices, quads.data(), quads.size() / 4, 4}
                         : MeshView{positions.data(), vertices, triangles.data(), triangles.size() / 3}};
    }
};

} // namespace

TEST(Quads, AreHitAsTheTrianglesThatTheyAreCutInto) {
    constexpr int Side = 30;
    const Sheet sheet(Side);
    PageMemory pages[2];
    for (const bool as_quads : {false, true}) {
        const std::vector<MeshView> views = sheet.views(as_quads);
        const Content content{{}, views};
        pages[as_quads] = build(content, votes_of(content).lattice());
        EXPECT_EQ(refusal_of(pages[as_quads].bytes()), "");
    }
    Random random(3);
    std::vector<Ray> rays;
    for (int i = 0; i < 4000; i++)
        rays.push_back({random.in_box(20) + Vec3f(Side / 2, Side / 2, 0), 0, random.direction()});
    std::vector<Hit> hits[2];
    for (int k = 0; k < 2; k++) {
        hits[k].resize(rays.size());
        closest(pages[k].page(), rays, hits[k]);
    }
    int found = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        ASSERT_EQ(hits[0][i].found(), hits[1][i].found()) << i;
        if (!hits[0][i].found())
            continue;
        found++;
        // The order of the corners of a triangle is the same, so distances and places are to the bit.
        EXPECT_EQ(hits[0][i].t, hits[1][i].t);
        EXPECT_EQ(pages[0].page().name(hits[0][i].leaf, int(hits[0][i].primitive)),
                  pages[1].page().name(hits[1][i].leaf, int(hits[1][i].primitive)));
        EXPECT_EQ(hits[0][i].u, hits[1][i].u);
        EXPECT_EQ(hits[0][i].v, hits[1][i].v);
    }
    EXPECT_GT(found, 400);
}

TEST(Quads, WithACornerThatIsNowhereKeepTheirOtherHalf) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> positions = {nan, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    const std::vector<uint32_t> corners = {0, 1, 2, 3};
    const MeshView view{positions.data(), 4, corners.data(), 1, 4};
    const Content content{{}, {&view, 1}};
    const PageMemory memory = build(content, votes_of(content).lattice());
    const Ray rays[2] = {{{0.8f, 0.8f, 1}, 0, {0, 0, -1}}, {{0.2f, 0.2f, 1}, 0, {0, 0, -1}}};
    Hit hits[2];
    closest(memory.page(), rays, hits);
    ASSERT_TRUE(hits[0].found());
    EXPECT_EQ(memory.page().name(hits[0].leaf, int(hits[0].primitive)), 1u);
    EXPECT_FALSE(hits[1].found());
}

} // namespace kanuka::hierarchy::testing
