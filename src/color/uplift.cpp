// The uplift table and its scalar lookup; transport's lanes follow the same steps.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "color/color.h"
#include "color/spaces.h"
#include "color/uplift_fit.h"

// The tables ride in the object file: 3 * resolution^3 * 3 floats each; UPLIFT_DIR is the folder of the
// files.
#define KANUKA_UPLIFT_TABLE(name, file)                                                                      \
    asm(".section .rodata\n"                                                                                 \
        ".balign 64\n"                                                                                       \
        ".global kanuka_" name "_begin\n"                                                                    \
        ".hidden kanuka_" name "_begin\n"                                                                    \
        "kanuka_" name "_begin:\n"                                                                           \
        ".incbin \"" UPLIFT_DIR "/" file "\"\n"                                                              \
        ".global kanuka_" name "_end\n"                                                                      \
        ".hidden kanuka_" name "_end\n"                                                                      \
        "kanuka_" name "_end:\n"                                                                             \
        ".byte 0\n"                                                                                          \
        ".previous\n")
KANUKA_UPLIFT_TABLE("uplift", "uplift.bin");
KANUKA_UPLIFT_TABLE("uplift_rec2020", "uplift_rec2020.bin");
KANUKA_UPLIFT_TABLE("uplift_acescg", "uplift_acescg.bin");
extern "C" const float kanuka_uplift_begin[], kanuka_uplift_end[];
extern "C" const float kanuka_uplift_rec2020_begin[], kanuka_uplift_rec2020_end[];
extern "C" const float kanuka_uplift_acescg_begin[], kanuka_uplift_acescg_end[];

namespace kanuka::color {

static UpliftTable read_table(const float* begin, const float* end) {
    UpliftTable t;
    const size_t count = size_t(end - begin);
    t.coefficients.resize(count);
    std::memcpy(t.coefficients.data(), begin, count * sizeof(float));
    t.resolution = int(std::lround(std::cbrt(double(count) / 9)));
    for (int i = 0; i < t.resolution; i++)
        t.scale.push_back(float(uplift_scale(i, t.resolution)));
    const double first = uplift_warp(UpliftDarkest);
    t.z_factor = float((t.resolution - 1) / (1 - first));
    t.z_offset = float(-first * (t.resolution - 1) / (1 - first));
    return t;
}

const UpliftTable& uplift_table() {
    static const UpliftTable table = read_table(kanuka_uplift_begin, kanuka_uplift_end);
    return table;
}

const UpliftTable& uplift_table(Space space) {
    static const UpliftTable rec2020 = read_table(kanuka_uplift_rec2020_begin, kanuka_uplift_rec2020_end);
    static const UpliftTable acescg = read_table(kanuka_uplift_acescg_begin, kanuka_uplift_acescg_end);
    return space == Space::Rec2020 ? rec2020 : space == Space::AcesCg ? acescg : uplift_table();
}

std::array<float, 3> uplift(const Rgb& rgb) {
    return uplift(rgb, uplift_table());
}

std::array<float, 3> uplift(const Rgb& rgb, const UpliftTable& table) {
    const int n = table.resolution;

    // 1. Clamp; bright colours by their complement.
    float c[3];
    for (int i = 0; i < 3; i++)
        c[i] = rgb[i] > 0 ? std::min(rgb[i], 1.0f) : 0.0f; // NaN is 0
    float mean = (c[0] + c[1] + c[2]) * (1.0f / 3);
    const float sign = mean > 0.5f ? -1.0f : 1.0f;
    if (mean > 0.5f) {
        for (float& v : c)
            v = 1 - v;
        mean = (c[0] + c[1] + c[2]) * (1.0f / 3);
    }

    // 2. The largest component picks the table.
    const int m = c[0] >= c[1] ? (c[0] >= c[2] ? 0 : 2) : (c[1] >= c[2] ? 1 : 2);
    const float v = c[m], divisor = v > 0 ? v : 1;

    // 3. Cell, and position in it.
    const float at[3] = {
        std::sqrt(c[(m + 1) % 3] / divisor) * float(n - 1),
        std::sqrt(c[(m + 2) % 3] / divisor) * float(n - 1),
        std::max(fma(table.z_factor, std::sqrt(std::sqrt(v)) - std::sqrt(1 - v), table.z_offset), 0.0f)};
    int cell[3];
    float weight[3][2];
    for (int i = 0; i < 3; i++) {
        cell[i] = std::min(int(at[i]), n - 2);
        weight[i][1] = std::min(at[i] - float(cell[i]), 1.0f);
        weight[i][0] = 1 - weight[i][1];
    }

    // 4. Grey, plus the trilinear mix of the eight knots.
    std::array<float, 3> q{0, 0, mean - 0.5f};
    for (int corner = 0; corner < 8; corner++) {
        const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
        const float w = weight[0][dx] * weight[1][dy] * weight[2][dz];
        const size_t knot = ((size_t(m) * n + cell[2] + dz) * n + cell[1] + dy) * n + cell[0] + dx;
        for (int k = 0; k < 3; k++)
            q[k] = fma(w, table.coefficients[knot * 3 + k], q[k]);
    }

    // 5. From q to c.
    const float k = sign / std::sqrt(std::max(mean * (1 - mean), 1e-30f));
    return {q[0] * k, q[1] * k, q[2] * k};
}

float uplift_eval(const std::array<float, 3>& c, float lambda) {
    const float l = (lambda - LambdaMin) * (1 / (LambdaMax - LambdaMin));
    const float x = fma(fma(c[0], l, c[1]), l, c[2]);
    const float root = std::sqrt(fma(x, x, 1.0f));
    const float small = 0.5f / (root * (root + std::abs(x)));
    return x < 0 ? small : 1 - small;
}

} // namespace kanuka::color
