#include "bsdf/one_lobe.h"

#include "bsdf/lobes.h"

namespace kanuka::bsdf {

namespace {

constexpr int W = 8;
using F = Float<W>;
using V = Vec3<F>;

// Eight directions from `first` on; what is beyond the last is the last once more.
V load(std::span<const Vec3f> all, size_t first) {
    alignas(32) float axis[3][W];
    for (size_t i = 0; i < W; i++)
        for (int a = 0; a < 3; a++)
            axis[a][i] = all[std::min(first + i, all.size() - 1)][a];
    return {F::load(axis[0]), F::load(axis[1]), F::load(axis[2])};
}
void store(const V& v, std::span<Vec3f> to, size_t first) {
    alignas(32) float axis[3][W];
    v.x.store(axis[0]), v.y.store(axis[1]), v.z.store(axis[2]);
    for (size_t i = 0; i < W && first + i < to.size(); i++)
        to[first + i] = {axis[0][i], axis[1][i], axis[2][i]};
}
void store(const Spectrum<W>& s, std::span<Vec3f> to, size_t first) {
    store(V(s[0], s[1], s[2]), to, first);
}
void store(F v, std::span<float> to, size_t first) {
    alignas(32) float values[W];
    v.store(values);
    for (size_t i = 0; i < W && first + i < to.size(); i++)
        to[first + i] = values[i];
}
void store(Mask<W> m, std::span<uint8_t> to, size_t first) {
    for (size_t i = 0; i < W && first + i < to.size(); i++)
        to[first + i] = m.bits() >> i & 1;
}
F mean_of_three(const Spectrum<W>& s) {
    return (s[0] + s[1] + s[2]) * F(1.0f / 3);
}

// Seen from the inside the frame is turned over: lobes have wo.z > 0.
struct View {
    Mask<W> outside;
    V wo;
    explicit View(const V& given) : outside(given.z > F(0.0f)), wo(given) { wo.z = max(abs(wo.z), F(1e-6f)); }
    V turned(V w) const {
        w.z = kanuka::select(outside, w.z, -w.z);
        return w;
    }
};

// Sampling goes by the wavelength that stands first, the hero: `hero` turns the three, lane by lane.
struct Prepared {
    F l[Wavelengths];
    LobeInputs<W> in;
    Int<W> hero;

    Prepared(const grid::LobeDecl& decl, std::span<const std::optional<Vec3f>> given, const View& view,
             Int<W> hero = Int<W>(0))
        : hero(hero) {
        for (int i = 0; i < 3; i++)
            l[i] = one_of(i, [](int k) { return F((OneLobe::WavelengthsNm[k] - 360) / 470); });
        l[3] = F((OneLobe::WavelengthsNm[1] - 360) / 470);
        int color = 0, number = 0;
        for (size_t i = 0; i < decl.inputs.size(); i++) {
            const grid::LobeInput& input = decl.inputs[i];
            if (input.type == grid::InputType::Normal)
                continue;
            in.given |= uint32_t(given[i].has_value()) << i;
            Vec3f v = given[i].value_or(input.fallback);
            for (int a = 0; a < 3; a++)
                v[a] = std::clamp(v[a], input.low, input.high);
            if (input.type == grid::InputType::Color) {
                Spectrum<W>& s = in.color[color++];
                for (int k = 0; k < 3; k++)
                    s[k] = one_of(k, [&v](int c) { return F(v[c]); });
                s[3] = F((v.x + v.y + v.z) / 3);
            } else {
                in.number[number++] = F(v.x);
            }
        }
        prepare_lobe(decl.id, in, view.wo, view.outside, l);
    }
    // Back in the order of the colours.
    Spectrum<W> turned_back(const Spectrum<W>& s) const {
        Spectrum<W> r = s;
        for (int i = 0; i < 3; i++)
            r[i] = kanuka::select(hero == Int<W>(0), s[i],
                                  kanuka::select(hero == Int<W>(1), s[(i + 2) % 3], s[(i + 1) % 3]));
        return r;
    }

  private:
    template <class Of>
    F one_of(int place, const Of& of) const {
        return kanuka::select(hero == Int<W>(0), of(place),
                              kanuka::select(hero == Int<W>(1), of((place + 1) % 3), of((place + 2) % 3)));
    }
};

} // namespace

bool OneLobe::is_of_surfaces(const grid::LobeDecl& decl) {
    return decl.kind != grid::LobeKind::Emission && decl.kind != grid::LobeKind::Phase &&
           decl.id != LobeId::AimedBsdf;
}

void OneLobe::evaluate(std::span<const Vec3f> wo, std::span<const Vec3f> wi, const Values& to) const {
    for (size_t i = 0; i < wo.size(); i += W) {
        const View view(load(wo, i));
        const Prepared p(grid::lobe(m_id), m_inputs, view);
        const LobeValue<W> v = eval_lobe(m_id, p.in, view.wo, view.turned(load(wi, i)));
        store(v.f, to.value, i), store(mean_of_three(v.pdf), to.pdf, i);
    }
}

void OneLobe::sample(std::span<const Vec3f> wo, std::span<const Vec3f> u, const Samples& to) const {
    for (size_t i = 0; i < wo.size(); i += W) {
        const View view(load(wo, i));
        V random = load(u, i);
        const Int<W> hero = min(to_int(random.x * F(3.0f)), Int<W>(2));
        random.x = clamp(random.x * F(3.0f) - F(hero), F(0.0f), F(0.99999994f));
        const Prepared p(grid::lobe(m_id), m_inputs, view, hero);
        const LobeSample<W> s = sample_lobe(m_id, p.in, view.wo, random.x, random.y, random.z);
        const LobeValue<W> v = eval_lobe(m_id, p.in, view.wo, s.wi);
        store(p.turned_back(select(s.delta, s.value.f, v.f)), to.values.value, i);
        store(mean_of_three(select(s.delta, s.value.pdf, v.pdf)), to.values.pdf, i);
        store(view.turned(s.wi), to.wi, i), store(s.valid, to.valid, i), store(s.delta, to.delta, i);
    }
}

void OneLobe::albedo(std::span<const Vec3f> wo, std::span<Vec3f> to) const {
    for (size_t i = 0; i < wo.size(); i += W) {
        const View view(load(wo, i));
        const Prepared p(grid::lobe(m_id), m_inputs, view);
        store(albedo_of_lobe(m_id, p.in, view.wo), to, i);
    }
}

} // namespace kanuka::bsdf
