// A shader and the co-shaders that it is compiled with. Each co-shader has a tree of its own, even if two are
// of one class: so its variables are its own.
#pragma once

#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "sl/parse/ast.h"

namespace kanuka::sl {

class Sema;

struct Linked {
    struct Unit {
        const CoShader* given = nullptr;
        ast::ShaderDecl* shader = nullptr;
    };
    // What a call s->f (…) runs where s is a given unit: the method, and an argument for each of its formals.
    struct Target {
        ast::FunctionDecl* function = nullptr;
        std::vector<ast::Expr*> args;
    };
    std::vector<Unit> units;
    std::unordered_map<const ast::Expr*, std::vector<Target>> calls; // parallel to units
    Sema* caller = nullptr;                                          // the shader's own; it has the globals

    int find(std::string_view handle) const {
        for (size_t i = 0; i < units.size(); i++)
            if (units[i].given->handle == handle)
                return int(i);
        return -1;
    }
    // A parameter or member of a unit, by name.
    ast::VarDecl* variable(size_t unit, std::string_view name) const {
        const ast::ShaderDecl& s = *units[unit].shader;
        for (const auto* list : {&s.parameters, &s.members})
            for (ast::VarDecl* v : *list)
                if (v->name == name)
                    return v;
        return nullptr;
    }
    bool has_method(size_t unit, std::string_view name) const {
        for (const ast::FunctionDecl* f : units[unit].shader->functions)
            if (f->is_public && f->name == name)
                return true;
        return false;
    }
    bool in_category(size_t unit, std::string_view category) const;
};

} // namespace kanuka::sl
