// Small points, which are balls: beside spheres in doubles, by Embree and in pages.
#include "bvh/test_traced.h"

using namespace kanuka;
using namespace kanuka::bvh::testing;
using dice::test::floats;

namespace {

constexpr int Count = 400;

// Points of all sizes in a box, some in each other, some that are nowhere; their places `after` the shutter.
scene::Primitive spray(bool after = false, float size = 1, float far = 0) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<float> p, w;
    for (int i = 0; i < Count; i++) {
        for (int c = 0; c < 3; c++) {
            const float at = uniform(random), way = uniform(random);
            p.push_back(far + size * (at + (after ? 0.4f * way : 0)));
        }
        const float width = size * (0.02f + 0.16f * std::abs(uniform(random)));
        w.push_back(after ? 0.7f * width : width);
    }
    p[3 * 7] = std::numeric_limits<float>::quiet_NaN();
    w[9] = 0;
    scene::Primitive out = dice::test::primitive(scene::Points{}, p);
    out.primvars.set(floats("width", scene::Type::Float, scene::Detail::Vertex, w));
    return out;
}

Slab slab_of(scene::Primitive points) {
    Slab slab;
    slab.primitives = {std::move(points)};
    slab.options = dice::test::looking(3, 16);
    return slab;
}

struct Ball {
    double x[3], r;
};
std::vector<Ball> traced_balls(const store::Store& store, float time) {
    const store::ShapeRecord& s = store.shapes()[0];
    std::vector<Ball> balls;
    for (int i = 0; i < s.mv; i++) {
        const float *p = store.floats(s) + s.positions + 4 * i,
                    *q = s.motion_segments ? p + s.motion_stride : p;
        Ball b{};
        for (int c = 0; c < 3; c++)
            b.x[c] = double(p[c]) + (double(q[c]) - double(p[c])) * double(time);
        b.r = double(p[3]) + (double(q[3]) - double(p[3])) * double(time);
        balls.push_back(b);
    }
    return balls;
}
struct Met {
    double t = INFINITY, margin = INFINITY; // of the nearest border; how close the ray comes to missing one
    int ball = -1;
};
Met nearest(const std::vector<Ball>& balls, const Vec3f& o, const Vec3f& d) {
    Met met;
    const double dd = double(dot(d, d));
    for (size_t i = 0; i < balls.size(); i++) {
        double b = 0, c = -balls[i].r * balls[i].r;
        for (int a = 0; a < 3; a++) {
            const double f = double(o[a]) - balls[i].x[a];
            b += f * double(d[a]), c += f * f;
        }
        const double h = b * b - dd * c;
        met.margin = std::min(met.margin, std::abs(h) / (dd * balls[i].r * balls[i].r));
        if (h < 0)
            continue;
        for (const double t : {(-b - std::sqrt(h)) / dd, (-b + std::sqrt(h)) / dd})
            if (t >= 0) {
                met.margin = std::min(met.margin, std::abs(t));
                if (t < met.t)
                    met.t = t, met.ball = int(i);
            }
    }
    return met;
}

class Balls : public ::testing::TestWithParam<bool> {}; // in pages?
INSTANTIATE_TEST_SUITE_P(Traced, Balls, ::testing::Bool(),
                         [](const auto& of) { return of.param ? "InPages" : "ByEmbree"; });

void expect_spheres(const Traced& traced, float time, float size, float far, int& found) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const std::vector<Ball> balls = traced_balls(traced.store(), time);
    for (int i = 0; i < 4000; i++) {
        const Vec3f o = Vec3f(far) + size * (i % 2 ? 2.0f : 0.9f) *
                                         Vec3f(uniform(random), uniform(random), uniform(random)),
                    to = Vec3f(far) + size * Vec3f(uniform(random), uniform(random), uniform(random)),
                    d = to - o;
        bvh::RayPacket<8> packet;
        for (int k = 0; k < 8; k++)
            for (int c = 0; c < 3; c++)
                packet.o[c].v[k] = o[c], packet.d[c].v[k] = d[c];
        packet.t_max = Float<8>(1e30f);
        packet.active = Int<8>::lane_index() == Int<8>(0);
        packet.time = Float<8>(time);
        bvh::HitPacket<8> hits;
        traced.scene().intersect(packet, hits);
        const Met want = nearest(balls, o, d);
        if (want.margin < 1e-3)
            continue;
        ASSERT_EQ(hits.hit[0], want.ball >= 0) << i;
        if (want.ball < 0)
            continue;
        found++;
        ASSERT_EQ(hits.prim.v[0], want.ball) << i;
        ASSERT_NEAR(double(hits.t.v[0]), want.t, 1e-4 * (1 + want.t)) << i;
        Vec3f n, at = o + d * hits.t.v[0];
        for (int c = 0; c < 3; c++)
            n[c] = float(double(at[c]) - balls[size_t(want.ball)].x[c]);
        const Vec3f Ng(hits.Ng.x.v[0], hits.Ng.y.v[0], hits.Ng.z.v[0]);
        ASSERT_GT(dot(n, Ng), 0.999f * length(n) * length(Ng)) << i;
    }
}

} // namespace

TEST_P(Balls, AreSpheres) {
    for (const auto& [size, far] : {std::pair{1.0f, 0.0f}, {1e-3f, 0.0f}, {1e3f, 0.0f}, {1.0f, 100.0f}}) {
        Slab slab = slab_of(spray(false, size, far));
        slab.target.pixels_per_unit = 4 / size; // as instances are diced
        const Traced traced(slab, GetParam(), 1);
        const store::ShapeRecord& s = traced.store().shapes()[0];
        ASSERT_TRUE(s.flags & store::ShapeRecord::Balls);
        ASSERT_EQ(s.mu, Count - 2); // one is nowhere, one of no width
        int found = 0;
        expect_spheres(traced, 0, size, far, found);
        EXPECT_GT(found, 1500) << size;
    }
}

TEST_P(Balls, MoveAndShrink) {
    const scene::Primitive later[] = {spray(true)};
    Slab slab = slab_of(spray());
    slab.target.later = later;
    const Traced traced(slab, GetParam(), 1);
    ASSERT_TRUE(traced.store().shapes()[0].flags & store::ShapeRecord::Balls);
    int found = 0;
    for (const float time : {0.0f, 0.3f, 0.5f, 1.0f})
        expect_spheres(traced, time, 1, 0, found);
    EXPECT_GT(found, 4000);
}

// Light through a slab of balls falls as exp(-n pi r^2 L), whichever way it goes.
TEST_P(Balls, HideLightFromAllSides) {
    constexpr int Many = 60000;
    constexpr float Radius = 0.004f;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<float> p(3 * Many);
    for (float& x : p)
        x = uniform(random);
    scene::Primitive points = dice::test::primitive(scene::Points{}, p);
    points.primvars.set(floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {2 * Radius}));
    const Traced traced(slab_of(points), GetParam());
    ASSERT_TRUE(traced.store().shapes()[0].flags & store::ShapeRecord::Balls);
    const double expected = std::exp(-double(Many) / 8 * double(Pi) * double(Radius * Radius) * 2);
    for (const Vec3f d : {Vec3f(0, 0, 1), Vec3f(1, 0, 0), Vec3f(0, -1, 0)})
        EXPECT_NEAR(traced.passed(Vec3f(0.0f), d, 0.9f, 40000), expected, 0.01);
}
