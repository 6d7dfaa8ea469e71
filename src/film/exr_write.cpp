#include <cmath>
#include <cstring>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include "film/atomic_file.h"
#include "film/film.h"

namespace kanuka::film {

namespace {

class Stream : public Imf::OStream {
  public:
    explicit Stream(AtomicFile& file) : OStream(file.path().c_str()), m_file(file) {}
    void write(const char data[], int size) override { m_file.write(data, size_t(size)); }
    uint64_t tellp() override { return m_file.position(); }
    void seekp(uint64_t position) override { m_file.seek(position); }

  private:
    AtomicFile& m_file;
};

void check(const std::string& path, const Picture& picture) {
    const auto fail = [&](const std::string& what) { throw Error(Location{path}, what, ExitCode::Output); };
    if (picture.width <= 0 || picture.height <= 0)
        fail("the picture has no pixels");
    if (picture.channels.empty())
        fail("the picture has no channels");
    for (const auto& channel : picture.channels) {
        if (channel.name.empty() || channel.name.size() > 255)
            fail("a channel's name must have 1 to 255 characters");
        if (channel.data.size() != size_t(picture.width) * picture.height)
            fail("channel \"" + channel.name + "\" has " + std::to_string(channel.data.size()) + " pixels; " +
                 std::to_string(picture.width) + " x " + std::to_string(picture.height) + " are needed");
        if (picture.find(channel.name) != &channel)
            fail("there are two channels \"" + channel.name + "\"");
    }
}

// Attributes that mean something to readers: a string under such a name would make the file unreadable.
bool is_reserved(const std::string& name) {
    static const char* const names[] = {"channels",
                                        "compression",
                                        "dataWindow",
                                        "displayWindow",
                                        "lineOrder",
                                        "pixelAspectRatio",
                                        "screenWindowCenter",
                                        "screenWindowWidth",
                                        "tiles",
                                        "type",
                                        "name",
                                        "version",
                                        "chunkCount",
                                        "view",
                                        "multiView",
                                        "preview",
                                        "chromaticities",
                                        "maxSamplesPerPixel"};
    for (const char* reserved : names)
        if (name == reserved)
            return true;
    return false;
}

Imf::Header make_header(const Picture& picture) {
    const Imath::Box2i data({picture.x0, picture.y0},
                            {picture.x0 + picture.width - 1, picture.y0 + picture.height - 1});
    Imath::Box2i display = data;
    if (picture.full_width > 0 && picture.full_height > 0)
        display = {{0, 0}, {picture.full_width - 1, picture.full_height - 1}};
    Imf::Header header(display, data);
    header.compression() = Imf::ZIP_COMPRESSION;
    const color::SpaceInfo& space = color::info(picture.space);
    const auto v2 = [](const double(&xy)[2]) { return Imath::V2f(float(xy[0]), float(xy[1])); };
    Imf::addChromaticities(header, Imf::Chromaticities(v2(space.primaries.xy[0]), v2(space.primaries.xy[1]),
                                                       v2(space.primaries.xy[2]), v2(space.white)));
    if (picture.white_luminance > 0)
        Imf::addWhiteLuminance(header, picture.white_luminance);
    for (const auto& [name, value] : picture.metadata) {
        std::string key = is_reserved(name) ? "kanuka." + name : name;
        if (key.size() > 255)
            key.resize(255);
        if (!key.empty())
            header.insert(key, Imf::StringAttribute(value));
    }
    for (const auto& channel : picture.channels)
        header.channels().insert(channel.name, Imf::Channel(channel.half ? Imf::HALF : Imf::FLOAT));
    return header;
}

// Finite values stay finite: an infinity from a very bright highlight would spoil every filter run over the
// picture.
half to_half(float value) {
    if (std::isfinite(value))
        value = std::min(std::max(value, -float(HALF_MAX)), float(HALF_MAX));
    return half(value);
}

} // namespace

void write_exr(const std::string& path, const Picture& picture) {
    check(path, picture);
    AtomicFile file(path);
    try {
        Stream stream(file);
        // Scan lines go out in blocks of 16, as ZIP compresses them, so halves need not all be there at once.
        constexpr int BlockRows = 16;
        Imf::OutputFile out(stream, make_header(picture));
        const size_t width = size_t(picture.width);
        std::vector<std::vector<half>> halves(picture.channels.size());
        for (size_t c = 0; c < halves.size(); c++)
            if (picture.channels[c].half)
                halves[c].resize(width * BlockRows);
        for (int row = 0; row < picture.height; row += BlockRows) {
            const int rows = std::min(BlockRows, picture.height - row);
            Imf::FrameBuffer frame;
            for (size_t c = 0; c < halves.size(); c++) {
                const auto& channel = picture.channels[c];
                const float* from = channel.data.data() + size_t(row) * width;
                // Slices are addressed as if they held the whole data window; makeSlice does that arithmetic.
                const Imath::V2i origin(picture.x0, picture.y0 + row);
                if (channel.half) {
                    for (size_t i = 0; i < width * rows; i++)
                        halves[c][i] = to_half(from[i]);
                    frame.insert(channel.name,
                                 Imf::Slice::Make(Imf::HALF, halves[c].data(), origin, picture.width, rows));
                } else {
                    frame.insert(channel.name,
                                 Imf::Slice::Make(Imf::FLOAT, from, origin, picture.width, rows));
                }
            }
            out.setFrameBuffer(frame);
            out.writePixels(rows);
        }
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(Location{path}, std::string("cannot be written: ") + e.what(), ExitCode::Output);
    }
    file.commit();
}

} // namespace kanuka::film
