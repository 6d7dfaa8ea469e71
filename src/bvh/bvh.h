// Ray queries over the store. Large groups and fibres lie in pages of our own, wherever they stand or move
// (page_scene.h, docs/hierarchy.md). The rest is Embree's (build.cpp): meshes are one geometry each, grids of
// a group one; instances are one user geometry per group of them, nested by callback. Shapes that change
// while the shutter is open have a vertex buffer a step; moving instances, here and there, have their bounds
// at several times, and their matrix is made for every ray that meets them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/lanes.h"
#include "base/level_range.h"
#include "base/motion.h"
#include "base/places.h"
#include "base/vec.h"
#include "bvh/solids.h"
#include "bvh/watch.h"
#include "store/store.h"

namespace kanuka::store {
class HierarchyFiles;
}

namespace kanuka::bvh {

struct Leftovers; // leftovers.h

// What a group holds: a run of the store's shapes, and instances of groups with lower numbers.
struct GroupDesc {
    struct Range {
        int first, count;
        int solid =
            -1; // that they bound, of the group's or, if it has none, of the group's that it is placed in
    };
    std::vector<Range> shapes;
    struct Instances {
        int group;
        Places places; // group_from_child; their matrices must outlive the scene
        // Moving ones instead: where each is at a time from 0 to 1; must outlive the scene.
        std::span<const MotionPath> paths = {};
        int first_slot = Unnumbered; // within the group; see number_emitters()
        bool bounds_solid = false;   // parts of the surfaces of solids
        // What HitPacket::variation is in each place, or of each path; empty = what it is around. Must
        // outlive the scene.
        std::vector<int32_t> variations = {};
        // Which rays see each, by RayPacket::level; empty = all do. Must outlive the scene.
        std::vector<LevelRange> levels = {};

        size_t size() const { return paths.empty() ? places.size() : paths.size(); }
    };
    std::vector<Instances> instances;
    std::vector<SolidNode> solids;

    static constexpr int Unnumbered = -1;
    int first_emitter = 0, emitters = 0; // of the group's own shapes: a run of the store's
    int slots = 0;                       // numbered triangles, instances included
};

// Gives every emitting triangle of the world a number, a slot, once for each place that instances put it at:
// a group's own first, then those of its instances, place by place. Instances that would bring a group beyond
// `most` slots stay without numbers; so do moving ones. Returns the emitting triangles, places counted, that
// `most` has left without.
uint64_t number_emitters(const store::Store& store, std::span<GroupDesc> groups, int most);

// What a ray has passed that stops some colours more than others, and the part of its light that was let
// through there, relative to the chance of passing: store::ShapeRecord::Tinted.
struct LetThrough {
    static constexpr int Most = 16; // the rest counts with the last
    int count = 0;
    float t[Most], part[3][Most];

    void add(float at, const Rgb& let_through);
    Rgb before(float end) const; // of all up to there
};

template <int W>
struct RayPacket {
    Vec3<Float<W>> o, d; // d need not be unit length; distances are in units of it
    Float<W> t_max;
    Float<W> t_min{0.0f};
    Mask<W> active;
    bool coherent = false; // side by side, as camera rays are: traced as a packet
    Int<W> seed;           // decides hits on partly present surfaces; same seed, same decisions
    Float<W> time{0.0f};   // while the shutter is open, 0 to 1
    Int<W> passes{0};      // shadow linking: passes through shapes that share a bit of it; occluded() alone
    Int<W> camera{0};      // 1: from the camera, which some shapes are hidden from
    Float<W> level{0.5f};  // which levels of detail it meets: store::Links::level_from, GroupDesc::Instances
    LetThrough* passages = nullptr; // one a lane, empty; null = nobody asks
};

template <int W>
struct HitPacket {
    Mask<W> hit;
    Float<W> t, u, v;
    Vec3<Float<W>> Ng; // not normalised; in the space of the shape
    Int<W> shape,
        prim; // index into Store::shapes; face of a mesh, unused for grids (u, v run over the whole grid)
    Int<W> instanced;                          // 0, or 1 where `world_from_shape` holds the lane's transform
    alignas(64) float world_from_shape[12][W]; // row-major 3x4, at the ray's time
    // How large the numbers were, in units of the world, through which the ray came to the shape's space and
    // points of the shape come back; rounding is relative to that. Where instanced.
    Float<W> magnitude;
    Int<W>
        slot_shift; // where instanced: added to the number of an emitter, its slot; negative sums have none
    Int<W>
        variation; // of the innermost instance that has one (GroupDesc::Instances::variations); 0 = none has

    void clear(Float<W> t_max) { // no hits
        hit = Mask<W>(false);
        t = t_max, u = v = Float<W>(0.0f);
        Ng = {u, u, u};
        shape = prim = instanced = slot_shift = variation = Int<W>(0);
        magnitude = u;
    }
};

// Groups that have so much of a kind lie in pages of our own, with all surfaces, or all fibres, that are in
// them (docs/hierarchy.md, "In the renderer"). Smaller ones, which caches hold, Embree traces faster. Among
// many instances rays through pages take two thirds of the time.
struct PagesFrom {
    uint64_t cells = uint64_t(1) << 19;     // of grids,
    uint64_t triangles = uint64_t(3) << 19; // or of meshes, which Embree builds faster
    uint64_t segments = 1 << 16;            // of fibres; and if they take more than places of the group do
    uint64_t changing = 1 << 22;            // cells or segments, of what changes and is given at two times
    uint64_t places = 512;                  // of instances: with so many, all but what changes
    uint64_t few_triangles = 128;           // at most: where a scene has no more, rays test all of them

    PagesFrom() = default;
    // All in pages, or, ~0, nothing.
    PagesFrom(uint64_t of_all)
        : cells(of_all), triangles(of_all), segments(of_all), changing(of_all), places(of_all),
          few_triangles(~of_all == 0 ? 0 : 128) {}
};

class Scene {
  public:
    struct Build {
        // Of what is Embree's:
        bool compact = false;   // a third of the memory for a little speed
        bool watertight = true; // no ray passes between polygons that share an edge; a tenth of the speed
        std::function<bool()> cancelled = {}; // asked on any thread while it is built
        PagesFrom pages_from = {};
        uint64_t page_bytes = ~uint64_t(0);     // the most of a page: for tests of groups that take several
        store::HierarchyFiles* files = nullptr; // where pages may lie that need not be built
        // Of a scene before this one, or empty; null = nothing that this one leaves is asked for.
        std::shared_ptr<Leftovers> leftovers = {};
    };
    // The last group is the world. Builds in parallel; throws tasks::Cancelled where it is cancelled.
    // Vertices of the store are moved to where pages have them.
    Scene(store::Store& store, std::span<const GroupDesc> groups, Build build);
    ~Scene();
    Scene(const Scene&) = delete;

    // Thread safety: queries may run on any thread. Many packets at once are faster than one by one, and find
    // the same bits.
    template <int W>
    void intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const;
    template <int W>
    void intersect(const RayPacket<W>& rays, HitPacket<W>& hits) const {
        intersect<W>(std::span(&rays, 1), std::span(&hits, 1));
    }
    template <int W>
    void find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const;
    template <int W>
    Mask<W> occluded(const RayPacket<W>& rays) const {
        Mask<W> m;
        find_occluded<W>(std::span(&rays, 1), std::span(&m, 1));
        return m;
    }

    // Cuts away what lies on the side of a plane that its normal points to, for all rays. Before any query.
    struct Plane {
        Vec3f point, normal;
    };
    // Planes that move are there at `times` even times of the shutter, all planes of one time after the
    // other.
    void clip(std::span<const Plane> planes, int times = 1);
    // Tells it of every ray, up to its hit. Null = nobody; it must outlive the scene.
    void watch_by(const Watch* watch) { m_watch = watch; }

    Bounds3f bounds() const;
    uint64_t bytes() const; // of the hierarchies, without the positions that they share with the store
    struct PageBytes {
        uint64_t built = 0, stored = 0; // stored: that came from files
    };
    PageBytes page_bytes() const; // of bytes(), pages of shapes
    struct Kept {
        uint64_t pages = 0, levels = 0; // pages of shapes; trees over places
    };
    Kept kept() const; // of Build::leftovers
    // For a scene of nearly the same groups. No queries any more.
    std::shared_ptr<Leftovers> leave();

  private:
    template <int W>
    void intersect_embree(const RayPacket<W>& rays, HitPacket<W>& hits) const;
    template <int W>
    Mask<W> occluded_embree(const RayPacket<W>& rays) const;
    template <int W>
    void tell(const RayPacket<W>& rays, const Mask<W>& which, const Float<W>& t_max) const;
    struct Impl;
    std::unique_ptr<Impl> m_impl;
    const Watch* m_watch = nullptr;
};

} // namespace kanuka::bvh
