// Layering programs against their definition (grid/layering.h), in double and by recursion: random trees of
// lobes whose values are closed forms.
#include <map>

#include <gtest/gtest.h>

#include "bsdf/oracles/optics.h"
#include "bsdf/test_trees.h"

namespace kanuka::bsdf {
namespace {

using namespace testing;
using Waves = std::array<double, Wavelengths>;

Waves waves(double x) {
    return {x, x, x, x};
}
Waves waves_of(const Vec3f& v) {
    return {double(v.x), double(v.y), double(v.z), (double(v.x) + double(v.y) + double(v.z)) / 3};
}
double mean_of(const Waves& w) {
    return (w[0] + w[1] + w[2] + w[3]) / 4;
}
template <class F>
Waves each(F f) {
    Waves w;
    for (size_t k = 0; k < Wavelengths; k++)
        w[k] = f(k);
    return w;
}

// A lobe of the tree, as it is defined.
struct Leaf {
    LobeId id;
    Waves first{}, second{}; // its colours
    double ior = 1;
    Waves weight{};   // by the operators above it
    Waves depth{};    // log of what a straight way through the coats above it leaves
    double index = 1; // of those, the largest
    bool scatters() const { return id != LobeId::DiffuseEmission; }

    Waves albedo(double cosine) const {
        const double F = ior > 1 ? oracle::glass_reflectance(cosine, ior) : 0, sheet = 2 * F / (1 + F);
        return each([&](size_t k) {
            switch (id) {
            case LobeId::DiffuseEmission:
                return 0.0;
            case LobeId::MicrofacetDielectricBrdf:
                return first[k] * F;
            case LobeId::ThinWalledDielectricBsdf:
                return first[k] * sheet + second[k] * (1 - sheet);
            default:
                return first[k];
            }
        });
    }
    // Beer and Lambert, along the direction that Snell's law has in the coat.
    double way(double cosine, size_t k) const {
        return std::exp(depth[k] / std::sqrt(1 - (1 - cosine * cosine) / (index * index)));
    }
};

// A random tree and what it should be.
class RandomTree {
  public:
    Tree tree;
    std::vector<Leaf> leaves; // in the order that they stand, emission among them
    RandomTree(uint32_t seed, bool coats) : m_random(seed), m_coats(coats) {
        grow(1 + int(m_random.one() * 4));
        const int root = int(tree.program.nodes.size()) - 1;
        descend(root, waves(1), waves(0), 1);
    }
    double cosine = 0; // of the view; set before weights() is asked
    void seen(double c) {
        cosine = c;
        descend(int(tree.program.nodes.size()) - 1, waves(1), waves(0), 1);
    }

  private:
    float some() { return m_random.one() < 0.15f ? 0.0f : m_random.one() < 0.15f ? 1.0f : m_random.one(); }
    Vec3f color() { return {some(), m_random.one(), m_random.one()}; }

    int lobe() {
        const float w = some(), kind = m_random.one();
        Leaf leaf{};
        const Vec3f a = color(), b = color();
        leaf.first = waves_of(a), leaf.second = waves_of(b);
        int node;
        if (kind < 0.4f || (m_coats && kind < 0.6f)) {
            leaf.id = LobeId::LambertBrdf;
            node = tree.lobe(leaf.id, {a}, w);
        } else if (kind < 0.6f) {
            leaf.id = LobeId::LambertBtdf;
            node = tree.lobe(leaf.id, {a}, w);
        } else if (kind < 0.7f) {
            leaf.id = LobeId::DiffuseEmission;
            node = tree.lobe(leaf.id, {a}, w);
        } else {
            leaf.id = LobeId::ThinWalledDielectricBsdf;
            leaf.ior = double(1.2f + m_random.one());
            node = tree.lobe(leaf.id, {a, b, Vec3f(float(leaf.ior)), Vec3f(0.0f)}, w);
        }
        m_leaf_of[size_t(node)] = int(leaves.size());
        leaves.push_back(leaf);
        return node;
    }
    int coat() { // smooth, and absorbs
        Leaf leaf{LobeId::MicrofacetDielectricBrdf};
        leaf.ior = double(1.1f + 0.8f * m_random.one());
        const Vec3f a = color(), through(0.2f + 0.8f * m_random.one(), m_random.one(), 0.5f);
        leaf.first = waves_of(a), leaf.second = waves_of(through);
        const int node = tree.lobe(leaf.id,
                                   {a, Vec3f(float(leaf.ior)), Vec3f(0.0f), Vec3f(0.0f), Vec3f(0.0f),
                                    Vec3f(0.5f), Vec3f(0.0f), Vec3f(1.33f), through},
                                   some());
        m_leaf_of[size_t(node)] = int(leaves.size());
        leaves.push_back(leaf);
        return node;
    }
    int grow(int depth) {
        if (depth == 0)
            return lobe();
        const LayerOp ops[] = {LayerOp::Mix, LayerOp::Over, LayerOp::Coat, LayerOp::Add};
        const LayerOp op = m_coats && m_random.one() < 0.5f ? LayerOp::Coat : ops[int(m_random.one() * 4)];
        const bool absorbs = m_coats && op == LayerOp::Coat && m_random.one() < 0.8f;
        const int upper = absorbs ? coat() : grow(m_random.one() < 0.6f ? 0 : depth - 1);
        const int lower = grow(depth - 1);
        return tree.join(op, upper, lower, some());
    }

    const grid::LayerNode& node(int i) const { return tree.program.nodes[size_t(i)]; }
    double weight(int i) const { return double(tree.values[size_t(node(i).weight)].x); }
    double coverage(int i) const {
        const grid::LayerNode& n = node(i);
        const double w = weight(i);
        if (n.op == LayerOp::Lobe)
            return w;
        const double u = coverage(n.upper), l = coverage(n.lower);
        return std::min(1.0, n.op == LayerOp::Mix   ? w * u + (1 - w) * l
                             : n.op == LayerOp::Add ? u + l
                                                    : w * u + (1 - w * u) * l);
    }
    Waves albedo(int i) const {
        const grid::LayerNode& n = node(i);
        const double w = weight(i);
        if (n.op == LayerOp::Lobe)
            return each([&, a = leaves[size_t(m_leaf_of.at(size_t(i)))].albedo(cosine)](size_t k) {
                return w * a[k];
            });
        const Waves u = albedo(n.upper), l = albedo(n.lower), below = under(i);
        return each([&](size_t k) { return u[k] * (n.op == LayerOp::Add ? 1 : w) + l[k] * below[k]; });
    }
    // What an operator leaves of its lower side.
    Waves under(int i) const {
        const grid::LayerNode& n = node(i);
        const double w = weight(i);
        const Waves u = albedo(n.upper);
        return each([&](size_t k) {
            return n.op == LayerOp::Mix    ? 1 - w
                   : n.op == LayerOp::Over ? 1 - w * coverage(n.upper)
                   : n.op == LayerOp::Add  ? 1
                                           : std::clamp(1 - w * u[k], 0.0, 1.0);
        });
    }
    void descend(int i, const Waves& above, const Waves& depth, double index) {
        const grid::LayerNode& n = node(i);
        const double w = weight(i);
        if (n.op == LayerOp::Lobe) {
            Leaf& leaf = leaves[size_t(m_leaf_of.at(size_t(i)))];
            leaf.depth = depth, leaf.index = index;
            leaf.weight = each([&](size_t k) { return above[k] * w * leaf.way(cosine, k); });
            return;
        }
        const Waves rest = under(i);
        descend(n.upper, each([&](size_t k) { return above[k] * (n.op == LayerOp::Add ? 1 : w); }), depth,
                index);
        const grid::LayerNode& upper = node(n.upper);
        Waves deeper = depth;
        if (n.op == LayerOp::Coat && upper.op == LayerOp::Lobe &&
            upper.lobe == LobeId::MicrofacetDielectricBrdf) {
            const Leaf& coat = leaves[size_t(m_leaf_of.at(size_t(n.upper)))];
            deeper = each(
                [&](size_t k) { return depth[k] + std::log(std::max(1 - w * (1 - coat.second[k]), 1e-6)); });
            index = std::max(index, coat.ior);
        }
        descend(n.lower, each([&](size_t k) { return above[k] * rest[k]; }), deeper, index);
    }

    Uniform m_random;
    bool m_coats;
    std::map<size_t, int> m_leaf_of;
};

void expect_tree(RandomTree& t, float cosine) {
    t.seen(double(cosine));
    const MaterialCode code(t.tree.program);
    F8 l[Wavelengths];
    wavelengths<8>(l);
    const V8 wo = seen_from<8>(cosine);
    const Material<8> material(code, TreeFetch<8>(t.tree), Mask<8>(true), wo, l);
    std::vector<const Leaf*> leaves;
    for (const Leaf& leaf : t.leaves)
        if (leaf.scatters())
            leaves.push_back(&leaf);
    // Albedo, and how lobes share samples: those of a coat's base by what crosses at about 45 degrees.
    std::vector<double> share;
    Waves all{};
    double total = 0;
    for (const Leaf* leaf : leaves) {
        const Waves own = leaf->albedo(t.cosine);
        const Waves a = each([&](size_t k) { return leaf->weight[k] * own[k] * leaf->way(double(0.7f), k); });
        for (size_t k = 0; k < Wavelengths; k++)
            all[k] += a[k];
        share.push_back(mean_of(a));
        total += share.back();
    }
    ASSERT_EQ(bool(material.black()[0]), !(total > 0));
    if (!(total > 0))
        return;
    for (size_t k = 0; k < Wavelengths; k++)
        EXPECT_NEAR(material.albedo()[int(k)][0], all[k], 2e-5 * (1 + all[k]));
    for (double& s : share)
        s /= total;
    // Values and densities.
    Uniform u(3);
    for (int i = 0; i < 4; i++) {
        const V8 wi = direction(F8(-1.0f) + u.lanes<8>() * F8(2.0f), u.lanes<8>());
        const auto v = material.eval(wo, wi);
        for (int lane = 0; lane < 8; lane++) {
            const double z = double(wi.z[lane]);
            Waves f{};
            double pdf = 0;
            for (size_t n = 0; n < leaves.size(); n++) {
                const Leaf& leaf = *leaves[n];
                const bool up = leaf.id == LobeId::LambertBrdf;
                if ((!up && leaf.id != LobeId::LambertBtdf) || (z > 0) != up)
                    continue;
                const double p = std::abs(z) / oracle::HalfTau;
                for (size_t k = 0; k < Wavelengths; k++)
                    f[k] += leaf.weight[k] * leaf.first[k] * p * (z > 0 ? leaf.way(z, k) : 1);
                pdf += share[n] * p;
            }
            for (int k = 0; k < Wavelengths; k++) {
                EXPECT_NEAR(v.f[k][lane], f[size_t(k)], 2e-5 * (1 + f[size_t(k)]));
                EXPECT_NEAR(v.pdf[k][lane], pdf, 2e-5 * (1 + pdf));
            }
        }
    }
    // Samples: each lobe as often as its share; mirrors and panes by Fresnel's shares of it.
    constexpr int Count = 4096;
    std::vector<double> chosen(leaves.size()), straight(leaves.size());
    for (int i = 0; i < Count; i += 8) {
        F8 x;
        for (int lane = 0; lane < 8; lane++)
            x.v[lane] = (float(i + lane) + 0.5f) / Count;
        const auto s = material.sample(wo, x, u.lanes<8>(), u.lanes<8>());
        const auto goes = material.goes_straight(s);
        const auto v = material.eval(wo, s.wi);
        for (int lane = 0; lane < 8; lane++) {
            const size_t n = size_t(s.leaf[lane]);
            ASSERT_LT(n, leaves.size());
            const Leaf& leaf = *leaves[n];
            chosen[n] += 1.0 / Count;
            ASSERT_TRUE(s.valid[lane]);
            const bool delta =
                leaf.id == LobeId::ThinWalledDielectricBsdf || leaf.id == LobeId::MicrofacetDielectricBrdf;
            ASSERT_EQ(bool(s.delta[lane]), delta);
            const bool through = s.wi.z[lane] < 0;
            EXPECT_EQ(bool(goes[lane]), through && leaf.id == LobeId::ThinWalledDielectricBsdf);
            straight[n] += goes[lane] ? 1.0 / Count : 0;
            const double F = leaf.ior > 1 ? oracle::glass_reflectance(t.cosine, leaf.ior) : 0,
                         sheet = 2 * F / (1 + F);
            for (int k = 0; k < Wavelengths; k++) {
                const size_t c = size_t(k);
                double f = double(v.f[k][lane]), pdf = double(v.pdf[k][lane]);
                if (delta) {
                    const double way = through ? 1 : leaf.way(double(s.wi.z[lane]), c);
                    const double one = leaf.id == LobeId::MicrofacetDielectricBrdf ? leaf.first[c] * F
                                       : through ? leaf.second[c] * (1 - sheet)
                                                 : leaf.first[c] * sheet;
                    f = leaf.weight[c] * one * way;
                    pdf = share[n] * (leaf.id == LobeId::MicrofacetDielectricBrdf ? 1
                                      : through                                   ? 1 - sheet
                                                                                  : sheet);
                }
                EXPECT_NEAR(s.value.f[k][lane], f, 2e-5 * (1 + f));
                EXPECT_NEAR(s.value.pdf[k][lane], pdf, 2e-5 * (1 + pdf));
            }
        }
    }
    Waves f{};
    double pdf = 0;
    for (size_t n = 0; n < leaves.size(); n++) {
        EXPECT_NEAR(chosen[n], share[n], 2.0 / Count + 1e-5);
        const Leaf& leaf = *leaves[n];
        if (leaf.id != LobeId::ThinWalledDielectricBsdf)
            continue;
        const double F = oracle::glass_reflectance(t.cosine, leaf.ior), passes = 1 - 2 * F / (1 + F);
        EXPECT_NEAR(straight[n], share[n] * passes, 3.0 / Count + 1e-5);
        for (size_t k = 0; k < Wavelengths; k++)
            f[k] += leaf.weight[k] * leaf.second[k] * passes;
        pdf += share[n] * passes;
    }
    const auto s = material.straight(wo);
    for (int k = 0; k < Wavelengths; k++) {
        EXPECT_NEAR(s.f[k][0], f[size_t(k)], 2e-5);
        EXPECT_NEAR(s.pdf[k][0], pdf, 2e-5);
    }
}

} // namespace

TEST(MaterialOracles, RandomTrees) {
    for (uint32_t seed = 1; seed <= 150; seed++) {
        RandomTree t(seed, seed % 2);
        SCOPED_TRACE("tree " + std::to_string(seed));
        for (float cosine : {0.95f, 0.5f, 0.15f})
            expect_tree(t, cosine);
        if (HasFailure())
            return;
    }
}

} // namespace kanuka::bsdf
