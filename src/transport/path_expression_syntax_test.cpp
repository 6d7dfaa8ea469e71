// What light path expressions mean, against std::regex over paths spelled out; and what is said of those that
// cannot be read.
#include <chrono>
#include <functional>
#include <gtest/gtest.h>
#include <regex>

#include "base/error.h"
#include "transport/path_expression.h"

namespace kanuka::transport {
namespace {

// Letters of the steps behind the camera, and of the classes of lights below.
constexpr std::string_view StepLetters = "abcdefv", LightLetters = "olkm";
const LightNames Classes[] = {{}, {}, {"key"}, {"key", "rim"}};

// Every path of up to `most` steps before its light.
void each_path(int most, const std::function<void(const std::string&)>& visit) {
    std::vector<std::string> paths{""};
    for (size_t first = 0, length = 0; length <= size_t(most); length++) {
        const size_t end = paths.size();
        for (; first < end; first++) {
            for (const char light : LightLetters)
                visit(paths[first] + light);
            for (const char step : StepLetters)
                paths.push_back(paths[first] + step);
        }
    }
}

bool accepts(const PathAutomaton& a, const std::string& path) {
    uint8_t state = 0;
    for (const char c : path.substr(0, path.size() - 1)) {
        state = a.states[state].next[StepLetters.find(c) + 1];
        if (state == PathAutomaton::Dead)
            return false;
    }
    return a.states[state].accepts >> LightLetters.find(path.back()) & 1;
}

} // namespace

TEST(PathSyntax, MeansThePathsOfItsRegularExpression) {
    const std::pair<const char*, const char*> cases[] = {
        {"C.*", ".*"},
        {"CL", "[lkm]"},
        {"CO", "o"},
        {"C<RD>L", "a[lkm]"},
        {"C<RD>[LO]", "a[olkm]"},
        {"C<RD>[<L.>O]", "a[olkm]"},
        {"CD+L", "[ad]+[lkm]"},
        {"C<R[DG]><.S>*<L.'key'>", "[ab][cf]*[km]"},
        {"C(S|V)*O", "([cf]|v)*o"},
        {"C<RD>{1,2}[^O]", "a{1,2}[^o]"},
        {"C[^<RD>]*L", "[^a]*[lkm]"},
        {"C<RD>?G{2}<[^R].>{0,}L", "a?[be]{2}[^abc]*[lkm]"},
        {"C(<RD>L|<TS><L.'rim'>)", "a[lkm]|fm"},
        {"C(<RD>V*){2}<T.>O", "(av*){2}[def]o"},
        {"C((D|G)+S){1,}L", "([adbe]+[cf])+[lkm]"},
        {"C.{3}L", ".{3}[lkm]"},
        {"C<L.'nobody'>", "[^\\s\\S]"},
        {"<RD>L", "[^\\s\\S]"},
    };
    for (const auto& [text, pattern] : cases) {
        const PathAutomaton a = compile_path_expression(text, Classes);
        const std::regex regex(pattern);
        int wrong = 0;
        each_path(
            4, [&](const std::string& path) { wrong += accepts(a, path) != std::regex_match(path, regex); });
        EXPECT_EQ(wrong, 0) << text;
    }
}

TEST(PathSyntax, SaysWhatIsWrongAndWhere) {
    const struct {
        const char* text;
        int column;
        const char *found, *expected;
    } cases[] = {{"C(", 3, "the end", "), which closes a ("},
                 {"C(D|G", 6, "the end", "), which closes a ("},
                 {"C)", 2, "')'", "the end of the expression"},
                 {"C{", 3, "the end", "a number from 0 to 64"},
                 {"C{3L", 4, "'L'", "}, which ends the count"},
                 {"*", 1, "'*'", "one of C R T D G S V L O . or <, [, ("},
                 {"", 1, "the end", "one of C R T D G S V L O . or <, [, ("},
                 {"C<", 3, "the end", "one of C R T V L O . or ["},
                 {"C<RX>", 4, "'X'", "one of D G S . or [, >, 'name'"},
                 {"C<RD", 5, "the end", ">, which closes a <"},
                 {"C<R[DX]>", 6, "'X'", "one of D G S . or ]"},
                 {"C[", 3, "the end", "], which closes a ["},
                 {"C[DX]", 4, "'X'", "one of C R T D G S V L O . or <, ]"},
                 {"C<RD>{2,1}L", 9, "'1'", "a number from 2 to 64"},
                 {"CX", 2, "'X'", "one of C R"},
                 {"C<L.'x", 5, "'''", "a name that another ' ends"},
                 {"C.{99}L", 4, "'9'", "a number from 0 to 64"},
                 {"C.{-1}L", 4, "'-'", "a number from 0 to 64"},
                 {"C<>", 3, "'>'", "one of C R T V L O . or ["},
                 {"C|*", 3, "'*'", "one of C R"},
                 {"C<L.'\u00e4\u00f6'>\u00e9L", 10, "'\u00e9'", "one of C R"}};
    for (const auto& c : cases)
        try {
            compile_path_expression(c.text, Classes);
            ADD_FAILURE() << c.text;
        } catch (const Error& error) {
            const std::string what = error.what(),
                              begin = "column " + std::to_string(c.column) + ": there is " + c.found,
                              end = "\n" + std::string(c.text) + "\n" +
                                    std::string(size_t(c.column) - 1, ' ') + "^";
            EXPECT_TRUE(what.starts_with(begin)) << c.text << ": " << what;
            EXPECT_NE(what.find(std::string("expected ") + c.expected), std::string::npos) << what;
            EXPECT_TRUE(what.ends_with(end)) << c.text << ": " << what;
        }
    EXPECT_EQ(compile_path_expression("C[]", Classes).states.size(), 1u) << "of nothing: no path";
}

TEST(PathSyntax, TooMuchToBeReadEndsSoon) {
    std::string nothing = "()", nested = "(D)", wide = "C", often = "CD";
    for (int k = 0; k < 60; k++)
        nothing = "(" + nothing + "){64}", nested = "(" + nested + "){64}", wide += "(D|G)";
    for (int k = 0; k < 100000; k++)
        often += "*";
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(compile_path_expression("C" + nothing + "L", Classes).states.size(), 1u) << "it is CL";
    EXPECT_THROW(compile_path_expression(nested, Classes), Error);
    EXPECT_THROW(compile_path_expression(wide, Classes), Error);
    EXPECT_THROW(compile_path_expression(often, Classes), Error);
    EXPECT_THROW(compile_path_expression(std::string(100000, '('), Classes), Error);
    // 62 events are read, 63 are not; where it is too much is told.
    EXPECT_EQ(compile_path_expression("C<RD>{60}L", Classes).states.size(), 61u);
    try {
        compile_path_expression("C<RD>{61}L", Classes);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("column 11: ")) << error.what();
    }
    try { // of a long text, what is around the fault is shown
        compile_path_expression("C" + std::string(400, '|') + "X", Classes);
        ADD_FAILURE();
    } catch (const Error& error) {
        const std::string what = error.what();
        EXPECT_TRUE(what.starts_with("column 402: there is 'X'")) << what;
        const size_t line = what.find('\n') + 1, caret = what.find('\n', line) + 1;
        EXPECT_EQ(what[line + what.find('^') - caret], 'X') << what;
        EXPECT_LT(what.size(), 500u);
    }
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 1.0);
}

} // namespace kanuka::transport
