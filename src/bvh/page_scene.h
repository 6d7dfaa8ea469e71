// What of a scene lies in pages of our own hierarchy: grids, meshes and fibres, of groups that have many of
// them, and instances of such groups. All of it may move and change. Where all lies in pages, so do surfaces
// that bound solids. The rest is Embree's (build.cpp).
#pragma once

#include <algorithm>
#include <array>
#include <map>

#include "base/digest.h"
#include "bvh/bvh.h"
#include "bvh/matrix.h"
#include "bvh/page_plan.h"
#include "bvh/presence.h"
#include "hierarchy/build.h"
#include "hierarchy/instances.h"
#include "hierarchy/world.h"

namespace kanuka::bvh {

class KeptPages;
struct Leftovers;

class PageScene {
  public:
    // Groups that have less than `least` are left out. Vertices are moved to where pages have them, in the
    // store too. In parallel; the same bytes for any number of threads. `most_bytes`: of a page, but for a
    // single shape; less than what pages may have for tests of groups that take several. `files`: what lies
    // there is not built; null = none. `leftovers`: nor what is there; they are used up.
    PageScene(store::Store& store, std::span<const GroupDesc> groups, const PagesFrom& least,
              uint64_t most_bytes = ~uint64_t(0), store::HierarchyFiles* files = nullptr,
              Leftovers* leftovers = nullptr);
    PageScene(const PageScene&) = delete;

    bool empty() const { return m_root == None; }
    // Surfaces that bound solids, of all groups, or none.
    bool holds_solids() const { return m_holds_solids; }
    // Of a shape of a group, which bounds solid `solid` (-1 = none), wherever the group bounds none as a
    // whole.
    bool holds(size_t group, const store::ShapeRecord& shape, int solid) const {
        if (solid >= 0)
            return m_holds_solids;
        const int view = view_of(group, Part::Plain);
        return view >= 0 && m_groups[size_t(view)].has[size_t(sort_of(shape))];
    }
    Bounds3f bounds() const;
    uint64_t bytes() const;
    Scene::PageBytes bytes_of_shapes() const { return m_page_bytes; }
    Scene::Kept kept() const { return {m_kept_pages, m_world.refitted()}; }
    void leave(Leftovers& to); // ends it
    // What moves goes in circles, of which Embree cuts the boxes in time: then that is faster, by far.
    bool goes_round() const { return m_world.surplus() > 10; }
    // The closest hits of the rays of all packets; `hits` are the closest so far.
    template <int W>
    void intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const;
    // Adds lanes that something is in the way of.
    template <int W>
    void find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const;

  private:
    static constexpr uint32_t None = ~0u; // no page of the world

    // Of each a group has all in pages, or none.
    enum class Sort { Surfaces, Fibres, ChangingSurfaces, ChangingFibres };
    static constexpr size_t Sorts = 4;
    static Sort sort_of(const store::ShapeRecord& shape) {
        return Sort((shape.flags & store::ShapeRecord::Fibre ? 1 : 0) + (shape.motion_segments > 0 ? 2 : 0));
    }

    struct Run { // instances of another group, numbered on through the level
        uint32_t first;
        int group;
        Places places;
        std::span<const MotionPath> paths; // moving ones instead
        int first_slot;
        std::span<const int32_t> variations; // GroupDesc::Instances has the same

        Matrix place(uint32_t number, float time) const;
    };
    // Shapes of a page, as it numbers them. Partly: there for some rays alone.
    struct Grids {
        std::vector<int> shapes;
        std::vector<uint8_t> partly;
    };
    struct Numbered : Grids {        // meshes, and fibres
        std::vector<uint32_t> first; // face or segment of each shape
        uint32_t count = 0;          // of them

        void add(int shape, bool is_partly, size_t parts);
        struct Part {
            int shape, number;
            bool partly;
        };
        [[gnu::always_inline]] Part part(uint32_t name) const {
            const size_t i = size_t(std::upper_bound(first.begin(), first.end(), name) - first.begin()) - 1;
            return {shapes[i], int(name - first[i]), partly[i] != 0};
        }
    };
    struct Own { // a page of shapes
        Grids grids;
        Numbered meshes, fibres; // few cells are a mesh
        uint32_t page = None;
        uint32_t intervals = 0; // of time, each of which has a page, this one and those that follow; 0: still
    };
    struct Shapes { // of a group
        std::vector<int> surfaces, fibres;
        bool empty() const { return surfaces.empty() && fibres.empty(); }
    };
    struct Lattices : hierarchy::Lattices { // of a group
        explicit Lattices(const hierarchy::Lattices& of) : hierarchy::Lattices(of) {}
        Lattices(const store::Store& store, const Shapes& shapes, bool exact);
        void move(store::Store& store, int shape) const;
    };
    struct Group {
        std::vector<Own> owns; // one, where all fits into a page
        std::array<bool, Sorts> has{};
        std::vector<Run> runs;
        int surfaces = -1;                    // of its solids: their view, which lies behind its own pages
        std::vector<GroupDesc::Range> ranges; // of surfaces of solids, in the order of the store's shapes
        int first_emitter, slots;             // first_emitter: -1 = its own have no numbers
        uint32_t root = None; // the page of its shapes, or the level of those and its instances
    };
    struct Owner {
        int group = -1, own = 0;
    };
    struct Place { // of a hit on a shape
        int shape, prim;
        float u, v;
        bool partly;
    };
    class Presence;
    class Crossed;
    class Solids;

    int view_of(size_t group, Part part) const { return m_view_of[group][size_t(part)]; }
    // Where a hit lies; tells step(run, number in the run) of each instance on the way.
    template <class Step>
    Owner follow(const hierarchy::InstancePath& path, const Step& step) const;
    void build_view(store::Store& store, std::span<const GroupDesc> descs, const PagePlan& plan, size_t v);
    bool is_of(Part part, const SolidTrees& trees, int solid) const; // what bounds that, or (-1) none
    // `place_bytes`: what places of the group take in one other group, at the most.
    Shapes choose(const store::Store& store, const GroupDesc& desc, Part part, Group& group,
                  const PagesFrom& least, uint64_t place_bytes) const;
    // `surfaces`: the view of the group's solids; -1 = it has none.
    void place(const GroupDesc& desc, Part part, Group& group, size_t v, int surfaces);
    // `exact`: vertices keep 22 bits.
    void build_owns(store::Store& store, size_t v, const Shapes& shapes, bool exact);
    std::vector<std::vector<int>> cut_into_pages(const store::Store& store, const Shapes& shapes) const;
    // All of the same number of intervals.
    void build_own(const store::Store& store, size_t v, std::span<const int> shapes, const Lattices& lattices,
                   KeptPages& kept);
    Own number_shapes(const store::Store& store, std::span<const int> shapes);
    Place place_of(const hierarchy::Page& page, const hierarchy::Hit& hit) const;
    int solid_of(const hierarchy::Page& page, int shape) const; // that it bounds there
    // Of the root, if that is a page of what changes: how many pages there are, one for each of time.
    uint32_t root_intervals() const {
        return m_world.nesting(m_root) == 0 ? m_groups.back().owns[0].intervals : 0;
    }
    uint32_t interval_of(const hierarchy::Page& page) const; // of time, that what changes has the page for
    template <int W>
    void put(const RayPacket<W>& rays, int lane, const hierarchy::Hit& hit,
             const hierarchy::InstancePath& path, HitPacket<W>& hits) const;

    struct Memory { // of a page
        hierarchy::PageMemory page;
        Digest content; // null where nobody asks
        hierarchy::Lattices lattices;
    };

    const store::Store& m_store;
    uint64_t m_most_bytes;
    store::HierarchyFiles* m_files;
    Leftovers* m_leftovers; // while it is built
    Scene::PageBytes m_page_bytes;
    std::vector<std::array<int, 3>> m_view_of; // of each group, by Part; -1: nothing of it is needed
    std::vector<Group> m_groups;               // by view
    std::map<uint32_t, SolidTrees> m_solids;   // by the page of their surfaces
    bool m_holds_solids = false;
    std::vector<Owner> m_owner_of_page; // by number; of levels none
    std::vector<Memory> m_memory;
    uint64_t m_kept_pages = 0;
    hierarchy::World m_world;
    uint32_t m_root = None;
    bool m_partly = false; // something is there for some rays alone
};

} // namespace kanuka::bvh
