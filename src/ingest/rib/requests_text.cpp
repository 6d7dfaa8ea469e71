// The table of requests as text.

#include "ingest/rib/requests.h"

namespace kanuka::ingest {

std::string_view name(ArgType type) {
    switch (type) {
    case ArgType::None:
        return "";
    case ArgType::Float:
        return "float";
    case ArgType::Integer:
        return "integer";
    case ArgType::String:
        return "string";
    case ArgType::Handle:
    case ArgType::NewHandle:
        return "handle";
    case ArgType::Floats:
        return "floats";
    case ArgType::FloatArray:
        return "float[]";
    case ArgType::IntegerArray:
        return "integer[]";
    case ArgType::StringArray:
        return "string[]";
    case ArgType::BasisMatrix:
        return "basis";
    }
    return "";
}

std::string_view name(Since since) {
    constexpr std::string_view names[] = {"3.1", "3.2", "ext"};
    return names[size_t(since)];
}

std::string_view name(Support support) {
    constexpr std::string_view names[] = {"full", "partial", "kept", "ignored", "needless", "missing"};
    return names[size_t(support)];
}

std::string scope_names(uint8_t scopes) {
    constexpr std::pair<Scope, std::string_view> names[] = {{InOuter, "outer"},
                                                            {InFrame, "frame"},
                                                            {InWorld, "world"},
                                                            {InObject, "object"},
                                                            {InMotion, "motion"}};
    std::string s;
    for (const auto& [scope, name] : names)
        if (scopes & scope)
            s += (s.empty() ? "" : ", ") + std::string(name);
    return s;
}

std::string requests_markdown() {
    std::string s =
        "| request | arguments | since | legal in | support | note |\n|---|---|---|---|---|---|\n";
    for (const RequestSpec& r : requests()) {
        std::string arguments;
        for (size_t i = 0; i < r.arg_count(); i++) {
            const ArgSpec& a = r.args[i];
            const std::string one = a.type == ArgType::Floats
                                        ? std::string(a.name)
                                        : std::string(a.name) + ": " + std::string(name(a.type));
            arguments += (i ? ", " : "") + (a.optional ? "(" + one + ")" : one);
        }
        if (r.params != Params::None)
            arguments += arguments.empty() ? "…" : ", …";
        s += "| " + std::string(r.name) + " | " + arguments + " | " + std::string(name(r.since)) + " | " +
             scope_names(r.scopes) + " | " + std::string(name(r.support)) + " | " + std::string(r.note) +
             " |\n";
    }
    return s;
}

} // namespace kanuka::ingest
