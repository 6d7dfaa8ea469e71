// The C side of the table of requests: parameters in C, which besides a request's arguments hold the lengths
// of arrays. ri.h and the functions behind it are made from it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "ingest/rib/requests.h"

namespace kanuka::ri {

struct Parameter {
    std::string type, name;
    std::string length; // a C++ expression over the others; empty = no array
};

struct Signature {
    const ingest::RequestSpec* spec;
    std::string result; // "RtVoid", or what the function returns
    std::vector<Parameter> parameters;
    // For primitives: a C++ expression for how many vertices there are, where the arguments do not say.
    std::string vertices = "0";
};

// Of all requests that are made by the table alone; the rest are written by hand in manual.cpp.
std::vector<Signature> signatures();

} // namespace kanuka::ri
