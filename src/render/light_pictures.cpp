#include "render/light_pictures.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <optional>

#include "color/photometry.h"
#include "film/film.h"
#include "shade/ies.h"
#include "shade/shade.h"

namespace kanuka::render {

static bool is_exr(const std::string& file) {
    std::string ending = std::filesystem::path(file).extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return ending == ".exr";
}

// Light is not negative, and no more than is kept.
static void keep_radiances(std::vector<float>& rgb, const scene::Light& light, Journal& journal) {
    size_t negative = 0, other = 0;
    for (float& v : rgb) {
        if (v >= 0 && v <= color::LargestRadiance)
            continue;
        negative += std::isfinite(v) && v < 0;
        other += !std::isfinite(v) || v > 0;
        v = std::isfinite(v) ? std::clamp(v, 0.0f, color::LargestRadiance) : 0.0f;
    }
    const std::string all =
        " of " + std::to_string(rgb.size()) + " values of the picture \"" + light.texture + "\" ";
    if (negative > 0)
        journal.report(Severity::Info, light.where,
                       std::to_string(negative) + all + "are negative and are taken as 0");
    if (other > 0)
        journal.warning(light.where, std::to_string(other) + all +
                                         "are not finite (taken as 0) or beyond 1e15 (taken as that)");
}

// Its own space is brought to the scene's; a file that names none is taken to be in the scene's.
static shade::LatLong read_exr_sky(const std::string& file, color::Space space) {
    const film::Picture picture = film::read_exr(file);
    const auto *r = picture.find("R"), *g = picture.find("G"), *b = picture.find("B");
    if (!r || !g || !b)
        throw Error("it has no R, G and B channels");
    shade::LatLong sky{picture.width, picture.height, std::vector<float>(r->data.size() * 3)};
    const bool converts = picture.names_space && picture.space != space;
    const color::Matrix3 matrix = color::convert(picture.space, space);
    for (size_t i = 0; i < r->data.size(); i++) {
        Rgb c(r->data[i], g->data[i], b->data[i]);
        if (converts)
            c = color::transform(matrix, c);
        for (int k = 0; k < 3; k++)
            sky.rgb[3 * i + size_t(k)] = c[k];
    }
    return sky;
}

static std::optional<shade::LatLong> read_sky(const scene::Light& light, color::Space space,
                                              Journal& journal) {
    if (!is_exr(light.texture))
        return shade::read_latlong(light.texture, space, 0, light.where, journal);
    try {
        return read_exr_sky(light.texture, space);
    } catch (const Error& e) {
        journal.error(light.where, "the environment picture \"" + light.texture + "\" cannot be used (" +
                                       e.what() + "); give a latitude-longitude OpenEXR or HDR file");
        return std::nullopt;
    }
}

void load_environment(transport::SceneInputs& in, color::Space space, Journal& journal) {
    for (scene::Light& light : in.lights) {
        if (light.kind != scene::Light::Kind::Environment || in.map.width > 0)
            continue;
        if (light.table)
            in.map = {light.table->width, light.table->height, light.table->rgb};
        else if (light.texture.empty())
            continue;
        else if (auto sky = read_sky(light, space, journal))
            in.map = {sky->width, sky->height, std::move(sky->rgb)};
        else {
            light.texture.clear();
            continue;
        }
        keep_radiances(in.map.rgb, light, journal);
    }
}

void load_tables(transport::SceneInputs& in, color::Space space, Journal& journal) {
    using Kind = scene::Light::Kind;
    constexpr int MostColumns = 1024;
    for (scene::Light& light : in.lights) {
        if (light.kind == Kind::Quad && !light.texture.empty()) {
            if (auto picture = shade::read_latlong(light.texture, space, MostColumns, light.where, journal)) {
                auto table = std::make_shared<scene::LightTable>();
                table->width = picture->width, table->height = picture->height;
                keep_radiances(picture->rgb, light, journal);
                table->rgb = std::move(picture->rgb);
                light.table = std::move(table);
            }
        } else if ((light.kind == Kind::Point || light.kind == Kind::Spot) && !light.profile.empty()) {
            light.table = shade::read_ies(light.profile, light.where, journal);
        }
    }
}

} // namespace kanuka::render
