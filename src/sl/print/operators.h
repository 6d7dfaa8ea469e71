// How C writes numbers and operations.
#pragma once

#include <string>
#include <string_view>

#include "sl/ir/ir.h"

namespace kanuka::sl {

// How tightly an expression holds together, so that parentheses stand only where they must.
enum Tightness { Choice = 1, Or, And, Equal, Less, Sum, Product, Prefix, Whole };

// The shortest that reads back as the same number.
std::string number_text(float x);
// The operator between two operands, and how tightly it holds them; empty = there is none.
std::string_view infix_operator(ir::Op op, int& tight);
// The name of the function that an operation is.
std::string function_name(const ir::Instr& i);

} // namespace kanuka::sl
