#include "sl/ir/surface_colors.h"

#include <utility>

namespace kanuka::sl::ir {

namespace {

// Values that a variable may come from, each once.
class Origins {
  public:
    Origins(const Stage& stage, int var)
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

bool is_grey(const Instr& i) {
    return i.floats.size() == 1 ||
           (i.floats.size() == 3 && i.floats[0] == i.floats[1] && i.floats[1] == i.floats[2]);
}

} // namespace

bool always_one(const Stage& stage, const Builder& builder, int var) {
    bool one = true, overwritten = false;
    const auto search = [&](auto& again, const Block& b) -> void {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                const Instr& i = stage.instrs[size_t(item.ref)];
                if (i.op == Op::Store && i.imm == var) {
                    const bool first =
                        builder.at(i.args[0]).op == Op::Input; // the initial Os, overwritten at the top level
                    one = one && (first || builder.is_const(i.args[0], 1));
                    overwritten = overwritten || (&b == stage.root && builder.is_const(i.args[0], 1));
                }
            }
            if (item.body)
                again(again, *item.body);
            if (item.orelse)
                again(again, *item.orelse);
        }
    };
    search(search, *stage.root);
    return one && overwritten;
}

bool follows_opacity(const Program& program) {
    Origins origins(program.shade, program.Oi);
    Ref at;
    while (const Instr* i = origins.next(at)) {
        if (i->op == Op::Input && Input(i->imm) == Input::Os)
            return true;
        origins.arguments(*i);
        if (i->op == Op::Load || i->op == Op::LoadElement)
            origins.stores(i->imm);
    }
    return false;
}

Grey greyness(const Program& program, const Builder& builder) {
    Grey grey = Grey::Always;
    Origins origins(program.shade, program.Oi);
    Ref r;
    while (const Instr* at = origins.next(r)) {
        const Instr& i = *at;
        if (i.ty != Ty::Triple)
            continue;
        if (i.op == Op::Const ? !builder.is_const(r, 0) && !builder.is_const(r, 1) && !is_grey(i)
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
            origins.stores(i.imm);
            break;
        case Op::Add:
        case Op::Sub:
        case Op::Mul:
        case Op::Div:
        case Op::Min:
        case Op::Max:
        case Op::Neg:
            origins.arguments(i);
            break;
        case Op::Select:
            origins.arguments(i, 1);
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

bool ends_plain(const Program& program, const Builder& builder) {
    const Stage& stage = program.shade;
    bool plain = true;
    for (const Item& item : stage.root->items) {
        if (item.kind != Item::Instruction)
            continue;
        const Instr& i = stage.instrs[size_t(item.ref)];
        if (i.op == Op::Store && i.imm == program.Ci)
            plain = !builder.is_const(i.args[0], 0);
    }
    if (plain)
        return true;
    // A zero at the top level, then perhaps something within an if.
    bool zero_seen = false, more = false;
    const auto search = [&](auto& again, const Block& b, bool top) -> void {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                const Instr& i = stage.instrs[size_t(item.ref)];
                if (i.op == Op::Store && i.imm == program.Ci) {
                    const bool zero = builder.is_const(i.args[0], 0);
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
    search(search, *stage.root, true);
    return !zero_seen || more;
}

} // namespace kanuka::sl::ir
