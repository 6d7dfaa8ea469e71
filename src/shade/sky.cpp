#include "shade/sky.h"

#include <cmath>

#include "base/latlong.h"
#include "color/color.h"

namespace kanuka::shade {

namespace {

constexpr int Width = 512, Height = 256; // of the picture; its lower half is the ground

struct Sun {
    float theta; // from the zenith
    Vec3f direction;
    float turbidity;
};

Sun clean(const Vec3f& sun, float turbidity) {
    const float size = length(sun);
    Vec3f d = size > 0 && std::isfinite(size) ? sun * (1 / size) : Vec3f(0, 0, 1);
    // At least half a degree above the horizon.
    constexpr float Lowest = 0.0087f;
    if (d.z < Lowest) {
        const float across = std::hypot(d.x, d.y),
                    scale = std::sqrt(1 - Lowest * Lowest) / std::max(across, 1e-6f);
        d = across > 1e-6f ? Vec3f(d.x * scale, d.y * scale, Lowest)
                           : Vec3f(std::sqrt(1 - Lowest * Lowest), 0, Lowest);
    }
    return {std::acos(std::clamp(d.z, -1.0f, 1.0f)), d,
            std::isfinite(turbidity) ? std::clamp(turbidity, 2.0f, 10.0f) : 2.0f};
}

// Perez et al. 1993: F = (1 + A exp(B / cos theta)) (1 + C exp(D gamma) + E cos^2 gamma).
struct Perez {
    float a, b, c, d, e;
    float at(float cos_theta, float gamma) const {
        const float cosine = std::cos(gamma);
        return (1 + a * std::exp(b / std::max(cos_theta, 0.01f))) *
               (1 + c * std::exp(d * gamma) + e * cosine * cosine);
    }
};

} // namespace

std::shared_ptr<const scene::LightTable> preetham_sky(const Vec3f& toward, float turbidity) {
    const Sun sun = clean(toward, turbidity);
    const float T = sun.turbidity, s = sun.theta, s2 = s * s, s3 = s2 * s;
    // Appendix A.2: the distribution of Y, x and y, and their values at the zenith.
    const Perez fy{0.1787f * T - 1.4630f, -0.3554f * T + 0.4275f, -0.0227f * T + 5.3251f,
                   0.1206f * T - 2.5771f, -0.0670f * T + 0.3703f};
    const Perez fcx{-0.0193f * T - 0.2592f, -0.0665f * T + 0.0008f, -0.0004f * T + 0.2125f,
                    -0.0641f * T - 0.8989f, -0.0033f * T + 0.0452f};
    const Perez fcy{-0.0167f * T - 0.2608f, -0.0950f * T + 0.0092f, -0.0079f * T + 0.2102f,
                    -0.0441f * T - 1.6537f, -0.0109f * T + 0.0529f};
    const float chi = (4.0f / 9 - T / 120) * (Pi - 2 * s);
    const float Yz = std::max((4.0453f * T - 4.9710f) * std::tan(chi) - 0.2155f * T + 2.4192f, 0.0f);
    const float xz = T * T * (0.00166f * s3 - 0.00375f * s2 + 0.00209f * s) +
                     T * (-0.02903f * s3 + 0.06377f * s2 - 0.03202f * s + 0.00394f) + 0.11693f * s3 -
                     0.21196f * s2 + 0.06052f * s + 0.25886f;
    const float yz = T * T * (0.00275f * s3 - 0.00610f * s2 + 0.00317f * s) +
                     T * (-0.04214f * s3 + 0.08970f * s2 - 0.04153f * s + 0.00516f) + 0.15346f * s3 -
                     0.26756f * s2 + 0.06670f * s + 0.26688f;
    auto table = std::make_shared<scene::LightTable>();
    table->width = Width, table->height = Height;
    table->angle = Pi;
    table->rgb.assign(size_t(Width) * Height * 3, 0.0f);
    for (int j = 0; j < Height / 2; j++)
        for (int i = 0; i < Width; i++) {
            const Vec3f d = latlong_direction((float(i) + 0.5f) / Width, (float(j) + 0.5f) / Height);
            const float gamma = std::acos(std::clamp(dot(d, sun.direction), -1.0f, 1.0f));
            const auto value = [&](const Perez& f, float zenith) {
                return zenith * f.at(d.z, gamma) / f.at(1, s);
            };
            const float Y = value(fy, Yz), x = value(fcx, xz), y = std::max(value(fcy, yz), 0.01f);
            const Rgb rgb = color::xyz_to_rgb({x / y * Y, Y, (1 - x - y) / y * Y});
            for (int c = 0; c < 3; c++)
                table->rgb[(size_t(j) * Width + size_t(i)) * 3 + size_t(c)] = std::max(rgb[c], 0.0f);
        }
    return table;
}

Rgb preetham_sun(const Vec3f& toward, float turbidity) {
    const Sun sun = clean(toward, turbidity);
    const float T = sun.turbidity;
    // Appendix A.1. Relative optical mass: Kasten's formula, theta in degrees.
    const float mass =
        1 / (std::cos(sun.theta) + 0.15f * std::pow(93.885f - sun.theta * 180 * InvPi, -1.253f));
    const color::Table outside = color::blackbody(5778);
    const auto &cx = color::cie_x(), &cy = color::cie_y(), &cz = color::cie_z();
    const float beta = 0.04608f * T - 0.04586f; // Angstrom's turbidity
    double xyz[3] = {0, 0, 0}, above = 0;
    for (int i = 0; i < color::LambdaCount; i++) {
        const float um = (color::LambdaMin + float(i)) * 1e-3f;
        const float rayleigh = std::exp(-0.008735f * mass * std::pow(um, -4.08f));
        const float aerosol = std::exp(-beta * mass * std::pow(um, -1.3f));
        // Ozone's Chappuis band, 0.35 cm of it: a bell about 600 nm stands in for the table.
        const float bell = (um - 0.600f) / 0.058f,
                    ozone = std::exp(-0.12f * 0.35f * mass * std::exp(-0.5f * bell * bell));
        const double s = double(outside[size_t(i)] * rayleigh * aerosol * ozone);
        xyz[0] += s * double(cx[size_t(i)]), xyz[1] += s * double(cy[size_t(i)]),
            xyz[2] += s * double(cz[size_t(i)]);
        above += double(outside[size_t(i)] * cy[size_t(i)]);
    }
    // Outside the air the sun gives 134 000 lux at the mean distance (CIE 108).
    const double scale = 134 / above;
    Rgb rgb = color::xyz_to_rgb({float(xyz[0] * scale), float(xyz[1] * scale), float(xyz[2] * scale)});
    for (int c = 0; c < 3; c++)
        rgb[c] = std::max(rgb[c], 0.0f);
    return rgb;
}

} // namespace kanuka::shade
