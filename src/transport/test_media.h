// Scenes with media, and what is known about them.
#pragma once

#include <functional>
#include <gtest/gtest.h>

#include "transport/test_scene.h"

namespace kanuka::transport::testing {

inline constexpr int Size = 16;

inline std::array<float, 4> amount(const Rgb& per_meter) {
    const float m = std::max({per_meter.x, per_meter.y, per_meter.z, 1e-9f});
    const auto c = color::uplift(per_meter * (0.5f / m));
    return {c[0], c[1], c[2], 2 * m};
}
inline double amount_at(const std::array<float, 4>& a, int i) {
    return double(a[3]) * double(color::uplift_eval({a[0], a[1], a[2]}, color::LambdaMin + float(i)));
}

inline store::Interior medium(const Rgb& absorption, const Rgb& scattering, float g = 0, float ior = 1,
                              float priority = 0) {
    store::Interior in;
    in.absorbs = std::max({absorption.x, absorption.y, absorption.z}) > 0;
    in.scatters = std::max({scattering.x, scattering.y, scattering.z}) > 0;
    if (in.absorbs)
        in.absorption_spectrum = amount(absorption);
    if (in.scatters)
        in.scattering_spectrum = amount(scattering);
    in.phase_inputs[0] = g;
    in.ior = ior;
    in.priority = priority;
    return in;
}

// What a camera sees of a spectrum that is `value` times white.
inline Rgb seen(const std::function<double(int)>& value) {
    double xyz[3] = {0, 0, 0};
    for (int i = 0; i < color::LambdaCount; i++) {
        const double light = color::illuminant_d65()[size_t(i)] * value(i);
        xyz[0] += light * color::cie_x()[size_t(i)], xyz[1] += light * color::cie_y()[size_t(i)],
            xyz[2] += light * color::cie_z()[size_t(i)];
    }
    const double n = color::cie_y_integral();
    return color::xyz_to_rgb({float(xyz[0] / n), float(xyz[1] / n), float(xyz[2] / n)});
}

inline scene::Light visible_sky(const Rgb& radiance) {
    scene::Light l = constant_sky(radiance);
    l.visible_camera = true;
    return l;
}

// Six walls facing outwards.
inline void add_box(TestScene& s, Vec3f c, float half, const std::vector<Lobe>& lobes, int interior) {
    const Vec3f x(half, 0, 0), y(0, half, 0), z(0, 0, half);
    s.add_quad(c - z, y, x, lobes, interior);
    s.add_quad(c + z, x, y, lobes, interior);
    s.add_quad(c - x, z, y, lobes, interior);
    s.add_quad(c + x, y, z, lobes, interior);
    s.add_quad(c - y, x, z, lobes, interior);
    s.add_quad(c + y, z, x, lobes, interior);
}

inline void look_along_z(TestScene& s, float half_width) {
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, half_width, Size, Size);
}

inline void expect_mean(const TestScene::Estimate& e, const Rgb& expected, double relative,
                        const std::string& what) {
    EXPECT_EQ(e.nan_samples, 0u) << what;
    for (int c = 0; c < 3; c++)
        EXPECT_NEAR(e.channel[c].mean(), double(expected[c]),
                    relative * double(expected[c]) + 4.5 * e.channel[c].error())
            << what << ", channel " << c;
}
inline void expect_same(const TestScene::Estimate& a, const TestScene::Estimate& b, double relative,
                        const std::string& what) {
    EXPECT_EQ(a.nan_samples + b.nan_samples, 0u) << what;
    for (int c = 0; c < 3; c++)
        EXPECT_NEAR(a.channel[c].mean(), b.channel[c].mean(),
                    relative * b.channel[c].mean() +
                        4.5 * std::hypot(a.channel[c].error(), b.channel[c].error()))
            << what << ", channel " << c;
}

} // namespace kanuka::transport::testing
