// Frames and worlds: which of them makes the scene, and what the scene takes from the state.

#include <algorithm>
#include <cmath>

#include "ingest/rib/context.h"
#include "ingest/rib/on_demand.h"
#include "ingest/rib/rib.h"
#include "scene/place_shaders.h"

namespace kanuka::ingest {

// A shadow-map pass: pictures of depth for a renderer that cannot trace shadows.
bool Context::writes_depth_only() const {
    const auto& displays = options.options.displays;
    return !displays.empty() && std::ranges::all_of(displays, [](const scene::Display& d) {
        return d.driver == "zfile" || d.driver == "shadow" || d.driver == "deepshad" || d.mode == "z" ||
               d.mode == "deepopacity";
    });
}

// A pass whose pictures a texture is made of, further on.
bool Context::writes_sources() const {
    const auto& displays = options.options.displays;
    return m_frame_choice.sources && !displays.empty() &&
           std::ranges::all_of(
               displays, [&](const scene::Display& d) { return m_frame_choice.sources->contains(d.file); });
}

// Of several frames of one number the one that is asked for? The last of m_frames_seen is this one.
bool Context::is_asked_for(int number) const {
    return m_frame_choice.frame == number && repeats() == m_frame_choice.repeat;
}

// How many frames of the last one's number came before it.
int Context::repeats() const {
    return int(std::ranges::count(m_frames_seen, m_frames_seen.back())) - 1;
}

void Context::begin_frame(int number, const Location& where) {
    open(BlockKind::Frame, where);
    m_blocks.back().options = std::make_unique<OptionState>(options);
    m_frame_open = true;
    m_frames_seen.push_back(number);
    m_frame_lights = lights.size();
    m_frame_chosen =
        !m_world_done && (m_frame_choice.frame == 0 || is_asked_for(number) || m_frame_choice.list);
    if (!m_frame_chosen)
        stream.skip_to("FrameBegin", {"FrameEnd"});
}

void Context::end_frame(const Location& where) {
    if (m_frame_open && m_in_world) {
        reports.error("block not closed", m_world_where,
                      "WorldBegin is not closed before FrameEnd at " + where.str() + "; it was closed there");
        end_world(where);
    }
    if (!close(BlockKind::Frame, where))
        return;
    m_frame_open = false;
    if (m_world_done)
        stream.stop(); // the frames after it are not read
    else
        lights.truncate(m_frame_lights);
}

// A display that names a camera has its state in place of the current one.
void Context::choose_camera(const Location& where) {
    const auto& displays = options.options.displays;
    std::string name = options.options.user.get_string("hider:camera", "");
    if (!displays.empty())
        name = displays[0].parameters.get_string("camera", name);
    for (const scene::Display& d : displays)
        if (d.parameters.get_string("camera", name) != name)
            reports.warning("further camera", where,
                            "the display \"" + d.file + "\" names the camera \"" +
                                d.parameters.get_string("camera", "") +
                                "\", but the first display has another: one camera makes all layers of a "
                                "picture. Render the scene once more with that display first");
    if (name.empty())
        return;
    const auto known = options.cameras.find(name);
    if (known == options.cameras.end()) {
        std::string names;
        for (const auto& [have, camera] : options.cameras)
            names += (names.empty() ? "" : ", ") + have;
        reports.error("unknown camera", where,
                      "there is no Camera \"" + name + "\", which a display names; " +
                          (names.empty() ? "there are none" : "there are " + names) +
                          ". The state at WorldBegin is the camera");
        return;
    }
    const NamedCamera& chosen = known->second;
    options.camera = chosen.camera;
    options.frame_aspect_ratio = chosen.frame_aspect_ratio;
    options.options.shutter_opening = chosen.shutter_opening;
    ctm = chosen.camera_from_world;
    ctm_keys = chosen.keys;
}

// Is this the world to be rendered? `number` is that of its frame, or its own among those outside of frames.
bool Context::takes_world(int number, const Location& where) {
    bool take =
        !m_world_done && (m_frame_open ? m_frame_chosen : m_frame_choice.frame == 0 || is_asked_for(number));
    if (m_world_done)
        reports.once(Severity::Info, "further world", where,
                     "a further WorldBegin: one world is rendered at a time; ask for frame " +
                         std::to_string(number) + " to get this one");
    const bool makes_picture = !writes_depth_only() && !writes_sources();
    if (take && m_frame_choice.frame == 0 && !m_frame_choice.take_depth_pass && !makes_picture) {
        take = false;
        m_depth_passes.push_back({number, where});
    }
    if (std::vector<RibFrame>* list = m_frame_choice.list) {
        take = false;
        const int repeat = repeats();
        if (list->empty() || list->back().number != number ||
            list->back().repeat != repeat) // not its second world
            list->push_back({number, where, makes_picture, writes_sources(), repeat});
    }
    return take;
}

// The camera is where the transformations before the world put it. Gives the world from there.
Transform Context::set_camera(const Location& where) {
    m_camera_from_world = ctm;
    Transform world_from_camera;
    try {
        world_from_camera = ctm.inverse();
    } catch (const Error&) {
        reports.error("camera", where,
                      "the camera's transformation cannot be inverted; look for a Scale by 0 before "
                      "WorldBegin. The identity was used instead");
        m_camera_from_world = {};
        ctm_keys.clear();
    }
    const bool usable = std::ranges::all_of(ctm_keys, [](const TransformKey& k) {
        const double det = k.transform.determinant3();
        return std::isfinite(det) && det != 0;
    });
    if (!usable)
        reports.error("camera", where,
                      "the moving camera's transformation cannot be inverted at all times; it stands still");
    m_scene.options = options.options;
    if (writes_depth_only() && m_scene.options.integrator == "path") {
        m_scene.options.integrator = "facing";
        reports.info("depth alone", where,
                     "the displays ask for depth alone: shapes are shown as if lit from the eye (integrator "
                     "facing) beside it");
    }
    m_scene.camera = options.camera;
    m_scene.camera.camera_from_world = m_camera_from_world;
    if (usable)
        m_scene.camera.motion = ctm_keys;
    if (options.frame_aspect_ratio && !m_scene.camera.screen_window) {
        const float f = *options.frame_aspect_ratio; // RISpec 4.1.1: the shorter side runs from -1 to 1
        m_scene.camera.screen_window =
            f >= 1 ? std::array<float, 4>{-f, f, -1, 1} : std::array<float, 4>{-1, 1, -1 / f, 1 / f};
    }
    return world_from_camera;
}

void Context::begin_world(const Location& where) {
    tell_of_outside();
    const bool in_frame = m_frame_open;
    const int number = in_frame ? m_frames_seen.back() : ++m_loose_worlds;
    if (!in_frame)
        m_frames_seen.push_back(number);
    const bool take = takes_world(number, where);
    open(BlockKind::World, where);
    m_blocks.back().options = std::make_unique<OptionState>(options);
    m_in_world = true;
    m_world_where = where;
    if (!take) {
        stream.skip_to("WorldBegin", {"WorldEnd"});
        return;
    }
    m_world_done = true;
    m_world_in_frame = in_frame;
    Transform world_from_here;
    try {
        world_from_here = ctm.inverse();
    } catch (const Error&) {
        // reported by set_camera(), or of no matter
    }
    choose_camera(where);
    mend_means();
    const Transform world_from_camera = set_camera(where);
    m_world_options = options;
    if (m_frame_choice.camera_only)
        stream.stop();
    // What was declared in camera space so far gets its place in the world.
    replace({});
    lights.place(world_from_here);
    for (auto& [name, transform] : coordinate_systems)
        transform = world_from_here * transform;
    place_shaders(world_from_here, attributes.edit(0));
    if (m_scene.options.imager)
        m_scene.options.imager->world_from_shader =
            world_from_here * m_scene.options.imager->world_from_shader;
    coordinate_systems["world"] = {};
    coordinate_systems["camera"] = world_from_camera;
}

void Context::end_world(const Location& where) {
    if (m_open_object >= 0) {
        reports.error("block not closed", where,
                      "WorldEnd inside an object: ObjectEnd is missing; it was closed here");
        end_object(where);
    }
    if (!close(BlockKind::World, where))
        return;
    m_in_world = false;
}

void Context::finish(const Location& end) {
    while (!m_blocks.empty()) {
        const Block& block = m_blocks.back();
        const std::string begin(begin_name(block.kind));
        const std::string block_end = begin.substr(0, begin.size() - 5) + "End";
        reports.error("file ends early", block.where,
                      begin + " is not closed at the end of the file; " + block_end + " was added there");
        switch (block.kind) {
        case BlockKind::Object:
            end_object(end);
            break;
        case BlockKind::World:
            end_world(end);
            break;
        default:
            close(block.kind, end);
        }
    }
    if (!conditions.empty())
        reports.error("file ends early", end, "IfBegin is not closed at the end of the file; add IfEnd");
    for (const auto& [number, where] : m_depth_passes)
        if (m_world_done)
            reports.info("depth pass", where,
                         "frame " + std::to_string(number) +
                             " writes what shadow maps or textures are made of and was passed over: ask for "
                             "the frame by its "
                             "number to render it");
    complete();
}

// What the scene takes when its world is whole.
void Context::complete() {
    using Transport = scene::Options::Transport;
    if (traces_light && m_scene.options.transport == Transport::Auto)
        m_scene.options.transport = Transport::Full;
    for (scene::ShaderRef& light : lights.finish(reports))
        m_editor->add(std::move(light));
    m_next_id = objects.finish(m_scene, *m_editor, m_next_id);
    if (const auto& repeat = m_editor->repeat())
        reports.once(Severity::Info, "name that is given twice", repeat->where, repeat->message());
    m_scene.coordinate_systems = coordinate_systems;
    if (m_world_done && m_scene.primitives.empty() && m_scene.instances.empty() &&
        (!delayed || delayed->bounds().empty()))
        reports.warning("empty world", m_world_where,
                        "the world has no primitives: the picture will be empty");
}

std::optional<scene::Scene> Context::take_world() {
    if (!m_world_done || m_in_world)
        return std::nullopt;
    complete();
    scene::Scene scene = std::move(m_scene);
    m_scene = {};
    m_editor.emplace(m_scene);
    m_scene.journal = scene.journal;
    m_world_done = false;
    m_next_id = 1;
    objects.forget_groups();
    lights.forget_primitives();
    return scene;
}

} // namespace kanuka::ingest
