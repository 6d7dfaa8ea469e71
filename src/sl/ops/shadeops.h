// The one table of shadeops: names, signatures, documentation and implementation. Sema resolves calls with
// it, lowering implements them with it, and docs/shadeops.md is printed from it.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sl/ir/ir.h"
#include "sl/parse/ast.h"

namespace kanuka::sl::ops {

enum class Impl : uint8_t {
    Primitive, // one IR operation, componentwise if its arguments are triples
    Source,    // RSL: the row's source
    Special,   // lowering knows it by name
    Closure,   // light that is not known yet
    Noise,
};

// Where a shadeop may be called.
enum Where : uint8_t { Anywhere = 0, ClosureOnly = 1, InitOnly = 2, InteriorOnly = 4, PrelightingOnly = 8 };

struct Argument {
    ast::Type type;
    bool output = false;
    std::string name;
};

struct Signature {
    ast::Type result;
    std::vector<Argument> args;
    bool variadic = false; // further arguments, or name and value pairs, may follow
    Impl impl = Impl::Special;
    ir::Op op = ir::Op::Const;
    int imm = 0;
    std::string source; // Impl::Source: the whole function
};

struct Shadeop {
    std::string name, category, doc;
    std::vector<Signature> signatures;
};

std::span<const Shadeop> shadeops();
const Shadeop* find_shadeop(std::string_view name);
std::string shadeops_manual(); // Markdown

// Names for a spline's basis: its 4x4 matrix by rows (coefficients of t^3, t^2, t, 1) and its step, null if
// unknown.
struct SplineBasis {
    float m[4][4];
    int step;
};
const SplineBasis* find_basis(std::string_view name);

// ---- the variables that every shader sees
// --------------------------------------------------------------------------

struct Global {
    std::string_view name;
    ast::Base type;
    int input;    // ir::Input; -1 = special
    bool written; // by a shader
    std::string_view doc;
};
std::span<const Global> globals();

} // namespace kanuka::sl::ops
