// The same maths twice: as a shader, and by hand in C++ for the compiler's vectoriser (arithmetic.cpp).
#pragma once

#include <string>

std::string arithmetic_shader();
// r = f(P) for n points, each component an array.
void arithmetic_by_hand(int n, const float* x, const float* y, const float* z, float* r, float* g, float* b);
