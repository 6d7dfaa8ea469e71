// The one table of Ri requests. The parser reads arguments by it, the context validates scopes by it and
// calls its handlers, the manual's list of requests is made from it; a writer and the C binding are to be
// driven by it too.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "ingest/rib/call.h"

namespace kanuka::ingest {

class Context;

enum class ArgType : uint8_t {
    None,
    Float,
    Integer, // RIB may write it as 4.0
    String,
    Handle,    // an integer or a string, made by NewHandle
    NewHandle, // in RIB an argument, in C the value returned
    Floats,    // exactly `count` floats, in brackets or not
    FloatArray,
    IntegerArray,
    StringArray,
    BasisMatrix, // the name of a basis, or 16 floats
};

struct ArgSpec {
    std::string_view name;
    ArgType type = ArgType::None;
    uint8_t count = 0;     // Floats: how many
    bool optional = false; // may be missing, with all after it
};

// What a parameter list means, which decides how undeclared tokens are read.
enum class Params : uint8_t { None, Shader, Option, Attribute, Primitive, Other };

// Where a request is legal: the innermost of these that is open; Motion in addition.
enum Scope : uint8_t { InOuter = 1, InFrame = 2, InWorld = 4, InObject = 8, InMotion = 16 };

enum class Support : uint8_t {
    Full,
    Partial,  // done, with limits that the note names
    Kept,     // stored in the scene for whoever wants it; changes nothing yet
    Ignored,  // read and checked, has no meaning here
    Needless, // its purpose is served without it; said once
    Missing,  // reported once, with the note as mend
};

enum class Since : uint8_t { V31, V32, Extension }; // RISpec 3.1, RISpec 3.2, or renderers' common extensions

struct RequestSpec {
    std::string_view name;
    Since since;
    uint8_t scopes;
    std::array<ArgSpec, MaxArguments> args;
    Params params;
    Support support;
    void (*handler)(Context&, Call&); // null: Ignored and Missing need none
    std::string_view note;

    size_t arg_count() const;
    std::string usage() const; // "Sphere radius zmin zmax thetamax …parameters…"
};

std::span<const RequestSpec> requests(); // sorted as the manual shows them
const RequestSpec* find_request(std::string_view name);
std::string_view nearest_request(std::string_view name); // empty = none is near

std::string_view name(ArgType type);
std::string_view name(Since since);
std::string_view name(Support support);
std::string scope_names(uint8_t scopes);
std::string requests_markdown(); // the table of docs/rib.md

} // namespace kanuka::ingest
