// Lobes and weights out of the terms of light that Ci holds.
#include <utility>

#include "grid/lobe_table.h"
#include "sl/ir/light_terms.h"

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
        Ref opacity = None;
        if (!always_one(m_program.Oi)) {
            opacity = m_b.load(m_program.Oi, {});
            Ref sum = m_b.emit(Op::Extract, Ty::Float, {opacity}, {}, 0);
            for (int c = 1; c < 3; c++)
                sum = op(Op::Add, sum, m_b.emit(Op::Extract, Ty::Float, {opacity}, {}, c));
            m_presence = op(Op::Mul, sum, f(1 / 3.f));
            if (m_terms.plain && !follows_opacity() && last_plain())
                m_presence = glowing(m_presence);
            output("", -1, grid::LobeId::LambertBrdf, m_presence, Special::Presence);
            color_opacity(opacity);
        }
        bool has_lobe = false;
        for (const auto& [site, var] : m_terms.weights)
            has_lobe = has_lobe || (m_terms.sites[size_t(site)].kind != Closure::Ambient &&
                                    m_terms.sites[size_t(site)].kind != Closure::Indirect);
        const auto total = [&](auto&& wanted) {
            Ref sum = None;
            for (const auto& [site, var] : m_terms.weights)
                if (wanted(m_terms.sites[size_t(site)].kind)) {
                    Ref w = m_b.load(var, {});
                    const Site& s = m_terms.sites[size_t(site)];
                    if (s.kind == Closure::LightSample || is_fresnel(s.kind))
                        w = op(Op::Mul, w, m_b.splat(m_b.load(s.reference, {}), {}));
                    sum = sum == None ? w : op(Op::Add, sum, w);
                }
            return sum == None ? None : unpremultiply(sum, opacity);
        };
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
        int count = 0;
        Ref rest = None, rest_exponent = None; // more than a material has room for: one lobe together
        for (const auto& [site, var] : m_terms.weights) {
            const Site& s = m_terms.sites[size_t(site)];
            if (s.shape < 0)
                continue;
            const std::string name = "specular" + (count ? std::to_string(count + 1) : std::string());
            const bool half = about_half(s);
            const Ref exponent = m_b.load(s.shape, {});
            Ref w = unpremultiply(m_b.load(var, {}), opacity);
            if (++count >= MaxGlossy) {
                rest = rest == None ? w : op(Op::Add, rest, w);
                rest_exponent = rest_exponent == None ? exponent : op(Op::Min, rest_exponent, exponent);
                continue;
            }
            if (s.anisotropy < 0 && s.kind != Closure::DielectricGlossy) {
                highlight(name, w, exponent, half);
                continue;
            }
            const Ref alpha2 = alpha2_of(exponent, half);
            w = op(Op::Mul, w, m_b.splat(height(alpha2), {}));
            const Ref alpha = m_b.emit(Op::Sqrt, Ty::Float, {alpha2}, {});
            Ref roughness = m_b.emit(Op::Sqrt, Ty::Float, {alpha}, {});
            if (s.anisotropy >= 0) // a lobe's is that across its grooves, this the mean
                roughness =
                    op(Op::Div, roughness,
                       m_b.emit(
                           Op::Sqrt, Ty::Float,
                           {m_b.emit(Op::Sqrt, Ty::Float,
                                     {op(Op::Sub, f(1), op(Op::Mul, f(Stretch), m_b.load(s.anisotropy, {})))},
                                     {})},
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
        if (rest != None)
            highlight("specular" + std::to_string(MaxGlossy), rest, rest_exponent, true);
        if (const Ref w = total([](Closure k) { return k == Closure::Mirror || k == Closure::Environment; });
            w != None)
            glossy("mirror", w, f(0));
        int aims = 0;
        for (const auto& [site, var] : m_terms.weights)
            if (const Site& s = m_terms.sites[size_t(site)]; s.aim >= 0)
                aimed("trace" + (aims++ ? std::to_string(aims) : std::string()),
                      unpremultiply(m_b.load(var, {}), opacity), m_b.load(s.aim, {}));
        const Ref reflected = total([](Closure k) { return k == Closure::DielectricMirror; });
        const Ref refracted =
            total([](Closure k) { return k == Closure::DielectricTransmit || k == Closure::Refraction; });
        if (refracted != None)
            glass(reflected == None ? m_b.triple(0) : reflected, refracted, any_index());
        else if (reflected != None)
            dielectric("gloss", reflected, any_index(), f(0));
        // fresnel() that no lobe takes: as the dicing camera sees it.
        Ref emission = total([](Closure k) { return is_fresnel(k); });
        if (m_terms.plain && (emission != None || last_plain())) {
            const Ref plain = emitted(m_b.load(m_program.Ci, {}));
            emission = emission == None ? plain : op(Op::Add, emission, plain);
        }
        if (emission != None) {
            m_program.fixed_lobes.emplace_back("emission", grid::LobeId::DiffuseEmission);
            output("emission", grid::EmissionRadiance, grid::LobeId::DiffuseEmission, emission);
        }
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

    // -------------------------------------------------------------------------------------------------

    Ref op(Op o, Ref a, Ref b) { return m_b.emit(o, m_b.at(a).ty, {a, b}, {}); }
    Ref f(float x) { return m_b.constant(x); }

    // True if every store to the variable is the constant one.
    bool always_one(int var) {
        bool one = true;
        const auto search = [&](auto& again, const Block& b) -> void {
            for (const Item& item : b.items) {
                if (item.kind == Item::Instruction) {
                    const Instr& i = m_stage.instrs[size_t(item.ref)];
                    if (i.op == Op::Store && i.imm == var) {
                        const bool first =
                            m_b.at(i.args[0]).op == Op::Input; // the initial Os, overwritten at the top level
                        one = one && (first || m_b.is_const(i.args[0], 1));
                        m_overwritten = m_overwritten || (&b == m_stage.root && m_b.is_const(i.args[0], 1));
                    }
                }
                if (item.body)
                    again(again, *item.body);
                if (item.orelse)
                    again(again, *item.orelse);
            }
        };
        m_overwritten = false;
        search(search, *m_stage.root);
        return one && m_overwritten;
    }

    // Ci is premultiplied by opacity; a lobe's weight is not.
    Ref unpremultiply(Ref w, Ref opacity) {
        if (opacity == None)
            return w;
        std::vector<Ref> parts;
        for (int c = 0; c < 3; c++) {
            const Ref x = m_b.emit(Op::Extract, Ty::Float, {w}, {}, c),
                      o = m_b.emit(Op::Extract, Ty::Float, {opacity}, {}, c);
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
    // Values that a variable may come from, each once.
    class Sources {
      public:
        Sources(const Stage& stage, int var)
            : m_stage(stage), m_seen(stage.instrs.size(), 0), m_vars(stage.vars.size(), 0) {
            stores(var);
        }
        const Instr* next(Ref& at) {
            while (!m_work.empty()) {
                at = m_work.back();
                m_work.pop_back();
                if (!std::exchange(m_seen[size_t(at)], uint8_t(1)))
                    return &m_stage.instrs[size_t(at)];
            }
            return nullptr;
        }
        void arguments(const Instr& i, int from = 0) {
            m_work.insert(m_work.end(), i.args.begin() + from, i.args.end());
        }
        void stores(int var) {
            if (std::exchange(m_vars[size_t(var)], uint8_t(1)))
                return;
            for (const Instr& i : m_stage.instrs)
                if ((i.op == Op::Store || i.op == Op::StoreElement) && i.imm == var)
                    m_work.push_back(i.args[i.op == Op::StoreElement]);
        }

      private:
        const Stage& m_stage;
        std::vector<Ref> m_work;
        std::vector<uint8_t> m_seen, m_vars;
    };
    // Does Oi come from Os? Then it is one on opaque surfaces, whose presence must stay a constant.
    bool follows_opacity() const {
        Sources sources(m_stage, m_program.Oi);
        Ref at;
        while (const Instr* i = sources.next(at)) {
            if (i->op == Op::Input && Input(i->imm) == Input::Os)
                return true;
            sources.arguments(*i);
            if (i->op == Op::Load || i->op == Op::LoadElement)
                sources.stores(i->imm);
        }
        return false;
    }

    // Its components by themselves, where they may differ.
    void color_opacity(Ref opacity) {
        const Grey grey = greyness();
        if (grey == Grey::Always)
            return;
        for (int c = 0; c < 3; c++) {
            output("opacity" + std::to_string(c), -1, grid::LobeId::LambertBrdf,
                   m_b.emit(Op::Extract, Ty::Float, {opacity}, {}, c), Special::Opacity);
            m_program.channels.back().opacity = int8_t(c);
            m_program.channels.back().as_os = grey == Grey::AsOs;
        }
    }
    // Are all components of Oi alike? Never known, wherever Os has that, or in any case.
    enum class Grey { Unknown, AsOs, Always };
    Grey greyness() {
        Grey grey = Grey::Always;
        Sources sources(m_stage, m_program.Oi);
        Ref r;
        while (const Instr* at = sources.next(r)) {
            const Instr& i = *at;
            if (i.ty != Ty::Triple)
                continue;
            if (i.op == Op::Const ? !m_b.is_const(r, 0) && !m_b.is_const(r, 1) && !is_grey(i)
                                  : i.op == Op::Input && Input(i.imm) != Input::Os)
                return Grey::Unknown;
            switch (i.op) {
            case Op::Const:
            case Op::Splat:
                break;
            case Op::Input:
                grey = Grey::AsOs;
                break;
            case Op::Load:
            case Op::LoadElement:
                sources.stores(i.imm);
                break;
            case Op::Add:
            case Op::Sub:
            case Op::Mul:
            case Op::Div:
            case Op::Min:
            case Op::Max:
            case Op::Neg:
                sources.arguments(i);
                break;
            case Op::Select:
                sources.arguments(i, 1);
                break;
            case Op::Make:
                if (i.args[0] != i.args[1] || i.args[1] != i.args[2])
                    return Grey::Unknown;
                break;
            default:
                return Grey::Unknown;
            }
        }
        return grey;
    }
    static bool is_grey(const Instr& i) {
        return i.floats.size() == 1 ||
               (i.floats.size() == 3 && i.floats[0] == i.floats[1] && i.floats[1] == i.floats[2]);
    }

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

    // Is there anything but light in what Ci is left with? Its initial value does not count if it is
    // overwritten at the top level.
    bool last_plain() {
        bool plain = true;
        for (const Item& item : m_stage.root->items) {
            if (item.kind != Item::Instruction)
                continue;
            const Instr& i = m_stage.instrs[size_t(item.ref)];
            if (i.op == Op::Store && i.imm == m_program.Ci)
                plain = !m_b.is_const(i.args[0], 0);
        }
        if (plain)
            return true;
        // A zero at the top level, then perhaps something within an if.
        bool zero_seen = false, more = false;
        const auto search = [&](auto& again, const Block& b, bool top) -> void {
            for (const Item& item : b.items) {
                if (item.kind == Item::Instruction) {
                    const Instr& i = m_stage.instrs[size_t(item.ref)];
                    if (i.op == Op::Store && i.imm == m_program.Ci) {
                        const bool zero = m_b.is_const(i.args[0], 0);
                        if (top && zero) {
                            zero_seen = true;
                            more = false;
                        } else if (!zero) {
                            more = true;
                        }
                    }
                }
                if (item.body)
                    again(again, *item.body, false);
                if (item.orelse)
                    again(again, *item.orelse, false);
            }
        };
        search(search, *m_stage.root, true);
        return !zero_seen || more;
    }

    static constexpr int Diffuse = input_of(grid::LobeId::LambertBrdf, "diffuseReflectance");

    Program& m_program;
    Stage& m_stage;
    Builder& m_b;
    const LightTerms& m_terms;
    bool m_overwritten = false;
    Ref m_presence = None;
};

} // namespace

void write_lobes(Program& program, Builder& builder, const LightTerms& terms) {
    Lobes(program, builder, terms).run();
}

} // namespace kanuka::sl::ir
