#include "sl/ir/lower/matrix.h"

#include <algorithm>
#include <tuple>

namespace kanuka::sl::ir {

namespace {

// The 2x2 minors of the upper two rows (s) and the lower two (c) give determinant and inverse (Laplace
// expansion).
struct Minors {
    Ref m[16], s[6], c[6];
};

Minors minors(Builder& b, Ref matrix, Loc at) {
    Minors r;
    for (int i = 0; i < 16; i++)
        r.m[i] = b.emit(Op::Extract, Ty::Float, {matrix}, at, i);
    const auto minor = [&](int row, int i, int j) {
        const Ref x = b.emit(Op::Mul, Ty::Float, {r.m[row * 4 + i], r.m[row * 4 + 4 + j]}, at);
        const Ref y = b.emit(Op::Mul, Ty::Float, {r.m[row * 4 + 4 + i], r.m[row * 4 + j]}, at);
        return b.emit(Op::Sub, Ty::Float, {x, y}, at);
    };
    static constexpr int Columns[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    for (int k = 0; k < 6; k++) {
        r.s[k] = minor(0, Columns[k][0], Columns[k][1]);
        r.c[k] = minor(2, Columns[k][0], Columns[k][1]);
    }
    return r;
}

Ref sum(Builder& b, Loc at, std::initializer_list<std::tuple<int, Ref, Ref>> terms) {
    Ref total = ir::None;
    for (const auto& [sign, x, y] : terms) {
        Ref t = b.emit(Op::Mul, Ty::Float, {x, y}, at);
        if (total == ir::None)
            total = sign > 0 ? t : b.emit(Op::Neg, Ty::Float, {t}, at);
        else
            total = b.emit(sign > 0 ? Op::Add : Op::Sub, Ty::Float, {total, t}, at);
    }
    return total;
}

Ref determinant_of(Builder& b, const Minors& q, Loc at) {
    return sum(b, at,
               {{1, q.s[0], q.c[5]},
                {-1, q.s[1], q.c[4]},
                {1, q.s[2], q.c[3]},
                {1, q.s[3], q.c[2]},
                {-1, q.s[4], q.c[1]},
                {1, q.s[5], q.c[0]}});
}

} // namespace

Ref determinant(Builder& b, Ref m, Loc at) {
    return determinant_of(b, minors(b, m, at), at);
}

Ref inverse(Builder& b, Ref matrix, Loc at) {
    const Minors q = minors(b, matrix, at);
    const Ref* m = q.m;
    const Ref *s = q.s, *c = q.c;
    const Ref det = determinant_of(b, q, at);
    // A singular matrix has the inverse zero.
    const Ref singular = b.emit(Op::Eq, Ty::Bool, {det, b.constant(0.0f)}, at);
    const Ref safe = b.emit(Op::Select, Ty::Float, {singular, b.constant(1.0f), det}, at);
    const Ref one = b.emit(Op::Select, Ty::Float, {singular, b.constant(0.0f), b.constant(1.0f)}, at);
    const Ref scale = b.emit(Op::Div, Ty::Float, {one, safe}, at);
    const std::vector<Ref> adjugate = {
        sum(b, at, {{1, m[5], c[5]}, {-1, m[6], c[4]}, {1, m[7], c[3]}}),
        sum(b, at, {{-1, m[1], c[5]}, {1, m[2], c[4]}, {-1, m[3], c[3]}}),
        sum(b, at, {{1, m[13], s[5]}, {-1, m[14], s[4]}, {1, m[15], s[3]}}),
        sum(b, at, {{-1, m[9], s[5]}, {1, m[10], s[4]}, {-1, m[11], s[3]}}),
        sum(b, at, {{-1, m[4], c[5]}, {1, m[6], c[2]}, {-1, m[7], c[1]}}),
        sum(b, at, {{1, m[0], c[5]}, {-1, m[2], c[2]}, {1, m[3], c[1]}}),
        sum(b, at, {{-1, m[12], s[5]}, {1, m[14], s[2]}, {-1, m[15], s[1]}}),
        sum(b, at, {{1, m[8], s[5]}, {-1, m[10], s[2]}, {1, m[11], s[1]}}),
        sum(b, at, {{1, m[4], c[4]}, {-1, m[5], c[2]}, {1, m[7], c[0]}}),
        sum(b, at, {{-1, m[0], c[4]}, {1, m[1], c[2]}, {-1, m[3], c[0]}}),
        sum(b, at, {{1, m[12], s[4]}, {-1, m[13], s[2]}, {1, m[15], s[0]}}),
        sum(b, at, {{-1, m[8], s[4]}, {1, m[9], s[2]}, {-1, m[11], s[0]}}),
        sum(b, at, {{-1, m[4], c[3]}, {1, m[5], c[1]}, {-1, m[6], c[0]}}),
        sum(b, at, {{1, m[0], c[3]}, {-1, m[1], c[1]}, {1, m[2], c[0]}}),
        sum(b, at, {{-1, m[12], s[3]}, {1, m[13], s[1]}, {-1, m[14], s[0]}}),
        sum(b, at, {{1, m[8], s[3]}, {-1, m[9], s[1]}, {1, m[10], s[0]}}),
    };
    std::vector<Ref> out;
    for (Ref a : adjugate)
        out.push_back(b.emit(Op::Mul, Ty::Float, {a, scale}, at));
    return b.emit(Op::Make, Ty::Matrix, std::move(out), at);
}

// Is `index` element i?
static Ref is_element(Builder& b, Ref index, int i, Loc at) {
    if (b.is_const(index))
        return b.boolean(int(b.at(index).floats[0]) == i);
    const Ref low = b.emit(Op::Ge, Ty::Bool, {index, b.constant(float(i))}, at);
    const Ref high = b.emit(Op::Lt, Ty::Bool, {index, b.constant(float(i + 1))}, at);
    return b.emit(Op::And, Ty::Bool, {low, high}, at);
}

Ref component_of(Builder& b, Ref whole, Ref index, Loc at) {
    const int n = comps(b.at(whole).ty);
    const auto part = [&](int i) { return b.emit(Op::Extract, Ty::Float, {whole}, at, i); };
    if (b.is_const(index)) {
        const float f = b.at(index).floats[0];
        return part(f > 0 ? int(std::min(f, float(n - 1))) : 0);
    }
    Ref r = part(0);
    for (int i = 1; i < n; i++)
        r = b.emit(Op::Select, Ty::Float, {is_element(b, index, i, at), part(i), r}, at);
    return r;
}

Ref with_component(Builder& b, Ref whole, Ref index, Ref value, Loc at) {
    const Ty t = b.at(whole).ty;
    std::vector<Ref> parts;
    for (int i = 0; i < comps(t); i++) {
        const Ref old = b.emit(Op::Extract, Ty::Float, {whole}, at, i);
        parts.push_back(b.emit(Op::Select, Ty::Float, {is_element(b, index, i, at), value, old}, at));
    }
    return b.emit(Op::Make, t, std::move(parts), at);
}

} // namespace kanuka::sl::ir
