// Sampling at the ends of its random numbers: directions of length one, values that are numbers, no sample
// without a lobe.
#include <gtest/gtest.h>

#include "bsdf/test_trees.h"

namespace kanuka::bsdf {

using namespace testing;

// The largest below one, too.
TEST(SamplingEnds, DirectionsOfLengthOne) {
    const float ends[] = {0, 0x1p-24f, 0.25f, 0.5f, 1 - 0x1p-24f};
    std::vector<LobeCase> cases = rough_cases({0.999f, 0.6f, 0.02f});
    for (const LobeCase& c : rough_cases({0.6f}))
        if (grid::find_input(c.decl(), "roughness") >= 0)
            cases.push_back(c.with("roughness", 0));
    for (const LobeCase& c : cases) {
        Uniform u(3);
        const auto in = c.inputs<8>();
        const V8 wo = c.wo<8>();
        const auto check = [&](F8 choice, F8 u0, F8 u1) {
            const auto s = sample_lobe(c.id, in, wo, choice, u0, u1);
            const auto v = eval_lobe(c.id, in, wo, s.wi);
            for (int k = 0; k < 8; k++) {
                if (!s.valid[k])
                    continue;
                ASSERT_NEAR(dot(s.wi, s.wi)[k], 1, 1e-5f)
                    << c.str() << " " << choice[k] << " " << u0[k] << " " << u1[k];
                for (int i = 0; i < Wavelengths; i++) {
                    ASSERT_TRUE(v.f[i][k] >= 0 && v.f[i][k] < 1e30f) << c.str();
                    ASSERT_TRUE(v.pdf[i][k] >= 0 && v.pdf[i][k] < 1e30f) << c.str();
                }
            }
        };
        for (int i = 0; i < 16; i++)
            check(u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
        for (float a : ends)
            for (float b : ends)
                for (float d : ends)
                    check(F8(a), F8(b), F8(d));
    }
}

// Shares of lobes add up to one but for rounding: what is left over goes to the last.
TEST(SamplingEnds, EverySampleHasALobe) {
    Uniform u(9);
    int rounded = 0;
    for (int i = 0; i < 200; i++) {
        Tree t;
        int root = -1;
        const int leaves = 2 + int(u.one() * 12);
        for (int k = 0; k < leaves; k++) {
            const int leaf = t.lobe(LobeId::LambertBrdf, {Vec3f(0.05f + u.one(), u.one(), u.one())});
            root = root < 0 ? leaf : t.join(LayerOp::Mix, root, leaf, 0.2f + 0.6f * u.one());
        }
        const MaterialCode code(t.program);
        F8 l[Wavelengths];
        wavelengths<8>(l);
        const V8 wo = seen_from<8>(0.7f);
        const Material<8> material(code, TreeFetch<8>(t), Mask<8>(true), wo, l);
        float density = 0; // of all lobes, at most one by rounding
        for (const float x : {0.0f, 1 - 0x1p-24f}) {
            const auto s = material.sample(wo, F8(x), F8(0.3f), F8(0.5f));
            ASSERT_TRUE(s.valid[0]) << x;
            EXPECT_EQ(s.leaf[0], x == 0 ? 0 : leaves - 1);
            EXPECT_NEAR(s.value.pdf[0][0], s.wi.z[0] * InvPi, 1e-6f);
            density = s.value.pdf[0][0] / (s.wi.z[0] * InvPi);
        }
        rounded += density < 1;
    }
    EXPECT_GT(rounded, 20); // some add up to less than one
}

} // namespace kanuka::bsdf
