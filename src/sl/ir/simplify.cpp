#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

bool has_effect(CallKind kind) {
    switch (kind) {
    case CallKind::Printf:
    case CallKind::Report:
    case CallKind::CreateBoundary:
    case CallKind::AddLobe:
    case CallKind::AddLayer:
    case CallKind::CreateInterior:
    case CallKind::AddPhaseFunction:
    case CallKind::SetPhaseFunction:
    case CallKind::SetAbsorption:
    case CallKind::SetScattering:
    case CallKind::SetPriority:
        return true;
    default:
        return false;
    }
}

namespace {

template <class F>
void for_items(Block& block, F&& f) {
    for (Item& i : block.items) {
        f(i, block);
        if (i.body)
            for_items(*i.body, f);
        if (i.orelse)
            for_items(*i.orelse, f);
    }
}

// A variable with one store, in the block that declares it, is a name for the stored value.
void forward(Stage& s) {
    struct Use {
        Block* declared = nullptr;
        Block* stored = nullptr;
        int stores = 0;
        Ref value = None;
    };
    std::vector<Use> uses(s.vars.size());
    for_items(*s.root, [&](Item& i, Block& b) {
        if (i.kind == Item::Declare) {
            uses[size_t(i.target)].declared = &b;
        } else if (i.kind == Item::Instruction) {
            const Instr& instr = s.instrs[size_t(i.ref)];
            if (instr.op == Op::Store) {
                Use& u = uses[size_t(instr.imm)];
                u.stores++;
                u.stored = &b;
                u.value = instr.args[0];
            } else if (instr.op == Op::StoreElement) {
                uses[size_t(instr.imm)].stores = 2;
            }
        }
    });
    std::vector<Ref> alias(s.instrs.size(), None);
    for (size_t r = 0; r < s.instrs.size(); r++) {
        const Instr& i = s.instrs[r];
        if (i.op != Op::Load)
            continue;
        const Use& u = uses[size_t(i.imm)];
        if (u.stores == 1 && u.stored == u.declared && u.declared && !s.vars[size_t(i.imm)].must_be_uniform) {
            if (Instr& value = s.instrs[size_t(u.value)]; value.text.empty() && value.op != Op::Text)
                value.text = s.vars[size_t(i.imm)].name; // for who reads what becomes of a shader
            alias[r] = u.value;
        }
    }
    const auto resolve = [&](Ref r) {
        while (r != None && alias[size_t(r)] != None)
            r = alias[size_t(r)];
        return r;
    };
    for (Instr& i : s.instrs)
        for (Ref& a : i.args)
            a = resolve(a);
    for (CallSite& c : s.calls)
        for (Ref& a : c.args)
            a = resolve(a);
    for_items(*s.root, [&](Item& i, Block&) {
        if (i.kind == Item::If)
            i.ref = resolve(i.ref);
    });
}

// Marks backwards from outputs and effects; what stays unmarked goes.
class Liveness {
  public:
    explicit Liveness(Stage& s) : m_stage(s) {}

    void run() {
        index(*m_stage.root, -1);
        m_live.assign(m_stage.instrs.size(), false);
        m_live_var.assign(m_stage.vars.size(), false);
        m_place.assign(m_stage.instrs.size(), -1);
        m_stores.resize(m_stage.vars.size());
        for (size_t n = 0; n < m_nodes.size(); n++) {
            const Item& i = *m_nodes[n].item;
            if (i.kind == Item::Instruction) {
                m_place[size_t(i.ref)] = int(n);
                const Instr& instr = m_stage.instrs[size_t(i.ref)];
                if (instr.op == Op::Store || instr.op == Op::StoreElement)
                    m_stores[size_t(instr.imm)].push_back(i.ref);
                if (instr.op == Op::Call && has_effect(m_stage.calls[size_t(instr.imm)].kind))
                    mark(i.ref);
            } else if (i.kind == Item::Jump) {
                m_jumps.resize(size_t(m_stage.targets));
                m_jumps[size_t(i.target)].push_back(int(n));
            }
        }
        m_jumps.resize(size_t(m_stage.targets));
        for (const Output& o : m_stage.outputs)
            mark_var(o.var);
        while (!m_work.empty()) {
            const Ref r = m_work.back();
            m_work.pop_back();
            const Instr& i = m_stage.instrs[size_t(r)];
            for (Ref a : i.args)
                mark(a);
            if (i.op == Op::Load || i.op == Op::LoadElement || i.op == Op::Store || i.op == Op::StoreElement)
                mark_var(i.imm);
            if (m_place[size_t(r)] >= 0)
                need(m_nodes[size_t(m_place[size_t(r)])].parent);
        }
        prune(*m_stage.root);
    }

  private:
    struct Node {
        Item* item;
        int parent;
        bool needed = false;
    };

    void index(Block& b, int parent) {
        for (Item& i : b.items) {
            const int n = int(m_nodes.size());
            m_nodes.push_back({&i, parent});
            if (i.body)
                index(*i.body, n);
            if (i.orelse)
                index(*i.orelse, n);
        }
    }
    void mark(Ref r) {
        if (r == None || m_live[size_t(r)])
            return;
        m_live[size_t(r)] = true;
        m_work.push_back(r);
    }
    void mark_var(int v) {
        if (v < 0 || m_live_var[size_t(v)])
            return;
        m_live_var[size_t(v)] = true;
        for (Ref r : m_stores[size_t(v)])
            mark(r);
    }
    // What runs inside of node n matters: so do the conditions around it and the jumps past it.
    void need(int n) {
        for (; n >= 0 && !m_nodes[size_t(n)].needed; n = m_nodes[size_t(n)].parent) {
            Node& node = m_nodes[size_t(n)];
            node.needed = true;
            if (node.item->kind == Item::If)
                mark(node.item->ref);
            if (node.item->kind == Item::Scope)
                for (int j : m_jumps[size_t(node.item->target)]) {
                    m_nodes[size_t(j)].needed = true;
                    need(m_nodes[size_t(j)].parent);
                }
        }
    }
    void prune(Block& b) {
        std::vector<Item> kept;
        for (Item& i : b.items) {
            const bool keep = i.kind == Item::Instruction ? m_live[size_t(i.ref)]
                              : i.kind == Item::Declare   ? m_live_var[size_t(i.target)]
                                                          : m_nodes[m_next].needed;
            m_next++;
            if (i.body)
                prune(*i.body);
            if (i.orelse)
                prune(*i.orelse);
            if (keep)
                kept.push_back(i);
        }
        b.items = std::move(kept);
    }

    Stage& m_stage;
    std::vector<Node> m_nodes; // in the order of prune's walk
    std::vector<bool> m_live, m_live_var;
    std::vector<int> m_place;
    std::vector<std::vector<Ref>> m_stores;
    std::vector<std::vector<int>> m_jumps;
    std::vector<Ref> m_work;
    size_t m_next = 0;
};

} // namespace

void simplify(Stage& stage) {
    if (!stage.root)
        return;
    forward(stage);
    Liveness(stage).run();
}

} // namespace kanuka::sl::ir
