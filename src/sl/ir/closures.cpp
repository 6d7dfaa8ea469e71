// A classic surface's Ci, read as a material. A colour that contains light is linear in it: C = plain + sum
// of w_k light_k, with one term for each call of diffuse(), specular(), … in the inlined shader. So every
// variable and value that may contain light becomes a bundle of ordinary colours, its plain part and its
// weights, and +, -, * and ?: act on the parts; if and loops act on the parts' variables like on any other.
// What is not linear in light is an error at its line. At the end Ci's bundle says lobes and weights.
#include <algorithm>
#include <map>

#include "sl/ir/passes.h"
#include "sl/ir/plan.h"

namespace kanuka::sl::ir {

namespace {

struct Site {
    Closure kind;
    Loc loc;
    int shape = -1;              // variable: the argument that shapes the lobe (roughness, exponent)
    int eta = -1;                // variable: of a Fresnel factor
    int first = -1, second = -1; // a product of two factors: their sites
};

bool is_factor(Closure k) {
    return k >= Closure::Light && k <= Closure::FresnelTransmit;
}
bool has_shape(Closure k) {
    return k == Closure::Specular || k == Closure::Phong || k == Closure::SpecularKernel ||
           k == Closure::PhongKernel;
}
bool is_fresnel(Closure k) {
    return k == Closure::FresnelReflect || k == Closure::FresnelTransmit;
}

// The term that two factors make; LightDirection = none.
Closure product_kind(Closure a, Closure b) {
    if (b == Closure::Light || is_fresnel(a))
        std::swap(a, b);
    if (a == Closure::Light)
        switch (b) {
        case Closure::CosineKernel:
            return Closure::Diffuse;
        case Closure::SpecularKernel:
            return Closure::Specular;
        case Closure::PhongKernel:
            return Closure::Phong;
        default:
            return Closure::LightDirection;
        }
    if (b == Closure::FresnelReflect)
        switch (a) {
        case Closure::Mirror:
        case Closure::Environment:
            return Closure::DielectricMirror;
        case Closure::Specular:
        case Closure::Phong:
            return Closure::DielectricGlossy;
        default:
            return a; // diffuse() times a Fresnel term: without it
        }
    if (b == Closure::FresnelTransmit)
        return a == Closure::Refraction ? Closure::DielectricTransmit : a;
    return Closure::LightDirection;
}

// Sites that a value may contain, and whether it may have a part without light.
struct Contents {
    std::vector<int> sites;
    bool plain = false;
    bool merge(const Contents& o) {
        bool changed = o.plain && !plain;
        plain = plain || o.plain;
        for (int s : o.sites)
            if (const auto it = std::lower_bound(sites.begin(), sites.end(), s);
                it == sites.end() || *it != s) {
                sites.insert(it, s);
                changed = true;
            }
        return changed;
    }
};

using Bundle = std::map<int, Ref>; // by site; Plain = the part without light
constexpr int Plain = -1;

class Extraction {
  public:
    Extraction(Program& program, Diagnostics& diagnostics)
        : m_program(program), m_stage(program.shade), m_diagnostics(diagnostics), m_b(program.shade) {}

    void run() {
        m_directions = find_directions(m_stage);
        find_sites(*m_stage.root);
        m_refs.resize(m_stage.instrs.size());
        m_vars.resize(m_stage.vars.size());
        for (bool changed = true; changed;)
            changed = flow(*m_stage.root);
        if (m_broken)
            return;
        make_variables();
        Block* const old = m_stage.root;
        m_stage.root = m_stage.block();
        m_b.set_block(m_stage.root);
        for (const int v : m_new_vars)
            m_b.declare(v);
        for (const Site& s : m_sites)
            for (int v : {s.shape, s.eta})
                if (v >= 0 && s.first < 0)
                    m_b.store(v, m_b.constant(v == s.eta ? 1.0f : 0.1f), s.loc);
        rewrite(*old);
        finish();
    }

  private:
    void error(Loc at, const std::string& what) {
        m_broken = true;
        m_diagnostics.error(at, what);
    }

    void find_sites(Block& b) {
        for (Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                Instr& i = m_stage.instrs[size_t(item.ref)];
                // An environment map seen along a mirrored view direction is a mirror that sees the scene.
                if (i.op == Op::Call && m_stage.calls[size_t(i.imm)].kind == CallKind::Environment &&
                    i.args.size() > 2 && m_directions.refs[size_t(i.args[2])] && i.ty == Ty::Triple) {
                    i.args = {i.args[2]};
                    i.op = Op::Closure;
                    i.imm = int(Closure::Environment);
                }
                if (i.op == Op::Closure) {
                    check_arguments(i);
                    m_site_of[item.ref] = int(m_sites.size());
                    m_sites.push_back({Closure(i.imm), i.loc});
                }
            }
            if (item.body)
                find_sites(*item.body);
            if (item.orelse)
                find_sites(*item.orelse);
        }
    }

    void check_arguments(const Instr& i) {
        const Closure kind = Closure(i.imm);
        const bool mirror =
            kind == Closure::Mirror || kind == Closure::Environment || kind == Closure::Refraction;
        if (mirror && !m_directions.refs[size_t(i.args[0])])
            error(i.loc, "light is traced along mirrored or refracted view directions only: expected "
                         "reflect(I, N), found a "
                         "direction that does not depend on I");
        if (!mirror && kind != Closure::PhongKernel && !i.args.empty() &&
            m_directions.refs[size_t(i.args[0])])
            error(i.loc, "the normal of this lobe depends on the viewing direction I, which is not known: "
                         "shading runs before "
                         "rays; use N or faceforward(N, I)");
        for (size_t k = 2; k < i.args.size(); k++)
            if (m_directions.refs[size_t(i.args[k])])
                error(i.loc, "the roughness of this lobe depends on the viewing direction I, which is not "
                             "known: shading runs "
                             "before rays");
    }

    Contents contents(Ref r) {
        const Instr& i = m_stage.instrs[size_t(r)];
        if (i.op == Op::Const) {
            Contents c;
            c.plain = !m_b.is_const(r, 0);
            return c;
        }
        if (is_leaf(i.op))
            return {{}, true};
        return m_refs[size_t(r)];
    }

    static const char* source_name(Closure kind) {
        static constexpr const char* Names[] = {
            "ambient()",       "diffuse()",      "specular()", "phong()",         "trace()",
            "trace()",         "environment()",  "Cl",         "the direction L", "the direction L",
            "the direction L", "fresnel()",      "fresnel()",  "trace()",         "trace()",
            "specular()",      "the direction L"};
        static_assert(std::size(Names) == size_t(Closure::LightDirection) + 1);
        return Names[int(kind)];
    }

    // The site of a product, made at its first use; -1 = these do not make a term.
    int product(int a, int b) {
        if (a > b)
            std::swap(a, b);
        const auto [it, fresh] = m_products.try_emplace({a, b}, -1);
        if (!fresh)
            return it->second;
        const Closure kind = product_kind(m_sites[size_t(a)].kind, m_sites[size_t(b)].kind);
        if (kind == Closure::LightDirection)
            return -1;
        Site s{kind, m_sites[size_t(a)].loc};
        s.first = a;
        s.second = b;
        m_sites.push_back(s);
        return it->second = int(m_sites.size()) - 1;
    }

    void nonlinear(const Instr& i, const Contents& c) {
        const Site& s = m_sites[size_t(c.sites[0])];
        error(i.loc.line ? i.loc : s.loc, "this needs the light of " + std::string(source_name(s.kind)) +
                                              " in line " + std::to_string(s.loc.line) +
                                              ", which is not known: shading runs before rays. Light may be "
                                              "added, and multiplied by what is known; use layers "
                                              "or lobe weights for anything else");
    }

    bool flow(const Block& b) {
        bool changed = false;
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction)
                changed = flow_instruction(item.ref) || changed;
            if (item.kind == Item::If)
                if (const Contents c = contents(item.ref); !c.sites.empty())
                    nonlinear(m_stage.instrs[size_t(item.ref)], c);
            if (item.body)
                changed = flow(*item.body) || changed;
            if (item.orelse)
                changed = flow(*item.orelse) || changed;
        }
        return changed;
    }

    bool flow_instruction(Ref r) {
        const Instr& i = m_stage.instrs[size_t(r)];
        Contents c;
        switch (i.op) {
        case Op::Closure:
            c.sites = {m_site_of[r]};
            break;
        case Op::Load:
            c = m_vars[size_t(i.imm)];
            break;
        case Op::Store:
            return m_vars[size_t(i.imm)].merge(contents(i.args[0]));
        case Op::Add:
        case Op::Sub:
        case Op::Neg:
        case Op::Splat:
            for (Ref a : i.args)
                c.merge(contents(a));
            break;
        case Op::Select: {
            c.merge(contents(i.args[1]));
            c.merge(contents(i.args[2]));
            if (const Contents k = contents(i.args[0]); !k.sites.empty())
                nonlinear(i, k);
            break;
        }
        case Op::Mul:
        case Op::Div: {
            const Contents x = contents(i.args[0]), y = contents(i.args[1]);
            if (!y.sites.empty() && i.op == Op::Div) {
                nonlinear(i, y);
                break;
            }
            if (!x.sites.empty() && !y.sites.empty()) {
                for (int a : x.sites)
                    for (int b : y.sites) {
                        Contents p;
                        p.sites = {product(a, b)};
                        if (p.sites[0] < 0) {
                            nonlinear(i, y);
                            return false;
                        }
                        c.merge(p);
                    }
                if (y.plain)
                    c.merge({x.sites, false});
                if (x.plain)
                    c.merge({y.sites, false});
                c.plain = x.plain && y.plain;
                break;
            }
            c.sites = x.sites.empty() ? y.sites : x.sites;
            c.plain = x.plain && y.plain;
            break;
        }
        default:
            c.plain = true;
            for (Ref a : i.args)
                if (const Contents k = contents(a); !k.sites.empty()) {
                    nonlinear(i, k);
                    break;
                }
            break;
        }
        return m_refs[size_t(r)].merge(c);
    }

    // ---- rewriting
    // ----------------------------------------------------------------------------------------------------

    void make_variables() {
        const size_t count = m_stage.vars.size();
        m_parts.resize(count);
        for (size_t v = 0; v < count; v++)
            for (int s : m_vars[v].sites) {
                const int part = m_b.var(m_stage.vars[v].name + "'" + std::to_string(s), m_stage.vars[v].ty,
                                         m_stage.vars[v].loc);
                m_parts[v][s] = part;
            }
        for (Site& s : m_sites) {
            if (s.first >= 0) { // products come after their factors
                for (int f : {s.first, s.second}) {
                    s.shape = std::max(s.shape, m_sites[size_t(f)].shape);
                    s.eta = std::max(s.eta, m_sites[size_t(f)].eta);
                }
                continue;
            }
            int* const slot = has_shape(s.kind) ? &s.shape : is_fresnel(s.kind) ? &s.eta : nullptr;
            if (slot) {
                *slot = m_b.var("shape", Ty::Float, s.loc);
                m_new_vars.push_back(*slot);
            }
        }
    }

    Ref same(Ty ty, float x) { return ty == Ty::Float ? m_b.constant(x) : m_b.triple(x); }

    Bundle bundle(Ref r) {
        if (const auto it = m_bundles.find(r); it != m_bundles.end())
            return it->second;
        Bundle b;
        if (contents(r).plain)
            b[Plain] = r;
        return b;
    }

    void rewrite(const Block& b) {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                instruction(item);
                continue;
            }
            m_b.item(item);
            if (item.kind == Item::Declare)
                for (const auto& [site, part] : m_parts[size_t(item.target)])
                    m_b.declare(part);
            const size_t at = m_b.block()->items.size() - 1;
            Block* const here = m_b.block();
            for (Block* Item::* side : {&Item::body, &Item::orelse}) {
                const Block* old = item.*side;
                if (!old)
                    continue;
                Block* const made = m_stage.block();
                m_b.set_block(made);
                rewrite(*old);
                m_b.set_block(here);
                here->items[at].*side = made;
            }
        }
    }

    void instruction(const Item& item) {
        const Instr i = m_stage.instrs[size_t(item.ref)];
        const Loc at = i.loc;
        if (i.op == Op::Store && !m_parts[size_t(i.imm)].empty()) {
            const Bundle value = bundle(i.args[0]);
            const auto part = [&](int site) {
                const auto it = value.find(site);
                return it == value.end() ? same(m_stage.vars[size_t(i.imm)].ty, 0) : it->second;
            };
            for (const auto& [site, var] : m_parts[size_t(i.imm)])
                m_b.store(var, part(site), at);
            m_b.store(i.imm, part(Plain), at);
            return;
        }
        if (m_refs[size_t(item.ref)].sites.empty()) {
            m_b.item(item);
            return;
        }
        Bundle out;
        switch (i.op) {
        case Op::Closure: {
            const int s = m_site_of[item.ref];
            out[s] = same(i.ty, 1);
            const Site& site = m_sites[size_t(s)];
            if (site.shape >= 0 || site.eta >= 0)
                m_b.store(site.shape >= 0 ? site.shape : site.eta, shape_argument(site.kind, i.args[2], at),
                          at);
            break;
        }
        case Op::Splat:
            for (const auto& [k, w] : bundle(i.args[0]))
                out[k] = m_b.splat(w, at);
            break;
        case Op::Load:
            for (const auto& [site, var] : m_parts[size_t(i.imm)])
                out[site] = m_b.load(var, at);
            if (m_vars[size_t(i.imm)].plain)
                out[Plain] = m_b.load(i.imm, at);
            break;
        case Op::Neg:
            for (const auto& [k, w] : bundle(i.args[0]))
                out[k] = m_b.emit(Op::Neg, i.ty, {w}, at);
            break;
        case Op::Add:
        case Op::Sub: {
            out = bundle(i.args[0]);
            for (const auto& [k, w] : bundle(i.args[1]))
                if (const auto it = out.find(k); it != out.end())
                    it->second = m_b.emit(i.op, i.ty, {it->second, w}, at);
                else
                    out[k] = i.op == Op::Add ? w : m_b.emit(Op::Neg, i.ty, {w}, at);
            break;
        }
        case Op::Mul:
        case Op::Div: {
            const bool left = !contents(i.args[0]).sites.empty(), right = !contents(i.args[1]).sites.empty();
            if (left && right) {
                // Factor by factor; a plain part of one side leaves the other's factors as they are.
                for (const auto& [k, w] : bundle(i.args[0]))
                    for (const auto& [l, x] : bundle(i.args[1])) {
                        const int site = k == Plain ? l : l == Plain ? k : product(k, l);
                        const Ref p = m_b.emit(Op::Mul, i.ty, {w, x}, at);
                        const auto it = out.find(site);
                        out[site] = it == out.end() ? p : m_b.emit(Op::Add, i.ty, {it->second, p}, at);
                    }
                break;
            }
            for (const auto& [k, w] : bundle(i.args[left ? 0 : 1]))
                out[k] = left ? m_b.emit(i.op, i.ty, {w, i.args[1]}, at)
                              : m_b.emit(i.op, i.ty, {i.args[0], w}, at);
            break;
        }
        case Op::Select: {
            const Bundle a = bundle(i.args[1]), b = bundle(i.args[2]);
            const auto get = [&](const Bundle& x, int k) {
                const auto it = x.find(k);
                return it == x.end() ? same(i.ty, 0) : it->second;
            };
            Bundle keys = a;
            keys.insert(b.begin(), b.end());
            for (const auto& [k, unused] : keys)
                out[k] = m_b.emit(Op::Select, i.ty, {i.args[0], get(a, k), get(b, k)}, at);
            break;
        }
        default:
            break;
        }
        m_bundles[item.ref] = std::move(out);
    }

    // ---- the material
    // -------------------------------------------------------------------------------------------------

    // What shapes a lobe, in one measure: specular() and its kernel the inverse of Blinn's exponent, phong()
    // its exponent.
    Ref shape_argument(Closure kind, Ref x, Loc at) {
        if (kind != Closure::SpecularKernel)
            return x;
        const Ref n = m_b.emit(Op::Max, Ty::Float, {x, m_b.constant(1e-3f)}, at);
        return m_b.emit(Op::Div, Ty::Float, {m_b.constant(1.0f), n}, at);
    }

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

    void output(const std::string& node, int input, grid::LobeId lobe, Ref value, bool presence = false) {
        const Ty ty = m_b.at(value).ty;
        const int var = m_b.var(presence ? "presence" : node, ty, {});
        m_b.declare(var);
        m_b.store(var, value, {});
        m_stage.outputs.push_back({Output::Slot, var, int(m_program.channels.size())});
        m_program.channels.push_back({node, input, lobe, presence, ty});
    }

    void glossy(const std::string& node, Ref weight, Ref roughness) {
        constexpr auto Lobe = grid::LobeId::MicrofacetConductorBrdf;
        m_program.fixed_lobes.emplace_back(node, Lobe);
        output(node, 0, Lobe, weight);
        output(node, 1, Lobe, weight);
        output(node, 2, Lobe, roughness);
    }

    void dielectric(const std::string& node, Ref weight, Ref index, Ref roughness) {
        constexpr auto Lobe = grid::LobeId::MicrofacetDielectricBrdf;
        m_program.fixed_lobes.emplace_back(node, Lobe);
        output(node, 0, Lobe, weight);
        output(node, 1, Lobe, index);
        output(node, 2, Lobe, roughness);
    }

    void glass(Ref reflected, Ref refracted, Ref index) {
        constexpr auto Lobe = grid::LobeId::MicrosurfaceDielectricBsdfRgb_v1;
        m_program.fixed_lobes.emplace_back("glass", Lobe);
        output("glass", 1, Lobe, reflected);
        output("glass", 2, Lobe, refracted);
        output("glass", 3, Lobe, index);
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
        for (const Site& s : m_sites)
            if (s.eta >= 0)
                return index_of(s);
        return f(1);
    }

    bool shape_is_inverse(const Site& s) const {
        for (int k : {s.first, s.second})
            if (k >= 0 && (m_sites[size_t(k)].kind == Closure::Specular ||
                           m_sites[size_t(k)].kind == Closure::SpecularKernel))
                return true;
        return false;
    }

    // Blinn's exponent n as a GGX width: alpha = sqrt(2 / (n + 2)) (Walter et al. 2007); roughness is its
    // root. specular(): n = 1 / r. phong(): four times Phong's exponent gives about the same highlight.
    Ref roughness_of(Ref x, bool inverse) {
        const Ref twice = op(Op::Mul, op(Op::Max, x, f(0)), f(2));
        const Ref more = op(Op::Add, twice, f(1));
        const Ref alpha2 = inverse ? op(Op::Div, twice, more) : op(Op::Div, f(1), more);
        return m_b.emit(Op::Sqrt, Ty::Float, {m_b.emit(Op::Sqrt, Ty::Float, {alpha2}, {})}, {});
    }

    void finish() {
        Ref opacity = None;
        if (!always_one(m_program.Oi)) {
            opacity = m_b.load(m_program.Oi, {});
            Ref sum = m_b.emit(Op::Extract, Ty::Float, {opacity}, {}, 0);
            for (int c = 1; c < 3; c++)
                sum = op(Op::Add, sum, m_b.emit(Op::Extract, Ty::Float, {opacity}, {}, c));
            output("", -1, grid::LobeId::LambertBrdf, op(Op::Mul, sum, f(1 / 3.f)), true);
        }
        const auto& parts = m_parts[size_t(m_program.Ci)];
        bool has_diffuse = false;
        for (const auto& [site, var] : parts)
            has_diffuse = has_diffuse || m_sites[size_t(site)].kind == Closure::Diffuse;
        for (const auto& [site, var] : parts)
            if (const Site& s = m_sites[size_t(site)];
                is_factor(s.kind) || s.kind == Closure::LightDirection) {
                error(s.loc, std::string(s.kind == Closure::Light ? "Cl"
                                         : is_fresnel(s.kind)     ? "a Fresnel factor"
                                                                  : "this cosine") +
                                 " reaches Ci by itself, which is no material: expected Cl times a cosine, N "
                                 ". L, or a glossy "
                                 "kernel, pow(N . H, n), or a Fresnel factor times trace() or specular()");
                return;
            }
        // Ambient light is light like any other here: diffuse() already reflects it.
        const auto total = [&](auto&& wanted) {
            Ref sum = None;
            for (const auto& [site, var] : parts)
                if (wanted(m_sites[size_t(site)].kind)) {
                    const Ref w = m_b.load(var, {});
                    sum = sum == None ? w : op(Op::Add, sum, w);
                }
            return sum == None ? None : unpremultiply(sum, opacity);
        };
        if (const Ref w = total(
                [&](Closure k) { return k == Closure::Diffuse || (k == Closure::Ambient && !has_diffuse); });
            w != None) {
            m_program.fixed_lobes.emplace_back("diffuse", grid::LobeId::LambertBrdf);
            output("diffuse", 0, grid::LobeId::LambertBrdf, w);
        }
        int count = 0;
        for (const auto& [site, var] : parts) {
            const Site& s = m_sites[size_t(site)];
            if (s.shape < 0)
                continue;
            const std::string name = "specular" + (count ? std::to_string(count + 1) : std::string());
            const Ref w = unpremultiply(m_b.load(var, {}), opacity);
            const bool inverse = s.kind == Closure::Specular || shape_is_inverse(s);
            const Ref roughness = roughness_of(m_b.load(s.shape, {}), inverse);
            if (s.kind == Closure::DielectricGlossy)
                dielectric(name, w, index_of(s), roughness);
            else
                glossy(name, w, roughness);
            count++;
        }
        if (const Ref w = total([](Closure k) { return k == Closure::Mirror || k == Closure::Environment; });
            w != None)
            glossy("mirror", w, f(0));
        const Ref reflected = total([](Closure k) { return k == Closure::DielectricMirror; });
        const Ref refracted =
            total([](Closure k) { return k == Closure::DielectricTransmit || k == Closure::Refraction; });
        if (refracted != None)
            glass(reflected == None ? m_b.triple(0) : reflected, refracted, any_index());
        else if (reflected != None)
            dielectric("gloss", reflected, any_index(), f(0));
        if (m_vars[size_t(m_program.Ci)].plain && last_plain()) {
            m_program.fixed_lobes.emplace_back("emission", grid::LobeId::DiffuseEmission);
            output("emission", 0, grid::LobeId::DiffuseEmission,
                   unpremultiply(m_b.load(m_program.Ci, {}), opacity));
        }
    }

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

    Program& m_program;
    Stage& m_stage;
    Diagnostics& m_diagnostics;
    Builder m_b;
    Directions m_directions;
    std::vector<Site> m_sites;
    std::map<Ref, int> m_site_of;
    std::map<std::pair<int, int>, int> m_products;
    std::vector<Contents> m_refs, m_vars;
    std::vector<std::map<int, int>> m_parts; // by variable: a variable for each site
    std::vector<int> m_new_vars;
    std::map<Ref, Bundle> m_bundles;
    bool m_broken = false, m_overwritten = false;
};

} // namespace

void extract_closures(Program& program, Diagnostics& diagnostics) {
    if (program.Ci < 0 || !program.shade.root)
        return;
    Extraction(program, diagnostics).run();
}

} // namespace kanuka::sl::ir
