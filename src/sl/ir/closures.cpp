// Which values of a classic surface hold which light: the first half of extraction.h.
#include <algorithm>

#include "sl/ir/extraction.h"
#include "sl/ir/plan.h"

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

Extraction::Extraction(Program& program, Diagnostics& diagnostics, bool strict)
    : m_program(program), m_stage(program.shade), m_diagnostics(diagnostics), m_b(program.shade),
      m_strict(strict) {}

std::map<int, Loc> Extraction::run() {
    m_directions = find_directions(m_stage);
    find_colored();
    find_sites(*m_stage.root);
    find_used();
    m_refs.resize(m_stage.instrs.size());
    m_vars.resize(m_stage.vars.size());
    m_declared.resize(m_stage.vars.size());
    m_plain_only.resize(m_stage.vars.size());
    m_plain_only[size_t(m_program.Oi)] = true;
    for (size_t v = 0; v < m_vars.size(); v++)
        m_plain_only[v] = m_plain_only[v] || m_stage.vars[v].counts;
    for (const Output& o : m_stage.outputs)
        if (o.var >= 0 && o.var != m_program.Ci)
            m_plain_only[size_t(o.var)] = true;
    for (const Site& s : m_sites)
        if (s.reference >= 0)
            m_plain_only[size_t(s.reference)] = true;
    for (bool changed = true; changed;)
        changed = flow(*m_stage.root);
    for (int s : m_vars[size_t(m_program.Ci)].sites) // Cl without a kernel, or a cosine without Cl
        if (in_loop(m_sites[size_t(s)].kind))
            not_a_lobe({{s}, false}, m_sites[size_t(s)].loc);
    if (!m_failed.empty())
        return m_failed;
    int said = 0;
    for (const auto& [line, complaint] : m_complaints) {
        if (m_strict) {
            m_diagnostics.error(complaint.first, complaint.second);
        } else if (said++ < MaxComplaints) {
            const int more = int(m_complaints.size()) - MaxComplaints;
            m_diagnostics.warning(complaint.first,
                                  complaint.second +
                                      (said == MaxComplaints && more > 0
                                           ? " (the same in " + std::to_string(more) + " lines more)"
                                           : std::string()));
        }
    }

    find_normals();
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
    for (const Site& s : m_sites)
        if (s.aim >= 0)
            m_b.store(s.aim, m_b.leaf(Op::Input, Ty::Triple, int(Input::N)), s.loc);
    if (m_normal >= 0)
        m_b.store(m_normal, m_b.leaf(Op::Input, Ty::Triple, int(Input::N)), {});
    rewrite(*old);
    if (m_normal >= 0)
        m_stage.outputs.push_back({Output::Normal, m_normal, 0});
    write_lobes(m_program, m_b, {m_sites, m_parts[size_t(m_program.Ci)], m_vars[size_t(m_program.Ci)].plain});
    return {};
}

// One complaint a line: what is in it hangs together.
void Extraction::complain(Loc at, const std::string& what) {
    m_complaints.try_emplace({at.file, at.line}, at, what);
}

// ---- sites

// Illuminance loops that make use of Cl.
void Extraction::find_colored() {
    std::map<int, int> loops; // by variable that holds Cl
    for (const Instr& i : m_stage.instrs)
        if (i.op == Op::Store)
            if (const Instr& from = m_stage.instrs[size_t(i.args[0])];
                from.op == Op::Closure && Closure(from.imm) == Closure::Light)
                loops[i.imm] = int(from.floats[0]);
    for (const Instr& i : m_stage.instrs)
        if (const auto it = loops.find(i.imm); i.op == Op::Load && it != loops.end())
            m_colored.insert(it->second);
}

// A kernel in a loop that leaves Cl out, as cel shaders do: the light is meant.
static Closure whole(Closure kernel) {
    switch (kernel) {
    case Closure::CosineKernel:
        return Closure::Diffuse;
    case Closure::CosineBehind:
        return Closure::DiffuseBehind;
    case Closure::SpecularKernel:
        return Closure::Specular;
    case Closure::PhongKernel:
        return Closure::Phong;
    default:
        return kernel;
    }
}

void Extraction::find_sites(Block& b) {
    for (Item& item : b.items) {
        if (item.kind == Item::Instruction) {
            Instr& i = m_stage.instrs[size_t(item.ref)];
            if (i.op == Op::Closure) {
                check_arguments(i);
                m_site_of[item.ref] = int(m_sites.size());
                Site s{Closure(i.imm), i.loc};
                if (is_fresnel(s.kind) || s.kind == Closure::LightSample)
                    s.reference = int(i.floats[0]);
                else if (in_loop(s.kind))
                    s.loop = int(i.floats[0]);
                if (s.loop >= 0 && !m_colored.count(s.loop))
                    s.kind = whole(s.kind);
                m_sites.push_back(s);
            }
        }
        m_loops += item.kind == Item::Loop;
        if (item.body)
            find_sites(*item.body);
        if (item.orelse)
            find_sites(*item.orelse);
        m_loops -= item.kind == Item::Loop;
    }
}

// What is stored, asked or has an effect, and what that is made of. A kernel that was read as a whole leaves
// its parts behind.
void Extraction::find_used() {
    m_used.assign(m_stage.instrs.size(), false);
    std::vector<Ref> work;
    const auto roots = [&](auto& again, const Block& b) -> void {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                const Instr& i = m_stage.instrs[size_t(item.ref)];
                if (i.op == Op::Store || i.op == Op::StoreElement || i.op == Op::Call)
                    work.push_back(item.ref);
            } else if (item.kind == Item::If) {
                work.push_back(item.ref);
            } else if (item.kind == Item::Scope && item.light != None) {
                work.push_back(item.light);
            }
            if (item.body)
                again(again, *item.body);
            if (item.orelse)
                again(again, *item.orelse);
        }
    };
    roots(roots, *m_stage.root);
    while (!work.empty()) {
        const Ref r = work.back();
        work.pop_back();
        if (m_used[size_t(r)])
            continue;
        m_used[size_t(r)] = true;
        for (const Ref a : m_stage.instrs[size_t(r)].args)
            work.push_back(a);
    }
}

void Extraction::check_arguments(Instr& i) {
    const Closure kind = Closure(i.imm);
    const bool mirror =
        kind == Closure::Mirror || kind == Closure::Environment || kind == Closure::Refraction;
    if (kind == Closure::Mirror && m_loops == 0 && m_aims < MostAims &&
        !m_directions.refs[size_t(i.args[0])]) {
        i.imm = int(Closure::Aimed);
        m_aims++;
        return;
    }
    if (mirror && !m_directions.refs[size_t(i.args[0])]) {
        complain(i.loc, "light is traced along mirrored or refracted view directions, and along few others "
                        "that no loop makes: found one more that does not depend on I. Taken as diffuse()");
        i.imm = int(Closure::Diffuse);
        i.args.clear();
        return;
    }
    if (!mirror && kind != Closure::PhongKernel && !i.args.empty() && m_directions.refs[size_t(i.args[0])])
        complain(i.loc, "the normal of this lobe depends on the viewing direction I, which is not known: "
                        "shading runs before rays; use N or faceforward(N, I). Taken as seen from the "
                        "dicing camera");
    for (size_t k = 2; k < i.args.size(); k++)
        if (m_directions.refs[size_t(i.args[k])])
            complain(i.loc, "the roughness of this lobe depends on the viewing direction I, which is not "
                            "known: shading runs before rays. Taken as seen from the dicing camera");
}

Contents Extraction::contents(Ref r) {
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

Contents Extraction::arguments(const Instr& i) {
    Contents c;
    for (Ref a : i.args)
        c.merge(contents(a));
    return c;
}

// The site of a product, made at its first use; -1 = these do not make a term.
int Extraction::product(int a, int b) {
    if (a > b)
        std::swap(a, b);
    const auto [it, fresh] = m_products.try_emplace({a, b}, -1);
    if (!fresh)
        return it->second;
    const Site &x = m_sites[size_t(a)], &y = m_sites[size_t(b)];
    const Closure kind = product_kind(x.kind, y.kind);
    if (kind == Closure::LightDirection || (in_loop(x.kind) && x.loop != y.loop))
        return -1;
    Site s{kind, x.loc};
    s.first = a;
    s.second = b;
    s.reference = std::max(x.reference, y.reference);
    m_sites.push_back(s);
    return it->second = int(m_sites.size()) - 1;
}

// The site that light goes to when it cannot be told which it is: a Lambert lobe's, if there is one.
int Extraction::carrier(const Contents& c) const {
    int best = -1;
    for (int s : c.sites)
        if (const Closure k = m_sites[size_t(s)].kind;
            is_light(k) && (best < 0 || (is_lambert(k) && !is_lambert(m_sites[size_t(best)].kind))))
            best = s;
    return best;
}

// ---- what light flows into

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

std::map<int, Loc> extract_closures(Program& program, Diagnostics& diagnostics, bool strict) {
    if (program.Ci < 0 || !program.shade.root)
        return {};
    choose_pictures(program.shade, strict);
    rename_assignments(program);
    return Extraction(program, diagnostics, strict).run();
}

} // namespace kanuka::sl::ir
