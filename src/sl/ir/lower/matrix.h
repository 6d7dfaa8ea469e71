// Matrices and the components of triples and matrices, as operations on floats.
#pragma once

#include "sl/ir/builder.h"

namespace kanuka::sl::ir {

Ref determinant(Builder& b, Ref matrix, Loc at);
Ref inverse(Builder& b, Ref matrix, Loc at); // a singular matrix has the inverse zero
// Elements of matrices are counted row by row. An index that is no constant may lie outside.
Ref component_of(Builder& b, Ref whole, Ref index, Loc at);
Ref with_component(Builder& b, Ref whole, Ref index, Ref value, Loc at);

} // namespace kanuka::sl::ir
