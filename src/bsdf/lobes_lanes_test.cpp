// What holds for each lane by itself: its lobe's bits whatever its neighbours have, directions of unit
// length, names by the nearest number.
#include <gtest/gtest.h>

#include "bsdf/oracles/optics.h"
#include "bsdf/test_trees.h"

namespace kanuka::bsdf {
namespace {

using namespace testing;

// A hit of one lane.
struct Hit {
    float color[grid::MostColors][Wavelengths] = {}, number[grid::MostNumbers] = {}, l[Wavelengths], outer,
          wo[3], u[3], wi[3];
    bool outside;
};

Hit random_hit(const grid::LobeDecl& decl, uint32_t given, Uniform& u) {
    Hit h{};
    const auto end = [&](float low, float high) { // often one of the ends
        const float x = u.one();
        return x < 0.25f ? low : x < 0.4f ? high : low + u.one() * (high - low);
    };
    int color = 0, number = 0;
    for (size_t i = 0; i < decl.inputs.size(); i++) {
        const grid::LobeInput& input = decl.inputs[i];
        const bool is = given >> i & 1, amount = input.storage == grid::Storage::Amount;
        if (input.type == grid::InputType::Color) {
            const bool rough = input.name == "roughness";
            const float one = end(input.low, amount ? 5.0f : input.high);
            const float fallback[3] = {input.fallback.x, input.fallback.y, input.fallback.z};
            for (int k = 0; k < Wavelengths; k++)
                h.color[color][k] = !is     ? fallback[k % 3]
                                    : rough ? one
                                            : end(input.low, amount ? 5.0f : input.high);
            color++;
        } else if (decl.id != LobeId::AimedBsdf && input.type != grid::InputType::Normal) {
            float v = is ? end(input.low, std::min(input.high, 1e4f)) : input.fallback.x;
            if (is && !input.names.empty())
                v = std::floor(u.one() * float(input.names.size()));
            h.number[number++] = v;
        }
    }
    for (float& x : h.l)
        x = u.one();
    h.outer = u.one() < 0.5f ? 1.0f : 1.33f;
    h.outside = u.one() < 0.6f;
    for (float* w : {h.wo, h.wi}) {
        const float z = u.one(), turn = 6.2831853f * u.one(), s = std::sqrt(1 - z * z);
        w[0] = s * std::cos(turn), w[1] = s * std::sin(turn), w[2] = std::max(z, 1e-3f);
    }
    if (u.one() < 0.4f)
        h.wi[2] = -h.wi[2];
    for (float& x : h.u)
        x = u.one();
    return h;
}

// All that a lobe says of W hits, lane by lane.
template <int W>
void answers(LobeId id, uint32_t given, const Hit* hits, std::vector<float>* out) {
    const auto lanes = [&](auto get) {
        Float<W> f;
        for (int k = 0; k < W; k++)
            f.v[k] = get(hits[k]);
        return f;
    };
    const auto vector = [&](auto which) {
        return Vec3<Float<W>>(lanes([&](const Hit& h) { return which(h)[0]; }),
                              lanes([&](const Hit& h) { return which(h)[1]; }),
                              lanes([&](const Hit& h) { return which(h)[2]; }));
    };
    LobeInputs<W> in;
    in.given = given;
    for (int c = 0; c < grid::MostColors; c++)
        for (int i = 0; i < Wavelengths; i++)
            in.color[c][i] = lanes([&](const Hit& h) { return h.color[c][i]; });
    for (int n = 0; n < grid::MostNumbers; n++)
        in.number[n] = lanes([&](const Hit& h) { return h.number[n]; });
    Float<W> l[Wavelengths];
    for (int i = 0; i < Wavelengths; i++)
        l[i] = lanes([&](const Hit& h) { return h.l[i]; });
    const Float<W> outer = lanes([](const Hit& h) { return h.outer; });
    const Mask<W> outside = lanes([](const Hit& h) { return h.outside ? 1.0f : 0.0f; }) > Float<W>(0.5f);
    const auto wo = vector([](const Hit& h) { return h.wo; }), wi = vector([](const Hit& h) { return h.wi; });
    prepare_lobe(id, in, wo, outside, l, &outer);
    const auto s =
        sample_lobe(id, in, wo, lanes([](const Hit& h) { return h.u[0]; }),
                    lanes([](const Hit& h) { return h.u[1]; }), lanes([](const Hit& h) { return h.u[2]; }));
    const auto a = eval_lobe(id, in, wo, wi), b = eval_lobe(id, in, wo, s.wi);
    const auto albedo = albedo_of_lobe(id, in, wo);
    for (int k = 0; k < W; k++) {
        std::vector<float>& to = out[k];
        to = {float(s.valid[k])};
        for (int i = 0; i < Wavelengths; i++)
            to.insert(to.end(), {albedo[i][k], a.f[i][k], a.pdf[i][k]});
        if (!s.valid[k])
            continue;
        to.insert(to.end(), {float(s.delta[k]), s.wi.x[k], s.wi.y[k], s.wi.z[k]});
        for (int i = 0; i < Wavelengths; i++)
            to.insert(to.end(), {s.delta[k] ? s.value.f[i][k] : b.f[i][k],
                                 s.delta[k] ? s.value.pdf[i][k] : b.pdf[i][k]});
    }
}

template <int W>
bool is_alone(const grid::LobeDecl& decl, uint32_t given, Uniform& u) {
    Hit hits[W];
    for (Hit& h : hits)
        h = random_hit(decl, given, u);
    std::vector<float> together[W], alone[1];
    answers<W>(decl.id, given, hits, together);
    for (int k = 0; k < W; k++) {
        answers<1>(decl.id, given, hits + k, alone);
        if (alone[0] == together[k])
            continue;
        size_t i = 0;
        while (i + 1 < std::min(alone[0].size(), together[k].size()) && alone[0][i] == together[k][i])
            i++;
        ADD_FAILURE() << decl.name << " given " << given << " value " << i << " is " << together[k][i]
                      << ", alone " << alone[0][i];
        return false;
    }
    return true;
}

} // namespace

// Lanes hold hits of different inputs, sides and wavelengths: rough beside smooth, with and without films,
// walks and dispersion. Each is what it would be alone, to the bit.
TEST(LobeLanes, NeighboursDoNotMatter) {
    for (const grid::LobeDecl& decl : grid::lobe_table()) {
        if (!scatters(decl))
            continue;
        Uniform u(uint32_t(decl.id) + 77);
        for (int round = 0; round < 120; round++) {
            uint32_t given = 0; // all, none, or some
            for (size_t i = 0; i < decl.inputs.size(); i++)
                given |= uint32_t(round % 3 == 0 || u.one() < 0.6f) << i;
            if (!is_alone<8>(decl, given, u) || !is_alone<16>(decl, given, u))
                break;
        }
    }
}

namespace {

// Each lane reads the values of a tree of its own; all trees are of one program.
template <int W>
struct LaneFetch {
    std::vector<TreeFetch<1>> lanes;
    LaneFetch(const Tree* trees) {
        for (int k = 0; k < W; k++)
            lanes.emplace_back(trees[k]);
    }
    Float<W> at(const MaterialCode::Place& p, int component) const {
        Float<W> f;
        for (int k = 0; k < W; k++) {
            const Vec3f v = lanes[size_t(k)].value(p);
            f.v[k] = component < 3 ? v[component] : (v.x + v.y + v.z) / 3;
        }
        return f;
    }
    Spectrum<W> color(const MaterialCode::Place& p) const {
        Spectrum<W> s;
        for (int i = 0; i < Wavelengths; i++)
            s[i] = at(p, i);
        return s;
    }
    Float<W> number(const MaterialCode::Place& p) const { return at(p, 0); }
};

Tree random_material(int kind, Uniform& u) {
    const auto some = [&] { return u.one() < 0.25f ? 0.0f : u.one() < 0.3f ? 1.0f : u.one(); };
    const auto color = [&] { return Vec3f(some(), u.one(), u.one()); };
    Tree t;
    const auto coat = [&] {
        return t.lobe(LobeId::MicrofacetDielectricBrdf,
                      {color(), Vec3f(1.1f + u.one()), Vec3f(some()), Vec3f(0.0f), Vec3f(0.0f), Vec3f(0.5f),
                       Vec3f(0.0f), Vec3f(1.33f), color()},
                      some());
    };
    const LayerOp over = kind % 2 ? LayerOp::Thick : LayerOp::Coat;
    const int first = coat(), second = kind < 4 ? coat() : -1;
    const int metal = t.lobe(LobeId::MicrofacetConductorBrdf, {color(), White, Vec3f(some())}, some());
    const int other = kind % 3 == 0   ? t.lobe(LobeId::PhongBrdf, {color(), Vec3f(50 * u.one())}, some())
                      : kind % 3 == 1 ? t.lobe(LobeId::OrenNayarBrdf, {color(), Vec3f(some())}, some())
                                      : t.lobe(LobeId::ThinWalledDielectricBsdf,
                                               {color(), color(), Vec3f(1.5f), Vec3f(some())}, some());
    int base = t.join(kind & 2 ? LayerOp::Over : LayerOp::Mix, metal, other, some());
    if (second >= 0)
        base = t.join(over, second, base, some());
    t.join(over, first, base, some());
    return t;
}

template <int W>
std::vector<std::vector<float>> material_answers(const Tree* trees, const MaterialCode& code,
                                                 const float (*u)[5]) {
    const auto lanes = [&](int which) {
        Float<W> f;
        for (int k = 0; k < W; k++)
            f.v[k] = u[k][which];
        return f;
    };
    Float<W> l[Wavelengths];
    wavelengths<W>(l);
    const Float<W> z = max(lanes(3), Float<W>(0.01f)), sine = sqrt(Float<W>(1.0f) - z * z);
    const Vec3<Float<W>> wo(sine * Float<W>(0.8f), sine * Float<W>(-0.6f), z);
    const Material<W> m(code, LaneFetch<W>(trees), lanes(4) < Float<W>(0.7f), wo, l);
    const auto s = m.sample(wo, lanes(0), lanes(1), lanes(2));
    const auto straight = m.straight(wo);
    std::vector<std::vector<float>> all;
    for (int k = 0; k < W; k++) {
        std::vector<float>& out = all.emplace_back();
        out = {float(m.black()[k]), float(s.valid[k])};
        for (int i = 0; i < Wavelengths; i++)
            out.insert(out.end(), {m.albedo()[i][k], straight.f[i][k], straight.pdf[i][k]});
        if (!s.valid[k])
            continue;
        out.insert(out.end(), {float(s.delta[k]), float(s.leaf[k]), s.wi.x[k], s.wi.y[k], s.wi.z[k]});
        for (int i = 0; i < Wavelengths; i++)
            out.insert(out.end(), {s.value.f[i][k], s.value.pdf[i][k]});
    }
    return all;
}

} // namespace

// The same of materials: coats of any roughness and weight, thick or thin, over rough and smooth lobes.
TEST(LobeLanes, NeighboursDoNotMatterToMaterials) {
    for (int kind = 0; kind < 12; kind++) {
        Uniform u(uint32_t(kind) + 5);
        bool good = true;
        for (int round = 0; round < 30 && good; round++) {
            std::vector<Tree> trees;
            float numbers[8][5];
            for (auto& row : numbers) {
                trees.push_back(random_material(kind, u));
                for (float& x : row)
                    x = u.one();
            }
            const MaterialCode code(trees[0].program);
            const auto together = material_answers<8>(trees.data(), code, numbers);
            for (size_t k = 0; k < 8; k++) {
                const auto alone = material_answers<1>(&trees[k], code, numbers + k)[0];
                good &= together[k] == alone;
                EXPECT_EQ(together[k], alone) << "kind " << kind << " round " << round << " lane " << k;
            }
        }
    }
}

TEST(LobeLanes, DirectionsHaveUnitLength) {
    for (const LobeCase& c : rough_cases({0.999f, 0.6f, 0.1f})) {
        Uniform u(31);
        const auto in = c.inputs<8>();
        for (int i = 0; i < 16; i++) {
            const auto s = sample_lobe(c.id, in, c.wo<8>(), u.lanes<8>(), u.lanes<8>(), u.lanes<8>());
            for (int k = 0; k < 8; k++)
                EXPECT_NEAR(std::hypot(s.wi.x[k], s.wi.y[k], s.wi.z[k]), 1, s.valid[k] ? 2e-6 : 2) << c.str();
        }
    }
}

TEST(LobeLanes, MetalsGoByTheNearestNumber) {
    const size_t names = grid::lobe(LobeId::MetalBrdf).inputs[0].names.size();
    const auto metal = [](float number) {
        return LobeCase{LobeId::MetalBrdf}.with("metal", number).inputs<8>();
    };
    for (size_t m = 1; m < names; m++)
        for (float off : {-0.4f, 0.4f})
            for (int i = 0; i < Wavelengths; i++) {
                EXPECT_EQ(metal(float(m) + off).eta[i][0], metal(float(m)).eta[i][0]) << m << " " << off;
                EXPECT_EQ(metal(float(m) + off).k[i][0], metal(float(m)).k[i][0]) << m << " " << off;
            }
}

// Of what a lobe below a thick coat scatters, the part that goes up again: by Fresnel's equations.
TEST(LobeLanes, PartThatIsReflected) {
    for (float cosine : {1.0f, 0.6f, 0.2f})
        for (const grid::LobeDecl& decl : grid::lobe_table()) {
            if (!scatters(decl))
                continue;
            const LobeCase c = LobeCase{decl.id}.seen_at(cosine);
            const auto in = c.inputs<8>();
            const double F = oracle::glass_reflectance(double(cosine), 1.5);
            for (float albedo : {0.01f, 0.8f}) {
                const double part = decl.kind == grid::LobeKind::Transmission             ? 0.0
                                    : decl.id == LobeId::ThinWalledDielectricBsdf         ? 2 * F / (1 + F)
                                    : decl.kind == grid::LobeKind::ReflectionTransmission ? F
                                                                                          : 1.0;
                const auto r = reflected_albedo(decl.id, in, c.wo<8>(), Spectrum<8>(F8(albedo)));
                EXPECT_NEAR(r[0][0], std::min(part, double(albedo)), 1e-5) << c.str();
            }
        }
}

} // namespace kanuka::bsdf
