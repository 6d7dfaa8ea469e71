// Makes ri.h and the functions behind it from the table of requests:
//
//   kanuka_make_ri header PROLOGUE > ri.h        kanuka_make_ri calls > calls.cpp

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

#include "ri/signatures.h"
#include "ri/tokens.h"

namespace {

using namespace kanuka;
using ingest::ArgSpec;
using ingest::ArgType;
using ri::Parameter;
using ri::Signature;

std::string declared(const Parameter& p) {
    if (p.type.ends_with('*') && !p.length.empty()) {
        const std::string type = p.type.substr(0, p.type.size() - 1);
        // Arrays of strings are constant: what programs hand over, some do and some do not declare so.
        return (type == "RtString" || type == "RtToken" ? "const " : "") + type + " " + p.name + "[]";
    }
    if (p.type == "RtFloat" && !p.length.empty())
        return p.type + " " + p.name + "[]";
    return p.type + " " + p.name;
}

std::string joined(const Signature& s, bool types) {
    std::string all;
    for (const Parameter& p : s.parameters)
        all += (all.empty() ? "" : ", ") + (types ? declared(p) : p.name);
    return all;
}

bool has_parameters(const Signature& s) {
    return s.spec->params != ingest::Params::None;
}

std::string name_of(const Signature& s) {
    return "Ri" + std::string(s.spec->name);
}

std::string vector_form(const Signature& s) {
    const std::string all = joined(s, true);
    return s.result + " " + name_of(s) + "V(" + all + (all.empty() ? "" : ", ") +
           "RtInt n, const RtToken tokens[], RtPointer parms[])";
}

std::string plain_form(const Signature& s) {
    const std::string all = joined(s, true);
    return s.result + " " + name_of(s) + "(" +
           (has_parameters(s) ? all + ", ..."
            : all.empty()     ? "void"
                              : all) +
           ")";
}

const Parameter* find(const Signature& s, std::string_view name) {
    for (const Parameter& p : s.parameters)
        if (p.name == name)
            return &p;
    return nullptr;
}

// The numbers of an argument "x1 y1 z1 …" in the table: of parameters that are called so, or of all of them,
// points one number after another.
std::string listed(const Signature& s, const std::string& names) {
    std::string list;
    const auto add = [&](const std::string& number) { list += (list.empty() ? "" : ", ") + number; };
    if (!find(s, names.substr(0, names.find(' ')))) {
        for (const Parameter& p : s.parameters)
            for (int i = 0; i < (p.length.empty() ? 1 : std::stoi(p.length)); i++)
                add(p.length.empty() ? p.name : p.name + "[" + std::to_string(i) + "]");
        return list;
    }
    for (size_t at = 0; at < names.size();) {
        const size_t stop = std::min(names.find(' ', at), names.size());
        add(names.substr(at, stop - at));
        at = stop + 1;
    }
    return list;
}

// How an argument of the request is taken from the parameters.
std::string taken(const Signature& s, const ArgSpec& a) {
    const std::string name(a.name);
    const Parameter* p = find(s, name);
    switch (a.type) {
    case ArgType::NewHandle:
        return "c.new_handle();";
    case ArgType::Handle:
        return "c.handle(" + name + ");";
    case ArgType::String:
        return (p && p->type == "RtFilterFunc" ? "c.filter(" : "c.text(") + name + ");";
    case ArgType::Float:
    case ArgType::Integer:
        return "c.number(double(" + name + "));";
    case ArgType::BasisMatrix:
        return "c.floats(&" + name + "[0][0], 16);";
    case ArgType::Floats:
        if (a.count == 16)
            return "c.floats(&" + name + "[0][0], 16);";
        if (find(s, "bound"))
            return "c.floats(bound, 6);";
        return "c.floats({" + listed(s, name) + "});";
    case ArgType::FloatArray:
        return "c.floats(" + name + ", " + p->length + ");";
    case ArgType::IntegerArray:
        return "c.ints(" + name + ", " + p->length + ");";
    case ArgType::StringArray:
        return "c.strings(" + name + ", " + p->length + ");";
    case ArgType::None:
        break;
    }
    return "";
}

void write_header(const char* prologue) {
    std::ifstream in(prologue);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const size_t tokens = text.find("@TOKENS@"), calls = text.find("@CALLS@");
    std::fputs(text.substr(0, tokens).c_str(), stdout);
    std::string line = "KANUKA_RI extern RtToken";
    for (const auto& [name, value] : ri::Tokens) {
        if (line.size() + name.size() > 100) {
            std::printf("%s\n", line.c_str());
            line = "   ";
        }
        line += " " + std::string(name) + (name == std::end(ri::Tokens)[-1].first ? ";" : ",");
    }
    std::printf("%s", line.c_str());
    std::fputs(text.substr(tokens + 8, calls - tokens - 8).c_str(), stdout);
    const std::vector<Signature> all = ri::signatures();
    for (const Signature& s : all) {
        std::printf("KANUKA_RI %s;\n", plain_form(s).c_str());
        if (has_parameters(s))
            std::printf("KANUKA_RI %s;\n", vector_form(s).c_str());
    }
    std::fputs(text.substr(calls + 8).c_str(), stdout);
}

void write_calls() {
    std::puts("// Made from the table of requests by kanuka_make_ri.\n#include <cstdarg>\n\n#include "
              "\"ri/binding.h\"\n\nusing namespace kanuka::ri;\n\nextern \"C\" {\n");
    for (const auto& [name, value] : ri::Tokens)
        std::printf("RtToken %s = \"%s\";\n", std::string(name).c_str(), std::string(value).c_str());
    for (const Signature& s : ri::signatures()) {
        const bool handle = s.result != "RtVoid";
        std::string body = "    " + std::string(handle ? "return " : "") + "make_call(\"" +
                           std::string(s.spec->name) + "\", [&]([[maybe_unused]] Caller& c) {\n";
        for (size_t i = 0; i < s.spec->arg_count(); i++)
            body += "        " + taken(s, s.spec->args[i]) + "\n";
        if (has_parameters(s))
            body += "        c.parameters(n, tokens, parms, " + s.vertices + ");\n";
        body += "    });\n}\n";
        std::printf("\n%s {\n%s", (has_parameters(s) ? vector_form(s) : plain_form(s)).c_str(), body.c_str());
        if (!has_parameters(s))
            continue;
        const std::string names = joined(s, false);
        std::printf("\n%s {\n    std::va_list list;\n    va_start(list, %s);\n    Listed a(list);\n    "
                    "va_end(list);\n    %s%sV(%s, a.count(), a.tokens(), a.values());\n}\n",
                    plain_form(s).c_str(), s.parameters.back().name.c_str(), handle ? "return " : "",
                    name_of(s).c_str(), names.c_str());
    }
    std::puts("\n} // extern \"C\"");
}

} // namespace

int main(int argc, char** argv) {
    const std::string what = argc > 1 ? argv[1] : "";
    if (what == "header" && argc > 2)
        write_header(argv[2]);
    else if (what == "calls")
        write_calls();
    else
        return std::fputs("kanuka_make_ri header PROLOGUE | calls\n", stderr), 2;
    return 0;
}
