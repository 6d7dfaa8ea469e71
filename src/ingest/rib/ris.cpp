#include "ingest/rib/ris.h"

namespace kanuka::ingest::ris {

using scene::Type;
using scene::Value;
using scene::ValueList;

bool names(std::string_view list, std::string_view name) {
    for (size_t at = list.find(name); at != std::string_view::npos; at = list.find(name, at + 1)) {
        const size_t end = at + name.size();
        if ((at == 0 || list[at - 1] == ' ') && (end == list.size() || list[end] == ' '))
            return true;
    }
    return false;
}

std::string_view ours(std::string_view mapping, std::string_view theirs) {
    for (size_t at = 0; at < mapping.size();) {
        const size_t stop = std::min(mapping.find(' ', at), mapping.size());
        const std::string_view pair = mapping.substr(at, stop - at);
        const size_t colon = pair.find(':');
        if (pair.substr(0, colon) == theirs)
            return colon == std::string_view::npos ? pair : pair.substr(colon + 1);
        at = stop + 1;
    }
    return {};
}

void set(ValueList& list, std::string_view name, Type type, std::vector<float> floats) {
    Value v;
    v.name = name;
    v.type = type;
    v.floats = std::move(floats);
    list.set(std::move(v));
}
void set(ValueList& list, std::string_view name, float value) {
    set(list, name, Type::Float, {value});
}
void set(ValueList& list, std::string_view name, Rgb c) {
    set(list, name, Type::Color, {c.x, c.y, c.z});
}
void set(ValueList& list, std::string_view name, std::string text) {
    Value v;
    v.name = name;
    v.type = Type::String;
    v.strings = std::vector<std::string>{std::move(text)};
    list.set(std::move(v));
}

void report_rest(Context& c, const Call& call, const Mapping& mapping, std::string_view known) {
    std::string rest;
    for (const Value& v : call.params.values)
        if (ours(mapping.parameters, v.name).empty() && !names(known, v.name) && !v.name.starts_with("__"))
            rest += (rest.empty() ? "" : ", ") + v.name;
    if (!rest.empty())
        c.reports.once(Severity::Info, "parameters of " + call.text(0), call.where,
                       std::string(call.spec->name) + " \"" + call.text(0) + "\" was taken for \"" +
                           std::string(mapping.ours) + "\", which has no counterpart of " + rest);
}

} // namespace kanuka::ingest::ris
