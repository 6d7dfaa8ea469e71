#include "shade/linear_input.h"

#include <OpenImageIO/half.h>
#include <array>
#include <filesystem>

#include "color/color.h"

namespace kanuka::shade {

namespace {

const std::array<half, 256>& table8() {
    static const std::array<half, 256> table = [] {
        std::array<half, 256> t;
        for (int i = 0; i < 256; i++)
            t[size_t(i)] = half(color::srgb_decode(float(i) / 255));
        return t;
    }();
    return table;
}

// Whether its numbers can be encoded light: floats are light as they are.
bool has_codes(const OIIO::ImageSpec& spec) {
    return spec.format == OIIO::TypeDesc::UINT8 || spec.format == OIIO::TypeDesc::UINT16;
}

std::string suffix(PictureSpace space) {
    switch (space) {
    case PictureSpace::Auto:
        return "";
    case PictureSpace::Raw:
        return " (raw)";
    case PictureSpace::Srgb:
        return " (srgb)";
    }
    return "";
}

} // namespace

bool is_srgb(const OIIO::ImageSpec& spec) {
    if (!has_codes(spec))
        return false;
    const OIIO::string_view space = spec.get_string_attribute("oiio:ColorSpace");
    return spec.nchannels >= 3 && OIIO::Strutil::iequals(space, "sRGB");
}

bool LinearInput::pass(bool success) {
    if (!success)
        errorfmt("{}", m_file->geterror());
    return success;
}

// Readers allocate what a header claims before they find that the file is too short for it. No compression
// that pictures come in goes much beyond a thousandth.
bool LinearInput::fits(const std::string& name) {
    constexpr int LargestSide = 1 << 20, MostChannels = 1024, LargestTile = 8192;
    constexpr int Untiled = 64; // Textures: autotile
    constexpr uint64_t Always = uint64_t(128) << 20, MostCompressed = 4096;
    const OIIO::ImageSpec& s = m_file->spec();
    const auto size = std::to_string(s.width) + " by " + std::to_string(s.height) + " pixels of " +
                      std::to_string(s.nchannels) + " channels";
    if (s.width < 1 || s.height < 1 || s.depth > 1 || s.nchannels < 1 || s.width > LargestSide ||
        s.height > LargestSide || s.nchannels > MostChannels) {
        errorfmt("it claims {}", size);
        return false;
    }
    if (s.tile_width < 0 || s.tile_height < 0 || s.tile_width > LargestTile || s.tile_height > LargestTile) {
        errorfmt("its tiles claim {} by {} pixels", s.tile_width, s.tile_height);
        return false;
    }
    // A texture cache covers the whole display window, level by level, and counts its tiles in an int.
    const int most_off = 2 * LargestSide;
    for (const int x : {s.full_width, s.full_height, s.full_x, s.full_y, s.x, s.y})
        if (x < -most_off || x > most_off) {
            errorfmt("it claims {} at {} {} in a picture of {} by {} at {} {}", size, s.x, s.y, s.full_width,
                     s.full_height, s.full_x, s.full_y);
            return false;
        }
    const auto across = [](int a, int b, int tile) {
        return (uint64_t(std::max(a, b)) + uint64_t(tile) - 1) / uint64_t(tile);
    };
    constexpr uint64_t MostTiles = uint64_t(1) << 28;
    const int tile_width = s.tile_width > 0 ? s.tile_width : Untiled,
              tile_height = s.tile_height > 0 ? s.tile_height : Untiled;
    if (across(s.width, s.full_width, tile_width) * across(s.height, s.full_height, tile_height) >
        MostTiles) {
        errorfmt("it claims {} in tiles of {} by {}", size, tile_width, tile_height);
        return false;
    }
    std::error_code none;
    const uint64_t file = std::filesystem::file_size(name, none);
    const uint64_t bytes = std::max(s.image_bytes(true), s.tile_bytes(true));
    if (!none && bytes > Always && bytes / MostCompressed > file) {
        errorfmt("it claims {}, and the file has {} bytes", size, file);
        return false;
    }
    return true;
}

void LinearInput::take_spec() {
    m_spec = m_file->spec();
    m_decodes =
        m_space == PictureSpace::Auto ? is_srgb(m_spec) : m_space == PictureSpace::Srgb && has_codes(m_spec);
    if (m_decodes) {
        m_spec.set_format(OIIO::TypeDesc::HALF);
        m_spec.channelformats.clear();
        m_spec.attribute("oiio:ColorSpace", "Linear");
        m_spec.attribute("kanuka:rec709", 1); // so are its primaries
        m_spec.erase_attribute("oiio:BitsPerSample");
    }
}

bool LinearInput::open(const std::string& name, OIIO::ImageSpec& spec) {
    return open(name, spec, {});
}

std::string LinearInput::name_of(const std::string& path, PictureSpace space) {
    return path + suffix(space);
}

bool LinearInput::open(const std::string& as_named, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) {
    const std::string name = as_named.substr(0, as_named.size() - suffix(m_space).size());
    m_file = OIIO::ImageInput::open(name, &config);
    if (!m_file) {
        errorfmt("{}", OIIO::geterror());
        return false;
    }
    m_name = name;
    if (!fits(m_name)) {
        m_file.reset();
        return false;
    }
    take_spec();
    spec = m_spec;
    return true;
}

bool LinearInput::close() {
    const bool closed = !m_file || m_file->close();
    m_file.reset();
    return closed;
}

// The file's reader and the buffer are shared by the threads of a texture cache: who seeks while another
// reads would have it read of another level.
bool LinearInput::seek_subimage(int subimage, int miplevel) {
    const lock_guard lock(*this);
    if (!m_file)
        return false;
    if (subimage == current_subimage() && miplevel == current_miplevel())
        return true;
    if (!m_file->seek_subimage(subimage, miplevel) || !fits(m_name))
        return false;
    take_spec();
    return true;
}

void LinearInput::decode(const unsigned char* from, size_t pixels, void* to) const {
    const OIIO::ImageSpec& file = m_file->spec();
    const int channels = file.nchannels;
    half* out = static_cast<half*>(to);
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++, out++) {
            const bool color = c < 3 && c != file.alpha_channel;
            if (file.format == OIIO::TypeDesc::UINT8) {
                const unsigned char value = from[i * size_t(channels) + size_t(c)];
                *out = color ? table8()[value] : half(float(value) / 255);
            } else {
                const float value =
                    float(reinterpret_cast<const uint16_t*>(from)[i * size_t(channels) + size_t(c)]) / 65535;
                *out = half(color ? color::srgb_decode(value) : value);
            }
        }
}

bool LinearInput::read_native_scanline(int subimage, int miplevel, int y, int z, void* data) {
    const lock_guard lock(*this);
    if (!seek_subimage(subimage, miplevel))
        return false;
    if (!m_decodes)
        return pass(m_file->read_native_scanline(subimage, miplevel, y, z, data));
    m_buffer.resize(m_file->spec().scanline_bytes(true));
    if (!pass(m_file->read_native_scanline(subimage, miplevel, y, z, m_buffer.data())))
        return false;
    decode(m_buffer.data(), size_t(m_spec.width), data);
    return true;
}

bool LinearInput::read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) {
    const lock_guard lock(*this);
    if (!seek_subimage(subimage, miplevel))
        return false;
    if (!m_decodes)
        return pass(m_file->read_native_tile(subimage, miplevel, x, y, z, data));
    m_buffer.resize(m_file->spec().tile_bytes(true));
    if (!pass(m_file->read_native_tile(subimage, miplevel, x, y, z, m_buffer.data())))
        return false;
    decode(m_buffer.data(), m_spec.tile_pixels(), data);
    return true;
}

} // namespace kanuka::shade
