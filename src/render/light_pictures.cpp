#include "render/light_pictures.h"

#include <algorithm>
#include <cmath>

#include "color/photometry.h"
#include "film/film.h"
#include "shade/ies.h"
#include "shade/shade.h"

namespace kanuka::render {

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

void load_environment(transport::SceneInputs& in, color::Space space, Journal& journal) {
    for (scene::Light& light : in.lights) {
        if (light.kind != scene::Light::Kind::Environment || in.map.width > 0)
            continue;
        if (light.table) {
            in.map = {light.table->width, light.table->height, light.table->rgb};
            keep_radiances(in.map.rgb, light, journal);
            continue;
        }
        if (light.texture.empty())
            continue;
        try {
            const film::Picture picture = film::read_exr(light.texture);
            const auto *r = picture.find("R"), *g = picture.find("G"), *b = picture.find("B");
            if (!r || !g || !b)
                throw Error("it has no R, G and B channels");
            in.map.width = picture.width;
            in.map.height = picture.height;
            in.map.rgb.resize(r->data.size() * 3);
            // A file that names its space is brought to the scene's; others are taken to be in it.
            const bool converts = picture.names_space && picture.space != space;
            const color::Matrix3 matrix = color::convert(picture.space, space);
            for (size_t i = 0; i < r->data.size(); i++) {
                in.map.rgb[3 * i] = r->data[i];
                in.map.rgb[3 * i + 1] = g->data[i];
                in.map.rgb[3 * i + 2] = b->data[i];
                if (converts) {
                    const Rgb c = color::transform(matrix, {r->data[i], g->data[i], b->data[i]});
                    for (int k = 0; k < 3; k++)
                        in.map.rgb[3 * i + size_t(k)] = c[k];
                }
            }
            keep_radiances(in.map.rgb, light, journal);
        } catch (const Error& e) {
            journal.error(light.where, "the environment picture \"" + light.texture + "\" cannot be used (" +
                                           e.what() + "); give a latitude-longitude OpenEXR file");
            light.texture.clear();
        }
    }
}

void load_tables(transport::SceneInputs& in, Journal& journal) {
    using Kind = scene::Light::Kind;
    constexpr int MostColumns = 1024;
    for (scene::Light& light : in.lights) {
        if (light.kind == Kind::Quad && !light.texture.empty()) {
            if (auto picture = shade::read_latlong(light.texture, MostColumns, light.where, journal)) {
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
