// The terms of light that a classic surface has: the first part of extraction.h.
#include <algorithm>

#include "sl/ir/extraction.h"
#include "sl/ir/plan.h"

namespace kanuka::sl::ir {

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

} // namespace kanuka::sl::ir
