#include "sl/ops/shadeops.h"
#include "sl/print/print.h"

namespace kanuka::sl {

using namespace ast;

namespace {

class TreePrinter {
  public:
    explicit TreePrinter(const Sources& sources) : m_sources(sources) {}

    std::string run(const ShaderDecl& s) {
        line(0, std::string(kind_name(s.kind)) + " " + std::string(s.name));
        for (const VarDecl* v : s.parameters)
            variable(1, "parameter", *v);
        for (const VarDecl* v : s.members)
            variable(1, "member", *v);
        for (const FunctionDecl* f : s.functions)
            function(1, *f);
        if (s.body)
            statement(1, s.body);
        // Functions outside of the shader, as far as they are called.
        for (size_t k = 0; k < m_called.size(); k++)
            if (!within(s, m_called[k]))
                function(0, *m_called[k]);
        return m_out;
    }

  private:
    static bool within(const ShaderDecl& s, const FunctionDecl* f) {
        for (const FunctionDecl* own : s.functions)
            if (own == f)
                return true;
        return f->outer != nullptr;
    }

    void line(int indent, const std::string& text) {
        m_out += std::string(size_t(indent) * 2, ' ') + text + "\n";
    }

    void source(int indent, Loc at) {
        if (at.line == 0 || (at.line == m_last.line && at.file == m_last.file))
            return;
        m_last = at;
        if (const std::string text = source_line(m_sources, at); !text.empty())
            line(indent, "// " + text);
    }

    void variable(int indent, const std::string& what, const VarDecl& v) {
        source(indent, v.loc);
        static constexpr const char* Details[] = {"", "uniform ", "varying "};
        line(indent, what + " " + (v.output ? "output " : "") + Details[int(v.detail)] + v.type.str() + " " +
                         std::string(v.name));
        if (v.init)
            expression(indent + 1, v.init);
    }

    void function(int indent, const FunctionDecl& f) {
        source(indent, f.loc);
        line(indent, "function " + f.result.str() + " " + std::string(f.name));
        for (const VarDecl* v : f.formals)
            variable(indent + 1, "formal", *v);
        if (f.body)
            statement(indent + 1, f.body);
    }

    static std::string name_of(StmtKind kind) {
        switch (kind) {
        case StmtKind::Empty:
            return "empty";
        case StmtKind::Block:
            return "block";
        case StmtKind::Declare:
            return "declare";
        case StmtKind::Expression:
            return "do";
        case StmtKind::If:
            return "if";
        case StmtKind::While:
            return "while";
        case StmtKind::For:
            return "for";
        case StmtKind::Break:
            return "break";
        case StmtKind::Continue:
            return "continue";
        case StmtKind::Return:
            return "return";
        case StmtKind::Illuminance:
            return "illuminance";
        case StmtKind::Illuminate:
            return "illuminate";
        case StmtKind::Solar:
            return "solar";
        case StmtKind::Gather:
            return "gather";
        default:
            return "statement";
        }
    }

    void statement(int indent, const Stmt* s) {
        source(indent, s->loc);
        if (s->function)
            return function(indent, *s->function);
        if (s->kind == StmtKind::Declare) {
            for (const VarDecl* v : s->vars)
                variable(indent, "declare", *v);
            return;
        }
        if (s->kind == StmtKind::Block && !s->block.empty()) {
            for (const Stmt* b : s->block)
                statement(indent, b);
            return;
        }
        const bool jump = s->kind == StmtKind::Break || s->kind == StmtKind::Continue;
        line(indent, name_of(s->kind) + (jump && s->levels > 1 ? " " + std::to_string(s->levels) : ""));
        if (s->first)
            statement(indent + 1, s->first);
        for (const Expr* e : {s->init, s->expr, s->step})
            if (e)
                expression(indent + 1, e);
        for (const Expr* e : s->args)
            expression(indent + 1, e);
        if (s->body) {
            line(indent, "then");
            statement(indent + 1, s->body);
        }
        if (s->orelse) {
            line(indent, "else");
            statement(indent + 1, s->orelse);
        }
    }

    std::string head(const Expr& e) {
        std::string text(e.text);
        switch (e.kind) {
        case ExprKind::Number: {
            char number[32];
            std::snprintf(number, sizeof number, "%g", double(e.number));
            return number;
        }
        case ExprKind::String:
            return "\"" + text + "\"";
        case ExprKind::Name:
            return text;
        case ExprKind::Index:
            return "element";
        case ExprKind::Call:
            return "call " + text + (e.shadeop ? " (shadeop)" : "");
        case ExprKind::Method:
            return "method " + text;
        case ExprKind::Cast:
            return "cast";
        case ExprKind::Tuple:
        case ExprKind::TupleIn:
            return "tuple";
        case ExprKind::List:
            return "list";
        case ExprKind::Unary:
            return e.negate ? "-" : "!";
        case ExprKind::Binary:
            return std::string(spelling(e.op));
        case ExprKind::Ternary:
            return "?:";
        case ExprKind::Assign:
            return std::string(e.op == BinOp::None ? "" : spelling(e.op)) + "=";
        case ExprKind::Construct:
            return "construct";
        case ExprKind::Sequence:
            return "sequence";
        default:
            return "expression";
        }
    }

    void expression(int indent, const Expr* e) {
        if (indent > 200) { // what nests so deep is read by nobody
            line(indent, "…");
            return;
        }
        const bool plain = e->kind == ExprKind::Number || e->kind == ExprKind::String;
        line(indent, head(*e) + (plain ? "" : " : " + e->type.str()));
        if (e->function) {
            bool known = false;
            for (const FunctionDecl* f : m_called)
                known = known || f == e->function;
            // A shadeop's own source is not the reader's.
            if (!known && !e->shadeop)
                m_called.push_back(e->function);
        }
        for (const Expr* a : e->args)
            expression(indent + 1, a);
    }

    const Sources& m_sources;
    std::string m_out;
    std::vector<const FunctionDecl*> m_called;
    Loc m_last{};
};

} // namespace

std::string print_tree(const ShaderDecl& shader, const Sources& sources) {
    return TreePrinter(sources).run(shader);
}

} // namespace kanuka::sl
