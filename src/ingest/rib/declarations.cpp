#include "ingest/rib/declarations.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "base/spelling.h"
#include "ingest/rib/number.h"
#include "scene/schema/options.h"

namespace kanuka::ingest {

using scene::Detail;
using scene::Type;

static std::optional<Detail> detail_by_name(std::string_view w) {
    constexpr std::pair<std::string_view, Detail> names[] = {
        {"constant", Detail::Constant},       {"uniform", Detail::Uniform},
        {"varying", Detail::Varying},         {"vertex", Detail::Vertex},
        {"facevarying", Detail::FaceVarying}, {"facevertex", Detail::FaceVertex}};
    for (const auto& [name, detail] : names)
        if (w == name)
            return detail;
    return std::nullopt;
}

static std::optional<Type> type_by_name(std::string_view w) {
    constexpr std::pair<std::string_view, Type> names[] = {
        {"float", Type::Float},   {"integer", Type::Integer}, {"int", Type::Integer},
        {"string", Type::String}, {"color", Type::Color},     {"point", Type::Point},
        {"vector", Type::Vector}, {"normal", Type::Normal},   {"hpoint", Type::HPoint},
        {"matrix", Type::Matrix}, {"mpoint", Type::Matrix},   {"shader", Type::String}};
    for (const auto& [name, type] : names)
        if (w == name)
            return type;
    return std::nullopt;
}

std::optional<InlineDeclaration> parse_declaration(std::string_view text, bool need_name,
                                                   std::string& problem) {
    InlineDeclaration r;
    size_t at = 0;
    const auto space = [&] {
        while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])))
            at++;
    };
    const auto next = [&] {
        space();
        const size_t start = at;
        while (at < text.size() && text[at] != '[' && !std::isspace(static_cast<unsigned char>(text[at])))
            at++;
        return text.substr(start, at - start);
    };
    std::string_view w = next();
    if (const auto detail = detail_by_name(w)) {
        r.declaration.detail = *detail;
        r.declaration.declared_detail = true;
        w = next();
    }
    // "reference TYPE name": the value is the output of a Pattern, "handle:output".
    const bool reference = w == "reference";
    if (reference)
        w = next();
    // What plug-ins hand to each other beside values.
    static constexpr std::string_view Handed[] = {"struct", "bxdf",          "displace",    "lightfilter",
                                                  "shader", "displayfilter", "samplefilter"};
    const bool handed = reference && std::ranges::find(Handed, w) != std::end(Handed);
    const auto type = handed ? Type::String : type_by_name(w);
    if (!type) {
        problem = "\"" + std::string(w) +
                  "\" is no type; use float, integer, string, color, point, vector, normal, hpoint or matrix";
        return std::nullopt;
    }
    r.declaration.type = reference ? Type::String : *type;
    space();
    if (at < text.size() && text[at] == '[') {
        at++;
        space();
        // "[ 2.0 ]" is seen in the wild, so the size is read as any number.
        const ScannedNumber n = at < text.size() && text[at] == ']'
                                    ? ScannedNumber{1, text.data() + at, true}
                                    : scan_number(text.data() + at, text.data() + text.size());
        // "color[] name": as many as are given; exporters write "color[0] name" for none.
        const bool open = n.end && (n.end == text.data() + at || n.value == 0);
        r.declaration.open_array = open;
        if (!open && (!n.end || !(n.value >= 1) || n.value > 1e6 || n.value != std::floor(n.value))) {
            problem = "the array size in \"" + std::string(text) + "\" must be a whole number of 1 or more";
            return std::nullopt;
        }
        r.declaration.array_size = std::max(int(n.value), 1);
        at = size_t(n.end - text.data());
        space();
        if (at >= text.size() || text[at] != ']') {
            problem = "the array size in \"" + std::string(text) + "\" is not closed by ]";
            return std::nullopt;
        }
        at++;
    }
    r.name = next();
    space();
    if (r.name.empty() && need_name) {
        problem = "the declaration \"" + std::string(text) + "\" names no parameter";
        return std::nullopt;
    }
    if (at < text.size()) {
        problem = "\"" + std::string(text.substr(at)) + "\" is left over in the declaration \"" +
                  std::string(text) + "\"";
        return std::nullopt;
    }
    return r;
}

namespace {

struct Standard {
    std::string_view declaration; // "class type[n]"
    std::string_view names;       // separated by spaces
};

// RISpec 3.2: table 3.1 and the standard shaders' parameters (appendix A), then the options and attributes
// that RenderMan renderers share, which files use without declaring them.
constexpr Standard StandardDeclarations[] = {
    {"uniform float",
     "Ka Kd Ks Kr Km roughness amplitude intensity coneangle conedeltaangle beamdistribution mindistance "
     "maxdistance distance fov flatness sphere jitter dither bandwidth samplingrate"},
    {"uniform color", "lightcolor specularcolor background bgcolor color opacity"},
    {"uniform point", "from to"},
    {"uniform string",
     "texturename coordinatesystem shader texture archive procedural display displays name shadinggroup "
     "shadows depthfilter shadowname mapname bucketorder sense "
     "casts_shadows __instanceid __group"},
    {"vertex point", "P"},
    {"vertex float", "Pz"},
    {"vertex hpoint", "Pw"},
    {"varying normal", "N"},
    {"uniform normal", "Np"},
    {"varying color", "Cs Os"},
    {"varying float", "s t width"},
    {"varying float[2]", "st"},
    {"constant float", "constantwidth"},
    {"constant normal", "constantnormal"},
    {"uniform integer", "gridsize texturememory geocachememory eyesplits endofframe maxspeculardepth "
                        "maxdiffusedepth max_raylevel diceflatness shadowterminator "
                        "camera truedisplacement proceduralmemory offscreen runprograms ondemand "
                        "shared"},
    {"uniform integer[2]", "bucketsize origin"},
    {"uniform float[4]", "quantize"},
};

// What Option "kanuka" takes needs no declaration.
void declare_options(Declarations& to) {
    for (const scene::OptionParameter& row : scene::option_parameters()) {
        constexpr std::string_view category = "kanuka:";
        std::string_view name = row.rib;
        name = name.substr(0, name.find(' '));
        if (!name.starts_with(category))
            continue;
        Declaration d;
        d.detail = Detail::Uniform;
        d.type = row.kind == scene::Kind::Number                                   ? Type::Float
                 : row.kind == scene::Kind::Flag || row.kind == scene::Kind::Whole ? Type::Integer
                                                                                   : Type::String;
        to.declare(name.substr(category.size()), d);
    }
}

} // namespace

Declarations::Declarations() {
    declare_options(*this);
    std::string problem;
    for (const Standard& row : StandardDeclarations) {
        const auto parsed = parse_declaration(row.declaration, false, problem);
        for (size_t at = 0; at < row.names.size();) {
            const size_t stop = std::min(row.names.find(' ', at), row.names.size());
            if (stop > at)
                declare(row.names.substr(at, stop - at), parsed->declaration);
            at = stop + 1;
        }
    }
}

void Declarations::declare(std::string_view name, const Declaration& declaration, std::string_view text) {
    if (!text.empty())
        m_own.insert(m_own.end(), {std::string(name), std::string(text)});
    m_map.insert_or_assign(std::string(name), declaration);
}

const Declaration* Declarations::find(std::string_view name) const {
    if (m_last && m_last->first == name)
        return &m_last->second;
    const auto it = m_map.find(name);
    if (it == m_map.end())
        return nullptr;
    m_last = &*it;
    return &it->second;
}

std::string_view Declarations::nearest(std::string_view name) const {
    Nearest nearest(name);
    for (const auto& [known, declaration] : m_map)
        nearest.offer(known);
    return nearest.best();
}

} // namespace kanuka::ingest
