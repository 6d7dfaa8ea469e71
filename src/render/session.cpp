#include "render/session.h"

#include <algorithm>
#include <cstring>

#include "base/cancel.h"
#include "base/tasks.h"
#include "render/albedo.h"
#include "render/budget.h"
#include "render/checkpoint.h"
#include "render/develop.h"
#include "render/surfaces.h"
#include "render/tracing.h"
#include "scene/digest.h"

#ifndef KANUKA_VERSION
#define KANUKA_VERSION "unknown"
#endif

namespace kanuka::render {

namespace {

Job job_of(const scene::Scene& scene, const Overrides& o, Journal& journal, Stats& stats) {
    static const Progress silent;
    Job job{.scene = scene,
            .options = scene.options,
            .camera = o.camera.value_or(scene.camera),
            .shot = o.shot,
            .journal = journal,
            .stats = &stats,
            .progress = &silent,
            .part = o.part,
            .lanes = o.lanes,
            .standard_shaders = o.standard_shaders,
            .delayed = o.delayed,
            .memory = o.memory ? *o.memory : machine_memory(),
            .page_memory = 0,
            .memory_budget = o.memory_budget ? *o.memory_budget : memory_budget_of_environment(),
            .geometry_memory = 0,
            .store_window = o.store_window,
            .pages_from = o.pages_from,
            .store = o.store ? *o.store : store::store_settings_of_environment(),
            .oracle = o.oracle,
            .shading_rate = o.shading_rate.value_or(1.0f),
            .may_face = !o.options.has("integrator") && scene.options.integrator == "path" &&
                        !scene.file.empty() && !o.delayed,
            .integrator = {},
            .aovs = {}};
    job.page_memory = o.page_memory.value_or(job.memory / 4);
    job.geometry_memory = job.memory;
    if (const MemoryBudget& budget = job.memory_budget; budget.bytes > 0) {
        // All that pages can hold lies in pages: Embree's memory stays where it is. As much as that may take
        // is a matter of the disk, half of it for the hierarchy (budget.h).
        job.pages_from = 0;
        job.geometry_memory = paged_memory::room(budget);
        job.page_memory = std::min(job.page_memory, budget.bytes / 8);
    }
    o.options.apply(job.options);
    const scene::Options& options = job.options;
    if (options.width < 1 || options.height < 1 ||
        int64_t(options.width) * options.height > (int64_t(1) << 30))
        throw Error("the resolution must be at least 1x1 and at most 2^30 pixels", ExitCode::Usage);
    if (job.part) {
        if (options.adaptive > 0)
            throw Error(
                "a picture that is sampled adaptively has no parts: where pixels stop depends on all samples "
                "before; set adaptive to 0",
                ExitCode::Usage);
        check_part(*job.part, options.samples);
    }
    job.integrator = transport::IntegratorChoice::parse(options.integrator);
    job.aovs.ask(options.displays, o.aovs);
    return job;
}

// Blocks of progressions that a pixel has sums of at the end.
int blocks_kept(const Job& job) {
    if (job.part && job.part->first > 0)
        return (job.part->count() + BlockSize - 1) / BlockSize;
    return 1; // and for the buckets that are at work one more
}

// A black picture is a surprise: the likeliest reason, for who looks at nothing.
void tell_of_darkness(const film::Picture& picture, bool has_lights, const Job& job) {
    const auto dark = [&](std::initializer_list<const char*> names) {
        return std::ranges::all_of(names, [&](const char* name) {
            const film::Picture::Channel* channel = picture.find(name);
            return !channel || std::ranges::all_of(channel->data, [](float v) { return v == 0; });
        });
    };
    if (!dark({"R", "G", "B"}))
        return;
    const std::string why =
        dark({"A"})   ? "the camera sees nothing; look at its place, its clipping planes and what "
                        "messages say is missing"
        : !has_lights ? "no light shines; add one, or look at shapes by the integrator facing"
                      : "no light reaches what the camera sees; look at the lights' places, or at "
                        "shapes by the integrator facing";
    job.journal.warning(job.where(), "the picture is black: " + why);
}

} // namespace

// One making of the scene: what it became, and the samples of it.
struct Making {
    Making(const scene::Scene& scene, const Overrides& o, Journal& journal, Stats& stats, Kept* kept)
        : records_oracle(o.records_oracle), job(job_of(scene, o, journal, stats)),
          window(crop_window(job.options.crop, job.options.width, job.options.height)) {
        if (records_oracle) // its factors are over the finest, and of what is declared
            job.options.instance_levels = 0, job.options.unique_up_to = 0;
        refuse_what_cannot_fit(window, job.aovs.count(), job.memory, blocks_kept(job));
        world.emplace(job, kept);
        lighting.emplace(job, *world);
    }

    void build() {
        world->build();
        Journal unheard; // what is not read yet may have them
        job.aovs.find(world->geometry().store.programs(), job.scene.file,
                      world->on_demand() ? unheard : job.journal);
        if (records_oracle)
            lighting->log_footprints((recorder = world->recorder()).get());
        lighting->build();
        tracing.emplace(job, *world, *lighting, window);
    }

    // Of all that samples depend on, but for how many there are.
    Digest key() const {
        // Where pixels stop is decided by what the picture looks like.
        const float exposure = job.options.adaptive > 0 ? float(world->color().exposure.factor()) : 0.0f;
        return digest_of(std::string_view(KANUKA_VERSION), world->key(), job.options, exposure, job.camera,
                         job.shot, job.shading_rate, job.pages_from.cells, job.pages_from.segments,
                         job.aovs.names(), job.aovs.expressions(), world->classic(), lighting->key());
    }

    Development how() const {
        Development how = development(job.options, world->camera(), world->color(), job.aovs,
                                      lighting->view().camera.filter.weighted());
        how.metadata = {{"kanuka.version", KANUKA_VERSION},
                        {"kanuka.transport", world->classic() ? "classic" : "full"},
                        {"kanuka.scene", job.scene.file},
                        {"kanuka.integrator", job.options.integrator},
                        {"kanuka.colorspace", std::string(color::info(how.space).name)},
                        {"kanuka.shutter", std::to_string(job.options.shutter_open) + " " +
                                               std::to_string(job.options.shutter_close)},
                        {"kanuka.seed", std::to_string(job.options.seed)}};
        return how;
    }

    film::Picture develop() {
        film::Picture picture = render::develop(tracing->gathered(), how());
        const scene::Options& options = job.options;
        if (options.imager) {
            const auto channel = [&](size_t c) { return std::span<float>(picture.channels[c].data); };
            world->shading().image(*options.imager,
                                   {picture.width, picture.height, picture.x0, picture.y0, options.width,
                                    options.height, channel(0), channel(1), channel(2), channel(3)});
        }
        return picture;
    }

    bool records_oracle;
    Job job;
    Window window;
    std::unique_ptr<OracleRecorder> recorder; // null = nothing is recorded
    std::optional<World> world;
    std::optional<Lighting> lighting;
    std::optional<Tracing> tracing; // none = it is not built
};

class Session::Impl {
  public:
    Impl(const scene::Scene& scene, const Overrides& overrides, Keep keep, Journal& journal, Stats& stats)
        : m_scene(&scene), m_journal(&journal), m_keep(keep), m_kept(keep == Keep::Pages) {
        begin(overrides, stats);
    }
    void begin(const scene::Scene& scene, const Overrides& overrides, Journal& journal, Stats& stats) {
        m_making.reset();
        m_scene = &scene, m_journal = &journal;
        begin(overrides, stats);
    }

    void begin(const Overrides& overrides, Stats& stats) {
        check_threads(overrides.threads.value_or(0));
        m_threads = overrides.threads.value_or(0);
        m_making.reset(); // which leaves what can be of use
        const MemoryBudget budget =
            overrides.memory_budget ? *overrides.memory_budget : memory_budget_of_environment();
        m_hold.emplace(budget);
        m_paged_before = paged_memory::counts();
        m_making.emplace(*m_scene, overrides, *m_journal, stats, m_keep == Keep::Nothing ? nullptr : &m_kept);
    }

    bool prepared() const { return making().tracing.has_value(); }
    bool prepare(const Progress& progress) {
        if (prepared())
            return true;
        const bool done = work(
            progress, [&] { return tasks::unless_cancelled(progress.cancelled, [&] { making().build(); }); });
        tell_of_full_disk();
        return done;
    }

    bool advance(int progressions, const Progress& progress) {
        const std::optional<Part>& part = making().job.part;
        if (part && progressions > part->count())
            throw Error("the part has " + std::to_string(part->count()) + " progressions, not " +
                            std::to_string(progressions),
                        ExitCode::Usage);
        if (!prepare(progress))
            return false;
        const bool done = work(progress, [&] { return making().tracing->run(first() + progressions); });
        making().world->close_store();
        return done;
    }

    int progressions() const {
        return making().tracing ? making().tracing->gathered().least_done() - first() : 0;
    }
    int wanted() const {
        const Job& job = making().job;
        return job.part ? job.part->count() : job.options.samples;
    }

    film::Picture picture() {
        film::Picture picture;
        if (making().tracing)
            tasks::with_threads(m_threads, [&] {
                const ScopedTimer timer(making().job.stats->time.film_s);
                picture = making().develop();
            });
        return picture;
    }

    film::Picture finish() {
        if (making().tracing)
            tasks::with_threads(m_threads, [&] { making().tracing->report(); });
        film::Picture picture = this->picture();
        tell_of_large_rest();
        if (!picture.channels.empty() && progressions() >= wanted())
            tell_of_darkness(picture, making().lighting->has_lights(), making().job);
        return picture;
    }

    Digest key() const {
        if (m_keep == Keep::Nothing)
            throw Error("this session keeps no keys, by which a checkpoint is known");
        return making().key();
    }
    void save(const std::string& path) {
        if (!making().tracing)
            throw Error("there is nothing to save yet");
        save_checkpoint(path, key(), making().how(), making().tracing->gathered());
    }
    void resume(const std::string& path, const Progress& progress) {
        const std::optional<Part>& part = making().job.part;
        if (prepare(progress))
            resume_checkpoint(path, key(), part ? &*part : nullptr, making().tracing->gathered());
    }

    Recorded save_oracle(const std::string& path) const {
        if (!making().recorder)
            throw Error("this session has recorded no oracle");
        const DicingOracle oracle = making().recorder->result();
        oracle.save(path);
        return {oracle.primitives(), oracle.seen()};
    }

    const std::vector<MadeAgain::Reason>& made_again() const { return m_kept.made_again.reasons(); }

    void close_statistics() {
        Stats& stats = *making().job.stats;
        stats.time.total_s = stats.time.ingest_s +
                             std::chrono::duration<double>(Job::Clock::now() - making().job.start).count();
        stats.bytes.peak_rss = peak_memory();
        const paged_memory::Counts paged = paged_memory::counts();
        stats.bytes.scratch = paged.bytes;
        stats.bytes.given_back = paged.given_back - m_paged_before.given_back;
    }

  private:
    Making& making() const {
        if (!m_making)
            throw Error("the last update() of the session was refused; update it again first");
        return *m_making;
    }
    int first() const { return making().job.part ? making().job.part->first : 0; }
    void tell_of_full_disk() const {
        const uint64_t refused = paged_memory::counts().refused - m_paged_before.refused;
        if (refused > 0)
            m_journal->warning(
                making().job.where(),
                "scratch files cannot grow (" + std::string(std::strerror(paged_memory::counts().why)) +
                    "): " + std::to_string(refused >> 20) +
                    " MB stay in memory, whatever its budget; KANUKA_SCRATCH names another folder");
    }
    // The budget is for what is large; the rest is told where it is more than that.
    void tell_of_large_rest() const {
        const uint64_t budget = making().job.memory_budget.bytes, peak = peak_memory();
        if (budget > 0 && peak > budget)
            m_journal->warning(
                making().job.where(),
                "this process has had " + std::to_string(peak >> 20) +
                    " MB in memory at once, and its budget is " + std::to_string(budget >> 20) +
                    ": what is not paged is the scene as it was read, the picture, textures, and "
                    "primitives while they are diced");
    }
    // On as many threads as were asked for; `progress` is that of this call.
    template <class Step>
    bool work(const Progress& progress, const Step& step) {
        bool done = false;
        const Progress* const before = std::exchange(making().job.progress, &progress);
        try {
            tasks::with_threads(m_threads, [&] { done = step(); });
        } catch (...) {
            making().job.progress = before;
            throw;
        }
        making().job.progress = before;
        return done;
    }

    const scene::Scene* m_scene;
    Journal* m_journal;
    const Keep m_keep;
    int m_threads = 0;
    std::optional<paged_memory::Hold> m_hold;
    paged_memory::Counts m_paged_before;
    Kept m_kept;
    mutable std::optional<Making> m_making; // none: what was to follow the last one was refused
};

Session::Session(const scene::Scene& scene, const Overrides& overrides, Keep keep, Journal& journal,
                 Stats& stats)
    : m(std::make_unique<Impl>(scene, overrides, keep, journal, stats)) {}
Session::~Session() = default;
bool Session::prepare(const Progress& progress) {
    return m->prepare(progress);
}
bool Session::prepared() const {
    return m->prepared();
}
bool Session::advance(int progressions, const Progress& progress) {
    return m->advance(progressions, progress);
}
int Session::progressions() const {
    return m->progressions();
}
int Session::wanted() const {
    return m->wanted();
}
film::Picture Session::picture() {
    return m->picture();
}
film::Picture Session::finish() {
    return m->finish();
}
void Session::update(const Overrides& overrides, Stats& stats) {
    m->begin(overrides, stats);
}
void Session::update(const scene::Scene& scene, const Overrides& overrides, Journal& journal, Stats& stats) {
    m->begin(scene, overrides, journal, stats);
}
void Session::save(const std::string& path) {
    m->save(path);
}
void Session::resume(const std::string& path, const Progress& progress) {
    m->resume(path, progress);
}
Session::Recorded Session::save_oracle(const std::string& path) const {
    return m->save_oracle(path);
}
const std::vector<MadeAgain::Reason>& Session::made_again() const {
    return m->made_again();
}
void Session::close_statistics() {
    m->close_statistics();
}

Result render(const scene::Scene& scene, const Overrides& overrides, Journal& journal, Stats& stats,
              const Progress& progress) {
    Session session(scene, overrides, Session::Keep::Nothing, journal, stats);
    Result result;
    result.cancelled = !session.advance(session.wanted(), progress);
    result.picture = session.finish();
    session.close_statistics();
    return result;
}

std::vector<SurfaceGroup> read_surfaces(const scene::Scene& scene, const Overrides& overrides,
                                        Journal& journal, Stats& stats, const Progress& progress) {
    const int threads = overrides.threads.value_or(0);
    check_threads(threads);
    Job job = job_of(scene, overrides, journal, stats);
    const paged_memory::Hold hold(job.memory_budget);
    job.progress = &progress;
    job.options.instance_levels = 0; // models have one
    job.options.unique_up_to = 0;    // and groups as they are declared
    if (overrides.delayed)
        journal.warning(job.where(),
                        "procedurals that wait for rays are left out, since there are none: load the "
                        "scene without on_demand");
    World world(job, nullptr);
    std::vector<SurfaceGroup> groups;
    tasks::with_threads(threads, [&] {
        const bool done = tasks::unless_cancelled(progress.cancelled, [&] {
            world.build_surfaces();
            const Albedos albedos(world.geometry().store, *world.color().palette);
            groups = surfaces_of(world.geometry(), world.camera().origin, albedos, scene, journal, progress);
        });
        if (!done || progress.cancelled())
            groups.clear();
    });
    return groups;
}

} // namespace kanuka::render
