// Environment pictures, whole, for light sampling.
#include "shade/shade.h"

#include <cmath>

#include "shade/linear_input.h"

namespace kanuka::shade {

namespace {

// Averages `factor` by `factor` pixels; what does not divide goes to the last row and column.
LatLong shrink(const LatLong& from, int factor) {
    LatLong to;
    to.width = std::max(1, from.width / factor);
    to.height = std::max(1, from.height / factor);
    to.rgb.assign(size_t(to.width) * size_t(to.height) * 3, 0.0f);
    for (int y = 0; y < to.height; y++)
        for (int x = 0; x < to.width; x++) {
            const int x1 = x == to.width - 1 ? from.width : (x + 1) * factor;
            const int y1 = y == to.height - 1 ? from.height : (y + 1) * factor;
            double sum[3] = {};
            for (int j = y * factor; j < y1; j++)
                for (int i = x * factor; i < x1; i++)
                    for (int c = 0; c < 3; c++)
                        sum[c] +=
                            double(from.rgb[(size_t(j) * size_t(from.width) + size_t(i)) * 3 + size_t(c)]);
            const double pixels = double(x1 - x * factor) * double(y1 - y * factor);
            for (int c = 0; c < 3; c++)
                to.rgb[(size_t(y) * size_t(to.width) + size_t(x)) * 3 + size_t(c)] = float(sum[c] / pixels);
        }
    return to;
}

} // namespace

std::optional<LatLong> read_latlong(const std::string& file, color::Space space, int max_width,
                                    const Location& asker, Journal& journal) {
    const auto fail = [&](const std::string& why) {
        journal.error(asker, "a light's picture \"" + file + "\" cannot be read (" + why +
                                 "); write it anew, as an EXR or HDR file");
        return std::nullopt;
    };
    LinearInput input;
    OIIO::ImageSpec spec;
    if (!input.open(file, spec))
        return fail(input.geterror());
    constexpr int64_t MaxPixels = int64_t(1) << 28; // a hostile header must not take all memory
    if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 ||
        spec.image_pixels() > uint64_t(MaxPixels))
        return fail("it is " + std::to_string(spec.width) + " by " + std::to_string(spec.height) + " pixels");
    const int channels = std::min(3, spec.nchannels);
    std::vector<float> pixels(size_t(spec.width) * size_t(spec.height) * size_t(channels));
    if (!input.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, pixels.data()))
        return fail(input.geterror());

    const bool converts = space != color::Space::Rec709 && spec.get_int_attribute("kanuka:rec709", 0) != 0;
    const color::Matrix3 from_rec709 = color::convert(color::Space::Rec709, space);
    LatLong picture;
    picture.width = spec.width;
    picture.height = spec.height;
    picture.rgb.resize(size_t(spec.width) * size_t(spec.height) * 3);
    for (size_t i = 0; i < picture.rgb.size() / 3; i++) {
        Rgb pixel;
        for (int c = 0; c < 3; c++)
            pixel[c] = pixels[i * size_t(channels) + size_t(std::min(c, channels - 1))];
        if (converts)
            pixel = color::transform(from_rec709, pixel);
        // Light is never negative, and one infinite pixel would outshine the rest.
        for (int c = 0; c < 3; c++)
            picture.rgb[i * 3 + size_t(c)] = std::isfinite(pixel[c]) ? std::max(0.0f, pixel[c]) : 0.0f;
    }
    if (max_width > 0 && picture.width > max_width)
        picture = shrink(picture, (picture.width + max_width - 1) / max_width);
    return picture;
}

} // namespace kanuka::shade
