// What of a scene is to lie in pages, as far as the scene as a whole decides it.
#pragma once

#include <span>
#include <vector>

#include "bvh/bvh.h"

namespace kanuka::bvh {

// From a group's shapes and instances page_scene.h takes up to three parts.
enum class Part {
    Plain,    // what bounds no solid
    Surfaces, // of the group's solids
    Whole     // all of it, which bounds solids of the group that it is placed in
};

struct PagePlan {
    struct View {
        size_t group;
        Part part;
    };
    PagesFrom least;               // as asked for, but for what many instances change
    std::vector<uint64_t> bytes;   // of places of each group: the most in one other
    std::vector<View> views;       // what is reached, after what it needs: the world's plain part is the last
    bool holds_solids = false;     // surfaces that bound some lie in pages, too
    bool fits(size_t group) const; // places of it do

    PagePlan(const store::Store& store, std::span<const GroupDesc> groups, const PagesFrom& asked);

  private:
    class Reached;
    bool can_hold_solids(const store::Store& store, std::span<const GroupDesc> groups,
                         const Reached& reached) const;
};

} // namespace kanuka::bvh
