#include <cctype>
#include <set>
#include <unordered_map>

#include "sl/print/operators.h"
#include "sl/print/print.h"

namespace kanuka::sl {

using namespace ir;

namespace {

struct Text {
    std::string s;
    int tight = Whole;
    std::vector<int> loads;  // variables that it reads
    std::vector<Loc> places; // of what it is made of
};

class CPrinter {
  public:
    CPrinter(const Program& program, const Stage& stage, const Sources& sources)
        : m_program(program), m_stage(stage), m_sources(sources), m_uses(stage.instrs.size()),
          m_texts(stage.instrs.size()) {}

    std::string run() {
        m_used.assign(m_stage.vars.size(), false);
        count(*m_stage.root);
        name_vars();
        m_out = "// once for each grid: what is uniform has one value, what is varying one a vertex\nvoid " +
                m_stage.name + "()\n{\n";
        block(*m_stage.root, 1);
        return m_out + "}\n";
    }

  private:
    struct Use {
        int count = 0;
        const Block* block = nullptr; // of the last one
        size_t index = 0;
    };

    // ---- before

    void name_vars() {
        // Names of the shader's parameters and the surface's variables are taken.
        for (const Parameter& q : m_program.parameters)
            m_times[q.name]++;
        for (int i = 0; i < int(Input::Count); i++)
            m_times[std::string(input_info(Input(i)).name)]++;
        m_output.assign(m_stage.vars.size(), false);
        m_names.resize(m_stage.vars.size());
        for (const Output& o : m_stage.outputs)
            if (o.var >= 0) {
                m_names[size_t(o.var)] = output_name(m_program, o);
                m_output[size_t(o.var)] = true;
            }
        for (size_t v = 0; v < m_names.size(); v++)
            if (m_used[v] && !m_output[v])
                m_names[v] = unique(m_stage.vars[v].name);
    }

    std::string unique(const std::string& given) {
        std::string name;
        for (const char c : given)
            name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
        if (name.find_first_not_of('_') == std::string::npos) // the value of a ?: has no name
            name = "v";
        const int n = ++m_times[name];
        return n > 1 ? name + "_" + std::to_string(n) : name;
    }

    // A value that was a variable of the source keeps its name.
    const std::string& name(Ref r) {
        std::string& n = m_value_names[r];
        if (n.empty())
            n = named(r) ? unique(m_stage.instrs[size_t(r)].text) : "t" + std::to_string(r);
        return n;
    }
    bool named(Ref r) const { return !m_stage.instrs[size_t(r)].text.empty(); }

    void use(Ref r, const Block& b, size_t index) {
        m_uses[size_t(r)] = {m_uses[size_t(r)].count + 1, &b, index};
    }

    void count(const Block& b) {
        for (size_t k = 0; k < b.items.size(); k++) {
            const Item& i = b.items[k];
            if (i.kind == Item::Instruction) {
                const Instr& instr = m_stage.instrs[size_t(i.ref)];
                for (const Ref a : instr.args)
                    use(a, b, k);
                if (instr.op == Op::Load || instr.op == Op::Store || instr.op == Op::LoadElement ||
                    instr.op == Op::StoreElement)
                    m_used[size_t(instr.imm)] = true;
            } else if (i.kind == Item::If) {
                use(i.ref, b, k);
            }
            if (i.body)
                count(*i.body);
            if (i.orelse)
                count(*i.orelse);
        }
    }

    // ---- lines

    void line(int indent, const std::string& text) {
        m_out += std::string(size_t(indent) * 4, ' ') + text + "\n";
    }

    void place(int indent, Loc at) {
        if (at.line == 0 || (at.file == m_last.file && at.line == m_last.line))
            return;
        m_last = at;
        if (const std::string text = source_line(m_sources, at); !text.empty())
            line(indent, "// " + text);
    }

    static std::string type(Ty ty, bool varying) {
        static constexpr const char* Names[] = {"void",   "bool",   "float", "float3",
                                                "matrix", "string", "mask"};
        return std::string(varying ? "varying " : "uniform ") + Names[int(ty)];
    }

    std::string declaration(int var) const {
        const Var& v = m_stage.vars[size_t(var)];
        return type(v.ty, v.varying) + " " + m_names[size_t(var)] +
               (v.array ? "[" + std::to_string(v.array) + "]" : "");
    }

    void declare_pending(int indent, std::set<int>& pending) {
        for (const int var : pending)
            line(indent, declaration(var) + ";");
        pending.clear();
    }

    // ---- blocks

    void block(const Block& b, int indent) {
        std::set<int> pending; // variables whose first value may declare them
        const auto condition = [&](const Item& i) {
            const Text& t = text(i.ref);
            for (const Loc at : t.places)
                place(indent, at);
            place(indent, i.loc);
            return t.s;
        };
        for (size_t k = 0; k < b.items.size(); k++) {
            const Item& i = b.items[k];
            switch (i.kind) {
            case Item::Instruction:
                instruction(b, k, indent, pending);
                break;
            case Item::Declare:
                if (!m_output[size_t(i.target)])
                    pending.insert(i.target);
                break;
            case Item::If:
                declare_pending(indent, pending);
                line(indent, "if (" + condition(i) + ") {");
                block(*i.body, indent + 1);
                if (i.orelse && !i.orelse->items.empty()) {
                    line(indent, "} else {");
                    block(*i.orelse, indent + 1);
                }
                line(indent, "}");
                break;
            case Item::Loop:
                declare_pending(indent, pending);
                place(indent, i.loc);
                line(indent, "for (;;) {");
                block(*i.body, indent + 1);
                line(indent, "}");
                break;
            case Item::Scope:
                declare_pending(indent, pending);
                line(indent, "{");
                block(*i.body, indent + 1);
                line(indent, "} L" + std::to_string(i.target) + ":;");
                break;
            case Item::Jump:
                line(indent, "goto L" + std::to_string(i.target) + ";");
                break;
            default:
                break; // masks come later
            }
        }
        declare_pending(indent, pending);
    }

    void instruction(const Block& b, size_t k, int indent, std::set<int>& pending) {
        const Ref r = b.items[k].ref;
        const Instr& i = m_stage.instrs[size_t(r)];
        if (i.op == Op::Store || i.op == Op::StoreElement) {
            const size_t value = i.op == Op::Store ? 0 : 1;
            for (const Ref a : i.args)
                for (const Loc at : text(a).places)
                    place(indent, at);
            place(indent, i.loc);
            std::string target = m_names[size_t(i.imm)];
            if (i.op == Op::StoreElement)
                target += "[" + text(i.args[0]).s + "]";
            else if (pending.erase(i.imm))
                target = declaration(i.imm);
            line(indent, target + " = " + text(i.args[value]).s + ";");
            return;
        }
        Text t = compute(i);
        const Use& u = m_uses[size_t(r)];
        const auto places = [&] {
            for (const Loc at : t.places)
                place(indent, at);
        };
        if (i.op == Op::Call) {
            places();
            line(indent, (u.count ? type(i.ty, i.varying) + " " + name(r) + " = " : "") + t.s + ";");
        } else if (u.count == 0) {
            return;
        } else if (u.count == 1 && !named(r) && u.block == &b && t.s.size() < 90 &&
                   unchanged(b, k, u.index, t.loads)) {
            m_texts[size_t(r)] = std::move(t);
            return;
        } else {
            places();
            line(indent, type(i.ty, i.varying) + " " + name(r) + " = " + t.s + ";");
        }
        m_texts[size_t(r)] = {name(r), Whole, {}, {}};
    }

    // Nothing between two items of a block writes these variables.
    bool unchanged(const Block& b, size_t from, size_t to, const std::vector<int>& vars) const {
        if (vars.empty())
            return true;
        for (size_t k = from + 1; k < to; k++) {
            const Item& i = b.items[k];
            if (i.body)
                return false;
            if (i.kind != Item::Instruction)
                continue;
            const Instr& instr = m_stage.instrs[size_t(i.ref)];
            if (instr.op == Op::Store || instr.op == Op::StoreElement)
                for (const int v : vars)
                    if (v == instr.imm)
                        return false;
        }
        return true;
    }

    // ---- expressions

    const Text& text(Ref r) {
        Text& t = m_texts[size_t(r)];
        if (t.s.empty()) {
            const Instr& i = m_stage.instrs[size_t(r)];
            t = is_leaf(i.op) ? leaf(i) : Text{name(r), Whole, {}, {}};
        }
        return t;
    }

    Text leaf(const Instr& i) {
        switch (i.op) {
        case Op::Const: {
            if (i.ty == Ty::Bool)
                return {i.floats[0] != 0 ? "true" : "false"};
            bool same = true;
            std::string all;
            for (const float x : i.floats) {
                all += (all.empty() ? "" : ", ") + number_text(x);
                same = same && x == i.floats[0];
            }
            if (i.floats.size() == 1)
                return {all, i.floats[0] < 0 ? Prefix : Whole};
            return {(i.ty == Ty::Matrix ? "matrix(" : "float3(") + (same ? number_text(i.floats[0]) : all) +
                    ")"};
        }
        case Op::Text:
            return {"\"" + i.text + "\""};
        case Op::Input:
            return {std::string(input_info(Input(i.imm)).name)};
        case Op::Param:
            return {parameter_name(m_program, i)};
        case Op::Member:
            return {"member" + std::to_string(i.imm)};
        default:
            return {"given." + channel_name(m_program, i.imm)};
        }
    }

    std::string wrapped(Ref r, int tight) {
        const Text& t = text(r);
        return t.tight < tight ? "(" + t.s + ")" : t.s;
    }

    Text compute(const Instr& i) {
        Text t;
        const std::vector<Ref>& args = i.args;
        for (const Ref a : args) {
            const Text& of = text(a);
            t.loads.insert(t.loads.end(), of.loads.begin(), of.loads.end());
            t.places.insert(t.places.end(), of.places.begin(), of.places.end());
        }
        t.places.push_back(i.loc);
        int tight = Whole;
        if (const std::string_view op = infix_operator(i.op, tight); !op.empty()) {
            t.s = wrapped(args[0], tight) + " " + std::string(op) + " " + wrapped(args[1], tight + 1);
            t.tight = tight;
            return t;
        }
        switch (i.op) {
        case Op::Load:
            t.s = m_names[size_t(i.imm)];
            t.loads.push_back(i.imm);
            break;
        case Op::LoadElement:
            t.s = m_names[size_t(i.imm)] + "[" + text(args[0]).s + "]";
            t.loads.push_back(i.imm);
            break;
        case Op::Neg:
        case Op::Not:
            t.s = (i.op == Op::Neg ? "-" : "!") + wrapped(args[0], Whole);
            t.tight = Prefix;
            break;
        case Op::Select:
            t.s = wrapped(args[0], Choice + 1) + " ? " + wrapped(args[1], Choice + 1) + " : " +
                  wrapped(args[2], Choice);
            t.tight = Choice;
            break;
        case Op::Extract:
            t.s = wrapped(args[0], Whole) + (m_stage.instrs[size_t(args[0])].ty == Ty::Triple
                                                 ? "." + std::string(1, "xyz"[std::min(i.imm, 2)])
                                                 : "[" + std::to_string(i.imm) + "]");
            break;
        case Op::Call:
            t.s = call(m_stage.calls[size_t(i.imm)]);
            break;
        default:
            t.s = function_name(i);
            t.s += "(";
            for (size_t k = 0; k < args.size(); k++)
                t.s += (k ? ", " : "") + text(args[k]).s;
            t.s += ")";
        }
        return t;
    }

    std::string call(const CallSite& site) {
        std::string s(call_name(site.kind));
        s += "(";
        for (size_t k = 0; k < site.args.size(); k++) {
            s += k ? ", " : "";
            if (k < site.names.size() && !site.names[k].empty())
                s += site.names[k] + ": ";
            s += text(site.args[k]).s;
        }
        return s + ")";
    }

    const Program& m_program;
    const Stage& m_stage;
    const Sources& m_sources;
    std::vector<Use> m_uses;
    std::vector<Text> m_texts;
    std::vector<std::string> m_names; // of variables
    std::vector<bool> m_output;       // variables that the stage hands out
    std::vector<bool> m_used;
    std::unordered_map<std::string, int> m_times;
    std::unordered_map<Ref, std::string> m_value_names;
    std::string m_out;
    Loc m_last{};
};

} // namespace

std::string print_c(const Program& program, const Stage& stage, const Sources& sources) {
    return CPrinter(program, stage, sources).run();
}

} // namespace kanuka::sl
