// Furnaces wherever things lie: a convex grey body under an even sky shows its albedo, however far it was
// modelled from its origin, however large, small, nested, mirrored, sheared or moving it is. Rays that meet
// the surface they start from make it darker.
#include <gtest/gtest.h>

#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr float Albedo = 0.8f;

// Faces of a cube about c, two cells each, so that neighbours lie in one plane.
void add_cube(TestScene& s, Vec3f c, float r) {
    const Vec3f x(r, 0, 0), y(0, r, 0), z(0, 0, r);
    const std::vector<Lobe> grey{matte(Rgb(Albedo))};
    s.add_quad(c - z, y, x, grey);
    s.add_quad(c + z, x, y, grey);
    s.add_quad(c - x, z, y, grey);
    s.add_quad(c + x, y, z, grey);
    s.add_quad(c - y, x, z, grey);
    s.add_quad(c + y, z, x, grey);
}

class Placed {
  public:
    TestScene scene;

    // Groups from the innermost out; each is placed in the next, the last one in the world.
    struct Level {
        Transform parent_from_group;
        std::vector<TransformKey> moves = {}; // instead, after this matrix
    };
    void finish(const std::vector<Level>& levels, float half_width) {
        scene.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, half_width, 24, 24);
        scene.inputs.lights.push_back(constant_sky(Rgb(1)));
        m_groups.resize(levels.size() + 1);
        m_groups[0].shapes.push_back({0, int(scene.store.shapes().size())});
        m_rows.resize(levels.size());
        m_paths.resize(levels.size());
        for (size_t k = 0; k < levels.size(); k++) {
            if (levels[k].moves.empty()) {
                for (size_t i = 0; i < 12; i++)
                    m_rows[k].push_back(float(levels[k].parent_from_group.m[i / 4][i % 4]));
                m_groups[k + 1].instances.push_back({int(k), m_rows[k]});
            } else {
                m_paths[k].emplace_back(levels[k].moves, Transform(), levels[k].parent_from_group);
                m_groups[k + 1].instances.push_back({int(k), {}, m_paths[k]});
                scene.inputs.moving = true;
            }
        }
        scene.finish(m_groups);
    }
    // Of what is covered: the darkest pixel, and the mean.
    void expect_albedo(const std::string& what, int lanes = 8) {
        double sum = 0, least = 1e9;
        int covered = 0;
        for (const PixelSums& p : scene.render(Progressions, lanes)) {
            if (p.hits < Progressions) // part of it is sky
                continue;
            covered++;
            sum += double(p.rgb[1]);
            least = std::min(least, double(p.rgb[1]));
        }
        ASSERT_GT(covered, 50) << what;
        EXPECT_NEAR(sum / covered, double(Albedo), 0.002 * double(Albedo)) << what;
        EXPECT_GT(least, 0.96 * double(Albedo)) << what; // colour noise of 16 samples is within
    }

  private:
    static constexpr int Progressions = 16;
    std::vector<bvh::GroupDesc> m_groups;
    std::vector<std::vector<float>> m_rows;
    std::vector<std::vector<MotionPath>> m_paths;
};

Transform turned() {
    return Transform::rotate(35, 1, 2, 0.5);
}
// Ends three units before the camera what was modelled at `c`.
Transform to_view(const Transform& turn, const Vec3f& c) {
    return Transform::translate(0, 0, 4) * turn *
           Transform::translate(-double(c.x), -double(c.y), -double(c.z));
}

} // namespace

TEST(Placement, ModelledFarFromItsOrigin) {
    for (const float far : {1e3f, 1e4f, 1e5f, 1e6f})
        for (const Vec3f& towards : {Vec3f(1, 0, 0), Vec3f(1, -1, 1), Vec3f(0.25f, 0.5f, -1)}) {
            const Vec3f c = towards * far;
            Placed p;
            add_cube(p.scene, c, 1);
            p.finish({{to_view(turned(), c)}}, 0.3f);
            p.expect_albedo("at " + std::to_string(far) + " towards " + std::to_string(towards.y));
        }
}

TEST(Placement, LargeTiltedPlanes) {
    for (const float size : {1e2f, 1e3f, 1e4f, 1e5f, 1e6f})
        for (const float tilt : {0.0f, 0.3f, 0.8f, 1.2f}) {
            // Two units below the camera, seen obliquely; its corners are nothing that floats hold exactly.
            const Vec3f n = normalize(Vec3f(std::sin(tilt) * 0.7f, std::cos(tilt), -0.4f));
            const Vec3f x = normalize(cross(n, Vec3f(0.3f, 0.1f, 1))), y = cross(n, x);
            Placed p;
            p.scene.add_quad(n * -2 + x * (0.13f * size) + y * (0.29f * size), x * size, y * -size,
                             {matte(Rgb(Albedo))});
            p.scene.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 24, 24);
            p.finish({}, 1);
            p.expect_albedo("size " + std::to_string(size) + " tilt " + std::to_string(tilt));
        }
}

TEST(Placement, TinyAndLargeBodies) {
    for (const double size : {1e-9, 1e-6, 1e-3, 1e3, 1e6}) {
        Placed flat;
        add_cube(flat.scene, Vec3f(0, 0, 4 * float(size)), float(size));
        flat.finish({}, 0.2f);
        flat.expect_albedo("size " + std::to_string(size));
        // The same by a matrix: modelled in units, at some distance.
        Placed scaled;
        const Vec3f c(30, -20, 10);
        add_cube(scaled.scene, c, 1);
        scaled.finish({{Transform::scale(size, size, size) * to_view(turned(), c)}}, 0.3f);
        scaled.expect_albedo("scaled by " + std::to_string(size));
        // And a model of that size scaled to units.
        Placed grown;
        add_cube(grown.scene, c * float(size), float(size));
        grown.finish({{to_view(turned(), c) * Transform::scale(1 / size, 1 / size, 1 / size)}}, 0.3f);
        grown.expect_albedo("grown from " + std::to_string(size));
    }
}

TEST(Placement, MirroredAndSheared) {
    for (const float far : {0.0f, 1e3f, 1e5f}) {
        const Vec3f c(far, -far, far);
        Transform shear;
        shear.m[0][1] = 3, shear.m[2][0] = -0.7, shear.m[1][2] = 1.5;
        for (const auto& [t, what] : {std::pair{Transform::scale(-1, 1, 1), "mirrored"},
                                      {Transform::scale(20, 1, 0.5), "stretched"},
                                      {Transform::scale(-1, -1, -1), "turned over"},
                                      {shear, "sheared"},
                                      {Transform::scale(1, -1, 1) * shear, "sheared and mirrored"}}) {
            Placed p;
            add_cube(p.scene, c, 1);
            p.finish({{to_view(turned() * t, c)}}, 0.15f);
            p.expect_albedo(std::string(what) + " at " + std::to_string(far));
        }
    }
}

// There and back again: no level's own matrix looks far.
TEST(Placement, InstancesOfInstances) {
    for (const double far : {1e3, 1e5, 1e6}) {
        const Transform out = Transform::translate(far, -far, 0.5 * far) * turned();
        Placed p;
        add_cube(p.scene, {0, 0, 0}, 1);
        p.finish({{out},
                  {Transform::rotate(20, 0, 1, 0)},
                  {to_view(Transform(), {0, 0, 0}) * (Transform::rotate(20, 0, 1, 0) * out).inverse()}},
                 0.3f);
        p.expect_albedo("nested, " + std::to_string(far));
        Placed within; // and a large middle
        add_cube(within.scene, {0, 0, 0}, 1);
        within.finish({{Transform::scale(far, far, far)},
                       {turned()},
                       {to_view(turned(), {0, 0, 0}) * Transform::scale(1 / far, -1 / far, 1 / far)}},
                      0.3f);
        within.expect_albedo("large within, " + std::to_string(far));
    }
}

TEST(Placement, Moving) {
    for (const float far : {1e3f, 1e5f, 1e6f}) {
        const Vec3f c(far, far, -far);
        Placed p; // a place that turns
        add_cube(p.scene, c, 1);
        const Transform here = Transform::translate(0, 0, 4),
                        there = Transform::translate(0.2, 0, 4) * Transform::rotate(60, 1, 0, 0);
        p.finish({{Transform::translate(-double(c.x), -double(c.y), -double(c.z)), {{0, here}, {1, there}}}},
                 0.15f);
        p.expect_albedo("moving place, " + std::to_string(far));
        Placed q; // a plane that slides within itself, far and fast
        const Vec3f x = normalize(Vec3f(0.6f, 0.1f, 0.8f)), y = normalize(cross(x, Vec3f(0.2f, 1, 0))),
                    n = cross(x, y);
        // In pages vertices stand on a lattice of a hundredth of a micropolygon, which it is one of.
        const float away = TestScene::traced_by().pages_from.changing == 0 ? std::max(3.0f, far / 64) : 3.0f;
        const auto at = [&](float slid) -> std::array<Vec3f, 4> {
            const Vec3f o = n * (n.z > 0 ? away : -away) + x * slid, e = x * far, f = y * far;
            return {o - e - f, o + e - f, o - e + f, o + e + f};
        };
        q.scene.add_moving_quad({at(-0.4f * far), at(0.3f * far)}, {matte(Rgb(Albedo))});
        q.scene.inputs.moving = true;
        q.finish({}, 0.15f);
        q.expect_albedo("sliding plane, " + std::to_string(far));
    }
}

// Seen by way of a mirror a hundred thousand units away: there a ray's parameter is known to some
// thousandths, while what it meets lies before the eye, where rays stand off by a hundred thousandth.
TEST(Placement, NearByAndSeenFromAfar) {
    constexpr float Far = 1e5f;
    TestScene s;
    s.add_quad({0, 0, Far}, {0, 1, 0}, {1, 0, 0}, {metal(0)});
    const Vec3f n = normalize(Vec3f(0.6f, -0.3f, 1)), x = normalize(cross(n, Vec3f(0, 1, 0.2f)));
    s.add_quad({0, 0, -5}, x * 3, cross(n, x) * 3, {matte(Rgb(Albedo))});
    s.inputs.lights = {constant_sky(Rgb(1))};
    s.inputs.max_depth = 4;
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f / Far, 24, 24);
    s.finish();
    double sum = 0;
    for (const PixelSums& p : s.render(16, 8))
        sum += double(p.rgb[1]) / (24 * 24);
    EXPECT_NEAR(sum, double(Albedo), 0.004);
}

} // namespace kanuka::transport
