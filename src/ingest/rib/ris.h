// Plug-ins of RenderMan since its version 19 in terms of ours: what the handlers of Bxdf, Light and their
// like share.
#pragma once

#include <algorithm>
#include <cctype>

#include "ingest/rib/context.h"

namespace kanuka::ingest::ris {

// "theirs:ours" or, where both are the same, one name; separated by spaces.
struct Mapping {
    std::string_view theirs, ours, parameters;
};

// Is the name in the list, whose names are separated by spaces?
bool names(std::string_view list, std::string_view name);
// Our name of their parameter; empty = there is none.
std::string_view ours(std::string_view mapping, std::string_view theirs);

// The row for a plug-in, null = there is none.
template <size_t N>
const Mapping* find(const Mapping (&table)[N], std::string_view name) {
    // Plug-ins are files, which some systems find whatever their case.
    const auto same = [](char a, char b) {
        return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
    };
    for (const Mapping& m : table)
        if (std::ranges::equal(m.theirs, name, same))
            return &m;
    return nullptr;
}

void set(scene::ValueList& list, std::string_view name, scene::Type type, std::vector<float> floats);
void set(scene::ValueList& list, std::string_view name, float value);
void set(scene::ValueList& list, std::string_view name, Rgb c);
void set(scene::ValueList& list, std::string_view name, std::string text);

// Says once a shader which of its parameters have no counterpart.
void report_rest(Context& c, const Call& call, const Mapping& mapping, std::string_view known);

} // namespace kanuka::ingest::ris
