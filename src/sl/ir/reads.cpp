// What a stage reads of the surface, and from how far: each difference to the neighbours that another one
// goes into is a ring more. Bounded by MostRings, which loops reach that carry differences round.
#include <algorithm>

#include "sl/ir/passes.h"

namespace kanuka::sl::ir {
namespace {

constexpr int MostRings = 4;

class Reading {
  public:
    explicit Reading(const Stage& stage)
        : m_stage(stage), m_refs(stage.instrs.size()), m_vars(stage.vars.size()) {}

    grid::Reads run() {
        do {
            m_changed = false;
            walk(*m_stage.root, 0);
        } while (m_changed);
        for (const int rings : m_refs)
            m_reads.rings = std::max(m_reads.rings, rings);
        return m_reads;
    }

  private:
    void raise(int& rings, int to) {
        if (to = std::min(to, MostRings); to > rings) {
            rings = to;
            m_changed = true;
        }
    }

    void instruction(Ref ref, int condition) {
        const Instr& i = m_stage.instrs[size_t(ref)];
        const CallSite* site = i.op == Op::Call ? &m_stage.calls[size_t(i.imm)] : nullptr;
        const bool difference = site && (site->kind == CallKind::Dx || site->kind == CallKind::Dy);
        int rings = 0;
        for (const Ref a : i.args) {
            rings = std::max(rings, m_refs[size_t(a)]);
            // How u and v change along themselves is known without them.
            if (const Instr& leaf = m_stage.instrs[size_t(a)]; leaf.op == Op::Input)
                reads(Input(leaf.imm), difference);
        }
        if (i.op == Op::Load || i.op == Op::LoadElement)
            rings = std::max(rings, m_vars[size_t(i.imm)]);
        if (difference ||
            (site && (site->kind == CallKind::CalculateNormal || site->kind == CallKind::Texture)))
            rings++;
        raise(m_refs[size_t(ref)], rings);
        if (i.op == Op::Store || i.op == Op::StoreElement)
            raise(m_vars[size_t(i.imm)], std::max({rings, condition, m_jumps}));
    }

    void reads(Input input, bool difference) {
        m_reads.parameters |= !difference && (input == Input::u || input == Input::v);
        m_reads.texture |= input == Input::s || input == Input::t;
        m_reads.frame |= input == Input::dPdu || input == Input::dPdv;
        m_reads.eye |= input == Input::E;
        if (input == Input::du || input == Input::dv) // means over neighbours
            m_reads.rings = std::max(m_reads.rings, 1);
    }

    void walk(const Block& block, int condition) {
        for (const Item& item : block.items) {
            int inside = condition;
            if (item.kind == Item::Instruction)
                instruction(item.ref, condition);
            else if (item.kind == Item::If)
                inside = std::max(condition, m_refs[size_t(item.ref)]);
            else if (item.kind == Item::Jump) // whether what follows runs
                raise(m_jumps, condition);
            for (const Block* b : {item.body, item.orelse})
                if (b)
                    walk(*b, inside);
        }
    }

    const Stage& m_stage;
    std::vector<int> m_refs, m_vars;
    int m_jumps = 0;
    bool m_changed = false;
    grid::Reads m_reads;
};

} // namespace

grid::Reads find_reads(const Stage& stage) {
    return stage.root ? Reading(stage).run() : grid::Reads{};
}

} // namespace kanuka::sl::ir
