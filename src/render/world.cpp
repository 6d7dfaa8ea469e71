#include "render/world.h"

#include <algorithm>
#include <malloc.h>

#include "bvh/leftovers.h"
#include "bvh/nesting.h"
#include "scene/digest.h"
#include "store/hierarchy_files.h"

namespace kanuka::render {

namespace {

// A scene that names neither a light nor a surface would be black. RISpec's default surface is lit from the
// eye, so that shapes show. A surface shader that is not found is none.
bool names_no_light(const scene::Scene& scene, const shade::ShadingSystem& shading) {
    const auto plain = [&](const std::vector<scene::Primitive>& primitives) {
        const scene::Attributes* last = nullptr;
        return std::all_of(primitives.begin(), primitives.end(), [&](const scene::Primitive& p) {
            const scene::Attributes* a = p.attributes.get();
            if (!a || a == last)
                return true;
            last = a;
            return !a->area_light && (!a->surface || !shading.knows(*a->surface));
        });
    };
    return scene.lights.empty() && scene.light_shaders.empty() && plain(scene.primitives) &&
           std::all_of(scene.groups.begin(), scene.groups.end(),
                       [&](const scene::Group& g) { return plain(g.primitives); });
}

} // namespace

World::World(Job& job, Kept* kept)
    : m_job(job), m_kept(kept ? kept : &m_own), m_has_keys(kept || !job.store.folder.empty()) {
    place_camera();
}

World::~World() {
    close_store();
    if (reads_ahead())
        m_on_demand->note_read(m_kept->met);
    const bool is_of_one_picture = m_on_demand && !reads_ahead(); // what rays have met
    if (!m_kept->pages.keeps() || is_of_one_picture || !m_bvh || (m_shading && m_shading->has_air()))
        return;
    m_bvh->watch_by(nullptr);
    m_kept->geometry = std::move(m_geometry);
    m_kept->bvh = std::move(m_bvh);
    m_kept->of_bvh = m_of_bvh;
}

void World::close_store() {
    if (m_disk)
        m_disk->close();
}

void World::place_camera() {
    std::vector<std::array<double, 3>> eyes;
    for (const scene::Camera& each : m_job.shot)
        eyes.push_back(eye_of(each, m_job.shutter()));
    const std::array<double, 3> origin = origin_of_shot(eyes, eye_of(m_job.camera, m_job.shutter()));
    m_camera = render::place_camera(m_job.camera, m_job.options, m_job.shutter(), origin);
    m_dice.camera = m_camera.dicing;
    m_dice.camera.shot = poses_of_shot();
    m_dice.shading_rate_scale = m_job.shading_rate;
    m_dice.geometry_tolerance = m_job.options.geometry_tolerance;
    m_dice.normal_tolerance = m_job.options.normal_tolerance;
    m_dice.max_micropolygons = dice::DiceOptions::most_for(m_job.options.width, m_job.options.height,
                                                           m_job.shading_rate * finest_rate());
}

// Every view costs time wherever a rate is asked for. A camera goes smoothly, and eight tell where it comes.
std::vector<Transform> World::poses_of_shot() const {
    constexpr size_t Most = 8;
    const std::vector<scene::Camera>& all = m_job.shot;
    std::vector<Transform> poses;
    const size_t count = std::min(all.size(), Most);
    for (size_t i = 0; i < count; i++) {
        const size_t frame = count > 1 ? i * (all.size() - 1) / (count - 1) : 0;
        const dice::DicingCamera placed =
            render::place_camera(all[frame], m_job.options, m_job.shutter(), m_camera.origin).dicing;
        poses.push_back(placed.page_from_camera);
        poses.insert(poses.end(), placed.also_from.begin(), placed.also_from.end());
    }
    return poses;
}

float World::finest_rate() const {
    float finest = 1;
    const auto look = [&](const std::vector<scene::Primitive>& primitives) {
        for (const scene::Primitive& p : primitives)
            if (p.attributes)
                finest = std::min(finest, p.attributes->shading_rate);
    };
    look(m_job.scene.primitives);
    for (const scene::Group& g : m_job.scene.groups)
        look(g.primitives);
    return finest;
}

void World::prepare_color() {
    const Digest of_color = digest_of(m_job.options.color, m_job.options.texture_path, m_job.scene.file);
    if (m_kept->color.palette && m_kept->of_color == of_color)
        return;
    m_kept->pages.clear();
    m_kept->made_again.begin("options of colour");
    m_kept->color = make_color_setup(m_job.scene, m_job.options, m_job.journal);
    m_kept->of_color = of_color;
}

// The geometry of before stays until the hierarchy is built, which may be the same. Each takes as much again
// to be traced, and pages are kept beside.
void World::drop_what_leaves_no_room() {
    const Geometry* before = m_kept->geometry.get();
    if (!before || before->store.grid_bytes() + before->store.input_bytes() <= m_job.geometry_memory / 8)
        return;
    m_kept->bvh.reset();
    m_kept->geometry.reset();
}

void World::build() {
    build_surfaces();
    build_bvh();
}

void World::build_surfaces() {
    m_kept->made_again.begin();
    prepare_color();
    if (!m_job.oracle.empty())
        m_oracle = DicingOracle::load(m_job.oracle);
    m_kept->pages.set_budget(m_job.page_memory);
    drop_what_leaves_no_room();
    if (!m_job.store.folder.empty()) // what others have stored meanwhile is found
        m_disk = std::make_unique<store::DiskStore>(m_job.store, m_job.journal);
    shade::ShadingOptions so;
    so.palette = m_kept->color.palette.get();
    so.shader_path = m_job.options.shader_path;
    so.texture_path = m_job.options.texture_path;
    so.standard_shaders = m_job.standard_shaders;
    so.lanes = m_job.lanes;
    so.options = &m_job.options, so.camera = &m_job.camera;
    so.render_from_world = m_camera.render_from_world;
    so.camera_from_render = m_camera.camera_from_render;
    so.aovs = m_job.aovs.names();
    m_shading = shade::ShadingSystem::create(so, m_job.scene, m_job.journal, *m_job.stats);
    decide_transport();
    if (m_classic)
        m_shading->light_defaults_from_eye();
    m_linking = std::make_unique<Linking>(m_job.scene, m_job.journal);
    m_clips = clipping_planes(m_job.camera, m_camera);
    m_geometry = build_geometry(request_for(m_job.scene));
    if (m_has_keys)
        m_kept->pages.next();
    if (m_disk)
        m_disk->end_pack();
    if (m_job.delayed) {
        const int megabytes = m_job.options.procedural_memory;
        m_on_demand =
            std::make_unique<OnDemand>(*m_job.delayed, m_camera.render_from_world,
                                       uint64_t(std::max(megabytes, 0)) << 20, m_job.journal, *m_job.stats);
        const auto build = [&](const scene::Scene& part) { return add_part(part); };
        m_on_demand->build_known(resident_bytes(), build);
        if (reads_ahead())
            m_on_demand->build_ahead(m_kept->met, build);
    }
}

void World::decide_transport() {
    if (m_job.may_face && names_no_light(m_job.scene, *m_shading)) {
        m_job.options.integrator = "facing";
        m_job.integrator = transport::IntegratorChoice::parse(m_job.options.integrator);
        m_job.journal.report(
            Severity::Info, m_job.where(),
            "there are neither lights nor surface shaders: shapes are shown as if lit from the "
            "eye (integrator facing)");
    }
    using Transport = scene::Options::Transport;
    m_classic = m_job.options.transport == Transport::Classic;
    if (m_job.options.transport != Transport::Auto || m_job.options.integrator != "path")
        return;
    m_classic = m_shading->all_classic(m_job.scene);
}

GeometryRequest World::request_for(const scene::Scene& scene) {
    GeometryRequest request{scene,
                            *m_shading,
                            *m_kept->color.palette,
                            m_dice,
                            m_camera.render_from_world,
                            m_job.shutter(),
                            m_job.journal,
                            *m_job.stats,
                            *m_job.progress,
                            *m_linking,
                            m_clips,
                            m_job.geometry_memory,
                            m_job.store_window,
                            m_classic};
    request.working_memory = m_job.memory;
    request.memory_budget = m_job.memory_budget.bytes;
    request.oracle = m_oracle ? &*m_oracle : nullptr;
    request.instance_levels = m_oracle ? 0 : m_job.options.instance_levels;
    request.instance_variants = m_job.options.instance_variants;
    request.unique_up_to = uint64_t(m_job.options.unique_up_to);
    if (m_has_keys) {
        const scene::Options& o = m_job.options;
        request.pages = &m_kept->pages;
        request.disk = m_disk.get();
        request.made_again = m_kept->pages.keeps() ? &m_kept->made_again : nullptr;
        request.setting = digest_of(o.shader_path, o.texture_path, o.strict_directions, o.specular,
                                    o.array_room, m_job.aovs.names());
    }
    return request;
}

std::unique_ptr<OracleRecorder> World::recorder() const {
    dice::DiceOptions options = m_dice; // as fine as pictures are, whatever this one is
    options.shading_rate_scale = 1;
    return std::make_unique<OracleRecorder>(m_job.scene, m_camera.render_from_world, options);
}

// ---- the hierarchy

// What follows from the geometry as it is now.
void World::build_bvh() {
    const ScopedTimer timer(m_job.stats->time.bvh_s);
    m_job.progress->update("build", 0);
    const int times = std::max(1, int(m_camera.motion.size() / 12));
    Digester key;
    key(m_geometry->key, m_job.options.watertight, times, m_camera.origin, m_job.pages_from.cells,
        m_job.pages_from.segments, m_job.memory_budget.bytes > 0, m_kept->of_color);
    for (const bvh::Scene::Plane& p : m_clips)
        key(p.point, p.normal);
    // Each edit of a session makes another hierarchy, of all that is in a group: too much to be written.
    const bool is_first = m_kept->of_bvh == Digest();
    m_of_bvh = key.digest();
    if ((!m_on_demand || reads_ahead()) && m_kept->bvh && m_kept->of_bvh == m_of_bvh) {
        m_geometry = std::move(m_kept->geometry);
        m_bvh = std::move(m_kept->bvh);
        m_job.stats->count.hierarchies_kept += 1;
    } else {
        std::shared_ptr<bvh::Leftovers> leftovers;
        if (m_kept->pages.keeps() && !m_on_demand)
            leftovers = m_kept->bvh ? m_kept->bvh->leave() : std::make_shared<bvh::Leftovers>();
        m_kept->bvh.reset();
        m_kept->geometry.reset();
        bound_nesting();
        number_emitters();
        m_bvh.reset();
        std::optional<store::HierarchyFiles> files;
        if (m_disk && !m_on_demand) // what rays have met is another world every time
            files.emplace(*m_disk, store::HierarchyFiles::How{.writes = is_first});
        m_bvh = std::make_unique<bvh::Scene>(
            m_geometry->store, m_geometry->groups,
            bvh::Scene::Build{.compact = m_job.stats->count.traced_polygons > 1000000,
                              .watertight = m_job.options.watertight,
                              .cancelled = m_job.progress->cancelled,
                              .pages_from = m_job.pages_from,
                              .files = files ? &*files : nullptr,
                              .leftovers = std::move(leftovers)});
        m_bvh->clip(m_clips, times);
        // What grids lay in while they were shaded is free by now, and the heap would keep it as long as rays
        // are traced. The next edit would only have to ask for it again.
        if (is_first)
            malloc_trim(0);
        m_job.stats->bytes.hierarchy_built = m_bvh->page_bytes().built;
        m_job.stats->bytes.hierarchy_stored = m_bvh->page_bytes().stored;
    }
    m_bvh->watch_by(m_on_demand ? m_on_demand->watch() : nullptr);
    m_job.stats->bytes.bvh = m_bvh->bytes();
    m_job.progress->update("build", 1);
}

void World::bound_nesting() {
    const bvh::Nesting n = bvh::bound_nesting(m_geometry->store, m_geometry->groups, m_geometry->transforms);
    const auto say = [&](uint64_t count, Severity severity, const std::string& why) {
        if (count > 0)
            m_job.journal.report(severity, m_job.where(), std::to_string(count) + " instances " + why);
    };
    say(n.merged, Severity::Info, "lie exactly where others of the same group do and are shown as one");
    say(n.left_out, Severity::Warning,
        "are left out: they lie in each other, and at one spot a ray would have to enter more than " +
            std::to_string(int(bvh::MostEntered)) + " of them; fewer levels of groups in groups would do");
    say(n.too_deep, Severity::Warning,
        "are left out: they lie more groups deep in each other than rays follow (16)");
}

// Emitting triangles in instances are sampled, place by place, as long as there are not too many.
void World::number_emitters() {
    constexpr int Most = 1 << 23; // a hierarchy of about half a gigabyte
    const uint64_t without = bvh::number_emitters(m_geometry->store, m_geometry->groups, Most);
    if (without > 0)
        m_job.journal.warning(m_job.where(), std::to_string(without) +
                                                 " emitting triangles in instances are more than are sampled "
                                                 "(2^23): they are found by chance, with more noise");
}

Bounds3f World::bounds() const {
    Bounds3f b = m_bvh->bounds();
    if (m_on_demand)
        b.extend(m_on_demand->bounds());
    if (b.empty())
        return b;
    const Vec3f origin{float(m_camera.origin[0]), float(m_camera.origin[1]), float(m_camera.origin[2])};
    return {b.lo + origin, b.hi + origin};
}

// ---- procedurals that rays have met

uint64_t World::resident_bytes() const {
    return m_geometry->store.grid_bytes() + m_geometry->store.input_bytes();
}

uint64_t World::add_part(const scene::Scene& part) {
    m_linking->add(part, m_job.journal);
    GeometryRequest request = request_for(part);
    request.oracle = nullptr; // ids of what rays have met go by the order in which they did
    request.unique_up_to = 0; // which would be of each part
    extend_geometry(request, *m_geometry);
    return resident_bytes();
}

bool World::extend() {
    if (!m_on_demand || !m_on_demand->read_met([&](const scene::Scene& part) { return add_part(part); }))
        return false;
    build_bvh();
    return true;
}

} // namespace kanuka::render
