// Layering: weights of mix, over and coat trees, the furnace, mixtures of smooth and rough lobes, lane
// counts.
#include "bsdf/test_trees.h"

namespace kanuka::bsdf {

using namespace testing;

TEST(Material, FurnaceOfLosslessLobes) {
    for (float cosine : Cosines) {
        Tree a, b, c;
        white_lambert(a);
        expect_energy(a, cosine, 1, "Lambert");
        white_mirror(b);
        expect_energy(b, cosine, 1, "mirror");
        glass(c, 0);
        expect_energy(c, cosine, 1, "glass");
    }
}

TEST(Material, FurnaceOfMixes) {
    for (float cosine : Cosines) {
        Tree t;
        const int a = white_lambert(t), b = white_mirror(t);
        const int inner = t.join(LayerOp::Mix, a, b, 0.3f), c = glass(t, 0);
        t.join(LayerOp::Mix, inner, c, 0.6f);
        expect_energy(t, cosine, 1, "mix");
    }
}

TEST(Material, FurnaceOfOver) {
    for (float cosine : Cosines) {
        Tree t; // a half-present layer over a whole one; what it covers the base does not show
        const int a = white_mirror(t, 0.5f), b = white_lambert(t);
        t.join(LayerOp::Over, a, b, 0.8f);
        expect_energy(t, cosine, 1, "over");
        Tree deep; // over (over (a, b), c): coverage of the upper pair is 0.4 + 0.6 * 0.5
        const int p = white_mirror(deep, 0.4f), q = white_lambert(deep, 0.5f), r = white_lambert(deep);
        const int pair = deep.join(LayerOp::Over, p, q);
        deep.join(LayerOp::Over, pair, r);
        expect_energy(deep, cosine, 1, "nested over");
    }
}

TEST(Material, FurnaceOfCoats) {
    for (float cosine : Cosines)
        for (float roughness : {0.0f, 0.2f, 0.5f, 0.9f})
            for (float weight : {1.0f, 0.5f}) {
                Tree t;
                const int a = varnish(t, roughness), b = white_lambert(t);
                t.join(LayerOp::Coat, a, b, weight);
                expect_energy(t, cosine, 1, "coat", 0.005); // the albedo table's share
            }
}

// Which of a path's four wavelengths leads must not change what a material is: values, densities and the
// shares of lobes are those of each wavelength alone. Under an interface that disperses, what a coat leaves
// to its base goes by Fresnel's equations with Cauchy's index at that wavelength, here in double.
TEST(Material, NothingDependsOnTheHero) {
    constexpr double Abbe = 12, Ior = 1.7;
    for (float roughness : {0.0f, 0.4f}) {
        Tree t;
        const int a = t.lobe(LobeId::MicrosurfaceDielectricBsdfRgb_v1,
                             {Vec3f(roughness), White, Vec3f(0.0f), Vec3f(float(Ior)), Vec3f(float(Abbe))},
                             0.6f),
                  b = t.lobe(LobeId::LambertBrdf, {Half});
        t.join(LayerOp::Coat, a, b);
        const MaterialCode code(t.program);
        for (float cosine : {0.9f, 0.2f}) {
            F8 l[Wavelengths], turned[Wavelengths];
            wavelengths<8>(l);
            const V8 wo = seen_from<8>(cosine), wi = seen_from<8>(0.5f);
            const Material<8> first(code, TreeFetch<8>(t), Mask<8>(true), wo, l);
            const auto expected = first.eval(wo, wi);
            for (int turn = 1; turn < Wavelengths; turn++) {
                for (int k = 0; k < Wavelengths; k++)
                    turned[k] = l[(k + turn) % Wavelengths];
                const Material<8> m(code, TreeFetch<8>(t), Mask<8>(true), wo, turned);
                const auto value = m.eval(wo, wi);
                for (int k = 0; k < Wavelengths; k++) {
                    const int same = (k + turn) % Wavelengths;
                    EXPECT_NEAR(value.f[k][0], expected.f[same][0], 1e-6f);
                    EXPECT_NEAR(value.pdf[k][0], expected.pdf[same][0], 1e-6f);
                    EXPECT_NEAR(m.albedo()[k][0], first.albedo()[same][0], 1e-6f);
                }
            }
            for (int k = 0; k < Wavelengths && roughness == 0; k++) {
                const double lambda = 360 + 470 * double(l[k][0]);
                const double B = (Ior - 1) / Abbe / (1 / (486.13 * 486.13) - 1 / (656.28 * 656.28));
                const double n = Ior + B * (1 / (lambda * lambda) - 1 / (587.56 * 587.56)),
                             c = double(cosine);
                const double ct = std::sqrt(1 - (1 - c * c) / (n * n));
                const double s = (c - n * ct) / (c + n * ct), p = (n * c - ct) / (n * c + ct);
                const double F = 0.5 * (s * s + p * p);
                EXPECT_NEAR(double(first.albedo()[k][0]), 0.6 * F + 0.5 * (1 - 0.6 * F), 1e-5) << lambda;
            }
        }
    }
}

// A coat that absorbs, over a white base: what is reflected, and what crosses the layer down and up, by
// quadrature over the way in.
TEST(Material, AbsorbingCoats) {
    for (float cosine : Cosines)
        for (float weight : {1.0f, 0.5f}) {
            Tree t;
            const Vec3f through(0.9f, 0.5f, 0.2f);
            const int a = t.lobe(LobeId::MicrofacetDielectricBrdf,
                                 {White, Vec3f(1.5f), Vec3f(0.0f), Vec3f(0.0f), Vec3f(0.0f), Vec3f(0.5f),
                                  Vec3f(0.0f), Vec3f(1.33f), through});
            const int b = white_lambert(t);
            t.join(LayerOp::Coat, a, b, weight);
            const Energy e = scattered(t, cosine, true, 20000);
            Float<1> unused;
            const double F = double(fresnel_dielectric(Float<1>(cosine), Float<1>(1.5f), unused)[0]);
            const auto down = [](double c) { return std::sqrt(1 - (1 - c * c) / 2.25); };
            for (int w = 0; w < 3; w++) {
                const double T = 1 - double(weight) * (1 - double(through[w]));
                double in = 0;
                for (int i = 0; i < 1000; i++) {
                    const double c2 = (i + 0.5) / 1000; // by cos^2
                    in += std::pow(T, 1 / down(std::sqrt(c2))) / 1000;
                }
                const double expected = double(weight) * F +
                                        (1 - double(weight) * F) * std::pow(T, 1 / down(double(cosine))) * in;
                EXPECT_NEAR(e.mean[w], expected, 4.5 * e.error + 0.004)
                    << cosine << " " << weight << " " << w;
            }
        }
}

TEST(Material, FurnaceOfATallTree) {
    for (float cosine : Cosines) {
        Tree t; // coat (varnish, coat (varnish, mix (mirror, over (half Lambert, glass))))
        const int clear = varnish(t, 0.1f), second = varnish(t, 0.6f), mirror = white_mirror(t);
        const int paint = white_lambert(t, 0.5f), base = glass(t, 0);
        const int painted = t.join(LayerOp::Over, paint, base);
        const int mixed = t.join(LayerOp::Mix, mirror, painted, 0.25f);
        const int coated = t.join(LayerOp::Coat, second, mixed);
        t.join(LayerOp::Coat, clear, coated);
        expect_energy(t, cosine, 1, "tall tree", 0.006);
    }
}

TEST(Material, AddSumsWeights) {
    Tree t;
    const int a = t.lobe(LobeId::LambertBrdf, {Half}, 0.25f), b = t.lobe(LobeId::LambertBtdf, {White}, 0.75f);
    t.join(LayerOp::Add, a, b);
    expect_energy(t, 0.5f, 0.125 + 0.75, "add");
}

// What light path expressions split: of an Add, each part is the material that has nothing else.
TEST(Material, PartsOfLobesAddUp) {
    const Vec3f red(0.7f, 0.2f, 0.1f), blue(0.1f, 0.2f, 0.4f), rough(0.45f);
    for (const LayerOp op : {LayerOp::Add, LayerOp::Coat, LayerOp::Thick}) {
        Tree whole, diffuse, glossy;
        const int base = whole.join(LayerOp::Add, whole.lobe(LobeId::LambertBrdf, {red}),
                                    whole.lobe(LobeId::MicrofacetConductorBrdf, {blue, blue, rough}));
        whole.join(op, varnish(whole, 0.3f), base);
        diffuse.lobe(LobeId::LambertBrdf, {red});
        const int metal = glossy.lobe(LobeId::MicrofacetConductorBrdf, {blue, blue, rough});
        glossy.join(LayerOp::Add, varnish(glossy, 0.3f), metal);
        const MaterialCode code(whole.program);
        EXPECT_EQ(__builtin_popcount(code.diffuse), 1);
        F8 l[Wavelengths];
        wavelengths<8>(l);
        const V8 wo = seen_from<8>(0.6f);
        const auto make = [&](const MaterialCode& of, const Tree& tree) {
            return Material<8>(of, TreeFetch<8>(tree), Mask<8>(true), wo, l);
        };
        const MaterialCode code_of_diffuse(diffuse.program), code_of_glossy(glossy.program);
        const Material<8> all = make(code, whole), one = make(code_of_diffuse, diffuse),
                          other = make(code_of_glossy, glossy);
        Uniform u(5);
        for (int i = 0; i < 40; i++) {
            const V8 wi = sample_cosine(u.lanes<8>(), u.lanes<8>());
            const auto f = all.eval(wo, wi).f, part = all.eval_some(code.diffuse, wo, wi),
                       rest = all.eval_some(~code.diffuse, wo, wi);
            for (int w = 0; w < Wavelengths; w++)
                for (int k = 0; k < 8; k++) {
                    EXPECT_GT(part[w][k], 0);
                    EXPECT_NEAR(part[w][k] + rest[w][k], f[w][k], 1e-5f * f[w][k]);
                    if (op != LayerOp::Add)
                        continue;
                    EXPECT_NEAR(part[w][k], one.eval(wo, wi).f[w][k], 1e-5f * part[w][k]);
                    EXPECT_NEAR(rest[w][k], other.eval(wo, wi).f[w][k], 1e-5f * rest[w][k]);
                }
        }
        EXPECT_EQ(all.eval_some(0, wo, wo)[0][0], 0);
    }
}

TEST(Material, ColoursStayWhereTheyBelong) {
    Tree t;
    const int a = t.lobe(LobeId::LambertBrdf, {Vec3f(1, 0.5f, 0)}),
              b = t.lobe(LobeId::LambertBrdf, {Vec3f(0, 0, 1)});
    t.join(LayerOp::Mix, a, b, 0.75f);
    const Energy e = scattered(t, 0.6f);
    const double expected[] = {0.75, 0.375, 0.25, 0.75 * 0.5 + 0.25 / 3};
    for (int w = 0; w < Wavelengths; w++) {
        EXPECT_NEAR(e.mean[w], expected[w], 1e-5);
        EXPECT_NEAR(e.albedo[w][0], expected[w], 1e-6);
    }
}

// Stated albedos against sampled ones where lobes do lose energy: rough metal between face and edge colour.
TEST(Material, AlbedoOfRoughConductors) {
    for (float cosine : Cosines)
        for (float roughness : {0.2f, 0.5f, 1.0f})
            for (const Vec3f& face : {Vec3f(0.0f), Vec3f(0.9f, 0.6f, 0.3f)}) {
                Tree t;
                t.lobe(LobeId::MicrofacetConductorBrdf, {face, White, Vec3f(roughness)});
                const Energy e = scattered(t, cosine, true, 20000);
                for (int w = 0; w < Wavelengths; w++)
                    EXPECT_NEAR(e.mean[w], e.albedo[w][0], 0.005 + 4.5 * e.error)
                        << cosine << " " << roughness;
            }
}

// A black face seen head-on still shines at its edges when rough: it must be sampled, or light is lost.
TEST(Material, BlackFacesAreSampled) {
    Tree t;
    t.lobe(LobeId::MicrofacetConductorBrdf, {Vec3f(0.0f), White, Vec3f(1.0f)});
    EXPECT_GT(scattered(t, 1).mean[0], 1e-5);
}

TEST(Material, BlackIsBlack) {
    Tree t;
    t.lobe(LobeId::LambertBrdf, {Vec3f(0.0f)});
    const Energy e = scattered(t, 0.5f, true, 10);
    EXPECT_EQ(e.mean[0], 0);
    EXPECT_EQ(e.albedo[0][0], 0);
    const MaterialCode code(t.program);
    F8 l[Wavelengths];
    wavelengths<8>(l);
    EXPECT_TRUE(all(Material<8>(code, TreeFetch<8>(t), Mask<8>(true), seen_from<8>(0.5f), l).black()));
}

// The mixture's density is what its samples have: f / pdf over samples is the integral of f, for lobes that
// differ.
TEST(Material, MixturesIntegrate) {
    for (float cosine : {0.9f, 0.2f}) {
        Tree t;
        const int a = t.lobe(LobeId::MicrofacetConductorBrdf, {Half, White, Vec3f(0.4f)});
        const int b = t.lobe(LobeId::LambertBrdf, {Vec3f(0.2f, 0.5f, 0.9f)}), c = glass(t, 0.5f);
        const int mixed = t.join(LayerOp::Mix, a, b, 0.4f);
        t.join(LayerOp::Mix, mixed, c, 0.6f);
        const MaterialCode code(t.program);
        F8 l[Wavelengths];
        wavelengths<8>(l);
        const Material<8> material(code, TreeFetch<8>(t), Mask<8>(true), seen_from<8>(cosine), l);
        const Energy e = scattered(t, cosine, true, 20000);
        for (int w = 0; w < Wavelengths; w++) {
            double sum = 0;
            for (double cell :
                 integrate_cells([&](const V8& wi) { return material.eval(seen_from<8>(cosine), wi).f[w]; }))
                sum += cell;
            EXPECT_NEAR(e.mean[w], sum, 4.5 * e.error + 1e-3) << cosine << ", wavelength " << w;
        }
    }
}

// Seen from inside, the index turns over: total reflection beyond the critical angle of 41.8 degrees.
TEST(Material, InsideOfGlass) {
    Tree t;
    glass(t, 0);
    const MaterialCode code(t.program);
    F8 l[Wavelengths];
    wavelengths<8>(l);
    const float cosine = 0.7f; // 45.6 degrees
    const Material<8> inside(code, TreeFetch<8>(t), Mask<8>(false), seen_from<8>(cosine), l);
    const Material<8> outside(code, TreeFetch<8>(t), Mask<8>(true), seen_from<8>(cosine), l);
    Uniform u(4);
    int through = 0;
    for (int i = 0; i < 100; i++) {
        const auto a = inside.sample(seen_from<8>(cosine), u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
        const auto b = outside.sample(seen_from<8>(cosine), u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
        for (int k = 0; k < 8; k++) {
            EXPECT_GT(a.wi.z[k], 0.0f);
            through += b.wi.z[k] < 0;
        }
    }
    EXPECT_GT(through, 700);
}

TEST(Material, TooManyLobesAreRefused) {
    Tree t;
    int root = white_lambert(t);
    for (int i = 0; i < MaxLobes; i++)
        root = t.join(LayerOp::Add, root, white_lambert(t));
    EXPECT_THROW(MaterialCode{t.program}, std::length_error);
}

TEST(Material, CodeKnowsWhatItDoes) {
    Tree plain, clear, prism;
    white_lambert(plain);
    glass(clear, 0.1f);
    prism.lobe(LobeId::MicrosurfaceDielectricBsdfRgb_v1,
               {Vec3f(0.0f), White, White, Vec3f(1.5f), Vec3f(30.0f)});
    EXPECT_FALSE(MaterialCode(plain.program).transmits);
    EXPECT_TRUE(MaterialCode(clear.program).transmits);
    EXPECT_FALSE(MaterialCode(clear.program).dispersive);
    EXPECT_TRUE(MaterialCode(prism.program).dispersive);
}

TEST(Material, LaneCountsAgree) {
    Tree t;
    const int a = varnish(t, 0.3f), b = t.lobe(LobeId::LambertBrdf, {Vec3f(0.2f, 0.5f, 0.9f)}),
              c = glass(t, 0.5f), d = white_mirror(t);
    const int base = t.join(LayerOp::Mix, b, c, 0.4f), under = t.join(LayerOp::Over, d, base, 0.3f);
    t.join(LayerOp::Coat, a, under, 0.9f);
    const MaterialCode code(t.program);
    const auto run = [&](auto width) {
        constexpr int W = decltype(width)::value;
        Float<W> l[Wavelengths];
        wavelengths<W>(l);
        const Material<W> material(code, TreeFetch<W>(t), Mask<W>(true), seen_from<W>(0.6f), l);
        Uniform u(8);
        std::vector<float> out;
        for (int i = 0; i < 4096 / W; i++) {
            float x[3][W];
            for (int k = 0; k < W; k++)
                for (auto& r : x)
                    r[k] = u.one();
            const auto s = material.sample(seen_from<W>(0.6f), Float<W>::load(x[0]), Float<W>::load(x[1]),
                                           Float<W>::load(x[2]));
            for (int k = 0; k < W; k++)
                for (float f : {s.wi.x[k], s.wi.y[k], s.wi.z[k], s.value.f[0][k], s.value.pdf[0][k],
                                s.value.f[3][k], float(s.valid[k]), float(s.delta[k])})
                    out.push_back(f);
        }
        return out;
    };
    const auto one = run(std::integral_constant<int, 1>());
    EXPECT_EQ(one, run(std::integral_constant<int, 8>()));
    EXPECT_EQ(one, run(std::integral_constant<int, 16>()));
}

} // namespace kanuka::bsdf
