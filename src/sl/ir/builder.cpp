#include "sl/ir/builder.h"

#include <cmath>

namespace kanuka::sl::ir {

Ref Builder::push(Instr instr) {
    if (m_place)
        instr.loc = *m_place;
    m_stage->instrs.push_back(std::move(instr));
    return Ref(m_stage->instrs.size() - 1);
}

Ref Builder::constant(std::vector<float> floats, Ty ty) {
    Instr i{Op::Const, ty};
    i.floats = std::move(floats);
    return push(std::move(i));
}

Ref Builder::text(std::string s) {
    Instr i{Op::Text, Ty::String};
    i.text = std::move(s);
    return push(std::move(i));
}

Ref Builder::leaf(Op op, Ty ty, int imm) {
    Instr i{op, ty};
    i.imm = imm;
    return push(std::move(i));
}

bool Builder::is_const(Ref r, float x) const {
    if (!is_const(r))
        return false;
    for (float f : at(r).floats)
        if (f != x)
            return false;
    return true;
}

int Builder::var(std::string name, Ty ty, Loc loc, int array) {
    Var v;
    v.name = std::move(name);
    v.ty = ty;
    v.loc = loc;
    v.array = array;
    m_stage->vars.push_back(std::move(v));
    return int(m_stage->vars.size() - 1);
}

Item& Builder::item(Item item) {
    if (m_place)
        item.loc = *m_place;
    m_block->items.push_back(item);
    return m_block->items.back();
}

void Builder::declare(int var) {
    Item i{Item::Declare};
    i.target = var;
    item(i);
}

Ref Builder::call(CallSite site, Ty ty) {
    if (m_place)
        site.loc = *m_place;
    Instr i{Op::Call, ty};
    i.imm = int(m_stage->calls.size());
    i.loc = site.loc;
    i.args = site.args;
    const Ref r = push(std::move(i));
    site.result = r;
    m_stage->calls.push_back(std::move(site));
    item({Item::Instruction, r});
    return r;
}

Ref Builder::emit(Op op, Ty ty, std::vector<Ref> args, Loc loc, int imm) {
    if (const Ref folded = fold(op, ty, args, imm); folded != None)
        return folded;
    Instr i{op, ty};
    i.imm = imm;
    i.loc = loc;
    i.args = std::move(args);
    const Ref r = push(std::move(i));
    item({Item::Instruction, r});
    return r;
}

static float apply(Op op, float a, float b) {
    switch (op) {
    case Op::Add:
        return a + b;
    case Op::Sub:
        return a - b;
    case Op::Mul:
        return a * b;
    case Op::Div:
        return a / b;
    case Op::Min:
        return b < a ? b : a;
    case Op::Max:
        return b > a ? b : a;
    case Op::Lt:
        return a < b;
    case Op::Le:
        return a <= b;
    case Op::Gt:
        return a > b;
    case Op::Ge:
        return a >= b;
    case Op::Eq:
        return a == b;
    case Op::Ne:
        return a != b;
    case Op::And:
        return a != 0 && b != 0;
    case Op::Or:
        return a != 0 || b != 0;
    case Op::Neg:
        return -a;
    case Op::Abs:
        return std::fabs(a);
    case Op::Floor:
        return std::floor(a);
    case Op::Ceil:
        return std::ceil(a);
    case Op::Sqrt:
        return a > 0 ? std::sqrt(a) : 0;
    case Op::Not:
        return a == 0;
    default:
        return a;
    }
}

// Arithmetic and comparisons of two operands.
Ref Builder::fold_binary(Op op, Ty ty, Ref a, Ref b) {
    if (is_const(a) && is_const(b)) {
        std::vector<float> f(at(a).floats.size());
        for (size_t i = 0; i < f.size(); i++)
            f[i] = apply(op, at(a).floats[i], at(b).floats[i]);
        return constant(std::move(f), ty);
    }
    // Identities that hold for every float, NaN included.
    if (op == Op::Mul && is_const(b, 1))
        return a;
    if (op == Op::Mul && is_const(a, 1))
        return b;
    if (op == Op::Div && is_const(b, 1))
        return a;
    if ((op == Op::Add || op == Op::Sub) && is_const(b, 0))
        return a;
    if (op == Op::Add && is_const(a, 0))
        return b;
    if (op == Op::And && is_const(a))
        return at(a).floats[0] != 0 ? b : a;
    if (op == Op::Or && is_const(a))
        return at(a).floats[0] != 0 ? a : b;
    return None;
}

Ref Builder::fold(Op op, Ty ty, const std::vector<Ref>& args, int imm) {
    bool all = !args.empty();
    for (Ref a : args)
        all = all && is_const(a);
    switch (op) {
    case Op::Add:
    case Op::Sub:
    case Op::Mul:
    case Op::Div:
    case Op::Min:
    case Op::Max:
    case Op::Lt:
    case Op::Le:
    case Op::Gt:
    case Op::Ge:
    case Op::Eq:
    case Op::Ne:
    case Op::And:
    case Op::Or:
        return fold_binary(op, ty, args[0], args[1]);
    case Op::Neg:
    case Op::Abs:
    case Op::Floor:
    case Op::Ceil:
    case Op::Sqrt:
    case Op::Not:
        if (all) {
            std::vector<float> f = at(args[0]).floats;
            for (float& x : f)
                x = apply(op, x, 0);
            return constant(std::move(f), ty);
        }
        return None;
    case Op::SameText:
        if (at(args[0]).op == Op::Text && at(args[1]).op == Op::Text)
            return boolean(at(args[0]).text == at(args[1]).text);
        return None;
    case Op::Splat:
        return all ? triple(at(args[0]).floats[0]) : None;
    case Op::ToFloat:
        return all ? constant(at(args[0]).floats[0]) : None;
    case Op::Make:
        if (all) {
            std::vector<float> f;
            for (Ref a : args)
                f.push_back(at(a).floats[0]);
            return constant(std::move(f), ty);
        }
        return None;
    case Op::Extract:
        if (all)
            return constant(at(args[0]).floats[imm]);
        if (at(args[0]).op == Op::Make)
            return at(args[0]).args[imm];
        if (at(args[0]).op == Op::Splat)
            return at(args[0]).args[0];
        return None;
    case Op::Select:
        return is_const(args[0]) ? (at(args[0]).floats[0] != 0 ? args[1] : args[2]) : None;
    default:
        return None;
    }
}

} // namespace kanuka::sl::ir
