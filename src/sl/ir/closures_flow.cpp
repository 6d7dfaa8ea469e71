// Which values of a classic surface hold which light: the second part of extraction.h.
#include <algorithm>

#include "sl/ir/extraction.h"

namespace kanuka::sl::ir {

bool Contents::merge(const Contents& o) {
    bool changed = o.plain && !plain;
    plain = plain || o.plain;
    for (int s : o.sites)
        if (const auto it = std::lower_bound(sites.begin(), sites.end(), s); it == sites.end() || *it != s) {
            sites.insert(it, s);
            changed = true;
        }
    return changed;
}

static const char* source_name(Closure kind) {
    static constexpr const char* Names[] = {
        "ambient()", "indirectdiffuse()", "diffuse()", "diffuse()", "specular()", "phong()",    "trace()",
        "trace()",   "environment()",     "trace()",   "Cl",        "L",          "L",          "L",
        "L",         "fresnel()",         "fresnel()", "trace()",   "trace()",    "specular()", "L",
        "Cl"};
    static_assert(std::size(Names) == size_t(Closure::LightSample) + 1);
    return Names[int(kind)];
}

void Extraction::not_a_lobe(const Contents& c, Loc at) {
    for (int s : c.sites)
        if (const Site& site = m_sites[size_t(s)]; in_loop(site.kind))
            m_failed.try_emplace(site.loop, at.line ? at : site.loc);
}

void Extraction::nonlinear(const Instr& i, const Contents& c) {
    not_a_lobe(c, i.loc);
    const int site = carrier(c);
    if (site < 0)
        return;
    const Site& s = m_sites[size_t(site)];
    const bool decides = (i.op >= Op::Lt && i.op <= Op::Not) || i.op == Op::Select;
    const std::string light = "the light of " + std::string(source_name(s.kind)) + " in line " +
                              std::to_string(s.loc.line) + ", which is not known: shading runs before rays. ";
    complain(i.loc.line ? i.loc : s.loc,
             decides ? "this condition needs " + light +
                           "It is decided as on a white surface, fully lit, and what depends on it is taken "
                           "to be light"
                     : "this is not linear in " + light +
                           "It is drawn as a straight line from no light to a white surface, fully lit. Add "
                           "light and multiply it with what is known; use layers or lobe weights for "
                           "anything else");
}

Contents Extraction::nonlinear_contents(const Instr& i, const Contents& lit) {
    if (i.ty != Ty::Float && i.ty != Ty::Triple && i.ty != Ty::Bool)
        return {{}, true};
    Contents c{{}, true};
    if (i.op == Op::Call) {
        // Derivatives serve filters; a picture looked up by light is light.
        const CallKind kind = m_stage.calls[size_t(i.imm)].kind;
        if (kind == CallKind::Texture || kind == CallKind::Environment)
            if (const int s = carrier(lit); s >= 0)
                return {{s}, false};
        return c;
    }
    for (int s : lit.sites)
        if (is_light(m_sites[size_t(s)].kind))
            c.sites.push_back(s);
    return c;
}

// The context that a variable's value depends on light by; null = none.
const Extraction::Context* Extraction::context_of(int var) const {
    if (m_contexts.empty() || m_plain_only[size_t(var)] ||
        m_declared[size_t(var)] >= int(m_contexts.size()) || m_contexts.back().scratch.count(var))
        return nullptr;
    const Ty ty = m_stage.vars[size_t(var)].ty;
    return ty == Ty::Float || ty == Ty::Triple ? &m_contexts.back() : nullptr;
}

bool Extraction::reads(Ref r, int var, int depth) {
    const Instr& i = m_stage.instrs[size_t(r)];
    if (i.op == Op::Load && i.imm == var)
        return true;
    if (depth > 12)
        return false;
    for (Ref a : i.args)
        if (reads(a, var, depth + 1))
            return true;
    return false;
}

// x = x + …, but no counter of a loop within.
bool Extraction::accumulates(const Instr& store, const Context& context) {
    if (!reads(store.args[0], store.imm, 0))
        return false;
    const Instr& value = m_stage.instrs[size_t(store.args[0])];
    const bool counts = value.op == Op::Add && (m_b.is_const(value.args[0]) || m_b.is_const(value.args[1]));
    return !counts || m_loops == context.loops + int(context.loop);
}

bool Extraction::flow_store(const Instr& i, Ref value) {
    Contents c = contents(value);
    Contents& var = m_vars[size_t(i.imm)];
    if (m_plain_only[size_t(i.imm)]) {
        not_a_lobe(c, i.loc);
        if (carrier(c) >= 0)
            nonlinear(i, c);
        return var.merge({{}, true});
    }
    if (const Context* context = context_of(i.imm); context && c.plain) {
        const bool sum = i.op == Op::Store && accumulates(i, *context);
        if (sum || !context->loop) {
            c.merge({{context->carrier}, false});
            c.plain = false; // a sum's old plain part is there already
        }
    }
    return var.merge(c);
}

// True if the item's body depends on light: then a context was entered.
bool Extraction::enter(const Item& item) {
    if (item.kind == Item::Scope && item.light != None) {
        m_contexts.push_back({true, m_site_of.at(item.light), m_loops, {}});
        find_scratch(*item.body, m_contexts.back().scratch);
        return true;
    }
    if (item.kind != Item::If)
        return false;
    const Contents c = contents(item.ref);
    const int site = carrier(c);
    if (site < 0)
        return false;
    m_contexts.push_back({false, site, m_loops, {}});
    return true;
}

void Extraction::find_scratch(const Block& b, std::set<int>& scratch) {
    for (const Item& item : b.items) {
        if (item.kind == Item::Instruction)
            if (const Instr& i = m_stage.instrs[size_t(item.ref)];
                i.op == Op::Store && !reads(i.args[0], i.imm, 0))
                scratch.insert(i.imm);
        if (item.body)
            find_scratch(*item.body, scratch);
        if (item.orelse)
            find_scratch(*item.orelse, scratch);
    }
}

bool Extraction::flow(const Block& b) {
    bool changed = false;
    for (const Item& item : b.items) {
        if (item.kind == Item::Instruction)
            changed = flow_instruction(item.ref) || changed;
        if (item.kind == Item::Declare)
            m_declared[size_t(item.target)] = int(m_contexts.size());
        if (item.kind == Item::If)
            not_a_lobe(contents(item.ref), item.loc);
        const bool entered = enter(item);
        m_loops += item.kind == Item::Loop;
        if (item.body)
            changed = flow(*item.body) || changed;
        if (item.orelse)
            changed = flow(*item.orelse) || changed;
        m_loops -= item.kind == Item::Loop;
        if (entered)
            m_contexts.pop_back();
    }
    return changed;
}

// Light times light: factors make terms, fresnel() is taken as it is seen from the dicing camera beside
// anything that it makes no lobe of, and the product of two terms is half of each.
void Extraction::flow_product(const Instr& i, Contents& c) {
    const Contents x = contents(i.args[0]), y = contents(i.args[1]);
    for (int a : x.sites)
        for (int b : y.sites) {
            const int p = product(a, b);
            const Closure ka = m_sites[size_t(a)].kind, kb = m_sites[size_t(b)].kind;
            if (p >= 0)
                c.merge({{p}, false});
            else if (is_light(ka) && is_light(kb)) {
                nonlinear(i, {{a}, false});
                c.merge({{std::min(a, b)}, false});
                c.merge({{std::max(a, b)}, false});
            } else if (is_fresnel(ka) && is_fresnel(kb))
                c.plain = true;
            else if (is_fresnel(ka) || is_fresnel(kb))
                c.merge({{is_fresnel(ka) ? b : a}, false});
            else
                not_a_lobe({{std::min(a, b), std::max(a, b)}, false}, i.loc);
        }
    if (y.plain)
        c.merge({x.sites, false});
    if (x.plain)
        c.merge({y.sites, false});
    c.plain = c.plain || (x.plain && y.plain);
}

// if (Kr > 0.001): saves a ray where fresnel() is small. Taken as true, so that the view does not matter.
bool Extraction::skips_little(const Instr& i) {
    if (i.op < Op::Lt || i.op > Op::Ge)
        return false;
    const bool more = i.op == Op::Gt || i.op == Op::Ge;
    const Ref amount = i.args[more ? 0 : 1], limit = i.args[more ? 1 : 0];
    if (!m_b.is_const(limit) || !(m_b.at(limit).floats[0] >= 0 && m_b.at(limit).floats[0] <= 0.05f))
        return false;
    const Contents c = contents(amount);
    for (int s : c.sites)
        if (!is_fresnel(m_sites[size_t(s)].kind))
            return false;
    return !c.sites.empty() && !c.plain;
}

bool Extraction::flow_instruction(Ref r) {
    if (!m_used[size_t(r)])
        return false;
    const Instr& i = m_stage.instrs[size_t(r)];
    Contents c;
    const Contents all = arguments(i);
    if (skips_little(i))
        return m_refs[size_t(r)].merge({{}, true});
    const auto chord = [&] {
        if (!all.sites.empty() &&
            !(i.op == Op::Max && (m_b.is_const(i.args[0], 0) || m_b.is_const(i.args[1], 0))))
            nonlinear(i, all);
        c = all.sites.empty() ? Contents{{}, true} : nonlinear_contents(i, all);
        not_a_lobe(all, i.loc);
    };
    switch (i.op) {
    case Op::Closure:
        not_a_lobe(all, i.loc);
        c.sites = {m_site_of[r]};
        break;
    case Op::Load:
    case Op::LoadElement:
        c = m_vars[size_t(i.imm)];
        break;
    case Op::Store:
        return flow_store(i, i.args[0]);
    case Op::StoreElement:
        return flow_store(i, i.args[1]);
    case Op::Add:
    case Op::Sub:
    case Op::Neg:
    case Op::Splat:
    case Op::Extract:
        c = all;
        break;
    case Op::Make:
        if (i.ty == Ty::Triple)
            c = all;
        else
            chord();
        break;
    case Op::Select:
        if (i.ty == Ty::Bool || !contents(i.args[0]).sites.empty()) {
            chord();
            break;
        }
        c.merge(contents(i.args[1]));
        c.merge(contents(i.args[2]));
        break;
    case Op::Mul:
    case Op::Div:
    case Op::Dot: {
        const Contents x = contents(i.args[0]), y = contents(i.args[1]);
        if (i.ty == Ty::Matrix || (!y.sites.empty() && i.op == Op::Div) ||
            (i.op == Op::Dot && !x.sites.empty() && !y.sites.empty())) {
            chord();
        } else if (!x.sites.empty() && !y.sites.empty()) {
            flow_product(i, c);
        } else {
            c.sites = x.sites.empty() ? y.sites : x.sites;
            c.plain = x.plain && y.plain;
        }
        break;
    }
    default:
        chord();
        break;
    }
    return m_refs[size_t(r)].merge(c);
}

} // namespace kanuka::sl::ir
