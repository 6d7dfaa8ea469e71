// The filters and bases of ri.h.

#include <algorithm>
#include <cmath>

#include "ri.h"

namespace {

constexpr float Pi = 3.14159265358979f;

float sinc(float x) {
    return std::abs(x) < 1e-4f ? 1 : std::sin(Pi * x) / (Pi * x);
}

float bessel(float r) { // J1(pi r) / (pi r / 2): the disc's counterpart of sinc
    return r < 1e-3f ? 1 : float(std::cyl_bessel_j(1.0, double(Pi * r))) / (0.5f * Pi * r);
}

float catmull_rom(float x) {
    x = std::abs(x);
    return x < 1 ? (1.5f * x - 2.5f) * x * x + 1 : x < 2 ? ((-0.5f * x + 2.5f) * x - 4) * x + 2 : 0;
}

float mitchell(float x) { // B = C = 1/3 over [-2, 2]
    x = std::abs(x);
    if (x < 1)
        return (7 * x * x * x - 12 * x * x + 16.0f / 3) / 6;
    return x < 2 ? (-7.0f / 3 * x * x * x + 12 * x * x - 20 * x + 32.0f / 3) / 6 : 0;
}

float blackman_harris(float x) { // over [-1/2, 1/2]
    if (std::abs(x) > 0.5f)
        return 0;
    const float t = 2 * Pi * (x + 0.5f);
    return 0.35875f - 0.48829f * std::cos(t) + 0.14128f * std::cos(2 * t) - 0.01168f * std::cos(3 * t);
}

float lanczos(float x, float width) { // sinc under the lobe of another that ends at the width
    return std::abs(2 * x) < width ? sinc(x) * sinc(2 * x / width) : 0;
}

} // namespace

extern "C" {

RtBasis RiBezierBasis = {{-1, 3, -3, 1}, {3, -6, 3, 0}, {-3, 3, 0, 0}, {1, 0, 0, 0}};
RtBasis RiBSplineBasis = {{-1.f / 6, 3.f / 6, -3.f / 6, 1.f / 6},
                          {3.f / 6, -6.f / 6, 3.f / 6, 0},
                          {-3.f / 6, 0, 3.f / 6, 0},
                          {1.f / 6, 4.f / 6, 1.f / 6, 0}};
RtBasis RiCatmullRomBasis = {
    {-0.5f, 1.5f, -1.5f, 0.5f}, {1, -2.5f, 2, -0.5f}, {-0.5f, 0, 0.5f, 0}, {0, 1, 0, 0}};
RtBasis RiHermiteBasis = {{2, 1, -2, 1}, {-3, -2, 3, -1}, {0, 1, 0, 0}, {1, 0, 0, 0}};
RtBasis RiPowerBasis = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};

RtFloat RiBoxFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return std::abs(x) <= xw / 2 && std::abs(y) <= yw / 2 ? 1 : 0;
}
RtFloat RiTriangleFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return std::max(0.0f, 1 - 2 * std::abs(x) / xw) * std::max(0.0f, 1 - 2 * std::abs(y) / yw);
}
RtFloat RiCatmullRomFilter(RtFloat x, RtFloat y, RtFloat, RtFloat) {
    return catmull_rom(x) * catmull_rom(y);
}
RtFloat RiSincFilter(RtFloat x, RtFloat y, RtFloat, RtFloat) {
    return sinc(x) * sinc(y);
}
RtFloat RiBesselFilter(RtFloat x, RtFloat y, RtFloat, RtFloat) {
    return bessel(std::hypot(x, y));
}
RtFloat RiGaussianFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    x *= 2 / xw;
    y *= 2 / yw;
    return std::exp(-2 * (x * x + y * y));
}
RtFloat RiMitchellFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return mitchell(4 * x / xw) * mitchell(4 * y / yw);
}
RtFloat RiBlackmanHarrisFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return blackman_harris(x / xw) * blackman_harris(y / yw);
}
RtFloat RiDiskFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return std::hypot(2 * x / xw, 2 * y / yw) <= 1 ? 1 : 0;
}
RtFloat RiLanczosFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return lanczos(x, xw) * lanczos(y, yw);
}
RtFloat RiSeparableCatmullRomFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return RiCatmullRomFilter(x, y, xw, yw);
}

} // extern "C"
