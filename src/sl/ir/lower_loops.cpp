// Loops over light and rays, and what else asks for light that comes only after shading.
//
// An illuminance loop is read in one of two ways. Once, with L and Cl as symbols (lower_light.cpp): then its
// kernel is that of a lobe, and exact. Where closures.cpp finds that it is none, the loop is lowered again,
// projected: its body runs for a fixed set of directions, evenly spread over the loop's cone, and what the
// directions add up to is the albedo of the kernel f, a = 1/pi integral of f over the cone, which becomes a
// Lambert lobe's. (In RISpec a light of colour Cl makes a surface of f = N . L show Cl, so a = 1 there.)
#include <algorithm>
#include <cmath>
#include <utility>

#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

// Directions of a projected loop: 16 rings of equal solid angle, two opposite ones on each. The sum over a
// hemisphere of any function linear in L is exact, so that N . L is diffuse() itself.
static constexpr int Directions = 32;

// illuminance([category,] position, [axis, angle,] ["name", value, …])
Lower::Cone Lower::cone_of(const Stmt* s) {
    size_t k = 0;
    while (k < s->args.size() && s->args[k]->type.is(Base::String))
        k++;
    Cone cone;
    if (k + 2 < s->args.size() && s->args[k + 1]->type.triple() && !s->args[k + 2]->type.is(Base::String)) {
        cone.axis = expr_as(s->args[k + 1], {Base::Vector});
        cone.angle = expr_as(s->args[k + 2], {Base::Float});
    }
    return cone;
}

void Lower::illuminance(const Stmt* s) {
    if (m_role == Role::Filter && m_program.kind == ShaderKind::Volume)
        return ask_lights(s);
    if (!m_lit) {
        if (m_program.kind == ShaderKind::Class)
            m_diagnostics.error(s->loc, "an illuminance loop belongs into a surface shader; here use a lobe");
        else
            m_diagnostics.warning(s->loc, "an illuminance loop belongs into a surface shader: there is no "
                                          "light here yet, and its body does not run");
        return;
    }
    const int number = m_loops_seen++;
    if (const auto it = m_projected.find(number); it != m_projected.end()) {
        if (!m_program.gathers_light)
            return project(s, it->second);
        m_diagnostics.warning(s->loc,
                              "this illuminance loop's kernel (line " + std::to_string(it->second.line) +
                                  ") is not that of a lobe: it is run for the lights of the scene, without "
                                  "shadows and as the dicing camera sees it, and shines");
        return ask_lights(s);
    }
    // The loop is the integral that a lobe stands for: its body is read once.
    const int outer = m_loop;
    const Ref sample = m_sample;
    m_loop = number;
    m_sample = ir::None;
    m_illuminance++;
    cone_of(s);
    const Binding color = bind_color(s->loc);
    if (VarDecl* l = m_sema.global("L"); l->assigned)
        store_tagged(bind(l).var, light_direction(Tag::Light, s->loc), s->loc);
    m_b.store(m_bind[m_sema.global("Cl")].var, kernel(Closure::Light, Ty::Triple, {}, Tag::None, s->loc),
              s->loc);
    const int target = m_b.stage().targets++;
    Item scope{Item::Scope};
    scope.target = target;
    scope.loc = s->loc;
    m_loops.push_back({target, target});
    scope.body = in_block([&] { statement(s->body); });
    m_loops.pop_back();
    m_b.item(scope);
    m_illuminance--;
    m_sample = sample;
    m_loop = outer;
    m_bind[m_sema.global("Cl")] = color;
}

// A volume shader's light is what it finds on its way: its loop runs over the lights of the scene, without
// shadows. The host answers for one of them at a time, at the loop's point of every vertex. So does a
// surface's whose kernel is no lobe's, where that is asked for.
//
//   scope leave { loop { if (counter >= lights) leave; L = …; Cl = …; scope next { if (lit) body } counter +=
//   1 } }
void Lower::ask_lights(const Stmt* s) {
    const Loc at = s->loc;
    const auto f = [&](float x) { return m_b.constant(x); };
    const auto op = [&](Op o, Ty t, Ref a, Ref b) { return m_b.emit(o, t, {a, b}, at); };
    const auto dot = [&](Ref a, Ref b) { return op(Op::Dot, Ty::Float, a, b); };
    const auto ask = [&](CallKind kind, Ty ty, std::vector<Ref> args) {
        CallSite site{kind, at};
        site.args = std::move(args);
        return m_b.call(std::move(site), ty);
    };
    size_t k = 0;
    while (k < s->args.size() && s->args[k]->type.is(Base::String))
        k++;
    if (k >= s->args.size())
        return m_diagnostics.error(at, "illuminance takes a position: illuminance (P) { … }");
    const Ref P = expr_as(s->args[k], {Base::Point});
    Cone cone = cone_of(s);
    if (cone.axis != ir::None && tag(cone.axis) == Tag::Facing)
        cone.axis = turned(cone.axis, at);
    const int illuminance = std::exchange(m_illuminance, 0);
    const Ref lights = ask(CallKind::Lights, Ty::Float, {});
    const Ref sample = m_sample;
    const Binding hidden = bind_color(at);
    const int color = m_bind[m_sema.global("Cl")].var;
    Ref lit = ir::None;
    const auto ask_light = [&](Ref now) {
        m_sample = ask(CallKind::LightDirection, Ty::Triple, {now, P});
        const Ref Cl = ask(CallKind::LightColor, Ty::Triple, {now, P});
        m_b.store(color, Cl, at);
        if (VarDecl* l = m_sema.global("L"); l->assigned)
            store_tagged(bind(l).var, m_sample, at);
        lit = op(Op::Gt, Ty::Bool, dot(Cl, Cl), f(0));
        if (cone.axis != ir::None) { // L . axis >= cos(angle) |L| |axis|
            const Ref low = m_b.emit(Op::Math1, Ty::Float,
                                     {op(Op::Min, Ty::Float, cone.angle, f(3.14159265f))}, at, int(Fn::Cos));
            const Ref size =
                m_b.emit(Op::Sqrt, Ty::Float,
                         {op(Op::Mul, Ty::Float, dot(m_sample, m_sample), dot(cone.axis, cone.axis))}, at);
            lit = op(Op::And, Ty::Bool, lit,
                     op(Op::Ge, Ty::Bool, dot(m_sample, cone.axis), op(Op::Mul, Ty::Float, low, size)));
        }
    };
    repeat("light", lights, at, ask_light, [&] {
        Item shines{Item::If};
        shines.ref = lit;
        shines.loc = at;
        shines.body = in_block([&] { statement(s->body); });
        shines.orelse = m_b.stage().block();
        m_b.item(shines);
    });
    m_illuminance = illuminance;
    m_sample = sample;
    m_bind[m_sema.global("Cl")] = hidden;
}

// counter = 0; scope leave { loop { if (counter >= count) leave; begin(counter); scope next { body } counter
// += 1 } }
void Lower::repeat(const char* counter_name, Ref count, Loc at, const std::function<void(Ref)>& begin,
                   const std::function<void()>& body, Ref light) {
    const int counter = m_b.var(counter_name, Ty::Float, at);
    const LoopTargets targets{m_b.stage().targets, m_b.stage().targets + 1};
    m_b.stage().targets += 2;
    Item outer{Item::Scope};
    outer.target = targets.leave;
    outer.loc = at;
    outer.light = light;
    outer.body = in_block([&] {
        m_b.declare(counter);
        m_b.store(counter, m_b.constant(0.0f), at);
        Item forever{Item::Loop};
        forever.loc = at;
        forever.body = in_block([&] {
            const Ref now = m_b.load(counter, at);
            Item done{Item::If};
            done.ref = m_b.emit(Op::Ge, Ty::Bool, {now, count}, at);
            done.loc = at;
            done.body = in_block([&] { jump(targets.leave, at); });
            done.orelse = m_b.stage().block();
            m_b.item(done);
            begin(now);
            pass(targets, at, body);
            m_b.store(counter, m_b.emit(Op::Add, Ty::Float, {m_b.load(counter, at), m_b.constant(1.0f)}, at),
                      at);
        });
        m_b.item(forever);
    });
    m_b.item(outer);
}

// Each loop has a Cl of its own. Returns the binding that it hides.
Lower::Binding Lower::bind_color(Loc at) {
    Binding& b = m_bind[m_sema.global("Cl")];
    const Binding old = b;
    b = {};
    b.kind = Binding::Variable;
    b.var = m_b.var("Cl", Ty::Triple, at);
    m_b.declare(b.var);
    return old;
}

void Lower::project(const Stmt* s, Loc reason) {
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
        cone.axis = expr_global("N", at);
        cone.angle = f(3.14159265f);
    }
    if (tag(cone.axis) == Tag::Facing || tag(cone.axis) == Tag::Behind)
        cone.axis = turned(cone.axis, at);
    Ref low;
    if (m_b.is_const(cone.angle)) {
        low = f(std::cos(std::min(std::max(m_b.at(cone.angle).floats[0], 0.01f), 3.14159265f)));
    } else {
        const Ref angle = op(Op::Min, op(Op::Max, cone.angle, f(0.01f)), f(3.14159265f));
        low = m_b.emit(Op::Math1, Ty::Float, {angle}, at, int(Fn::Cos));
    }
    const Ref weight = op(Op::Mul, op(Op::Sub, f(1), low), f(2.0f / float(Directions)));
    // ---- Cl: one in each direction while the loop runs; afterwards the sum stands for the integral
    const int reference = reference_value("Cl", at);
    m_b.store(reference, f(1), at);
    const Ref light = m_b.emit(Op::Closure, Ty::Triple, {}, at, int(Closure::LightSample));
    m_b.stage().instrs[size_t(light)].floats = {float(reference)};
    const Binding hidden = bind_color(at);
    const int color = m_bind[m_sema.global("Cl")].var;
    const int illuminance = m_illuminance;
    const Ref sample = m_sample;
    m_illuminance = 0;
    const auto choose = [&](Ref now) {
        constexpr int half = Directions / 2;
        m_sample = source_call("__light_direction", {cone.axis, low, now, f(float(half))}, at);
        m_b.store(color, light, at);
        if (VarDecl* l = m_sema.global("L"); l->assigned)
            store_tagged(bind(l).var, m_sample, at);
    };
    repeat("direction", f(float(Directions)), at, choose, [&] { statement(s->body); }, light);
    m_b.store(reference, weight, at);
    m_illuminance = illuminance;
    m_sample = sample;
    m_bind[m_sema.global("Cl")] = hidden;
}

// ---- gather

// gather(category, P, direction, angle, samples, "name", variable, …) body else misses
//
// Rays come after shading. Along a mirrored or refracted view direction each ray is one of trace(), and the
// body runs for every sample with what it sees; anywhere else (occlusion, colour bleeding) all rays miss, for
// transport does that part. Both run `samples` times, since shaders divide by that number.
void Lower::gather(const Stmt* s) {
    if (m_role != Role::Shade) {
        m_diagnostics.warning(s->loc, "gather() has no rays here: nothing of it runs");
        return;
    }
    std::vector<Ref> values;
    size_t k = 0;
    for (; k < s->args.size() && k < 5; k++)
        values.push_back(k > 0 && s->args[k]->kind == ExprKind::String ? ir::None : expr(s->args[k]));
    if (values.size() < 5 || std::count(values.begin() + 1, values.end(), ir::None) > 0) {
        m_diagnostics.error(s->loc, "gather() takes a category, a point, a direction, an angle and a number "
                                    "of samples, then names and variables");
        return;
    }
    const Ref direction = values[2];
    const bool number = m_b.at(values[4]).ty == Ty::Float;
    const Tag t = tag(direction);
    const bool view = m_lit && (t == Tag::Mirrored || t == Tag::Refracted);
    bool seen = false;
    for (k = 5; k + 1 < s->args.size(); k += 2) {
        const Expr *name = s->args[k], *variable = s->args[k + 1];
        if (name->kind != ExprKind::String || !variable->var)
            continue;
        const bool color = ty(variable->type) == Ty::Triple;
        if (view && color && name->text.starts_with("surface:")) {
            seen = true;
            assign_to(variable,
                      m_b.emit(Op::Closure, Ty::Triple, {direction}, s->loc,
                               int(t == Tag::Mirrored ? Closure::Mirror : Closure::Refraction)),
                      s->loc);
        } else if (name->text == "ray:direction" && color) {
            assign_to(variable, direction, s->loc);
        } else if (name->text == "ray:origin" && color) {
            assign_to(variable, values[1], s->loc);
        } else if (name->text == "ray:length" && ty(variable->type) == Ty::Float) {
            assign_to(variable, m_b.constant(1e10f), s->loc);
        }
    }
    const Stmt* body = seen ? s->body : s->orelse;
    if (body)
        repeat("ray", number ? values[4] : m_b.constant(1.0f), s->loc, [](Ref) {}, [&] { statement(body); });
}

// ---- queries of rays and lights

// rayinfo (name, variable). A surface is shaded for whatever ray may come: as if for one from the camera.
Ref Lower::ray_info(const Expr* e) {
    const std::string what = e->args[0]->kind == ExprKind::String ? std::string(e->args[0]->text) : "";
    const Expr* target = e->args[1];
    const Ty t = target->var ? ty(target->type) : Ty::Void;
    Ref value = ir::None;
    if (what == "type" && t == Ty::String)
        value = m_b.text("camera");
    else if (what == "direction" && t == Ty::Triple)
        value = expr_global("I", e->loc);
    else if (what == "origin" && t == Ty::Triple && m_role == Role::Shade)
        value = expr_global("E", e->loc);
    else if (t == Ty::Float && (what.ends_with("depth") || what == "shadeopacity" || what == "ismedium"))
        value = zero(t);
    if (value == ir::None || target->type.array ||
        (t == Ty::Triple && m_b.stage().vars[size_t(bind(target->var).var)].must_be_uniform))
        return zero(Ty::Float);
    assign_to(target, value, e->loc);
    return m_b.constant(1.0f);
}

Ref Lower::expr_global(const char* name, Loc at) {
    return global(m_sema.global(name), at);
}

} // namespace kanuka::sl::ir
