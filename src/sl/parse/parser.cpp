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

bool Parser::is_keyword(std::string_view s) {
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

} // namespace kanuka::sl
