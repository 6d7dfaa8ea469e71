#include "shade/query.h"

#include <algorithm>

#include "scene/schema/attributes.h"
#include "scene/schema/options.h"

namespace kanuka::shade {

namespace {

bool floats(const sl::Query& q, std::initializer_list<float> values) {
    if (q.wants_text || q.count < 1)
        return false;
    std::copy_n(values.begin(), std::min(values.size(), size_t(q.count)), q.floats);
    return true;
}

bool text(const sl::Query& q, std::string_view value) {
    if (q.wants_text)
        *q.text = value;
    return q.wants_text;
}

bool value(const sl::Query& q, const scene::Value* v) {
    if (!v)
        return false;
    if (q.wants_text) {
        if (!v->strings.empty())
            *q.text = v->strings[0];
        return !v->strings.empty();
    }
    const auto take = [&](const auto& numbers) {
        for (size_t i = 0; i < std::min(size_t(q.count), numbers.size()); i++)
            q.floats[i] = float(numbers[i]);
        return !numbers.empty();
    };
    return take(v->floats) || take(v->ints);
}

bool setting(const sl::Query& q, const scene::Setting& s) {
    if (q.wants_text) {
        if (!s.texts.empty())
            *q.text = s.texts[0];
        return !s.texts.empty();
    }
    for (size_t i = 0; i < std::min(size_t(q.count), s.numbers.size()); i++)
        q.floats[i] = float(s.numbers[i]);
    return !s.numbers.empty();
}

bool attribute(const sl::Query& q, std::string_view name, const scene::Attributes& a) {
    if (name == "ShadingRate")
        return floats(q, {a.shading_rate});
    if (name == "Sides")
        return floats(q, {float(a.sides)});
    if (name == "matte" || name == "Matte")
        return floats(q, {a.matte ? 1.0f : 0.0f});
    if (name == "Orientation")
        return text(q, a.reverse_orientation ? "inside" : "outside");
    if (name == "TextureCoordinates") {
        const auto& t = a.texture_coordinates;
        return floats(q, {t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7]});
    }
    if (name == "Color")
        return floats(q, {a.color.x, a.color.y, a.color.z});
    if (name == "Opacity")
        return floats(q, {a.opacity.x, a.opacity.y, a.opacity.z});
    if (const scene::AttributeParameter* row = scene::find_rib_attribute(name))
        return setting(q, row->get(a));
    return value(q, a.user.find(name));
}

bool option(const sl::Query& q, std::string_view name, const scene::Options& o, const scene::Camera* camera) {
    const float aspect = float(o.width) * o.pixel_aspect / float(std::max(1, o.height));
    if (name == "Format")
        return floats(q, {float(o.width), float(o.height), o.pixel_aspect});
    if (name == "DeviceResolution")
        return floats(q, {float(o.width), float(o.height), o.pixel_aspect});
    if (name == "FrameAspectRatio")
        return floats(q, {aspect});
    if (name == "CropWindow")
        return floats(q, {o.crop[0], o.crop[1], o.crop[2], o.crop[3]});
    if (name == "Shutter")
        return floats(q, {o.shutter_open, o.shutter_close});
    if (name == "PixelSamples")
        return floats(q, {float(o.samples), 1});
    if (camera && name == "DepthOfField" && camera->f_stop > 0)
        return floats(q, {camera->f_stop, camera->focal_length, camera->focal_distance});
    if (camera && name == "Clipping")
        return floats(q, {camera->near_clip, camera->far_clip});
    if (camera && name == "Projection")
        return text(q, kind_of(camera->projection).name);
    if (camera && name == "FieldOfView")
        return floats(q, {camera->fov});
    if (const scene::OptionParameter* row = scene::find_rib_option(name))
        return setting(q, row->get(o));
    return value(q, o.user.find(name));
}

bool renderer(const sl::Query& q, std::string_view name) {
    if (name == "renderer")
        return text(q, "kanuka");
    if (name == "version")
        return floats(q, {float(sl::CompilerVersion), 0, 0, 0});
    if (name == "versionstring")
        return text(q, std::to_string(sl::CompilerVersion) + ".0.0.0");
    return false;
}

bool texture(const sl::Query& q, std::string_view name, Textures& textures) {
    const std::optional<Textures::Info> info = textures.info(q.file);
    if (name == "exists")
        return floats(q, {info ? 1.0f : 0.0f});
    if (!info)
        return false;
    if (name == "resolution")
        return floats(q, {float(info->width), float(info->height)});
    if (name == "channels")
        return floats(q, {float(info->channels)});
    if (name == "type")
        return text(q, info->environment ? "environment" : "texture");
    return false;
}

} // namespace

bool answer(const sl::Query& q, const Facts& facts, Textures& textures) {
    std::string_view name = q.name ? q.name : "";
    if (name.starts_with("Ri:"))
        name.remove_prefix(3);
    switch (q.kind) {
    case sl::Query::Attribute:
        return facts.attributes && attribute(q, name, *facts.attributes);
    case sl::Query::Option:
        return facts.options && option(q, name, *facts.options, facts.camera);
    case sl::Query::Renderer:
        return renderer(q, name);
    case sl::Query::Texture:
        return texture(q, name, textures);
    }
    return false;
}

std::string attribute_key(const scene::Attributes& a) {
    std::string key = a.name + '\0' + a.displacement_bound_space + '\0';
    const auto number = [&](float x) { key.append(reinterpret_cast<const char*>(&x), sizeof x); };
    for (float x : {a.shading_rate, float(a.sides), float(a.matte), float(a.reverse_orientation),
                    a.displacement_bound, float(a.visible_camera)})
        number(x);
    for (float x : a.texture_coordinates)
        number(x);
    for (const scene::Value& v : a.user.values) {
        key += v.name + '\0';
        for (float x : v.floats)
            number(x);
        for (int32_t x : v.ints)
            number(float(x));
        for (const std::string& s : v.strings)
            key += s + '\0';
    }
    return key;
}

} // namespace kanuka::shade
