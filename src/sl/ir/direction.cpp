// What depends on the direction a surface is seen from. Shading runs before any ray is traced, so nothing
// that a surface hands out may: the source of all direction is E, which I = P - E brings in.
#include <algorithm>
#include <tuple>

#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

namespace {

class Walk {
  public:
    explicit Walk(const Stage& s) : m_stage(s) {
        m_d.refs.assign(s.instrs.size(), false);
        m_d.vars.assign(s.vars.size(), false);
        for (size_t r = 0; r < s.instrs.size(); r++)
            m_d.refs[r] = s.instrs[r].op == Op::Input && Input(s.instrs[r].imm) == Input::E;
    }
    Directions run() {
        do {
            m_changed = false;
            walk(*m_stage.root, false);
        } while (m_changed);
        return std::move(m_d);
    }

  private:
    void walk(const Block& b, bool control) {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                const Instr& i = m_stage.instrs[size_t(item.ref)];
                bool depends = false;
                for (Ref a : i.args)
                    depends = depends || m_d.refs[size_t(a)];
                if (i.op == Op::Closure || (i.op == Op::Call && m_stage.calls[size_t(i.imm)].frozen))
                    depends = false; // light comes later, from wherever it comes
                if (i.op == Op::Load || i.op == Op::LoadElement)
                    depends = depends || m_d.vars[size_t(i.imm)];
                if ((i.op == Op::Store || i.op == Op::StoreElement) && (depends || control) &&
                    !m_d.vars[size_t(i.imm)]) {
                    m_d.vars[size_t(i.imm)] = true;
                    m_changed = true;
                }
                if (depends && !m_d.refs[size_t(item.ref)]) {
                    m_d.refs[size_t(item.ref)] = true;
                    m_changed = true;
                }
            }
            const bool inner = control || (item.kind == Item::If && m_d.refs[size_t(item.ref)]);
            if (item.body)
                walk(*item.body, inner);
            if (item.orelse)
                walk(*item.orelse, inner);
        }
    }
    const Stage& m_stage;
    Directions m_d;
    bool m_changed = false;
};

} // namespace

Directions find_directions(const Stage& stage) {
    return Walk(stage).run();
}

// What of the material depends on it: "diffuse, presence".
static std::string dependents(const Program& program, const Directions& d) {
    std::string names;
    std::vector<std::string> seen;
    for (const Output& o : program.shade.outputs) {
        if (o.var < 0 || !d.vars[size_t(o.var)])
            continue;
        std::string name = "the normal";
        if (o.kind == Output::Slot && o.index < int(program.channels.size())) {
            const Channel& c = program.channels[size_t(o.index)];
            name = c.presence ? "presence" : c.node;
        }
        if (std::find(seen.begin(), seen.end(), name) != seen.end())
            continue;
        seen.push_back(name);
        names += (names.empty() ? "" : ", ") + name;
    }
    return names;
}

void check_directions(const Program& program, bool frozen, Diagnostics& diagnostics) {
    const Stage& stage = program.shade;
    if (!stage.root)
        return;
    const Directions d = find_directions(stage);
    const std::string names = dependents(program, d);
    if (names.empty())
        return;
    // Everything that no output needs is gone: each place where the eye comes in matters.
    std::vector<Loc> places;
    const auto search = [&](auto& again, const Block& b) -> void {
        for (const Item& item : b.items) {
            if (item.kind == Item::Instruction) {
                const Instr& i = stage.instrs[size_t(item.ref)];
                bool source = false;
                for (Ref a : i.args)
                    source = source || (stage.instrs[size_t(a)].op == Op::Input &&
                                        Input(stage.instrs[size_t(a)].imm) == Input::E);
                if (source && i.op != Op::Closure)
                    places.push_back(i.loc);
            }
            if (item.body)
                again(again, *item.body);
            if (item.orelse)
                again(again, *item.orelse);
        }
    };
    search(search, *stage.root);
    std::stable_sort(places.begin(), places.end(), [](Loc a, Loc b) {
        return std::tie(a.file, a.line, a.column) < std::tie(b.file, b.line, b.column);
    });
    const std::string what = "the material (" + names +
                             ") depends on the viewing direction I here, which is not known: shading runs "
                             "before rays. ";
    const std::string instead =
        "Give the direction to the lobe instead: a Fresnel effect is fresnel() times trace() or specular(), "
        "or MicrofacetDielectricBrdf, a rim \"coat\" or edgeReflectance of MicrofacetConductorBrdf; "
        "faceforward(), specular() and trace() take I";
    if (frozen && !places.empty())
        diagnostics.warning(places[0], what +
                                           "It is frozen to that of the dicing camera (I = P - E), so that "
                                           "mirrors and other views see it from there too. " +
                                           instead);
    else
        for (size_t k = 0; k < places.size() && k < 4; k++)
            diagnostics.error(places[k], what + instead);
}

} // namespace kanuka::sl::ir
