// Strings that vary over a grid. Machine code has no place for one string a vertex; but the strings that a
// shader chooses between are few and known: what varies becomes the number of the string in a list, and a
// comparison with it one of numbers. A lookup in a texture whose name varies becomes one lookup for each
// name, where it is the one that is chosen. Where else the text itself is needed, a string must still be
// uniform.
#include <map>

#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

namespace {

class Texts {
  public:
    Texts(Stage& stage, Diagnostics& diagnostics) : m_stage(stage), m_diagnostics(diagnostics), m_b(stage) {}

    void run(const Variant& variant) {
        Stage inferred = m_stage;
        infer_detail(inferred, variant, nullptr);
        m_var.resize(m_stage.vars.size());
        m_ref.resize(m_stage.instrs.size());
        bool any = false;
        for (size_t v = 0; v < m_var.size(); v++)
            any = (m_var[v] = m_stage.vars[v].ty == Ty::String && inferred.vars[v].varying) || any;
        for (size_t r = 0; r < m_ref.size(); r++)
            any = (m_ref[r] = m_stage.instrs[r].ty == Ty::String && inferred.instrs[r].varying) || any;
        if (!any)
            return;
        collect(*m_stage.root);
        if (m_broken)
            return;
        for (size_t v = 0; v < m_var.size(); v++)
            if (m_var[v])
                m_stage.vars[v].ty = Ty::Float;
        rewrite(*m_stage.root);
    }

  private:
    bool numbered(Ref r) const { return size_t(r) < m_ref.size() && m_ref[size_t(r)]; }

    void complain(Loc at) {
        m_broken = true;
        m_diagnostics.error(at,
                            "a string cannot vary over the surface here; make what it depends on uniform");
    }

    // A string's place in the list.
    void add(Ref r, Loc at) {
        const Instr& i = m_stage.instrs[size_t(r)];
        if (numbered(r) || m_number.count(key(r)))
            return;
        if (i.op != Op::Text && i.op != Op::Param && i.op != Op::Member)
            return complain(at);
        m_number[key(r)] = int(m_list.size());
        m_list.push_back(r);
    }
    std::string key(Ref r) const {
        const Instr& i = m_stage.instrs[size_t(r)];
        return i.op == Op::Text ? "t" + i.text
                                : (i.op == Op::Param ? "p" : "m") + std::to_string(i.imm) + "." +
                                      (i.floats.empty() ? std::string() : std::to_string(int(i.floats[0])));
    }
    Ref number(Ref r) { return numbered(r) ? r : m_b.constant(float(m_number[key(r)])); }

    // A message is one for the whole grid: what varies has no text in it.
    bool prints(const Instr& i) const {
        return i.op == Op::Call && m_stage.calls[size_t(i.imm)].kind == CallKind::Printf;
    }

    // A lookup by one text that varies: its argument, -1 = it is none.
    int looks_up(const Instr& i) const {
        if (i.op != Op::Call || (i.ty != Ty::Float && i.ty != Ty::Triple))
            return -1;
        int found = -1;
        for (size_t k = 0; k < i.args.size(); k++)
            if (numbered(i.args[k])) {
                if (found >= 0)
                    return -1;
                found = int(k);
            }
        return found;
    }

    // Finds all strings that may be chosen, and uses that need the text.
    void collect(const Block& b) {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                const Instr& i = m_stage.instrs[size_t(item.ref)];
                const bool varies = i.op == Op::Store ? m_var[size_t(i.imm)] : bool(m_ref[size_t(item.ref)]);
                if (i.op == Op::Store && varies)
                    add(i.args[0], i.loc);
                else if (i.op == Op::Select && varies)
                    for (size_t k : {1, 2})
                        add(i.args[k], i.loc);
                else if (varies && i.op != Op::Load)
                    complain(i.loc);
                else if (i.op != Op::SameText && i.op != Op::Store && i.op != Op::Select && !prints(i) &&
                         looks_up(i) < 0)
                    for (Ref a : i.args)
                        if (numbered(a))
                            complain(i.loc);
            }
            if (item.body)
                collect(*item.body);
            if (item.orelse)
                collect(*item.orelse);
        }
    }

    void rewrite(Block& b) {
        Block made;
        m_b.set_block(&made);
        for (Item& item : b.items) {
            if (item.kind == Item::Instruction)
                instruction(item.ref);
            made.items.push_back(item);
            for (Block* side : {item.body, item.orelse})
                if (side) {
                    rewrite(*side);
                    m_b.set_block(&made);
                }
        }
        b.items = std::move(made.items);
    }

    void instruction(Ref r) {
        const Instr i = m_stage.instrs[size_t(r)];
        if (i.op == Op::SameText && (numbered(i.args[0]) || numbered(i.args[1])))
            return same(r, i);
        if (const int argument = looks_up(i); argument >= 0)
            return look_up(r, i, size_t(argument));
        if (prints(i)) {
            for (size_t k = 0; k < i.args.size(); k++)
                if (numbered(i.args[k])) {
                    const Ref text = m_b.text("(a string that varies)");
                    m_stage.instrs[size_t(r)].args[k] = text;
                    m_stage.calls[size_t(i.imm)].args[k] = text;
                }
        } else if (i.op == Op::Store && m_var[size_t(i.imm)]) {
            const Ref n = number(i.args[0]);
            m_stage.instrs[size_t(r)].args[0] = n;
        } else if (numbered(r)) {
            if (i.op == Op::Select)
                for (size_t k : {1, 2}) {
                    const Ref n = number(i.args[k]);
                    m_stage.instrs[size_t(r)].args[k] = n;
                }
            m_stage.instrs[size_t(r)].ty = Ty::Float;
        }
    }

    // if (number == 0) result = lookup(first, …); if (number == 1) …
    void look_up(Ref r, const Instr& i, size_t argument) {
        const int result = m_b.var("looked up", i.ty, i.loc);
        m_b.declare(result);
        m_b.store(result, i.ty == Ty::Triple ? m_b.triple(0) : m_b.constant(0.0f), i.loc);
        const CallSite call = m_stage.calls[size_t(i.imm)];
        Block* const here = m_b.block();
        for (size_t k = 0; k < m_list.size(); k++) {
            Item chosen{Item::If};
            chosen.ref = m_b.emit(Op::Eq, Ty::Bool, {i.args[argument], m_b.constant(float(k))}, i.loc);
            chosen.loc = i.loc;
            chosen.body = m_stage.block();
            chosen.orelse = m_stage.block();
            m_b.set_block(chosen.body);
            CallSite site = call;
            site.args[argument] = m_list[k];
            m_b.store(result, m_b.call(std::move(site), i.ty), i.loc);
            m_b.set_block(here);
            m_b.item(chosen);
        }
        Instr& made = m_stage.instrs[size_t(r)];
        made.op = Op::Load;
        made.imm = result;
        made.args.clear();
    }

    // Is it one of the strings that are equal to the other operand?
    void same(Ref r, const Instr& i) {
        Ref x = i.args[0], other = i.args[1];
        if (!numbered(x))
            std::swap(x, other);
        Ref any = m_b.boolean(false);
        if (numbered(other)) {
            any = m_b.emit(Op::Eq, Ty::Bool, {x, other}, i.loc);
        } else {
            for (size_t k = 0; k < m_list.size(); k++) {
                const Ref it = m_b.emit(Op::Eq, Ty::Bool, {x, m_b.constant(float(k))}, i.loc);
                const Ref equal = m_b.emit(Op::SameText, Ty::Bool, {m_list[k], other}, i.loc);
                any =
                    m_b.emit(Op::Or, Ty::Bool, {any, m_b.emit(Op::And, Ty::Bool, {it, equal}, i.loc)}, i.loc);
            }
        }
        Instr& result = m_stage.instrs[size_t(r)];
        result.op = Op::Or;
        result.args = {any, any};
    }

    Stage& m_stage;
    Diagnostics& m_diagnostics;
    Builder m_b;
    std::vector<bool> m_var, m_ref; // variables and values that are numbers of strings
    std::vector<Ref> m_list;
    std::map<std::string, int> m_number;
    bool m_broken = false;
};

} // namespace

void number_texts(Stage& stage, const Variant& variant, Diagnostics& diagnostics) {
    if (stage.root)
        Texts(stage, diagnostics).run(variant);
}

} // namespace kanuka::sl::ir
