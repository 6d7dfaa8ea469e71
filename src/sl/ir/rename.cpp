// One name for each whole assignment, where that is easily seen: a variable that is assigned again in the
// block that declares it goes on under a new name. closures_flow.cpp does not follow the order of
// assignments; after this, Ci = Cs; Ci *= diffuse(N); is light times what is plain.
#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

namespace {

class Rename {
  public:
    Rename(Stage& s, const std::vector<bool>& keep) : m_stage(s), m_keep(keep) {
        for (size_t v = 0; v < s.vars.size(); v++)
            m_now.push_back(int(v));
        m_declared.resize(s.vars.size(), nullptr);
        m_used.resize(s.vars.size(), false);
        walk(*s.root);
    }
    int now(int var) const { return var < 0 ? var : m_now[size_t(var)]; }

  private:
    void walk(Block& b) {
        std::vector<Item> items;
        for (Item item : b.items) {
            if (item.kind == Item::Declare) {
                m_declared[size_t(item.target)] = &b;
                m_used[size_t(item.target)] = false;
                m_now[size_t(item.target)] = item.target;
            }
            if (item.kind == Item::Instruction) {
                Instr& i = m_stage.instrs[size_t(item.ref)];
                const bool element = i.op == Op::LoadElement || i.op == Op::StoreElement;
                if (i.op == Op::Load || i.op == Op::Store || element) {
                    const size_t old = size_t(i.imm);
                    if (i.op == Op::Store && m_declared[old] == &b && m_used[old] && !m_keep[old])
                        items.push_back(fresh(old));
                    m_used[old] = true;
                    i.imm = m_now[old];
                }
            }
            if (item.body)
                walk(*item.body);
            if (item.orelse)
                walk(*item.orelse);
            items.push_back(item);
        }
        b.items = std::move(items);
    }

    Item fresh(size_t old) {
        Var v = m_stage.vars[old];
        m_stage.vars.push_back(std::move(v));
        m_now[old] = int(m_stage.vars.size() - 1);
        Item declare{Item::Declare};
        declare.target = m_now[old];
        return declare;
    }

    Stage& m_stage;
    const std::vector<bool>& m_keep;
    std::vector<int> m_now;         // by variable: its present name
    std::vector<Block*> m_declared; // and the block that declares it
    std::vector<bool> m_used;       // since then
};

} // namespace

void rename_assignments(Program& program) {
    Stage& s = program.shade;
    std::vector<bool> keep(s.vars.size(), false);
    for (const Instr& i : s.instrs) // reference values are known by their number
        if (i.op == Op::Closure && !i.floats.empty() &&
            (Closure(i.imm) == Closure::FresnelReflect || Closure(i.imm) == Closure::FresnelTransmit ||
             Closure(i.imm) == Closure::LightSample))
            keep[size_t(i.floats[0])] = true;
    const Rename rename(s, keep);
    program.Ci = rename.now(program.Ci);
    program.Oi = rename.now(program.Oi);
    for (Output& o : s.outputs)
        o.var = rename.now(o.var);
}

} // namespace kanuka::sl::ir
