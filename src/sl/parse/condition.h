// Conditions of #if: an expression of numbers, in which macros are expanded already.
#pragma once

#include "sl/parse/token.h"

namespace kanuka::sl {

// What is malformed reads as zero; what follows the expression is reported.
double evaluate_condition(std::span<const Token> expression, Diagnostics& diagnostics);

} // namespace kanuka::sl
