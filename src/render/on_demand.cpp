#include "render/on_demand.h"

#include <algorithm>

namespace kanuka::render {

// A ray notes the first boxes on its way. Twice as many from round to round: what hides behind a box that is
// met is seldom needed, but a forest must not take a round a tree.
constexpr int FirstReach = 1, MostReach = 64;
// How many are read before the memory is looked at again.
constexpr size_t Portion = 1024;

OnDemand::OnDemand(scene::Delayed& delayed, const Transform& render_from_world, uint64_t limit,
                   Journal& journal, Stats& stats)
    : m_delayed(delayed), m_render_from_world(render_from_world), m_limit(limit), m_journal(journal),
      m_stats(stats), m_reach(FirstReach) {}

void OnDemand::build_known(uint64_t bytes, const Build& build) {
    m_first_bytes = m_bytes = bytes;
    for (const scene::Scene& part : m_delayed.parts())
        m_bytes = build(part);
    look_again();
}

void OnDemand::build_ahead(const std::set<scene::NodeId>& met, const Build& build) {
    // Each reading may bring others: those are looked at next.
    for (size_t begin = 0, end; begin < m_delayed.bounds().size(); begin = end) {
        end = m_delayed.bounds().size();
        std::vector<uint32_t> which;
        for (size_t i = begin; i < end; i++)
            if (!m_delayed.is_read(i) && met.contains(m_delayed.node(i)))
                which.push_back(uint32_t(i));
        if (which.empty())
            continue;
        m_delayed.read_ahead(which);
        m_bytes = build(m_delayed.parts().back());
    }
    m_watch.reset();
    look_again();
}

void OnDemand::note_read(std::set<scene::NodeId>& met) const {
    for (size_t i = 0; i < m_delayed.bounds().size(); i++)
        if (m_delayed.is_read(i))
            met.insert(m_delayed.node(i));
}

void OnDemand::look_again() {
    m_stats.count.procedurals = m_delayed.bounds().size();
    m_stats.count.procedurals_read = m_delayed.read_count();
    if (m_delayed.read_count() == m_delayed.bounds().size() || m_left_out > 0) {
        m_watch.reset();
        return;
    }
    if (m_watch && m_watched == m_delayed.bounds().size()) {
        m_watch->set_reach(m_reach);
        return;
    }
    std::vector<Bounds3f> boxes;
    boxes.reserve(m_delayed.bounds().size());
    for (const Bounds3f& b : m_delayed.bounds()) {
        Bounds3f box;
        for (int corner = 0; corner < 8; corner++)
            box.extend(m_render_from_world.point(
                {corner & 1 ? b.hi.x : b.lo.x, corner & 2 ? b.hi.y : b.lo.y, corner & 4 ? b.hi.z : b.lo.z}));
        boxes.push_back(box);
    }
    m_watch = std::make_unique<bvh::Watch>(boxes);
    m_watched = boxes.size();
    for (size_t i = 0; i < boxes.size(); i++)
        if (m_delayed.is_read(i))
            m_watch->leave_out(i);
    m_watch->set_reach(m_reach);
}

bool OnDemand::read_met(const Build& build) {
    if (!m_watch)
        return false;
    const std::vector<uint32_t> met = m_watch->take();
    if (met.empty())
        return false;
    const size_t portion = m_limit > 0 ? Portion : met.size();
    for (size_t begin = 0; begin < met.size(); begin += portion) {
        if (m_limit > 0 && m_bytes - std::min(m_bytes, m_first_bytes) > m_limit) {
            m_left_out = met.size() - begin;
            break;
        }
        const std::span<const uint32_t> which(met.data() + begin, std::min(portion, met.size() - begin));
        for (const uint32_t i : which)
            m_watch->leave_out(i);
        m_delayed.read(which);
        m_bytes = build(m_delayed.parts().back());
    }
    m_reach = std::min(2 * m_reach, MostReach);
    look_again();
    return true;
}

Bounds3f OnDemand::bounds() const {
    Bounds3f all;
    for (size_t i = 0; i < m_delayed.bounds().size(); i++)
        if (!m_delayed.is_read(i))
            all.extend(m_delayed.bounds()[i]);
    if (all.empty())
        return all;
    Bounds3f here;
    here.extend(m_render_from_world.point(all.lo));
    here.extend(m_render_from_world.point(all.hi));
    return here;
}

void OnDemand::report(const Location& where) const {
    if (m_left_out > 0)
        m_journal.error(where, "procedurals have grown beyond the " + std::to_string(m_limit >> 20) +
                                   " MB that Option \"limits\" \"int proceduralmemory\" allows: " +
                                   std::to_string(m_left_out) +
                                   " that rays have met, and whatever lies behind them, stay unread");
    if (m_delayed.read_count() < m_delayed.bounds().size() && m_left_out == 0)
        m_journal.report(Severity::Info, where,
                         std::to_string(m_delayed.read_count()) + " of " +
                             std::to_string(m_delayed.bounds().size()) +
                             " procedurals were read; no ray has met the others");
}

} // namespace kanuka::render
