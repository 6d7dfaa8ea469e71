// Lobes and weights out of the terms of light that Ci holds.
#include "grid/lobe_table.h"
#include "sl/ir/light_terms.h"
#include "sl/ir/surface_colors.h"

namespace kanuka::sl::ir {

namespace {

using grid::input_of;

// The presence that a surface has at least where it glows: what lies behind it is dimmed as much.
constexpr float LeastGlow = 1 / 16.f;

class Lobes {
  public:
    Lobes(Program& program, Builder& builder, const LightTerms& terms)
        : m_program(program), m_stage(program.shade), m_b(builder), m_terms(terms) {}

    void run() {
        presence();
        diffuse();
        highlights();
        traced();
        emission();
        // Black is a material too: one of no lobes would be nothing to trace.
        if (m_program.fixed_lobes.empty()) {
            m_program.fixed_lobes.emplace_back("diffuse", grid::LobeId::LambertBrdf);
            output("diffuse", Diffuse, grid::LobeId::LambertBrdf, m_b.triple(0));
        }
    }

  private:
    enum class Special { None, Presence, Ambient, Opacity }; // of no lobe
    // Glossy lobes: a material has 16 lobes and 32 nodes, add nodes among them.
    static constexpr int MaxGlossy = 12;

    Ref op(Op o, Ref a, Ref b) { return m_b.emit(o, m_b.at(a).ty, {a, b}, {}); }
    Ref f(float x) { return m_b.constant(x); }

    // ---- groups of terms, in the order of the material's lobes

    // The mean of Oi, and its components where they may differ.
    void presence() {
        if (always_one(m_stage, m_b, m_program.Oi))
            return;
        m_opacity = m_b.load(m_program.Oi, {});
        Ref sum = m_b.emit(Op::Extract, Ty::Float, {m_opacity}, {}, 0);
        for (int c = 1; c < 3; c++)
            sum = op(Op::Add, sum, m_b.emit(Op::Extract, Ty::Float, {m_opacity}, {}, c));
        m_presence = op(Op::Mul, sum, f(1 / 3.f));
        if (m_terms.plain && !follows_opacity(m_program) && ends_plain(m_program, m_b))
            m_presence = glowing(m_presence);
        output("", -1, grid::LobeId::LambertBrdf, m_presence, Special::Presence);
        color_opacity();
    }

    // The weights of all terms of the kinds that are wanted; None = there are none.
    template <typename Wanted>
    Ref total(const Wanted& wanted) {
        Ref sum = None;
        for (const auto& [site, var] : m_terms.weights)
            if (wanted(m_terms.sites[size_t(site)].kind)) {
                Ref w = m_b.load(var, {});
                const Site& s = m_terms.sites[size_t(site)];
                if (s.kind == Closure::LightSample || is_fresnel(s.kind))
                    w = op(Op::Mul, w, m_b.splat(m_b.load(s.reference, {}), {}));
                sum = sum == None ? w : op(Op::Add, sum, w);
            }
        return sum == None ? None : unpremultiply(sum);
    }

    // Lambert's lobes, and how much of ambient light is shown.
    void diffuse() {
        bool has_lobe = false;
        for (const auto& [site, var] : m_terms.weights)
            has_lobe = has_lobe || (m_terms.sites[size_t(site)].kind != Closure::Ambient &&
                                    m_terms.sites[size_t(site)].kind != Closure::Indirect);
        if (const Ref w =
                total([&](Closure k) { return is_lambert(k) || (k == Closure::Indirect && !has_lobe); });
            w != None) {
            m_program.fixed_lobes.emplace_back("diffuse", grid::LobeId::LambertBrdf);
            output("diffuse", Diffuse, grid::LobeId::LambertBrdf, w);
        }
        if (const Ref w = total([](Closure k) { return k == Closure::DiffuseBehind; }); w != None) {
            m_program.fixed_lobes.emplace_back("transmission", grid::LobeId::LambertBtdf);
            output("transmission", input_of(grid::LobeId::LambertBtdf, "diffuseTransmittance"),
                   grid::LobeId::LambertBtdf, w);
        }
        if (const Ref w = total([](Closure k) { return k == Closure::Ambient; }); w != None)
            output("ambient", -1, grid::LobeId::LambertBrdf, w, Special::Ambient);
    }

    void highlights() {
        int count = 0;
        Ref rest = None, rest_exponent = None; // more than a material has room for: one lobe together
        for (const auto& [site, var] : m_terms.weights) {
            const Site& s = m_terms.sites[size_t(site)];
            if (s.shape < 0)
                continue;
            const std::string name = "specular" + (count ? std::to_string(count + 1) : std::string());
            const bool half = about_half(s);
            const Ref exponent = m_b.load(s.shape, {});
            const Ref w = unpremultiply(m_b.load(var, {}));
            if (++count >= MaxGlossy) {
                rest = rest == None ? w : op(Op::Add, rest, w);
                rest_exponent = rest_exponent == None ? exponent : op(Op::Min, rest_exponent, exponent);
            } else if (s.anisotropy < 0 && s.kind != Closure::DielectricGlossy) {
                highlight(name, w, exponent, half);
            } else {
                microfacet(name, s, w, alpha2_of(exponent, half));
            }
        }
        if (rest != None)
            highlight("specular" + std::to_string(MaxGlossy), rest, rest_exponent, true);
    }

    // Ward's highlights, and those with Fresnel's factor.
    void microfacet(const std::string& name, const Site& s, Ref w, Ref alpha2) {
        w = op(Op::Mul, w, m_b.splat(height(alpha2), {}));
        const Ref alpha = m_b.emit(Op::Sqrt, Ty::Float, {alpha2}, {});
        Ref roughness = m_b.emit(Op::Sqrt, Ty::Float, {alpha}, {});
        if (s.anisotropy >= 0) // a lobe's is that across its grooves, this the mean
            roughness = op(
                Op::Div, roughness,
                m_b.emit(
                    Op::Sqrt, Ty::Float,
                    {m_b.emit(Op::Sqrt, Ty::Float,
                              {op(Op::Sub, f(1), op(Op::Mul, f(Stretch), m_b.load(s.anisotropy, {})))}, {})},
                    {}));
        if (s.kind == Closure::DielectricGlossy) {
            dielectric(name, w, index_of(s), roughness);
        } else {
            glossy(name, w, roughness);
            constexpr auto Lobe = grid::LobeId::MicrofacetConductorBrdf;
            output(name, input_of(Lobe, "anisotropy"), Lobe, m_b.load(s.anisotropy, {}));
            output(name, input_of(Lobe, "rotation"), Lobe, m_b.load(s.rotation, {}));
        }
    }

    // Mirrors, directions of their own, glass.
    void traced() {
        if (const Ref w = total([](Closure k) { return k == Closure::Mirror || k == Closure::Environment; });
            w != None)
            glossy("mirror", w, f(0));
        int aims = 0;
        for (const auto& [site, var] : m_terms.weights)
            if (const Site& s = m_terms.sites[size_t(site)]; s.aim >= 0)
                aimed("trace" + (aims++ ? std::to_string(aims) : std::string()),
                      unpremultiply(m_b.load(var, {})), m_b.load(s.aim, {}));
        const Ref reflected = total([](Closure k) { return k == Closure::DielectricMirror; });
        const Ref refracted =
            total([](Closure k) { return k == Closure::DielectricTransmit || k == Closure::Refraction; });
        if (refracted != None)
            glass(reflected == None ? m_b.triple(0) : reflected, refracted, any_index());
        else if (reflected != None)
            dielectric("gloss", reflected, any_index(), f(0));
    }

    void emission() {
        // fresnel() that no lobe takes: as the dicing camera sees it.
        Ref emission = total([](Closure k) { return is_fresnel(k); });
        if (m_terms.plain && (emission != None || ends_plain(m_program, m_b))) {
            const Ref plain = emitted(m_b.load(m_program.Ci, {}));
            emission = emission == None ? plain : op(Op::Add, emission, plain);
        }
        if (emission != None) {
            m_program.fixed_lobes.emplace_back("emission", grid::LobeId::DiffuseEmission);
            output("emission", grid::EmissionRadiance, grid::LobeId::DiffuseEmission, emission);
        }
    }

    // ---- opacity

    // Ci is premultiplied by opacity; a lobe's weight is not.
    Ref unpremultiply(Ref w) {
        if (m_opacity == None)
            return w;
        std::vector<Ref> parts;
        for (int c = 0; c < 3; c++) {
            const Ref x = m_b.emit(Op::Extract, Ty::Float, {w}, {}, c),
                      o = m_b.emit(Op::Extract, Ty::Float, {m_opacity}, {}, c);
            const Ref some = m_b.emit(Op::Gt, Ty::Bool, {o, f(0)}, {});
            const Ref safe = m_b.emit(Op::Select, Ty::Float, {some, o, f(1)}, {});
            parts.push_back(m_b.emit(Op::Select, Ty::Float, {some, op(Op::Div, x, safe), f(0)}, {}));
        }
        return m_b.emit(Op::Make, Ty::Triple, std::move(parts), {});
    }

    // Ci adds what Oi does not take away: a surface of Oi = 0 may glow. But only what is there is seen, so it
    // is there a little where it glows, and shines as much more.
    Ref glowing(Ref presence) {
        const Ref Ci = m_b.load(m_program.Ci, {});
        Ref most = m_b.emit(Op::Extract, Ty::Float, {Ci}, {}, 0);
        for (int c = 1; c < 3; c++)
            most = op(Op::Max, most, m_b.emit(Op::Extract, Ty::Float, {Ci}, {}, c));
        const Ref lit = m_b.emit(Op::Gt, Ty::Bool, {most, f(0)}, {});
        return m_b.emit(Op::Select, Ty::Float, {lit, op(Op::Max, presence, f(LeastGlow)), presence}, {});
    }
    // What a surface sends out, for its presence to weight to Ci.
    Ref emitted(Ref Ci) {
        if (m_presence == None)
            return Ci;
        const Ref some = m_b.emit(Op::Gt, Ty::Bool, {m_presence, f(0)}, {});
        const Ref safe = m_b.emit(Op::Select, Ty::Float, {some, m_presence, f(1)}, {});
        const Ref scale = m_b.emit(Op::Select, Ty::Float, {some, op(Op::Div, f(1), safe), f(0)}, {});
        return op(Op::Mul, Ci, m_b.splat(scale, {}));
    }

    // Its components by themselves, where they may differ.
    void color_opacity() {
        const Grey grey = greyness(m_program, m_b);
        if (grey == Grey::Always)
            return;
        for (int c = 0; c < 3; c++) {
            output("opacity" + std::to_string(c), -1, grid::LobeId::LambertBrdf,
                   m_b.emit(Op::Extract, Ty::Float, {m_opacity}, {}, c), Special::Opacity);
            m_program.channels.back().opacity = int8_t(c);
            m_program.channels.back().as_os = grey == Grey::AsOs;
        }
    }

    // ---- lobes

    void output(const std::string& node, int input, grid::LobeId lobe, Ref value,
                Special special = Special::None) {
        const bool presence = special == Special::Presence;
        const Ty ty = m_b.at(value).ty;
        const int var = m_b.var(presence ? "presence" : node, ty, {});
        m_b.declare(var);
        m_b.store(var, value, {});
        m_stage.outputs.push_back({Output::Slot, var, int(m_program.channels.size())});
        m_program.channels.push_back({special == Special::Opacity ? "" : node, input, lobe, presence,
                                      special == Special::Ambient, ty});
    }

    void glossy(const std::string& node, Ref weight, Ref roughness) {
        constexpr auto Lobe = grid::LobeId::MicrofacetConductorBrdf;
        m_program.fixed_lobes.emplace_back(node, Lobe);
        output(node, input_of(Lobe, "reflectance"), Lobe, weight);
        output(node, input_of(Lobe, "edgeReflectance"), Lobe, weight);
        output(node, input_of(Lobe, "roughness"), Lobe, roughness);
    }

    void highlight(const std::string& node, Ref weight, Ref exponent, bool half) {
        constexpr auto Lobe = grid::LobeId::HighlightBrdf;
        m_program.fixed_lobes.emplace_back(node, Lobe);
        output(node, input_of(Lobe, "height"), Lobe, weight);
        output(node, input_of(Lobe, "exponent"), Lobe, exponent);
        if (!half)
            output(node, input_of(Lobe, "about"), Lobe, f(1));
    }

    void aimed(const std::string& node, Ref weight, Ref direction) {
        constexpr auto Lobe = grid::LobeId::AimedBsdf;
        m_program.fixed_lobes.emplace_back(node, Lobe);
        output(node, input_of(Lobe, "part"), Lobe, weight);
        constexpr int Axes[] = {input_of(Lobe, "x"), input_of(Lobe, "y"), input_of(Lobe, "z")};
        for (int c = 0; c < 3; c++)
            output(node, Axes[c], Lobe, m_b.emit(Op::Extract, Ty::Float, {direction}, {}, c));
    }

    void dielectric(const std::string& node, Ref weight, Ref index, Ref roughness) {
        constexpr auto Lobe = grid::LobeId::MicrofacetDielectricBrdf;
        m_program.fixed_lobes.emplace_back(node, Lobe);
        output(node, input_of(Lobe, "reflectance"), Lobe, weight);
        output(node, input_of(Lobe, "ior"), Lobe, index);
        output(node, input_of(Lobe, "roughness"), Lobe, roughness);
    }

    void glass(Ref reflected, Ref refracted, Ref index) {
        constexpr auto Lobe = grid::LobeId::MicrosurfaceDielectricBsdfRgb_v1;
        m_program.fixed_lobes.emplace_back("glass", Lobe);
        output("glass", input_of(Lobe, "reflectance"), Lobe, reflected);
        output("glass", input_of(Lobe, "transmittance"), Lobe, refracted);
        output("glass", input_of(Lobe, "ior"), Lobe, index);
    }

    // fresnel() takes the index of the outside over that of the inside; a lobe the inverse.
    Ref index_of(const Site& s) {
        if (s.eta < 0)
            return f(1);
        const Ref eta = op(Op::Max, m_b.load(s.eta, {}), f(0.1f));
        const Ref inverse = op(Op::Div, f(1), eta);
        // A shader may give either: an index below one is the other side's.
        return op(Op::Max, inverse, eta);
    }
    Ref any_index() {
        for (const Site& s : m_terms.sites)
            if (s.eta >= 0)
                return index_of(s);
        return f(1);
    }

    // Is a highlight about the half vector, or about the mirror direction?
    bool about_half(const Site& s) const {
        const auto half = [](Closure k) { return k == Closure::Specular || k == Closure::SpecularKernel; };
        for (int k : {s.first, s.second})
            if (k >= 0 && half(m_terms.sites[size_t(k)].kind))
                return true;
        return half(s.kind);
    }

    // What is no plain highlight, Ward's and those with Fresnel's factor, is a microfacet lobe. Blinn's
    // exponent n as a GGX width: alpha = sqrt(2 / (n + 2)) (Walter et al. 2007); roughness is its root. About
    // the mirror direction four times the exponent gives about the same highlight.
    Ref alpha2_of(Ref exponent, bool half) {
        const Ref n = op(Op::Max, exponent, f(0));
        return half ? op(Op::Div, f(2), op(Op::Add, n, f(2)))
                    : op(Op::Div, f(1), op(Op::Add, op(Op::Mul, n, f(2)), f(1)));
    }

    // The albedo that keeps the height of the highlight. RISpec's is one on its axis, whatever its width; a
    // lobe's is pi D(0) / 4 = 1 / (4 alpha^2) times its albedo. So narrow highlights reflect little, as they
    // do there; wide ones would reflect more than there is.
    Ref height(Ref alpha2) { return op(Op::Min, op(Op::Mul, alpha2, f(4)), f(1)); }

    static constexpr int Diffuse = input_of(grid::LobeId::LambertBrdf, "diffuseReflectance");

    Program& m_program;
    Stage& m_stage;
    Builder& m_b;
    const LightTerms& m_terms;
    Ref m_opacity = None, m_presence = None;
};

} // namespace

void write_lobes(Program& program, Builder& builder, const LightTerms& terms) {
    Lobes(program, builder, terms).run();
}

} // namespace kanuka::sl::ir
