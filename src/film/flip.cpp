// Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: FLIP: A Difference Evaluator for
// Alternating Images, HPG 2020. Section numbers below are the paper's. The paper filters with two-dimensional
// kernels; all of them are sums of separable ones, and are run as such.
#include "film/flip.h"

#include <algorithm>
#include <cmath>

#include "base/tasks.h"
#include "color/color.h"

namespace kanuka::film {

namespace {

using Plane = std::vector<float>;
using Taps = std::vector<float>; // 2 radius + 1

struct White {
    Vec3f xyz;
    White() {
        for (int i = 0; i < 3; i++)
            xyz[i] = color::xyz_from_rgb[i][0] + color::xyz_from_rgb[i][1] + color::xyz_from_rgb[i][2];
    }
};

Vec3f rgb_to_xyz(const Vec3f& c) {
    Vec3f xyz;
    for (int i = 0; i < 3; i++)
        xyz[i] = fma(color::xyz_from_rgb[i][0], c.x,
                     fma(color::xyz_from_rgb[i][1], c.y, color::xyz_from_rgb[i][2] * c.z));
    return xyz;
}

// YyCxCz, the linearised CIELAB of section 4.1.
Vec3f to_opponent(const Vec3f& rgb, const White& white) {
    const Vec3f xyz = rgb_to_xyz(rgb);
    const float x = xyz.x / white.xyz.x, y = xyz.y / white.xyz.y, z = xyz.z / white.xyz.z;
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

Vec3f from_opponent(const Vec3f& o, const White& white) {
    const float y = (o.x + 16) / 116, x = y + o.y / 500, z = y - o.z / 200;
    return color::xyz_to_rgb({x * white.xyz.x, y * white.xyz.y, z * white.xyz.z});
}

// CIELAB with the Hunt effect: colour differences count less in the dark, section 4.1.
Vec3f to_hunt_lab(const Vec3f& rgb, const White& white) {
    const auto f = [](float t) {
        constexpr float Delta = 6.0f / 29;
        return t > Delta * Delta * Delta ? std::cbrt(t) : t / (3 * Delta * Delta) + 4.0f / 29;
    };
    const Vec3f xyz = rgb_to_xyz(rgb);
    const float x = f(xyz.x / white.xyz.x), y = f(xyz.y / white.xyz.y), z = f(xyz.z / white.xyz.z);
    const float lightness = 116 * y - 16, hunt = 0.01f * lightness;
    return {lightness, hunt * 500 * (x - y), hunt * 200 * (y - z)};
}

float hyab(const Vec3f& a, const Vec3f& b) {
    return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

// One pass along x or y; pixels beyond the border repeat it.
Plane convolve(const Plane& in, int width, int height, const Taps& taps, bool along_x) {
    const int radius = int(taps.size()) / 2;
    Plane out(in.size());
    tasks::parallel_for(size_t(height), [&](size_t row) {
        const int y = int(row);
        float* to = &out[size_t(y) * width];
        if (along_x) {
            const float* from = &in[size_t(y) * width];
            std::vector<float> padded(size_t(width + 2 * radius));
            for (int x = -radius; x < width + radius; x++)
                padded[x + radius] = from[std::clamp(x, 0, width - 1)];
            for (int k = 0; k <= 2 * radius; k++)
                for (int x = 0; x < width; x++)
                    to[x] = fma(taps[k], padded[x + k], to[x]);
        } else {
            for (int k = -radius; k <= radius; k++) {
                const float* from = &in[size_t(std::clamp(y + k, 0, height - 1)) * width];
                for (int x = 0; x < width; x++)
                    to[x] = fma(taps[k + radius], from[x], to[x]);
            }
        }
    });
    return out;
}

Plane convolve(const Plane& in, int width, int height, const Taps& x, const Taps& y) {
    return convolve(convolve(in, width, height, x, true), width, height, y, false);
}

// Contrast sensitivity, section 4.1 and table 1: a1 sqrt(pi / b1) exp(-pi^2 d^2 / b1) + the same with a2, b2;
// d in degrees.
struct Sensitivity {
    float a1, b1, a2, b2;
};
constexpr Sensitivity sensitivities[3] = {
    {1, 0.0047f, 0, 1e-5f}, {1, 0.0053f, 0, 1e-5f}, {34.1f, 0.04f, 13.5f, 0.025f}};

Taps gaussian_taps(int radius, double exponent) { // exp(-exponent k^2)
    Taps taps;
    for (int k = -radius; k <= radius; k++)
        taps.push_back(float(std::exp(-exponent * k * k)));
    return taps;
}

double sum(const Taps& taps) {
    double s = 0;
    for (const float t : taps)
        s += t;
    return s;
}

Planes blur_as_seen(const Planes& in, float pixels_per_degree) {
    const int radius = int(std::ceil(3 * std::sqrt(0.04 / (2 * M_PI * M_PI)) * pixels_per_degree));
    Planes out(in.width, in.height);
    for (int c = 0; c < 3; c++) {
        const Sensitivity& s = sensitivities[c];
        const float a[2] = {s.a1, s.a2}, b[2] = {s.b1, s.b2};
        Taps taps[2];
        double weight[2] = {}, total = 0;
        for (int g = 0; g < 2; g++) {
            taps[g] =
                gaussian_taps(radius, M_PI * M_PI / (double(b[g]) * pixels_per_degree * pixels_per_degree));
            const double mass = sum(taps[g]);
            weight[g] = a[g] * std::sqrt(M_PI / b[g]) * mass * mass; // of the two-dimensional kernel
            total += weight[g];
            for (float& t : taps[g])
                t = float(t / mass);
        }
        for (int g = 0; g < 2; g++) {
            if (weight[g] == 0)
                continue;
            const Plane blurred = convolve(in.c[c], in.width, in.height, taps[g], taps[g]);
            const float w = float(weight[g] / total);
            for (size_t i = 0; i < blurred.size(); i++)
                out.c[c][i] = fma(w, blurred[i], out.c[c][i]);
        }
    }
    return out;
}

// Edges and points, section 4.2: lengths of the gradients of first and second derivatives of a Gaussian.
struct Features {
    Plane edge, point;
};

Features find_features(const Plane& luminance, int width, int height, float pixels_per_degree) {
    constexpr double FeatureWidth = 0.082; // degrees
    const double sigma = 0.5 * FeatureWidth * pixels_per_degree;
    const int radius = int(std::ceil(3 * sigma));
    Taps flat = gaussian_taps(radius, 0.5 / (sigma * sigma)), edge, point;
    for (int k = -radius; k <= radius; k++) {
        edge.push_back(float(-k) * flat[k + radius]);
        point.push_back(float(k * k / (sigma * sigma) - 1) * flat[k + radius]);
    }
    // Positive weights of the two-dimensional kernel sum to 1, negative ones to -1.
    const auto normalise = [](Taps& taps) {
        double positive = 0, negative = 0;
        for (const float t : taps)
            (t > 0 ? positive : negative) += t;
        for (float& t : taps)
            t = float(t > 0 ? t / positive : t / -negative);
    };
    normalise(edge);
    normalise(point);
    const double mass = sum(flat);
    for (float& t : flat)
        t = float(t / mass);

    const auto gradient = [&](const Taps& taps) {
        Plane x = convolve(luminance, width, height, taps, flat);
        const Plane y = convolve(luminance, width, height, flat, taps);
        for (size_t i = 0; i < x.size(); i++)
            x[i] = std::sqrt(fma(x[i], x[i], y[i] * y[i]));
        return x;
    };
    return {gradient(edge), gradient(point)};
}

Planes to_opponent(const Planes& rgb, const White& white) {
    Planes out(rgb.width, rgb.height);
    for (size_t i = 0; i < rgb.c[0].size(); i++) {
        const Vec3f o = to_opponent({std::clamp(rgb.c[0][i], 0.0f, 1.0f), std::clamp(rgb.c[1][i], 0.0f, 1.0f),
                                     std::clamp(rgb.c[2][i], 0.0f, 1.0f)},
                                    white);
        for (int c = 0; c < 3; c++)
            out.c[c][i] = o[c];
    }
    return out;
}

Vec3f seen(const Planes& blurred, size_t i, const White& white) {
    const Vec3f rgb = from_opponent({blurred.c[0][i], blurred.c[1][i], blurred.c[2][i]}, white);
    return to_hunt_lab(
        {std::clamp(rgb.x, 0.0f, 1.0f), std::clamp(rgb.y, 0.0f, 1.0f), std::clamp(rgb.z, 0.0f, 1.0f)}, white);
}

} // namespace

Planes::Planes(int width, int height) : width(width), height(height) {
    for (auto& plane : c)
        plane.assign(size_t(width) * height, 0.0f);
}

std::vector<float> flip(const Planes& reference, const Planes& test, float pixels_per_degree) {
    constexpr float Qc = 0.7f, Pc = 0.4f, Pt = 0.95f, Qf = 0.5f;
    const White white;
    const int width = reference.width, height = reference.height;

    // 1. Opponent space; colour as seen; features of lightness.
    const Planes opponent[2] = {to_opponent(reference, white), to_opponent(test, white)};
    const Planes blurred[2] = {blur_as_seen(opponent[0], pixels_per_degree),
                               blur_as_seen(opponent[1], pixels_per_degree)};
    Features features[2];
    for (int i = 0; i < 2; i++) {
        Plane luminance = opponent[i].c[0];
        for (float& v : luminance)
            v = (v + 16) / 116;
        features[i] = find_features(luminance, width, height, pixels_per_degree);
    }

    // 2. The largest difference there can be: green against blue.
    const float largest = std::pow(hyab(to_hunt_lab({0, 1, 0}, white), to_hunt_lab({0, 0, 1}, white)), Qc);

    std::vector<float> result(size_t(width) * height);
    tasks::parallel_chunks(result.size(), 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            // 3. Colour: small differences get most of the range, section 4.1.
            const float d = std::pow(hyab(seen(blurred[0], i, white), seen(blurred[1], i, white)), Qc);
            const float knee = Pc * largest;
            const float color = d < knee ? Pt / knee * d : Pt + (d - knee) / (largest - knee) * (1 - Pt);
            // 4. Features make it worse, section 4.3.
            const float feature = std::max(std::abs(features[0].edge[i] - features[1].edge[i]),
                                           std::abs(features[0].point[i] - features[1].point[i]));
            const float amplified = std::pow(float(M_SQRT1_2) * feature, Qf);
            result[i] = std::clamp(std::pow(color, 1 - std::min(amplified, 1.0f)), 0.0f, 1.0f);
        }
    });
    return result;
}

Rgb heat(float value) {
    // A path through CIELAB: lightness rises evenly, hue turns from violet over red to yellow, chroma fades
    // at the ends.
    const float t = std::clamp(value, 0.0f, 1.0f);
    const float lightness = 97 * t, chroma = 75 * std::sin(float(M_PI) * std::pow(t, 0.8f));
    const float hue = (-60 + 155 * t * t) * float(M_PI) / 180;
    const float fy = (lightness + 16) / 116, fx = fy + chroma * std::cos(hue) / 500,
                fz = fy - chroma * std::sin(hue) / 200;
    const auto inverse = [](float f) {
        constexpr float Delta = 6.0f / 29;
        return f > Delta ? f * f * f : 3 * Delta * Delta * (f - 4.0f / 29);
    };
    const White white;
    const Rgb rgb =
        color::xyz_to_rgb({inverse(fx) * white.xyz.x, inverse(fy) * white.xyz.y, inverse(fz) * white.xyz.z});
    return {std::clamp(rgb.x, 0.0f, 1.0f), std::clamp(rgb.y, 0.0f, 1.0f), std::clamp(rgb.z, 0.0f, 1.0f)};
}

} // namespace kanuka::film
