#include <cmath>
#include <cstring>
#include <fstream>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTileDescription.h>
#include <ImfVersion.h>

#include "film/film.h"

namespace kanuka::film {

namespace {

// The file in memory: no read can go past its end, whatever its offsets say.
class Stream : public Imf::IStream {
  public:
    Stream(const std::string& path, const std::vector<char>& bytes) : IStream(path.c_str()), m_bytes(bytes) {}
    bool read(char out[], int size) override {
        if (size < 0 || uint64_t(size) > m_bytes.size() - std::min(m_position, uint64_t(m_bytes.size())))
            throw std::runtime_error("the file ends too early");
        std::memcpy(out, m_bytes.data() + m_position, size_t(size));
        m_position += uint64_t(size);
        return m_position < m_bytes.size();
    }
    uint64_t tellg() override { return m_position; }
    void seekg(uint64_t position) override { m_position = position; }

  private:
    const std::vector<char>& m_bytes;
    uint64_t m_position = 0;
};

std::vector<char> read_bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = in ? std::streamoff(in.tellg()) : -1;
    // A directory opens, and claims the largest size there is.
    constexpr std::streamoff Largest = std::streamoff(1) << 40;
    if (size < 0 || size > Largest)
        throw Error(Location{path}, "the picture cannot be opened");
    std::vector<char> bytes(static_cast<size_t>(size));
    in.seekg(0);
    if (!in.read(bytes.data(), size))
        throw Error(Location{path}, "the picture cannot be read");
    return bytes;
}

// What a header may ask for, before anything is allocated. The limits lie far above any rendered picture.
void check(const Imf::Header& header, size_t file_size) {
    constexpr int64_t LargestSide = 1 << 20;
    constexpr int64_t MostSamples = int64_t(1) << 31;
    constexpr int MostChannels = 4096;
    // The display window is not used to allocate, but has to make sense in 32 bits.
    for (const Imath::Box2i& box : {header.dataWindow(), header.displayWindow()}) {
        const int64_t w = int64_t(box.max.x) - box.min.x + 1, h = int64_t(box.max.y) - box.min.y + 1;
        if (w < 1 || h < 1 || w > LargestSide || h > LargestSide ||
            std::abs(int64_t(box.min.x)) > LargestSide || std::abs(int64_t(box.min.y)) > LargestSide)
            throw std::runtime_error("its windows are not those of a picture (" + std::to_string(w) + " x " +
                                     std::to_string(h) + ")");
    }
    const Imath::Box2i& box = header.dataWindow();
    const int64_t w = int64_t(box.max.x) - box.min.x + 1, h = int64_t(box.max.y) - box.min.y + 1;
    int channels = 0;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c, channels++)
        if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
            throw std::runtime_error(std::string("channel \"") + c.name() +
                                     "\" is subsampled; convert it first");
    if (channels == 0 || channels > MostChannels)
        throw std::runtime_error("it has " + std::to_string(channels) + " channels");
    if (w * h > MostSamples / channels)
        throw std::runtime_error("it is too large: " + std::to_string(w) + " x " + std::to_string(h) +
                                 " with " + std::to_string(channels) + " channels");
    // Every 256 scan lines need a chunk at the least (DWAB), with 8 bytes in the table and 8 of its own.
    // Tiles of any height: bounded by the side.
    const int64_t chunk_rows = header.hasTileDescription() ? LargestSide : 256;
    if ((h + chunk_rows - 1) / chunk_rows * 16 > int64_t(file_size))
        throw std::runtime_error("the file is too short for " + std::to_string(h) + " scan lines");
    if (header.hasTileDescription()) {
        const auto& tile = header.tileDescription();
        constexpr unsigned LargestTile = 8192;
        if (tile.xSize < 1 || tile.ySize < 1 || tile.xSize > LargestTile || tile.ySize > LargestTile)
            throw std::runtime_error("its tiles are " + std::to_string(tile.xSize) + " x " +
                                     std::to_string(tile.ySize));
    }
}

uint32_t little_endian(const std::vector<char>& bytes, size_t at) {
    uint32_t value = 0;
    for (int i = 3; i >= 0; i--)
        value = value << 8 | uint8_t(bytes[at + size_t(i)]);
    return value;
}

// Walks over one header's attributes (name, type, size, value) without looking into them, and returns where
// it ends: the library allocates what an attribute says it needs before it reads.
size_t skip_header(const std::vector<char>& bytes, size_t at) {
    const auto skip_text = [&] {
        const void* end = at < bytes.size() ? std::memchr(&bytes[at], 0, bytes.size() - at) : nullptr;
        if (!end)
            throw std::runtime_error("its header does not end");
        const size_t start = at;
        at = size_t(static_cast<const char*>(end) - bytes.data()) + 1;
        return at - start - 1;
    };
    while (skip_text() > 0) {
        skip_text();
        if (bytes.size() - at < 4 || little_endian(bytes, at) > bytes.size() - at - 4)
            throw std::runtime_error("an attribute of its header is longer than the file");
        at += 4 + little_endian(bytes, at);
    }
    return at;
}

void check_headers(Stream& stream, const std::vector<char>& bytes) {
    constexpr size_t Prologue = 8;
    constexpr uint32_t DeepFlag = 0x800, MultiPartFlag = 0x1000;
    if (bytes.size() < Prologue || !Imf::isImfMagic(bytes.data()))
        throw std::runtime_error("it does not start as an OpenEXR file does");
    const uint32_t version = little_endian(bytes, 4);
    if (version & DeepFlag)
        throw std::runtime_error("it holds deep data; flatten it first");
    for (size_t at = Prologue;;) {
        const size_t end = skip_header(bytes, at);
        Imf::Header header;
        int for_library = int(version);
        stream.seekg(at);
        header.readFrom(stream, for_library);
        check(header, bytes.size());
        at = end;
        // A multi-part file has headers up to an empty one.
        if (!(version & MultiPartFlag) || at >= bytes.size() || bytes[at] == 0)
            break;
    }
    stream.seekg(0);
}

Picture read(const std::string& path, const std::vector<char>& bytes) {
    Stream stream(path, bytes);
    check_headers(stream, bytes);
    Imf::InputFile in(stream, 0);
    const Imf::Header& header = in.header();

    Picture picture;
    const Imath::Box2i data = header.dataWindow(), display = header.displayWindow();
    picture.width = data.max.x - data.min.x + 1;
    picture.height = data.max.y - data.min.y + 1;
    // A display window that does not start at 0 is moved there.
    picture.x0 = data.min.x - display.min.x;
    picture.y0 = data.min.y - display.min.y;
    picture.full_width = display.max.x - display.min.x + 1;
    picture.full_height = display.max.y - display.min.y + 1;
    if (Imf::hasChromaticities(header)) {
        const Imf::Chromaticities& c = Imf::chromaticities(header);
        for (const color::Space space : {color::Space::Rec709, color::Space::Rec2020, color::Space::AcesCg,
                                         color::Space::Aces2065, color::Space::Xyz}) {
            const color::SpaceInfo& known = color::info(space);
            const auto near = [](const Imath::V2f& a, const double(&b)[2]) {
                return std::abs(a.x - b[0]) < 2e-3 && std::abs(a.y - b[1]) < 2e-3;
            };
            if (near(c.red, known.primaries.xy[0]) && near(c.green, known.primaries.xy[1]) &&
                near(c.blue, known.primaries.xy[2]) && near(c.white, known.white)) {
                picture.space = space;
                picture.names_space = true;
            }
        }
    }
    if (Imf::hasWhiteLuminance(header))
        picture.white_luminance = Imf::whiteLuminance(header);
    for (auto a = header.begin(); a != header.end(); ++a)
        if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
            picture.metadata[a.name()] = text->value();
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        picture.channels.push_back({c.name(), c.channel().type == Imf::HALF, {}});

    // In bands, with memory growing as they come: a short file that claims to be huge fails before it costs
    // much.
    constexpr int BandRows = 256;
    const size_t width = size_t(picture.width);
    for (int row = 0; row < picture.height; row += BandRows) {
        const int rows = std::min(BandRows, picture.height - row);
        Imf::FrameBuffer frame;
        for (auto& channel : picture.channels) {
            channel.data.resize(width * size_t(row + rows));
            frame.insert(channel.name,
                         Imf::Slice::Make(Imf::FLOAT, channel.data.data() + width * size_t(row),
                                          Imath::V2i(data.min.x, data.min.y + row), picture.width, rows));
        }
        in.setFrameBuffer(frame);
        in.readPixels(data.min.y + row, data.min.y + row + rows - 1);
    }
    return picture;
}

} // namespace

Picture read_exr(const std::string& path) {
    const std::vector<char> bytes = read_bytes(path);
    try {
        return read(path, bytes);
    } catch (const std::exception& e) {
        throw Error(Location{path}, std::string("not a readable OpenEXR picture: ") + e.what());
    }
}

} // namespace kanuka::film
