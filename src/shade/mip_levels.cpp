#include "shade/mip_levels.h"

#include <OpenImageIO/filter.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "base/tasks.h"
#include "base/vec.h"

namespace kanuka::shade {

namespace {

using Weight = std::function<float(float x, float y)>; // by the distance in texels of the smaller level

// RISpec's names and those of tools, what OpenImageIO calls them, and how wide they are by themselves.
struct Kind {
    std::string_view name;
    const char* theirs; // null: it is ours
    float width;
};
constexpr Kind Kinds[] = {{"box", "box", 1},           {"triangle", "triangle", 2},
                          {"gaussian", "gaussian", 3}, {"catmull-rom", "catmull-rom", 4},
                          {"b-spline", "b-spline", 4}, {"mitchell", "mitchell", 4},
                          {"sinc", "sinc", 4},         {"lanczos", "lanczos3", 6},
                          {"bessel", nullptr, 4},      {"blackman-harris", "blackman-harris", 3},
                          {"disk", "disk", 1}};

const Kind* find(const std::string& name) {
    for (const Kind& kind : Kinds)
        if (kind.name == name)
            return &kind;
    return nullptr;
}

// What sinc is for a square is J1(pi r) / (pi r / 2) for a disc; under a cosine's lobe that ends at the
// width.
float bessel(float x, float y, float width_x, float width_y) {
    const float r = std::hypot(x, y), edge = std::hypot(2 * x / width_x, 2 * y / width_y);
    if (edge >= 1)
        return 0;
    const float f = r < 1e-3f ? 1 : float(std::cyl_bessel_j(1.0, double(Pi * r))) / (0.5f * Pi * r);
    return f * std::cos(0.5f * Pi * edge);
}

// Texels of the larger level that one of the smaller is made of: [from, to), beyond the edges too.
struct Taps {
    int from, to;
};

// The texel that stands for one beyond the edge; -1 = none.
int wrapped(int i, int size, const std::string& wrap) {
    if (i >= 0 && i < size)
        return i;
    if (wrap == "periodic")
        return ((i % size) + size) % size;
    if (wrap == "mirror") {
        const int k = ((i % (2 * size)) + 2 * size) % (2 * size);
        return k < size ? k : 2 * size - 1 - k;
    }
    return wrap == "clamp" ? std::clamp(i, 0, size - 1) : -1;
}

// One axis of a level: where texel `i` of `small` lies among those of `large`, and what its filter reaches.
struct Axis {
    int large, small;
    float width;
    std::string wrap;

    float centre(int i) const { return (float(i) + 0.5f) * float(large) / float(small) - 0.5f; }
    float scale() const { return float(small) / float(large); }
    Taps taps(int i) const {
        const float radius = 0.5f * width / scale(), c = centre(i);
        // The nearest texel is always reached; what a filter of many pictures' width repeats is cut.
        const int reach = std::min(int(radius), 4 * large);
        return {std::max(int(std::ceil(c - radius)), int(std::lround(c)) - reach - 1),
                std::min(int(std::floor(c + radius)), int(std::lround(c)) + reach + 1) + 1};
    }
};

void nearest(const OIIO::ImageBuf& from, const Axis& s, const Axis& t, int x, int y, float* pixel) {
    from.getpixel(std::clamp(int(std::lround(s.centre(x))), 0, s.large - 1),
                  std::clamp(int(std::lround(t.centre(y))), 0, t.large - 1), 0, pixel);
}

// One axis at a time: `along` 0 = rows, 1 = columns.
OIIO::ImageBuf filter_along(const OIIO::ImageBuf& from, const Axis& axis, int along, const Weight& weight) {
    OIIO::ImageSpec spec = from.spec();
    const int channels = spec.nchannels;
    (along == 0 ? spec.width : spec.height) = axis.small;
    (along == 0 ? spec.full_width : spec.full_height) = axis.small;
    OIIO::ImageBuf to(spec);
    const auto* source = static_cast<const float*>(from.localpixels());
    auto* target = static_cast<float*>(to.localpixels());
    const size_t step = along == 0 ? size_t(channels) : size_t(channels) * size_t(from.spec().width);
    struct Tap {
        size_t offset;
        float weight;
    };
    std::vector<std::vector<Tap>> taps(size_t(axis.small));
    for (int i = 0; i < axis.small; i++) {
        const Taps reach = axis.taps(i);
        double sum = 0;
        auto& row = taps[size_t(i)];
        for (int k = reach.from; k < reach.to; k++)
            if (const int texel = wrapped(k, axis.large, axis.wrap); texel >= 0) {
                const float d = (float(k) - axis.centre(i)) * axis.scale();
                row.push_back({size_t(texel) * step, along == 0 ? weight(d, 0) : weight(0, d)});
                sum += double(row.back().weight);
            }
        if (!(sum > 1e-6)) {
            const int texel = std::clamp(int(std::lround(axis.centre(i))), 0, axis.large - 1);
            row = {{size_t(texel) * step, 1.0f}};
            sum = 1;
        }
        for (Tap& tap : row)
            tap.weight = float(double(tap.weight) / sum);
    }
    tasks::parallel_for(size_t(spec.height), [&](size_t y) {
        float* pixel = target + y * size_t(spec.width) * size_t(channels);
        for (int x = 0; x < spec.width; x++, pixel += channels) {
            const float* line = along == 0 ? source + y * size_t(from.spec().width) * size_t(channels)
                                           : source + x * channels;
            std::fill(pixel, pixel + channels, 0.0f);
            for (const Tap& tap : taps[along == 0 ? size_t(x) : y])
                for (int c = 0; c < channels; c++)
                    pixel[c] += tap.weight * line[tap.offset + size_t(c)];
        }
    });
    return to;
}

// A filter that is no product: all texels within its rectangle.
OIIO::ImageBuf filter_area(const OIIO::ImageBuf& from, const Axis& s, const Axis& t, const Weight& weight) {
    OIIO::ImageSpec spec = from.spec();
    const int channels = spec.nchannels;
    spec.width = spec.full_width = s.small;
    spec.height = spec.full_height = t.small;
    OIIO::ImageBuf to(spec);
    const auto* source = static_cast<const float*>(from.localpixels());
    tasks::parallel_for(size_t(spec.height), [&](size_t row) {
        const int y = int(row);
        std::vector<float> pixel(static_cast<size_t>(channels));
        for (int x = 0; x < spec.width; x++) {
            std::fill(pixel.begin(), pixel.end(), 0.0f);
            float sum = 0;
            const Taps across = s.taps(x), down = t.taps(y);
            for (int j = down.from; j < down.to; j++)
                for (int i = across.from; i < across.to; i++) {
                    const int a = wrapped(i, s.large, s.wrap), b = wrapped(j, t.large, t.wrap);
                    if (a < 0 || b < 0)
                        continue;
                    const float w =
                        weight((float(i) - s.centre(x)) * s.scale(), (float(j) - t.centre(y)) * t.scale());
                    const float* texel =
                        source + (size_t(b) * size_t(s.large) + size_t(a)) * size_t(channels);
                    for (size_t c = 0; c < size_t(channels); c++)
                        pixel[c] += w * texel[c];
                    sum += w;
                }
            if (sum > 1e-6f)
                for (float& c : pixel)
                    c /= sum;
            else
                nearest(from, s, t, x, y, pixel.data());
            to.setpixel(x, y, pixel.data(), channels);
        }
    });
    return to;
}

} // namespace

std::string mip_filter_names() {
    std::string all;
    for (const Kind& kind : Kinds)
        all += (all.empty() ? "" : ", ") + std::string(kind.name);
    return all;
}

bool is_mip_filter(const std::string& name) {
    return find(name) != nullptr;
}

std::vector<OIIO::ImageBuf> mip_levels(OIIO::ImageBuf picture, const MipFilter& filter) {
    const Kind& kind = *find(filter.name);
    constexpr float Widest = 64; // of a filter, in texels
    const auto width = [&](float asked) { return asked > 0 ? std::min(asked, Widest) : kind.width; };
    const float s_width = width(filter.s_width), t_width = width(filter.t_width);
    const std::unique_ptr<OIIO::Filter2D, decltype(&OIIO::Filter2D::destroy)> theirs(
        kind.theirs ? OIIO::Filter2D::create(kind.theirs, s_width, t_width) : nullptr,
        &OIIO::Filter2D::destroy);
    const Weight weight = [&](float x, float y) {
        return theirs ? (*theirs)(x, y) : bessel(x, y, s_width, t_width);
    };
    std::vector<OIIO::ImageBuf> levels;
    levels.push_back(std::move(picture));
    for (;;) {
        const OIIO::ImageBuf& large = levels.back();
        const int w = large.spec().width, h = large.spec().height;
        if (w == 1 && h == 1)
            return levels;
        const Axis s{w, std::max(1, w / 2), s_width, filter.s_wrap};
        const Axis t{h, std::max(1, h / 2), t_width, filter.t_wrap};
        if (theirs && theirs->separable())
            levels.push_back(filter_along(filter_along(large, s, 0, weight), t, 1, weight));
        else
            levels.push_back(filter_area(large, s, t, weight));
    }
}

} // namespace kanuka::shade
