// Keyword arguments declared once: the conversion, the signature and the documentation of a call come from
// one table.
#pragma once

#include <span>

#include "python/arguments.h"

namespace kanuka::python {

template <class To>
struct Keyword {
    const char* name;
    const char* type;     // as an annotation
    const char* fallback; // as Python writes it
    const char* unit;     // or what sort of thing it is; empty = the doc says it all
    const char* doc;
    void (*take)(To& to, nb::handle value, const char* name);
};

// TypeError: "render() has no argument progresions; did you mean progressions?"
[[noreturn]] void unknown_argument(const std::string& call, const std::string& name,
                                   const std::vector<std::string>& known);

template <class To>
const Keyword<To>& find_keyword(std::span<const Keyword<To>> table, const char* call,
                                const std::string& name) {
    for (const Keyword<To>& k : table)
        if (name == k.name)
            return k;
    std::vector<std::string> known;
    for (const Keyword<To>& k : table)
        known.push_back(k.name);
    unknown_argument(call, name, known);
}

template <class To>
void take_keywords(To& to, std::span<const Keyword<To>> table, const char* call, const nb::kwargs& given) {
    for (auto [key, value] : given) {
        const Keyword<To>& k = find_keyword(table, call, nb::cast<std::string>(key));
        k.take(to, value, k.name);
    }
}

// ", name: type = fallback" for each.
template <class To>
std::string keyword_signature(std::span<const Keyword<To>> table) {
    std::string text;
    for (const Keyword<To>& k : table)
        text += ", " + std::string(k.name) + ": " + k.type + " = " + k.fallback;
    return text;
}
template <class To>
std::string keyword_doc(std::span<const Keyword<To>> table) {
    std::string text;
    for (const Keyword<To>& k : table)
        text += "\n    " + std::string(k.name) + ": " + (*k.unit ? std::string(k.unit) + "; " : "") + k.doc;
    return text;
}

// The commonest of conversions: to a member, of its own type or inside of an optional.
template <auto Member>
struct Put;
template <class To, class T, T To::* Member>
struct Put<Member> {
    static void take(To& to, nb::handle value, const char* name) { to.*Member = argument<T>(value, name); }
};
template <auto Member>
constexpr auto put = &Put<Member>::take;

} // namespace kanuka::python
