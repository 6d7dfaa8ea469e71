#include "sl/ir/lower/members.h"

#include <algorithm>

namespace kanuka::sl::ir {

using namespace ast;

void MemberLowerer::declare() {
    // Structs are their members.
    std::vector<const VarDecl*> all;
    const auto flatten = [&](auto& again, const VarDecl* v) -> void {
        if (v->fields.empty())
            all.push_back(v);
        for (const VarDecl* f : v->fields)
            again(again, f);
    };
    for (const VarDecl* v : m_context.shader.members)
        flatten(flatten, v);
    for (const VarDecl* v : all) {
        if (v->type.handle() || v->type.base == Base::Lobe)
            continue;
        m_index[v] = int(m_program.members.size());
        Place place;
        place.text = ty(v->type) == Ty::String;
        place.count = comps(ty(v->type)) * (v->type.array ? std::max(1, v->type.size) : 1);
        int& size = place.text ? m_program.member_strings : m_program.member_floats;
        place.offset = size;
        size += place.count;
        m_program.members.push_back(place);
    }
}

Ref MemberLowerer::initial_value(const VarDecl* v) {
    const auto it = m_index.find(v);
    return it == m_index.end() ? ir::None : m_b.leaf(Op::Member, ty(v->type), it->second);
}

void MemberLowerer::keep(Stage& init) {
    const size_t first = init.outputs.size();
    for (const auto& [v, index] : m_index)
        if (!v->type.array && m_state.bindings[v].kind == Binding::Variable)
            init.outputs.push_back({Output::Member, m_state.bindings[v].var, index});
    std::ranges::sort(init.outputs.begin() + ptrdiff_t(first), init.outputs.end(), {},
                      &Output::index); // not as declarations lie in memory
}

void MemberLowerer::leave() {
    for (const auto* list : {&m_context.shader.members, &m_context.shader.parameters})
        for (const VarDecl* v : *list)
            leave(v);
}

void MemberLowerer::leave(const VarDecl* v) {
    for (const VarDecl* f : v->fields)
        leave(f);
    const auto bound = m_state.bindings.find(v);
    const bool own = m_index.contains(v) || (v->kind == VarDecl::Parameter && v->output);
    if (!v->fields.empty() || !own || bound == m_state.bindings.end() ||
        bound->second.kind != Binding::Variable)
        return;
    int stores = 0; // the first one is its coming to life
    for (const Instr& i : m_b.stage().instrs)
        stores += (i.op == Op::Store || i.op == Op::StoreElement) && i.imm == bound->second.var;
    if (stores < 2 || v->type.array || ty(v->type) == Ty::String || v->detail == Detail::Uniform)
        return;
    Parameter p;
    p.name = "displaced." + std::string(v->name);
    p.type = ty(v->type) == Ty::Matrix   ? sl::Type::Matrix
             : ty(v->type) == Ty::Triple ? sl::Type::Vector
                                         : sl::Type::Float;
    p.varying = true;
    Place place;
    place.count = comps(ty(v->type));
    place.varying = true;
    place.offset = m_program.floats;
    m_program.floats += place.count;
    p.floats.resize(size_t(place.count));
    m_carried.emplace_back(v, int(m_program.parameters.size()));
    m_b.stage().outputs.push_back({Output::Carried, bound->second.var, int(m_program.parameters.size())});
    m_program.parameters.push_back(std::move(p));
    m_program.places.push_back(place);
    m_program.carried++;
}

void MemberLowerer::take() {
    for (const auto& [v, index] : m_carried)
        store_tagged(bind(v).var, m_b.leaf(Op::Param, ty(v->type), index), v->loc);
}

// What the surface does not read is not kept.
void MemberLowerer::drop_unread() {
    std::erase_if(m_program.displace.outputs, [&](const Output& o) {
        if (o.kind != Output::Carried)
            return false;
        const auto carried = std::find_if(m_carried.begin(), m_carried.end(),
                                          [&](const auto& c) { return c.second == o.index; });
        const int var = m_state.bindings[carried->first].var;
        return std::ranges::none_of(m_program.shade.instrs,
                                    [&](const Instr& i) { return i.op == Op::Load && i.imm == var; }) &&
               std::ranges::none_of(m_program.shade.outputs, [&](const Output& s) { return s.var == var; });
    });
}

} // namespace kanuka::sl::ir
