// Splits runs of boxes in two by the surface area heuristic, over 16 bins an axis [Wald 2007, "On fast
// construction of SAH-based bounding volume hierarchies"]. Sums run in a fixed order: what comes out depends
// on the boxes alone.
#pragma once

#include <bit>
#include <cfloat>
#include <cstdint>

#include "base/large_pages.h"
#include "base/vec.h"

namespace kanuka::hierarchy {

// Four floats at once; the last belongs to no box, and is never looked at.
typedef float Float4 __attribute__((vector_size(16)));
inline Float4 lower(Float4 a, Float4 b) {
    return a < b ? a : b;
}
inline Float4 upper(Float4 a, Float4 b) {
    return a > b ? a : b;
}

// A box and what it is of, in half a line of the cache.
struct Item {
    Float4 lo, hi; // the number lies in the last of both

    Item() {} // what it is of is written once, and not before
    Item(const Bounds3f& b, uint32_t index)
        : lo{b.lo.x, b.lo.y, b.lo.z, holder(index & LowMask)},
          hi{b.hi.x, b.hi.y, b.hi.z, holder(index >> LowBits)} {}
    uint32_t index() const {
        return (std::bit_cast<uint32_t>(hi[3]) & LowMask) << LowBits |
               (std::bit_cast<uint32_t>(lo[3]) & LowMask);
    }
    Float4 twice_centre() const { return lo + hi; }
    Bounds3f bounds() const { return {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}}; }

  private:
    // Floats from 1 to 2: all boxes are worked on four floats at a time, and what is no normal number would
    // be slow.
    static constexpr int LowBits = 16;
    static constexpr uint32_t LowMask = (1u << LowBits) - 1;
    static float holder(uint32_t bits) { return std::bit_cast<float>(0x3f800000u | bits); }
};
static_assert(sizeof(Item) == 32);

struct Box4 {
    Float4 lo{FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX}, hi{-FLT_MAX, -FLT_MAX, -FLT_MAX, -FLT_MAX};

    void extend(Float4 from, Float4 to) { lo = lower(lo, from), hi = upper(hi, to); }
    void extend(const Item& i) { extend(i.lo, i.hi); }
    void extend(const Box4& b) { extend(b.lo, b.hi); }
    float half_area() const {
        const Float4 d = hi - lo;
        return d[0] < 0 ? 0 : d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
    }
    Bounds3f bounds() const { return {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}}; }
};

// Cuts all items into runs of at most `most`, in parallel: the leaves of a tree whose inner nodes are the
// splits.
struct SplitTree {
    struct Branch {
        uint32_t begin, end; // items
        int32_t left, right; // branches; -1 = a leaf
        uint32_t leaves;     // below
        int32_t height;      // of the branches below
        float lo[3], hi[3];
        float half_area;

        Branch() {} // all are written at once, and not before
        Branch(uint32_t begin, uint32_t end, const Box4& box)
            : begin(begin), end(end), left(-1), right(-1), leaves(1), height(0),
              lo{box.lo[0], box.lo[1], box.lo[2]}, hi{box.hi[0], box.hi[1], box.hi[2]},
              half_area(box.half_area()) {}
        Bounds3f box() const { return {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}}; }
        void set_children(int32_t at, const Branch& a, int32_t then, const Branch& b) {
            left = at, right = then;
            leaves = a.leaves + b.leaves;
            height = (a.height > b.height ? a.height : b.height) + 1;
        }
    };
    LargeVector<Branch> branches; // the first is the root; left and right come after their parent
    LargeVector<Item> items;      // in order of the leaves
};
SplitTree split_all(LargeVector<Item> items, uint32_t most);

} // namespace kanuka::hierarchy
