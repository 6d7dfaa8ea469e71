#include "render/tracing.h"

#include <algorithm>
#include <numeric>

#include "base/cancel.h"
#include "base/tasks.h"
#include "render/fireflies.h"

namespace kanuka::render {

Tracing::Tracing(Job& job, World& world, Lighting& lighting, const Window& window)
    : m_job(job), m_world(world), m_lighting(lighting),
      m_gathered(window, lighting.view().settings.aov_is_color.size(), job.options.adaptive > 0,
                 job.part ? job.part->first : 0) {}

bool Tracing::run(int end) {
    const ScopedTimer timer(m_job.stats->time.transport_s);
    const auto cancelled = [&] { return m_job.progress->cancelled(); };
    const int first = m_gathered.first();
    m_work = m_gathered.buckets() * uint64_t(std::max(end - first, 1));
    m_finished = 0;
    for (size_t b = 0; b < m_gathered.buckets(); b++)
        m_finished += uint64_t(m_gathered.bucket(b).done - first);
    // The first pass shows a whole picture; later ones stay with a bucket longer, for the caches' sake. After
    // the first block they stay to the end of a block: then few buckets at a time have sums of one under way.
    for (int from = m_gathered.least_done(); from < end && !cancelled(); from = m_gathered.least_done()) {
        const int visit = from == first ? 1 : from < first + BlockSize ? 8 : BlockSize;
        int to = std::min({end, from + visit, block_end(from)});
        if (m_job.options.adaptive > 0) {
            m_gathered.decide(m_job.options.adaptive, float(m_world.color().exposure.factor()),
                              m_lighting.view().camera.filter.weighted());
            to = std::min(to, Accumulator::next_decision(from));
        }
        if (to > 1 && !m_has_learned &&
            !tasks::unless_cancelled(m_job.progress->cancelled, [&] { learn_roulette(); }))
            break;
        std::vector<size_t> todo(m_gathered.buckets());
        std::iota(todo.begin(), todo.end(), size_t(0));
        // Buckets whose paths have met procedurals that are not read are done again when they are.
        for (;;) {
            std::vector<uint8_t> again(todo.size());
            tasks::parallel_for(todo.size(), [&](size_t i) { again[i] = !trace(todo[i], to); });
            bool more = false;
            if (m_world.on_demand() && !cancelled())
                tasks::unless_cancelled(m_job.progress->cancelled, [&] { more = extend(); });
            if (!more)
                break;
            size_t i = 0;
            std::erase_if(todo, [&](size_t) { return again[i++] == 0; });
        }
        if (from == first)
            note_first_pixels();
    }
    return m_gathered.least_done() >= end;
}

void Tracing::learn_roulette() {
    if (transport::RoulettePilot::is_wanted(m_lighting.view().settings)) {
        transport::RoulettePilot pilot(m_job.options.width, m_job.options.height);
        do {
            m_lighting.play_roulette(&transport::RoulettePilot::Weak);
            tasks::parallel_for(pilot.batches(), [&](size_t b) {
                std::unique_ptr<transport::Kernel> kernel = take_kernel();
                m_job.stats->count.rays += pilot.trace(b, *kernel);
                give_kernel(std::move(kernel));
            });
        } while (m_world.on_demand() && extend()); // paths have met procedurals that are read now
        m_roulette = pilot.learn();
        if (m_roulette)
            m_job.stats->roulette.assign(m_roulette->at.begin(), m_roulette->at.end());
        for (int bounce = 0; m_roulette && bounce < transport::RouletteFactors::Depths; bounce++)
            if (m_roulette->pairs_sky(bounce))
                m_job.stats->sky_pairs.push_back(bounce);
    }
    m_has_learned = true;
    m_lighting.play_roulette(m_roulette ? &*m_roulette : nullptr);
}

void Tracing::note_first_pixels() {
    Stats::Time& time = m_job.stats->time;
    if (time.first_pixel_s == 0)
        time.first_pixel_s =
            time.ingest_s + std::chrono::duration<double>(Job::Clock::now() - m_job.start).count();
}

bool Tracing::trace(size_t bucket, int to) {
    const auto cancelled = [&] { return m_job.progress->cancelled(); };
    const int from = m_gathered.bucket(bucket).done;
    if (from >= to || cancelled())
        return true;
    const bvh::Watch* const watch = m_world.on_demand() ? m_world.on_demand()->watch() : nullptr;
    const uint64_t met = watch ? watch->noted_here() : 0;
    std::vector<Sums> before = watch ? m_gathered.bucket(bucket).sums : std::vector<Sums>();
    std::unique_ptr<transport::Kernel> kernel = take_kernel();
    transport::BatchCounts counts;
    transport::BatchRequest r = m_gathered.request(bucket);
    to = std::min(to, block_end(from));
    int done = from;
    if (!m_gathered.is_traced(bucket))
        done = to;
    for (; done < to && (done == from || !cancelled()); done++) {
        r.progression = uint32_t(done);
        kernel->trace(r, counts);
    }
    give_kernel(std::move(kernel));
    if (watch && watch->noted_here() != met) {
        m_gathered.bucket(bucket).sums = std::move(before);
        m_job.stats->count.rays += counts.rays;
        return false;
    }
    m_gathered.finish(bucket, done);
    count(counts);
    const uint64_t n = m_finished += uint64_t(done - from);
    const std::lock_guard lock(m_mutex);
    m_job.progress->update("progressions", double(n) / double(m_work));
    return true;
}

bool Tracing::extend() {
    if (!m_world.extend())
        return false;
    Journal unheard;
    m_job.aovs.find(m_world.geometry().store.programs(), m_job.scene.file, unheard);
    m_kernels.clear();
    m_lighting.refresh();
    m_lighting.play_roulette(m_roulette ? &*m_roulette : nullptr);
    return true;
}

void Tracing::report() {
    if (m_world.on_demand()) {
        m_world.on_demand()->report(m_job.where());
        m_job.aovs.find(m_world.geometry().store.programs(), m_job.scene.file, m_job.journal);
    }
    if (const uint64_t bad = m_job.stats->count.nan_samples)
        m_job.journal.warning(
            m_job.where(), std::to_string(bad) +
                               " samples that were not finite have been dropped, the first at pixel " +
                               std::to_string(m_first_nan.second) + ", " + std::to_string(m_first_nan.first));
    if (m_job.stats->count.fireflies > 0)
        m_job.stats->fireflies =
            explain_fireflies(m_fireflies, *take_kernel(), m_lighting.view(), m_job.scene);
}

std::unique_ptr<transport::Kernel> Tracing::take_kernel() {
    {
        const std::lock_guard lock(m_mutex);
        if (!m_kernels.empty()) {
            auto k = std::move(m_kernels.back());
            m_kernels.pop_back();
            return k;
        }
    }
    return transport::make_kernel(m_lighting.view(), m_job.lanes);
}

void Tracing::give_kernel(std::unique_ptr<transport::Kernel> kernel) {
    const std::lock_guard lock(m_mutex);
    m_kernels.push_back(std::move(kernel));
}

void Tracing::count(const transport::BatchCounts& c) {
    m_job.stats->count.paths += c.paths;
    m_job.stats->count.rays += c.rays;
    m_job.stats->count.nan_samples += c.nan_samples;
    m_job.stats->count.fireflies += c.fireflies;
    if (c.fireflies == 0 && c.nan_samples == 0)
        return;
    const std::lock_guard lock(m_mutex);
    for (const transport::Firefly& f : c.worst)
        if (f.x >= 0)
            m_fireflies.note(f);
    if (c.nan_samples > 0)
        m_first_nan = std::min(m_first_nan, std::pair(c.nan_y, c.nan_x));
}

} // namespace kanuka::render
