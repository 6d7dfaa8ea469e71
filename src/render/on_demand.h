// Procedurals are read when a ray meets their bounds. Work that has met some is thrown away and done again
// with what they made, so that the picture is the one of the whole scene; the boxes that no ray entered are
// never opened.
#pragma once

#include <functional>
#include <memory>
#include <set>

#include "base/stats.h"
#include "bvh/watch.h"
#include "scene/delayed.h"

namespace kanuka::render {

class OnDemand {
  public:
    // `limit`: bytes that may grow out of them; 0 = without bound.
    OnDemand(scene::Delayed& delayed, const Transform& render_from_world, uint64_t limit, Journal& journal,
             Stats& stats);

    // Adds a part to what is traced and says how many bytes there are now.
    using Build = std::function<uint64_t(const scene::Scene& part)>;
    // What earlier renders have read.
    void build_known(uint64_t bytes, const Build& build);
    // What frames before have met, with what is in that.
    void build_ahead(const std::set<scene::NodeId>& met, const Build& build);
    void note_read(std::set<scene::NodeId>& met) const;
    uint64_t limit() const { return m_limit; }
    // Null: nothing is left to be met.
    const bvh::Watch* watch() const { return m_watch.get(); }
    // Reads what rays have met since the last call; false = nothing.
    bool read_met(const Build& build);
    Bounds3f bounds() const; // of what is not read, in render space
    void report(const Location& where) const;

  private:
    void look_again();
    scene::Delayed& m_delayed;
    Transform m_render_from_world;
    uint64_t m_limit, m_first_bytes = 0, m_bytes = 0;
    Journal& m_journal;
    Stats& m_stats;
    std::unique_ptr<bvh::Watch> m_watch;
    size_t m_watched = 0; // boxes
    int m_reach = 1;
    size_t m_left_out = 0; // met, but beyond the limit
};

} // namespace kanuka::render
