// Members and output parameters of a class between its stages.
#include <algorithm>

#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

// RSL 2.0 runs begin(), displacement() and surface() once each, one after the other, on one set of members.
// Here displacement and surface are stages of their own, and begin() runs in both, for what it does besides;
// what displacement leaves in a member or an output parameter travels on the grid, one value a vertex, under
// a name that no source can say. Arrays, strings and members declared uniform do not travel.
void Lower::leave_members() {
    const auto leave = [&](auto& again, const VarDecl* v) -> void {
        for (const VarDecl* f : v->fields)
            again(again, f);
        const auto bound = m_bind.find(v);
        const bool own = m_member_index.contains(v) || (v->kind == VarDecl::Parameter && v->output);
        if (!v->fields.empty() || !own || bound == m_bind.end() || bound->second.kind != Binding::Variable)
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
    };
    for (const auto* list : {&m_shader.members, &m_shader.parameters})
        for (const VarDecl* v : *list)
            leave(leave, v);
}

void Lower::take_members() {
    for (const auto& [v, index] : m_carried)
        store_tagged(bind(v).var, m_b.leaf(Op::Param, ty(v->type), index), v->loc);
}

// What the surface does not read is not kept.
void Lower::drop_unread_members() {
    std::erase_if(m_program.displace.outputs, [&](const Output& o) {
        if (o.kind != Output::Carried)
            return false;
        const auto carried = std::find_if(m_carried.begin(), m_carried.end(),
                                          [&](const auto& c) { return c.second == o.index; });
        const int var = m_bind[carried->first].var;
        return std::ranges::none_of(m_program.shade.instrs,
                                    [&](const Instr& i) { return i.op == Op::Load && i.imm == var; }) &&
               std::ranges::none_of(m_program.shade.outputs, [&](const Output& s) { return s.var == var; });
    });
}

} // namespace kanuka::sl::ir
