#include "sl/ir/ir.h"

#include <cstdio>
#include <unordered_map>

namespace kanuka::sl::ir {

int comps(Ty ty) {
    switch (ty) {
    case Ty::Void:
        return 0;
    case Ty::Triple:
        return 3;
    case Ty::Matrix:
        return 16;
    default:
        return 1;
    }
}

const InputInfo& input_info(Input input) {
    static constexpr InputInfo Table[] = {
        {"P", Ty::Triple, true, false},    {"N", Ty::Triple, true, false},    {"Ng", Ty::Triple, true, false},
        {"dPdu", Ty::Triple, true, false}, {"dPdv", Ty::Triple, true, false}, {"u", Ty::Float, true, false},
        {"v", Ty::Float, true, false},     {"s", Ty::Float, true, false},     {"t", Ty::Float, true, false},
        {"Cs", Ty::Triple, false, true},   {"Os", Ty::Triple, false, true},   {"E", Ty::Triple, false, false},
        {"time", Ty::Float, false, false}, {"du", Ty::Float, false, false},   {"dv", Ty::Float, false, false},
    };
    static_assert(std::size(Table) == size_t(Input::Count));
    return Table[int(input)];
}

Stage& Stage::operator=(const Stage& other) {
    if (this == &other)
        return *this;
    name = other.name;
    instrs = other.instrs;
    vars = other.vars;
    calls = other.calls;
    outputs = other.outputs;
    faults = other.faults;
    targets = other.targets;
    reads = other.reads;
    blocks.clear();
    std::unordered_map<const Block*, Block*> copies;
    for (const Block& b : other.blocks)
        copies[&b] = &blocks.emplace_back(b);
    for (Block& b : blocks)
        for (Item& i : b.items) {
            i.body = i.body ? copies[i.body] : nullptr;
            i.orelse = i.orelse ? copies[i.orelse] : nullptr;
        }
    root = other.root ? copies[other.root] : nullptr;
    return *this;
}

const char* op_name(Op op) {
    static constexpr const char* Names[] = {
        "const",       "text",         "input",    "param",  "member", "channel",  "load",  "store",
        "loadelement", "storeelement", "add",      "sub",    "mul",    "div",      "neg",   "min",
        "max",         "abs",          "floor",    "ceil",   "sqrt",   "math1",    "math2", "lt",
        "le",          "gt",           "ge",       "eq",     "ne",     "sametext", "and",   "or",
        "not",         "select",       "tofloat",  "splat",  "make",   "extract",  "dot",   "cross",
        "matmul",      "noise",        "alllanes", "tomask", "tobool", "andnot",   "call",  "closure"};
    static_assert(std::size(Names) == size_t(Op::Closure) + 1);
    return Names[int(op)];
}

static void dump_block(const Stage& s, const Block& b, int indent, std::string& out) {
    const std::string pad(size_t(indent) * 2, ' ');
    const auto operand = [&](Ref r) {
        const Instr& i = s.instrs[r];
        if (i.op == Op::Const) {
            char text[32];
            std::snprintf(text, sizeof text, "%g", double(i.floats[0]));
            return std::string(text);
        }
        if (i.op == Op::Text)
            return "\"" + i.text + "\"";
        if (i.op == Op::Input && i.imm < int(Input::Count))
            return std::string(input_info(Input(i.imm)).name);
        if (i.op == Op::Param)
            return "param" + std::to_string(i.imm);
        return "%" + std::to_string(r);
    };
    for (const Item& item : b.items) {
        out += pad;
        switch (item.kind) {
        case Item::Instruction: {
            const Instr& i = s.instrs[item.ref];
            if (i.ty != Ty::Void)
                out += "%" + std::to_string(item.ref) + " = ";
            out += i.varying ? "varying " : "";
            out += op_name(i.op);
            if (i.op == Op::Load || i.op == Op::Store || i.op == Op::LoadElement || i.op == Op::StoreElement)
                out += " " + s.vars[i.imm].name + "." + std::to_string(i.imm);
            else if (i.imm)
                out += "#" + std::to_string(i.imm);
            for (Ref a : i.args)
                out += " " + operand(a);
            out += "\n";
            break;
        }
        case Item::If:
            out += "if " + operand(item.ref) + "\n";
            break;
        case Item::Loop:
            out += item.masked ? "loop masked\n" : "loop\n";
            break;
        case Item::Scope:
            out += "scope " + std::to_string(item.target) + (item.masked ? " masked\n" : "\n");
            break;
        case Item::Jump:
            out += "jump " + std::to_string(item.target) + "\n";
            break;
        case Item::Declare:
            out += "declare " + s.vars[item.target].name + "." + std::to_string(item.target) + "\n";
            break;
        case Item::Guard:
            out += "guard ." + std::to_string(item.target) + "\n";
            break;
        case Item::LeaveLoop:
            out += "leave ." + std::to_string(item.target) + "\n";
            break;
        }
        if (item.body)
            dump_block(s, *item.body, indent + 1, out);
        if (item.orelse && !item.orelse->items.empty()) {
            out += pad + "else\n";
            dump_block(s, *item.orelse, indent + 1, out);
        }
    }
}

std::string dump(const Stage& stage) {
    std::string out = stage.name + "\n";
    if (stage.root)
        dump_block(stage, *stage.root, 1, out);
    return out;
}

} // namespace kanuka::sl::ir
