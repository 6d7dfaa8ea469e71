#include <algorithm>
#include <cmath>

#include "film/film.h"
#include "film/flip.h"

namespace kanuka::film {

namespace {

std::string size_of(const Picture& p) {
    return std::to_string(p.width) + " x " + std::to_string(p.height);
}

std::array<const std::vector<float>*, 3> find_rgb(const Picture& picture, const char* which) {
    static const char* const names[] = {"R", "G", "B"};
    std::array<const std::vector<float>*, 3> rgb;
    for (int c = 0; c < 3; c++) {
        const Picture::Channel* channel = picture.find(names[c]);
        if (!channel || channel->data.size() != size_t(picture.width) * picture.height)
            throw Error(std::string("the ") + which + " picture has no channel \"" + names[c] +
                        "\"; only colour pictures are compared");
        rgb[c] = &channel->data;
    }
    return rgb;
}

} // namespace

Comparison compare(const Picture& a, const Picture& b, float gain) {
    if (a.width != b.width || a.height != b.height)
        throw Error("pictures of different sizes cannot be compared: " + size_of(a) + " and " + size_of(b));
    if (a.width <= 0 || a.height <= 0)
        throw Error("pictures without pixels cannot be compared");
    const auto rgb_a = find_rgb(a, "first"), rgb_b = find_rgb(b, "second");
    const size_t pixels = size_t(a.width) * a.height;

    // 1. Means over pixels that are finite in both.
    Comparison result;
    Planes seen_a(a.width, a.height), seen_b(a.width, a.height);
    size_t counted = 0;
    for (size_t i = 0; i < pixels; i++) {
        bool finite_a = true, finite_b = true;
        for (int c = 0; c < 3; c++) {
            finite_a &= std::isfinite((*rgb_a[c])[i]);
            finite_b &= std::isfinite((*rgb_b[c])[i]);
        }
        result.nonfinite_a += !finite_a;
        result.nonfinite_b += !finite_b;
        for (int c = 0; c < 3; c++) {
            const double va = (*rgb_a[c])[i], vb = (*rgb_b[c])[i];
            seen_a.c[c][i] = finite_a ? float(va * gain) : 0;
            seen_b.c[c][i] = finite_b ? float(vb * gain) : 0;
            if (!finite_a || !finite_b)
                continue;
            counted++;
            const double error = std::abs(va - vb);
            result.relative_mse += error * error / (vb * vb + 0.01);
            result.mean_a += va;
            result.mean_b += vb;
            if (error > result.max_error) {
                result.max_error = error;
                result.max_x = int(i % size_t(a.width));
                result.max_y = int(i / size_t(a.width));
            }
        }
    }
    if (counted > 0) {
        result.relative_mse /= double(counted);
        result.mean_a /= double(counted);
        result.mean_b /= double(counted);
    }
    result.mean_ratio = result.mean_a == result.mean_b ? 1 : result.mean_a / result.mean_b;

    // 2. FLIP and its picture.
    std::vector<float> values = flip(seen_b, seen_a);
    Picture& map = result.difference;
    map.width = a.width;
    map.height = a.height;
    for (const char* name : {"R", "G", "B"})
        map.channels.push_back({name, true, std::vector<float>(pixels)});
    for (size_t i = 0; i < pixels; i++) {
        result.flip += values[i];
        const Rgb color = heat(values[i]);
        for (int c = 0; c < 3; c++)
            map.channels[c].data[i] = color[c];
    }
    result.flip /= double(pixels);
    map.channels.push_back({"flip", false, std::move(values)});
    return result;
}

} // namespace kanuka::film
