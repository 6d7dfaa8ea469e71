// Thick coats: what is sampled has the density that is stated, a white base under a clear coat loses nothing,
// absorption against quadrature, reciprocity where it holds, lane counts.
#include <numeric>

#include "bsdf/oracles/facets.h"
#include "bsdf/test_trees.h"

namespace kanuka::bsdf {

using namespace testing;
using kanuka::testing::chi_square;
using kanuka::testing::sidak;

namespace {

struct Base {
    std::string name;
    std::function<int(Tree&)> add;
};

int rough_mirror(Tree& t, float roughness) {
    return t.lobe(LobeId::MicrofacetConductorBrdf, {White, White, Vec3f(roughness)});
}

int shaped_mirror(Tree& t, float roughness, float anisotropy, float tail) {
    return t.lobe(LobeId::MicrofacetConductorBrdf,
                  {White, White, Vec3f(roughness), White, Vec3f(anisotropy), Vec3f(0.1f), Vec3f(tail)});
}

// All of white bases: what goes in comes out.
std::vector<Base> white_bases() {
    std::vector<Base> all = {
        {"Lambert", [](Tree& t) { return white_lambert(t); }},
        {"mirror", [](Tree& t) { return white_mirror(t); }},
        {"translucent",
         [](Tree& t) {
             const int a = white_lambert(t), b = t.lobe(LobeId::LambertBtdf, {White});
             return t.join(LayerOp::Mix, a, b, 0.6f);
         }},
        {"mix",
         [](Tree& t) {
             const int a = rough_mirror(t, 0.4f), b = white_lambert(t);
             return t.join(LayerOp::Mix, a, b, 0.3f);
         }},
        {"coated",
         [](Tree& t) {
             const int a = varnish(t, 0.3f), b = white_lambert(t);
             return t.join(LayerOp::Coat, a, b);
         }},
        {"brushed", [](Tree& t) { return shaped_mirror(t, 0.6f, 0.8f, 0.5f); }},
        {"brushed, narrow", [](Tree& t) { return shaped_mirror(t, 0.3f, 0.6f, 0.5f); }},
        {"Beckmann", [](Tree& t) { return shaped_mirror(t, 0.6f, 0, 0); }},
        {"foil", [](Tree& t) { return t.lobe(LobeId::RetroBrdf, {White, White, Vec3f(0.4f)}); }},
    };
    for (float roughness : {0.2f, 0.3f, 0.45f, 0.7f, 0.85f, 1.0f})
        all.push_back({"rough mirror " + std::to_string(roughness),
                       [=](Tree& t) { return rough_mirror(t, roughness); }});
    for (float roughness : {0.3f, 1.0f})
        all.push_back({"Oren-Nayar " + std::to_string(roughness),
                       [=](Tree& t) { return t.lobe(LobeId::OrenNayarBrdf, {White, Vec3f(roughness)}); }});
    return all;
}

// Reflection that loses something by itself, at its whitest.
std::vector<Base> other_bases() {
    const auto one_lobe = [](std::string name, LobeId id, std::vector<Vec3f> inputs) {
        return Base{std::move(name), [=](Tree& t) { return t.lobe(id, inputs); }};
    };
    std::vector<Base> all = {
        one_lobe("grating", LobeId::GratingBrdf, {White}),
        one_lobe("silver", LobeId::MetalBrdf, {Vec3f(1.0f), White, White, Vec3f(0.4f)}),
        one_lobe("dielectric", LobeId::MicrofacetDielectricBrdf, {White, Vec3f(2.0f), Vec3f(0.5f)}),
        one_lobe("long tail", LobeId::MicrofacetConductorBrdf,
                 {White, White, Vec3f(0.6f), White, Vec3f(0.0f), Vec3f(0.0f), Vec3f(0.6f)}),
        one_lobe("glass", LobeId::MicrosurfaceDielectricBsdfRgb_v1, {Half, White, White, Vec3f(1.8f)}),
        one_lobe("sheet", LobeId::ThinWalledDielectricBsdf, {White, White, Vec3f(1.8f), Half}),
    };
    for (float roughness : {0.1f, 1.0f}) {
        all.push_back(one_lobe("Burley", LobeId::BurleyBrdf, {White, Vec3f(roughness)}));
        all.push_back(one_lobe("sheen", LobeId::SheenBrdf, {White, Vec3f(roughness)}));
    }
    for (float exponent : {2.0f, 40.0f, 1000.0f}) {
        all.push_back(one_lobe("Phong", LobeId::PhongBrdf, {White, Vec3f(exponent)}));
        all.push_back(one_lobe("Blinn", LobeId::BlinnBrdf, {White, Vec3f(exponent)}));
    }
    return all;
}

int clear_coat(Tree& t, float index, float roughness) {
    return t.lobe(LobeId::MicrofacetDielectricBrdf, {White, Vec3f(index), Vec3f(roughness)});
}
int absorbing_coat(Tree& t, Vec3f through, float thickness, Vec3f absorption) {
    return t.lobe(LobeId::MicrofacetDielectricBrdf,
                  {White, Vec3f(1.5f), Vec3f(0.0f), Vec3f(0.0f), Vec3f(0.0f), Vec3f(0.5f), Vec3f(0.0f),
                   Vec3f(1.33f), through, Vec3f(thickness), absorption});
}

Tree under(const Base& base, float index, float roughness, float weight = 1) {
    Tree t;
    const int a = clear_coat(t, index, roughness), b = base.add(t);
    t.join(LayerOp::Thick, a, b, weight);
    return t;
}

} // namespace

// Energy by base, index, roughness and weight of the coat, and view; `alone`: of the base without a coat.
template <class Check>
void each_energy(const std::vector<Base>& bases, const std::vector<float>& indices, const Check& check) {
    for (const Base& base : bases)
        for (float cosine : Cosines) {
            Tree plain;
            base.add(plain);
            const Energy alone = scattered(plain, cosine, true, 3000);
            for (float index : indices)
                for (float roughness : {0.0f, 0.4f})
                    for (float weight : {1.0f, 0.5f}) {
                        SCOPED_TRACE(base.name + ", index " + std::to_string(index) + ", coat " +
                                     std::to_string(roughness) + ", weight " + std::to_string(weight) +
                                     ", cosine " + std::to_string(cosine));
                        check(scattered(under(base, index, roughness, weight), cosine, true, 3000), alone);
                    }
        }
}

// What a white base gets it gives back, but for 2.5 %; but for 1 % where the index is at most 1.5 and the
// base is Lambert's or of round microfacets, for which kept light is known rather than fitted or estimated.
// No coat makes light: what is beyond 1 is its base's own.
TEST(ThickCoat, WhiteBasesLoseNothing) {
    each_energy(white_bases(), {1.2f, 1.5f, 2.2f}, [](const Energy& e, const Energy& alone) {
        EXPECT_GE(e.mean[0] + 4.5 * e.error, 1 - 0.025);
        EXPECT_LE(e.mean[0] - 4.5 * e.error, std::max(alone.mean[0], 1.0) + 0.005);
        EXPECT_NEAR(e.albedo[0][0], 1, 0.02);
    });
    auto round = white_bases();
    std::erase_if(round, [](const Base& b) {
        return b.name.starts_with("brushed") || b.name == "Beckmann" || b.name.starts_with("Oren");
    });
    each_energy(round, {1.2f, 1.5f},
                [](const Energy& e, const Energy&) { EXPECT_GE(e.mean[0] + 4.5 * e.error, 1 - 0.01); });
}

TEST(ThickCoat, NothingIsGained) {
    each_energy(other_bases(), {1.2f, 1.5f, 2.2f, 3.5f}, [](const Energy& e, const Energy& alone) {
        for (int w = 0; w < Wavelengths; w++)
            EXPECT_LE(e.mean[w] - 4.5 * e.error, std::max(alone.mean[w], 1.0) + 0.005) << w;
    });
}

// Two coats, one upon the other, over a mix.
TEST(ThickCoat, Nested) {
    for (float cosine : Cosines) {
        Tree t;
        const int clear = clear_coat(t, 1.3f, 0), second = clear_coat(t, 1.5f, 0.3f);
        const int mirror = rough_mirror(t, 0.5f), paint = white_lambert(t);
        const int base = t.join(LayerOp::Mix, mirror, paint, 0.5f),
                  inner = t.join(LayerOp::Thick, second, base);
        t.join(LayerOp::Thick, clear, inner);
        const Energy e = scattered(t, cosine);
        EXPECT_LE(e.mean[0] - 4.5 * e.error, 1.005) << cosine;
        EXPECT_GE(e.mean[0] + 4.5 * e.error, 1 - 0.02) << cosine;
    }
}

// Directions of a rough base and of a diffuse one, against the density; what does not come out is the last
// cell.
TEST(ThickCoat, SamplesFollowTheirDensity) {
    constexpr int Count = 40000;
    const auto bases = white_bases();
    int tests = 0;
    for (const Base& base : bases)
        for (float cosine : {0.95f, 0.3f}) {
            if (base.name == "mirror")
                continue;
            const Tree t = under(base, 1.5f, 0.5f);
            const MaterialCode code(t.program);
            F8 l[Wavelengths];
            wavelengths<8>(l);
            const V8 wo = seen_from<8>(cosine);
            const Material<8> material(code, TreeFetch<8>(t), Mask<8>(true), wo, l);
            auto expected = integrate_cells([&](const V8& wi) { return material.eval(wo, wi).pdf[0]; });
            const double total = std::accumulate(expected.begin(), expected.end(), 0.0);
            expected.push_back(std::max(1 - total, 0.0));
            std::vector<double> seen(expected.size(), 0.0);
            Uniform u(uint32_t(7 + tests++));
            for (int i = 0; i < Count; i += 8) {
                const auto s = material.sample(wo, u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
                const F8 turn = turn_of(s.wi.y, s.wi.x);
                for (int k = 0; k < 8; k++) {
                    const int ring = std::clamp(int((s.wi.z[k] + 1) * 0.5f * Rings), 0, Rings - 1);
                    const int sector = std::min(int(turn[k] * Sectors), Sectors - 1);
                    seen[s.valid[k] ? size_t(ring * Sectors + sector) : seen.size() - 1]++;
                }
            }
            EXPECT_LE(total, 1 + 3e-4) << base.name;
            EXPECT_GT(total, 0.6) << base.name << ": too much is drawn in vain";
            EXPECT_NEAR(1 - seen.back() / Count, total,
                        5 * std::sqrt(total * std::max(1 - total, 1e-4) / Count) + 3e-4)
                << base.name;
            for (double& e : expected)
                e *= Count;
            const auto test = chi_square(seen, expected);
            EXPECT_GT(test.p, sidak(1e-3, 2 * int(bases.size()))) << base.name << " at " << cosine;
            EXPECT_LE(test.impossible, 1e-4 * Count) << base.name;
        }
}

// What one facet of a dielectric reflects of light that comes by a cosine.
double albedo_of_facets(double alpha, double n, double cosine) {
    if (alpha == 0)
        return oracle::glass_reflectance(cosine, n);
    const oracle::Facets facets{alpha, alpha};
    const oracle::Dir wo{std::sqrt(1 - cosine * cosine), 0, cosine};
    return 2 * oracle::integral(0, oracle::HalfTau / 2, 40, [&](double theta) {
               return std::sin(theta) * oracle::integral(0, 1, 24, [&](double x) { // dense about the mirror
                          const double phi = oracle::HalfTau * (1 - x * x * x);
                          const oracle::Dir wi{std::sin(theta) * std::cos(phi),
                                               std::sin(theta) * std::sin(phi), std::cos(theta)};
                          const double F = oracle::glass_reflectance(oracle::cosine_of_facet(n, wo, wi), n);
                          return F * oracle::reflected(facets, wo, wi) * 3 * x * x * oracle::HalfTau;
                      });
           });
}

// A clear coat, smooth or rough, over Lambert: what its facets do not reflect goes in, and by reciprocity
// out, and the rest goes on inside, a geometric series (oracles/, in double).
TEST(ThickCoat, LambertAgainstTheClosedForm) {
    const float n = 1.5f, albedo = 0.6f;
    F8 l[Wavelengths];
    wavelengths<8>(l);
    for (float roughness : {0.0f, 0.35f, 0.7f, 1.0f}) {
        const double alpha = double(roughness) * double(roughness);
        const auto passes = [&](double c) { return 1 - albedo_of_facets(alpha, double(n), c); };
        const double mean = oracle::integral(0, 1, 6, [&](double c) { return 2 * c * passes(c); });
        const double kept = 1 - mean / double(n * n);
        Tree t, alone;
        const int a = clear_coat(t, n, roughness), b = t.lobe(LobeId::LambertBrdf, {Vec3f(albedo)});
        t.join(LayerOp::Thick, a, b);
        clear_coat(alone, n, roughness);
        const MaterialCode code(t.program), code_alone(alone.program);
        for (float out : {0.95f, 0.5f, 0.2f})
            for (float in : {0.9f, 0.4f, 0.15f}) {
                const V8 wo = seen_from<8>(out), wi = direction(F8(in), F8(0.37f));
                const Material<8> material(code, TreeFetch<8>(t), Mask<8>(true), wo, l),
                    coat(code_alone, TreeFetch<8>(alone), Mask<8>(true), wo, l);
                const double expected = passes(double(out)) * passes(double(in)) * double(albedo) *
                                        double(in) /
                                        (oracle::HalfTau * double(n * n) * (1 - double(albedo) * kept));
                const float below = material.eval(wo, wi).f[0][0] - coat.eval(wo, wi).f[0][0];
                EXPECT_NEAR(double(below) / expected, 1, 0.012) << roughness << " " << out << " " << in;
            }
    }
}

// f(wo, wi) / cos i is symmetric where the base is diffuse; over microfacets the series goes by the viewer's
// side alone, and is not.
class ReciprocalCoat : public ::testing::TestWithParam<float> {};
INSTANTIATE_TEST_SUITE_P(ThickCoat, ReciprocalCoat, ::testing::Values(0.0f, 0.4f, 0.8f));
TEST_P(ReciprocalCoat, OverDiffuseBases) {
    Tree t;
    const int a = GetParam() > 0 ? clear_coat(t, 1.5f, GetParam())
                                 : absorbing_coat(t, White, 2, Vec3f(0.1f, 0.2f, 0.4f)),
              b = t.lobe(LobeId::LambertBrdf, {Half});
    t.join(LayerOp::Thick, a, b);
    const MaterialCode code(t.program);
    F8 l[Wavelengths];
    wavelengths<8>(l);
    Uniform u(3);
    for (int i = 0; i < 50; i++) {
        const V8 x = direction(F8(u.one()), F8(u.one())), y = direction(F8(u.one()), F8(u.one()));
        const Material<8> from_x(code, TreeFetch<8>(t), Mask<8>(true), x, l),
            from_y(code, TreeFetch<8>(t), Mask<8>(true), y, l);
        for (int k = 0; k < Wavelengths; k++) {
            const float there = from_x.eval(x, y).f[k][0] / y.z[0], back = from_y.eval(y, x).f[k][0] / x.z[0];
            EXPECT_NEAR(there, back, 0.01f * std::max(there, back) + 1e-6f) << x.z[0] << " " << y.z[0];
        }
    }
}

// A mirror below an absorbing coat: in and out along the refracted direction, absorption by thickness; what
// the surface reflects inside adds a series.
TEST(ThickCoat, AbsorptionAlongRefractedWays) {
    for (float cosine : Cosines)
        for (float thickness : {0.5f, 2.0f}) {
            Tree t;
            const Vec3f sigma(0.1f, 0.5f, 1.5f);
            const int a = absorbing_coat(t, White, thickness, sigma), b = white_mirror(t);
            t.join(LayerOp::Thick, a, b);
            const Energy e = scattered(t, cosine, true, 4000);
            Float<1> unused;
            const double F = double(fresnel_dielectric(Float<1>(cosine), Float<1>(1.5f), unused)[0]);
            const double down = std::sqrt(1 - (1 - double(cosine) * double(cosine)) / 2.25);
            for (int w = 0; w < 3; w++) {
                const double way = std::exp(-double(sigma[w]) * double(thickness) / down);
                // The series takes about the mean of the ways.
                const double mean = std::exp(-double(sigma[w]) * double(thickness) / 0.7);
                const double expected = F + (1 - F) * (1 - F) * way * way / (1 - F * mean * mean);
                EXPECT_NEAR(e.mean[w], expected, 4.5 * e.error + 0.004) << cosine << " " << w;
            }
        }
}

// A coat of no weight is none, and one of any other upper layer is a coat.
TEST(ThickCoat, NoneAndOthers) {
    Tree t;
    const int a = clear_coat(t, 1.5f, 0), b = white_lambert(t);
    t.join(LayerOp::Thick, a, b, 0);
    const MaterialCode code(t.program);
    F8 l[Wavelengths];
    wavelengths<8>(l);
    const V8 wo = seen_from<8>(0.4f), wi = direction(F8(0.3f), F8(0.1f));
    const Material<8> material(code, TreeFetch<8>(t), Mask<8>(true), wo, l);
    EXPECT_NEAR(material.eval(wo, wi).f[0][0], 0.3f / 3.14159265f, 2e-4f);
    Tree other;
    const int c = white_mirror(other, 0.5f), d = white_lambert(other);
    other.join(LayerOp::Thick, c, d);
    EXPECT_TRUE(MaterialCode(other.program).beds.empty());
    expect_energy(other, 0.5f, 1, "thick mirror");
    Tree plain;
    white_lambert(plain);
    EXPECT_TRUE(MaterialCode(plain.program).beds.empty());
}

TEST(ThickCoat, LaneCountsAgree) {
    Tree t;
    const int a = absorbing_coat(t, Vec3f(0.9f, 0.8f, 0.7f), 1, Vec3f(0.1f, 0.2f, 0.3f)),
              b = rough_mirror(t, 0.5f),
              c = t.lobe(LobeId::OrenNayarBrdf, {Vec3f(0.2f, 0.5f, 0.9f), Vec3f(0.7f)});
    const int base = t.join(LayerOp::Mix, b, c, 0.4f);
    t.join(LayerOp::Thick, a, base, 0.9f);
    const MaterialCode code(t.program);
    const auto run = [&](auto width) {
        constexpr int W = decltype(width)::value;
        Float<W> l[Wavelengths];
        wavelengths<W>(l);
        const Material<W> material(code, TreeFetch<W>(t), Mask<W>(true), seen_from<W>(0.6f), l);
        Uniform u(8);
        std::vector<float> out;
        for (int i = 0; i < 2048 / W; i++) {
            float x[3][W];
            for (int k = 0; k < W; k++)
                for (auto& r : x)
                    r[k] = u.one();
            const auto s = material.sample(seen_from<W>(0.6f), Float<W>::load(x[0]), Float<W>::load(x[1]),
                                           Float<W>::load(x[2]));
            for (int k = 0; k < W; k++) {
                out.push_back(float(s.valid[k]));
                for (float f : {s.wi.x[k], s.wi.y[k], s.wi.z[k], s.value.f[0][k], s.value.pdf[0][k],
                                s.value.f[3][k], float(s.delta[k])})
                    out.push_back(s.valid[k] ? f : 0.0f);
            }
        }
        return out;
    };
    const auto one = run(std::integral_constant<int, 1>()), eight = run(std::integral_constant<int, 8>()),
               sixteen = run(std::integral_constant<int, 16>());
    EXPECT_EQ(one, eight);
    EXPECT_EQ(one, sixteen);
}

} // namespace kanuka::bsdf
