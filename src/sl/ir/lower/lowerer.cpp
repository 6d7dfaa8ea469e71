#include "sl/ir/lower/lowerer.h"

#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

Ty ty(const ast::Type& t) {
    switch (t.base) {
    case Base::Void:
        return Ty::Void;
    case Base::Bool:
        return Ty::Bool;
    case Base::Float:
        return Ty::Float;
    case Base::Matrix:
        return Ty::Matrix;
    case Base::String:
    case Base::Shader: // its handle
        return Ty::String;
    case Base::Color:
    case Base::Point:
    case Base::Vector:
    case Base::Normal:
        return Ty::Triple;
    default:
        return Ty::Void;
    }
}

static bool contains(const Stmt* s, StmtKind wanted) {
    if (!s)
        return false;
    if (s->kind == wanted)
        return true;
    for (const Stmt* b : s->block)
        if (contains(b, wanted))
            return true;
    return contains(s->body, wanted) || contains(s->orelse, wanted);
}

bool has_return(const Stmt* s) {
    return contains(s, StmtKind::Return);
}

Ref Lowerer::expr(const Expr* e) {
    return expressions().expr(e);
}

Ref Lowerer::expr_as(const Expr* e, const ast::Type& to) {
    return expressions().convert(expr(e), to, e->loc);
}

Binding& Lowerer::bind(const VarDecl* v) {
    return variables().binding(v);
}

Ref Lowerer::zero(Ty ty) {
    if (ty == Ty::String)
        return m_b.text("");
    return m_b.constant(std::vector<float>(size_t(comps(ty)), 0.0f), ty);
}

int Lowerer::fault(Loc at, std::string what) {
    m_b.stage().faults.emplace_back(at, std::move(what));
    return int(m_b.stage().faults.size() - 1);
}

Tag Lowerer::tag(Ref r) const {
    const auto it = m_state.tags.find(r);
    return it == m_state.tags.end() ? Tag::None : it->second;
}

Ref Lowerer::tagged(Ref r, Tag t) {
    if (t != Tag::None)
        m_state.tags[r] = t;
    return r;
}

void Lowerer::store_tagged(int var, Ref value, Loc at) {
    const Tag t = tag(value);
    if (t == Tag::None)
        m_state.var_tags.erase(var);
    else
        m_state.var_tags[var] = t;
    m_b.store(var, value, at);
}

Ref Lowerer::load_tagged(int var, Loc at) {
    const Ref r = m_b.load(var, at);
    const auto it = m_state.var_tags.find(var);
    return it == m_state.var_tags.end() ? r : tagged(r, it->second);
}

} // namespace kanuka::sl::ir
