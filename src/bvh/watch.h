// Boxes that rays are watched for: which of them they enter before they hit anything. For what is not read
// yet.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "base/vec.h"

namespace kanuka::bvh {

// Thread safety: look() may run on any thread; the others while nothing does.
class Watch {
  public:
    // Boxes in the space of rays.
    explicit Watch(std::span<const Bounds3f> boxes);
    ~Watch();
    Watch(const Watch&) = delete;

    // A ray enters the boxes on its way from t_min to t_max; the first `reach` of them are noted.
    void look(const Vec3f& o, const Vec3f& d, float t_min, float t_max) const;

    void set_reach(int boxes) { m_reach = boxes; }
    void leave_out(size_t box) { m_out[box] = true; } // it is read
    std::vector<uint32_t> take();                     // those that were noted since the last call, in order
    // How often this thread has noted one: what a piece of work has met is the difference.
    uint64_t noted_here() const;

  private:
    struct Query;
    friend struct WatchCallbacks;
    struct Impl;
    std::unique_ptr<Impl> m_impl;
    std::vector<bool> m_out;
    int m_reach = 1;
};

} // namespace kanuka::bvh
