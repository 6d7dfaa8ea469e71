// Walks between facets: what eval() says in the mean against rays that are simulated, furnaces, reciprocity
// in the mean, the same numbers for the same directions.
#include <gtest/gtest.h>

#include "base/test_statistics.h"
#include "bsdf/test_lobes.h"

namespace kanuka::bsdf {

using namespace testing;
using kanuka::testing::RunningMean;

namespace {

LobeCase mirror(float roughness) {
    return LobeCase{LobeId::MicrofacetConductorBrdf}.with("roughness", roughness).with("walks", 1);
}
LobeCase glass(float roughness, float ior = 1.5f) {
    return LobeCase{LobeId::MicrosurfaceDielectricBsdfRgb_v1}
        .with("roughness", roughness)
        .with("ior", ior)
        .with("walks", 1);
}

// Mean of value over density, of samples that end in each of the rings of equal solid angle, from -z up.
constexpr int Belts = 10;
void evaluated(const LobeCase& c, int count, RunningMean ring[Belts], RunningMean& whole) {
    Uniform u(31);
    const auto in = c.inputs<8>();
    const V8 wo = c.wo<8>();
    for (int i = 0; i < count; i += 8) {
        const auto s = sample_lobe(c.id, in, wo, u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
        const auto v = eval_lobe(c.id, in, wo, s.wi);
        for (int k = 0; k < 8; k++) {
            const double w = s.valid[k] && v.pdf[0][k] > 0 ? double(v.f[0][k] / v.pdf[0][k]) : 0.0;
            whole.add(w);
            for (int b = 0; b < Belts; b++)
                ring[b].add(b == std::clamp(int((s.wi.z[k] + 1) * 0.5f * Belts), 0, Belts - 1) ? w : 0.0);
        }
    }
}

// The same of rays that wander over a microsurface until they leave it, written in heights of their own: a
// uniform distribution in [-1, 1], as the paper has it.
Vec3f wander(float alpha, float eta, bool refracts, Vec3f wo, Uniform& u, bool& left) {
    using F1 = Float<1>;
    using V1 = Vec3<F1>;
    const auto lambda = [&](const Vec3f& w) {
        const double t2 = double(w.x * w.x + w.y * w.y) / std::max(double(w.z) * double(w.z), 1e-12);
        const double root = std::sqrt(1 + double(alpha) * double(alpha) * t2);
        return 0.5 * ((w.z > 0 ? root : -root) - 1);
    };
    const auto climb = [&](const Vec3f& w, double h, bool& out) {
        const double L = lambda(w), C = 0.5 * (h + 1), x = double(u.one());
        if (w.z > 0 && x >= 1 - std::pow(C, L)) {
            out = true;
            return h;
        }
        return std::clamp(2 * C / std::pow(1 - x, 1 / L) - 1, -1.0, 1.0);
    };
    Vec3f ray = wo * -1.0f;
    double h = 1;
    bool outside = true;
    for (int k = 0; k < 200; k++) {
        left = false;
        h = outside ? climb(ray, h, left) : -climb(ray * -1.0f, -h, left);
        if (left)
            return ray;
        const float side = outside ? 1.0f : -1.0f;
        const Vec3f v = ray * -side;
        const V1 v1{F1(v.x), F1(v.y), F1(v.z)};
        const V1 m = sample_visible_ggx<1>(F1(alpha), F1(alpha), v1, F1(u.one()), F1(u.one()));
        F1 cos_t;
        const F1 index(outside ? eta : 1 / eta), cosine = max(dot(v1, m), F1(0.0f));
        const bool reflects = !refracts || u.one() < fresnel_dielectric(cosine, index, cos_t)[0];
        const V1 next = reflects ? reflect(v1, m) : refract(v1, m, index, cos_t);
        ray = Vec3f(next.x[0], next.y[0], next.z[0]) * side;
        outside = reflects ? outside : !outside;
    }
    return ray;
}

} // namespace

TEST(Microsurface, MeansAreWhatRaysDo) {
    for (const bool refracts : {false, true})
        for (float roughness : {0.5f, 0.9f})
            for (float cosine : {0.95f, 0.3f})
                for (bool outside : {true, false}) {
                    if (!refracts && !outside)
                        continue;
                    const LobeCase c =
                        (refracts ? glass(roughness) : mirror(roughness)).seen_at(cosine, outside);
                    RunningMean ring[Belts], simulated[Belts], whole;
                    evaluated(c, 200000, ring, whole);
                    Uniform u(5);
                    const auto wo = c.wo<1>();
                    for (int i = 0; i < 60000; i++) {
                        bool left;
                        const Vec3f w = wander(roughness * roughness, outside ? 1.5f : 1 / 1.5f, refracts,
                                               Vec3f(wo.x[0], wo.y[0], wo.z[0]), u, left);
                        EXPECT_TRUE(left);
                        for (int b = 0; b < Belts; b++)
                            simulated[b].add(
                                b == std::clamp(int((w.z + 1) * 0.5f * Belts), 0, Belts - 1) ? 1.0 : 0.0);
                    }
                    for (int b = 0; b < Belts; b++)
                        EXPECT_NEAR(ring[b].mean(), simulated[b].mean(),
                                    4.5 * std::hypot(ring[b].error(), simulated[b].error()) + 5e-4)
                            << c.str() << ", belt " << b;
                }
}

// White ones lose nothing: no fit is in between.
TEST(Microsurface, Furnace) {
    for (float roughness : {0.2f, 0.4f, 0.7f, 1.0f})
        for (float cosine : {0.999f, 0.5f, 0.1f})
            for (const LobeCase& c :
                 {mirror(roughness).seen_at(cosine),
                  mirror(roughness).with("anisotropy", 0.6f).seen_at(cosine),
                  glass(roughness).seen_at(cosine), glass(roughness, 2.2f).seen_at(cosine, false),
                  glass(roughness).with("abbe", 30).seen_at(cosine)}) {
                RunningMean ring[Belts], whole;
                evaluated(c, 100000, ring, whole);
                // Slopes of stretched facets come from tables.
                EXPECT_NEAR(whole.mean(), 1, 4.5 * whole.error() + (c.given.size() > 3 ? 0.004 : 0.001))
                    << c.str();
            }
}

// Colour deepens with every facet: a metal of reflectance r sends back between r E and r.
TEST(Microsurface, ColourDeepens) {
    const LobeCase c = mirror(1).with("reflectance", 0.5f).with("edgeReflectance", 0.5f).seen_at(0.6f);
    RunningMean ring[Belts], whole;
    evaluated(c, 100000, ring, whole);
    const double once = 0.5 * double(ggx_albedo(Float<1>(0.6f), Float<1>(1.0f))[0]);
    EXPECT_GT(whole.mean() - 5 * whole.error(), once);
    EXPECT_LT(whole.mean() + 5 * whole.error(), once + 0.25 * (1 - 2 * once));
}

// Means over small cones about two directions, there and back; through an interface with the square of the
// index.
TEST(Microsurface, ReciprocalInTheMean) {
    const auto mean = [](const LobeCase& c, const Vec3f& from, const Vec3f& to, uint32_t seed) {
        Uniform u(seed);
        RunningMean m;
        for (int i = 0; i < 20000; i++) {
            const auto blurred = [&](const Vec3f& w) {
                const Vec3f r(u.one() - 0.5f, u.one() - 0.5f, u.one() - 0.5f);
                const Vec3f b = normalize(w + r * 0.05f);
                return V8(F8(b.x), F8(b.y), F8(b.z));
            };
            const V8 a = blurred(from), b = blurred(to);
            m.add(double(eval_lobe(c.id, c.inputs<8>(a, c.outside), a, b).f[0][0]) /
                  std::abs(double(b.z[0])));
        }
        return m;
    };
    const Vec3f x = normalize(Vec3f(0.3f, 0.1f, 0.9f)), y = normalize(Vec3f(-0.7f, 0.5f, 0.4f));
    for (const LobeCase& c : {mirror(0.8f), glass(0.8f)}) {
        const RunningMean there = mean(c, x, y, 1), back = mean(c, y, x, 2);
        EXPECT_NEAR(there.mean(), back.mean(), 4.5 * std::hypot(there.error(), back.error())) << c.str();
    }
    const auto below = [](const Vec3f& w) { return Vec3f(w.x, w.y, -w.z); };
    const RunningMean in = mean(glass(0.8f), x, below(y), 3),
                      out = mean(glass(0.8f).seen_at(1, false), y, below(x), 4);
    EXPECT_NEAR(in.mean(), 2.25 * out.mean(), 4.5 * std::hypot(in.error(), 2.25 * out.error()));
}

} // namespace kanuka::bsdf
