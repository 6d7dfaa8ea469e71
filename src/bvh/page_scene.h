// What of a scene lies in pages of our own hierarchy: still grids and meshes of groups that have many of
// them, and still instances of such groups. The rest is Embree's (build.cpp): small groups, what moves,
// fibres and the surfaces of solids.
#pragma once

#include "bvh/presence.h"
#include "hierarchy/build.h"
#include "hierarchy/instances.h"
#include "hierarchy/world.h"

namespace kanuka::bvh {

class PageScene {
  public:
    // Groups whose grids have fewer cells than `least` are left out. Vertices are moved to where pages have
    // them, in the store too. In parallel; the same bytes for any number of threads.
    PageScene(store::Store& store, std::span<const GroupDesc> groups, uint64_t least);
    PageScene(const PageScene&) = delete;

    bool empty() const { return m_root == None; }
    // Of a shape of a group, which bounds solid `solid` (-1 = none), wherever the group stands still.
    bool holds(size_t group, const store::ShapeRecord& shape, int solid) const {
        return m_groups[group].own != None && can_hold(shape, solid);
    }
    Bounds3f bounds() const;
    uint64_t bytes() const;

    // The closest hits of the rays of all packets. Lanes without one have no other fields but t = t_max.
    template <int W>
    void intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const;
    // Lanes that something is in the way of.
    template <int W>
    void find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const;

  private:
    static constexpr uint32_t None = ~0u; // no page of the world

    struct Run { // instances of another group, numbered on through the level
        uint32_t first;
        int group;
        Places places;
        int first_slot;
    };
    struct Group {
        std::vector<int> grids, meshes;       // shapes, as the page numbers them; few cells are a mesh
        std::vector<uint32_t> first_triangle; // of each mesh
        std::vector<uint8_t> partly_grids, partly_meshes; // there for some rays alone
        std::vector<Run> runs;
        int first_emitter, slots;         // first_emitter: -1 = its own have no numbers
        uint32_t own = None, root = None; // page of its shapes; that, or the level with its instances
    };
    struct Place { // of a hit on a shape
        int shape, prim;
        float u, v;
        bool partly;
    };
    class Presence;
    static bool can_hold(const store::ShapeRecord& shape, int solid) {
        return solid < 0 && !(shape.flags & store::ShapeRecord::Fibre) && shape.motion_segments == 0;
    }

    // The group that a hit lies in; tells step(run, number in the run) of each instance on the way.
    template <class Step>
    const Group& follow(const hierarchy::InstancePath& path, const Step& step) const;
    void build_group(store::Store& store, std::span<const GroupDesc> descs, size_t g, uint64_t least);
    void build_own(store::Store& store, Group& group, const std::vector<int>& shapes);
    Place place_of(const hierarchy::Page& page, const hierarchy::Hit& hit) const;
    template <int W>
    void put(const RayPacket<W>& rays, int lane, const hierarchy::Hit& hit,
             const hierarchy::InstancePath& path, HitPacket<W>& hits) const;

    const store::Store& m_store;
    std::vector<Group> m_groups;
    std::vector<int> m_group_of_page; // whose own page it is, by number
    std::vector<hierarchy::PageMemory> m_memory;
    hierarchy::World m_world;
    uint32_t m_root = None;
    bool m_partly = false; // something is there for some rays alone
};

} // namespace kanuka::bvh
