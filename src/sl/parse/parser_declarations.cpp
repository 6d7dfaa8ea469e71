// Types, specifiers, variables, functions and structs.
#include "sl/parse/parser.h"

namespace kanuka::sl {

using namespace ast;

static Base base_by_name(std::string_view s) {
    static constexpr std::pair<std::string_view, Base> Names[] = {
        {"float", Base::Float},
        {"color", Base::Color},
        {"point", Base::Point},
        {"vector", Base::Vector},
        {"normal", Base::Normal},
        {"matrix", Base::Matrix},
        {"string", Base::String},
        {"shader", Base::Shader},
        {"void", Base::Void},
        {"MnkMaterial", Base::Material},
        {"MnkMaterialBoundary", Base::Boundary},
        {"MnkMaterialInterior", Base::Interior},
        {"MnkObjectProperties", Base::ObjectProperties}};
    for (const auto& [name, base] : Names)
        if (name == s)
            return base;
    return grid::find_lobe(s) ? Base::Lobe : Base::Error;
}

ast::Type Parser::type_named(std::string_view word) const {
    ast::Type type;
    type.base = base_by_name(word);
    if (type.base == Base::Lobe) {
        type.lobe = grid::find_lobe(word)->id;
    } else if (type.base == Base::Error) {
        if (const auto it = m_structs.find(word); it != m_structs.end()) {
            type.base = Base::Struct;
            type.record = it->second;
        }
    }
    return type;
}

bool Parser::at_type(size_t offset) const {
    const Token& t = peek(offset);
    return t.kind == Token::Identifier && type_named(t.text).base != Base::Error;
}

bool Parser::at_specifier(size_t offset) const {
    static constexpr std::string_view Words[] = {"uniform", "varying", "extern",  "output",
                                                 "public",  "private", "constant"};
    const Token& t = peek(offset);
    for (std::string_view w : Words)
        if (t.is(w))
            return !t.is("constant") || peek(offset + 1).kind == Token::Identifier;
    return false;
}

// Shaders older than the types normal, vector and matrix have variables of these names: "point normal = …".
// The word is a name where a type cannot be: before "=", ",", ";", ")", "[" or an operator.
bool Parser::at_type_as_name(size_t offset) const {
    const Token& t = peek(offset);
    if (!t.is("normal") && !t.is("vector") && !t.is("matrix") && !t.is("shader"))
        return false;
    const Token& after = peek(offset + 1);
    return after.kind == Token::Punctuation && !after.is("(") && !after.is("!") && !after.is("{");
}

bool Parser::at_declaration() const {
    size_t i = 0;
    while (at_specifier(i))
        i++;
    if (i > 0)
        return true;
    // "float noise (…)" is a cast of a call, or a nested function: a body after the ")" tells.
    if (!at_type() || peek(1).kind != Token::Identifier)
        return false;
    if (peek(1).is("uniform") || peek(1).is("varying"))
        return true;
    if (is_keyword(peek(1).text))
        return at_type_as_name(1);
    if (!peek(2).is("("))
        return true;
    int depth = 0;
    for (size_t k = 2; peek(k).kind != Token::End; k++) {
        depth += peek(k).is("(") - peek(k).is(")");
        if (depth == 0)
            return peek(k + 1).is("{");
    }
    return false;
}

ast::Type Parser::type_name() {
    const Token& t = peek();
    const ast::Type type = t.kind == Token::Identifier ? type_named(t.text) : ast::Type{};
    if (type.base == Base::Error)
        fail(t, "a type: float, color, point, vector, normal, matrix, string, or a lobe");
    next();
    return type;
}

Parser::Specifiers Parser::specifiers(bool need_type) {
    Specifiers s;
    s.loc = peek().loc;
    const auto words = [&] {
        for (; at_specifier(); next()) {
            if (peek().is("uniform"))
                s.detail = Detail::Uniform;
            else if (peek().is("varying"))
                s.detail = Detail::Varying;
            else if (peek().is("extern"))
                s.is_extern = true;
            else if (peek().is("output"))
                s.output = true;
            else if (peek().is("public"))
                s.is_public = true;
        }
    };
    words();
    if (need_type || at_type())
        s.type = type_name();
    if (peek(1).kind == Token::Identifier) // "float varying x"
        words();
    return s;
}

VarDecl* Parser::declarator(const Specifiers& s, VarDecl::Kind kind) {
    const bool odd = at_type_as_name();
    if (odd)
        m_type_names.insert(peek().text);
    const Token name = odd ? next() : identifier("a variable's name");
    VarDecl* v = m_arena.var();
    v->name = name.text;
    v->loc = name.loc;
    v->kind = kind;
    v->type = s.type;
    v->detail = s.detail;
    v->output = s.output;
    v->is_extern = s.is_extern;
    if (accept("[")) {
        v->type.array = true;
        if (!peek().is("]"))
            v->size = ternary();
        expect("]", "after the array's size");
    }
    if (accept("=")) {
        // matrix m = "shader" 1: the type is the variable's
        const bool space = peek().kind == Token::String && (v->type.triple() || v->type.is(Base::Matrix));
        v->init = space ? in_space(v->type) : expression();
    }
    // The comment at the declaration documents a parameter.
    Sources& sources = m_diagnostics.sources();
    if (kind == VarDecl::Parameter) {
        std::string_view doc = sources.comment(v->loc.file, v->loc.line);
        if (doc.empty() && v->loc.line > 1) { // above it, unless it is about what stands before it there
            const std::string_view above = sources.line({v->loc.file, v->loc.line - 1, 0});
            const size_t first = above.find_first_not_of(" \t");
            if (first != std::string_view::npos && (above[first] == '/' || above[first] == '*'))
                doc = sources.comment(v->loc.file, v->loc.line - 1);
        }
        while (!doc.empty() && (doc.front() == ' ' || doc.front() == '*' || doc.front() == '<'))
            doc.remove_prefix(1);
        while (!doc.empty() && (doc.back() == ' ' || doc.back() == '*'))
            doc.remove_suffix(1);
        v->doc = doc;
    }
    return v;
}

Stmt* Parser::declaration(const Specifiers& s, VarDecl::Kind kind, std::vector<VarDecl*>* into) {
    Stmt* d = m_arena.stmt(StmtKind::Declare, s.loc);
    do {
        VarDecl* v = declarator(s, kind);
        d->vars.push_back(v);
        if (into)
            into->push_back(v);
    } while (accept(","));
    expect(";", "after the declaration");
    return d;
}

// "( type a, b; type c )": "," continues the same type unless another type follows it.
std::vector<VarDecl*> Parser::formals(VarDecl::Kind kind) {
    std::vector<VarDecl*> vars;
    expect("(", "before the parameters");
    while (accept(";") || accept(",")) {
    }
    if (peek().is("void") && peek(1).is(")"))
        next();
    while (!peek().is(")")) {
        const Specifiers s = specifiers();
        vars.push_back(declarator(s, kind));
        while (peek().is(",")) {
            if ((at_type(1) && !at_type_as_name(1)) || at_specifier(1) || peek(1).is(")"))
                break;
            next();
            vars.push_back(declarator(s, kind));
        }
        if (!peek().is(";") && !peek().is(","))
            break;
        while (accept(";") || accept(",")) {
        }
    }
    expect(")", "after the parameters, or \";\" between them");
    return vars;
}

FunctionDecl* Parser::function(const Specifiers& result) {
    FunctionDecl* f = m_arena.function();
    const Token name = identifier("a function's name");
    f->name = name.text;
    f->loc = name.loc;
    f->result = result.type;
    f->is_public = result.is_public;
    f->formals = formals(VarDecl::Formal);
    if (accept(";"))
        return nullptr; // a declaration ahead of the function: all are known anyway
    if (!peek().is("{"))
        fail(peek(), "\"{\" and the function's body");
    f->body = block();
    return f;
}

FunctionDecl* Parser::function_alone() {
    try {
        return function(specifiers());
    } catch (const Failure&) {
        return nullptr;
    }
}

// struct Name { type a = value, b; … }
StructDecl* Parser::structure() {
    next();
    StructDecl* s = m_arena.record();
    const Token name = identifier("the struct's name");
    s->name = name.text;
    s->loc = name.loc;
    m_structs.try_emplace(s->name, s); // its functions may take it
    if (accept(":")) {
        const Token base = identifier("the struct that this one extends");
        const auto it = m_structs.find(base.text);
        if (it == m_structs.end())
            fail(base, "a struct");
        s->members = it->second->members;
        s->functions = it->second->functions;
    }
    expect("{", "before the members of the struct");
    while (!peek().is("}")) {
        if (peek().kind == Token::End)
            fail(peek(), "\"}\" for the struct that begins in line " + std::to_string(name.loc.line));
        if (accept(";"))
            continue;
        Specifiers specifier = specifiers(false);
        const bool untyped = specifier.type.base == Base::Error;
        if (peek(1).is("(")) {
            if (untyped)
                specifier.type.base = Base::Void;
            if (FunctionDecl* f = function(specifier))
                s->functions.push_back(f);
        } else {
            if (untyped)
                type_name(); // complains
            declaration(specifier, VarDecl::Member, &s->members);
        }
    }
    next();
    accept(";");
    if (m_structs.find(s->name)->second != s)
        m_diagnostics.error(s->loc, "struct \"" + std::string(s->name) + "\" is declared twice");
    return s;
}

} // namespace kanuka::sl
