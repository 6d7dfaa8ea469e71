// What curves hide of light from any direction: diced, stored and traced as a picture's geometry is, by
// Embree and in pages.
#include "bvh/test_traced.h"

using namespace kanuka;
using namespace kanuka::bvh::testing;
using dice::test::floats;

namespace {

constexpr float Width = 2e-4f, Depth = 2; // of the slab, in mean free paths

// Parallel fibres at random places of [-1, 1]^2 in x and z, from y = -1 to 1.
scene::Primitive grass(bool cubic) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(-1, 1);
    scene::Curves c;
    c.cubic = cubic;
    c.basis = scene::basis_by_name("b-spline");
    const int count = int(4 * Depth / (2 * Width)), n = cubic ? 6 : 3; // n w L = Depth along a side of 2
    std::vector<float> p;
    for (int i = 0; i < count; i++) {
        const float x = uniform(random), z = uniform(random);
        for (int k = 0; k < n; k++)
            p.insert(p.end(), {x, cubic ? float(k) - 2.5f : float(k - 1), z});
    }
    c.vertices_per_curve = std::vector<int32_t>(size_t(count), n);
    scene::Primitive out = dice::test::primitive(c, p);
    out.primvars.set(floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {Width}));
    return out;
}

class Fibres : public ::testing::TestWithParam<bool> {}; // in pages?
INSTANTIATE_TEST_SUITE_P(Traced, Fibres, ::testing::Bool(),
                         [](const auto& of) { return of.param ? "InPages" : "ByEmbree"; });

// Light through a slab of fibres falls as exp(-n w L), whichever way it goes.
TEST_P(Fibres, HideLightFromAllSides) {
    const double expected = std::exp(-double(Depth));
    constexpr int Rays = 40000;
    const double error = 4 * std::sqrt(2 * expected * (1 - expected) / 10000); // of rays, and of places
    const auto check = [&](const Slab& slab, bool fibres) {
        const Traced traced(slab, GetParam());
        EXPECT_EQ(traced.fibres(), fibres);
        EXPECT_NEAR(traced.passed(Vec3f(0.0f), {0, 0, 1}, 0.5f, Rays), expected, error);
        EXPECT_NEAR(traced.passed(Vec3f(0.0f), {1, 0, 0}, 0.5f, Rays), expected, error);
        // Tilted towards the fibres the way is as much longer as they are narrower.
        EXPECT_NEAR(traced.passed(Vec3f(0.0f), normalize(Vec3f(std::sqrt(3.0f), 1, 0)), 0.25f, Rays),
                    expected, error);
    };
    Slab slab;
    slab.primitives = {grass(false)};
    slab.options = dice::test::looking(3);
    check(slab, true);
    slab.primitives = {grass(true)};
    check(slab, true);
    slab.target.polygons = true;
    slab.primitives = {grass(false)};
    check(slab, false);
    slab.target = {};
    slab.target.pixels_per_unit = 30; // instanced
    check(slab, true);
}

// One bent fibre that narrows: its shadow on a plane, along any direction, by the area of its segments'
// outlines.
TEST_P(Fibres, AreAsWideFromEverywhere) {
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    for (const int wide : {0, 1, 2}) { // a fibre; a tube of three sides; a tube of many
        scene::Curves c;
        c.cubic = false;
        constexpr int Vertices = 5;
        c.vertices_per_curve = std::vector<int32_t>{Vertices};
        std::vector<float> p, w;
        for (int k = 0; k < Vertices; k++) {
            const float a = 0.4f * float(k);
            p.insert(p.end(), {std::sin(a), std::cos(a), 0.3f * a});
            w.push_back(0.02f - 0.002f * float(k));
        }
        Slab slab;
        slab.primitives = {dice::test::primitive(c, p)};
        slab.primitives[0].primvars.set(floats("width", scene::Type::Float, scene::Detail::Varying, w));
        slab.options = dice::test::looking(4, wide == 2 ? 8000 : 100);
        slab.target.polygons = wide == 1;
        const Traced traced(slab, GetParam());
        EXPECT_EQ(traced.fibres(), wide == 0);
        double found = 0, expected = 0;
        constexpr int Directions = 60, Rays = 40000;
        for (int i = 0; i < Directions; i++) {
            const Vec3f d = normalize(Vec3f(normal(random), normal(random), normal(random)));
            double sum = 0;
            for (int k = 0; k + 1 < Vertices; k++) {
                const Vec3f s(p[3 * k + 3] - p[3 * k], p[3 * k + 4] - p[3 * k + 1],
                              p[3 * k + 5] - p[3 * k + 2]);
                sum += double(length(cross(s, d))) * 0.5 * double(w[k] + w[k + 1]);
            }
            constexpr float Half = 1;
            found += (1 - traced.passed({0.5f, 0.5f, 0.25f}, d, Half, Rays, i)) * 4 * Half * Half;
            expected += sum;
        }
        EXPECT_NEAR(found / expected, 1, 0.02) << wide;
    }
}

// A bent fibre's skin is as far from its axis wherever it is met, at joints and ends too, and its normal
// leads straight away from the axis; what passes nearer meets it.
TEST_P(Fibres, AreRoundAtJointsAndEnds) {
    float radius = 0.02f;
    std::vector<Vec3f> axis{{-0.4f, 0, 0}, {0, 0, 0}, {0.2f, 0.3f, 0.1f}, {0.1f, 0.3f, 0.4f}};
    scene::Curves c;
    c.cubic = false;
    c.vertices_per_curve = std::vector<int32_t>{int32_t(axis.size())};
    std::vector<float> p;
    for (const Vec3f& q : axis)
        p.insert(p.end(), {q.x, q.y, q.z});
    Slab slab;
    slab.primitives = {dice::test::primitive(c, p)};
    slab.primitives[0].primvars.set(
        floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {2 * radius}));
    slab.options = dice::test::looking(4, 50);
    const Traced traced(slab, GetParam());
    ASSERT_TRUE(traced.fibres());
    // Half a ball ends it, drawn in so far that it covers what a blunt end would: 2 r l = pi r^2 / 2.
    for (const auto& [end, next] : {std::pair<size_t, size_t>{0, 1}, {3, 2}})
        axis[end] += normalize(axis[next] - axis[end]) * (radius * Pi / 4);
    const std::vector<Vec3f> traced_axis = traced.axis(radius);
    EXPECT_NEAR(radius, 0.02f, 1e-5f);
    for (size_t k = 0; k < axis.size(); k++) // on a lattice, in pages
        EXPECT_LT(length(traced_axis[k * (traced_axis.size() - 1) / 3] - axis[k]),
                  GetParam() ? 5e-4f : 1e-6f);
    const auto from_axis = [&](const Vec3f& q) { // the shortest way
        Vec3f best(1e9f);
        for (size_t k = 0; k + 1 < traced_axis.size(); k++) {
            const Vec3f from = q - traced_axis[k], s = traced_axis[k + 1] - traced_axis[k];
            const Vec3f way = from - s * std::clamp(dot(from, s) / length_squared(s), 0.0f, 1.0f);
            if (length_squared(way) < length_squared(best))
                best = way;
        }
        return best;
    };
    std::mt19937 random(11);
    std::normal_distribution<float> normal;
    std::uniform_real_distribution<float> uniform(-1.5f, 1.5f);
    const auto any = [&] { return Vec3f(normal(random), normal(random), normal(random)); };
    size_t met[4] = {}; // at the first end, at joints and at the last end, and between
    for (int i = 0; i < 20000; i++) {
        // Through a place near a vertex, a point of the axis every other time.
        const size_t k = size_t(i) % axis.size(), l = k == 3 ? 2 : k + 1;
        const Vec3f near = axis[k] + (axis[l] - axis[k]) * (i % 8 < 4 ? 0.0f : 0.5f);
        const Vec3f d = normalize(any()), o = near + any() * (radius * uniform(random)) - d;
        bvh::RayPacket<8> packet;
        for (int e = 0; e < 8; e++)
            for (int x = 0; x < 3; x++)
                packet.o[x].v[e] = o[x], packet.d[x].v[e] = d[x];
        packet.t_max = Float<8>(2);
        packet.active = Int<8>::lane_index() < Int<8>(1);
        packet.seed = Int<8>(0);
        packet.time = Float<8>(0);
        bvh::HitPacket<8> hits;
        traced.scene().intersect(packet, hits);
        float nearest = 1e9f;
        for (int s = 0; s <= 4000; s++)
            nearest = std::min(nearest, length(from_axis(o + d * (0.0005f * float(s)))));
        if (abs(nearest - radius) > 2e-5f) {
            EXPECT_EQ((hits.hit.bits() & 1) != 0, nearest < radius) << nearest;
        }
        if (!(hits.hit.bits() & 1))
            continue;
        const Vec3f way = from_axis(o + d * hits.t.v[0]);
        EXPECT_NEAR(length(way), radius, 5e-6f);
        const Vec3f n = normalize(Vec3f(hits.Ng.x.v[0], hits.Ng.y.v[0], hits.Ng.z.v[0]));
        EXPECT_GT(dot(n, normalize(way)), 0.9995f) << i;
        met[i % 8 >= 4 ? 3 : k == 0 ? 0 : k == 3 ? 2 : 1]++;
    }
    for (const size_t n : met)
        EXPECT_GT(n, 1000u);
}

// Of a material that lets light through in part and refracts nothing a fibre is one layer, as a ribbon is.
TEST_P(Fibres, AreOneLayerOfWhatIsPartlyThere) {
    for (const bool polygons : {false, true}) {
        Slab slab;
        slab.primitives = {grass(false)};
        slab.options = dice::test::looking(3);
        slab.target.polygons = polygons;
        slab.program.nodes[0].lobe = grid::LobeId::LambertBtdf;
        const Traced layer(slab, GetParam());
        // From inside of one fibre: out, if it is a layer.
        const scene::Value& v = *slab.primitives[0].primvars.find("P");
        bvh::RayPacket<8> packet;
        for (int k = 0; k < 8; k++)
            for (int c = 0; c < 3; c++) {
                packet.o[c].v[k] = v.floats[size_t(9 * k + c)] + (c == 1 ? 0.5f : 0.0f);
                packet.d[c].v[k] = c == 2 ? 1.0f : 0.0f;
            }
        packet.t_max = Float<8>(Width);
        packet.active = Int<8>::lane_index() >= Int<8>(0);
        packet.seed = Int<8>(1);
        EXPECT_EQ(layer.scene().occluded(packet).bits(), 0u);
        slab.program.nodes[0].lobe = grid::LobeId::MicrosurfaceDielectricBsdfRgb_v1;
        EXPECT_EQ(Traced(slab, GetParam()).scene().occluded(packet).bits(), 255u);
    }
}

// Of clear glass a fibre has one surface: rays go in and out of it by turns, as often as points along them
// are nearer to its axis than its radius, wherever segments join.
TEST_P(Fibres, HaveNoSurfacesInside) {
    scene::Curves c;
    c.cubic = false;
    c.vertices_per_curve = std::vector<int32_t>{6};
    const std::vector<float> p{-0.2f, 0,    0, -0.1f, 0.05f, 0,     0,    0, 0.03f,
                               0.02f, 0.1f, 0, 0.08f, 0.1f,  0.06f, 0.1f, 0, 0.1f};
    Slab slab;
    slab.primitives = {dice::test::primitive(c, p)};
    slab.primitives[0].primvars.set(
        floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {0.04f}));
    slab.options = dice::test::looking(4, 40);
    slab.program.nodes[0].lobe = grid::LobeId::MicrosurfaceDielectricBsdfRgb_v1;
    const Traced traced(slab, GetParam());
    ASSERT_TRUE(traced.fibres());
    float radius = 0;
    const std::vector<Vec3f> axis = traced.axis(radius);
    const auto depth = [&](const Vec3f& q) { // inside
        float best = -1;
        for (size_t k = 0; k + 1 < axis.size(); k++) {
            const Vec3f from = q - axis[k], s = axis[k + 1] - axis[k];
            best = std::max(
                best, radius - length(from - s * std::clamp(dot(from, s) / length_squared(s), 0.0f, 1.0f)));
        }
        return best;
    };
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    const auto any = [&] { return Vec3f(normal(random), normal(random), normal(random)); };
    int compared = 0, through_joints = 0;
    for (int i = 0; i < 3000; i++) {
        const size_t k = 1 + size_t(i) % (axis.size() - 2);
        const Vec3f d = normalize(any()), o = axis[k] + any() * (0.5f * radius) - d;
        std::vector<float> borders; // from sample to sample
        constexpr int Samples = 12000;
        bool was = false, clear = true;
        for (int s = 0; s <= Samples; s++) {
            const float t = 0.4f + 1.2f * float(s) / Samples, in = depth(o + d * t);
            if ((in > 0) != was)
                borders.push_back(t), was = in > 0;
            clear &= std::abs(in) > 1e-6f || in < -1e-4f; // none so shallow that samples decide
        }
        for (size_t b = 0; b + 1 < borders.size(); b++)
            clear &= borders[b + 1] - borders[b] > 2e-3f;
        if (!clear)
            continue;
        bvh::RayPacket<8> packet;
        for (int e = 0; e < 8; e++)
            for (int x = 0; x < 3; x++)
                packet.o[x].v[e] = o[x], packet.d[x].v[e] = d[x];
        packet.active = Int<8>::lane_index() < Int<8>(1);
        packet.seed = Int<8>(0);
        packet.time = Float<8>(0);
        std::vector<float> hits_at;
        for (float from = 0.0f; hits_at.size() < 20;) {
            packet.t_min = Float<8>(from), packet.t_max = Float<8>(2);
            bvh::HitPacket<8> hits;
            traced.scene().intersect(packet, hits);
            if (!(hits.hit.bits() & 1))
                break;
            hits_at.push_back(hits.t.v[0]);
            const Vec3f n(hits.Ng.x.v[0], hits.Ng.y.v[0], hits.Ng.z.v[0]);
            EXPECT_EQ(dot(n, d) > 0, hits_at.size() % 2 == 0) << i;
            from = hits_at.back() + 1e-4f;
        }
        ASSERT_EQ(hits_at.size(), borders.size()) << i;
        for (size_t b = 0; b < borders.size(); b++)
            EXPECT_NEAR(hits_at[b], borders[b], 2e-4f);
        compared++, through_joints += depth(o + d) > 0.2f * radius;
    }
    EXPECT_GT(compared, 1500);
    EXPECT_GT(through_joints, 500);
}

// Half way through the shutter they are half way, and as thick as is between.
TEST_P(Fibres, MoveAndSwell) {
    const auto rod = [](float x, float width) {
        scene::Curves c;
        c.cubic = false;
        c.vertices_per_curve = std::vector<int32_t>{2};
        scene::Primitive p = dice::test::primitive(c, {x, -1, 0, x, 1, 0});
        p.primvars.set(floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {width}));
        return p;
    };
    const scene::Primitive later[] = {rod(0.5f, 0.06f)};
    Slab slab;
    slab.primitives = {rod(-0.5f, 0.02f)};
    slab.options = dice::test::looking(4, 20);
    slab.target.later = later;
    const Traced traced(slab, GetParam());
    ASSERT_TRUE(traced.fibres());
    for (const float time : {0.0f, 0.25f, 0.5f, 1.0f}) {
        const Vec3f middle(time - 0.5f, 0, 0);
        EXPECT_NEAR((1 - traced.passed(middle, {0, 0, 1}, 0.1f, 20000, 1, time)) * 0.2,
                    0.02 + 0.04 * double(time), 0.0015);
        EXPECT_NEAR((1 - traced.passed(middle, {1, 0, 0}, 0.1f, 20000, 1, time)) * 0.2,
                    0.02 + 0.04 * double(time), 0.0015);
    }
}

} // namespace
