// Varying control flow becomes masks. A context is a mask variable: the lanes that run. A varying If splits
// its context in two; a masked Jump parks its lanes at the target's scope, where they join again; a masked
// Loop runs until its context is empty. Stores are masked unless the variable was declared in the same
// context (then no other lane can see it).
#include <algorithm>

#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

namespace {

class Masks {
  public:
    explicit Masks(Stage& s) : m_stage(s), m_b(s), m_parked(size_t(s.targets), -1) {}

    void run() {
        Block* const old = m_stage.root;
        m_stage.root = m_stage.block();
        m_b.set_block(m_stage.root);
        walk(*old);
    }

  private:
    struct Context {
        int mask = -1; // variable; -1 = all lanes
        int id = 0;
    };

    Ref varying(Ref r) {
        m_stage.instrs[size_t(r)].varying = true;
        return r;
    }
    int mask_var() {
        const int v = m_b.var("mask", Ty::Mask, {});
        m_stage.vars[size_t(v)].varying = true;
        m_b.declare(v);
        return v;
    }
    Ref current() {
        if (m_context.mask < 0)
            return varying(m_b.emit(Op::AllLanes, Ty::Mask, {}, {}));
        return load(m_context.mask);
    }
    Ref load(int var) { return varying(m_b.emit(Op::Load, Ty::Mask, {}, {}, var)); }
    void store(int var, Ref r) { varying(m_b.emit(Op::Store, Ty::Void, {r}, {}, var)); }
    Ref op(Op o, Ref a, Ref b) { return varying(m_b.emit(o, Ty::Mask, {a, b}, {})); }
    Ref none() { return m_b.constant({0.0f}, Ty::Mask); }

    // Runs `body` into a block under the context; guarded where skipping it pays.
    template <class F>
    void under(Context c, bool guard, F&& body) {
        const Context outer = m_context;
        m_context = c;
        if (guard) {
            Block* const here = m_b.block();
            Item g{Item::Guard};
            g.target = c.mask;
            g.body = m_stage.block();
            m_b.set_block(g.body);
            body();
            m_b.set_block(here);
            m_b.item(g);
        } else {
            body();
        }
        m_context = outer;
    }

    int cost(const Block& b) const {
        int c = 0;
        for (const Item& i : b.items) {
            if (i.kind == Item::Instruction) {
                const Instr& instr = m_stage.instrs[size_t(i.ref)];
                const int n = std::max(1, comps(instr.ty));
                c += instr.op == Op::Noise                                         ? 60
                     : instr.op == Op::Math1 || instr.op == Op::Math2              ? 15 * n
                     : instr.op == Op::Div || instr.op == Op::Sqrt                 ? 5 * n
                     : instr.op == Op::LoadElement || instr.op == Op::StoreElement ? 8 * n
                     : instr.op == Op::Call                                        ? 100
                     : instr.op == Op::MatMul                                      ? 64
                                                                                   : n;
            } else if (i.kind == Item::Loop) {
                c += 1000;
            }
            if (i.body)
                c += cost(*i.body);
            if (i.orelse)
                c += cost(*i.orelse);
        }
        return c;
    }

    // Do lanes leave the block for a masked target outside of it?
    bool lanes_leave(const Block& b, std::vector<int>& inside) const {
        for (const Item& i : b.items) {
            if (i.kind == Item::Jump && m_parked[size_t(i.target)] >= 0 &&
                std::find(inside.begin(), inside.end(), i.target) == inside.end())
                return true;
            if (i.kind == Item::Scope)
                inside.push_back(i.target);
            const bool leave =
                (i.body && lanes_leave(*i.body, inside)) || (i.orelse && lanes_leave(*i.orelse, inside));
            if (i.kind == Item::Scope)
                inside.pop_back();
            if (leave)
                return true;
        }
        return false;
    }
    bool lanes_leave(const Block* b) const {
        std::vector<int> inside;
        return b && lanes_leave(*b, inside);
    }

    static bool writes_values(CallKind kind) {
        return kind == CallKind::Printf || kind == CallKind::Format || kind == CallKind::Concat;
    }

    void instruction(const Item& item) {
        Instr& i = m_stage.instrs[size_t(item.ref)];
        const bool stores = i.op == Op::Store || i.op == Op::StoreElement;
        const bool varies = (stores || i.op == Op::LoadElement) && m_stage.vars[size_t(i.imm)].varying;
        if (stores && varies && m_context.mask >= 0 && m_stage.vars[size_t(i.imm)].context != m_context.id) {
            const Ref mask = current();
            m_stage.instrs[size_t(item.ref)].args.push_back(mask);
        } else if (i.op == Op::LoadElement && i.varying && m_stage.instrs[size_t(i.args[0])].varying) {
            const Ref mask = current(); // faults count lanes that run
            m_stage.instrs[size_t(item.ref)].args.push_back(mask);
        } else if ((i.op == Op::Div || i.op == Op::Math1 || i.op == Op::Math2) && i.varying &&
                   !i.floats.empty()) {
            const Ref mask = current();
            m_stage.instrs[size_t(item.ref)].args.push_back(mask);
        } else if (i.op == Op::Call && m_context.mask >= 0 &&
                   writes_values(m_stage.calls[size_t(i.imm)].kind)) {
            const Ref mask = current(); // of the first lane that runs
            m_stage.instrs[size_t(item.ref)].args.push_back(mask);
            CallSite& site = m_stage.calls[size_t(m_stage.instrs[size_t(item.ref)].imm)];
            site.args.push_back(mask);
        } else if (i.op == Op::StoreElement && m_stage.instrs[size_t(i.args[0])].varying) {
            const Ref mask = current();
            m_stage.instrs[size_t(item.ref)].args.push_back(mask);
        }
        m_b.item(item);
    }

    void branch(const Item& item) {
        if (!m_stage.instrs[size_t(item.ref)].varying) {
            Item i = item;
            Block* const here = m_b.block();
            const Context outer = m_context;
            i.body = m_stage.block();
            m_b.set_block(i.body);
            walk(*item.body);
            i.orelse = m_stage.block();
            m_b.set_block(i.orelse);
            walk(*item.orelse);
            m_b.set_block(here);
            m_context = outer;
            if (m_context.mask >= 0 && (lanes_leave(item.body) || lanes_leave(item.orelse)))
                m_context.id = ++m_ids;
            m_b.item(i);
            return;
        }
        const Ref all = current();
        const Ref c = varying(m_b.emit(Op::ToMask, Ty::Mask, {item.ref}, item.loc));
        const bool leave = lanes_leave(item.body) || lanes_leave(item.orelse);
        const bool has_else = item.orelse && !item.orelse->items.empty();
        Context yes{mask_var(), ++m_ids}, no{-1, 0};
        store(yes.mask, op(Op::And, all, c));
        if (has_else || leave) {
            no = {mask_var(), ++m_ids};
            store(no.mask, op(Op::AndNot, all, c));
        }
        under(yes, cost(*item.body) > 20, [&] { walk(*item.body); });
        if (has_else)
            under(no, cost(*item.orelse) > 20, [&] { walk(*item.orelse); });
        if (leave) {
            store(m_context.mask, op(Op::Or, load(yes.mask), load(no.mask)));
            m_context.id = ++m_ids;
        }
    }

    void scope(const Item& item) {
        Item i = item;
        Block* const here = m_b.block();
        if (!item.masked) {
            i.body = m_stage.block();
            m_b.set_block(i.body);
            walk(*item.body);
            m_b.set_block(here);
            m_b.item(i);
            return;
        }
        // Lanes never jump to this scope's end as one: no target is needed.
        const Ref all = current();
        const Context inner{mask_var(), ++m_ids};
        store(inner.mask, all);
        const int parked = mask_var();
        store(parked, none());
        m_parked[size_t(item.target)] = parked;
        under(inner, false, [&] { walk(*item.body); });
        m_parked[size_t(item.target)] = -1;
        if (lanes_leave(item.body)) { // for targets further out
            store(m_context.mask, op(Op::Or, load(inner.mask), load(parked)));
            m_context.id = ++m_ids;
        }
    }

    void loop(const Item& item) {
        Item i = item;
        Block* const here = m_b.block();
        const Context outer = m_context;
        i.body = m_stage.block();
        m_b.set_block(i.body);
        if (lanes_leave(item.body)) {
            Item leave{Item::LeaveLoop};
            leave.target = m_context.mask;
            m_b.item(leave);
            m_context.id = ++m_ids;
            i.masked = true;
        } else {
            i.masked = false;
        }
        walk(*item.body);
        m_b.set_block(here);
        m_context = outer;
        if (i.masked)
            m_context.id = ++m_ids;
        m_b.item(i);
    }

    void walk(const Block& b) {
        for (const Item& item : b.items) {
            switch (item.kind) {
            case Item::Instruction:
                instruction(item);
                break;
            case Item::Declare:
                m_stage.vars[size_t(item.target)].context = m_context.mask < 0 ? -2 : m_context.id;
                m_b.item(item);
                break;
            case Item::If:
                branch(item);
                break;
            case Item::Scope:
                scope(item);
                break;
            case Item::Loop:
                loop(item);
                break;
            case Item::Jump:
                if (const int parked = m_parked[size_t(item.target)]; parked >= 0) {
                    store(parked, op(Op::Or, load(parked), current()));
                    store(m_context.mask, none());
                    m_context.id = ++m_ids;
                } else {
                    m_b.item(item);
                }
                break;
            default:
                m_b.item(item);
                break;
            }
        }
    }

    Stage& m_stage;
    Builder m_b;
    Context m_context;
    int m_ids = 0;
    std::vector<int> m_parked; // mask variable of each target whose scope is open and masked
};

} // namespace

void make_masks(Stage& stage) {
    if (stage.root)
        Masks(stage).run();
}

} // namespace kanuka::sl::ir
