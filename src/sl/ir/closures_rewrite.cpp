// Computing with bundles of light: the third part of extraction.h.
#include "sl/ir/extraction.h"

namespace kanuka::sl::ir {

// Does the value come from more than N and its like: from a bump?
bool Extraction::is_bump(Ref r, std::set<Ref>& seen) {
    if (!seen.insert(r).second)
        return false;
    const Instr& i = m_stage.instrs[size_t(r)];
    if (i.op == Op::Noise || (i.op == Op::Call && m_stage.calls[size_t(i.imm)].kind != CallKind::SpaceMatrix))
        return true;
    for (Ref a : i.args)
        if (is_bump(a, seen))
            return true;
    if (i.op == Op::Load || i.op == Op::LoadElement)
        for (auto [it, end] = m_stores.equal_range(i.imm); it != end; ++it)
            if (is_bump(it->second, seen))
                return true;
    return false;
}

// Lobes have one normal, the surface's. A shader that leaves N alone and gives a bumped normal to its lobes
// means that one: diffuse()'s, if they differ.
void Extraction::find_normals() {
    for (const Output& o : m_stage.outputs)
        if (o.kind == Output::Normal)
            return;
    const auto index = [&](auto& again, const Block& b) -> void {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction)
                if (const Instr& i = m_stage.instrs[size_t(item.ref)];
                    i.op == Op::Store || i.op == Op::StoreElement)
                    m_stores.emplace(i.imm, i.args.back());
            if (item.body)
                again(again, *item.body);
            if (item.orelse)
                again(again, *item.orelse);
        }
    };
    index(index, *m_stage.root);
    bool lambert = false;
    for (const auto& [ref, site] : m_site_of) {
        const Instr& i = m_stage.instrs[size_t(ref)];
        const Closure kind = m_sites[size_t(site)].kind;
        const bool diffuse = kind == Closure::Diffuse || kind == Closure::CosineKernel;
        const bool glossy =
            kind == Closure::Specular || kind == Closure::Phong || kind == Closure::SpecularKernel;
        if ((!diffuse && !glossy) || i.args.empty() || (lambert && !diffuse) ||
            m_directions.refs[size_t(i.args[0])])
            continue;
        std::set<Ref> seen;
        if (!is_bump(i.args[0], seen))
            continue;
        if (diffuse && !lambert)
            m_normals.clear();
        lambert = lambert || diffuse;
        m_normals.insert(ref);
    }
    if (m_normals.empty())
        return;
    m_normal = m_b.var("normal", Ty::Triple, {});
    m_new_vars.push_back(m_normal);
}

void Extraction::make_variables() {
    const size_t count = m_vars.size();
    m_parts.resize(count);
    for (size_t v = 0; v < count; v++)
        for (int s : m_vars[v].sites) {
            const Var old = m_stage.vars[v];
            m_parts[v][s] = m_b.var(old.name + "'" + std::to_string(s), old.ty, old.loc, old.array);
        }
    for (const auto& [ref, site] : m_site_of)
        if (m_stage.instrs[size_t(ref)].args.size() > 4)
            for (int Site::* const slot : {&Site::anisotropy, &Site::rotation}) {
                m_new_vars.push_back(m_sites[size_t(site)].*slot = m_b.var("grooves", Ty::Float, {}));
            }
    for (Site& s : m_sites) {
        if (s.first >= 0) { // products come after their factors
            for (int f : {s.first, s.second}) {
                s.anisotropy = std::max(s.anisotropy, m_sites[size_t(f)].anisotropy);
                s.rotation = std::max(s.rotation, m_sites[size_t(f)].rotation);
                s.shape = std::max(s.shape, m_sites[size_t(f)].shape);
                s.eta = std::max(s.eta, m_sites[size_t(f)].eta);
            }
            continue;
        }
        if (s.kind == Closure::Aimed)
            m_new_vars.push_back(s.aim = m_b.var("aim", Ty::Triple, s.loc));
        int* const slot = has_shape(s.kind) ? &s.shape : is_fresnel(s.kind) ? &s.eta : nullptr;
        if (slot) {
            *slot = m_b.var("shape", Ty::Float, s.loc);
            m_new_vars.push_back(*slot);
        }
    }
}

// ---- values

Bundle Extraction::bundle(Ref r) {
    if (const auto it = m_bundles.find(r); it != m_bundles.end())
        return it->second;
    Bundle b;
    if (contents(r).plain)
        b[Plain] = r;
    return b;
}

Ref Extraction::reference(int site, Ty ty, Loc at) {
    const int var = m_sites[size_t(site)].reference;
    if (var < 0)
        return zero_of(ty, 1);
    const Ref r = m_b.load(var, at);
    return ty == Ty::Float ? r : m_b.splat(r, at);
}

// What a value is without light, or where all light is one. fresnel() is what the dicing camera sees in both.
Ref Extraction::value(Ref r, bool lit) {
    const auto it = m_bundles.find(r);
    if (it == m_bundles.end())
        return r;
    const Bundle b = it->second;
    const Instr made = m_stage.instrs[size_t(r)];
    if (made.ty == Ty::Bool)
        return b.at(lit ? AtFullLight : Plain);
    Ref sum = b.count(Plain) ? b.at(Plain) : zero_of(made.ty);
    for (const auto& [site, w] : b) {
        if (site < 0 || (!lit && !is_fresnel(m_sites[size_t(site)].kind)))
            continue;
        const Ref part = m_b.emit(Op::Mul, made.ty, {w, reference(site, made.ty, made.loc)}, made.loc);
        sum = m_b.emit(Op::Add, made.ty, {sum, part}, made.loc);
    }
    return sum;
}

// Without light there are divisions by zero and powers of zero: nothing, then.
Ref Extraction::finite(Ref r, Loc at) {
    if (m_b.at(r).ty == Ty::Triple) {
        std::vector<Ref> parts;
        for (int c = 0; c < 3; c++)
            parts.push_back(finite(m_b.emit(Op::Extract, Ty::Float, {r}, at, c), at));
        return m_b.emit(Op::Make, Ty::Triple, std::move(parts), at);
    }
    const Ref size = m_b.emit(Op::Abs, Ty::Float, {r}, at);
    const Ref good = m_b.emit(Op::Lt, Ty::Bool, {size, m_b.constant(1e18f)}, at);
    return m_b.emit(Op::Select, Ty::Float, {good, r, m_b.constant(0.0f)}, at);
}

// ---- blocks and instructions

void Extraction::rewrite(const Block& b) {
    for (const Item& old_item : b.items) {
        Item item = old_item;
        if (item.kind == Item::Instruction) {
            instruction(item);
            continue;
        }
        const bool entered = enter(item);
        if (item.kind == Item::If)
            item.ref = value(item.ref, true);
        m_b.item(item);
        if (item.kind == Item::Declare) {
            m_declared[size_t(item.target)] = int(m_contexts.size());
            for (const auto& [site, part] : m_parts[size_t(item.target)])
                m_b.declare(part);
        }
        m_loops += item.kind == Item::Loop;
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
        m_loops -= item.kind == Item::Loop;
        if (entered)
            m_contexts.pop_back();
    }
}

// An instruction that is plain, though its arguments are not: as it is at full light.
void Extraction::replace_arguments(Ref r) {
    std::vector<Ref> args = m_stage.instrs[size_t(r)].args;
    for (Ref& a : args)
        a = value(a, true);
    Instr& i = m_stage.instrs[size_t(r)];
    i.args = args;
    if (i.op == Op::Call)
        m_stage.calls[size_t(i.imm)].args = args;
}

void Extraction::store(const Instr& i) {
    const bool element = i.op == Op::StoreElement;
    const Ref given = i.args[element ? 1 : 0];
    const Ty ty = m_stage.vars[size_t(i.imm)].ty;
    const std::map<int, int>& parts = m_parts[size_t(i.imm)];
    const auto put = [&](int var, Ref r) {
        if (!element)
            return m_b.store(var, r, i.loc);
        const Ref made = m_b.emit(Op::StoreElement, Ty::Void, {value(i.args[0], true), r}, i.loc, var);
        m_stage.instrs[size_t(made)].floats = i.floats;
    };
    if (m_plain_only[size_t(i.imm)] || parts.empty())
        return put(i.imm, value(given, true));
    Bundle b = bundle(given);
    if (const Context* context = context_of(i.imm); context && b.count(Plain)) {
        const bool sum = !element && accumulates(i, *context);
        if (sum || !context->loop) {
            Ref more = b[Plain];
            b.erase(Plain);
            if (sum && m_vars[size_t(i.imm)].plain) {
                b[Plain] = m_b.load(i.imm, i.loc);
                more = m_b.emit(Op::Sub, ty, {more, b[Plain]}, i.loc);
            }
            const Ref w =
                finite(m_b.emit(Op::Div, ty, {more, reference(context->carrier, ty, i.loc)}, i.loc), i.loc);
            const auto it = b.find(context->carrier);
            b[context->carrier] = it == b.end() ? w : m_b.emit(Op::Add, ty, {it->second, w}, i.loc);
        }
    }
    const auto part = [&](int site) {
        const auto it = b.find(site);
        return it == b.end() ? zero_of(ty) : it->second;
    };
    std::vector<std::pair<int, Ref>> values;
    for (const auto& [site, var] : parts)
        values.emplace_back(var, part(site));
    values.emplace_back(i.imm, part(Plain));
    for (const auto& [var, r] : values)
        put(var, r);
}

// A term's own value is one; what its lobe needs beside its weight goes to the variables of the site.
Bundle Extraction::term(Ref r, const Instr& i) {
    const Loc at = i.loc;
    const int s = m_site_of[r];
    Bundle out;
    out[s] = zero_of(i.ty, 1);
    if (m_normals.count(r)) {
        const Ref n = value(i.args[0], true);
        const Ref square = m_b.emit(Op::Dot, Ty::Float, {n, n}, at);
        const Ref some = m_b.emit(Op::Gt, Ty::Bool, {square, m_b.constant(0.0f)}, at);
        const Ref given = m_b.leaf(Op::Input, Ty::Triple, int(Input::N));
        m_b.store(m_normal, m_b.emit(Op::Select, Ty::Triple, {some, n, given}, at), at);
    }
    const Site& site = m_sites[size_t(s)];
    if (site.shape >= 0 || site.eta >= 0)
        m_b.store(site.shape >= 0 ? site.shape : site.eta, value(i.args[2], true), at);
    if (site.aim >= 0)
        m_b.store(site.aim, value(i.args[0], true), at);
    if (site.anisotropy >= 0) {
        m_b.store(site.anisotropy, value(i.args[3], true), at);
        m_b.store(site.rotation, value(i.args[4], true), at);
    }
    return out;
}

Bundle Extraction::load(const Instr& i) {
    const auto get = [&](int var) {
        if (i.op == Op::Load)
            return m_b.load(var, i.loc);
        const Ref r = m_b.emit(Op::LoadElement, i.ty, {value(i.args[0], true)}, i.loc, var);
        m_stage.instrs[size_t(r)].floats = i.floats;
        return r;
    };
    Bundle out;
    for (const auto& [site, var] : m_parts[size_t(i.imm)])
        out[site] = get(var);
    if (m_vars[size_t(i.imm)].plain)
        out[Plain] = get(i.imm);
    return out;
}

void Extraction::instruction(const Item& item) {
    const Instr i = m_stage.instrs[size_t(item.ref)];
    const Loc at = i.loc;
    if (!m_used[size_t(item.ref)])
        return;
    if (i.op == Op::Store || i.op == Op::StoreElement)
        return store(i);
    if (skips_little(i)) {
        const Ref yes = m_b.boolean(true);
        m_bundles[item.ref] = {{Plain, yes}, {AtFullLight, yes}};
        return;
    }
    if (m_refs[size_t(item.ref)].sites.empty()) {
        replace_arguments(item.ref);
        m_b.item(item);
        return;
    }
    Bundle out;
    switch (i.op) {
    case Op::Closure:
        out = term(item.ref, i);
        break;
    case Op::Load:
    case Op::LoadElement:
        out = load(i);
        break;
    case Op::Splat:
    case Op::Neg:
    case Op::Extract:
        for (const auto& [k, w] : bundle(i.args[0]))
            out[k] = m_b.emit(i.op, i.ty, {w}, at, i.imm);
        break;
    case Op::Make:
        out = make(i);
        break;
    case Op::Add:
    case Op::Sub:
        out = sum(i);
        break;
    case Op::Mul:
    case Op::Div:
    case Op::Dot:
        out = multiply(i);
        break;
    case Op::Select:
        out = select(i);
        break;
    case Op::Call: {
        // A picture looked up by light.
        replace_arguments(item.ref);
        m_b.item(item);
        const int site = m_refs[size_t(item.ref)].sites[0];
        out[site] = finite(m_b.emit(Op::Div, i.ty, {item.ref, reference(site, i.ty, at)}, at), at);
        break;
    }
    default:
        out = chord(i);
        break;
    }
    m_bundles[item.ref] = std::move(out);
}

} // namespace kanuka::sl::ir
