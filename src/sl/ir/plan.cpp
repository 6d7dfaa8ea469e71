#include "sl/ir/plan.h"

namespace kanuka::sl::ir {

int item_size(const Item& item) {
    int n = 1;
    if (item.body)
        for (const Item& i : item.body->items)
            n += item_size(i);
    if (item.orelse)
        for (const Item& i : item.orelse->items)
            n += item_size(i);
    return n;
}

namespace {

class Planner {
  public:
    explicit Planner(const Stage& s) : m_stage(s) {
        m_plan.refs.resize(s.instrs.size());
        m_plan.vars.resize(s.vars.size());
        m_ref_region.assign(s.instrs.size(), -1);
        m_var_region.assign(s.vars.size(), -1);
        m_var_loop.assign(s.vars.size(), -1);
    }

    Plan run() {
        // Jumps out of regions make what is around them grid-level, which may make more jumps so.
        do {
            m_changed = false;
            mark(*m_stage.root, nullptr);
        } while (m_changed);
        block(*m_stage.root, -1);
        m_plan.outputs_apart = !m_open;
        open_region();
        for (const Output& o : m_stage.outputs)
            use_var(o.var, -1);
        m_plan.regions = m_regions;
        return std::move(m_plan);
    }

  private:
    bool mark(const Block& b, const Item* loop) {
        bool any = false;
        for (const Item& i : b.items) {
            bool grid = m_plan.grid.count(&i) > 0;
            switch (i.kind) {
            case Item::Instruction:
                grid = grid || grid_level(m_stage, m_stage.instrs[size_t(i.ref)]);
                break;
            case Item::Jump:
                grid = grid || m_targets.count(i.target) > 0;
                break;
            case Item::LeaveLoop:
                grid = grid || (loop && m_plan.grid.count(loop) > 0);
                break;
            default:
                break;
            }
            const Item* const inner = i.kind == Item::Loop ? &i : loop;
            if (i.body)
                grid = mark(*i.body, inner) || grid;
            if (i.orelse)
                grid = mark(*i.orelse, inner) || grid;
            if (grid && m_plan.grid.insert(&i).second)
                m_changed = true;
            if (grid && i.kind == Item::Scope && m_targets.insert(i.target).second)
                m_changed = true;
            any = any || grid;
        }
        return any;
    }

    void open_region() {
        if (!m_open) {
            m_open = true;
            m_current = m_regions++;
        }
    }

    void keep_ref(Ref r) {
        Slot& s = m_plan.refs[size_t(r)];
        const Instr& i = m_stage.instrs[size_t(r)];
        if (s.kind == Slot::Local && !is_leaf(i.op) && i.ty != Ty::Void)
            s = make(i.ty, i.varying, 1);
    }
    void keep_var(int v) {
        Slot& s = m_plan.vars[size_t(v)];
        const Var& var = m_stage.vars[size_t(v)];
        if (s.kind == Slot::Local)
            s = make(var.ty, var.varying, std::max(1, var.array));
    }
    Slot make(Ty ty, bool varying, int count) {
        const int n = comps(ty) * count;
        Slot s;
        int& size = ty == Ty::String ? m_plan.texts : varying ? m_plan.arrays : m_plan.uniforms;
        s.kind = ty == Ty::String ? Slot::Text : varying ? Slot::Array : Slot::Uniform;
        s.index = size;
        size += n;
        return s;
    }

    void use_ref(Ref r) {
        int& region = m_ref_region[size_t(r)];
        if (region < 0)
            region = m_current;
        else if (region != m_current)
            keep_ref(r);
    }
    void use_var(int v, int loop) {
        int& region = m_var_region[size_t(v)];
        if (region < 0)
            region = m_current;
        if (region != m_current || m_var_loop[size_t(v)] != loop)
            keep_var(v);
    }

    void lane_item(const Item& i, int loop) {
        switch (i.kind) {
        case Item::Instruction: {
            const Instr& instr = m_stage.instrs[size_t(i.ref)];
            if (instr.op == Op::Load || instr.op == Op::Store || instr.op == Op::LoadElement ||
                instr.op == Op::StoreElement)
                use_var(instr.imm, loop);
            for (Ref a : instr.args)
                use_ref(a);
            use_ref(i.ref);
            break;
        }
        case Item::If:
            use_ref(i.ref);
            break;
        case Item::Declare:
            m_var_loop[size_t(i.target)] = loop;
            if (m_stage.vars[size_t(i.target)].clear)
                use_var(i.target, loop);
            break;
        case Item::Guard:
        case Item::LeaveLoop:
            use_var(i.target, loop);
            break;
        default:
            break;
        }
        if (i.body)
            for (const Item& k : i.body->items)
                lane_item(k, loop);
        if (i.orelse)
            for (const Item& k : i.orelse->items)
                lane_item(k, loop);
    }

    void block(const Block& b, int loop) {
        m_open = false;
        int size = 0;
        for (const Item& i : b.items) {
            if (!m_plan.grid.count(&i)) {
                const int n = item_size(i);
                if (m_open && size + n > RegionLimit) {
                    m_open = false;
                    size = 0;
                }
                size += n;
                if (!m_open)
                    m_plan.first.insert(&i);
                open_region();
                lane_item(i, loop);
                continue;
            }
            m_open = false;
            size = 0;
            switch (i.kind) {
            case Item::Instruction:
                for (Ref a : m_stage.instrs[size_t(i.ref)].args)
                    keep_ref(a);
                keep_ref(i.ref);
                m_ref_region[size_t(i.ref)] = -2; // no region's own
                break;
            case Item::If:
                keep_ref(i.ref);
                break;
            case Item::Guard:
            case Item::LeaveLoop:
                keep_var(i.target);
                break;
            default:
                break;
            }
            const int inner = i.kind == Item::Loop ? ++m_loops : loop;
            if (i.body)
                block(*i.body, inner);
            if (i.orelse)
                block(*i.orelse, inner);
            m_open = false;
        }
    }

    const Stage& m_stage;
    Plan m_plan;
    std::unordered_set<int> m_targets;
    std::vector<int> m_ref_region, m_var_region, m_var_loop;
    int m_regions = 0, m_current = -1, m_loops = -1;
    bool m_open = false, m_changed = false;
};

} // namespace

Plan make_plan(const Stage& stage) {
    return Planner(stage).run();
}

} // namespace kanuka::sl::ir
