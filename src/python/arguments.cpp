#include "python/arguments.h"

namespace kanuka::python {

void wrong_argument(const std::string& name, const std::string& expected, nb::handle given) {
    std::string shown;
    try {
        shown = nb::cast<std::string>(nb::repr(given));
        if (constexpr size_t longest = 60; shown.size() > longest)
            shown = shown.substr(0, shown.find('\n')).substr(0, longest) + "...";
    } catch (std::exception&) { // a __repr__ that raises
    }
    const bool number = nb::isinstance<nb::int_>(given) && !nb::isinstance<nb::bool_>(given);
    if (number && expected.starts_with("int"))
        throw nb::value_error((name + ": " + shown + " is out of range").c_str());
    if (!given.is_none())
        shown += " (" + nb::cast<std::string>(given.type().attr("__name__")) + ")";
    throw nb::type_error((name + ": expected " + expected + ", got " + shown).c_str());
}

[[noreturn]] void unknown_argument(const std::string& call, const std::string& name,
                                   const std::vector<std::string>& known) {
    nb::list names;
    for (const std::string& k : known)
        names.append(k);
    const nb::object near = nb::module_::import_("difflib").attr("get_close_matches")(name, names, 1);
    std::string text = call + "() has no argument " + name;
    if (nb::len(near) > 0) {
        text += "; did you mean " + nb::cast<std::string>(near[0]) + "?";
    } else {
        text += "; it has ";
        for (size_t i = 0; i < known.size(); i++)
            text += (i ? ", " : "") + known[i];
    }
    throw nb::type_error(text.c_str());
}

std::string arguments::signature(const char* name, bool method, const std::vector<Parameter>& parameters,
                                 size_t before_keywords, const std::string& result) {
    std::string text = "def " + std::string(name) + "(" + (method ? "self" : "");
    const auto put = [&](const std::string& part) { text += (text.back() == '(' ? "" : ", ") + part; };
    for (size_t i = 0; i < parameters.size(); i++) {
        if (i == before_keywords)
            put("*");
        const Parameter& p = parameters[i];
        std::string part = p.name + ": " + p.type;
        if (p.fallback.is_valid()) {
            if (p.fallback.is_none() && !p.type.ends_with("None") && p.type != "object")
                part += " | None";
            part += " = " + nb::cast<std::string>(nb::repr(p.fallback));
        }
        put(part);
    }
    return text + ") -> " + result;
}

} // namespace kanuka::python
