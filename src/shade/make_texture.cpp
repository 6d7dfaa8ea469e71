#include "shade/make_texture.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "base/tasks.h"
#include "base/vec.h"
#include "shade/linear_input.h"
#include "shade/search.h"

namespace kanuka::shade {

namespace {

constexpr std::string_view Wraps[] = {"black", "clamp", "periodic", "mirror"};
// RISpec's names and those of tools, and what OpenImageIO calls them.
constexpr std::pair<std::string_view, const char*> Filters[] = {
    {"box", "box"},
    {"triangle", "triangle"},
    {"gaussian", "gaussian"},
    {"catmull-rom", "catmull-rom"},
    {"b-spline", "b-spline"},
    {"mitchell", "mitchell"},
    {"sinc", "sinc"},
    {"lanczos", "lanczos3"},
    {"blackman-harris", "blackman-harris"},
    {"disk", "disk"},
};

// A whole picture, in linear light.
OIIO::ImageBuf read_linear(const std::string& path, bool& halfs) {
    LinearInput file;
    OIIO::ImageSpec spec;
    if (!file.open(path, spec))
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
        faces[k] = read_linear(making.pictures[k], of_halfs);
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
        const float theta = Pi * (float(y) + 0.5f) / float(spec.height);
        for (int x = 0; x < spec.width; x++) {
            const float phi = 2 * Pi * (float(x) + 0.5f) / float(spec.width);
            const Vec3f d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
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

} // namespace

void make_texture(const TextureMaking& making) {
    using Kind = TextureMaking::Kind;
    if (making.pictures.size() != (making.kind == Kind::CubeFaces ? 6 : 1))
        throw Error("a texture is made of one picture, of cube faces of six; there are " +
                    std::to_string(making.pictures.size()));
    for (const std::string& wrap : {making.s_wrap, making.t_wrap})
        if (std::find(std::begin(Wraps), std::end(Wraps), wrap) == std::end(Wraps))
            throw Error("there is no wrap mode \"" + wrap + "\"; there are black, clamp, periodic, mirror");
    const auto filter = std::find_if(std::begin(Filters), std::end(Filters),
                                     [&](const auto& f) { return f.first == making.filter; });
    if (filter == std::end(Filters)) {
        std::string all;
        for (const auto& f : Filters)
            all += (all.empty() ? "" : ", ") + std::string(f.first);
        throw Error("there is no filter \"" + making.filter + "\"; there are " + all);
    }
    if (!(making.fov > 0 && making.fov < 180))
        throw Error("cube faces must have a field of view between 0 and 180 degrees");

    bool halfs;
    OIIO::ImageBuf picture =
        making.kind == Kind::CubeFaces ? unfold(making, halfs) : read_linear(making.pictures[0], halfs);
    OIIO::ImageSpec& spec = picture.specmod();
    for (const char* name : {"wrapmodes", "textureformat", "compression", "tiffcompression"})
        spec.erase_attribute(name);
    OIIO::ImageSpec config;
    config.format = halfs ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT;
    config.tile_width = config.tile_height = 64;
    config.tile_depth = 1;
    config.attribute("wrapmodes", making.kind == Kind::Texture ? making.s_wrap + "," + making.t_wrap
                                                               : std::string("periodic,clamp"));
    config.attribute("compression", "zip");
    config.attribute("maketx:filtername", filter->second);
    config.attribute("maketx:fileformatname", "openexr");
    config.attribute("maketx:hash", 0);
    std::ostringstream said;
    const auto mode =
        making.kind == Kind::Texture ? OIIO::ImageBufAlgo::MakeTxTexture : OIIO::ImageBufAlgo::MakeTxEnvLatl;
    if (!OIIO::ImageBufAlgo::make_texture(mode, picture, making.texture, config, &said)) {
        std::string why = said.str() + OIIO::geterror();
        while (!why.empty() && why.back() == '\n')
            why.pop_back();
        throw Error("the texture \"" + making.texture + "\" cannot be written" +
                        (why.empty() ? "" : " (" + why + ")") + "; look at its folder",
                    ExitCode::Output);
    }
}

std::map<std::string, std::string> make_textures(const scene::ValueList& options,
                                                 const std::vector<std::string>& folders, Journal& journal) {
    constexpr std::string_view Prefix = "maketexture:";
    constexpr const char* as_named[] = {""};
    std::map<std::string, std::string> made;
    for (const scene::Value& v : options.values) {
        // Pictures, then kind, s_wrap, t_wrap, filter; fov.
        if (!v.name.starts_with(Prefix) || v.strings.size() < 5)
            continue;
        const size_t n = v.strings.size() - 4;
        const std::string& kind = v.strings[n];
        TextureMaking making;
        making.texture = v.name.substr(Prefix.size());
        making.kind = kind == "latlong" ? TextureMaking::Kind::LatLong
                      : kind == "cube"  ? TextureMaking::Kind::CubeFaces
                                        : TextureMaking::Kind::Texture;
        for (size_t i = 0; i < n; i++) {
            const auto before = made.find(v.strings[i]); // of a texture that was just made
            making.pictures.push_back(
                before != made.end() ? before->second
                                     : find_file(v.strings[i], folders, as_named).value_or(v.strings[i]));
        }
        making.s_wrap = v.strings[n + 1], making.t_wrap = v.strings[n + 2], making.filter = v.strings[n + 3];
        if (!v.floats.empty())
            making.fov = v.floats[0];
        try {
            make_texture(making);
            made[making.texture] = making.texture;
        } catch (const std::exception& e) {
            if (n == 1)
                made[making.texture] = making.pictures[0];
            journal.error(v.where, "\"" + making.texture + "\" was not made: " + e.what() +
                                       (n == 1 ? "; the picture itself stands for it" : ""));
        }
    }
    return made;
}

} // namespace kanuka::shade
