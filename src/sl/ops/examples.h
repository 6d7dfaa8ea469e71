// One small use of every shadeop and statement, with what comes of it. The manual prints them, a test runs
// them: a row of the table without an example fails it.
#pragma once

#include <span>
#include <string_view>

namespace kanuka::sl::ops {

struct Example {
    enum Kind : uint8_t {
        Value,   // `expression`, a float, has the value `expected` after the statements of `before`
        Surface, // `before` is the body of a surface
        Source,  // `before` is a whole source
    } kind;
    std::string_view of;
    std::string_view before, expression;
    float expected;
};

// At u = s = 0.5, v = t = 0.4 of the plane P = (2u, v, 0), N = (0, 0, 1), whose vertices are du = 1/8, dv =
// 1/5 apart.
std::span<const Example> shadeop_examples();
std::span<const Example> statement_examples();

} // namespace kanuka::sl::ops
