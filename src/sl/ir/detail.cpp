// Which values are one a grid (uniform) and which one a vertex (varying): the least assignment under which a
// varying operand makes a varying result, and a variable assigned under a varying condition varies. A fixed
// point, since loops carry values back.
#include <algorithm>
#include <map>
#include <set>

#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

std::string Variant::key() const {
    std::string k{Cs ? 'C' : 'c', Os ? 'O' : 'o'};
    if (E)
        k += 'E';
    for (size_t i = 0; i < params.size(); i++)
        if (params[i])
            k += "," + std::to_string(i);
    return k;
}

bool grid_level(const Stage& stage, const Instr& instr) {
    if (instr.op != Op::Call)
        return false;
    switch (stage.calls[size_t(instr.imm)].kind) {
    case CallKind::Dx:
    case CallKind::Dy:
    case CallKind::CalculateNormal:
        return instr.varying; // of a uniform value: zero
    default:
        return true;
    }
}

namespace {

class Detail {
  public:
    Detail(Stage& s, const Variant& v)
        : m_stage(s), m_variant(v), m_scopes(size_t(s.targets)), m_declared(s.vars.size(), -1) {}

    void run() {
        for (Instr& i : m_stage.instrs)
            i.varying = i.op == Op::Input   ? input_varies(Input(i.imm))
                        : i.op == Op::Param ? i.floats.size() < 2 && m_variant.varies(i.imm)
                                            : i.op == Op::AllLanes;
        for (Var& v : m_stage.vars)
            v.varying = false;
        do {
            m_changed = false;
            m_depth = 0;
            m_left.clear();
            m_context = m_contexts = 0;
            walk(*m_stage.root);
        } while (m_changed);
    }

    std::vector<std::pair<Loc, int>> broken; // stores that make a uniform variable vary
    // Where only some lanes run: blocks, loops, scopes, by their addresses
    std::map<int, std::set<const void*>> partial; // variables that some lanes store and others see: in which
    std::map<Ref, std::vector<const void*>> guarded; // operations: in which

  private:
    struct ScopeState {
        int depth = 0;   // of varying conditions at its begin
        size_t left = 0; // size of m_left then
    };

    bool input_varies(Input i) const {
        if (i == Input::Cs)
            return m_variant.Cs;
        if (i == Input::Os)
            return m_variant.Os;
        if (i == Input::E)
            return m_variant.E;
        return input_info(i).varying;
    }
    // Do only some lanes run here?
    bool divergent() const { return m_depth > 0 || !m_left.empty(); }

    template <class T>
    void raise(T& flag) {
        if (!flag) {
            flag = true;
            m_changed = true;
        }
    }

    void instruction(Instr& i) {
        bool varying = i.varying;
        for (Ref a : i.args)
            varying = varying || m_stage.instrs[size_t(a)].varying;
        if (i.op == Op::Load || i.op == Op::LoadElement)
            varying = varying || m_stage.vars[size_t(i.imm)].varying;
        if (i.op == Op::Store || i.op == Op::StoreElement) {
            Var& v = m_stage.vars[size_t(i.imm)];
            // A variable declared where the same lanes run as here is one value for all that can see it.
            if (varying || (divergent() && m_declared[size_t(i.imm)] != m_context)) {
                if (!v.varying && (v.must_be_uniform || v.ty == Ty::String))
                    broken.emplace_back(i.loc, i.imm);
                if (!v.varying)
                    raise(v.varying);
                if (divergent() && m_declared[size_t(i.imm)] != m_context)
                    partial[i.imm].insert(m_regions.begin(), m_regions.end());
            }
            varying = varying || v.varying;
        }
        if (varying)
            if (!i.varying) {
                i.varying = true;
                m_changed = true;
            }
    }

    void walk(Block& b) {
        for (Item& item : b.items) {
            switch (item.kind) {
            case Item::Instruction:
                instruction(m_stage.instrs[size_t(item.ref)]);
                if (divergent())
                    guarded[item.ref] = m_regions;
                break;
            case Item::Declare:
                m_declared[size_t(item.target)] = m_context;
                break;
            case Item::If: {
                const bool varying = m_stage.instrs[size_t(item.ref)].varying;
                const int outer = m_context;
                const size_t left = m_left.size();
                m_depth += varying;
                for (Block* side : {item.body, item.orelse}) {
                    m_context = varying ? ++m_contexts : outer;
                    if (varying)
                        m_regions.push_back(side);
                    walk(*side);
                    if (varying)
                        m_regions.pop_back();
                }
                m_depth -= varying;
                m_context = m_left.size() == left ? outer : ++m_contexts;
                break;
            }
            case Item::Scope: {
                ScopeState& s = m_scopes[size_t(item.target)];
                s.depth = m_depth;
                s.left = m_left.size();
                const int outer = m_context;
                m_items.push_back(&item);
                const size_t regions = m_regions.size();
                if (item.masked)
                    m_regions.push_back(&item);
                walk(*item.body);
                m_regions.resize(regions);
                m_items.pop_back();
                std::erase(m_left, item.target); // lanes meet again
                m_context = m_left.size() == s.left ? outer : ++m_contexts;
                break;
            }
            case Item::Loop: {
                // Lanes that leave in one iteration are missing in the next: known after the first walk.
                const size_t left = m_left.size();
                const int outer = m_context;
                walk(*item.body);
                if (m_left.size() != left) {
                    if (!item.masked) {
                        item.masked = true;
                        m_changed = true;
                    }
                    m_context = ++m_contexts;
                    m_regions.push_back(&item);
                    walk(*item.body);
                    m_regions.pop_back();
                }
                m_context = m_left.size() == left ? outer : ++m_contexts;
                break;
            }
            case Item::Jump: {
                const ScopeState& s = m_scopes[size_t(item.target)];
                if (m_depth <= s.depth && m_left.size() <= s.left)
                    break; // all lanes that came to the scope jump together
                for (Item* scope : m_items)
                    if (scope->target == item.target && !scope->masked) {
                        scope->masked = true;
                        m_changed = true;
                    }
                if (std::find(m_left.begin(), m_left.end(), item.target) == m_left.end())
                    m_left.push_back(item.target);
                m_context = ++m_contexts;
                break;
            }
            default:
                break;
            }
        }
    }

    Stage& m_stage;
    const Variant& m_variant;
    std::vector<ScopeState> m_scopes;
    std::vector<Item*> m_items;
    std::vector<const void*> m_regions; // around what is being walked
    std::vector<int> m_left;            // targets that some lanes are waiting at
    std::vector<int> m_declared;        // context in which a variable came to life
    int m_context = 0, m_contexts = 0;  // changes with the set of lanes that run
    int m_depth = 0;
    bool m_changed = false;
};

void clear_masks(Block& b) {
    for (Item& i : b.items) {
        i.masked = false;
        if (i.body)
            clear_masks(*i.body);
        if (i.orelse)
            clear_masks(*i.orelse);
    }
}

} // namespace

// A derivative under a varying condition reads neighbours at which it does not hold. That is fine unless what
// it is taken of was assigned there alone: at the edge the neighbour has an old value.
static void warn_derivatives(const Stage& stage, const Detail& detail, Diagnostics& diagnostics) {
    if (detail.partial.empty())
        return;
    std::vector<std::vector<Ref>> stored(stage.vars.size());
    for (const Instr& i : stage.instrs)
        if (i.op == Op::Store || i.op == Op::StoreElement)
            stored[size_t(i.imm)].push_back(i.args[i.op == Op::StoreElement]);
    for (const auto& [r, regions] : detail.guarded) {
        const Instr& call = stage.instrs[size_t(r)];
        if (call.op != Op::Call)
            continue;
        const CallSite& site = stage.calls[size_t(call.imm)];
        if (site.kind != CallKind::Dx && site.kind != CallKind::Dy &&
            site.kind != CallKind::CalculateNormal && site.kind != CallKind::Texture &&
            site.kind != CallKind::Environment)
            continue;
        std::vector<Ref> work(site.args.begin(), site.args.end());
        std::set<Ref> seen;
        while (!work.empty()) {
            const Ref a = work.back();
            work.pop_back();
            if (a == None || !seen.insert(a).second)
                continue;
            const Instr& i = stage.instrs[size_t(a)];
            work.insert(work.end(), i.args.begin(), i.args.end());
            if (i.op != Op::Load && i.op != Op::LoadElement)
                continue;
            const auto stores = detail.partial.find(i.imm);
            const bool there = stores != detail.partial.end() &&
                               std::any_of(regions.begin(), regions.end(), [&](const void* where) {
                                   return stores->second.count(where) > 0;
                               });
            if (!there) {
                work.insert(work.end(), stored[size_t(i.imm)].begin(), stored[size_t(i.imm)].end());
                continue;
            }
            const bool texture = site.kind == CallKind::Texture || site.kind == CallKind::Environment;
            diagnostics.warning(
                site.loc, std::string(texture ? "the filter's width follows" : "the derivative is taken") +
                              " from neighbours, under a condition that varies over the surface: \"" +
                              stage.vars[size_t(i.imm)].name +
                              "\" has its value only where the condition holds, so it is wrong along the "
                              "edge. Compute it before the condition");
            break;
        }
    }
}

void infer_detail(Stage& stage, const Variant& variant, Diagnostics* diagnostics) {
    if (!stage.root)
        return;
    clear_masks(*stage.root);
    Detail detail(stage, variant);
    detail.run();
    if (!diagnostics)
        return;
    warn_derivatives(stage, detail, *diagnostics);
    for (const auto& [loc, v] : detail.broken) {
        const Var& var = stage.vars[size_t(v)];
        if (var.must_be_uniform)
            diagnostics->warning(loc, "\"" + var.name +
                                          "\" is declared uniform, but is given a value that varies over the "
                                          "surface: it is taken as varying");
        else
            diagnostics->error(loc, "a string cannot vary over the surface; make what it depends on uniform");
    }
}

} // namespace kanuka::sl::ir
