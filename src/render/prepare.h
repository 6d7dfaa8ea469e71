// One primitive on its way to the store: diced, shaded and encoded.
#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "base/digest.h"
#include "render/geometry.h"
#include "render/group_views.h"
#include "render/made_again.h"
#include "render/motion.h"
#include "render/page_frame.h"
#include "render/volumes.h"

namespace kanuka::render {

struct Prepared {
    store::Page page; // in the parent's space
    std::shared_ptr<const shade::Material> material;
    bool empty = true;
    // A primitive that moves as a whole is a group of its own: what it is when the shutter opens, in its
    // place in the parent's space then, and from there to where it goes.
    std::vector<MotionPath> path;
    bool asks_world = false;                         // shaders do, for where it is in there
    bool changes = false;                            // its shape
    Thickness inside;                                // of a Volume
    std::array<double, 3> offset{};                  // PageFrame::offset
    std::unique_ptr<const dice::DensityField> field; // of an oracle
    Digest key;                                      // of the page, where GeometryRequest::pages are kept
    Digest content;                                  // and that without what shaders read of where it stands
    std::optional<PageCache::Entry> made; // to be kept: in its own space; none = it was kept already
    bool is_evicted = false;              // it was kept once, and found no room
    bool is_stored = false;               // it came from the disk
    PageInputs inputs;                    // where GeometryRequest::made_again is
    std::vector<std::string> reasons;     // why it was made; empty = it was not
};

// Thread safety: prepare() may run at the same time, the others alone.
class Preparer {
  public:
    explicit Preparer(const GeometryRequest& request);
    void expect(size_t primitives) { m_total = primitives; } // to say how far it is
    void begin_run(uint64_t resident) {                      // of primitives: bytes in the store before it
        m_resident = resident;
        m_prepared = 0;
    }
    // `inside_out`: what a solid is taken away from ends there; its outside lies within.
    // `parent_from_group`: render space from the world or, of what is instanced, the group as it is built
    // from the group; a translation. `instanced`: null = in the world.
    void prepare(const scene::Primitive& declared, const Transform& parent_from_group,
                 const GroupView* instanced, bool inside_out, Prepared& out);
    // Dicing, shading and reading pages overlap on all threads; their shares of the wall clock are those of
    // the time spent in each.
    void share_wall_time(double wall) const;

    // What the store on disk is to know of a page.
    store::StoredPage entry_of(const Prepared& made) const;

  private:
    using Clock = std::chrono::steady_clock;
    void make(const scene::Primitive& declared, const Transform& parent_from_group,
              const GroupView* instanced, bool inside_out, Prepared& out);
    shade::SpacesRead dice_and_shade(const scene::Primitive& declared, const scene::Primitive& primitive,
                                     const PageFrame& frame, dice::DiceTarget target, bool inside_out,
                                     Clock::time_point start, Prepared& out);
    bool take_kept(Prepared& out);
    bool take_stored(Prepared& out);
    bool keeps() const { return m_request.pages->keeps() || m_request.disk; }
    void note_made(shade::SpacesRead read, Prepared& out) const;
    PageInputs inputs_of(const scene::Primitive& declared, const shade::Material& material,
                         const PageFrame& frame, const dice::DiceTarget& target, bool inside_out);
    Digest key_of(const scene::Attributes* attributes);
    static bool asks_world(const shade::SpacesRead& read);
    void refuse_more_than_fits() const;
    dice::DiceTarget target_of(const scene::Primitive& primitive, const shade::Material& material,
                               const PageFrame& frame, bool instanced,
                               std::span<const scene::Primitive> later) const;
    void fill(const scene::Primitive& primitive, const scene::Volume& volume,
              const Transform& parent_from_object, const PageFrame& frame, bool elsewhere,
              scene::Primitive& boundary, Prepared& out);
    float for_its_light(const scene::Primitive& primitive, const PageFrame& frame) const;
    std::vector<Transform> views_of(const MotionPath& path, const std::vector<Transform>& instead_from) const;
    void shade_and_encode(const scene::Primitive& primitive, dice::Diced& diced,
                          const shade::Material& material, bool inside_out, shade::SpacesLog& log,
                          Prepared& out);
    void shade_mesh(dice::Diced& diced, const shade::Material& material, grid::VertexInputs& inputs,
                    shade::SpacesLog& log);
    void say_of_values(const Location& where, uint64_t bad, uint64_t lost) const;

    const GeometryRequest& m_request;
    PageInputs m_setting; // what is the same for all primitives
    std::mutex m_attributes_mutex;
    std::map<const scene::Attributes*, Digest> m_attributes; // which many share
    std::atomic<double> m_dice_time{0}, m_shade_time{0}, m_store_time{0};
    std::mutex m_progress_mutex;
    size_t m_done = 0, m_total = 0;
    uint64_t m_resident = 0;
    std::atomic<uint64_t> m_prepared{0}; // of pages on the way to the store
};

} // namespace kanuka::render
