#include "sl/print/operators.h"

#include <cstdio>
#include <cstdlib>

#include "sl/ops/noise.h"

namespace kanuka::sl {

using namespace ir;

std::string number_text(float x) {
    char s[32];
    std::snprintf(s, sizeof s, "%.9g", double(x));
    for (int digits = 1; digits < 9; digits++) {
        char shorter[32];
        std::snprintf(shorter, sizeof shorter, "%.*g", digits, double(x));
        if (std::strtof(shorter, nullptr) == x)
            return shorter;
    }
    return s;
}

std::string_view infix_operator(Op op, int& tight) {
    switch (op) {
    case Op::Add:
        return tight = Sum, "+";
    case Op::Sub:
        return tight = Sum, "-";
    case Op::Mul:
        return tight = Product, "*";
    case Op::Div:
        return tight = Product, "/";
    case Op::Lt:
        return tight = Less, "<";
    case Op::Le:
        return tight = Less, "<=";
    case Op::Gt:
        return tight = Less, ">";
    case Op::Ge:
        return tight = Less, ">=";
    case Op::Eq:
        return tight = Equal, "==";
    case Op::Ne:
        return tight = Equal, "!=";
    case Op::And:
        return tight = And, "&&";
    case Op::Or:
        return tight = Or, "||";
    default:
        return {};
    }
}

std::string function_name(const Instr& i) {
    static constexpr const char* Functions[] = {"sin", "cos",  "tan",   "asin", "acos", "atan", "exp",
                                                "log", "log2", "log10", "exp2", "cbrt", "pow",  "atan2"};
    switch (i.op) {
    case Op::Min:
        return "min";
    case Op::Max:
        return "max";
    case Op::Abs:
        return "abs";
    case Op::Floor:
        return "floor";
    case Op::Ceil:
        return "ceil";
    case Op::Sqrt:
        return "sqrt";
    case Op::Math1:
    case Op::Math2:
        return Functions[size_t(i.imm)];
    case Op::SameText:
        return "same";
    case Op::ToFloat:
        return "float";
    case Op::Splat:
        return "float3";
    case Op::Make:
        return i.ty == Ty::Matrix ? "matrix" : "float3";
    case Op::Dot:
        return "dot";
    case Op::Cross:
        return "cross";
    case Op::MatMul:
        return "mul";
    case Op::Noise:
        return std::string(ops::noise_kernels()[size_t(i.imm)].symbol);
    default:
        return "op" + std::to_string(int(i.op));
    }
}

} // namespace kanuka::sl
