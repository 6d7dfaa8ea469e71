// What the ray tracer's own files share: Embree's objects of a scene, and what travels with a query.
#pragma once

#include <embree3/rtcore.h>

#include "bvh/bvh.h"
#include "bvh/clusters.h"
#include "bvh/matrix.h"
#include "bvh/presence.h"
#include "bvh/solids.h"

namespace kanuka::bvh {

constexpr int MaxDepth = 16; // of nested instances

// The same kernels on every machine: those for AVX-512 give distances that differ in the last bit, and a farm
// of both would show it. They are up to 7 % faster.
constexpr const char* EmbreeSettings = "isa=avx2";

// Embree's packaged build asserts that rays lie in the range that it can compute with. What does not hits
// nothing.
constexpr float LargestCoordinate = 1e18f;

struct Geometry {
    const store::Store* store;
    std::vector<int> shape_of_grid; // grids, and quads of grids: by primID; meshes: one entry
    std::vector<uint32_t> cell;     // quads of grids: place of the cell, u | v << 16, by primID; else empty
    int solid = -1;                 // that it bounds
    int group = -1;                 // that it lies in
    bool partly = false;            // for some rays it is not there

    int shape(unsigned prim) const {
        return shape_of_grid.size() == 1 ? shape_of_grid[0] : shape_of_grid[prim];
    }
};

struct Instances;

struct Group {
    RTCScene scene = nullptr;
    RTCScene solids = nullptr; // what bounds the solids of `trees`: rays that are traced here hit nothing,
                               // but note all crossings. geomIDs go on through both scenes.
    SolidTrees trees;
    std::vector<std::unique_ptr<Geometry>> geometries; // by geomID; null for instances
    std::vector<std::unique_ptr<Instances>> instances;
};

struct Instances {
    int group;
    int first_slot, slots; // of the first place; of each
    int first_emitter;     // of the group that is placed; -1 = its own have no numbers
    const Group* target;
    Places places;
    Bounds3f child;                // of the group that is placed
    LargeVector<Cluster> clusters; // still ones, by primID; moving ones are primitives themselves
    // Moving ones: bounds at `steps` even times, which hold everything in between when interpolated.
    std::span<const MotionPath> paths;
    std::span<const int32_t> variations; // GroupDesc::Instances has the same
    std::span<const LevelRange> levels;
    int steps = 1;
    std::vector<Bounds3f> bounds; // of an instance, step by step

    bool is_seen(uint32_t instance, float level) const {
        return levels.empty() || levels[instance].holds(level);
    }
};

// Travels with a query through all levels; filters and callbacks find their ray by ray.id.
struct Context {
    RTCIntersectContext embree; // first member: Embree hands it back (checked below)
    const int32_t* seeds;
    float* hit_transform; // [12][width]
    float* hit_magnitude; // HitPacket::magnitude
    int32_t* hit_group;
    int32_t* hit_slot_shift;
    int32_t* hit_variation;
    const int32_t* passes; // null: shadow linking is not asked for
    const int32_t* camera;
    const float* level;
    LetThrough* passages; // null = nobody asks
    int width;
    struct Crossings* crossings = nullptr; // where those of the ray go
    int depth = 0;
    Matrix world_from_current[MaxDepth + 1]; // down to level `known`: hits ask for more, by known_world()
    int known = 0;
    // Of the levels below the world, for the ray in question.
    const float *parent_from_current[MaxDepth + 1], *current_from_parent[MaxDepth + 1];
    int32_t slot[MaxDepth + 1]; // where the numbers of emitters in the current group begin
    int32_t variation[MaxDepth + 1];

    Beholder beholder(unsigned ray_id) const {
        return {seeds[ray_id], passes ? passes[ray_id] : 0, camera[ray_id], level[ray_id],
                passages ? passages + ray_id : nullptr};
    }
};
static_assert(offsetof(Context, embree) == 0);

// Of the current level; most instances that a ray enters have nothing that it hits.
const Matrix& known_world(Context& context);
// HitPacket::magnitude for a point of the current space.
float magnitude_at(Context& context, const Vec3f& p);

// ---- presence
// Filter of what is there for some rays alone: turns down what is not there for this one.
void presence_filter(const RTCFilterFunctionNArguments* args);

// ---- solids
// What a ray crosses, and where moving parts of solids are as it does.
struct Crossings {
    struct Place {
        const Geometry* geometry;
        Matrix world_from_shape;
        float magnitude;
        int32_t variation;
    };
    std::vector<Crossing> all;
    std::vector<Place> places;
    int depth; // of the group that has the tree
};
// Filter of what bounds solids: takes the crossing down and lets the ray go on.
void note_crossing(const RTCFilterFunctionNArguments* args);
// The nearest boundary of a group's solids; false = none up to the ray's end. The ray is in the group's
// space.
class SolidHit {
  public:
    bool find(const Group& group, Context& context, const RTCRay& ray);
    float t() const { return m_hit->t; }
    void put(Context& context, unsigned ray_id, RTCHit& hit) const;

  private:
    // All of them from the ray's start on, in order.
    void gather(const Group& group, Context& context, RTCRayHit rh, Crossings& crossings);

    Crossings m_crossings;
    const Crossing* m_hit = nullptr;
};
// Of one group with all that is in it, for one ray.
void intersect_group(const Group& group, Context& context, RTCRayHit& rh);
void occluded_group(const Group& group, Context& context, RTCRay& ray);
RTCBounds bounds_of(const Group& group);

// Callbacks of the user geometry that places groups.
void instance_bounds(const RTCBoundsFunctionArguments* args);
void instance_intersect(const RTCIntersectFunctionNArguments* args);
void instance_occluded(const RTCOccludedFunctionNArguments* args);
// Bounds at even times for instances that move, and at how many.
void bound_paths(Instances& in);

} // namespace kanuka::bvh
