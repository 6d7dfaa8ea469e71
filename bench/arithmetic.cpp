#include "arithmetic.h"

#include <cmath>

constexpr int Steps = 24; // of about twenty operations each

std::string arithmetic_shader() {
    std::string steps;
    for (int k = 0; k < Steps; k++) {
        const std::string a = std::to_string(0.3f + 0.01f * float(k)),
                          b = std::to_string(0.7f - 0.02f * float(k));
        steps += "        x = x * (" + a + " + y * " + b +
                 ") - z * z * 0.125;\n"
                 "        y = y * 0.75 + sqrt(abs(x * z) + 0.01) * " +
                 a +
                 " - x * 0.0625;\n"
                 "        z = clamp(z * " +
                 b +
                 " + x * y * 0.25, -1, 1);\n"
                 "        s = s + x * y - z / (1.5 + y * y);\n";
    }
    return "class arithmetic() {\n"
           "    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {\n"
           "        MnkMaterialBoundary boundary = CreateBoundary(m);\n"
           "        AddLobe(boundary, \"light\", DiffuseEmission());\n"
           "    }\n"
           "    public void mnk_prelighting(output MnkMaterialBoundary boundary) {\n"
           "        float x = xcomp(P), y = ycomp(P), z = zcomp(P), s = 0;\n" +
           steps +
           "        SetLobe(boundary, \"light\", 1, DiffuseEmission(\"radiance\", abs(color(x, y, s))));\n"
           "    }\n"
           "}\n";
}

void arithmetic_by_hand(int n, const float* __restrict px, const float* __restrict py,
                        const float* __restrict pz, float* __restrict r, float* __restrict g,
                        float* __restrict b) {
    for (int i = 0; i < n; i++) {
        float x = px[i], y = py[i], z = pz[i], s = 0;
#pragma GCC unroll 24
        for (int k = 0; k < Steps; k++) {
            const float p = 0.3f + 0.01f * float(k), q = 0.7f - 0.02f * float(k);
            x = x * (p + y * q) - z * z * 0.125f;
            y = y * 0.75f + std::sqrt(std::fabs(x * z) + 0.01f) * p - x * 0.0625f;
            z = z * q + x * y * 0.25f;
            z = z < -1 ? -1 : z > 1 ? 1 : z;
            s = s + x * y - z / (1.5f + y * y);
        }
        r[i] = std::fabs(x), g[i] = std::fabs(y), b[i] = std::fabs(s);
    }
}
