// environment(map, R) along a mirrored view direction. A picture that is there is what is seen: looked up
// along R for the dicing camera, plain light (docs/decisions/0006). Where no picture is named, or none is
// found, the surface is a mirror that sees the scene. The name may be an argument's: both are made, and which
// one counts is found out on each grid.
#include "sl/ir/builder.h"
#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

namespace {

class Pictures {
  public:
    Pictures(Stage& stage, bool strict)
        : m_stage(stage), m_b(stage), m_directions(find_directions(stage)), m_strict(strict) {}

    void walk(Block& block) {
        std::vector<Item> old;
        old.swap(block.items);
        for (Item& item : old) {
            m_b.set_block(&block);
            if (item.kind == Item::Instruction && mirrors(item.ref))
                replace(item.ref);
            block.items.push_back(item);
            if (item.body)
                walk(*item.body);
            if (item.orelse)
                walk(*item.orelse);
        }
    }

  private:
    bool mirrors(Ref r) const {
        const Instr& i = m_stage.instrs[size_t(r)];
        return i.op == Op::Call && m_stage.calls[size_t(i.imm)].kind == CallKind::Environment &&
               i.args.size() > 2 && m_directions.refs[size_t(i.args[2])] && i.ty == Ty::Triple;
    }

    // r = there ? the picture : a mirror
    void replace(Ref r) {
        const Instr call = m_stage.instrs[size_t(r)];
        const Loc at = call.loc;
        const Ref name = call.args[0], direction = call.args[2];
        const auto become = [&](Op op, std::vector<Ref> args, int imm) {
            Instr& i = m_stage.instrs[size_t(r)];
            i.op = op;
            i.args = std::move(args);
            i.imm = imm;
        };
        if (m_strict || (m_b.at(name).op == Op::Text && m_b.at(name).text.empty()))
            return become(Op::Closure, {direction}, int(Closure::Environment));

        CallSite ask{CallKind::Query, at};
        ask.args = {name, m_b.text("exists")};
        ask.imm = int(Query::Texture) * 4 + 1;
        const Ref exists = m_b.call(std::move(ask), Ty::Float);
        const Ref there = m_b.emit(Op::Gt, Ty::Bool, {exists, m_b.constant(0.0f)}, at);
        const int seen = m_b.var("environment", Ty::Triple, at);
        m_b.declare(seen);
        m_b.store(seen, m_b.triple(0), at);
        Item choice{Item::If};
        choice.ref = there;
        choice.loc = at;
        choice.body = in_block([&] {
            CallSite look = m_stage.calls[size_t(call.imm)];
            look.frozen = true;
            m_b.store(seen, m_b.call(std::move(look), Ty::Triple), at);
        });
        choice.orelse = in_block([&] {
            Ref none = m_b.emit(Op::SameText, Ty::Bool, {name, m_b.text("")}, at);
            for (const char* traced : {"raytrace", "reflection"}) // what PRMan and BMRT call it
                none = m_b.emit(Op::Or, Ty::Bool,
                                {none, m_b.emit(Op::SameText, Ty::Bool, {name, m_b.text(traced)}, at)}, at);
            Item missing{Item::If};
            missing.ref = m_b.emit(Op::Not, Ty::Bool, {none}, at);
            missing.loc = at;
            missing.body = in_block([&] {
                CallSite tell{CallKind::Printf, at};
                tell.args = {m_b.text("the environment \"%s\" is not found or not read: the scene is "
                                      "mirrored in its place"),
                             name};
                m_b.call(std::move(tell), Ty::Void);
            });
            missing.orelse = m_stage.block();
            m_b.item(missing);
        });
        m_b.item(choice);
        const Ref mirror = m_b.emit(Op::Closure, Ty::Triple, {direction}, at, int(Closure::Environment));
        become(Op::Select, {there, m_b.load(seen, at), mirror}, 0);
    }

    template <class F>
    Block* in_block(F&& body) {
        Block* const outer = m_b.block();
        Block* const made = m_stage.block();
        m_b.set_block(made);
        body();
        m_b.set_block(outer);
        return made;
    }

    Stage& m_stage;
    Builder m_b;
    Directions m_directions;
    bool m_strict;
};

} // namespace

void choose_pictures(Stage& stage, bool strict) {
    Pictures(stage, strict).walk(*stage.root);
}

} // namespace kanuka::sl::ir
