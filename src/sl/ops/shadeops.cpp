#include "sl/ops/shadeops.h"

#include <cstdio>
#include <unordered_map>

#include "sl/ops/examples.h"
#include "sl/ops/table.h"

namespace kanuka::sl::ops {

namespace {

using ast::Base;

Base base_named(std::string_view s) {
    static constexpr std::pair<std::string_view, Base> Names[] = {{"float", Base::Float},
                                                                  {"color", Base::Color},
                                                                  {"point", Base::Point},
                                                                  {"vector", Base::Vector},
                                                                  {"normal", Base::Normal},
                                                                  {"matrix", Base::Matrix},
                                                                  {"string", Base::String},
                                                                  {"shader", Base::Shader},
                                                                  {"void", Base::Void},
                                                                  {"lobe", Base::Lobe},
                                                                  {"MnkMaterial", Base::Material},
                                                                  {"MnkMaterialBoundary", Base::Boundary},
                                                                  {"MnkMaterialInterior", Base::Interior}};
    for (const auto& [name, base] : Names)
        if (name == s)
            return base;
    return Base::Error;
}

std::vector<std::string> words(std::string_view s) {
    std::vector<std::string> w;
    for (size_t i = 0; i < s.size();) {
        if (s[i] == ' ') {
            i++;
        } else if (s.substr(i, 3) == "...") {
            w.emplace_back("...");
            i += 3;
        } else if (s[i] == '(' || s[i] == ')' || s[i] == ',' || s[i] == '[' || s[i] == ']') {
            w.emplace_back(1, s[i++]);
        } else {
            const size_t begin = i;
            while (i < s.size() && std::string_view(" (),[].").find(s[i]) == std::string_view::npos)
                i++;
            w.emplace_back(s.substr(begin, i - begin));
        }
    }
    return w;
}

// "float mix(float a, float b)": the grammar is this regular.
Signature parse(std::string_view header, std::string& name) {
    std::vector<std::string> w = words(header);
    Signature s;
    s.result.base = base_named(w[0]);
    if (w[1] == "[") { // an array
        s.result.array = true;
        w.erase(w.begin() + 1, w.begin() + 3);
    }
    name = w[1];
    for (size_t i = 3; i < w.size() && w[i] != ")";) {
        if (w[i] == ",") {
            i++;
        } else if (w[i] == "...") {
            s.variadic = true;
            i++;
        } else {
            Argument a;
            a.output = w[i] == "output";
            i += a.output;
            a.type.base = base_named(w[i++]);
            a.name = w[i++];
            if (i < w.size() && w[i] == "[") {
                a.type.array = true;
                i += 2;
            }
            s.args.push_back(std::move(a));
        }
    }
    return s;
}

// Replaces the word `from` by `to`.
std::string replace_word(std::string_view text, char from, std::string_view to) {
    const auto in_word = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '"';
    };
    std::string out;
    for (size_t i = 0; i < text.size(); i++) {
        const bool alone = text[i] == from && (i == 0 || !in_word(text[i - 1])) &&
                           (i + 1 == text.size() || !in_word(text[i + 1]));
        if (alone)
            out += to;
        else
            out += text[i];
    }
    return out;
}

struct Table {
    std::vector<Shadeop> ops;
    std::unordered_map<std::string_view, size_t> index;

    Table() {
        std::unordered_map<std::string, size_t> by_name;
        for (const Row& row : rows()) {
            std::vector<std::string_view> types = {""};
            char letter = 'T';
            if (replace_word(row.header, 'T', "float") != row.header)
                types = {"float", "color", "point", "vector", "normal"};
            else if (replace_word(row.header, 'V', "point") != row.header) {
                types = {"point", "vector", "normal"};
                letter = 'V';
            }
            for (std::string_view type : types) {
                const std::string header =
                    type.empty() ? std::string(row.header) : replace_word(row.header, letter, type);
                std::string name;
                Signature s = parse(header, name);
                s.impl = row.impl;
                s.special = row.special;
                s.op = row.op;
                s.imm = row.imm;
                if (row.impl == Impl::Source) {
                    std::string plain = header;
                    if (const size_t dots = plain.find(", ..."); dots != std::string::npos)
                        plain.erase(dots, 5);
                    else if (const size_t only = plain.find("(...)"); only != std::string::npos)
                        plain.erase(only + 1, 3);
                    const std::string body(row.source);
                    s.source = plain + "{" + (type.empty() ? body : replace_word(body, letter, type)) + "}";
                }
                const auto [it, fresh] = by_name.try_emplace(name, ops.size());
                if (fresh)
                    ops.push_back({name, std::string(row.category), std::string(row.doc), row.optics, {}});
                // Templates may repeat a signature that a row before them spelt out.
                bool known = false;
                for (const Signature& other : ops[it->second].signatures) {
                    bool same = other.result == s.result && other.args.size() == s.args.size();
                    for (size_t i = 0; same && i < s.args.size(); i++)
                        same = other.args[i].type == s.args[i].type;
                    known = known || same;
                }
                if (!known)
                    ops[it->second].signatures.push_back(std::move(s));
            }
        }
        for (size_t i = 0; i < ops.size(); i++)
            index[ops[i].name] = i;
    }
};

const Table& table() {
    static const Table t;
    return t;
}

} // namespace

std::span<const Shadeop> shadeops() {
    return table().ops;
}

const Shadeop* find_shadeop(std::string_view name) {
    const Table& t = table();
    const auto it = t.index.find(name);
    return it == t.index.end() ? nullptr : &t.ops[it->second];
}

static std::string example_text(const Example& e) {
    if (e.kind == Example::Surface)
        return "`" + std::string(e.before) + "`";
    char number[32];
    std::snprintf(number, sizeof number, "%.6g", double(e.expected));
    return (e.before.empty() ? std::string() : "`" + std::string(e.before) + "` ") + "`" +
           std::string(e.expression) + "` is " + number;
}

std::string shadeops_manual() {
    std::string text = "# Shadeops\n\nMade from the table in `src/sl/ops/table.cpp`.\n";
    std::string category;
    for (const Shadeop& op : shadeops()) {
        if (op.name.starts_with("__"))
            continue;
        if (op.category != category)
            text += "\n## " + (category = op.category) + "\n\n";
        text += "- **" + op.name + "** — " + op.doc + "\n";
        for (const Signature& s : op.signatures) {
            text += "  - `" + s.result.str() + " " + op.name + "(";
            for (size_t i = 0; i < s.args.size(); i++)
                text += std::string(i ? ", " : "") + (s.args[i].output ? "output " : "") +
                        (s.args[i].type.base == Base::Lobe   ? "lobe"
                         : s.args[i].type.base == Base::Void ? "any"
                                                             : s.args[i].type.str()) +
                        " " + s.args[i].name;
            text += std::string(s.variadic ? (s.args.empty() ? "…" : ", …") : "") + ")`\n";
        }
        for (const Example& e : shadeop_examples())
            if (e.of == op.name && e.kind != Example::Source)
                text += "  - example: " + example_text(e) + "\n";
    }
    text += "\n# Statements and expressions\n\n";
    for (const Example& e : statement_examples())
        if (e.kind != Example::Source)
            text += "- **" + std::string(e.of) + "** " + example_text(e) + "\n";
    return text;
}

const SplineBasis* find_basis(std::string_view name) {
    static constexpr SplineBasis CatmullRom{
        {{-0.5f, 1.5f, -1.5f, 0.5f}, {1, -2.5f, 2, -0.5f}, {-0.5f, 0, 0.5f, 0}, {0, 1, 0, 0}}, 1};
    static constexpr SplineBasis BSpline{{{-1 / 6.f, 0.5f, -0.5f, 1 / 6.f},
                                          {0.5f, -1, 0.5f, 0},
                                          {-0.5f, 0, 0.5f, 0},
                                          {1 / 6.f, 2 / 3.f, 1 / 6.f, 0}},
                                         1};
    static constexpr SplineBasis Bezier{{{-1, 3, -3, 1}, {3, -6, 3, 0}, {-3, 3, 0, 0}, {1, 0, 0, 0}}, 3};
    static constexpr SplineBasis Hermite{{{2, 1, -2, 1}, {-3, -2, 3, -1}, {0, 1, 0, 0}, {1, 0, 0, 0}}, 2};
    // Linear runs over the inner values, as in RISpec: the first and the last do not matter.
    static constexpr SplineBasis Linear{{{0, 0, 0, 0}, {0, 0, 0, 0}, {0, -1, 1, 0}, {0, 1, 0, 0}}, 1};
    if (name == "catmull-rom" || name == "catmullrom" || name == "cubic")
        return &CatmullRom;
    if (name == "b-spline" || name == "bspline")
        return &BSpline;
    if (name == "bezier")
        return &Bezier;
    if (name == "hermite")
        return &Hermite;
    return name == "linear" ? &Linear : nullptr;
}

std::span<const Global> globals() {
    using ir::Input;
    static constexpr Global Table[] = {
        {"P", Base::Point, int(Input::P), true, "position, in current space"},
        {"N", Base::Normal, int(Input::N), true, "shading normal"},
        {"Ng", Base::Normal, int(Input::Ng), false, "geometric normal"},
        {"dPdu", Base::Vector, int(Input::dPdu), false, "derivative of P by u"},
        {"dPdv", Base::Vector, int(Input::dPdv), false, "derivative of P by v"},
        {"u", Base::Float, int(Input::u), false, "surface parameter"},
        {"v", Base::Float, int(Input::v), false, "surface parameter"},
        {"s", Base::Float, int(Input::s), false, "texture coordinate"},
        {"t", Base::Float, int(Input::t), false, "texture coordinate"},
        {"Cs", Base::Color, int(Input::Cs), false, "surface colour"},
        {"Os", Base::Color, int(Input::Os), false, "surface opacity"},
        {"E", Base::Point, int(Input::E), false, "position of the eye"},
        {"time", Base::Float, int(Input::time), false, "shutter time"},
        {"du", Base::Float, int(Input::du), false, "change of u to the next vertex"},
        {"dv", Base::Float, int(Input::dv), false, "change of v to the next vertex"},
        {"I", Base::Vector, -1, true, "from the eye to P"},
        {"Ci", Base::Color, -1, true, "light that leaves the surface: read as a material"},
        {"Oi", Base::Color, -1, true, "opacity of the surface"},
        {"L", Base::Vector, -1, true, "direction to the light, within illuminance"},
        {"Cl", Base::Color, -1, true, "light that arrives, within illuminance"},
        {"Ol", Base::Color, -1, true, "opacity of light"},
        {"Ps", Base::Point, -1, false, "lit point, in light shaders"},
        {"Ns", Base::Normal, -1, false, "normal at the lit point, in light shaders"},
        {"dtime", Base::Float, -1, false, "length of the shutter interval"},
        {"dPdtime", Base::Vector, -1, false, "motion of P"},
        {"ncomps", Base::Float, -1, false, "colour components: 3"},
        {"alpha", Base::Float, -1, true, "coverage, in imagers"},
        {"PI", Base::Float, -1, false, "3.14159…"},
        {"null", Base::Shader, -1, false, "no shader"},
    };
    return Table;
}

} // namespace kanuka::sl::ops
