#include <cmath>
#include <memory>

#include <spng.h>

#include "base/tasks.h"
#include "color/color.h"
#include "film/atomic_file.h"
#include "film/film.h"

namespace kanuka::film {

namespace {

// NaN and negative values are 0, infinity is 1.
float clamp01(float v) {
    return v > 0 ? std::min(v, 1.0f) : 0.0f;
}

uint8_t to_byte(float v) {
    return uint8_t(clamp01(v) * 255 + 0.5f);
}

struct Encoder {
    float gain, inverse_gamma;
    std::optional<color::Display> display;
    uint8_t operator()(float linear) const {
        const float exposed = linear * gain;
        if (!(exposed > 0))
            return 0;
        const float corrected = std::pow(std::min(exposed, 1.0f), inverse_gamma);
        return to_byte(display ? color::display_encode(*display, corrected) : corrected);
    }
};

int write_to_file(spng_ctx*, void* file, void* data, size_t size) {
    try {
        static_cast<AtomicFile*>(file)->write(data, size);
        return 0;
    } catch (const Error&) { // C frames lie between: the cause is found again by the caller
        return SPNG_IO_ERROR;
    }
}

} // namespace

PngEncoding png_encoding(std::string_view display, float exposure_gamma) {
    if (display == LinearDisplay)
        return {exposure_gamma, std::nullopt};
    const color::Display known = color::find_display(display).value_or(color::Display::Srgb);
    if (known == color::Display::Srgb && exposure_gamma != 1)
        return {exposure_gamma, std::nullopt};
    return {1, known};
}

void write_png(const std::string& path, const Picture& picture, float gain, float gamma,
               std::optional<color::Display> display) {
    const auto fail = [&](const std::string& what) { throw Error(Location{path}, what, ExitCode::Output); };
    if (!(gamma > 0) || !std::isfinite(gamma) || !std::isfinite(gain))
        fail("exposure needs a finite gain and a gamma above 0");
    if (picture.width <= 0 || picture.height <= 0)
        fail("the picture has no pixels");

    // 1. Which channels.
    const Picture::Channel* color[3] = {picture.find("R"), picture.find("G"), picture.find("B")};
    const Picture::Channel* alpha = picture.find("A");
    const bool rgb = color[0] && color[1] && color[2];
    if (!rgb) {
        if (picture.channels.size() != 1)
            fail("a PNG needs the channels R, G and B, or a single one; write an EXR");
        color[0] = &picture.channels[0];
        alpha = nullptr;
    }
    const size_t pixels = size_t(picture.width) * picture.height;
    for (const Picture::Channel* channel : {color[0], color[1], color[2], alpha})
        if (channel && channel->data.size() != pixels)
            fail("channel \"" + channel->name + "\" does not have one value a pixel");

    // 2. Pixels: linear premultiplied to sRGB straight.
    const int colors = rgb ? 3 : 1, components = colors + (alpha ? 1 : 0);
    const Encoder encode{gain, 1 / gamma, display};
    const bool converts = rgb && picture.space != color::Space::Rec709;
    const color::Matrix3 matrix = color::convert(picture.space, color::Space::Rec709);
    std::vector<uint8_t> bytes(pixels * components);
    const auto encode_pixel = [&](size_t i) {
        const float a = alpha ? clamp01(alpha->data[i]) : 1.0f;
        if (converts) {
            const Rgb linear =
                color::transform(matrix, {color[0]->data[i], color[1]->data[i], color[2]->data[i]});
            for (int c = 0; c < 3; c++)
                bytes[i * components + size_t(c)] = a > 0 ? encode(linear[c] / a) : 0;
        } else
            for (int c = 0; c < colors; c++)
                bytes[i * components + c] = a > 0 ? encode(color[c]->data[i] / a) : 0;
        if (alpha)
            bytes[i * components + colors] = to_byte(a);
    };
    tasks::parallel_chunks(pixels, 1 << 14, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            encode_pixel(i);
    });

    // 3. File.
    AtomicFile file(path);
    const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> png(spng_ctx_new(SPNG_CTX_ENCODER),
                                                                  spng_ctx_free);
    if (!png)
        fail("cannot be written: out of memory");
    spng_ihdr header{};
    header.width = uint32_t(picture.width);
    header.height = uint32_t(picture.height);
    header.bit_depth = 8;
    header.color_type = alpha ? SPNG_COLOR_TYPE_TRUECOLOR_ALPHA
                        : rgb ? SPNG_COLOR_TYPE_TRUECOLOR
                              : SPNG_COLOR_TYPE_GRAYSCALE;
    constexpr uint8_t Perceptual = 0;
    int status = spng_set_png_stream(png.get(), write_to_file, &file);
    if (!status)
        status = spng_set_ihdr(png.get(), &header);
    if (!status && display == color::Display::Srgb)
        status = spng_set_srgb(png.get(), Perceptual);
    if (!status && display == color::Display::Rec709) {
        spng_chrm chromaticities{0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06};
        status = spng_set_gama(png.get(), 1 / 2.4);
        if (!status)
            status = spng_set_chrm(png.get(), &chromaticities);
    }
    if (!status)
        status = spng_encode_image(png.get(), bytes.data(), bytes.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    if (status)
        fail(std::string("cannot be written: ") + spng_strerror(status));
    file.commit();
}

} // namespace kanuka::film
