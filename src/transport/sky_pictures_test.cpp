// Pictures of skies against numeric integration.
#include "transport/test_lights.h"

namespace kanuka::transport {
namespace {

using namespace testing;

LatLong picture(int width, int height, const std::function<Rgb(int, int)>& f) {
    LatLong m{width, height, {}};
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++)
            for (int c = 0; c < 3; c++)
                m.rgb.push_back(f(i, j)[c]);
    return m;
}

scene::Light sky_picture(const Transform& t, const Rgb& amount = Rgb(1)) {
    auto l = light(Kind::Environment, amount, t);
    l.texture = "a picture";
    return l;
}

// Bilinear between texel centres, wrapping in azimuth.
Rgb look_up(const LatLong& m, const Vec3f& d) {
    double turn = std::atan2(double(d.y), double(d.x)) / 6.283185307179586;
    turn = turn < 0 ? turn + 1 : turn;
    const double x = turn * m.width - 0.5,
                 y = std::acos(std::clamp(double(d.z), -1.0, 1.0)) / 3.141592653589793 * m.height - 0.5;
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const float fx = float(x - i), fy = float(y - j);
    const auto texel = [&](int a, int b) {
        const size_t at =
            3 * (size_t(std::clamp(b, 0, m.height - 1)) * size_t(m.width) + size_t((a + m.width) % m.width));
        return Rgb(m.rgb[at], m.rgb[at + 1], m.rgb[at + 2]);
    };
    return lerp(fy, lerp(fx, texel(i, j), texel(i + 1, j)), lerp(fx, texel(i, j + 1), texel(i + 1, j + 1)));
}

Rgb floor_irradiance(const LatLong& m, const Transform& environment_from_world) {
    double sum[3] = {0, 0, 0};
    constexpr int N = 600;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < 2 * N; j++) {
            const double y = (i + 0.5) / N, phi = 3.141592653589793 * (j + 0.5) / N, r = std::sqrt(1 - y * y);
            const Vec3f d(float(r * std::cos(phi)), float(y), float(r * std::sin(phi)));
            const Rgb l = look_up(m, environment_from_world.vector(d));
            for (int c = 0; c < 3; c++)
                sum[c] += double(l[c]) * y;
        }
    const double cell = 3.141592653589793 / (double(N) * N);
    return {float(sum[0] * cell), float(sum[1] * cell), float(sum[2] * cell)};
}

} // namespace

TEST(SkyPictures, AConstantOneIsAConstantSky) {
    FloorScene s;
    s.inputs.map = picture(16, 8, [](int, int) { return Rgb(1.5f); });
    s.inputs.lights.push_back(sky_picture(Transform::rotate(40, 1, 1, 0)));
    s.finish();
    expect_irradiance(s, [](const Vec3f&) { return 1.5 * 3.141592653589793; }, 0.003);
}

TEST(SkyPictures, IrradianceOfColoursAndSuns) {
    const Transform turned = Transform::rotate(50, 1, 2, 3);
    const auto gradient = picture(64, 32, [](int i, int j) {
        return Rgb(1 + 0.5f * std::sin(0.2f * float(i)), 1 + 0.02f * float(j), 0.5f + 0.01f * float(i));
    });
    auto sun = gradient;
    for (int j = 0; j < 32; j++)
        for (int i = 0; i < 64; i++) {
            const Vec3f d(std::sin(Pi * (float(j) + 0.5f) / 32) * std::cos(2 * Pi * (float(i) + 0.5f) / 64),
                          std::sin(Pi * (float(j) + 0.5f) / 32) * std::sin(2 * Pi * (float(i) + 0.5f) / 64),
                          std::cos(Pi * (float(j) + 0.5f) / 32));
            if (turned.vector(d).y > 0.96f) // about overhead, some texels
                for (int c = 0; c < 3; c++)
                    sun.rgb[size_t(3 * (j * 64 + i) + c)] = c == 2 ? 1000 : 2000;
        }
    for (const LatLong* m : {&gradient, static_cast<const LatLong*>(&sun)}) {
        FloorScene s;
        s.inputs.map = *m;
        s.inputs.lights.push_back(sky_picture(turned));
        s.finish();
        const Rgb expected = floor_irradiance(*m, turned.inverse()) * (Reflectance / Pi);
        const auto e = s.estimate(64, 12);
        for (int c = 0; c < 3; c++)
            EXPECT_NEAR(e.channel[c].mean(), expected[c], 0.006 * expected[c] + 4.5 * e.channel[c].error())
                << c;
    }
}

// What the camera sees of it is the picture, in place.
TEST(SkyPictures, AreSeenWhereTheyAre) {
    const Transform turned = Transform::rotate(70, 3, 1, 2);
    TestScene s;
    s.inputs.map = picture(
        32, 16, [](int i, int j) { return Rgb(1 + 0.1f * float(i % 16), 0.5f + 0.1f * float(j), 1); });
    s.inputs.lights.push_back(sky_picture(turned, Rgb(0.5f)));
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
    s.finish();
    const auto pixels = s.render(1024, 8);
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++) {
            const Vec3f d = s.pixel_direction(x, y);
            const Rgb expected = look_up(s.inputs.map, turned.inverse().vector(normalize(d))) * 0.5f;
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(pixels[size_t(y * Size + x)].rgb[c], expected[c], 0.05f * expected[c])
                    << x << " " << y;
        }
}

TEST(SkyPictures, NaNTexelsAreBlackAndNaNDirectionsHarmless) {
    FloorScene s;
    s.inputs.map = picture(8, 4, [](int i, int) {
        return i == 3   ? Rgb(std::numeric_limits<float>::quiet_NaN())
               : i == 5 ? Rgb(std::numeric_limits<float>::infinity())
                        : Rgb(1);
    });
    s.inputs.lights.push_back(sky_picture(Transform()));
    s.finish();
    for (const auto& c : s.estimate(16, 1).channel) {
        EXPECT_TRUE(std::isfinite(c.mean()));
        EXPECT_GT(c.mean(), 0.1);
    }
    EXPECT_EQ(s.nan_samples, 0u);
}

} // namespace kanuka::transport
