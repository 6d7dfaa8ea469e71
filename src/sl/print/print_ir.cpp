#include <cstdio>

#include "sl/print/print.h"

namespace kanuka::sl {

using namespace ir;

namespace {

class IrPrinter {
  public:
    IrPrinter(const Program& program, const Stage& stage, const Plan& plan, const Sources& sources)
        : m_program(program), m_stage(stage), m_plan(plan), m_sources(sources) {}

    std::string run() {
        m_out = "stage " + m_stage.name + ": " + std::to_string(m_plan.regions) +
                " regions; kept between them " + std::to_string(m_plan.arrays) + " arrays, " +
                std::to_string(m_plan.uniforms) + " uniform numbers, " + std::to_string(m_plan.texts) +
                " strings\n";
        block(*m_stage.root, 1);
        for (const Output& o : m_stage.outputs) {
            if (o.var >= 0)
                m_out += "  output " + output_name(m_program, o) + " = " + variable(o.var) + "\n";
        }
        return m_out;
    }

  private:
    std::string variable(int v) const {
        return (m_stage.vars[size_t(v)].varying ? "varying " : "uniform ") + m_stage.vars[size_t(v)].name +
               "." + std::to_string(v);
    }

    std::string operand(Ref r) const {
        const Instr& i = m_stage.instrs[size_t(r)];
        switch (i.op) {
        case Op::Const: {
            std::string all;
            for (const float x : i.floats) {
                char number[32];
                std::snprintf(number, sizeof number, "%g", double(x));
                all += (all.empty() ? "" : " ") + std::string(number);
            }
            return i.floats.size() > 1 ? "(" + all + ")" : all;
        }
        case Op::Text:
            return "\"" + i.text + "\"";
        case Op::Input:
            return std::string(input_info(Input(i.imm)).name);
        case Op::Param:
            return parameter_name(m_program, i);
        case Op::Member:
            return "member" + std::to_string(i.imm);
        case Op::Channel:
            return "given " + channel_name(m_program, i.imm);
        default:
            return "%" + std::to_string(r);
        }
    }

    std::string operation(const Instr& i) const {
        std::string s(op_name(i.op));
        const bool memory =
            i.op == Op::Load || i.op == Op::Store || i.op == Op::LoadElement || i.op == Op::StoreElement;
        if (memory)
            s += " " + m_stage.vars[size_t(i.imm)].name + "." + std::to_string(i.imm);
        else if (i.op == Op::Call)
            s = std::string(call_name(m_stage.calls[size_t(i.imm)].kind));
        else if (i.imm)
            s += "#" + std::to_string(i.imm);
        for (const Ref a : i.args)
            s += " " + operand(a);
        return s;
    }

    void line(int indent, const std::string& text) {
        m_out += std::string(size_t(indent) * 2, ' ') + text + "\n";
    }

    void place(int indent, Loc at) {
        if (at.line == 0 || (at.file == m_last.file && at.line == m_last.line))
            return;
        m_last = at;
        if (const std::string text = source_line(m_sources, at); !text.empty())
            line(indent, "; " + text);
    }

    void block(const Block& b, int indent) {
        for (const Item& i : b.items) {
            if (m_plan.first.count(&i))
                line(indent, "--- region");
            switch (i.kind) {
            case Item::Instruction: {
                const Instr& instr = m_stage.instrs[size_t(i.ref)];
                place(indent, instr.loc);
                static constexpr const char* Types[] = {"void",   "bool",   "float", "triple",
                                                        "matrix", "string", "mask"};
                std::string text = operation(instr);
                if (instr.ty != Ty::Void)
                    text = "%" + std::to_string(i.ref) + " = " + (instr.varying ? "varying " : "uniform ") +
                           Types[int(instr.ty)] + " " + text;
                else if (instr.varying)
                    text = "varying " + text;
                if (!instr.text.empty() && instr.op != Op::Text)
                    text += "   ; " + instr.text;
                line(indent, text);
                break;
            }
            case Item::If:
                line(indent, "if " + operand(i.ref));
                break;
            case Item::Loop:
                line(indent, i.masked ? "loop, lanes leave one by one" : "loop");
                break;
            case Item::Scope:
                line(indent,
                     "scope " + std::to_string(i.target) + (i.masked ? ", lanes leave one by one" : ""));
                break;
            case Item::Jump:
                line(indent, "leave scope " + std::to_string(i.target));
                break;
            case Item::Declare:
                line(indent, "declare " + variable(i.target));
                break;
            case Item::Guard:
                line(indent, "if any of " + variable(i.target));
                break;
            case Item::LeaveLoop:
                line(indent, "leave loop unless any of " + variable(i.target));
                break;
            }
            if (i.body)
                block(*i.body, indent + 1);
            if (i.orelse && !i.orelse->items.empty()) {
                line(indent, "else");
                block(*i.orelse, indent + 1);
            }
        }
    }

    const Program& m_program;
    const Stage& m_stage;
    const Plan& m_plan;
    const Sources& m_sources;
    std::string m_out;
    Loc m_last{};
};

} // namespace

std::string print_ir(const Program& program, const Stage& stage, const Plan& plan, const Sources& sources) {
    return IrPrinter(program, stage, plan, sources).run();
}

} // namespace kanuka::sl
