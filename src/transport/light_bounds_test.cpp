// What the choice of lights goes by: how much a light can contribute and from where, against sums over its
// surface; and the splits of the hierarchy, against all that it might have chosen.
#include <gtest/gtest.h>
#include <random>
#include <set>

#include "transport/quad_pictures.h"
#include "transport/test_floor.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;
constexpr double DoublePi = 3.14159265358979323846;

scene::Light lamp(Kind kind, float amount, const Transform& t) {
    scene::Light l;
    l.kind = kind;
    l.amount = Rgb(amount);
    l.world_from_light = t;
    l.width = 0.5f, l.height = 0.7f, l.radius = kind == Kind::Point || kind == Kind::Spot ? 0 : 0.3f;
    l.cone_angle = 40, l.cone_delta_angle = 10;
    return l;
}

const TestScene& view_of(TestScene& s, const std::vector<scene::Light>& lights) {
    s.inputs.lights = lights;
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
    s.finish();
    return s;
}

struct Patch {
    Vec3f p, n;
    double area;
};

// The surface of a lamp in its own space, in small parts.
std::vector<Patch> surface_of(const scene::Light& l) {
    constexpr int N = 64;
    std::vector<Patch> parts;
    const double r = double(l.radius), w = double(l.width), h = double(l.height);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double a = (i + 0.5) / N, b = (j + 0.5) / N, turn = 2 * DoublePi * b;
            const Vec3f around(float(std::cos(turn)), float(std::sin(turn)), 0), z(0, 0, 1);
            if (l.kind == Kind::Quad)
                parts.push_back({{float(w * (a - 0.5)), float(h * (b - 0.5)), 0}, z, w * h / (N * N)});
            else if (l.kind == Kind::Disk)
                parts.push_back({around * float(r * std::sqrt(a)), z, DoublePi * r * r / (N * N)});
            else if (l.kind == Kind::Cylinder)
                parts.push_back(
                    {around * float(r) + z * float(h * (a - 0.5)), around, 2 * DoublePi * r * h / (N * N)});
            else {
                const double up = 2 * a - 1;
                const Vec3f n = around * float(std::sqrt(1 - up * up)) + z * float(up);
                parts.push_back({n * float(r), n, 4 * DoublePi * r * r / (N * N)});
            }
        }
    return parts;
}

} // namespace

// In its best direction a lamp has the intensity that its bound says; all of it lies in the bound's sphere,
// and all of its normals in the cone.
TEST(LightBounds, AreWhatTheSurfaceHas) {
    const double scale = 2;
    const Transform placed = Transform::translate(3, -1, 2) * Transform::rotate(40, 1, 2, 3) *
                             Transform::scale(scale, scale, scale);
    for (Kind kind : {Kind::Quad, Kind::Disk, Kind::Sphere, Kind::Cylinder}) {
        TestScene s;
        const scene::Light l = lamp(kind, 5, placed);
        view_of(s, {l});
        const LightBound& bound = s.view.lights.bounds[0];
        const std::vector<Patch> parts = surface_of(l);
        double most = 0, farthest = 0, least_cosine = 1;
        for (int k = 0; k < 200; k++) { // directions in a plane through the axis
            const double angle = DoublePi * k / 200;
            const Vec3f w(float(std::sin(angle)), 0, float(std::cos(angle)));
            double sum = 0;
            for (const Patch& p : parts)
                sum += 5 * p.area * scale * scale * std::max(double(dot(p.n, w)), 0.0);
            most = std::max(most, sum);
        }
        for (const Patch& p : parts) {
            farthest = std::max(farthest, double(length(placed.point(p.p) - bound.center)));
            least_cosine = std::min(least_cosine, double(dot(normalize(placed.vector(p.n)), bound.axis)));
        }
        EXPECT_NEAR(bound.power / most, 1, 2e-3) << int(kind);
        EXPECT_NEAR(bound.radius / farthest, 1, 0.03) << int(kind);
        EXPECT_GE(bound.radius, farthest * (1 - 1e-5)) << int(kind);
        EXPECT_LE(bound.cos_spread, least_cosine + 1e-5) << int(kind);
        EXPECT_EQ(bound.cos_reach, 0) << int(kind);
    }
}

// Lamps without a surface, or with one that has their intensity; distant ones have an irradiance.
TEST(LightBounds, OfPointsSpotsAndSuns) {
    const Transform placed = Transform::translate(3, -1, 2) * Transform::rotate(40, 1, 2, 3);
    for (const float radius : {0.0f, 0.25f})
        for (Kind kind : {Kind::Point, Kind::Spot}) {
            TestScene s;
            auto l = lamp(kind, 5, placed);
            l.radius = radius;
            view_of(s, {l});
            const LightBound& bound = s.view.lights.bounds[0];
            EXPECT_NEAR(bound.power, 5, 1e-4f);
            EXPECT_EQ(bound.radius, radius);
            EXPECT_NEAR(length(bound.center - Vec3f(3, -1, 2)), 0, 1e-6f);
            EXPECT_EQ(bound.cos_spread, kind == Kind::Spot ? 1 : -1);
            if (kind == Kind::Spot) {
                EXPECT_NEAR(bound.cos_reach, std::cos(40 * DoublePi / 180), 1e-6);
            }
        }
    TestScene s;
    view_of(s, {lamp(Kind::Distant, 7, placed)});
    EXPECT_NEAR(s.view.lights.bounds[0].power, 7, 1e-4f);
}

// The smooth edge of a cone begins at the axis at the nearest; no cone is wider than all directions.
TEST(LightBounds, ConesEndAtTheAxisAndBehind) {
    struct Cone {
        float angle, delta;
        double outer, inner; // degrees
    };
    for (const Cone& c : {Cone{40, 10, 40, 30}, Cone{40, 40, 40, 0}, Cone{40, 90, 40, 0},
                          Cone{200, 10, 180, 180}, Cone{179, 60, 179, 119}}) {
        TestScene s;
        auto l = lamp(Kind::Spot, 1, Transform());
        l.cone_angle = c.angle, l.cone_delta_angle = c.delta;
        view_of(s, {l});
        EXPECT_NEAR(s.view.lights.analytic[0].cos_outer, std::cos(c.outer * DoublePi / 180), 1e-6) << c.angle;
        EXPECT_NEAR(s.view.lights.analytic[0].cos_inner, std::cos(c.inner * DoublePi / 180), 1e-6) << c.angle;
    }
}

// Emitting triangles have their area times their radiance, in an instance too.
TEST(LightBounds, OfTrianglesInInstances) {
    double power[2];
    for (const double scale : {1.0, 3.0}) {
        TestScene s;
        for (float x : {0.0f, 2.0f, 4.0f}) // a hierarchy
            s.add_quad({x, 0, 0}, {0.5f, 0, 0}, {0, 0.25f, 0}, {emission(Rgb(2))});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
        s.finish(0, Transform::rotate(30, 1, 1, 0) * Transform::scale(scale, scale, scale));
        ASSERT_EQ(s.view.lights.tree.nodes.size(), 1u);
        double sum = 0;
        for (const float p : s.view.lights.tree.nodes[0].power)
            sum += double(p);
        power[scale > 1] = sum;
    }
    EXPECT_NEAR(power[0], 3 * 0.5 * 2, 0.02 * power[0]);
    EXPECT_NEAR(power[1] / power[0], 9, 1e-4);
}

// Of a group that stands in two places every triangle is sampled in both; all of them together are known by
// their power and their middle.
TEST(LightBounds, OfTrianglesInTwoPlaces) {
    TestScene s;
    s.add_quad({0, 0, 0}, {0.5f, 0, 0}, {0, 0.25f, 0}, {emission(Rgb(2))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
    const std::vector<float> places{1, 0, 0, -3, 0, 1, 0, 1, 0, 0, 1, 5, 1, 0, 0, 3, 0, 1, 0, 1, 0, 0, 1, 5};
    s.groups.assign(2, {});
    s.groups[0].shapes.push_back({0, 1});
    s.groups[1].instances.push_back({0, places});
    s.finish(s.groups);
    ASSERT_EQ(s.view.lights.tree.nodes.size(), 1u);
    int left = 0, right = 0;
    for (size_t k = 0; k < 8; k++) {
        const LightNode& n = s.view.lights.tree.nodes[0];
        if (n.power[k] > 0) {
            (n.x[k] < 0 ? left : right)++;
            EXPECT_NEAR(std::abs(n.x[k]), 3, 0.5f);
            EXPECT_EQ(n.z[k], 5);
        }
    }
    EXPECT_EQ(left, 2);
    EXPECT_EQ(right, 2);
    EXPECT_NEAR(s.view.lights.emitter_power, 2 * 0.5 * 2, 0.02 * 2);
    EXPECT_NEAR(length(s.view.lights.emitter_center - Vec3f(0, 1, 5)), 0, 1e-5f);
    EXPECT_NEAR(std::sqrt(s.view.lights.emitter_radius2), 3, 0.2f);
}

// Lamps of all kinds have the colour that they are given: of a grey floor it is the floor's.
TEST(Lights, HaveTheirColours) {
    const Rgb colour(3, 1, 0.5f);
    for (Kind kind : {Kind::Point, Kind::Distant, Kind::Quad, Kind::Sphere, Kind::Environment}) {
        FloorScene s;
        scene::Light l = lamp(kind, 1, Transform::translate(0, 0.5, 0) * Transform::rotate(90, 1, 0, 0));
        l.amount = colour;
        l.visible_camera = false;
        s.inputs.lights.push_back(l);
        s.finish();
        const auto e = s.estimate(64, 8);
        for (int c : {0, 2})
            EXPECT_NEAR(e.channel[c].mean() / e.channel[1].mean(), colour[c], 0.02 * double(colour[c]))
                << int(kind);
    }
}

// However little of a picture lies below its mean, a twentieth of the places goes by solid angle: what is
// dark there is sampled too.
TEST(LightBounds, PicturesLeaveATwentiethToTheRest) {
    for (const int n : {3, 8, 64}) {
        TestScene s;
        auto l = lamp(Kind::Quad, 1, Transform());
        auto table = std::make_shared<scene::LightTable>();
        table->width = table->height = n;
        table->rgb.assign(size_t(3 * n * n), 0.0f);
        const size_t middle = size_t(n / 2 * n + n / 2);
        std::fill_n(table->rgb.begin() + ptrdiff_t(3 * middle), 3, 1.0f);
        l.table = table;
        view_of(s, {l});
        const float* words = s.view.lights.densities.data() + s.view.lights.analytic[0].picture;
        const double above = 1 - 1.0 / (n * n); // of its light: of the one texel, above the mean
        EXPECT_NEAR(words[QuadDensity::Share], std::min(above, 0.95), 1e-5) << n;
        EXPECT_NEAR(words[QuadDensity::Mean], 1.0 / (n * n), 1e-6) << n;
    }
}

namespace {

// Conty Estevez and Kulla 2018, section 4.4, in double precision: what the lights of a set cost.
struct Cost {
    double lo[3], hi[3], axis[3] = {0, 0, 0}, power = 0;
    int count = 0;
    Cost() { std::fill_n(lo, 3, 1e30), std::fill_n(hi, 3, -1e30); }
    void add(const LightBound& b) {
        for (int c = 0; c < 3; c++) {
            lo[c] = std::min(lo[c], double(b.center[c]) - double(b.radius));
            hi[c] = std::max(hi[c], double(b.center[c]) + double(b.radius));
            axis[c] += b.cos_spread > -1 ? double(b.axis[c]) : 0;
        }
        power += double(b.power);
        count++;
    }
    // Around the cone of normals of half angle t the cosine falls: its integral over directions, by sums.
    static double solid_angle(double t) {
        constexpr int N = 400;
        const double end = std::min(t + DoublePi / 2, DoublePi), step = (end - t) / N;
        double sum = 2 * DoublePi * (1 - std::cos(t));
        for (int i = 0; i < N; i++) {
            const double w = t + (i + 0.5) * step;
            sum += 2 * DoublePi * std::cos(w - t) * std::sin(w) * step;
        }
        return sum;
    }
    double value() const {
        const double d[3] = {hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]};
        const double area =
            d[0] * d[1] + d[1] * d[2] + d[2] * d[0] + 1e-3 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        // A cap of half angle t has a mean normal of length (1 + cos t) / 2.
        const double mean = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]) / count;
        return power * area * solid_angle(std::acos(std::clamp(2 * mean - 1, -1.0, 1.0)));
    }
};

// Cuts between twelve bins along each axis: who lies on the left, and the cost.
std::vector<std::pair<std::set<int>, double>> cuts(const std::vector<LightBound>& lights) {
    std::vector<std::pair<std::set<int>, double>> out;
    double lo[3] = {1e30, 1e30, 1e30}, hi[3] = {-1e30, -1e30, -1e30};
    for (const LightBound& b : lights)
        for (int c = 0; c < 3; c++)
            lo[c] = std::min(lo[c], double(b.center[c])), hi[c] = std::max(hi[c], double(b.center[c]));
    const double longest = std::max({hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]});
    for (int axis = 0; axis < 3; axis++)
        for (int cut = 0; cut < 11; cut++) {
            Cost left, right;
            std::set<int> on_left;
            for (size_t i = 0; i < lights.size(); i++) {
                const double at = (double(lights[i].center[axis]) - lo[axis]) / (hi[axis] - lo[axis]);
                const bool here = std::min(int(at * 12), 11) <= cut;
                (here ? left : right).add(lights[i]);
                if (here)
                    on_left.insert(int(i));
            }
            if (left.count > 0 && right.count > 0)
                out.emplace_back(on_left, (left.value() + right.value()) * longest / (hi[axis] - lo[axis]));
        }
    return out;
}

} // namespace

// The first cut of a set is the cheapest there is: its left part is some of the root's children, in their
// order.
TEST(LightTree, CutsWhereItCostsLeast) {
    std::mt19937 g(41);
    const auto u = [&](float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(g); };
    for (int round = 0; round < 60; round++) {
        std::vector<LightBound> lights(16);
        const float spread = u(0.1f, 2);
        for (size_t i = 0; i < lights.size(); i++) {
            LightBound& b = lights[i];
            b.center = {u(-1, 1), u(-1, 1), u(-1, 1)};
            b.radius = u(0, 0.1f);
            // Normals go with the place along one of the axes.
            const Vec3f towards = b.center[round % 3] > 0 ? Vec3f(0, 0, 1) : Vec3f(0, 1, 0);
            b.axis = normalize(towards + Vec3f(u(-1, 1), u(-1, 1), u(-1, 1)) * spread);
            b.cos_spread = round % 5 == 4 ? -1.0f : 1.0f;
            b.power = std::exp(u(-2, 2));
        }
        const LightTree tree = build_light_tree(lights);
        // Which of the root's children each leaf is under.
        std::vector<int> child(lights.size());
        for (size_t i = 0; i < lights.size(); i++) {
            int at = tree.place[i];
            while (tree.parent[size_t(at / 8)] >= 0)
                at = tree.parent[size_t(at / 8)];
            child[i] = at % 8;
        }
        const auto all = cuts(lights);
        double best = 1e300, chosen = 1e300;
        for (const auto& [left, cost] : all) {
            best = std::min(best, cost);
            for (int k = 0; k < 8; k++) {
                std::set<int> first;
                for (size_t i = 0; i < lights.size(); i++)
                    if (child[i] <= k)
                        first.insert(int(i));
                if (first == left)
                    chosen = std::min(chosen, cost);
            }
        }
        EXPECT_LT(chosen, best * (1 + 1e-3)) << round;
    }
}

} // namespace kanuka::transport
