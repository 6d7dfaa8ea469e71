#include "render/light_pictures.h"

#include <algorithm>
#include <cmath>

#include "film/film.h"
#include "shade/ies.h"
#include "shade/shade.h"

namespace kanuka::render {

void load_environment(transport::SceneInputs& in, color::Space space, Journal& journal) {
    for (scene::Light& light : in.lights) {
        if (light.kind != scene::Light::Kind::Environment || in.map.width > 0)
            continue;
        if (light.table) {
            in.map = {light.table->width, light.table->height, light.table->rgb};
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
                        in.map.rgb[3 * i + size_t(k)] = std::max(c[k], 0.0f);
                }
            }
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
                for (float& v : picture->rgb)
                    v = std::isfinite(v) ? std::clamp(v, 0.0f, 1e6f) : 0.0f;
                table->rgb = std::move(picture->rgb);
                light.table = std::move(table);
            }
        } else if ((light.kind == Kind::Point || light.kind == Kind::Spot) && !light.profile.empty()) {
            light.table = shade::read_ies(light.profile, light.where, journal);
        }
    }
}

} // namespace kanuka::render
