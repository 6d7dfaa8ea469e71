#include "sl/ir/lower/parameters.h"

#include <algorithm>

#include "sl/ir/lower/coshaders.h"
#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/handles.h"

namespace kanuka::sl::ir {

using namespace ast;

static sl::Type public_type(Base b) {
    switch (b) {
    case Base::Color:
        return sl::Type::Color;
    case Base::Point:
        return sl::Type::Point;
    case Base::Vector:
        return sl::Type::Vector;
    case Base::Normal:
        return sl::Type::Normal;
    case Base::Matrix:
        return sl::Type::Matrix;
    case Base::String:
        return sl::Type::String;
    case Base::Shader:
        return sl::Type::Shader;
    default:
        return sl::Type::Float;
    }
}

void ParameterLowerer::declare() {
    // The shader's own, then the co-shaders', each under its handle.
    for (const VarDecl* v : m_context.shader.parameters)
        add(v, std::string(v->name));
    for (size_t u = 0; m_context.linked && u < m_context.linked->units.size(); u++)
        for (const VarDecl* v : m_context.linked->units[u].shader->parameters)
            add(v, m_context.linked->units[u].given->handle + "." + std::string(v->name));
}

void ParameterLowerer::default_values() {
    for (size_t index = 0; index < m_parameters.size(); index++)
        default_value(m_parameters[index], int(index));
}

void ParameterLowerer::add(const VarDecl* v, std::string name) {
    m_index[v] = int(m_program.parameters.size());
    m_parameters.push_back(v);
    Parameter p;
    p.name = std::move(name);
    p.type = public_type(v->type.base);
    p.varying = v->detail == Detail::Varying;
    p.output = v->output;
    p.array_size = v->type.array ? v->type.size : 0;
    p.resizable = v->resizable;
    p.doc = v->doc;
    Place place;
    place.text = ty(v->type) == Ty::String;
    const int elements = v->resizable ? std::max(ResizableRoom, p.array_size) : std::max(1, p.array_size);
    place.count = comps(ty(v->type)) * elements;
    place.varying = p.varying && !place.text && !v->type.array;
    int& size = place.text ? m_program.strings : m_program.floats;
    place.offset = size;
    size += place.count;
    if (v->resizable)
        place.length = m_program.floats++;
    if (ty(v->type) == Ty::Void)
        m_diagnostics.error(v->loc, "a parameter cannot be a " + v->type.str());
    m_program.parameters.push_back(std::move(p));
    m_program.places.push_back(place);
}

// A default value that only the surface knows (varying vector direction = dPdu) is computed where the shader
// runs.
bool ParameterLowerer::late_default(const VarDecl* v) {
    const auto varies = [](auto& self, const Expr* e) -> bool {
        if (!e)
            return false;
        if (e->kind == ExprKind::Name && e->var && e->var->kind == VarDecl::Global)
            return e->text != "PI" && e->text != "ncomps" && e->text != "null";
        for (const Expr* a : e->args)
            if (self(self, a))
                return true;
        return false;
    };
    return v->init && !v->type.array && ty(v->type) != Ty::String && varies(varies, v->init);
}

// As many values as a parameter has; those that are not given are zero.
static void fill(Parameter& p, Ty ty, size_t elements) {
    if (ty == Ty::String)
        p.strings.resize(elements);
    else
        p.floats.resize(size_t(comps(ty)) * elements);
}

void ParameterLowerer::default_value(const VarDecl* v, int index) {
    Parameter& p = m_program.parameters[size_t(index)];
    ast::Type element = v->type;
    element.array = false;
    const Ty t = ty(element);
    if (!v->init)
        return fill(p, t, v->type.array ? size_t(v->type.size) : 1);
    if (late_default(v)) {
        m_program.places[size_t(index)].length = m_program.floats++;
        return fill(p, t, 1);
    }
    const std::vector<Ref> values = given_values(v, element, p.array_size);
    const bool constant = std::ranges::all_of(
        values, [&](Ref r) { return m_b.at(r).op == Op::Const || m_b.at(r).op == Op::Text; });
    if (constant) {
        for (Ref r : values)
            if (t == Ty::String)
                p.strings.push_back(m_b.at(r).text);
            else
                p.floats.insert(p.floats.end(), m_b.at(r).floats.begin(), m_b.at(r).floats.end());
        return fill(p, t, v->type.array ? size_t(std::max(0, p.array_size)) : 1);
    }
    if (element.base == Base::String && v->type.array) {
        m_diagnostics.error(v->init->loc, "the default values of an array of strings must be constants");
        return;
    }
    for (size_t k = 0; k < values.size(); k++) {
        const int var = m_b.var(p.name, t, v->loc);
        m_b.declare(var);
        m_b.store(var, values[k], v->loc);
        m_program.defaults.outputs.push_back({Output::Parameter, var, index, int(k)});
    }
}

std::vector<Ref> ParameterLowerer::given_values(const VarDecl* v, const ast::Type& element, int size) {
    std::vector<Ref> values;
    if (v->init->kind == ExprKind::List)
        for (const Expr* a : v->init->args)
            values.push_back(expr_as(a, element));
    else if (!v->init->type.array) // else it is an empty array of a function
        values.assign(size_t(std::max(1, size)), expr_as(v->init, element));
    if (v->type.array && int(values.size()) > size)
        values.resize(size_t(size));
    return values;
}

Binding ParameterLowerer::bind(const VarDecl* v) {
    const int index = m_index[v];
    const Ty t = ty(v->type);
    // What a co-shader's handle is known to be
    const Parameter& parameter = m_program.parameters[size_t(index)];
    const std::vector<std::string>* known =
        t == Ty::String && m_context.linked ? tracker().connected(parameter.name) : nullptr;
    if (!known && v->type.base == Base::Shader)
        known = &parameter.strings;
    if (const Binding layered = coshaders().bind_layered(v); layered.kind != Binding::None)
        return layered;
    if (late_default(v))
        return bind_late(v, index);
    if (v->type.array)
        return bind_array(v, index, known);
    const auto value = [&] {
        return known ? m_b.text(known->empty() ? std::string() : tracker().known((*known)[0]))
                     : m_b.leaf(Op::Param, t, index);
    };
    Binding b;
    if (!v->output && !v->assigned) {
        b.kind = Binding::Value;
        b.value = value();
        return b;
    }
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), t, v->loc);
    in_prologue([&] {
        m_b.declare(b.var);
        m_b.store(b.var, value(), v->loc);
    });
    return b;
}

// Its default value, unless one is given.
Binding ParameterLowerer::bind_late(const VarDecl* v, int index) {
    Binding b;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), ty(v->type), v->loc);
    in_prologue([&] {
        const Ref value = expr_as(v->init, v->type); // may bind globals, in the prologue too
        const Ref given = m_b.leaf(Op::Param, Ty::Float, index);
        m_b.stage().instrs[given].floats = {0, 0};
        const Ref own = m_b.leaf(Op::Param, ty(v->type), index);
        m_b.declare(b.var);
        m_b.store(b.var, m_b.emit(Op::Select, ty(v->type), {expressions().truth(given), own, value}, v->loc),
                  v->loc);
    });
    return b;
}

// Elements are copied: constants of the instance, so the copies fold away where they are not indexed.
Binding ParameterLowerer::bind_array(const VarDecl* v, int index, const std::vector<std::string>* handles) {
    const Ty t = ty(v->type);
    const int room = m_program.places[size_t(index)].count / comps(t);
    const int count = handles ? std::min(room, int(handles->size())) : room;
    const auto element = [&](std::vector<float> which, Ty type) {
        const Ref r = m_b.leaf(Op::Param, type, index);
        m_b.stage().instrs[r].floats = std::move(which);
        return r;
    };
    Binding b;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), t, v->loc, room);
    in_prologue([&] {
        m_b.declare(b.var);
        for (int i = 0; i < count; i++) {
            const Ref r = handles ? m_b.text(tracker().known((*handles)[size_t(i)])) : element({float(i)}, t);
            m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), r}, v->loc, b.var);
        }
        if (!v->resizable)
            return;
        b.length = m_b.var(std::string(v->name) + ".length", Ty::Float, v->loc);
        m_b.declare(b.length);
        m_b.store(b.length, handles ? m_b.constant(float(count)) : element({0, 0}, Ty::Float), v->loc);
    });
    return b;
}

} // namespace kanuka::sl::ir
