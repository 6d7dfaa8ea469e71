#include "sl/ir/lower/textures.h"

#include <algorithm>

#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

// texture("name"[channel], s, t, "blur", 0.1, …) and its forms without coordinates or with those of four
// corners.
Ref TextureLowerer::texture(const Expr* e, const ops::Signature& s) {
    const bool environment = s.special == ops::Special::Environment;
    CallSite site{environment ? CallKind::Environment : CallKind::Texture, e->loc};
    const Expr* file = e->args[0];
    Ref channel = m_b.constant(0.0f);
    if (file->kind == ExprKind::Index && file->type.is(Base::String) && !file->args[0]->type.array) {
        channel = expr_as(file->args[1], {Base::Float});
        file = file->args[0];
    }
    site.names = {"file", "channel"};
    site.args = {expr(file), channel};
    const std::vector<Ref> where = coordinates(e, environment);
    if (environment) {
        // A refracted direction sees the scene through a lobe, as trace() does; pictures.cpp knows of
        // mirrors.
        if (m_state.lit && !where.empty() && tag(where[0]) == Tag::Refracted && ty(s.result) == Ty::Triple)
            return m_b.emit(Op::Closure, Ty::Triple, {where[0]}, e->loc, int(Closure::Refraction));
        site.names.emplace_back("direction");
        site.args.push_back(where.empty() ? zero(Ty::Triple) : where[0]);
    } else {
        place(site, where);
    }
    options(site, e);
    site.imm = comps(ty(s.result));
    return m_b.call(std::move(site), ty(s.result));
}

// The values between the file's name and the first option.
std::vector<Ref> TextureLowerer::coordinates(const Expr* e, bool environment) {
    std::vector<Ref> where;
    for (size_t i = 1; i < e->args.size() && e->args[i]->kind != ExprKind::String; i++) {
        const Expr* a = e->args[i];
        if (a->type.base != Base::Struct) {
            where.push_back(expr(a));
            continue;
        }
        // A filter region: coordinates, and a direction.
        for (size_t k = environment ? 2 : 0;
             a->var && k < (environment ? 3u : 2u) && k < a->var->fields.size(); k++) {
            Expr field{ExprKind::Name, a->loc};
            field.var = a->var->fields[k];
            field.type = field.var->type;
            where.push_back(expr(&field));
        }
    }
    return where;
}

void TextureLowerer::place(CallSite& site, const std::vector<Ref>& where) {
    const auto add = [&](const char* name, size_t k, const char* fallback) {
        site.names.emplace_back(name);
        site.args.push_back(k < where.size() && m_b.at(where[k]).ty == Ty::Float
                                ? where[k]
                                : variables().global(m_sema.global(fallback), site.loc));
    };
    if (where.size() == 8) {
        static constexpr const char* Corners[] = {"s1", "t1", "s2", "t2", "s3", "t3", "s4", "t4"};
        for (size_t k = 0; k < 8; k++)
            add(Corners[k], k, "s");
        return;
    }
    if (where.size() != 0 && where.size() != 2)
        m_diagnostics.error(site.loc,
                            "texture() takes no coordinates, (s, t), or those of four corners; found " +
                                std::to_string(where.size()) + " values");
    add("s", 0, "s");
    add("t", 1, "t");
}

// "blur", 0.1, …
void TextureLowerer::options(CallSite& site, const Expr* e) {
    size_t i = 1;
    while (i < e->args.size() && e->args[i]->kind != ExprKind::String)
        i++;
    for (; i + 1 < e->args.size(); i += 2) {
        const Expr* n = e->args[i];
        if (n->kind != ExprKind::String) {
            m_diagnostics.error(n->loc, "expected the name of a texture parameter as a string");
            break;
        }
        static constexpr std::string_view Known[] = {
            "blur",  "sblur",  "tblur", "width",   "swidth", "twidth", "fill",  "wrap",      "swrap",
            "twrap", "filter", "lerp",  "samples", "bias",   "interp", "alpha", "colorspace"};
        const bool known = std::ranges::find(Known, n->text) != std::end(Known);
        if (!known)
            m_diagnostics.warning(n->loc, "texture parameter \"" + std::string(n->text) +
                                              "\" is not known and ignored");
        const Ref value = expr(e->args[i + 1]);
        if (known) {
            site.names.emplace_back(n->text);
            site.args.push_back(value);
        }
    }
}

} // namespace kanuka::sl::ir
