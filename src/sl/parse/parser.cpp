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
        "if",      "else",   "for",    "while",  "break",  "continue",    "return",     "float",
        "color",   "point",  "vector", "normal", "matrix", "string",      "void",       "uniform",
        "varying", "extern", "output", "class",  "public", "illuminance", "illuminate", "solar"};
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

bool Parser::at_type(size_t offset) const {
    const Token& t = peek(offset);
    return t.kind == Token::Identifier && base_by_name(t.text) != Base::Error;
}

bool Parser::at_declaration() const {
    size_t i = 0;
    while (peek(i).is("uniform") || peek(i).is("varying") || peek(i).is("extern") || peek(i).is("output") ||
           peek(i).is("public") || peek(i).is("private"))
        i++;
    if (i > 0)
        return true;
    // "float noise (…)" is a cast of a call, or a nested function: a body after the ")" tells.
    if (!at_type() || peek(1).kind != Token::Identifier || is_keyword(peek(1).text))
        return false;
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
    ast::Type type;
    type.base = t.kind == Token::Identifier ? base_by_name(t.text) : Base::Error;
    if (type.base == Base::Error)
        fail(t, "a type: float, color, point, vector, normal, matrix, string, or a lobe");
    if (type.base == Base::Lobe)
        type.lobe = grid::find_lobe(t.text)->id;
    next();
    return type;
}

Parser::Specifiers Parser::specifiers(bool need_type) {
    Specifiers s;
    s.loc = peek().loc;
    for (;; next()) {
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
        else if (!peek().is("private") && !peek().is("constant"))
            break;
    }
    if (need_type || at_type())
        s.type = type_name();
    return s;
}

VarDecl* Parser::declarator(const Specifiers& s, VarDecl::Kind kind) {
    const Token name = identifier("a variable's name");
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
    if (accept("="))
        v->init = expression();
    // The comment at the declaration documents a parameter.
    Sources& sources = m_diagnostics.sources();
    if (kind == VarDecl::Parameter) {
        std::string_view doc = sources.comment(v->loc.file, v->loc.line);
        if (doc.empty() && v->loc.line > 1)
            doc = sources.comment(v->loc.file, v->loc.line - 1);
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
    while (!peek().is(")")) {
        const Specifiers s = specifiers();
        vars.push_back(declarator(s, kind));
        while (peek().is(",")) {
            const Token& after = peek(1);
            if (at_type(1) || after.is("uniform") || after.is("varying") || after.is("output") ||
                after.is("extern"))
                break;
            next();
            vars.push_back(declarator(s, kind));
        }
        if (!accept(";") && !accept(","))
            break;
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

// ---- shaders
// ------------------------------------------------------------------------------------------------------

static constexpr std::pair<std::string_view, ShaderKind> ShaderKeywords[] = {
    {"surface", ShaderKind::Surface}, {"displacement", ShaderKind::Displacement},
    {"light", ShaderKind::Light},     {"volume", ShaderKind::Volume},
    {"imager", ShaderKind::Imager},   {"class", ShaderKind::Class},
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
            const Specifiers s = specifiers();
            if (peek(1).is("("))
                shader.functions.push_back(function(s));
            else
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
    if (at_shader()) {
        unit.shaders.push_back(shader());
    } else if (at_type() || at_declaration()) {
        unit.functions.push_back(function(specifiers()));
    } else if (peek().kind == Token::Identifier && peek(1).is("(")) {
        Specifiers s; // RISpec: a function without a type returns a float
        s.type.base = Base::Float;
        unit.functions.push_back(function(s));
    } else {
        fail(peek(), "a shader (surface, displacement, light, volume, imager, class) or a function");
    }
}

Unit Parser::unit() {
    Unit u;
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
                s->init = expression();
            expect(";", "after the loop's initialisation");
        }
        if (!peek().is(";"))
            s->expr = expression();
        expect(";", "after the loop's condition");
        if (!peek().is(")"))
            s->step = expression();
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
            return f;
        }
        return declaration(s, VarDecl::Local, nullptr);
    }
    Stmt* s = m_arena.stmt(StmtKind::Expression, t.loc);
    s->expr = expression();
    expect(";", "after the statement");
    return s;
}

} // namespace kanuka::sl
