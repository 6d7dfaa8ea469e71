#include "ingest/rib/condition.h"

#include <cctype>

#include "ingest/rib/context.h"
#include "ingest/rib/number.h"
#include "scene/schema/options.h"

namespace kanuka::ingest {

namespace {

struct Operand {
    bool is_text = false, defined = true;
    double number = 0;
    std::string text;
    bool truth() const { return is_text ? !text.empty() && text != "0" : number != 0; }
};

// Recursive descent, one function a precedence; nesting is bounded, so hostile input cannot exhaust the
// stack.
class Parser {
  public:
    Parser(std::string_view text, const Context& context) : m_text(text), m_context(context) {}

    bool run(std::string& problem) {
        const Operand r = any_of();
        space();
        if (m_problem.empty() && m_at < m_text.size())
            fail("\"" + std::string(m_text.substr(m_at)) + "\" is left over");
        problem = m_problem;
        return r.truth();
    }

  private:
    static Operand boolean(bool b) { return {false, true, double(b), {}}; }

    void fail(const std::string& what) {
        if (m_problem.empty())
            m_problem = what;
        m_at = m_text.size();
    }
    void space() {
        while (m_at < m_text.size() && std::isspace(static_cast<unsigned char>(m_text[m_at])))
            m_at++;
    }
    bool eat(std::string_view token) {
        space();
        if (m_text.substr(m_at, token.size()) != token)
            return false;
        m_at += token.size();
        return true;
    }

    Operand any_of() {
        Operand a = all_of();
        while (eat("||")) {
            const Operand b = all_of();
            a = boolean(a.truth() || b.truth());
        }
        return a;
    }
    Operand all_of() {
        Operand a = comparison();
        while (eat("&&")) {
            const Operand b = comparison();
            a = boolean(a.truth() && b.truth());
        }
        return a;
    }
    Operand comparison() {
        Operand a = sum();
        for (const std::string_view op : {"==", "!=", "<=", ">=", "<", ">"}) {
            if (!eat(op))
                continue;
            const Operand b = sum();
            const int order = a.is_text && b.is_text ? a.text.compare(b.text)
                              : a.number < b.number  ? -1
                              : a.number > b.number  ? 1
                                                     : 0;
            // A name without a value equals the empty string and 0; text never equals a number.
            const bool comparable = a.is_text == b.is_text || !a.defined || !b.defined;
            if (op == "==")
                return boolean(comparable && order == 0);
            if (op == "!=")
                return boolean(!comparable || order != 0);
            return boolean(comparable && (op == "<"    ? order < 0
                                          : op == "<=" ? order <= 0
                                          : op == ">"  ? order > 0
                                                       : order >= 0));
        }
        return a;
    }
    Operand sum() {
        Operand a = product();
        for (;;) {
            if (eat("+"))
                a.number += product().number;
            else if (eat("-"))
                a.number -= product().number;
            else
                return a;
        }
    }
    Operand product() {
        Operand a = unary();
        for (;;) {
            if (eat("*"))
                a.number *= unary().number;
            else if (eat("/"))
                a.number /= unary().number;
            else
                return a;
        }
    }
    Operand unary() {
        if (++m_depth > 100) {
            fail("it is nested too deeply");
            return {};
        }
        space();
        Operand r;
        if (m_text.substr(m_at, 2) != "!=" && eat("!"))
            r = boolean(!unary().truth());
        else if (eat("-"))
            r.number = -unary().number;
        else if (eat("(")) {
            r = any_of();
            if (!eat(")"))
                fail("\")\" is missing");
        } else
            r = primary();
        m_depth--;
        return r;
    }
    Operand primary() {
        space();
        if (m_at >= m_text.size()) {
            fail("it ends where a value is expected");
            return {};
        }
        const char c = m_text[m_at];
        if (c == '\'' || c == '"') {
            const size_t close = m_text.find(c, m_at + 1);
            if (close == std::string_view::npos) {
                fail("a string is not closed");
                return {};
            }
            Operand r{true, true, 0, std::string(m_text.substr(m_at + 1, close - m_at - 1))};
            m_at = close + 1;
            return r;
        }
        if (starts_number(c)) {
            const ScannedNumber n = scan_number(m_text.data() + m_at, m_text.data() + m_text.size());
            if (n.end) {
                m_at = size_t(n.end - m_text.data());
                return {false, true, n.value, {}};
            }
        }
        if (eat("defined")) {
            if (!eat("(")) {
                fail("\"(\" is expected after defined");
                return {};
            }
            const Operand r = name();
            if (!eat(")"))
                fail("\")\" is missing");
            return boolean(r.defined);
        }
        return name();
    }
    Operand name() {
        eat("$");
        const bool braces = eat("{");
        const size_t start = m_at;
        while (m_at < m_text.size() && (std::isalnum(static_cast<unsigned char>(m_text[m_at])) ||
                                        m_text[m_at] == '_' || m_text[m_at] == ':'))
            m_at++;
        std::string_view n = m_text.substr(start, m_at - start);
        if (n.empty()) {
            fail("\"" + std::string(m_text.substr(start)) + "\" is no value");
            return {};
        }
        if (braces && !eat("}"))
            fail("\"}\" is missing");
        return look_up(n);
    }
    static Operand operand(const scene::Setting& value) {
        if (value.numbers.empty())
            return {!value.texts.empty(), !value.texts.empty(), 0, value.texts.empty() ? "" : value.texts[0]};
        return {false, true, value.numbers[0], {}};
    }
    Operand look_up(std::string_view n) const {
        if (n == "Frame" && !m_context.frames_seen().empty())
            return {false, true, double(m_context.frames_seen().back()), {}};
        const auto prefixed = [&](std::string_view prefix) {
            if (n.substr(0, prefix.size()) != prefix)
                return false;
            n.remove_prefix(prefix.size());
            return true;
        };
        const bool attribute = prefixed("Attribute:"), option = !attribute && prefixed("Option:");
        if (const auto* row = option ? nullptr : scene::find_rib_attribute(n))
            return operand(row->get(*m_context.attributes.shared));
        if (const auto* row = attribute ? nullptr : scene::find_rib_option(n))
            return operand(row->get(m_context.options.options));
        const scene::Value* v = nullptr;
        if (attribute)
            v = m_context.attributes.shared->user.find(n);
        else if (option)
            v = m_context.options.options.user.find(n);
        else {
            v = m_context.attributes.shared->user.find(n);
            v = v ? v : m_context.options.options.user.find(n);
        }
        if (!v)
            return {false, false, 0, {}};
        if (!v->strings.empty())
            return {true, true, 0, v->strings[0]};
        return {false,
                true,
                !v->ints.empty()    ? double(v->ints[0])
                : v->floats.empty() ? 0
                                    : double(v->floats[0]),
                {}};
    }

    std::string_view m_text;
    const Context& m_context;
    size_t m_at = 0;
    int m_depth = 0;
    std::string m_problem;
};

} // namespace

bool evaluate_condition(std::string_view text, const Context& context, std::string& problem) {
    return Parser(text, context).run(problem);
}

} // namespace kanuka::ingest
