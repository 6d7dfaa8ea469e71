// Options: what holds for the whole picture.

#include <cmath>
#include <cstdint>

#include "ingest/rib/context.h"
#include "ingest/rib/dialects/options.h"
#include "ingest/rib/handlers.h"
#include "ingest/rib/search_path.h"
#include "scene/schema/camera.h"
#include "scene/schema/options.h"
#include "scene/shutter.h"

namespace kanuka::ingest::handlers {

using scene::Value;

static void keep(scene::ValueList& list, std::string name, std::vector<float> floats) {
    Value v;
    v.name = std::move(name);
    v.array_size = int(floats.size());
    v.floats = std::move(floats);
    list.set(std::move(v));
}

static void keep_text(scene::ValueList& list, std::string name, std::string text) {
    Value v;
    v.name = std::move(name);
    v.type = scene::Type::String;
    v.strings = std::vector<std::string>{std::move(text)};
    list.set(std::move(v));
}

static void out_of_range(Context& c, const Call& call, const std::string& what) {
    c.reports.error("range of " + std::string(call.spec->name), call.where,
                    std::string(call.spec->name) + ": " + what + "; it stays as it was");
}

void format(Context& c, Call& call) {
    if (!c.finite(call, 3))
        return;
    scene::Options& o = c.options.options;
    // -1 asks for the default of the display (RISpec 4.1.2).
    const auto side = [&](size_t i, int& side) {
        if (call.i(i) > 0)
            side = call.i(i);
        else if (call.i(i) != -1)
            out_of_range(c, call, "a resolution of " + std::to_string(call.i(i)) + " must be 1 or more");
    };
    side(0, o.width);
    side(1, o.height);
    if (call.args[2].given && call.f(2) > 0)
        o.pixel_aspect = call.f(2);
    else if (call.args[2].given && call.f(2) != -1)
        out_of_range(c, call, "the pixel aspect ratio must be more than 0");
}

void frame_aspect_ratio(Context& c, Call& call) {
    if (c.finite(call, 1) && call.f(0) > 0)
        c.options.frame_aspect_ratio = call.f(0);
    else
        out_of_range(c, call, "the ratio must be more than 0");
}

void screen_window(Context& c, Call& call) {
    if (!c.finite(call, 1))
        return;
    const auto& v = call.args[0].floats;
    const auto fault =
        scene::find_camera_parameter("screen_window")->set(c.options.camera, {{v.begin(), v.end()}, {}});
    if (fault)
        out_of_range(c, call, *fault);
}

void crop_window(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (!c.finite(call, 1))
        return;
    if (!(v[0] < v[1] && v[2] < v[3] && v[0] >= 0 && v[1] <= 1 && v[2] >= 0 && v[3] <= 1))
        return out_of_range(c, call, "it takes xmin < xmax and ymin < ymax between 0 and 1");
    c.options.options.crop = {v[0], v[1], v[2], v[3]};
}

void projection(Context& c, Call& call) {
    scene::Camera& camera = c.options.camera;
    std::string_view name = call.text(0);
    if (name == "PxrPerspective" || name == "PxrCamera")
        name = "perspective";
    else if (name == "PxrOrthographic")
        name = "orthographic";
    if (const auto known = projection_by_name(name)) {
        camera.projection = *known;
        scene::Camera seen = camera;
        auto fault = scene::find_camera_parameter("fov")->set(
            seen, {{call.params.get_float("fov", is_fisheye(*known) ? 180 : 90)}, {}});
        if (!fault)
            fault = scene::fault_of_fov(seen);
        if (!fault)
            camera.fov = seen.fov;
        else
            out_of_range(c, call, *fault);
    } else if (call.text(0) != "null") {
        c.reports.error("Projection", call.where,
                        "Projection \"" + call.text(0) +
                            "\" is unknown; the projection stays as it was (there are " +
                            projection_names<std::string>(", ") + ")");
    }
    // What comes before Projection would transform the projected picture (RISpec 4.1.1); what comes after it,
    // the camera.
    if (!(c.ctm == Transform{}))
        c.reports.warning(
            "transformation before Projection", call.where,
            "transformations before Projection were dropped; move them behind Projection, or use "
            "ScreenWindow to shift the picture");
    c.replace({});
    // Names of spaces are relative to the camera: "screen" and "NDC" have no affine place in the scene.
}

void clipping(Context& c, Call& call) {
    if (!c.finite(call, 2))
        return;
    if (!(call.f(0) < call.f(1)))
        return out_of_range(c, call, "near must be less than far");
    c.options.camera.near_clip = call.f(0);
    c.options.camera.far_clip = call.f(1);
}

void depth_of_field(Context& c, Call& call) {
    scene::Camera& camera = c.options.camera;
    if (!call.args[0].given) {
        camera.f_stop = camera.focal_length = camera.focal_distance = 0;
        return;
    }
    if (!call.args[2].given)
        return out_of_range(c, call,
                            "it takes fstop, focallength and focaldistance, or nothing for a pinhole");
    const bool pinhole = call.f(0) >= 1e30f; // RISpec's infinity, whatever else is said
    if (!pinhole && (!c.finite(call, 3) || !(call.f(0) > 0 && call.f(1) > 0 && call.f(2) > 0)))
        return out_of_range(c, call, "fstop, focallength and focaldistance must be more than 0");
    camera.f_stop = pinhole ? 0 : call.f(0);
    camera.focal_length = pinhole ? 0 : call.f(1);
    camera.focal_distance = pinhole ? 0 : call.f(2);
}

void shutter(Context& c, Call& call) {
    if (!c.finite(call, 2))
        return;
    c.options.options.shutter_open = call.f(0);
    c.options.options.shutter_close = call.f(1);
}

void pixel_variance(Context& c, Call& call) {
    keep(c.options.options.user, "pixelvariance", {call.f(0)});
}

void pixel_samples(Context& c, Call& call) {
    const double samples = call.d(0) * call.d(1);
    if (!(samples > 0 && samples <= 1e6))
        return out_of_range(c, call, "the number of samples must lie between 1 and 1000000");
    c.options.options.samples = std::max(1, int(std::lround(samples)));
}

void pixel_filter(Context& c, Call& call) {
    // "table": the values of Option "pixelfilter", as the C binding writes a function of a program's own.
    constexpr std::string_view known[] = {"box",  "triangle", "gaussian",        "catmull-rom",
                                          "sinc", "mitchell", "blackman-harris", "table"};
    std::string name = call.text(0);
    if (name == "separable-catmull-rom")
        name = "catmull-rom";
    if (!c.finite(call, 3) || !(call.f(1) > 0 && call.f(2) > 0 && call.f(1) <= 64 && call.f(2) <= 64))
        return out_of_range(c, call, "the widths must lie between 0 and 64 pixels");
    if (std::find(std::begin(known), std::end(known), name) == std::end(known)) {
        std::string names;
        for (const std::string_view k : known)
            names += (names.empty() ? "" : ", ") + std::string(k);
        return out_of_range(c, call, "there is no filter \"" + name + "\" (there are " + names + ")");
    }
    c.options.options.filter = name;
    c.options.options.filter_where = call.where;
    c.options.options.filter_width[0] = call.f(1);
    c.options.options.filter_width[1] = call.f(2);
}

void exposure(Context& c, Call& call) {
    if (!c.finite(call, 2) || !(call.f(1) > 0))
        return out_of_range(c, call, "gamma must be more than 0");
    c.options.options.exposure_gain = call.f(0);
    c.options.options.exposure_gamma = call.f(1);
}

void imager(Context& c, Call& call) {
    scene::ShaderRef imager = c.shader(call, 0);
    if (imager.name ==
        "background") // PRMan's and BMRT's names of what no language lets a parameter be called
        for (Value& v : imager.parameters.values)
            if (v.name == "color" || v.name == "background" || v.name == "backgroundcolor")
                v.name = "bgcolor";
    if (c.scope() == InWorld || c.scope() == InObject) // published files have it there, and PRMan takes it
        c.scene().options.imager = imager;
    c.options.options.imager = std::move(imager);
}

void quantize(Context& c, Call& call) {
    keep(c.options.options.user, "quantize:" + call.text(0), {call.f(1), call.f(2), call.f(3), call.f(4)});
}

void display(Context& c, Call& call) {
    scene::Display d;
    d.file = call.text(0);
    d.driver = call.text(1);
    d.mode = call.text(2);
    d.parameters = std::move(call.params);
    d.where = call.where;
    auto& displays = c.options.options.displays;
    if (!d.file.empty() && d.file[0] == '+')
        d.file.erase(0, 1);
    else
        displays.clear();
    if (d.file.empty() && d.driver != "framebuffer")
        c.reports.error("display", call.where,
                        "a Display without a name writes no file; name it, as in Display \"" +
                            std::string(displays.empty() ? "" : "+") + "ids.exr\" \"" + d.driver + "\" \"" +
                            d.mode + "\"");
    displays.push_back(std::move(d));
}

// What a display names by this is an output parameter of shaders, which say themselves what it is.
void display_channel(Context& c, Call& call) {
    scene::ValueList& user = c.options.options.user;
    scene::Value channel;
    channel.name = "displaychannel:" + call.text(0);
    channel.type = scene::Type::String;
    channel.strings = std::vector<std::string>{call.text(0)};
    channel.where = call.where;
    user.set(std::move(channel));
}

// Of the lens and the shutter, under "camera"; RenderMan has some of them under Hider.
static bool camera_option(Context& c, const Value& v) {
    scene::Camera& camera = c.options.camera;
    const auto wrong = [&](const std::string& needs) {
        c.reports.error("camera option", v.where, "\"" + v.name + "\": " + needs + "; it stays as it was");
    };
    const auto set = [&](const char* row, double number) {
        const auto fault = scene::find_camera_parameter(row)->set(camera, {{number}, {}});
        if (fault)
            wrong(fault->substr(std::string_view(row).size() + 2));
        return !fault;
    };
    const bool numbers = !v.floats.empty();
    const float f = numbers ? v.floats[0] : 0;
    if (v.name == "shutteropening") {
        if (const auto fault = scene::fault_of_opening({v.floats.data(), v.floats.size()}); fault || !numbers)
            wrong(fault.value_or("it takes 2 or 10 numbers"));
        else
            c.options.options.shutter_opening.assign(v.floats.begin(), v.floats.end());
    } else if (v.name == "aperture") { // sides, angle; PRMan's roundness and density are not followed
        if (!numbers)
            wrong("it takes the number of blades, 3 to 64 or 0 for round, and an angle in degrees");
        else if (set("blades", f))
            set("blade_rotation", v.floats.size() > 1 ? v.floats[1] : 0);
    } else if (v.name == "dofaspect") { // width over height
        if (numbers && f > 0)
            set("squeeze", 1 / f);
        else
            wrong("it must be more than 0");
    } else {
        return false;
    }
    return true;
}

// What RenderMan says by options since its 22nd version, and by requests before.
static bool ri_option(Context& c, const Value& v) {
    scene::Options& o = c.options.options;
    const auto& f = v.floats;
    if (v.name == "FormatResolution" && v.ints.size() == 2 && v.ints[0] > 0 && v.ints[1] > 0)
        o.width = v.ints[0], o.height = v.ints[1];
    else if (v.name == "FormatPixelAspectRatio" && f.size() == 1 && f[0] > 0)
        o.pixel_aspect = f[0];
    else if (v.name == "CropWindow" && f.size() == 4 && f[0] >= 0 && f[0] < f[1] && f[1] <= 1 && f[2] >= 0 &&
             f[2] < f[3] && f[3] <= 1)
        o.crop = {f[0], f[1], f[2], f[3]};
    else if (v.name == "ScreenWindow" && !f.empty() &&
             !scene::find_camera_parameter("screen_window")->set(c.options.camera, scene::setting_of(v)))
        return true;
    else if (v.name == "FrameAspectRatio" && f.size() == 1 && f[0] > 0)
        c.options.frame_aspect_ratio = f[0];
    else if (v.name == "Shutter" && f.size() == 2 && f[0] <= f[1])
        o.shutter_open = f[0], o.shutter_close = f[1];
    else
        return false;
    return true;
}

void hider(Context& c, Call& call) {
    scene::ValueList& user = c.options.options.user;
    keep_text(user, "hider", call.text(0));
    for (Value& v : call.params.values) {
        if (camera_option(c, v))
            continue;
        v.name = "hider:" + v.name;
        user.set(std::move(v));
    }
}

// The state of the camera as it is now, under a name. Its parameters are those of the state, which stays the
// camera if nobody names another.
void camera(Context& c, Call& call) {
    for (Value v : call.params.values) {
        if (v.name.starts_with("Ri:"))
            v.name = v.name.substr(3);
        scene::Camera& camera = c.options.camera;
        const bool number = v.floats.size() == 1 && std::isfinite(v.floats[0]);
        if (number && v.name == "nearClip" && v.floats[0] < camera.far_clip)
            camera.near_clip = v.floats[0];
        else if (number && v.name == "farClip" && v.floats[0] > camera.near_clip)
            camera.far_clip = v.floats[0];
        else if (!camera_option(c, v) && !ri_option(c, v))
            c.reports.once(
                Severity::Warning, "Camera " + v.name, v.where,
                "Camera: \"" + v.name +
                    "\" has no counterpart and was left out; there are shutteropening, aperture, dofaspect, "
                    "nearClip, farClip and Ri:ScreenWindow, and the requests Projection, Clipping, "
                    "DepthOfField, Shutter before it");
    }
    c.options.cameras[call.text(0)] = {c.options.camera, c.options.frame_aspect_ratio, c.ctm, c.ctm_keys,
                                       c.options.options.shutter_opening};
}

void color_samples(Context& c, Call& call) {
    const auto& n_rgb = call.args[0].floats;
    const size_t n = n_rgb.size() / 3;
    if (n == 0 || n_rgb.size() != 3 * n || call.args[1].floats.size() != 3 * n)
        return out_of_range(c, call, "both arrays must have three numbers a colour component");
    if (!c.finite(call, 2))
        return;
    c.options.rgb_from_samples = n_rgb;
}

void relative_detail(Context& c, Call& call) {
    if (!c.finite(call, 1) || !(call.f(0) >= 0))
        return out_of_range(c, call, "the scale must be 0 or more");
    c.options.relative_detail = call.f(0);
}

// Textures are made before the first lookup; what a made texture is asked for is kept under its name:
// pictures, kind, s_wrap, t_wrap, filter; and the field of view of cube faces, and the filter's widths.
static void keep_making(Context& c, const Call& call, size_t pictures, const char* kind, size_t filter,
                        const std::string& s_wrap, const std::string& t_wrap, float fov) {
    Value v;
    v.name = "maketexture:" + call.text(pictures);
    v.type = scene::Type::String;
    std::vector<std::string> texts;
    for (size_t i = 0; i < pictures; i++)
        texts.push_back(call.text(i));
    const std::string& named = call.text(filter);
    texts.insert(texts.end(), {kind, s_wrap.empty() ? "black" : s_wrap, t_wrap.empty() ? "black" : t_wrap,
                               named.empty() ? "box" : named});
    v.strings = std::move(texts);
    v.floats = std::vector<float>{fov, call.f(filter + 1), call.f(filter + 2)};
    v.where = call.where;
    c.options.options.user.set(std::move(v));
}

void make_texture(Context& c, Call& call) {
    keep_making(c, call, 1, "texture", 4, call.text(2), call.text(3), 90);
}

void make_latlong_environment(Context& c, Call& call) {
    keep_making(c, call, 1, "latlong", 2, "periodic", "clamp", 90);
}

void make_cube_face_environment(Context& c, Call& call) {
    keep_making(c, call, 6, "cube", 8, "periodic", "clamp", call.f(7));
}

// ---- Option -----------------------------------------------------------------------------------------

// Names of spaces, lights and files are looked at when the scene is rendered.
static void declared_option(Context& c, const scene::OptionParameter& row, const std::string& category,
                            const Value& v) {
    scene::Setting value = scene::setting_of(v);
    if (row.kind == scene::Kind::Whole && row.range.most > INT32_MAX) // RIB's integers have a sign
        for (double& x : value.numbers)
            x += x < 0 ? 4294967296.0 : 0;
    if (!row.takes(value)) {
        c.reports.error("Option " + category, v.where,
                        "Option \"" + category + "\": \"" + v.name + "\" must be " + row.expected() +
                            "; it stays as it was");
        return;
    }
    if (category == "color")
        c.options.options.color.where = v.where;
    if (category == "pixelfilter")
        c.options.options.filter_where = v.where;
    row.put(c.options.options, value);
}

static void search_path_option(Context& c, const Value& v) {
    scene::Options& o = c.options.options;
    std::vector<std::string>* path = v.name == "shader"    ? &o.shader_path
                                     : v.name == "texture" ? &o.texture_path
                                     : v.name == "archive" ? &o.archive_path
                                                           : nullptr;
    if (path && !v.strings.empty())
        *path = expand_search_path(v.strings[0], *path, c.default_path, c.stream.folder());
}

void option(Context& c, Call& call) {
    const std::string& category = call.text(0);
    const bool ours = category == "kanuka" || category == "color" || category == "exposure";
    for (Value& v : call.params.values) {
        if ((category == "Ri" && ri_option(c, v)) || (category == "camera" && camera_option(c, v)))
            continue;
        std::string name = category + ":" + v.name;
        if (const scene::OptionParameter* row = scene::find_rib_option(name))
            declared_option(c, *row, category, v);
        else if (ours)
            c.reports.error("Option " + category, v.where,
                            "Option \"" + category + "\": there is no \"" + v.name + "\"; there are " +
                                scene::rib_names_of(scene::option_parameters(), category));
        else if (const auto fault = dialects::option(c.options.options, name, v))
            c.reports.error("Option " + category, v.where,
                            "Option \"" + category + "\": \"" + v.name + "\" " + *fault +
                                "; it stays as it was");
        if (category == "kanuka")
            continue;
        if (category == "searchpath")
            search_path_option(c, v);
        v.name = std::move(name);
        c.options.options.user.set(std::move(v));
    }
}

} // namespace kanuka::ingest::handlers
