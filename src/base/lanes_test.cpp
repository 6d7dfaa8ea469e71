// Every operation on lanes gives the same bits for 1, 8 and 16 lanes, and what the scalar language says.
#include "base/rows.h"

#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

namespace kanuka {
namespace {

constexpr float Inf = std::numeric_limits<float>::infinity(), NaN = std::numeric_limits<float>::quiet_NaN();

uint32_t bits_of(float f) {
    uint32_t b;
    std::memcpy(&b, &f, 4);
    return f == f ? b : 0x7fc00000u; // which NaN comes out is not promised
}
float float_of(uint32_t b) {
    float f;
    std::memcpy(&f, &b, 4);
    return f;
}

// Special values paired with one another, then random bit patterns and ordinary numbers.
struct Operands {
    std::vector<float> a, b, c;

    Operands() {
        const float special[] = {0.0f,    -0.0f,         1.0f,        -1.0f,        0.5f, -2.5f,
                                 3.4e38f, -3.4e38f,      1e-40f,      -1e-45f,      Inf,  -Inf,
                                 NaN,     1.175494e-38f, 16777217.0f, 2147483520.0f};
        for (float x : special)
            for (float y : special) {
                a.push_back(x), b.push_back(y), c.push_back(special[(a.size() * 7) % std::size(special)]);
            }
        std::mt19937 g(1);
        std::uniform_real_distribution<float> ordinary(-100, 100);
        for (int i = 0; i < 16384; i++) {
            const bool wild = i & 1;
            for (auto* v : {&a, &b, &c})
                v->push_back(wild ? float_of(uint32_t(g())) : ordinary(g));
        }
    }
    size_t size() const { return a.size(); }
};

const Operands& operands() {
    static const Operands o;
    return o;
}

template <int W>
uint32_t lane_bits(const Float<W>& x, int i) {
    return bits_of(x[i]);
}
template <int W>
uint32_t lane_bits(const Int<W>& x, int i) {
    return uint32_t(x[i]);
}
template <int W>
uint32_t lane_bits(const Mask<W>& x, int i) {
    return uint32_t(x[i]);
}

template <int W, class Op>
std::vector<uint32_t> run(const Op& op) {
    const Operands& in = operands();
    std::vector<uint32_t> out;
    for (size_t i = 0; i + W <= in.size(); i += W) {
        const auto r = op(Float<W>::load(&in.a[i]), Float<W>::load(&in.b[i]), Float<W>::load(&in.c[i]));
        for (int k = 0; k < W; k++)
            out.push_back(lane_bits(r, k));
    }
    return out;
}

size_t first_difference(const std::vector<uint32_t>& x, const std::vector<uint32_t>& y) {
    for (size_t i = 0; i < x.size(); i++)
        if (x[i] != y[i])
            return i;
    return x.size();
}

// All widths against one lane, and one lane against `expected`, a scalar function.
template <class Op, class Scalar>
void check(const char* name, const Op& op, const Scalar& expected) {
    const Operands& in = operands();
    const auto one = run<1>(op), eight = run<8>(op), sixteen = run<16>(op);
    ASSERT_EQ(one.size(), in.size());
    ASSERT_EQ(eight.size(), in.size());
    ASSERT_EQ(sixteen.size(), in.size());
    for (const auto* wide : {&eight, &sixteen}) {
        const size_t i = first_difference(one, *wide);
        EXPECT_EQ(i, in.size()) << name << " differs between lane counts for " << in.a[i] << ", " << in.b[i]
                                << ", " << in.c[i];
    }
    for (size_t i = 0; i < in.size(); i++)
        ASSERT_EQ(one[i], expected(in.a[i], in.b[i], in.c[i]))
            << name << "(" << in.a[i] << ", " << in.b[i] << ", " << in.c[i] << ")";
}

#define CHECK_FLOAT(lanes, scalar)                                                                           \
    check(                                                                                                   \
        #lanes,                                                                                              \
        []([[maybe_unused]] auto a, [[maybe_unused]] auto b, [[maybe_unused]] auto c) { return lanes; },     \
        []([[maybe_unused]] float a, [[maybe_unused]] float b, [[maybe_unused]] float c) {                   \
            return bits_of(scalar);                                                                          \
        })
#define CHECK_BITS(lanes, scalar)                                                                            \
    check(                                                                                                   \
        #lanes,                                                                                              \
        []([[maybe_unused]] auto a, [[maybe_unused]] auto b, [[maybe_unused]] auto c) { return lanes; },     \
        []([[maybe_unused]] float a, [[maybe_unused]] float b, [[maybe_unused]] float c) {                   \
            return uint32_t(scalar);                                                                         \
        })

uint32_t raw(float f) {
    uint32_t b;
    std::memcpy(&b, &f, 4);
    return b;
}

} // namespace

TEST(Lanes, Arithmetic) {
    CHECK_FLOAT(a + b, a + b);
    CHECK_FLOAT(a - b, a - b);
    CHECK_FLOAT(a * b, a * b);
    CHECK_FLOAT(a / b, a / b);
    CHECK_FLOAT(-a, -a);
    CHECK_FLOAT(fma(a, b, c), __builtin_fmaf(a, b, c));
    CHECK_FLOAT(sqrt(a), __builtin_sqrtf(a));
    CHECK_FLOAT(floor(a), __builtin_floorf(a));
    CHECK_FLOAT(abs(a), std::fabs(a));
    CHECK_FLOAT(copysign(a, b), std::copysign(a, b));
    CHECK_FLOAT(a + decltype(a)(1.5f), a + 1.5f);
}

TEST(Lanes, MinAndMaxReturnTheSecondForNaN) {
    CHECK_FLOAT(min(a, b), a < b ? a : b);
    CHECK_FLOAT(max(a, b), a > b ? a : b);
    CHECK_FLOAT(clamp(a, decltype(a)(-1.0f), decltype(a)(1.0f)), a > -1 ? std::min(a, 1.0f) : -1.0f);
    CHECK_FLOAT(min(decltype(a)(NaN), a), a);
    CHECK_FLOAT(max(decltype(a)(NaN), a), a);
}

TEST(Lanes, Comparisons) {
    CHECK_BITS(a < b, a < b);
    CHECK_BITS(a > b, a > b);
    CHECK_BITS(a <= b, a <= b);
    CHECK_BITS(a >= b, a >= b);
    CHECK_BITS(a == b, a == b);
    CHECK_BITS(a != b, a != b);
    CHECK_BITS(is_finite(a), std::isfinite(a));
    CHECK_BITS((a < b) & (b < c), (a < b) && (b < c));
    CHECK_BITS((a < b) | (b < c), (a < b) || (b < c));
    CHECK_BITS((a < b) ^ (b < c), (a < b) != (b < c));
    CHECK_BITS(!(a < b), !(a < b));
    CHECK_FLOAT(select(a < b, b, c), a < b ? b : c);
}

TEST(Lanes, Conversions) {
    // Truncation; out of range gives the smallest integer, as SSE does.
    CHECK_BITS(to_int(a), _mm_cvttss_si32(_mm_set_ss(a)));
    CHECK_FLOAT((Float<int(sizeof a / 4)>(bitcast_int(a))), float(int32_t(raw(a))));
    CHECK_FLOAT(bitcast_float(bitcast_int(a)), a);
}

TEST(Lanes, Integers) {
    // Integers wrap: hashes live on it.
    CHECK_BITS(bitcast_int(a) + bitcast_int(b), raw(a) + raw(b));
    CHECK_BITS(bitcast_int(a) - bitcast_int(b), raw(a) - raw(b));
    CHECK_BITS(bitcast_int(a) * bitcast_int(b), raw(a) * raw(b));
    CHECK_BITS(bitcast_int(a) & bitcast_int(b), raw(a) & raw(b));
    CHECK_BITS(bitcast_int(a) | bitcast_int(b), raw(a) | raw(b));
    CHECK_BITS(bitcast_int(a) ^ bitcast_int(b), raw(a) ^ raw(b));
    CHECK_BITS(bitcast_int(a) << 7, raw(a) << 7);
    CHECK_BITS(bitcast_int(a) >> 7, raw(a) >> 7);
    CHECK_BITS(bitcast_int(a) >> (bitcast_int(b) & decltype(bitcast_int(b))(31)), raw(a) >> (raw(b) & 31));
    CHECK_BITS(bitcast_int(a) << (bitcast_int(b) & decltype(bitcast_int(b))(31)), raw(a) << (raw(b) & 31));
    CHECK_BITS(bitcast_int(a) < bitcast_int(b), int32_t(raw(a)) < int32_t(raw(b)));
    CHECK_BITS(bitcast_int(a) > bitcast_int(b), int32_t(raw(a)) > int32_t(raw(b)));
    CHECK_BITS(bitcast_int(a) <= bitcast_int(b), int32_t(raw(a)) <= int32_t(raw(b)));
    CHECK_BITS(bitcast_int(a) >= bitcast_int(b), int32_t(raw(a)) >= int32_t(raw(b)));
    CHECK_BITS(bitcast_int(a) == bitcast_int(b), raw(a) == raw(b));
    CHECK_BITS(bitcast_int(a) != bitcast_int(b), raw(a) != raw(b));
    CHECK_BITS(min(bitcast_int(a), bitcast_int(b)), std::min(int32_t(raw(a)), int32_t(raw(b))));
    CHECK_BITS(max(bitcast_int(a), bitcast_int(b)), std::max(int32_t(raw(a)), int32_t(raw(b))));
}

TEST(Lanes, Vectors) {
    const auto vectors = [](auto a, auto b, auto c) {
        using V = Vec3<decltype(a)>;
        return dot(cross(V(a, b, c), V(c, a, b)), V(b, c, a));
    };
    const auto scalar = [](float a, float b, float c) {
        return bits_of(dot(cross(Vec3f(a, b, c), Vec3f(c, a, b)), Vec3f(b, c, a)));
    };
    check("dot(cross)", vectors, scalar);
}

template <int W>
void broadcasts_keep_their_bits() {
    for (float f : {0.0f, -0.0f, 1.0f, -1.0f, Inf, -Inf, 1e-45f}) {
        const Float<W> x(f);
        for (int i = 0; i < W; i++)
            EXPECT_EQ(raw(x[i]), raw(f)) << W << " lanes of " << f;
    }
}
TEST(Lanes, BroadcastsKeepTheirBits) {
    broadcasts_keep_their_bits<1>();
    broadcasts_keep_their_bits<8>();
    broadcasts_keep_their_bits<16>();
}

template <int W>
void mask_queries() {
    EXPECT_TRUE(all(Mask<W>(true)));
    EXPECT_TRUE(none(Mask<W>(false)));
    EXPECT_FALSE(any(Mask<W>(false)));
    EXPECT_EQ(Mask<W>(true).bits(), (1u << W) - 1);
    for (int lane = 0; lane < W; lane++) {
        const Mask<W> m = Int<W>::lane_index() == Int<W>(lane);
        EXPECT_EQ(m.bits(), 1u << lane);
        EXPECT_TRUE(any(m));
        EXPECT_EQ(all(m), W == 1);
        EXPECT_EQ(all(!m), false);
        EXPECT_TRUE(m[lane]);
    }
}
TEST(Lanes, MaskQueries) {
    mask_queries<1>();
    mask_queries<8>();
    mask_queries<16>();
}

template <int W>
void memory_operations() {
    std::vector<float> table(100);
    std::vector<int32_t> numbers(100);
    for (int i = 0; i < 100; i++)
        table[size_t(i)] = float(i) * 0.5f, numbers[size_t(i)] = 1000 - i;
    const Int<W> index = (Int<W>::lane_index() * Int<W>(37) + Int<W>(11)) & Int<W>(63);
    const Float<W> f = gather(table.data(), index);
    const Int<W> n = gather(numbers.data(), index);
    for (int i = 0; i < W; i++) {
        EXPECT_EQ(f[i], 0.5f * float(index[i]));
        EXPECT_EQ(n[i], 1000 - index[i]);
    }
    const Mask<W> odd = (Int<W>::lane_index() & Int<W>(1)) == Int<W>(1);
    scatter(table.data(), Int<W>::lane_index() + Int<W>(64), Float<W>(-1.0f), odd);
    for (int i = 0; i < W; i++)
        EXPECT_EQ(table[size_t(64 + i)], i & 1 ? -1.0f : 0.5f * float(64 + i));
    float packed[2 * W + 1];
    packed[2 * W] = 77;
    const int count = compress_store(packed, Float<W>(Int<W>::lane_index()), odd.bits());
    EXPECT_EQ(count, W / 2);
    for (int i = 0; i < count; i++)
        EXPECT_EQ(packed[i], float(2 * i + 1));
    EXPECT_EQ(packed[2 * W], 77);
    for (uint32_t bits = 0; bits < (W == 16 ? 1u << 16 : 1u << W); bits += W == 16 ? 97 : 1) {
        const int kept = compress_store(packed, Float<W>(Int<W>::lane_index()), bits);
        ASSERT_EQ(kept, __builtin_popcount(bits));
        for (int i = 0, n = 0; i < W; i++) {
            if (bits >> i & 1) {
                ASSERT_EQ(packed[n++], float(i));
            }
        }
    }
}

// Rows out of a table, changed and put back, and packed.
template <int W>
void rows() {
    constexpr int Fields = 12, Count = 40;
    std::vector<float> table(size_t(Count) * Fields);
    for (size_t i = 0; i < table.size(); i++)
        table[i] = float(i);
    const Int<W> row = (Int<W>::lane_index() * Int<W>(7) + Int<W>(3)) & Int<W>(31);
    auto got = load_rows<Fields>(table.data(), row * Int<W>(Fields));
    for (int i = 0; i < W; i++)
        for (int f = 0; f < Fields; f++)
            ASSERT_EQ(got[size_t(f)][i], float(row[i] * Fields + f));
    for (auto& field : got)
        field = -field;
    const Mask<W> some = (Int<W>::lane_index() & Int<W>(3)) != Int<W>(2);
    store_rows(table.data(), row * Int<W>(Fields), got, some);
    std::vector<float> packed(size_t(W + 1) * Fields, 77);
    const int count = compress_rows(packed.data(), got, some.bits());
    EXPECT_EQ(count, __builtin_popcount(some.bits()));
    int n = 0;
    for (int i = 0; i < W; i++)
        for (int f = 0; f < Fields; f++) {
            const size_t at = size_t(row[i] * Fields + f);
            EXPECT_EQ(table[at], some[i] ? -float(at) : float(at));
            if (some[i]) {
                EXPECT_EQ(packed[size_t(n)], -float(at)) << n;
                n++;
            }
        }
    for (size_t i = size_t(count) * Fields; i < packed.size(); i++)
        EXPECT_EQ(packed[i], 77);
}
TEST(Lanes, Rows) {
    rows<1>();
    rows<8>();
    rows<16>();
}
TEST(Lanes, MemoryOperations) {
    memory_operations<1>();
    memory_operations<8>();
    memory_operations<16>();
}

template <int W>
void halves() {
    for (int base = 0; base < 65536; base += W) {
        const Float<W> f = half_to_float(Int<W>::lane_index() + Int<W>(base));
        for (int i = 0; i < W; i++) {
            const uint16_t h = uint16_t(base + i);
            if ((h & 0x7c00) == 0x7c00)
                continue; // infinities and NaN are never stored
            _Float16 half;
            std::memcpy(&half, &h, 2);
            ASSERT_EQ(raw(f[i]), raw(float(half))) << "half " << h << ", " << W << " lanes";
        }
    }
}
TEST(Lanes, HalvesAreExact) {
    halves<1>();
    halves<8>();
    halves<16>();
}

} // namespace kanuka
