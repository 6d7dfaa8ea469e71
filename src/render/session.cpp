#include "render/session.h"

#include <algorithm>
#include <climits>
#include <mutex>
#include <numeric>
#include <sys/resource.h>

#include "base/cancel.h"
#include "base/tasks.h"
#include "bvh/nesting.h"
#include "render/accumulator.h"
#include "render/air.h"
#include "render/aovs.h"
#include "render/budget.h"
#include "render/color_setup.h"
#include "render/develop.h"
#include "render/fireflies.h"
#include "render/geometry.h"
#include "render/light_pictures.h"
#include "render/on_demand.h"
#include "render/pixel_filter.h"
#include "scene/shutter.h"
#include "shade/lights.h"
#include "transport/kernel.h"
#include "transport/scene_data.h"

#ifndef KANUKA_VERSION
#define KANUKA_VERSION "unknown"
#endif

namespace kanuka::render {

namespace {

using Clock = std::chrono::steady_clock;
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

class BatchSession {
  public:
    BatchSession(const scene::Scene& scene, const Overrides& o, Journal& journal, Stats& stats,
                 const Progress& progress)
        : m_scene(scene), m_journal(journal), m_stats(stats), m_progress(progress), m_lanes(o.lanes),
          m_standard_shaders(o.standard_shaders), m_delayed(o.delayed),
          m_memory(o.memory ? *o.memory : machine_memory()), m_options(scene.options),
          m_taken_by(o.camera.value_or(scene.camera)) {
        m_may_face = !o.options.has("integrator") && m_options.integrator == "path" &&
                     !m_scene.file.empty() && !m_delayed;
        o.options.apply(m_options);
        if (m_options.width < 1 || m_options.height < 1 ||
            int64_t(m_options.width) * m_options.height > (int64_t(1) << 30))
            throw Error("the resolution must be at least 1x1 and at most 2^30 pixels", ExitCode::Usage);
        m_shading_rate = o.shading_rate.value_or(1.0f);
        m_progressions = m_options.samples;
        m_integrator = transport::IntegratorChoice::parse(m_options.integrator);
        m_aovs.ask(m_options.displays, o.aovs);
        m_window = crop_window(m_options.crop, m_options.width, m_options.height);
    }

    Result run() {
        m_start = Clock::now();
        refuse_what_cannot_fit(m_window, m_aovs.names().size(), m_memory);
        place_camera();
        Result result;
        if (!tasks::unless_cancelled(m_progress.cancelled, [&] { build(); })) {
            result.cancelled = true;
            return result;
        }
        trace();
        const ScopedTimer timer(m_stats.time.film_s);
        result.picture = finish();
        result.cancelled = m_progress.cancelled();
        if (!result.cancelled)
            tell_of_darkness(result.picture);
        return result;
    }

    void close_statistics() {
        m_stats.time.total_s += std::chrono::duration<double>(Clock::now() - m_start).count();
        rusage usage;
        getrusage(RUSAGE_SELF, &usage);
        m_stats.bytes.peak_rss = uint64_t(usage.ru_maxrss) * 1024;
    }

  private:
    void place_camera() {
        m_camera = render::place_camera(m_taken_by, m_options, shutter());
        m_dice.camera = m_camera.dicing;
        m_dice.shading_rate_scale = m_shading_rate;
        m_dice.geometry_tolerance = m_options.geometry_tolerance;
        m_dice.normal_tolerance = m_options.normal_tolerance;
        m_dice.max_micropolygons =
            dice::DiceOptions::most_for(m_options.width, m_options.height, m_shading_rate * finest_rate());
    }
    float finest_rate() const {
        float finest = 1;
        const auto look = [&](const std::vector<scene::Primitive>& primitives) {
            for (const scene::Primitive& p : primitives)
                if (p.attributes)
                    finest = std::min(finest, p.attributes->shading_rate);
        };
        look(m_scene.primitives);
        for (const scene::Group& g : m_scene.groups)
            look(g.primitives);
        return finest;
    }
    Shutter shutter() const { return {double(m_options.shutter_open), double(m_options.shutter_close)}; }

    void build() {
        m_color = make_color_setup(m_scene, m_options, m_journal);
        shade::ShadingOptions so;
        so.palette = m_color.palette.get();
        so.shader_path = m_options.shader_path;
        so.texture_path = m_options.texture_path;
        so.standard_shaders = m_standard_shaders;
        so.lanes = m_lanes;
        so.options = &m_options, so.camera = &m_taken_by;
        so.render_from_world = m_camera.render_from_world;
        so.camera_from_render = m_camera.camera_from_render;
        so.aovs = m_aovs.names();
        m_shading = shade::ShadingSystem::create(so, m_scene, m_journal, m_stats);
        decide_transport();
        if (m_classic)
            m_shading->light_defaults_from_eye();
        m_linking = std::make_unique<Linking>(m_scene, m_journal);
        m_clips = clipping_planes(m_taken_by, m_camera);
        m_geometry = build_geometry(request_for(m_scene));
        if (m_delayed) {
            const int megabytes = m_options.procedural_memory;
            m_on_demand =
                std::make_unique<OnDemand>(*m_delayed, m_camera.render_from_world,
                                           uint64_t(std::max(megabytes, 0)) << 20, m_journal, m_stats);
            m_on_demand->build_known(resident_bytes(),
                                     [&](const scene::Scene& part) { return add_part(part); });
        }
        build_bvh();
        Journal unheard; // what is not read yet may have them
        m_aovs.find(m_geometry->store.programs(), m_scene.file, m_on_demand ? unheard : m_journal);
        transport::SceneInputs& in = m_inputs;
        in.lights = m_scene.lights;
        for (scene::Light& l : in.lights)
            m_shading->find_files(l);
        std::vector<scene::ShaderRef> light_shaders = m_scene.light_shaders;
        for (scene::ShaderRef& ref : light_shaders)
            if (!m_classic && !ref.shadows)
                ref.shadows = true;
        for (scene::Light& l : m_shading->lights(light_shaders, world_bounds()))
            in.lights.push_back(std::move(l));
        for (scene::Light& l : in.lights)
            shade::resolve_light_color(l, *m_color.palette, m_color.folders, m_journal);
        m_linking->apply(in.lights);
        in.palette = m_color.palette.get();
        in.sensor = &m_color.sensor;
        load_environment(in, m_color.palette->space(), m_journal);
        load_tables(in, m_journal);
        in.render_from_world = m_camera.render_from_world;
        in.camera = m_camera.view;
        in.camera.motion = m_camera.motion;
        if (const auto fault = scene::fault_of_opening(m_options.shutter_opening))
            m_journal.warning({m_scene.file}, "the shutter's opening is not used: " + *fault);
        else
            m_shutter_quantiles = scene::shutter_quantiles(m_options.shutter_opening);
        in.camera.shutter_quantiles = m_shutter_quantiles;
        m_filter = make_filter(m_options, {m_scene.file}, m_journal);
        const film::Filter::Cells& cells = m_filter->cells();
        transport::FilterView& filter = in.camera.filter;
        filter.cells = {cells.nx,
                        cells.ny,
                        cells.rows.data(),
                        cells.cells.data(),
                        cells.weight.data(),
                        {cells.width[0], cells.width[1]}};
        filter.x = m_filter->table_x();
        filter.y = m_filter->table_y();
        if (m_filter->has_weights()) {
            filter.signs_x = m_filter->weight_x();
            filter.signs_y = m_filter->weight_y();
        }
        in.integrator = m_integrator;
        in.clamp_direct = m_options.clamp_direct;
        in.clamp_indirect = m_options.clamp_indirect;
        in.max_depth = m_options.max_depth;
        in.volume_depth = m_options.volume_depth;
        in.interreflection = !m_classic;
        in.seed = m_options.seed;
        make_view();
        m_shading->check_air(m_bvh->bounds());
    }

    // A black picture is a surprise: the likeliest reason, for who looks at nothing.
    void tell_of_darkness(const film::Picture& picture) {
        const auto dark = [&](std::initializer_list<const char*> names) {
            return std::ranges::all_of(names, [&](const char* name) {
                const film::Picture::Channel* channel = picture.find(name);
                return !channel || std::ranges::all_of(channel->data, [](float v) { return v == 0; });
            });
        };
        if (!dark({"R", "G", "B"}))
            return;
        const std::string why =
            dark({"A"}) ? "the camera sees nothing; look at its place, its clipping planes and what "
                          "messages say is missing"
            : m_inputs.lights.empty()
                ? "no light shines; add one, or look at shapes by the integrator facing"
                : "no light reaches what the camera sees; look at the lights' places, or at "
                  "shapes by the integrator facing";
        m_journal.warning(Location{m_scene.file}, "the picture is black: " + why);
    }

    void decide_transport() {
        if (m_may_face && names_no_light(m_scene, *m_shading)) {
            m_options.integrator = "facing";
            m_integrator = transport::IntegratorChoice::parse(m_options.integrator);
            m_journal.report(
                Severity::Info, Location{m_scene.file},
                "there are neither lights nor surface shaders: shapes are shown as if lit from the "
                "eye (integrator facing)");
        }
        using Transport = scene::Options::Transport;
        m_classic = m_options.transport == Transport::Classic;
        if (m_options.transport != Transport::Auto || m_options.integrator != "path")
            return;
        m_classic = m_shading->all_classic(m_scene);
    }

    GeometryRequest request_for(const scene::Scene& scene) {
        return {scene,     *m_shading, *m_color.palette, m_dice,     m_camera.render_from_world,
                shutter(), m_journal,  m_stats,          m_progress, *m_linking,
                m_clips,   m_memory,   m_classic};
    }

    // What follows from the geometry as it is now.
    void build_bvh() {
        const ScopedTimer timer(m_stats.time.bvh_s);
        m_progress.update("build", 0);
        bound_nesting();
        number_emitters();
        m_bvh.reset();
        m_bvh =
            std::make_unique<bvh::Scene>(m_geometry->store, m_geometry->groups,
                                         bvh::Scene::Build{.compact = m_stats.count.traced_polygons > 1000000,
                                                           .watertight = m_options.watertight,
                                                           .cancelled = m_progress.cancelled});
        m_bvh->clip(m_clips, std::max(1, int(m_camera.motion.size() / 12)));
        m_bvh->watch_by(m_on_demand ? m_on_demand->watch() : nullptr);
        m_stats.bytes.bvh = m_bvh->bytes();
        m_progress.update("build", 1);
    }
    void make_view() {
        place_lamps();
        m_inputs.aov_is_color = m_aovs.is_color();
        m_inputs.store = &m_geometry->store;
        m_inputs.bvh = m_bvh.get();
        m_inputs.groups = m_geometry->groups;
        m_inputs.instanced = m_geometry->instanced;
        m_inputs.moving = m_geometry->moving;
        m_kernels.clear();
        m_data = transport::SceneData(m_inputs, m_journal);
        if (m_shading->has_air() && !m_data.view.media.airs.empty())
            m_air = make_air(*m_shading, *m_bvh, m_linked_lamps, m_data.view, m_inputs.lights);
        m_data.view.media.air = m_air.get();
        m_stats.bytes.textures = m_shading->texture_bytes();
    }

    // Lights that shaders are told of, for what is in their way.
    void place_lamps() {
        m_air.reset();
        m_inputs.point_lights.clear();
        const auto lit = [](const grid::LayeringProgram& p) { return !p.lit_by.empty(); };
        if (m_shading->has_air() || std::ranges::any_of(m_geometry->store.programs(), lit)) {
            std::vector<scene::Light> lights;
            const std::vector<shade::Lamp> lamps = m_shading->lamps();
            for (const shade::Lamp& lamp : lamps)
                lights.push_back(lamp.light);
            m_linking->apply(lights);
            for (size_t i = 0; i < lamps.size(); i++)
                m_inputs.point_lights.push_back({lamps[i].far
                                                     ? m_camera.render_from_world.vector(lamps[i].place)
                                                     : m_camera.render_from_world.point(lamps[i].place),
                                                 lamps[i].far, lights[i].passes});
            m_linked_lamps = std::move(lights);
        }
    }

    // ---- procedurals that rays have met
    uint64_t resident_bytes() const {
        return m_geometry->store.grid_bytes() + m_geometry->store.input_bytes();
    }
    uint64_t add_part(const scene::Scene& part) {
        m_linking->add(part, m_journal);
        extend_geometry(request_for(part), *m_geometry);
        return resident_bytes();
    }
    // True: there is more to be traced now.
    bool read_what_was_met() {
        if (!m_on_demand || !m_on_demand->read_met([&](const scene::Scene& part) { return add_part(part); }))
            return false;
        build_bvh();
        Journal unheard;
        m_aovs.find(m_geometry->store.programs(), m_scene.file, unheard);
        make_view();
        return true;
    }

    void bound_nesting() {
        const bvh::Nesting n =
            bvh::bound_nesting(m_geometry->store, m_geometry->groups, m_geometry->transforms);
        const auto say = [&](uint64_t count, Severity severity, const std::string& why) {
            if (count > 0)
                m_journal.report(severity, {m_scene.file}, std::to_string(count) + " instances " + why);
        };
        say(n.merged, Severity::Info, "lie exactly where others of the same group do and are shown as one");
        say(n.left_out, Severity::Warning,
            "are left out: they lie in each other, and at one spot a ray would have to enter more than " +
                std::to_string(int(bvh::MostEntered)) +
                " of them; fewer levels of groups in groups would do");
        say(n.too_deep, Severity::Warning,
            "are left out: they lie more groups deep in each other than rays follow (16)");
    }

    // Emitting triangles in instances are asked for light, place by place, as long as there are not too many.
    void number_emitters() {
        constexpr int Most = 1 << 23; // a hierarchy of about half a gigabyte
        const uint64_t without = bvh::number_emitters(m_geometry->store, m_geometry->groups, Most);
        if (without > 0)
            m_journal.warning(
                {m_scene.file},
                std::to_string(without) +
                    " emitting triangles in instances are more than light is asked from (2^23): "
                    "they are found by chance, with more noise");
    }

    Bounds3f world_bounds() const {
        Bounds3f b = m_bvh->bounds();
        if (m_on_demand)
            b.extend(m_on_demand->bounds());
        if (b.empty())
            return b;
        const Vec3f eye{float(m_camera.eye[0]), float(m_camera.eye[1]), float(m_camera.eye[2])};
        return {b.lo + eye, b.hi + eye};
    }

    void trace() {
        m_gathered = Accumulator(m_window, m_data.view.settings.aov_is_color.size());
        const ScopedTimer timer(m_stats.time.transport_s);
        const uint64_t work = m_gathered.buckets() * uint64_t(m_progressions);
        std::atomic<uint64_t> finished{0};
        // The first pass shows a whole picture; later ones stay with a bucket longer, for the caches' sake.
        int from = 0;
        while (from < m_progressions && !m_progress.cancelled()) {
            const int to = std::min(m_progressions, from == 0 ? 1 : from + 8);
            // Buckets whose paths have met procedurals that are not read are done again when they are.
            std::vector<size_t> todo(m_gathered.buckets());
            std::iota(todo.begin(), todo.end(), size_t(0));
            std::vector<uint8_t> again(todo.size());
            const auto trace_bucket = [&](size_t index) {
                const size_t bucket = todo[index];
                if (m_progress.cancelled())
                    return;
                const bvh::Watch* const watch = m_on_demand ? m_on_demand->watch() : nullptr;
                const uint64_t met = watch ? watch->noted_here() : 0;
                const Accumulator::Sums before = watch ? m_gathered.take(bucket) : Accumulator::Sums();
                std::unique_ptr<transport::Kernel> kernel = take_kernel();
                transport::BatchCounts counts;
                transport::BatchRequest r = m_gathered.request(bucket);
                int done = from;
                for (; done < to && (done == from || !m_progress.cancelled()); done++) {
                    r.progression = uint32_t(done);
                    kernel->trace(r, counts);
                }
                give_kernel(std::move(kernel));
                if (watch && watch->noted_here() != met) {
                    m_gathered.put(bucket, before);
                    m_stats.count.rays += counts.rays;
                    again[bucket] = 1;
                    return;
                }
                m_gathered.set_done(bucket, done);
                count(counts);
                const uint64_t n = finished += uint64_t(done - from);
                const std::lock_guard lock(m_mutex);
                m_progress.update("progressions", double(n) / double(work));
            };
            for (;;) {
                tasks::parallel_for(todo.size(), trace_bucket);
                bool more = false;
                if (m_on_demand && !m_progress.cancelled())
                    tasks::unless_cancelled(m_progress.cancelled, [&] { more = read_what_was_met(); });
                if (!more)
                    break;
                std::erase_if(todo, [&](size_t bucket) { return again[bucket] == 0; });
                std::fill(again.begin(), again.end(), uint8_t(0));
            }
            if (from == 0)
                m_stats.time.first_pixel_s =
                    m_stats.time.ingest_s + std::chrono::duration<double>(Clock::now() - m_start).count();
            from = to;
        }
        if (m_on_demand) {
            m_on_demand->report({m_scene.file});
            m_aovs.find(m_geometry->store.programs(), m_scene.file, m_journal);
        }
        if (const uint64_t bad = m_stats.count.nan_samples)
            m_journal.warning(
                {m_scene.file},
                std::to_string(bad) + " samples that were not finite have been dropped, the first at pixel " +
                    std::to_string(m_first_nan.second) + ", " + std::to_string(m_first_nan.first));
        if (m_stats.count.fireflies > 0 && m_bvh) // which a cancelled render may have lost
            m_stats.fireflies = explain_fireflies(m_fireflies, *take_kernel(), m_data.view, m_scene);
    }

    std::unique_ptr<transport::Kernel> take_kernel() {
        {
            const std::lock_guard lock(m_mutex);
            if (!m_kernels.empty()) {
                auto k = std::move(m_kernels.back());
                m_kernels.pop_back();
                return k;
            }
        }
        return transport::make_kernel(m_data.view, m_lanes);
    }
    void give_kernel(std::unique_ptr<transport::Kernel> kernel) {
        const std::lock_guard lock(m_mutex);
        m_kernels.push_back(std::move(kernel));
    }

    void count(const transport::BatchCounts& c) {
        m_stats.count.paths += c.paths;
        m_stats.count.rays += c.rays;
        m_stats.count.nan_samples += c.nan_samples;
        m_stats.count.fireflies += c.fireflies;
        if (c.fireflies > 0) {
            const std::lock_guard lock(m_mutex);
            for (const transport::Firefly& f : c.worst)
                if (f.x >= 0)
                    m_fireflies.note(f);
        }
        if (c.nan_samples > 0) {
            const std::lock_guard lock(m_mutex);
            m_first_nan = std::min(m_first_nan, std::pair(c.nan_y, c.nan_x));
        }
    }

    film::Picture finish() {
        film::Picture picture =
            develop(m_gathered, m_options, m_camera, m_color, m_aovs, m_data.view.camera.filter.weighted());
        if (m_options.imager) {
            const auto channel = [&](size_t c) { return std::span<float>(picture.channels[c].data); };
            m_shading->image(*m_options.imager,
                             {picture.width, picture.height, picture.x0, picture.y0, m_options.width,
                              m_options.height, channel(0), channel(1), channel(2), channel(3)});
        }
        picture.metadata = {{"kanuka.version", KANUKA_VERSION},
                            {"kanuka.transport", m_classic ? "classic" : "full"},
                            {"kanuka.scene", m_scene.file},
                            {"kanuka.integrator", m_options.integrator},
                            {"kanuka.colorspace", std::string(color::info(picture.space).name)},
                            {"kanuka.progressions", std::to_string(m_gathered.least_done())},
                            {"kanuka.shutter", std::to_string(m_options.shutter_open) + " " +
                                                   std::to_string(m_options.shutter_close)},
                            {"kanuka.seed", std::to_string(m_options.seed)}};
        return picture;
    }

    const scene::Scene& m_scene;
    Journal& m_journal;
    Stats& m_stats;
    const Progress& m_progress;
    int m_lanes;
    std::string m_standard_shaders;
    scene::Delayed* m_delayed;
    const uint64_t m_memory;
    scene::Options m_options;
    scene::Camera m_taken_by;
    transport::IntegratorChoice m_integrator;
    transport::BatchCounts m_fireflies;                // those alone
    std::pair<int, int> m_first_nan{INT_MAX, INT_MAX}; // y, x
    float m_shading_rate;
    bool m_may_face = false; // nobody chose an integrator
    bool m_classic = false;  // scene::Options::transport, decided
    ColorSetup m_color;
    int m_progressions;
    Window m_window;
    Clock::time_point m_start;

    PlacedCamera m_camera;
    dice::DiceOptions m_dice;
    std::unique_ptr<shade::ShadingSystem> m_shading;
    std::unique_ptr<Linking> m_linking;
    std::vector<bvh::Scene::Plane> m_clips;
    std::unique_ptr<Geometry> m_geometry;
    std::unique_ptr<OnDemand> m_on_demand;
    std::unique_ptr<bvh::Scene> m_bvh;
    std::unique_ptr<grid::Air> m_air; // null = there is none
    std::vector<scene::Light> m_linked_lamps;
    transport::SceneInputs m_inputs;
    std::unique_ptr<film::Filter> m_filter;
    std::vector<float> m_shutter_quantiles; // empty = open all the time
    transport::SceneData m_data;

    std::mutex m_mutex;
    std::vector<std::unique_ptr<transport::Kernel>> m_kernels;
    Accumulator m_gathered;
    Aovs m_aovs;
};

} // namespace

Result render(const scene::Scene& scene, const Overrides& overrides, Journal& journal, Stats& stats,
              const Progress& progress) {
    Result result;
    check_threads(overrides.threads.value_or(0));
    tasks::with_threads(overrides.threads.value_or(0), [&] {
        BatchSession session(scene, overrides, journal, stats, progress);
        result = session.run();
        session.close_statistics();
    });
    return result;
}

} // namespace kanuka::render
