#include "sl/ir/lower/light_loops.h"

#include <algorithm>
#include <cmath>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/directions.h"
#include "sl/ir/lower/functions.h"
#include "sl/ir/lower/statements.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

// Directions of a projected loop: 16 rings of equal solid angle, two opposite ones on each. The sum over a
// hemisphere of any function linear in L is exact, so that N . L is diffuse() itself.
static constexpr int LoopDirections = 32;

// The position: categories come before it.
size_t LightLoopLowerer::first_argument(const Stmt* s) {
    size_t k = 0;
    while (k < s->args.size() && s->args[k]->type.is(Base::String))
        k++;
    return k;
}

// illuminance([category,] position, [axis, angle,] ["name", value, …])
LightLoopLowerer::Cone LightLoopLowerer::cone_of(const Stmt* s) {
    const size_t k = first_argument(s);
    Cone cone;
    if (k + 2 < s->args.size() && s->args[k + 1]->type.triple() && !s->args[k + 2]->type.is(Base::String)) {
        cone.axis = expr_as(s->args[k + 1], {Base::Vector});
        cone.angle = expr_as(s->args[k + 2], {Base::Float});
    }
    return cone;
}

void LightLoopLowerer::illuminance(const Stmt* s) {
    if (m_state.role == Role::Filter && m_program.kind == ShaderKind::Volume)
        return ask_lights(s);
    if (!m_state.lit) {
        if (m_program.kind == ShaderKind::Class)
            m_diagnostics.error(s->loc, "an illuminance loop belongs into a surface shader; here use a lobe");
        else
            m_diagnostics.warning(s->loc, "an illuminance loop belongs into a surface shader: there is no "
                                          "light here yet, and its body does not run");
        return;
    }
    const int number = m_seen++;
    const auto it = m_context.options.projected.find(number);
    if (it == m_context.options.projected.end())
        return read(s, number);
    if (!m_program.gathers_light)
        return project(s, it->second);
    m_diagnostics.warning(s->loc,
                          "this illuminance loop's kernel (line " + std::to_string(it->second.line) +
                              ") is not that of a lobe: it is run for the lights of the scene, without "
                              "shadows and as the dicing camera sees it, and shines");
    ask_lights(s);
}

// The loop is the integral that a lobe stands for: its body is read once.
void LightLoopLowerer::read(const Stmt* s, int number) {
    const LightState outer = m_state.light;
    m_state.light.number = number;
    m_state.light.sample = ir::None;
    m_state.light.depth++;
    cone_of(s);
    const Binding color = bind_color(s->loc);
    if (VarDecl* l = m_sema.global("L"); l->assigned)
        store_tagged(bind(l).var, directions().to_light(Tag::Light, s->loc), s->loc);
    m_b.store(m_state.bindings[m_sema.global("Cl")].var,
              directions().kernel(Closure::Light, Ty::Triple, {}, Tag::None, s->loc), s->loc);
    const int target = m_b.stage().targets++;
    Item scope{Item::Scope};
    scope.target = target;
    scope.loc = s->loc;
    m_state.loops.targets.push_back({target, target});
    scope.body = in_block([&] { statements().statement(s->body); });
    m_state.loops.targets.pop_back();
    m_b.item(scope);
    m_state.light = outer;
    m_state.bindings[m_sema.global("Cl")] = color;
}

// A volume shader's light is what it finds on its way: its loop runs over the lights of the scene, without
// shadows. The host answers for one of them at a time, at the loop's point of every vertex. So does a
// surface's whose kernel is no lobe's, where that is asked for.
//
//   scope leave { loop { if (counter >= lights) leave; L = …; Cl = …; scope next { if (lit) body } counter +=
//   1 } }
void LightLoopLowerer::ask_lights(const Stmt* s) {
    const Loc at = s->loc;
    const auto ask = [&](CallKind kind, Ty ty, std::vector<Ref> args) {
        CallSite site{kind, at};
        site.args = std::move(args);
        return m_b.call(std::move(site), ty);
    };
    const size_t k = first_argument(s);
    if (k >= s->args.size())
        return m_diagnostics.error(at, "illuminance takes a position: illuminance (P) { … }");
    const Ref P = expr_as(s->args[k], {Base::Point});
    Cone cone = cone_of(s);
    if (cone.axis != ir::None && tag(cone.axis) == Tag::Facing)
        cone.axis = directions().turned(cone.axis, at);
    const LightState outer = m_state.light;
    m_state.light.depth = 0;
    const Ref lights = ask(CallKind::Lights, Ty::Float, {});
    const Binding hidden = bind_color(at);
    const int color = m_state.bindings[m_sema.global("Cl")].var;
    Ref lit = ir::None;
    const auto ask_light = [&](Ref now) {
        m_state.light.sample = ask(CallKind::LightDirection, Ty::Triple, {now, P});
        const Ref Cl = ask(CallKind::LightColor, Ty::Triple, {now, P});
        m_b.store(color, Cl, at);
        set_direction(m_state.light.sample, at);
        lit = lit_cone(cone, m_state.light.sample, Cl, at);
    };
    statements().repeat("light", lights, at, ask_light, [&] {
        Item shines{Item::If};
        shines.ref = lit;
        shines.loc = at;
        shines.body = in_block([&] { statements().statement(s->body); });
        shines.orelse = m_b.stage().block();
        m_b.item(shines);
    });
    m_state.light = outer;
    m_state.bindings[m_sema.global("Cl")] = hidden;
}

// Does light of this colour come from within the cone?
Ref LightLoopLowerer::lit_cone(const Cone& cone, Ref L, Ref Cl, Loc at) {
    const auto f = [&](float x) { return m_b.constant(x); };
    const auto op = [&](Op o, Ty t, Ref a, Ref b) { return m_b.emit(o, t, {a, b}, at); };
    const auto dot = [&](Ref a, Ref b) { return op(Op::Dot, Ty::Float, a, b); };
    const Ref bright = op(Op::Gt, Ty::Bool, dot(Cl, Cl), f(0));
    if (cone.axis == ir::None)
        return bright;
    // L . axis >= cos(angle) |L| |axis|
    const Ref low = m_b.emit(Op::Math1, Ty::Float, {op(Op::Min, Ty::Float, cone.angle, f(3.14159265f))}, at,
                             int(Fn::Cos));
    const Ref size =
        m_b.emit(Op::Sqrt, Ty::Float, {op(Op::Mul, Ty::Float, dot(L, L), dot(cone.axis, cone.axis))}, at);
    return op(Op::And, Ty::Bool, bright,
              op(Op::Ge, Ty::Bool, dot(L, cone.axis), op(Op::Mul, Ty::Float, low, size)));
}

// L, where the shader assigns to it and so has a variable.
void LightLoopLowerer::set_direction(Ref L, Loc at) {
    if (VarDecl* l = m_sema.global("L"); l->assigned)
        store_tagged(bind(l).var, L, at);
}

// Each loop has a Cl of its own. Returns the binding that it hides.
Binding LightLoopLowerer::bind_color(Loc at) {
    Binding& b = m_state.bindings[m_sema.global("Cl")];
    const Binding old = b;
    b = {};
    b.kind = Binding::Variable;
    b.var = m_b.var("Cl", Ty::Triple, at);
    m_b.declare(b.var);
    return old;
}

void LightLoopLowerer::project(const Stmt* s, Loc reason) {
    m_diagnostics.warning(s->loc, "this illuminance loop's kernel (line " + std::to_string(reason.line) +
                                      ") is not that of a lobe: its albedo is kept, as Lambert reflection. "
                                      "Known are Cl times N . L, pow(N . H, n), pow(R . L, n) and "
                                      "specularbrdf()");
    const Loc at = s->loc;
    const auto f = [&](float x) { return m_b.constant(x); };
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, m_b.at(a).ty, {a, b}, at); };
    // ---- the cone: cosines from `low` to 1 about the axis; all directions about N where there is none
    Cone cone = cone_of(s);
    if (cone.axis == ir::None) {
        cone.axis = variables().global("N", at);
        cone.angle = f(3.14159265f);
    }
    if (tag(cone.axis) == Tag::Facing || tag(cone.axis) == Tag::Behind)
        cone.axis = directions().turned(cone.axis, at);
    Ref low;
    if (m_b.is_const(cone.angle)) {
        low = f(std::cos(std::min(std::max(m_b.at(cone.angle).floats[0], 0.01f), 3.14159265f)));
    } else {
        const Ref angle = op(Op::Min, op(Op::Max, cone.angle, f(0.01f)), f(3.14159265f));
        low = m_b.emit(Op::Math1, Ty::Float, {angle}, at, int(Fn::Cos));
    }
    const Ref weight = op(Op::Mul, op(Op::Sub, f(1), low), f(2.0f / float(LoopDirections)));
    // ---- Cl: one in each direction while the loop runs; afterwards the sum stands for the integral
    const int reference = reference_value("Cl", at);
    m_b.store(reference, f(1), at);
    const Ref light = m_b.emit(Op::Closure, Ty::Triple, {}, at, int(Closure::LightSample));
    m_b.stage().instrs[size_t(light)].floats = {float(reference)};
    const Binding hidden = bind_color(at);
    const int color = m_state.bindings[m_sema.global("Cl")].var;
    const LightState outer = m_state.light;
    m_state.light.depth = 0;
    const auto choose = [&](Ref now) {
        constexpr int half = LoopDirections / 2;
        m_state.light.sample =
            functions().source_call("__light_direction", {cone.axis, low, now, f(float(half))}, at);
        m_b.store(color, light, at);
        set_direction(m_state.light.sample, at);
    };
    statements().repeat(
        "direction", f(float(LoopDirections)), at, choose, [&] { statements().statement(s->body); }, light);
    m_b.store(reference, weight, at);
    m_state.light = outer;
    m_state.bindings[m_sema.global("Cl")] = hidden;
}

int LightLoopLowerer::reference_value(const char* name, Loc at) {
    const int var = m_b.var(name, Ty::Float, at);
    in_prologue([&] {
        m_b.declare(var);
        m_b.store(var, m_b.constant(0.0f), at);
    });
    return var;
}

// gather(category, P, direction, angle, samples, "name", variable, …) body else misses
//
// Rays come after shading. Along a mirrored or refracted view direction each ray is one of trace(), and the
// body runs for every sample with what it sees; anywhere else (occlusion, colour bleeding) all rays miss, for
// transport does that part. Both run `samples` times, since shaders divide by that number.
void LightLoopLowerer::gather(const Stmt* s) {
    if (m_state.role != Role::Shade) {
        m_diagnostics.warning(s->loc, "gather() has no rays here: nothing of it runs");
        return;
    }
    std::vector<Ref> values;
    for (size_t k = 0; k < s->args.size() && k < 5; k++)
        values.push_back(k > 0 && s->args[k]->kind == ExprKind::String ? ir::None : expr(s->args[k]));
    if (values.size() < 5 || std::count(values.begin() + 1, values.end(), ir::None) > 0) {
        m_diagnostics.error(s->loc, "gather() takes a category, a point, a direction, an angle and a number "
                                    "of samples, then names and variables");
        return;
    }
    const bool number = m_b.at(values[4]).ty == Ty::Float;
    const Stmt* body = seen_by_rays(s, values) ? s->body : s->orelse;
    if (body)
        statements().repeat(
            "ray", number ? values[4] : m_b.constant(1.0f), s->loc, [](Ref) {},
            [&] { statements().statement(body); });
}

// Assigns what rays bring back. Do they see anything?
bool LightLoopLowerer::seen_by_rays(const Stmt* s, const std::vector<Ref>& values) {
    const Ref direction = values[2];
    const Tag t = tag(direction);
    const bool view = m_state.lit && (t == Tag::Mirrored || t == Tag::Refracted);
    bool seen = false;
    for (size_t k = 5; k + 1 < s->args.size(); k += 2) {
        const Expr *name = s->args[k], *variable = s->args[k + 1];
        if (name->kind != ExprKind::String || !variable->var)
            continue;
        const bool color = ty(variable->type) == Ty::Triple;
        if (view && color && name->text.starts_with("surface:")) {
            seen = true;
            assignments().assign_to(variable,
                                    m_b.emit(Op::Closure, Ty::Triple, {direction}, s->loc,
                                             int(t == Tag::Mirrored ? Closure::Mirror : Closure::Refraction)),
                                    s->loc);
        } else if (name->text == "ray:direction" && color) {
            assignments().assign_to(variable, direction, s->loc);
        } else if (name->text == "ray:origin" && color) {
            assignments().assign_to(variable, values[1], s->loc);
        } else if (name->text == "ray:length" && ty(variable->type) == Ty::Float) {
            assignments().assign_to(variable, m_b.constant(1e10f), s->loc);
        }
    }
    return seen;
}

} // namespace kanuka::sl::ir
