// Lobes on normals of their own: no light is lost or made, samples and values agree, and directions are those
// of the law of reflection about that normal, in double precision.
#include "bsdf/own_normal.h"

#include <gtest/gtest.h>

#include "bsdf/test_trees.h"

namespace kanuka::bsdf {
namespace {

using namespace testing;

const Vec3f Leaning[] = {{0, 0, 1}, {0.3f, 0, 1}, {-0.5f, 0.7f, 1}, {1.2f, 0.4f, 0.5f}, {0.3f, 0, -1}};

struct Vec3d {
    double x, y, z;
};
Vec3d unit(Vec3d v) {
    const double s = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
    return {v.x / s, v.y / s, v.z / s};
}
double dot(const Vec3d& a, const Vec3d& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

int with_normal(Tree& t, LobeId id, std::vector<Vec3f> inputs) {
    const grid::LobeDecl& decl = grid::lobe(id);
    while (decl.inputs[inputs.size()].type != grid::InputType::Normal)
        inputs.push_back(decl.inputs[inputs.size()].fallback);
    inputs.emplace_back(0.0f); // what a place holds is the hit's business
    return t.lobe(id, inputs);
}

// A tree seen along wo, with the normal of all lobes that have their own.
struct Seen {
    const MaterialCode code;
    F8 l[Wavelengths];
    V8 normals[MaxLobes];
    V8 wo;
    Material<8> material;

    Seen(const Tree& t, const Vec3f& normal, const V8& wo)
        : code(t.program), wo(wo),
          material(code, TreeFetch<8>(t), Mask<8>(true), wo, filled(normal), nullptr, normals) {}

  private:
    const F8* filled(const Vec3f& normal) {
        wavelengths<8>(l);
        std::ranges::fill(normals, V8(F8(normal.x), F8(normal.y), F8(normal.z)));
        return l;
    }
};

double energy(const Seen& seen, double& error) {
    Uniform u(11);
    RunningMean mean;
    for (int i = 0; i < 6000; i++) {
        const auto s = seen.material.sample(seen.wo, u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
        for (int k = 0; k < 8; k++)
            mean.add(s.valid[k] && s.value.pdf[0][k] > 0 ? double(s.value.f[0][k] / s.value.pdf[0][k]) : 0.0);
    }
    error = mean.error();
    return mean.mean();
}

TEST(OwnNormal, TurnsToItsNormalAndBack) {
    Uniform u(3);
    for (int i = 0; i < 200; i++) {
        const V8 n(F8(2.0f) * u.lanes<8>() - F8(1.0f), F8(2.0f) * u.lanes<8>() - F8(1.0f), u.lanes<8>());
        const V8 w(u.lanes<8>(), F8(2.0f) * u.lanes<8>() - F8(1.0f), u.lanes<8>());
        const Turn<8> turn(n);
        const V8 up = turn.to(turn.n), back = turn.from(turn.to(w));
        for (int k = 0; k < 8; k++) {
            const Vec3d given = unit({n.x[k], n.y[k], n.z[k]});
            if (given.z > 0.11) {
                EXPECT_NEAR(dot(given, {turn.n.x[k], turn.n.y[k], turn.n.z[k]}), 1, 1e-6);
            }
            EXPECT_NEAR(up.z[k], 1, 1e-6f);
            EXPECT_NEAR(back.x[k], w.x[k], 1e-6f);
            EXPECT_NEAR(back.y[k], w.y[k], 1e-6f);
            EXPECT_NEAR(back.z[k], w.z[k], 1e-6f);
            // Lengths and angles stay.
            EXPECT_NEAR(dot(turn.to(w), turn.to(n))[k], dot(w, n)[k], 2e-6f);
        }
    }
}

// Normals of zero and no number are the material's own, as are those along it.
TEST(OwnNormal, IsTheMaterialsWhereThereIsNone) {
    Tree plain, own;
    white_lambert(plain);
    with_normal(own, LobeId::LambertBrdf, {White});
    const V8 wo = seen_from<8>(0.6f), wi(F8(0.48f), F8(-0.36f), F8(0.8f));
    const Seen without(plain, Vec3f(0.0f), wo);
    for (const Vec3f& n : {Vec3f(0.0f), Vec3f(NAN, 0, 1), Vec3f(0, 0, 7), Vec3f(0, 0, -1)}) {
        const Seen with(own, n, wo);
        EXPECT_EQ(with.material.eval(wo, wi).f[0][0], without.material.eval(wo, wi).f[0][0]);
        EXPECT_EQ(with.material.eval(wo, wi).pdf[0][0], without.material.eval(wo, wi).pdf[0][0]);
    }
}

// Lambert's law about the normal, and what is below the horizon mirrored there.
TEST(OwnNormal, ValuesAreThoseOfTheTurnedLobe) {
    Tree t;
    with_normal(t, LobeId::LambertBrdf, {White});
    for (const Vec3f& n : Leaning) {
        const double side = n.z < 0 ? -1 : 1;
        const Vec3d normal = unit({side * n.x, side * n.y, side * n.z});
        const Seen seen(t, n, seen_from<8>(0.6f));
        Uniform u(5);
        for (int i = 0; i < 200; i++) {
            const V8 wi = sample_cosine(u.lanes<8>(), u.lanes<8>());
            const LobeValue<8> v = seen.material.eval(seen.wo, wi);
            const LobeValue<8> below = seen.material.eval(seen.wo, mirrored_at_horizon(wi));
            for (int k = 0; k < 8; k++) {
                const Vec3d w{wi.x[k], wi.y[k], wi.z[k]}, image{wi.x[k], wi.y[k], -wi.z[k]};
                const double expected =
                    (std::max(dot(normal, w), 0.0) + std::max(dot(normal, image), 0.0)) / M_PI;
                EXPECT_NEAR(v.f[0][k], expected, 1e-6);
                EXPECT_NEAR(v.pdf[0][k], expected, 1e-6); // it is sampled as it reflects
                EXPECT_EQ(below.f[0][k], 0);
            }
        }
    }
}

TEST(OwnNormal, SmoothLobesReflectAboutIt) {
    Tree t;
    with_normal(t, LobeId::MicrofacetConductorBrdf, {White, White, Vec3f(0.0f)});
    for (const Vec3f& n : {Leaning[0], Leaning[1], Leaning[2]}) {
        const Vec3d normal = unit({n.x, n.y, n.z});
        const Seen seen(t, n, seen_from<8>(0.9f));
        const Vec3d o{seen.wo.x[0], seen.wo.y[0], seen.wo.z[0]};
        const double c = 2 * dot(o, normal);
        const auto s = seen.material.sample(seen.wo, F8(0.3f), F8(0.2f), F8(0.7f));
        ASSERT_TRUE(s.valid[0] && s.delta[0]);
        EXPECT_NEAR(s.wi.x[0], c * normal.x - o.x, 2e-6);
        EXPECT_NEAR(s.wi.y[0], c * normal.y - o.y, 2e-6);
        EXPECT_NEAR(s.wi.z[0], std::abs(c * normal.z - o.z), 2e-6);
    }
}

// White furnaces: what leans has the energy of what does not, seen under the same angle to its normal.
TEST(OwnNormal, LosesAndMakesNoLight) {
    Tree matte, rough, metal, coated, below;
    with_normal(matte, LobeId::LambertBrdf, {White});
    with_normal(rough, LobeId::OrenNayarBrdf, {White, Vec3f(0.8f)});
    with_normal(metal, LobeId::MicrofacetConductorBrdf, {White, White, Vec3f(0.5f)});
    const int above =
        with_normal(coated, LobeId::MicrofacetDielectricBrdf, {White, Vec3f(1.5f), Vec3f(0.3f)});
    coated.join(LayerOp::Coat, above, white_lambert(coated));
    const int coat = varnish(below, 0.3f);
    below.join(LayerOp::Coat, coat, with_normal(below, LobeId::LambertBrdf, {White}));
    for (const Tree* t : {&matte, &rough, &metal, &coated, &below})
        for (const Vec3f& n : Leaning)
            for (float cosine : {0.95f, 0.4f}) {
                const V8 wo = seen_from<8>(cosine);
                const Turn<8> turn(V8(F8(n.x), F8(n.y), F8(n.z)));
                const float angle = t == &below ? cosine : turn.seen(wo).z[0];
                double error, error_upright;
                const double upright = energy(Seen(*t, Vec3f(0.0f), seen_from<8>(angle)), error_upright);
                const double found = energy(Seen(*t, n, wo), error);
                EXPECT_NEAR(found, upright, 4.5 * (error + error_upright) + 1e-3)
                    << t - &matte << " leaning " << n.x << " " << n.y << " " << n.z << " cosine " << cosine;
                EXPECT_NEAR(upright, 1, 0.012 + 4.5 * error_upright); // of the coat's table
            }
}

// Light that a thick coat refracts about its own normal stays, is reflected back inside, and leaves in the
// end.
TEST(OwnNormal, ThickCoatsLoseLittleLight) {
    for (const Vec3f& n : Leaning)
        for (float cosine : {0.95f, 0.4f})
            for (const bool metal : {false, true}) {
                Tree t;
                const int coat =
                    with_normal(t, LobeId::MicrofacetDielectricBrdf, {White, Vec3f(1.5f), Vec3f(0.2f)});
                const int base = metal ? t.lobe(LobeId::MicrofacetConductorBrdf, {White, White, Vec3f(0.5f)})
                                       : white_lambert(t);
                t.join(LayerOp::Thick, coat, base);
                double error;
                const double found = energy(Seen(t, n, seen_from<8>(cosine)), error);
                EXPECT_LE(found, 1.01 + 4.5 * error) << metal;
                EXPECT_GE(found, (metal ? 0.85 : 0.97) - 4.5 * error)
                    << metal << " leaning " << n.x << " " << n.y << " " << n.z << " cosine " << cosine;
            }
}

// The form factor of a sphere that the horizon cuts (Snyder 1996, *Area Light Sources for Real-Time
// Graphics*): what it covers is the cone, of sine 1 / n.
TEST(OwnNormal, KnowsTheConeThatLeaves) {
    for (const double n : {1.2, 1.5, 2.0})
        for (double cosine = -0.95; cosine < 1; cosine += 0.05) {
            ThickLayer<8> layer;
            const double sine = std::sqrt(1 - cosine * cosine), h2 = n * n, k2 = 1 - h2 * cosine * cosine;
            double expected = std::max(cosine, 0.0);
            if (k2 > 0)
                expected = h2 / M_PI *
                           ((cosine * std::acos(-cosine * std::sqrt((h2 - 1) / (1 - cosine * cosine))) -
                             std::sqrt(k2 * (h2 - 1))) /
                                h2 +
                            std::atan(std::sqrt(k2 / (h2 - 1))));
            layer.turn = nullptr;
            layer.n = F8(float(n));
            const V8 receiver(F8(float(sine)), F8(0.0f), F8(float(cosine)));
            EXPECT_NEAR(layer.cone_seen_from(receiver)[0], expected, 1e-5) << n << " " << cosine;
        }
}

// What is sampled has the density that is stated: of the pdf's integral over the sphere by a lattice, and of
// the mean of f / pdf beside that of f.
TEST(OwnNormal, DensitiesIntegrateToOne) {
    Tree thick, coated;
    thick.join(LayerOp::Thick,
               with_normal(thick, LobeId::MicrofacetDielectricBrdf, {White, Vec3f(1.5f), Vec3f(0.5f)}),
               white_lambert(thick));
    coated.join(LayerOp::Coat,
                with_normal(coated, LobeId::MicrofacetDielectricBrdf, {White, Vec3f(1.5f), Vec3f(0.5f)}),
                with_normal(coated, LobeId::SheenBrdf, {White, Vec3f(0.6f)}));
    for (const Tree* t : {&thick, &coated})
        for (const Vec3f& n : Leaning) {
            const Seen seen(*t, n, seen_from<8>(0.7f));
            double density = 0, value = 0, error;
            const int rows = 512, columns = 1024;
            for (int i = 0; i < rows; i++)
                for (int j = 0; j < columns; j += 8) {
                    float turn[8];
                    for (int k = 0; k < 8; k++)
                        turn[k] = (float(j + k) + 0.5f) / float(columns);
                    F8 s, c;
                    sincos_2pi(F8::load(turn), s, c);
                    const F8 z((float(i) + 0.5f) / float(rows)), r = sqrt(F8(1.0f) - z * z);
                    const LobeValue<8> v = seen.material.eval(seen.wo, V8(r * c, r * s, z));
                    for (int k = 0; k < 8; k++)
                        density += v.pdf[0][k], value += v.f[0][k];
                }
            const double cell = 2 * M_PI / (rows * columns);
            EXPECT_LE(density * cell, 1.002);
            EXPECT_GE(density * cell, n.x > 1 ? 0.6 : 0.97); // what is refracted out of sight is no sample
            const double sampled = energy(seen, error);
            EXPECT_NEAR(sampled, value * cell, 4.5 * error + 2e-3);
        }
}

} // namespace
} // namespace kanuka::bsdf
