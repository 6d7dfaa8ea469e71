// For tests: a floor under lights, against the irradiance that it ought to have.
#pragma once

#include <functional>
#include <gtest/gtest.h>

#include "transport/test_scene.h"

namespace kanuka::transport::testing {

inline constexpr int Size = 24;
inline constexpr float Reflectance = 0.8f;

// A floor at y = -1 that fills the picture, seen from the origin; everything that shines is above.
struct FloorScene : TestScene {
    explicit FloorScene(const std::vector<Lobe>& lobes = {matte(Rgb(Reflectance))}) {
        add_quad({0, -1, 0}, {0, 0, 4}, {4, 0, 0}, lobes);
        camera({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, 0.8f, Size, Size);
        inputs.max_depth = 1;
    }
    Vec3f point(int x, int y) const {
        const Vec3f d = pixel_direction(x, y);
        return {d.x, -1, d.y};
    }
};

// Irradiance at each pixel of the floor, against the picture: its mean, and pixel by pixel within the noise
// that pixels with like values have.
inline void expect_irradiance(FloorScene& s, const std::function<double(const Vec3f&)>& irradiance,
                              double relative, int progressions = 32, int pixel_progressions = 512) {
    double expected = 0, worst = 0;
    std::vector<double> truth;
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++) {
            truth.push_back(irradiance(s.point(x, y)) * Reflectance / 3.141592653589793);
            expected += truth.back() / (Size * Size);
        }
    const auto e = s.estimate(progressions, 12);
    EXPECT_EQ(e.nan_samples, 0u);
    for (const auto& c : e.channel)
        EXPECT_NEAR(c.mean(), expected, relative * expected + 4.5 * c.error());
    const auto pixels = s.render(pixel_progressions, 8);
    for (size_t i = 0; i < pixels.size(); i++)
        worst = std::max(worst, std::abs(double(pixels[i].rgb[1]) - truth[i]) / (truth[i] + 0.1 * expected));
    EXPECT_LT(worst, 0.1);
}

} // namespace kanuka::transport::testing
