#include "sl/parse/parser.h"

namespace kanuka::sl {

using namespace ast;

std::string Parser::describe(const Token& t) {
    switch (t.kind) {
    case Token::End:
        return "the end of the file";
    case Token::String:
        return "the string \"" + std::string(t.text.substr(0, 40)) + "\"";
    default:
        return "\"" + std::string(t.text.substr(0, 40)) + "\"";
    }
}

void Parser::fail(const Token& found, const std::string& expected) {
    m_diagnostics.error(found.loc, "found " + describe(found) + ", expected " + expected);
    throw Failure{};
}

Token Parser::expect(std::string_view s, const char* where) {
    if (!peek().is(s))
        fail(peek(), "\"" + std::string(s) + "\" " + where);
    return next();
}

static bool is_keyword(std::string_view s) {
    static constexpr std::string_view Words[] = {
        "if",      "else",   "for",    "while",       "break",      "continue", "return", "float",
        "color",   "point",  "vector", "normal",      "matrix",     "string",   "void",   "uniform",
        "varying", "extern", "output", "illuminance", "illuminate", "solar"};
    for (std::string_view w : Words)
        if (w == s)
            return true;
    return false;
}

Token Parser::identifier(const char* what) {
    if (peek().kind != Token::Identifier || is_keyword(peek().text))
        fail(peek(), what);
    return next();
}

// After an error: on to the end of the statement, at the nesting where it began.
void Parser::recover() {
    int depth = 0;
    while (peek().kind != Token::End) {
        if (depth == 0 && peek().is("}"))
            return;
        const Token t = next();
        if (t.is("{"))
            depth++;
        else if (t.is("}")) {
            if (--depth == 0)
                return;
        } else if (t.is(";") && depth == 0)
            return;
    }
}

// ---- types and declarations
// ---------------------------------------------------------------------------------------

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

// ---- shaders
// ------------------------------------------------------------------------------------------------------

static constexpr std::pair<std::string_view, ShaderKind> ShaderKeywords[] = {
    {"surface", ShaderKind::Surface},
    {"displacement", ShaderKind::Displacement},
    {"transformation", ShaderKind::Displacement}, // RISpec 3.1: moves P
    {"light", ShaderKind::Light},
    {"volume", ShaderKind::Volume},
    {"imager", ShaderKind::Imager},
    {"class", ShaderKind::Class},
    {"shader", ShaderKind::Class}};

bool Parser::at_shader() const {
    for (const auto& [word, kind] : ShaderKeywords)
        if (peek().is(word) && peek(1).kind == Token::Identifier)
            return true;
    return false;
}

ShaderDecl* Parser::shader() {
    ShaderDecl* s = m_arena.shader();
    const Token word = next();
    for (const auto& [name, kind] : ShaderKeywords)
        if (word.is(name))
            s->kind = kind;
    const Token name = identifier("the shader's name");
    s->name = name.text;
    s->loc = name.loc;
    s->parameters = formals(VarDecl::Parameter);
    if (!peek().is("{"))
        fail(peek(), "\"{\" and the shader's body");
    if (s->kind == ShaderKind::Class)
        class_body(*s);
    else
        s->body = block();
    return s;
}

void Parser::class_body(ShaderDecl& shader) {
    const Token open = next();
    while (!peek().is("}")) {
        if (peek().kind == Token::End)
            fail(peek(), "\"}\" for the class that begins in line " + std::to_string(open.loc.line));
        if (accept(";"))
            continue;
        try {
            if (peek().is("struct")) {
                structure();
                continue;
            }
            Specifiers s = specifiers(false);
            const bool untyped = s.type.base == Base::Error;
            if (peek(1).is("(")) {
                if (untyped) // "construct () { … }"
                    s.type.base = Base::Void;
                if (FunctionDecl* f = function(s))
                    shader.functions.push_back(f);
            } else if (untyped) {
                type_name(); // complains
            } else
                declaration(s, VarDecl::Member, &shader.members);
        } catch (const Failure&) {
            recover();
        }
    }
    next();
}

void Parser::top_level(Unit& unit) {
    if (accept(";"))
        return;
    const auto keep = [&](FunctionDecl* f) {
        if (f)
            unit.functions.push_back(f);
    };
    if (at_shader()) {
        unit.shaders.push_back(shader());
    } else if (peek().is("struct")) {
        structure();
    } else if (peek().is("plugin") && peek(1).kind == Token::String) {
        m_diagnostics.warning(next().loc, "plug-ins of other renderers are not here: their functions give 0");
        next();
        accept(";");
        unit.plugins = true;
    } else if (at_type() || at_declaration()) {
        const Specifiers s = specifiers();
        if (peek(1).is("("))
            keep(function(s));
        else
            declaration(s, VarDecl::Member, &unit.constants);
    } else if (peek().kind == Token::Identifier && peek(1).is("(")) {
        Specifiers s; // RISpec: a function without a type returns a float
        s.type.base = Base::Float;
        keep(function(s));
    } else {
        fail(peek(), "a shader (surface, displacement, light, volume, imager, class) or a function");
    }
}

// 3Delight's and PRMan's filter regions: here they carry coordinates, whose differences make the filter.
static constexpr const char* FilterRegion = R"(struct filterregion {
    float region_s = 0, region_t = 0; vector region_r = 0;
    void calculate2d(float a; float b) { region_s = a; region_t = b; }
    void calculate3d(point p) { region_r = vector(p); }
    void calculate3d(point p; vector du; vector dv) { region_r = vector(p); }
    void scale(float k) { }
    void blur(float k) { }
})";

void Parser::builtin_structs() {
    for (const Token& t : m_tokens) {
        if (!t.is("filterregion"))
            continue;
        const uint32_t file = m_diagnostics.sources().add("<filterregion>", FilterRegion);
        const std::vector<Token> tokens = lex(m_diagnostics.sources(), file, m_diagnostics);
        Parser own(tokens, m_arena, m_diagnostics);
        own.structure();
        m_structs = std::move(own.m_structs);
        return;
    }
}

Unit Parser::unit() {
    Unit u;
    builtin_structs();
    while (peek().kind != Token::End) {
        const size_t before = m_pos;
        try {
            top_level(u);
        } catch (const Failure&) {
            recover();
            accept("}");
            if (m_pos == before)
                next();
            // What follows belongs to the broken one until the next shader or function begins.
            while (peek().kind != Token::End && !at_shader() && !(at_type() && peek(2).is("(")))
                next();
        }
    }
    return u;
}

// ---- statements
// ---------------------------------------------------------------------------------------------------

Stmt* Parser::block() {
    const Token open = expect("{", "to begin a block");
    Stmt* b = m_arena.stmt(StmtKind::Block, open.loc);
    while (!peek().is("}")) {
        if (peek().kind == Token::End)
            fail(peek(), "\"}\" for the block that begins in line " + std::to_string(open.loc.line));
        const size_t before = m_pos;
        try {
            if (Stmt* s = statement())
                b->block.push_back(s);
        } catch (const Failure&) {
            recover();
            if (m_pos == before)
                next();
        }
    }
    next();
    return b;
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

Stmt* Parser::light_statement(StmtKind kind) {
    Stmt* s = m_arena.stmt(kind, next().loc);
    s->args = arguments();
    s->body = statement();
    if (kind == StmtKind::Gather && accept("else"))
        s->orelse = statement();
    return s;
}

// a, b, …: in a for statement
Expr* Parser::sequence() {
    Expr* first = expression();
    if (!peek().is(","))
        return first;
    Expr* e = m_arena.expr(ExprKind::Sequence, first->loc);
    e->args = {first};
    while (accept(","))
        e->args.push_back(expression());
    return e;
}

Stmt* Parser::jump(StmtKind kind) {
    Stmt* s = m_arena.stmt(kind, next().loc);
    if (kind == StmtKind::Return) {
        if (!peek().is(";"))
            s->expr = expression();
    } else if (peek().kind == Token::Number) {
        s->levels = int(next().number);
    }
    expect(";", kind == StmtKind::Return ? "after return" : "after break or continue");
    return s;
}

Stmt* Parser::statement() {
    const Nesting nesting(*this);
    const Token& t = peek();
    if (t.is("{"))
        return block();
    if (accept(";"))
        return nullptr;
    if (t.is("if")) {
        Stmt* s = m_arena.stmt(StmtKind::If, next().loc);
        expect("(", "after if");
        s->expr = expression();
        expect(")", "after the condition");
        s->body = statement();
        if (accept("else"))
            s->orelse = statement();
        return s;
    }
    if (t.is("while")) {
        Stmt* s = m_arena.stmt(StmtKind::While, next().loc);
        expect("(", "after while");
        s->expr = expression();
        expect(")", "after the condition");
        s->body = statement();
        return s;
    }
    if (t.is("for")) {
        Stmt* s = m_arena.stmt(StmtKind::For, next().loc);
        expect("(", "after for");
        if (at_declaration())
            s->first = declaration(specifiers(), VarDecl::Local, nullptr);
        else {
            if (!peek().is(";"))
                s->init = sequence();
            expect(";", "after the loop's initialisation");
        }
        if (!peek().is(";"))
            s->expr = expression();
        expect(";", "after the loop's condition");
        if (!peek().is(")"))
            s->step = sequence();
        expect(")", "after the loop's step");
        s->body = statement();
        return s;
    }
    if (t.is("break"))
        return jump(StmtKind::Break);
    if (t.is("continue"))
        return jump(StmtKind::Continue);
    if (t.is("return"))
        return jump(StmtKind::Return);
    if (t.is("illuminance") && peek(1).is("("))
        return light_statement(StmtKind::Illuminance);
    if (t.is("gather") && peek(1).is("("))
        return light_statement(StmtKind::Gather);
    if (t.is("illuminate") && peek(1).is("("))
        return light_statement(StmtKind::Illuminate);
    if (t.is("solar") && peek(1).is("("))
        return light_statement(StmtKind::Solar);
    if (at_declaration()) {
        const Specifiers s = specifiers();
        if (peek(1).is("(") && !is_keyword(peek().text)) {
            Stmt* f = m_arena.stmt(StmtKind::Function, s.loc);
            f->function = function(s);
            return f->function ? f : nullptr;
        }
        return declaration(s, VarDecl::Local, nullptr);
    }
    Stmt* s = m_arena.stmt(StmtKind::Expression, t.loc);
    s->expr = sequence();
    expect(";", "after the statement");
    return s;
}

} // namespace kanuka::sl
