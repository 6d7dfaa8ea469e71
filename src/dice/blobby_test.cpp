// Blobbies as meshes: where their surface lies, that it is closed, what it is coloured.
#include <gtest/gtest.h>

#include <bit>
#include <filesystem>
#include <fstream>

#include "base/tasks.h"
#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

std::vector<float> ball(float x, float y, float z, float size) {
    return {size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, x, y, z, 1};
}

scene::Primitive blobby(std::vector<int32_t> code, const std::vector<std::vector<float>>& blobs,
                        std::vector<float> colors = {}) {
    scene::Blobby b;
    std::vector<float> all;
    for (const auto& f : blobs)
        all.insert(all.end(), f.begin(), f.end());
    b.code = std::move(code);
    b.floats = std::move(all);
    b.leaves = int(blobs.size());
    scene::Primitive p = primitive(std::move(b));
    if (!colors.empty())
        p.primvars.set(test::floats("Cs", Type::Color, Detail::Vertex, std::move(colors)));
    return p;
}

Diced run(const scene::Primitive& p, const DiceOptions& o = looking(3), DiceTarget target = {}) {
    Journal journal;
    Diced d = dice::dice(p, target, o, {}, journal);
    EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
    return d;
}

size_t open_edges(const Diced& d) {
    EdgeCount count;
    const auto at = [&](uint32_t i) {
        const Vec3f p = d.mesh_vertices.position(int(i));
        return positive_zero({p.x, p.y, p.z});
    };
    const auto& v = d.mesh.indices;
    for (size_t f = 0; f < v.size(); f += 4) {
        count.triangle(at(v[f]), at(v[f + 1]), at(v[f + 3]));
        count.triangle(at(v[f + 2]), at(v[f + 3]), at(v[f + 1]));
    }
    return count.open();
}

double volume(const Diced& d) {
    double six = 0;
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        six += double(dot(d.mesh_vertices.position(int(a)),
                          cross(d.mesh_vertices.position(int(b)), d.mesh_vertices.position(int(c)))));
    };
    const auto& v = d.mesh.indices;
    for (size_t f = 0; f < v.size(); f += 4) {
        add(v[f], v[f + 1], v[f + 3]);
        add(v[f + 2], v[f + 3], v[f + 1]);
    }
    return six / 6;
}

} // namespace

TEST(Blobby, OneBallIsHalfItsSupport) {
    const Diced d = run(blobby({1001, 0}, {ball(0.3f, -0.2f, 0.1f, 2)}));
    ASSERT_TRUE(d.is_mesh);
    ASSERT_GT(d.mesh_vertices.vertices(), 5000);
    const Vec3f center{0.3f, -0.2f, 0.1f};
    for (int i = 0; i < d.mesh_vertices.vertices(); i++) {
        const Vec3f r = d.mesh_vertices.position(i) - center;
        ASSERT_NEAR(length(r), 1, 2e-4f);
        ASSERT_GT(dot(normalize(d.mesh_vertices.normal(i)), normalize(r)), 0.9999f);
    }
    EXPECT_EQ(open_edges(d), 0u);
    EXPECT_NEAR(volume(d), 4.0 / 3 * double(Pi), 0.02); // counterclockwise from outside
    // A mirroring transform turns nothing inside out.
    DiceTarget mirror;
    mirror.page_from_object = Transform::scale(-1, 1, 1);
    EXPECT_NEAR(volume(run(blobby({1001, 0}, {ball(0, 0, 0, 2)}), looking(3), mirror)), 4.0 / 3 * double(Pi),
                0.02);
}

TEST(Blobby, ASegmentIsACapsule) {
    std::vector<float> f{-1, 0, 0, 1, 0, 0, 0.8f};
    for (const float x : ball(0, 0, 0, 1))
        f.push_back(x);
    const Diced d = run(blobby({1002, 0}, {f}));
    for (int i = 0; i < d.mesh_vertices.vertices(); i++) {
        const Vec3f p = d.mesh_vertices.position(i);
        ASSERT_NEAR(length(p - Vec3f(std::clamp(p.x, -1.0f, 1.0f), 0, 0)), 0.4f, 2e-4f);
    }
    EXPECT_EQ(open_edges(d), 0u);
}

TEST(Blobby, OperationsHoldOnTheSurface) {
    // Two overlapping bumps, and what each operation makes of them at a vertex.
    const auto f = [](const Vec3f& p, float x) {
        const float r2 = length_squared(p - Vec3f(x, 0, 0)) / 4;
        return r2 < 1 ? (1 - r2) * (1 - r2) * (1 - r2) : 0.0f;
    };
    const std::vector<std::vector<float>> blobs{ball(-0.6f, 0, 0, 2), ball(0.6f, 0, 0, 2)};
    struct Case {
        std::vector<int32_t> code;
        std::function<float(float, float)> value;
    };
    const Case cases[] = {
        {{0, 2, 0, 1}, [](float a, float b) { return a + b; }},
        {{1, 2, 0, 1}, [](float a, float b) { return a * b; }},
        {{2, 2, 0, 1}, [](float a, float b) { return std::max(a, b); }},
        {{3, 2, 0, 1}, [](float a, float b) { return std::min(a, b); }},
        {{4, 0, 1}, [](float a, float b) { return b - a; }},
        {{6, 0, 0, 2, 1, 2}, [](float a, float b) { return b - a; }},
        {{7, 0}, [](float a, float) { return a; }},
        // 2 a / (1 + b)
        {{1000, 32, 0, 2, 2, 1, 0, 2, 0, 0, 5, 4, 3}, [](float a, float b) { return 2 * a / (1 + b); }},
    };
    for (const Case& c : cases) {
        std::vector<int32_t> code{1001, 0, 1001, 16};
        code.insert(code.end(), c.code.begin(), c.code.end());
        scene::Primitive p = blobby(code, {blobs[0], blobs[1], {1}});
        std::get<scene::Blobby>(p.geometry).leaves = 2;
        const Diced d = run(p, looking(3, 128));
        ASSERT_GT(d.mesh_vertices.vertices(), 300);
        size_t off = 0;
        for (int i = 0; i < d.mesh_vertices.vertices(); i++) {
            const Vec3f q = d.mesh_vertices.position(i);
            off += std::abs(c.value(f(q, -0.6f), f(q, 0.6f)) - 0.421875f) > 2e-3f;
        }
        // Across the edges of max and min vertices stay within their cells.
        EXPECT_LE(off, size_t(d.mesh_vertices.vertices()) / 20) << c.code[0];
        EXPECT_EQ(open_edges(d), 0u) << c.code[0];
    }
}

TEST(Blobby, VertexValuesFollowTheField) {
    const Diced d = run(blobby({1001, 0, 1001, 16, 0, 2, 0, 1}, {ball(-0.5f, 0, 0, 2), ball(0.5f, 0, 0, 2)},
                               {1, 0, 0, 0, 0, 1}));
    const grid::Channel& color = d.mesh_vertices.primvars.at(0);
    for (int i = 0; i < d.mesh_vertices.vertices(); i++) {
        const float red = color.component(0)[i], blue = color.component(2)[i];
        ASSERT_NEAR(red + blue, 1, 1e-5f);
        const float x = d.mesh_vertices.position(i).x;
        ASSERT_TRUE(std::abs(x) < 0.02f || (x < 0) == (red > blue)) << x;
    }
}

TEST(Blobby, ConstantsMayHaveValues) {
    // A constant, a ball, the larger of them: the ball's value is the second where nleaf is 2, the first
    // where it is 1.
    for (const int leaves : {1, 2}) {
        scene::Primitive p = blobby({1000, 16, 1001, 0, 2, 2, 0, 1}, {ball(0, 0, 0, 2), {0.0f}});
        std::get<scene::Blobby>(p.geometry).leaves = leaves;
        p.primvars.set(
            test::floats("Cs", Type::Color, Detail::Vertex,
                         leaves == 1 ? std::vector<float>{0, 1, 0} : std::vector<float>{1, 0, 0, 0, 1, 0}));
        const Diced d = run(p);
        const grid::Channel& color = d.mesh_vertices.primvars.at(0);
        ASSERT_GT(d.mesh_vertices.vertices(), 100);
        for (int i = 0; i < d.mesh_vertices.vertices(); i++)
            ASSERT_NEAR(color.component(1)[i], 1, 1e-5f);
    }
}

TEST(Blobby, PlugInsAddNothingAndAreNamed) {
    // An ellipsoid, a plug-in with two floats and no strings, their sum: as the ellipsoid alone.
    scene::Primitive p = blobby({1001, 0, 1004, 0, 2, 16, 0, 0, 0, 2, 0, 1}, {ball(0, 0, 0, 2), {1, 2}});
    std::get<scene::Blobby>(p.geometry).strings = std::vector<std::string>{"cube.so"};
    Journal journal;
    const Diced d = dice::dice(p, {}, looking(3), {}, journal);
    EXPECT_NEAR(volume(d), volume(run(blobby({1001, 0}, {ball(0, 0, 0, 2)}))), 1e-6);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("the plug-in \"cube.so\", adds nothing"), std::string::npos);
}

TEST(Blobby, UnknownOperationsThatCountTheirOperandsArePassedOver) {
    // AIR's dynamic blob (9000), a leaf as it says, between an ellipsoid and their sum.
    scene::Primitive p =
        blobby({1001, 0, 9000, 4, 0, 80, 1, 96, 0, 2, 0, 1}, {ball(0, 0, 0, 2)}, {1, 0, 0, 0, 1, 0});
    std::get<scene::Blobby>(p.geometry).leaves = 2;
    Journal journal;
    const Diced d = dice::dice(p, {}, looking(3), {}, journal);
    EXPECT_NEAR(volume(d), volume(run(blobby({1001, 0}, {ball(0, 0, 0, 2)}))), 1e-6);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("the operation 9000 is not known; its 4 operands"),
              std::string::npos)
        << journal.entries()[0].message;
}

TEST(Blobby, DivisionByNothingIsNothing) {
    // A large ball over a small one beside its middle: none of it but where the small one is.
    const Diced d =
        run(blobby({1001, 0, 1001, 16, 5, 0, 1}, {ball(0, 0, 0, 2), ball(0.5f, 0, 0, 1)}), looking(3, 128));
    ASSERT_GT(d.mesh_vertices.vertices(), 300);
    for (int i = 0; i < d.mesh_vertices.vertices(); i++) {
        const Vec3f p = d.mesh_vertices.position(i);
        ASSERT_LT(length(p - Vec3f(0.5f, 0, 0)), 1.05f);
    }
    EXPECT_EQ(open_edges(d), 0u);
    Journal journal;
    const Diced none = dice::dice(blobby({1001, 0, 1001, 16, 5, 0, 1}, {ball(0, 0, 0, 1), ball(3, 0, 0, 1)}),
                                  {}, looking(3), {}, journal);
    EXPECT_TRUE(none.mesh.indices.empty()) << "nothing is everywhere";
}

TEST(Blobby, BadCodesAreReportedAndHugeOnesBounded) {
    Journal journal;
    for (const std::vector<int32_t>& code : std::vector<std::vector<int32_t>>{{1001, 0, 0, 2, 0, 9},
                                                                              {1001, 5},
                                                                              {1001},
                                                                              {77},
                                                                              {9000, 1 << 30, 0},
                                                                              {9000, -1},
                                                                              {9000},
                                                                              {0, 1 << 30, 0},
                                                                              {1003, 0, 0},
                                                                              {1000, 0},
                                                                              {1001, -4}}) {
        const Diced d = dice::dice(blobby(code, {ball(0, 0, 0, 1)}), {}, looking(3), {}, journal);
        EXPECT_TRUE(d.mesh.indices.empty()) << code[0];
    }
    EXPECT_GE(journal.entries().size(), 9u);
    Journal coarse;
    DiceOptions near = looking(3, 200000);
    const Diced d = dice::dice(blobby({1001, 0}, {ball(0, 0, 0, 2)}), {}, near, {}, coarse);
    ASSERT_EQ(coarse.entries().size(), 1u);
    EXPECT_NE(coarse.entries()[0].message.find("times larger than micropolygons"), std::string::npos);
    EXPECT_GT(d.mesh_vertices.vertices(), 100000);
}

// Depths of a floor at world z = 0, seen from z = 10 looking down, 8 units each way; half of it lies 1
// higher.
static std::string depth_file(bool turned) {
    const int n = 64;
    std::vector<uint32_t> words{0x2F0867AB, uint32_t(n) | uint32_t(n) << 16};
    const float screen[16] = {0.25f, 0, 0, 0, 0, 0.25f, 0, 0, 0, 0, -1, 0, 0, 0, 10, 1};
    const float camera[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 10, 1};
    for (const float* m : {screen, camera})
        for (int i = 0; i < 16; i++)
            words.push_back(std::bit_cast<uint32_t>(m[i]));
    for (int i = 0; i < n * n; i++)
        words.push_back(std::bit_cast<uint32_t>(i % n < n / 2 ? 10.0f : 9.0f));
    std::string bytes;
    for (size_t i = 0; i < words.size(); i++)
        for (int b = 0; b < 4; b++) {
            const int shift = turned ? (i == 1 ? (b ^ 1) * 8 : (3 - b) * 8) : b * 8;
            bytes.push_back(char(words[i] >> shift & 255));
        }
    return bytes;
}

TEST(Blobby, RepellingPlanesKeepTheGround) {
    const std::filesystem::path path = std::filesystem::temp_directory_path() / "kanuka_ground.zfile";
    const auto made = [&](float z, double world_up = 0) {
        scene::Primitive p =
            blobby({1001, 0, 1003, 0, 16, 0, 2, 0, 1}, {ball(0, 0, z, 3), {0.8f, 0.02f, 0.3f, 0.2f}});
        std::get<scene::Blobby>(p.geometry).strings = std::vector<std::string>{path.string()};
        p.world_from_object = Transform::translate(0, 0, world_up);
        return p;
    };
    const auto write = [&](const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; };
    const auto lowest = [](const Diced& d, bool right) {
        float z = 1e9f;
        for (int i = 0; i < d.mesh_vertices.vertices(); i++) {
            const Vec3f p = d.mesh_vertices.position(i);
            if (right ? p.x > 0.15f : p.x < -0.15f)
                z = std::min(z, p.z);
        }
        return z;
    };
    for (const bool turned : {false, true}) {
        write(depth_file(turned));
        const Diced d = run(made(0.5f));
        EXPECT_EQ(open_edges(d), 0u);
        // Without the ground the ball would reach from z = -1 to 2. B / z meets the field's 0.4 or so near
        // the floor.
        EXPECT_GT(lowest(d, false), 0.01f);
        EXPECT_LT(lowest(d, false), 0.1f);
        EXPECT_GT(lowest(d, true), 1.01f); // the floor's other half lies higher
        EXPECT_LT(lowest(d, true), 1.1f);
    }
    // The ground stays in the world where the object moves; far above it nothing happens.
    EXPECT_NEAR(lowest(run(made(0.5f, 0.25)), false), lowest(run(made(0.5f)), false) - 0.25f, 0.05f);
    EXPECT_NEAR(lowest(run(made(4)), false), 2.5f, 0.05f);
    for (const auto& [bytes, words] :
         {std::pair{std::string("TIFF") + std::string(200, 'x'), "is no file of depths"},
          std::pair{depth_file(false).substr(0, 300), "ends early"},
          std::pair{std::string(), "there is no file"}}) {
        write(bytes);
        Journal journal;
        EXPECT_FALSE(dice::dice(made(0.5f), {}, looking(3), {}, journal).mesh.indices.empty());
        ASSERT_EQ(journal.entries().size(), 1u) << words;
        EXPECT_NE(journal.entries()[0].message.find(words), std::string::npos)
            << journal.entries()[0].message;
    }
    std::filesystem::remove(path);
}

TEST(Blobby, SameForAnyThreadCount) {
    const scene::Primitive p =
        blobby({1001, 0, 1001, 16, 0, 2, 0, 1}, {ball(-0.5f, 0.1f, 0, 2), ball(0.5f, 0, 0.2f, 2)});
    std::vector<float> positions[2];
    for (const int threads : {1, 3})
        tasks::with_threads(threads, [&] { positions[threads / 3] = run(p).mesh_vertices.P; });
    EXPECT_EQ(positions[0], positions[1]);
}
