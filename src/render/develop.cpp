#include "render/develop.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kanuka::render {

Development development(const scene::Options& options, const PlacedCamera& camera, const ColorSetup& color,
                        const Aovs& aovs, bool filter_weighted) {
    Development how;
    how.full_width = options.width, how.full_height = options.height;
    how.space = color.sensor.output;
    how.exposure = float(color.exposure.factor());
    if (color.exposure.physical())
        how.white_luminance = 1 / how.exposure;
    how.origin = camera.origin, how.eye = camera.eye, how.forward = camera.forward;
    how.filter_weighted = filter_weighted;
    how.imager = bool(options.imager);
    how.layers = aovs.layers();
    how.exposure_gain = options.exposure_gain, how.exposure_gamma = options.exposure_gamma;
    how.display = options.color.display;
    return how;
}

film::Picture develop(const Accumulator& gathered, const Development& how) {
    film::Picture picture;
    picture.width = gathered.window().width();
    picture.height = gathered.window().height();
    picture.full_width = how.full_width;
    picture.full_height = how.full_height;
    picture.x0 = gathered.window().x0;
    picture.y0 = gathered.window().y0;
    picture.space = how.space;
    picture.white_luminance = how.white_luminance;
    const float exposure = how.exposure;
    struct Out {
        const char* name;
        bool half;
    };
    static constexpr Out outs[] = {{"R", true},        {"G", true},        {"B", true},        {"A", true},
                                   {"albedo.R", true}, {"albedo.G", true}, {"albedo.B", true}, {"N.X", true},
                                   {"N.Y", true},      {"N.Z", true},      {"Z", false},       {"P.X", false},
                                   {"P.Y", false},     {"P.Z", false},     {"id", false}};
    const size_t pixels = gathered.window().pixels();
    for (const Out& o : outs)
        picture.channels.push_back({o.name, o.half, std::vector<float>(pixels)});
    const size_t first_aov = how.layers.add_channels(picture, pixels);
    std::vector<float> aovs(gathered.aovs());
    const Transform world_from_render = Transform::translate(how.origin[0], how.origin[1], how.origin[2]);
    for (int y = 0; y < picture.height; y++)
        for (int x = 0; x < picture.width; x++) {
            const size_t i = size_t(y) * size_t(picture.width) + size_t(x);
            const transport::PixelSums s = gathered.pixel(x, y);
            const float done = float(gathered.samples_at(x, y)) - s.dropped;
            // Filters with negative lobes: weights spread about their mean of one, and few may nearly cancel.
            // So they weigh what a sample is above the plain mean, which is 0 all over where all samples are
            // alike.
            const float n = s.weight > 0.25f * done ? 1 / s.weight : done > 0 ? 1 / done : 0;
            const auto filtered = [&](float sum, float plain) {
                if (!how.filter_weighted || done <= 0)
                    return sum * n;
                const float mean = plain / done;
                return mean + (sum - mean * s.weight) / done;
            };
            const float h = s.hits > 0 ? 1 / s.hits : 0;
            auto put = [&, c = 0](float v) mutable { picture.channels[size_t(c++)].data[i] = v; };
            for (int c = 0; c < 3; c++)
                put(filtered(s.rgb[c], s.plain[c]) * exposure);
            put(std::clamp(filtered(s.alpha, s.plain[3]), 0.0f, 1.0f));
            for (float v : s.albedo)
                put(v * n);
            Vec3f normal{s.normal[0], s.normal[1], s.normal[2]};
            normal = dot(normal, normal) > 0 ? normalize(normal) : Vec3f(0.0f);
            put(normal.x), put(normal.y), put(normal.z);
            const Vec3f p{s.position[0] * h, s.position[1] * h, s.position[2] * h};
            // Of things at the end of single precision sums and products leave it.
            constexpr float most = std::numeric_limits<float>::max();
            const auto bounded = [most](float v) {
                return std::isnan(v) ? most : std::clamp(v, -most, most);
            };
            put(s.hits > 0 ? bounded(dot(p - how.eye, how.forward)) : std::numeric_limits<float>::infinity());
            const Vec3f world = s.hits > 0 ? world_from_render.point(p) : Vec3f(0.0f);
            put(bounded(world.x)), put(bounded(world.y)), put(bounded(world.z));
            put(s.id);
            gathered.aovs_of(x, y, aovs);
            how.layers.put(picture, first_aov, i, aovs, {n, h, exposure, done});
        }
    picture.metadata = how.metadata;
    picture.metadata["kanuka.progressions"] = std::to_string(gathered.least_done() - gathered.first());
    if (gathered.first() > 0)
        picture.metadata["kanuka.part"] = progressions_text(gathered.first(), gathered.least_done());
    return picture;
}

} // namespace kanuka::render
