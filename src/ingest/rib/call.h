// One call of one request with its arguments: what the RIB parser and the C binding both make and the context
// executes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/error.h"
#include "scene/values.h"

namespace kanuka::ingest {

struct RequestSpec;

// Storage is kept from call to call, so that reading a large file allocates little.
struct Argument {
    bool given = false;
    bool is_text = false; // a Handle or Basis written as a string
    double number = 0;
    std::string text;
    std::vector<float> floats;
    std::vector<int32_t> ints;
    std::vector<std::string> strings;

    void clear() {
        given = is_text = false;
        number = 0;
        text.clear();
        floats.clear();
        ints.clear();
        strings.clear();
    }
};

inline constexpr size_t MaxArguments = 12;

struct Call {
    const RequestSpec* spec = nullptr;
    Location where;
    std::array<Argument, MaxArguments> args;
    scene::ValueList params;
    // The parameters' tokens as they were written, where a writer needs them: see Reader::pass_on.
    std::vector<std::string> tokens;

    float f(size_t i) const { return float(args[i].number); }
    double d(size_t i) const { return args[i].number; }
    int i(size_t k) const;
    const std::string& text(size_t i) const { return args[i].text; }
    // A handle as a name: the number 1, the string "1" and the number 1.0 are the same handle.
    std::string handle(size_t i) const;
};

} // namespace kanuka::ingest
