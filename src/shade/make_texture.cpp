#include "shade/make_texture.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imageio.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>

#include "base/cache_folder.h"
#include "base/latlong.h"
#include "base/tasks.h"
#include "scene/picture_name.h"
#include "shade/linear_input.h"
#include "shade/mip_levels.h"
#include "shade/search.h"

namespace kanuka::shade {

namespace {

constexpr std::string_view Wraps[] = {"black", "clamp", "periodic", "mirror"};

// The file of a picture that a scene names. What a Display of another frame wrote under that name is an
// OpenEXR file of another name (picture_name.h).
std::optional<std::string> find_picture(const std::string& name, std::vector<std::string> folders) {
    constexpr const char* As[] = {"", ".exr"};
    folders.push_back("."); // where pictures are written
    if (auto found = find_file(name, folders, As))
        return found;
    return find_file(scene::picture_file(name), folders, std::span(As, 1));
}

// A whole picture, in linear light.
OIIO::ImageBuf read_linear(const std::string& path, PictureSpace space, bool& halfs) {
    LinearInput file(space);
    OIIO::ImageSpec spec;
    std::error_code failed;
    if (!std::filesystem::exists(path, failed))
        throw Error("there is no picture \"" + path + "\"");
    if (!file.open(LinearInput::name_of(path, space), spec))
        throw Error("the picture \"" + path + "\" cannot be read (" + file.geterror() + ")");
    halfs = spec.format == OIIO::TypeDesc::HALF || spec.format.basesize() == 1;
    spec.set_format(OIIO::TypeDesc::FLOAT);
    spec.tile_width = spec.tile_height = spec.tile_depth = 0;
    OIIO::ImageBuf picture(spec);
    if (!file.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, picture.localpixels()))
        throw Error("the picture \"" + path + "\" cannot be read (" + file.geterror() + ")");
    return picture;
}

// Which way the faces look, and which way is up.
constexpr float Views[6][2][3] = {{{1, 0, 0}, {0, 1, 0}},  {{-1, 0, 0}, {0, 1, 0}}, {{0, 1, 0}, {0, 0, -1}},
                                  {{0, -1, 0}, {0, 0, 1}}, {{0, 0, 1}, {0, 1, 0}},  {{0, 0, -1}, {0, 1, 0}}};
Vec3f view(size_t face, int which) {
    const float* v = Views[face][which];
    return {v[0], v[1], v[2]};
}

// Six faces to a picture by latitude and longitude, as fine at its equator as they are.
OIIO::ImageBuf unfold(const TextureMaking& making, bool& halfs) {
    std::array<OIIO::ImageBuf, 6> faces;
    halfs = true;
    int channels = 0, size = 1;
    for (size_t k = 0; k < 6; k++) {
        bool of_halfs;
        faces[k] = read_linear(making.pictures[k], making.space, of_halfs);
        halfs &= of_halfs;
        channels = k == 0 ? faces[k].nchannels() : std::min(channels, faces[k].nchannels());
        size = std::max({size, faces[k].spec().width, faces[k].spec().height});
    }
    OIIO::ImageSpec spec(4 * size, 2 * size, channels, OIIO::TypeDesc::FLOAT);
    if (faces[0].spec().get_int_attribute("kanuka:rec709", 0))
        spec.attribute("kanuka:rec709", 1);
    OIIO::ImageBuf out(spec);
    const float scale = 1 / std::tan(making.fov * Pi / 360);
    tasks::parallel_for(size_t(spec.height), [&](size_t y) {
        std::vector<float> pixel(64);
        for (int x = 0; x < spec.width; x++) {
            const Vec3f d = latlong_direction((float(x) + 0.5f) / float(spec.width),
                                              (float(y) + 0.5f) / float(spec.height));
            size_t best = 0;
            for (size_t k = 1; k < 6; k++)
                if (dot(d, view(k, 0)) > dot(d, view(best, 0)))
                    best = k;
            const Vec3f forward = view(best, 0), up = view(best, 1);
            const float ahead = dot(d, forward) / scale;
            const float s = 0.5f + 0.5f * dot(d, cross(up, forward)) / ahead; // right, in a left-handed space
            const float t = 0.5f - 0.5f * dot(d, up) / ahead;
            faces[best].interppixel_NDC(s, t, pixel.data(), OIIO::ImageBuf::WrapClamp);
            out.setpixel(x, int(y), pixel.data(), channels);
        }
    });
    return out;
}

// When a file was written, in UTC and as OpenEXR's capDate has it. Textures bear the date of their picture:
// made again they are the same file.
std::string date_of(const std::string& path) {
    std::error_code failed;
    const auto written = std::filesystem::last_write_time(path, failed);
    const auto time =
        failed ? std::chrono::system_clock::time_point{} : std::chrono::file_clock::to_sys(written);
    const std::time_t seconds = std::chrono::system_clock::to_time_t(
        std::chrono::time_point_cast<std::chrono::system_clock::duration>(time));
    std::tm utc{};
    gmtime_r(&seconds, &utc);
    char text[32];
    return {text, std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &utc)};
}

// A tiled file of all levels, whole under its name or not there.
void write_levels(const std::vector<OIIO::ImageBuf>& levels, OIIO::ImageSpec spec, const std::string& name,
                  const std::string& part) {
    const auto fail = [&](std::string why) {
        std::error_code ignored;
        std::filesystem::remove(part, ignored);
        while (!why.empty() && why.back() == '\n')
            why.pop_back();
        throw Error("the texture \"" + name + "\" cannot be written" + (why.empty() ? "" : " (" + why + ")") +
                        "; look at its folder",
                    ExitCode::Output);
    };
    const std::unique_ptr<OIIO::ImageOutput> file = OIIO::ImageOutput::create("openexr");
    if (!file)
        fail(OIIO::geterror());
    for (size_t i = 0; i < levels.size(); i++) {
        const OIIO::ImageSpec& size = levels[i].spec();
        spec.width = spec.full_width = size.width;
        spec.height = spec.full_height = size.height;
        spec.x = spec.y = spec.full_x = spec.full_y = 0;
        if (!file->open(part, spec, i == 0 ? OIIO::ImageOutput::Create : OIIO::ImageOutput::AppendMIPLevel) ||
            !file->write_image(OIIO::TypeDesc::FLOAT, levels[i].localpixels()))
            fail(file->geterror());
    }
    if (!file->close())
        fail(file->geterror());
    std::error_code failed;
    std::filesystem::rename(part, name, failed);
    if (failed)
        fail(failed.message());
}

} // namespace

void make_texture(const TextureMaking& making) {
    using Kind = TextureMaking::Kind;
    if (making.pictures.size() != (making.kind == Kind::CubeFaces ? 6 : 1))
        throw Error("a texture is made of one picture, of cube faces of six; there are " +
                    std::to_string(making.pictures.size()));
    for (const std::string& wrap : {making.s_wrap, making.t_wrap})
        if (std::find(std::begin(Wraps), std::end(Wraps), wrap) == std::end(Wraps))
            throw Error("there is no wrap mode \"" + wrap + "\"; there are black, clamp, periodic, mirror");
    if (!is_mip_filter(making.filter))
        throw Error("there is no filter \"" + making.filter + "\"; there are " + mip_filter_names());
    if (!(making.fov > 0 && making.fov < 180))
        throw Error("cube faces must have a field of view between 0 and 180 degrees");

    bool halfs;
    OIIO::ImageBuf picture = making.kind == Kind::CubeFaces
                                 ? unfold(making, halfs)
                                 : read_linear(making.pictures[0], making.space, halfs);
    const bool environment = making.kind != Kind::Texture;
    const std::string s_wrap = environment ? "periodic" : making.s_wrap,
                      t_wrap = environment ? "clamp" : making.t_wrap;
    OIIO::ImageSpec spec = picture.spec();
    // A profile is of the codes, not of light; OpenEXR has no place for it, which OpenImageIO would say.
    for (const char* name : {"compression", "tiffcompression", "ICCProfile"})
        spec.erase_attribute(name);
    spec.set_format(halfs ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
    spec.tile_width = spec.tile_height = 64;
    spec.tile_depth = 1;
    spec.attribute("wrapmodes", s_wrap + "," + t_wrap);
    spec.attribute("compression", "zip");
    spec.attribute("DateTime", date_of(making.pictures[0]));
    // OpenEXR's own mark of an environment means another axis upwards, and texels that lie on its edges.
    spec.attribute("textureformat", "Plain Texture");
    spec.attribute("kanuka:environment", int(environment));
    write_levels(
        mip_levels(std::move(picture), {making.filter, making.s_width, making.t_width, s_wrap, t_wrap}), spec,
        making.texture, unfinished_name(making.texture, making.unfinished_suffix));
}

std::map<std::string, std::string> make_textures(const scene::ValueList& options,
                                                 const std::vector<std::string>& folders, Journal& journal) {
    constexpr std::string_view Prefix = "maketexture:";
    std::map<std::string, std::string> made;
    // Of six pictures none could stand in, nor could another file of a like name.
    const auto leave_to_no_other = [&](const std::string& texture) {
        if (!std::filesystem::exists(texture))
            made[texture] = "";
    };
    // OpenImageIO takes a bare name, as "env" or "tif", for that of a format.
    const auto path_of = [](const std::string& name) {
        return name.find('/') == std::string::npos ? "./" + name : name;
    };
    for (const scene::Value& v : options.values) {
        // Pictures, then kind, s_wrap, t_wrap, filter; fov, s_width, t_width.
        if (!v.name.starts_with(Prefix) || v.strings.size() < 5)
            continue;
        const size_t n = v.strings.size() - 4;
        const std::string& kind = v.strings[n];
        TextureMaking making;
        making.texture = v.name.substr(Prefix.size());
        making.kind = kind == "latlong" ? TextureMaking::Kind::LatLong
                      : kind == "cube"  ? TextureMaking::Kind::CubeFaces
                                        : TextureMaking::Kind::Texture;
        std::string missing;
        for (size_t i = 0; i < n; i++) {
            const auto before = made.find(v.strings[i]); // of a texture that was just made
            const auto picture = before != made.end() ? before->second : find_picture(v.strings[i], folders);
            if (!picture)
                missing += (missing.empty() ? "\"" : "\", \"") + v.strings[i];
            making.pictures.push_back(picture.value_or(v.strings[i]));
        }
        if (!missing.empty()) {
            const bool several = missing.find("\", \"") != std::string::npos;
            journal.error(v.where,
                          "\"" + making.texture + "\" was not made: " +
                              (several ? "there are no pictures " : "there is no picture ") + missing +
                              "\" in " + join_folders(folders) + ". Where another frame of the file writes " +
                              (several ? "them" : "it") + ", render that frame first, by its number");
            if (n > 1)
                leave_to_no_other(making.texture);
            continue;
        }
        making.s_wrap = v.strings[n + 1], making.t_wrap = v.strings[n + 2], making.filter = v.strings[n + 3];
        const auto number = [&](size_t i, float otherwise) {
            return i < v.floats.size() ? v.floats[i] : otherwise;
        };
        making.fov = number(0, making.fov);
        making.s_width = number(1, 0), making.t_width = number(2, 0);
        try {
            make_texture(making);
            made[making.texture] = path_of(making.texture);
        } catch (const std::exception& e) {
            if (n == 1)
                made[making.texture] = making.pictures[0];
            else
                leave_to_no_other(making.texture);
            journal.error(v.where, "\"" + making.texture + "\" was not made: " + e.what() +
                                       (n == 1 ? "; the picture itself stands for it" : ""));
        }
    }
    return made;
}

} // namespace kanuka::shade
