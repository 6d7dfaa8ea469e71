#include "ingest/rib/context.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/large_arrays.h"
#include "ingest/rib/handlers.h"
#include "ingest/rib/motion.h"
#include "ingest/rib/primvars.h"

namespace kanuka::ingest {

std::string_view begin_name(BlockKind kind) {
    constexpr std::string_view names[] = {"FrameBegin", "WorldBegin",  "AttributeBegin", "TransformBegin",
                                          "SolidBegin", "ObjectBegin", "MotionBegin"};
    return names[size_t(kind)];
}

Context::Context(Stream& stream, Declarations& declarations, Journal& journal, FrameChoice frame,
                 std::string scene_folder, std::vector<std::string> extra_archive_path)
    : reports(journal), stream(stream), declarations(declarations),
      extra_archive_path(std::move(extra_archive_path)), m_frame_choice(frame) {
    if (!scene_folder.empty() && scene_folder != ".")
        default_path.push_back(std::move(scene_folder));
    default_path.push_back(".");
    options.options.shader_path = options.options.texture_path = options.options.archive_path = default_path;
    options.camera.projection = scene::Camera::Projection::Orthographic; // RISpec's default
    m_scene.journal = &journal;
}

Scope Context::scope() const {
    if (m_open_object >= 0)
        return InObject;
    if (m_in_world)
        return InWorld;
    return m_frame_open ? InFrame : InOuter;
}

// ---- execution --------------------------------------------------------------------------------------

static std::string places(uint8_t scopes) {
    if (!(scopes & (InWorld | InObject)))
        return "it belongs before WorldBegin";
    if (!(scopes & (InOuter | InFrame)))
        return scopes & InWorld ? "it belongs between WorldBegin and WorldEnd" : "it belongs into an object";
    return "it belongs to " + scope_names(scopes);
}

// What stood before the first world, said in one.
void Context::tell_of_outside() {
    if (m_outside > 0)
        reports.error(
            "before the world", m_first_outside.second,
            m_first_outside.first + " is not legal here and was left out: it belongs between WorldBegin " +
                "and WorldEnd" +
                (m_outside > 1 ? ". Requests before the world that were: " + std::to_string(m_outside) : ""));
    m_outside = 0;
}

void Context::execute(Call& call) {
    const RequestSpec& spec = *call.spec;
    const auto name = [&] { return std::string(spec.name); }; // for messages
    const bool in_motion = !m_blocks.empty() && m_blocks.back().kind == BlockKind::Motion;

    // Step 1: is it legal here?
    const bool of_the_world = spec.scopes & (InWorld | InObject) && !(spec.scopes & (InOuter | InFrame));
    if (of_the_world && !(scope() & (InWorld | InObject)) && m_frames_seen.empty() && !of_program &&
        reports.mode != Reports::Mode::Abort) { // of an archive, if no world follows
        if (m_outside++ == 0)
            m_first_outside = {name(), call.where};
        return;
    }
    if (!(spec.scopes & scope())) {
        reports.error("scope of " + name(), call.where,
                      spec.handler == &handlers::world_begin
                          ? "WorldBegin was left out: the world has begun already, at " + m_world_where.str()
                          : name() + " is not legal here and was left out: " + places(spec.scopes));
        return;
    }
    if (in_motion && !(spec.scopes & InMotion)) {
        reports.error("motion block", call.where,
                      name() + " is not legal between MotionBegin and MotionEnd; the block opened at " +
                          m_blocks.back().where.str() +
                          " holds samples of one transformation, colour or primitive, and was closed here");
        end_motion(call.where);
    } else if (in_motion && spec.handler != &handlers::motion_end) {
        // Step 2: samples of a motion block gather.
        if (m_motion.request && m_motion.request != &spec) {
            reports.error("motion block", call.where,
                          name() + " in a motion block of " + std::string(m_motion.request->name) +
                              ": all samples must be of one request; left out");
            return;
        }
        m_motion.request = &spec;
        const int sample = m_motion.calls++;
        if (spec.handler) {
            motion_sample(call);
            return;
        }
        if (sample > 0)
            return;
    }
    // Step 3: do it, or say why not.
    const auto note = [&] { return spec.note.empty() ? "" : ": " + std::string(spec.note); };
    switch (spec.support) {
    case Support::Missing: {
        const bool geometry = !(spec.scopes & InOuter);
        reports.once(geometry ? Severity::Error : Severity::Warning, name(), call.where,
                     name() + " is not supported and was left out" + note());
        return;
    }
    case Support::Needless:
        reports.once(Severity::Info, name(), call.where, name() + " is not needed" + note());
        return;
    case Support::Ignored:
        return;
    default:
        break;
    }
    spec.handler(*this, call);
}

bool Context::finite(const Call& call, size_t arguments) {
    for (size_t i = 0; i < arguments; i++) {
        bool good = std::isfinite(call.args[i].number);
        for (const float f : call.args[i].floats)
            good = good && std::isfinite(f);
        if (!good) {
            reports.error("not finite", call.where,
                          std::string(call.spec->name) + ": \"" + std::string(call.spec->args[i].name) +
                              "\" is not a finite number; the request was left out");
            return false;
        }
    }
    return true;
}

// ---- blocks -----------------------------------------------------------------------------------------

std::vector<AttributeState*> Context::open_states() {
    std::vector<AttributeState*> states{&attributes};
    for (Block& block : m_blocks)
        states.push_back(&block.attributes);
    return states;
}

void Context::open(BlockKind kind, const Location& where) {
    // A block keeps a copy of the state, some 600 bytes: nobody nests so many, and a broken file must not
    // fill the memory.
    constexpr size_t Deepest = 100'000;
    if (m_blocks.size() >= Deepest &&
        (kind == BlockKind::Attribute || kind == BlockKind::Transform || kind == BlockKind::Solid)) {
        reports.once(Severity::Error, "blocks too deep", where,
                     std::string(begin_name(kind)) + " was left out: " + std::to_string(Deepest) +
                         " blocks are open already, nested too deep; look for missing ends");
        return;
    }
    m_blocks.push_back({kind, where, attributes, ctm, ctm_keys, nullptr});
}

void Context::restore(Block& block) {
    if (block.kind == BlockKind::Motion) {
        finish_motion();
        return;
    }
    ctm = block.ctm;
    ctm_keys = std::move(block.ctm_keys);
    if (block.kind != BlockKind::Transform)
        attributes = std::move(block.attributes);
    if (block.options)
        options = std::move(*block.options);
}

bool Context::close(BlockKind kind, const Location& where) {
    // Step 1: find it, but not beyond the object, world or frame that we are in.
    size_t at = m_blocks.size();
    while (at > 0 && m_blocks[at - 1].kind != kind) {
        const BlockKind other = m_blocks[at - 1].kind;
        const bool wall =
            other == BlockKind::Object || other == BlockKind::World || other == BlockKind::Frame;
        if (wall &&
            (kind == BlockKind::Attribute || kind == BlockKind::Transform || kind == BlockKind::Solid ||
             kind == BlockKind::Motion || (kind == BlockKind::Object && other != BlockKind::Object))) {
            at = 0;
            break;
        }
        at--;
    }
    const std::string begin(begin_name(kind));
    if (at == 0) {
        const std::string end = begin.substr(0, begin.size() - 5) + "End";
        reports.error("unmatched " + end, where, end + " without " + begin + " was left out");
        return false;
    }
    // Step 2: what is open inside it ends with it.
    if (m_blocks.size() > at) {
        const size_t within = m_blocks.size() - at - 1;
        reports.error("block not closed", m_blocks[at].where,
                      std::string(begin_name(m_blocks[at].kind)) + " is not closed before the end of " +
                          begin + " at " + where.str() + "; it was closed there" +
                          (within > 0 ? ", with " + std::to_string(within) + " within it" : ""));
    }
    while (m_blocks.size() > at) {
        if (m_blocks.back().kind == BlockKind::Object)
            end_object(where);
        else {
            restore(m_blocks.back());
            m_blocks.pop_back();
        }
    }
    restore(m_blocks.back());
    m_blocks.pop_back();
    return true;
}

// ---- procedurals that wait --------------------------------------------------------------------------

bool Context::may_delay() const {
    return delayed && m_in_world && m_open_object < 0 && attributes.solid < 0 && ctm_keys.empty() &&
           options.options.user.get_int("procedural:ondemand", 1) != 0 &&
           std::ranges::none_of(m_blocks, [](const Block& b) { return b.kind == BlockKind::Motion; });
}

void Context::reopen_world() {
    m_scene = {};
    m_editor.emplace(m_scene, objects.groups_before());
    m_scene.journal = &reports.journal();
    m_in_world = true;
    options = m_world_options; // a frame's end has undone those that it set
    m_lights_before = lights.size();
    open(BlockKind::World, m_world_where);
}

scene::Scene Context::close_world() {
    end_world(m_world_where);
    if (lights.size() > m_lights_before) {
        reports.once(Severity::Warning, "light in a procedural", m_world_where,
                     "a LightSource in a procedural that was read on demand was left out: say Option "
                     "\"procedural\" \"int ondemand\" [0], or declare it outside");
        lights.truncate(m_lights_before);
    }
    m_next_id = objects.finish(m_scene, *m_editor, m_next_id);
    return std::move(m_scene);
}

void Context::begin_delayed(scene::NodeId procedural) {
    m_editor->set_root(procedural);
}

// ---- objects ----------------------------------------------------------------------------------------

void Context::begin_object(const std::string& handle, const Location& where) {
    if (m_open_object >= 0) {
        reports.error("nested object", where,
                      "ObjectBegin inside ObjectBegin: the object before ends here; close it by ObjectEnd");
        end_object(where);
    }
    m_object_outer = ctm;
    open(BlockKind::Object, where);
    m_open_object = objects.begin(handle, where);
    replace({});
    attributes.solid = -1;
    attributes.shared =
        std::make_shared<scene::Attributes>(); // what is not set inside comes from the instance
    attributes.set = 0;
}

void Context::end_object(const Location& where) {
    if (m_open_object < 0)
        return;
    const int object = m_open_object;
    while (!m_blocks.empty() && m_blocks.back().kind != BlockKind::Object) {
        reports.error("block not closed", m_blocks.back().where,
                      std::string(begin_name(m_blocks.back().kind)) + " is not closed before ObjectEnd at " +
                          where.str() + "; it was closed there");
        restore(m_blocks.back());
        m_blocks.pop_back();
    }
    m_open_object = -1;
    restore(m_blocks.back());
    m_blocks.pop_back();
    objects.end(object);
}

void Context::add_light(scene::ShaderRef light) {
    if (m_open_object >= 0)
        objects.record(m_open_object).lights.push_back(std::move(light));
    else
        lights.declare_everywhere(std::move(light), open_states());
}

void Context::add_instance(const Call& call) {
    const int object = objects.find(call.handle(0));
    if (object < 0) {
        reports.error("unknown object", call.where,
                      "ObjectInstance \"" + call.handle(0) +
                          "\": there is no such object; define it by ObjectBegin … ObjectEnd first");
        return;
    }
    if (!attributes.detail_visible || !usable_transform(call))
        return;
    for (scene::ShaderRef light : std::vector(objects.record(object).lights)) {
        scene::transform_shader(ctm, light);
        add_light(std::move(light));
    }
    if (attributes.solid >= 0) {
        if (m_open_object < 0)
            lights.shine(attributes);
        add_to_solid(object, call.where);
        return;
    }
    if (m_open_object >= 0) {
        int& depth = objects.record(m_open_object).depth;
        if (objects.record(object).depth >= Objects::MaxDepth) {
            reports.error("objects too deep", call.where,
                          "ObjectInstance \"" + call.handle(0) + "\" was left out: objects nest " +
                              std::to_string(Objects::MaxDepth) + " levels deep at most");
            return;
        }
        depth = std::max(depth, objects.record(object).depth + 1);
        ObjectRecord::Member member;
        member.object = object;
        member.set = attributes.set;
        member.primitive.world_from_object = ctm;
        member.primitive.attributes = attributes.shared;
        member.primitive.motion = moving_place(ctm_keys);
        objects.record(m_open_object).members.push_back(std::move(member));
        return;
    }
    lights.shine(attributes);
    try {
        objects.instance(m_scene, *m_editor, object, attributes.shared, ctm, ctm_keys);
    } catch (const Error& e) { // an inverse that double precision cannot hold
        reports.error("singular transformation", call.where,
                      "ObjectInstance was left out: " + std::string(e.what()));
    }
}

// ---- primitives -------------------------------------------------------------------------------------

Transform Context::world_from_current() const {
    return m_open_object >= 0 ? m_object_outer * ctm : ctm;
}

Transform Context::camera_from_current() const {
    return m_in_world ? m_camera_from_world * world_from_current() : world_from_current();
}

bool Context::usable_transform(const Call& call) {
    const double det = ctm.determinant3();
    if (std::isfinite(det) && det != 0)
        return true;
    reports.error(
        "singular transformation", call.where,
        std::string(call.spec->name) +
            " was left out: the current transformation flattens it to nothing; look for a Scale by 0");
    return false;
}

scene::ShaderRef Context::shader(Call& call, size_t name_argument) const {
    scene::ShaderRef ref;
    ref.name = call.text(name_argument);
    ref.parameters = std::move(call.params);
    ref.world_from_shader = ctm;
    ref.where = call.where;
    return ref;
}

// One for all primitives in a row that have it.
const Shared<Transform>& Context::shared_ctm() {
    // Bit by bit, zeros have signs. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    if (std::memcmp(&*m_shared_ctm, &ctm, sizeof ctm) != 0)
        m_shared_ctm = ctm;
    return m_shared_ctm;
}

void Context::add_primitive(Call& call, scene::Geometry geometry) {
    const bool in_motion = m_motion.request == call.spec;
    if (in_motion && m_motion.calls > 1) {
        add_shape(call, std::move(geometry));
        return;
    }
    if (!attributes.detail_visible || !usable_transform(call) || !check_primvars(call, geometry, reports))
        return;
    if (m_open_object < 0)
        lights.shine(attributes);
    if (in_motion)
        m_motion.shapes.push_back({m_motion.times[0], geometry, call.params}); // buffers are shared
    int solid = attributes.solid;
    if (solid >= 0 && solids()[size_t(solid)].kind != scene::Solid::Kind::Primitive) {
        // Without a SolidBegin "primitive" of its own it is one.
        solid = add_solid({scene::Solid::Kind::Primitive, solid});
    }
    m_motion.object = m_open_object;
    if (m_open_object >= 0) {
        auto& members = objects.record(m_open_object).members;
        m_motion.index = int(members.size());
        members.push_back(
            {scene::Primitive(std::move(geometry), std::move(call.params), shared_ctm(), attributes.shared,
                              m_next_id++, call.where, moving_place(ctm_keys), solid),
             -1, attributes.set});
        return;
    }
    m_motion.index = int(m_scene.primitives.size());
    auto& all = m_scene.primitives;
    if (all.size() == all.capacity() && all.size() > 1000) {
        // As many as there will be if the file goes on like this: growing step by step moves them all again
        // and again.
        const double expected = double(all.size()) / std::max(stream.progress(), 0.05) * 1.05;
        reserve_large(all, std::max(2 * all.size(), size_t(expected)));
    }
    // With all members given, or the whole of it is cleared first: a fifth of the time of reading it.
    m_editor->emplace(std::move(geometry), std::move(call.params), shared_ctm(), attributes.shared,
                      m_next_id++, call.where, moving_place(ctm_keys), solid, scene::NodeId::None);
}

int Context::add_solid(scene::Solid solid) {
    if (m_open_object >= 0)
        solids().push_back(solid);
    else
        m_editor->add(solid);
    return int(solids().size()) - 1;
}

} // namespace kanuka::ingest
