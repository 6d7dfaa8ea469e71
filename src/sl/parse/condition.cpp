#include "sl/parse/condition.h"

namespace kanuka::sl {

namespace {

class Condition {
  public:
    explicit Condition(std::span<const Token> tokens) : m_tokens(tokens) {}

    double value() { return binary(0); }
    // The first token that is no part of the expression.
    const Token* rest() const { return m_at < m_tokens.size() ? &m_tokens[m_at] : nullptr; }

  private:
    double primary() {
        if (m_at >= m_tokens.size() || ++m_depth > 256)
            return 0;
        const Token t = m_tokens[m_at++];
        double value = 0;
        if (t.is("!"))
            value = primary() == 0;
        else if (t.is("-"))
            value = -primary();
        else if (t.is("(")) {
            value = binary(0);
            if (m_at < m_tokens.size() && m_tokens[m_at].is(")"))
                m_at++;
        } else if (t.kind == Token::Number)
            value = t.number;
        m_depth--;
        return value;
    }

    double binary(int lowest) {
        static const std::vector<std::vector<std::string_view>> levels = {
            {"||"}, {"&&"}, {"==", "!="}, {"<", ">", "<=", ">="}, {"+", "-"}, {"*", "/"}};
        if (lowest == int(levels.size()))
            return primary();
        double a = binary(lowest + 1);
        while (m_at < m_tokens.size()) {
            const Token op = m_tokens[m_at];
            bool found = false;
            for (std::string_view s : levels[lowest])
                found = found || op.is(s);
            if (!found)
                break;
            m_at++;
            const double b = binary(lowest + 1);
            a = op.is("||")   ? (a != 0 || b != 0)
                : op.is("&&") ? (a != 0 && b != 0)
                : op.is("==") ? a == b
                : op.is("!=") ? a != b
                : op.is("<")  ? a < b
                : op.is(">")  ? a > b
                : op.is("<=") ? a <= b
                : op.is(">=") ? a >= b
                : op.is("+")  ? a + b
                : op.is("-")  ? a - b
                : op.is("*")  ? a * b
                              : (b != 0 ? a / b : 0);
        }
        return a;
    }

    std::span<const Token> m_tokens;
    size_t m_at = 0;
    int m_depth = 0;
};

} // namespace

double evaluate_condition(std::span<const Token> expression, Diagnostics& diagnostics) {
    Condition condition(expression);
    const double value = condition.value();
    if (const Token* rest = condition.rest())
        diagnostics.error(rest->loc,
                          "\"" + std::string(rest->text) + "\" does not belong into a condition of #if");
    return value;
}

} // namespace kanuka::sl
